"""The guide's example of uncertain variables is a valid study."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from damagepred.campaign.sample import joint_places
from damagepred.study import Study
from tests.guide.pages import WRITTEN, blocks


def test_the_example_can_be_sampled(tmp_path: Path) -> None:
    example, measured = blocks(WRITTEN["uncertainty"])[:2]
    (tmp_path / "house.toml").write_text(example.text)
    (tmp_path / "shear_tests.csv").write_text(measured.text)
    study = Study.from_toml(tmp_path / "house.toml")
    assert set(study.settings.variables) == set(tomllib.loads(example.text)["variables"])
    places = joint_places(study.settings.scene)
    drawn = [study.design.joint_values(i, places) for i in range(300)]
    strength, cohesion = (np.array([d[f"joint.{n}"] for d in drawn]) for n in ("tensile_strength", "cohesion"))
    assert np.unique(cohesion).tolist() == pytest.approx([0.29e6, 0.31e6, 0.35e6, 0.42e6, 0.51e6])
    assert np.corrcoef(strength.ravel(), cohesion.ravel())[0, 1] == pytest.approx(0.7, abs=0.03)
    assert strength.mean() == pytest.approx(0.95 * 0.453e6 + 0.05 * 0.226e6, rel=0.03)
