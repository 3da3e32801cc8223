"""Templates of ``damagepred new``: what they sample, and the files beside them."""

import tomllib
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from damagepred.analyses.stored_walls import require_on
from damagepred.campaign.sample import joint_places
from damagepred.campaign.settings import StudySettings
from damagepred.campaign.template import Template, write_template
from damagepred.errors import InputError
from damagepred.scene.what_moves import what_moves
from damagepred.study import Study
from damagepred.uq.observations import Observations
from tests.guide.pages import WRITTEN, blocks

MOVES = {
    "tree": "The left end of the ground goes down by 25 mm, to nothing 3 m from that end; drying clay, 5000 kPa/m",
    "end-settlement": "The left end of the ground goes down by 25 mm, to nothing 3 m from that end; soil, 5000 kPa/m",
    "survey": "The left end of the ground goes down by 60 mm, to nothing 4 m from that end; drying clay, 5000 kPa/m",
}


@pytest.mark.parametrize("name", [name for name in get_args(Template) if name != "house"])  # a scene, no study
def test_each_template_samples_the_batch_of_its_mortar(name: Template, tmp_path: Path) -> None:
    write_template(tmp_path / "house.toml", name)
    settings = StudySettings.from_toml(tmp_path / "house.toml")
    assert settings.variables["joint.strength_factor"].field is None
    assert settings.variables["joint.tensile_strength"].field is not None
    if name in MOVES:
        assert what_moves(settings.mean_wall()[0]) == MOVES[name]


def test_the_soil_log_has_its_surface_movement_by_hand(tmp_path: Path) -> None:
    write_template(tmp_path / "log.toml", "soil-log")
    scene = StudySettings.from_toml(tmp_path / "log.toml").scene
    # alpha is 1 in the cracked upper half of H_s = 2.3 m and 2 - z / 5 below; suction falls from 1.2 pF to 0 at H_s
    z = (0.5 + np.arange(23000)) * 1e-4
    strain = np.where(z < 0.4, 0.01, np.where(z < 1.6, 0.04, 0.03))
    rise = strain * np.where(z < 1.15, 1.0, 2.0 - z / 5.0) * 1.2 * (1.0 - z / 2.3) * 1e-4
    assert scene.mound.surface_movement == pytest.approx(rise.sum(), rel=1e-4)
    assert scene.loads.roof == pytest.approx(24e3)


def test_a_survey_comes_with_its_observations(tmp_path: Path) -> None:
    files = write_template(tmp_path / "house.toml", "survey")
    assert [file.name for file in files] == ["house.toml", "house_observations.toml"]
    observed = Observations.from_toml(files[1])
    assert (len(observed.crack), len(observed.level), len(observed.dates)) == (3, 8, 2)
    assert all(crack.width for crack in observed.crack)
    require_on(observed, StudySettings.from_toml(files[0]).scene, "the template")
    (tmp_path / "house.toml").unlink()
    with pytest.raises(InputError, match=r"house_observations\.toml: exists and was not changed"):
        write_template(tmp_path / "house.toml", "survey")


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
