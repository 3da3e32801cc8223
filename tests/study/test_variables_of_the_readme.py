"""The README's example of what is uncertain is a study that can be drawn."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from damagepred.study import Study
from damagepred.study.campaign.sample import joint_places
from tests.conftest import ROOT


def test_the_example_can_be_drawn(tmp_path: Path) -> None:
    section = (ROOT / "README.md").read_text().split("## What is uncertain")[1]
    example = re.search(r"```toml\n(.*?)```", section, re.DOTALL)
    assert example is not None
    (tmp_path / "house.toml").write_text("[scene.wall]\nlength = 2.4\nheight = 0.9\n" + example[1])
    (tmp_path / "shear_tests.csv").write_text("test,cohesion\n1,0.31\n2,0.42\n3,0.35\n4,0.29\n5,0.51\n")
    study = Study.from_toml(tmp_path / "house.toml")
    assert set(study.settings.variables) == set(tomllib.loads(example[1])["variables"])
    places = joint_places(study.settings.scene)
    drawn = [study.design.joint_values(i, places) for i in range(300)]
    strength, cohesion = (np.array([d[f"joint.{n}"] for d in drawn]) for n in ("tensile_strength", "cohesion"))
    assert np.unique(cohesion).tolist() == pytest.approx([0.29e6, 0.31e6, 0.35e6, 0.42e6, 0.51e6])
    assert np.corrcoef(strength.ravel(), cohesion.ravel())[0, 1] == pytest.approx(0.7, abs=0.03)
    assert strength.mean() == pytest.approx(0.95 * 0.453e6 + 0.05 * 0.226e6, rel=0.03)
