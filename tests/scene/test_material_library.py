"""Masonry by name: values under the user's own, scatter, correlation, and where the report says they come from."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from damagepred import InputError, Joint, Scene, solve
from damagepred.campaign.settings import StudySettings
from damagepred.inputs.data_files import CONFIDENCE
from damagepred.scene import masonry_library

DUTCH = "clay brick, Dutch, 1940s"
JOINTS = f"{DUTCH}, joints"
ENERGIES = ("fracture_energy", "shear_fracture_energy")


@pytest.mark.parametrize("name", list(masonry_library()))
def test_every_material_makes_a_wall(name: str) -> None:
    scene, library = Scene.from_dict({"material": name}), masonry_library()[name]
    for place, value in library.values.items():
        assert scene.numbers[place] == value.mean
        assert value.confidence in CONFIDENCE
        assert (value.cov is None) == (value.cov_confidence == "")
    assert all(place in library.values for pair in library.correlation for place in pair)
    assert library.source
    assert library.description
    assert library.calibrated_on
    assert Scene.from_dict(scene.to_dict()) == scene


def test_beds_heads_and_batch_of_a_micro_model_belong_together() -> None:
    scene = Scene.from_dict({"material": JOINTS})
    assert (scene.joint.tensile_strength, scene.joint.cohesion, scene.joint.shear_fracture_energy) == (9e4, 9e4, 75.3)
    assert scene.heads.tensile_strength == pytest.approx(0.05e6, rel=1e-3)
    assert scene.heads.fracture_energy == pytest.approx(4.99, rel=1e-3)
    weaker = Scene.from_dict({"material": JOINTS, "joint": {"cohesion": 6e4}, "head_joint": {"tensile_strength": 2e4}})
    assert (weaker.heads.tensile_strength, weaker.heads.cohesion) == (2e4, pytest.approx(0.556 * 6e4))
    for name, batch in ((JOINTS, 0.30), ("calcium silicate brick, Dutch", 0.08)):
        tables = {"scene": {"material": name}, "study": {"samples": 512, "material_scatter": True}}
        factor = StudySettings.from_dict(tables, source="study").design().wall_values(512)["joint.strength_factor"]
        assert factor.std() / factor.mean() == pytest.approx(batch, rel=0.05)


@pytest.mark.parametrize(
    ("tables", "value"),
    [
        ({"joint": {"compressive_strength": "none"}}, lambda s: s.joint.compressive_strength),
        ({"joint": dict.fromkeys(ENERGIES, "none")}, lambda s: s.joint.fracture_energy),
        ({"joint": {"brittle_shear": True, "shear_fracture_energy": "none"}}, lambda s: s.joint.shear_fracture_energy),
        ({"head_joint": "none"}, lambda s: s.head_joint),
        ({"head_joint": {"factor": "none"}}, lambda s: s.head_joint.factor),
    ],
)
def test_a_value_of_the_library_can_be_taken_away_and_stays_away(tables: dict, value: Callable) -> None:
    for name in (DUTCH, JOINTS) if "joint" in tables else (JOINTS,):
        scene = Scene.from_dict({"material": name} | tables)
        assert value(scene) is None
        assert Scene.from_dict(scene.to_dict()) == scene
        study = StudySettings.from_dict({"scene": {"material": name} | tables}, source="study")
        assert value(StudySettings.from_dict(study.to_dict(), source="study").scene) is None


def test_in_python_as_in_a_file() -> None:
    assert Scene(material=DUTCH) == Scene.from_dict({"material": DUTCH})
    assert Scene(material=DUTCH, joint=Joint()).joint == Joint()  # a whole table is given


def test_a_wrong_name_is_answered_by_the_names() -> None:
    with pytest.raises(InputError, match="Did you mean 'clay brick, Dutch, 1940s'"):
        Scene.from_dict({"material": "clay brick, Dutch, 1950s"})


def test_a_study_samples_the_scatter_of_the_library() -> None:
    tables = {
        "scene": {"material": DUTCH, "joint": {"tensile_strength": "0.2 MPa"}},
        "study": {"samples": 512, "material_scatter": True},
        "variables": {"joint.friction": {"distribution": "uniform", "lower": 0.6, "upper": 0.8}},
    }
    settings = StudySettings.from_dict(tables, source="study")
    values = settings.design().wall_values(512)
    assert set(values) == {
        "joint.friction",
        "joint.tensile_strength",
        "joint.cohesion",
        "joint.normal_stiffness",
        "joint.shear_stiffness",
    }
    strength = values["joint.tensile_strength"]
    assert strength.mean() == pytest.approx(0.2e6, rel=0.01)  # about the value of the scene
    assert strength.std() / strength.mean() == pytest.approx(0.3, rel=0.05)
    assert values["joint.friction"].max() <= 0.8
    logs = np.log([values["joint.normal_stiffness"], values["joint.shear_stiffness"]])
    assert np.corrcoef(logs)[0, 1] == pytest.approx(0.8, abs=0.03)
    again = StudySettings.from_dict(settings.to_dict(), source="study")
    assert again.variables == settings.variables


def test_scatter_needs_a_material() -> None:
    with pytest.raises(InputError, match=r"material_scatter: needs scene\.material"):
        StudySettings.from_dict({"scene": {}, "study": {"material_scatter": True}}, source="study")


def test_the_compressive_strength_of_the_library_acts_on_nothing_that_is_far_from_it() -> None:
    wall = {"wall": {"length": 1.1, "height": 0.6, "block_length": 0.22, "block_height": 0.06}}
    pushed = {"control": "displacement", "displacement": "0.6 mm", "beam": "level"}
    test = {"movement": {"shape": "loads", "increments": 4}, "load": [{"direction": "along"}], "loading": pushed}
    scene = Scene.from_dict(
        {"material": DUTCH, "loads": {"roof": "30 kN"}, **wall, **test, "solver": {"blocks": "rigid"}}
    )
    assert scene.joint.compressive_strength == 12.9e6
    capped, free = solve(scene), solve(replace(scene, joint=replace(scene.joint, compressive_strength=None)))
    assert capped["crack_width_max"].values[-1] > 1e-5
    assert float(capped["contact_normal_stress"].min()) < 0.0
    for name in ("crack_width_max", "contact_opening", "contact_normal_stress", "newton_iterations"):
        np.testing.assert_array_equal(capped[name].values, free[name].values)
