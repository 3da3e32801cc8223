"""Results that cannot be right are refused where the input shows it, and marked where only the result does."""

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
import tomli_w

import damagepred
from damagepred import NO_LIMITS, InputError, Joint, Scene, Wall, solve
from damagepred.archive.files import read_dataset
from damagepred.archive.versions import with_defaults_of
from damagepred.campaign.settings import StudySettings, read_frozen
from damagepred.scene.described import build
from damagepred.scene.plausibility import unlikely_values
from damagepred.scene.scene import archived_scene
from tests.cli.conftest import Run, command

__all__ = ["command"]

SOFT = "[wall]\nlength = 1.2\nheight = 0.6\n[movement]\nincrements = 2\n[joint]\nnormal_stiffness = 2e5\n"

IMPOSSIBLE = {
    "a strength in MPa": (
        {"joint": {"tensile_strength": 0.453}},
        "joint.tensile_strength = 0.453 Pa: must be 0, or at least 10 Pa. Did you mean '0.453 MPa'?",
    ),
    "a residual strength in MPa": ({"joint": {"residual_cohesion": 0.2}}, "Did you mean '0.2 MPa'?"),
    "a cap in MPa": ({"joint": {"compressive_strength": 12}}, "Did you mean '12 MPa'?"),
    "a head joint in MPa": ({"head_joint": {"tensile_strength": 0.1}}, "Did you mean '0.1 MPa'?"),
    "a stiffness in N/mm3": (
        {"joint": {"normal_stiffness": 82.9}},
        "= 82.9 Pa/m: must be 0, or at least 10000 Pa/m. Did you mean '82.9 N/mm3'?",
    ),
    "a modulus in MPa": ({"block": {"elastic_modulus": 7000}}, "Did you mean '7000 MPa'?"),
    "a modulus in GPa": ({"block": {"elastic_modulus": 7}}, "Did you mean '7 GPa'?"),
    "a weight for a density": ({"block": {"density": 19}}, "least 50 kg/m3. Did you mean '1937 kg/m3'?"),
    "a weight in N/m3": ({"block": {"density": 19000}}, "at most 12000 kg/m3. Did you mean '1937 kg/m3'?"),
    "a density in t/m3": ({"block": {"density": 1.9}}, "Did you mean '1900 kg/m3'?"),
    "an angle of friction": (
        {"dpc": {"friction": 36.9}},
        "dpc.friction = 36.9: must be at most 5. Did you mean 0.75, the tangent of 36.9 degrees?",
    ),
    "an angle of the soil": ({"soil": {"friction": 25}}, "Did you mean 0.47, the tangent of 25 degrees?"),
    "soil in kPa/m": ({"soil": {"swelling_stiffness": 4000}}, "Did you mean '4000 kPa/m'?"),
    "a depth in mm": ({"mound": {"suction_depth": 2300}}, "must be at most 300 m. Did you mean '2300 mm'?"),
    "a tree in mm": (
        {"movement": {"shape": "mound"}, "mound": {"shape": "tree", "position": -9000, "reach": 12}},
        "Did you mean '-9000 mm'?",
    ),
    "a bearing in mm": (
        {"opening": [{"x": 2.0, "y": 0.9, "width": 0.9, "height": 1.0, "lintel_bearing": 120}]},
        "Did you mean '120 mm'?",
    ),
    "an edge in mm": ({"movement": {"shape": "mound"}, "mound": {"edge_distance": 1200}}, "Did you mean '1200 mm'?"),
    "a gap in mm": ({"control_joint": [{"x": 3.0, "width": 10}]}, "Did you mean '10 mm'?"),
}


@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_an_impossible_number_is_refused(name: str) -> None:
    """Not in archives, which stay readable."""
    tables, words = IMPOSSIBLE[name]
    with pytest.raises(InputError) as refused:
        Scene.from_dict(tables)
    assert str(refused.value).endswith(words)
    assert archived_scene({"scene": tomli_w.dumps(tables)}) == build(Scene, tables, "scene")
    study = tomli_w.dumps({"scene": tables})
    with pytest.raises(InputError, match="Did you mean"):
        StudySettings.from_dict(tomllib.loads(study))
    assert read_frozen(study).scene == build(Scene, with_defaults_of(0, tables), "scene")


