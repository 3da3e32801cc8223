"""Epistemic uncertainty from the stored walls, beside the Monte Carlo error."""

import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from damagepred.analyses.epistemic import _changed, alternatives
from damagepred.campaign.settings import StudySettings
from damagepred.cli.sentences import estimate_lines
from damagepred.errors import InputError
from damagepred.study import Study
from tests.conftest import SMALL_STUDY

TINY = SMALL_STUDY.replace("length = 1.44", "length = 0.96").replace("increments = 6", "increments = 3")


def test_alternatives_are_estimated_beside_the_study(tmp_path: Path) -> None:
    tables = tomllib.loads(TINY)
    tables["study"] |= {"samples": 16, "epistemic": {"rougher": {"joint.friction": {"mean": 0.8}}, "same": {}}}
    with ThreadPoolExecutor(2) as executor:
        Study(StudySettings.from_dict(tables)).run(tmp_path / "s.dp", executor=executor)
    own, rougher, same = alternatives(tmp_path / "s.dp", 1, 6e-3)
    assert (own.name, rougher.name, same.name) == ("", "rougher", "same")
    assert same.found.estimate.value == pytest.approx(own.found.estimate.value)
    assert same.effective_samples == pytest.approx(16)
    assert 4 < rougher.effective_samples < 16
    said = "\n".join(estimate_lines([own, rougher, same], 1, 6e-3))
    assert "Monte Carlo error" in said
    assert "epistemic range of the inputs" in said


def test_what_is_no_alternative() -> None:
    settings = StudySettings.from_dict(tomllib.loads(TINY))
    with pytest.raises(InputError, match="are separate studies"):
        _changed(settings, "a", {"joint.cohesion": {"cov": 0.1}})
    with pytest.raises(InputError, match="covv"):
        _changed(settings, "a", {"joint.friction": {"covv": 0.1}})
