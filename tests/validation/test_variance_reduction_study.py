"""The study of what Sobol points and coarse walls save: its measure where the answer is known, and its small form."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from damagepred.uq.samplers import unit_points
from tests.conftest import ROOT

STUDY = ROOT / "studies" / "variance_reduction" / "run.py"


def test_the_measure_of_what_is_saved() -> None:
    saved = runpy.run_path(str(STUDY))["saved"]
    label = np.arange(64 * 32) % 64
    random = [saved(np.random.default_rng(s).standard_normal(len(label)), label) for s in range(200)]
    assert 0.83 < np.mean([r["lower"] < 1 < r["upper"] for r in random]) < 0.96
    points = unit_points("sobol", 2, len(label), 1, replicates=64)
    smooth = saved(points.sum(axis=1), label)
    assert smooth["lower"] > 100
    # a third of the variance is noise that no points even out: three walls for one
    noise = np.random.default_rng(2).standard_normal(len(label)) * np.sqrt(0.5 * points.sum(axis=1).var())
    partly = saved(points.sum(axis=1) + noise, label)
    assert partly["ratio"] == pytest.approx(3, rel=0.5)


def test_the_share_of_what_pairs_have_in_common() -> None:
    random = np.random.default_rng(3)
    common = random.standard_normal(400)
    pairs = [np.sqrt(0.7) * common + np.sqrt(0.3) * random.standard_normal(400) for _ in range(2)]
    found = runpy.run_path(str(STUDY))["common_share"](*pairs)
    assert found["lower"] < 0.7 < found["upper"]
    assert found["gain at most"] == pytest.approx(1 / 0.3, rel=0.25)


@pytest.mark.slow
def test_the_small_form_runs(tmp_path: Path) -> None:
    study = runpy.run_path(str(STUDY))
    settings = study["settings_of"]("small")
    gained = study["sobol"](settings, "small", tmp_path / "sobol.dp", 4, 4, 1)
    beside = study["coarse_walls"](settings, "small", tmp_path, 12, 1)
    shared = study["split"](settings, "small", tmp_path, 6, 1)
    assert len(gained)
    assert shared["share"].between(-1, 1).all()
    assert set(beside["coarse wall"]) == set(study["COARSE"])
    assert beside["correlation"].between(-1, 1).all()