UNLIKELY = {
    "a strength": ({"joint": {"tensile_strength": 45.3}}, "joint.tensile_strength = 45.3 Pa: did you mean '45.3 MPa'?"),
    "a load in kN": ({"loads": {"roof": 6}}, "loads.roof = 6 N: did you mean '6 kN'?"),
    "soft soil": ({"soil": {"swelling_stiffness": 4e4}}, "did you mean '40000 kPa/m'?"),
    "a swing in mm": (
        {"movement": {"seasons": {"years": 2, "swing": 0.4}}, "wall": {"length": 10}},
        "movement.seasons.swing = 0.4 m: did you mean '0.4 mm'?",
    ),
    "a deep soil": ({"mound": {"suction_depth": 40}}, "mound.suction_depth = 40 m: did you mean '40 mm'?"),
}


def test_scenes_made_in_python_are_refused_alike() -> None:
    """Also where ``replace`` has put an impossible value, as ``solve`` reads it; sampled walls are taken."""
    with pytest.raises(InputError, match=r"Scene: joint.friction = 36.9: must be at most 5. Did you mean 0.75"):
        Scene(joint=Joint(friction=36.9))
    changed = replace(Scene(wall=Wall(length=0.48, height=0.15)), joint=Joint(friction=36.9))
    with pytest.raises(InputError, match=r"scene: joint.friction = 36.9"):
        solve(changed, increments=1)
    assert solve(changed, increments=1, limits=NO_LIMITS).attrs["status"] == "complete"


@pytest.mark.parametrize("name", UNLIKELY)
def test_an_unlikely_number_is_asked_back(name: str) -> None:
    tables, words = UNLIKELY[name]
    (said,) = unlikely_values(Scene.from_dict(tables))
    assert said.endswith(words)


@pytest.mark.thorough
def test_means_of_a_study_are_asked_back(command: Run, tmp_path: Path) -> None:
    (tmp_path / "house.toml").write_text(
        "[study]\nsamples = 2\n[scene.wall]\nlength = 1.2\nheight = 0.3\n[scene.movement]\nincrements = 1\n"
        '[variables."joint.cohesion"]\ndistribution = "normal"\nmean = 37.5\ncov = 0.1\n'
    )
    asked = "caution: joint.cohesion = 37.5 Pa: did you mean '37.5 MPa'?"
    other = "caution: variable joint.cohesion: mean 37.5 Pa, the scene has 0.375 MPa by default; samples follow the"
    for name in ("check", "solve", "study"):
        said = command(name, tmp_path / "house.toml").out
        assert asked in said, name
        assert other in said, name


@pytest.mark.parametrize("name", ["check", "solve", "study", "rare"])
def test_impossible_means_are_refused(command: Run, tmp_path: Path, name: str) -> None:
    (tmp_path / "house.toml").write_text(
        '[scene.wall]\nlength = 1.2\n[variables."joint.friction"]\ndistribution = "normal"\nmean = 36.9\ncov = 0.1\n'
        '[variables."joint.cohesion"]\ndistribution = "normal"\nmean = "0.453"\ncov = 0.1\n'
    )
    more = {"rare": ("--category", 2, "--at", "8 mm")}
    refused = command(name, tmp_path / "house.toml", *more.get(name, ()))
    assert refused.code == 2
    assert '"joint.friction"]: mean of joint.friction = 36.9: must be at most 5. Did you mean 0.75' in refused.err
    assert "joint.cohesion = 0.453 Pa: must be 0, or at least 10 Pa. Did you mean '0.453 MPa'?" in refused.err


def test_a_wall_that_sinks_is_marked(command: Run, tmp_path: Path) -> None:
    """On the screen, in the archive and in the report."""
    file, archive, page = tmp_path / "wall.toml", tmp_path / "wall.nc", tmp_path / "wall.html"
    file.write_text(SOFT, encoding="utf-8")
    solved = command("solve", file, "-o", archive)
    assert "displacement_tolerance = 0.05" in solved.out + solved.err
    ds = read_dataset(archive)
    assert ds.attrs["implausible"] == 1
    assert ds.attrs["displacement_share"] > 0.05
    assert command("report", archive, "-o", page).code == 0
    assert "the result is implausible" in page.read_text(encoding="utf-8")


@pytest.mark.thorough
def test_walls_of_a_study_are_marked(command: Run, tmp_path: Path) -> None:
    file, folder = tmp_path / "study.toml", tmp_path / "study.dp"
    file.write_text("[study]\nsamples = 2\n" + SOFT.replace("[", "[scene."), encoding="utf-8")
    run = command("study", file, "-o", folder)
    assert "In 2 walls the largest displacement" in run.out + run.err
    assert damagepred.open_study(folder).implausible.values.tolist() == [1, 1]
    assert "the result is implausible" in command("status", folder).out
