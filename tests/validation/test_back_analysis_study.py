"""The studies of back-analysis: scores by hand, and a small run."""

import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from damagepred.analyses.inference_options import InferenceOptions
from tests.validation.test_validation_cases import module

STUDY = Path(__file__).resolve().parents[2] / "studies" / "back_analysis"


@pytest.fixture
def synthetic(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    for name in ("judging", "synthetic"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setattr(sys, "path", [str(STUDY), *sys.path])
    return module("synthetic", STUDY / "synthetic.py")


def test_the_promised_area_is_that_of_right_probabilities(synthetic: ModuleType) -> None:
    assert synthetic.promised_area(np.full(5, 0.3)) == pytest.approx(0.5)
    assert synthetic.promised_area(np.array([0.0, 0.0, 1.0])) == pytest.approx(1.0)
    # two values: (p of the lower, higher) = (0.2, 0.6); true above other 0.6 * 0.8 + ties, over 0.8 * 1.2
    assert synthetic.promised_area(np.array([0.2, 0.6])) == pytest.approx((0.6 * 0.8 + 0.5 * (0.16 + 0.24)) / 0.96)
    random = np.random.default_rng(2)
    probability = random.beta(0.5, 0.7, 40_000)
    true = random.uniform(size=40_000) < probability
    promised = synthetic.promised_area(probability)
    assert synthetic.area(probability, true) == pytest.approx(promised, abs=0.01)
    blurred = np.clip(probability + 0.3 * random.standard_normal(40_000), 0.0, 1.0)
    assert synthetic.area(blurred, true) < promised - 0.02  # no other score does better


@pytest.mark.thorough
def test_a_small_run_infers_the_causes(synthetic: ModuleType, tmp_path: Path) -> None:
    run = module("back_analysis_run", STUDY / "run.py")
    study = tmp_path / "study.toml"
    text = (STUDY / "study.toml").read_text(encoding="utf-8")
    study.write_text(
        text.replace("1.92 m", "0.96 m").replace("0.6 m", "0.3 m").replace("increments = 12", "increments = 4")
    )
    stored = synthetic.archives(study, run.KINDS, tmp_path / "stored", 6, 1, 1)
    unseen = synthetic.archives(study, run.KINDS, tmp_path / "unseen", 2, 2, 1)
    survey = synthetic.Survey(((0.24, 0.1), (0.48, 0.1)), ((0.48, 0.0375), (0.12, 0.0375)))
    cases = list(synthetic.infer_cases(stored, unseen, survey, InferenceOptions(replays=6), [1, 2]))
    assert [case.cause for case in cases] == [0, 0, 1, 1] * 2
    assert all(case.probability.sum() == pytest.approx(1.0) for case in cases)
    found = run.scores(cases, 2)
    assert len(found["coverage_90_of_each_survey"]) == 2
    assert found["cases"] == 8
    page = run.page_text({"cracks": {**found, "stored_walls": 6}})
    assert page.startswith("| 8 cases: 4 walls, 2 surveys each | measured | expected |")
    assert "| cracks | 6 | 8 |" in page
