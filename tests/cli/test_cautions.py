"""What a run says of itself: energy that does not balance, and joints whose bond could not soften."""

from pathlib import Path

import numpy as np
import pytest

from damagepred.archive.cautions import energy_error_share, wall_cautions
from damagepred.archive.files import read_dataset
from damagepred.archive.folder import open_study
from damagepred.study.settings import StudySettings
from tests.cli.conftest import Run

SCENE = """
[{0}wall]
length = 1.2
height = 0.45
thickness = 0.11
[{0}dpc]
course = 2
friction = 0.1
[{0}movement]
central_deflection = "3 mm"
increments = 3
[{0}joint]
{1}
[{0}solver]
energy_tolerance = {2}
"""
TOO_LITTLE = "fracture_energy = 5.0\nshear_fracture_energy = 0.5"
UNBALANCED, SNAP_BACK = "more than energy_tolerance", "(snap-back)"


def test_the_share_is_of_the_largest_work() -> None:
    values = {
        "energy_error": np.array([0.0, 0.1, -0.3, np.nan]), "external_work": np.array([1.0, 2.0, 3.0, np.nan]),
        "friction_work": np.array([0.0, 4.0, 1.0, np.nan]), "kinetic_energy": np.array([0.0, 6.0, 0.0, 0.0]),
    }  # fmt: skip
    assert energy_error_share(values) == pytest.approx(0.3 / 6.0)
    assert np.isnan(energy_error_share({"energy_error": np.full(3, np.nan), "external_work": np.ones(3)}))


@pytest.mark.parametrize(("joint", "tolerance"), [("", 1.0), (TOO_LITTLE, 1e-12)])
def test_a_wall_says_what_must_be_known(command: Run, tmp_path: Path, joint: str, tolerance: float) -> None:
    """On the screen of solve and check, in the archive and in the report; nothing where there is nothing to say."""
    file, archive, page = tmp_path / "wall.toml", tmp_path / "wall.nc", tmp_path / "wall.html"
    file.write_text(SCENE.format("", joint, tolerance))
    solved = command("solve", file, "-o", archive)
    assert solved.code == 0, solved.err
    said = solved.out, command("check", file).out
    assert command("report", archive, "-o", page).code == 0
    ds = read_dataset(archive)
    last = {name: abs(ds[name].values).max() for name in ("energy_error", "external_work", "elastic_energy")}
    assert 0 < ds.attrs["energy_error_share"] <= last["energy_error"] / last["external_work"] * (1 + 1e-12)
    assert ds.attrs["energy_tolerance"] == tolerance
    for text in (*said, page.read_text()):
        for words in (UNBALANCED, SNAP_BACK):
            assert (words in text) == bool(joint), words
    bonds = len(np.unique(ds["contact_joint"].values[ds["contact_cohesion"].values > 0]))
    assert ds.attrs["snap_back_limited_joints"] == (bonds if joint else 0)
    assert len(wall_cautions(ds)) == (2 if joint else 0)


@pytest.mark.parametrize(("joint", "tolerance"), [("", 1.0), (TOO_LITTLE, 1e-12)])
def test_a_study_says_what_must_be_known(command: Run, tmp_path: Path, joint: str, tolerance: float) -> None:
    file, folder, page = tmp_path / "study.toml", tmp_path / "study.dp", tmp_path / "study.html"
    study = '[study]\nsamples = 2\n[variables."dpc.friction"]\ndistribution = "uniform"\nlower = 0.05\nupper = 0.1\n'
    file.write_text(study + SCENE.format("scene.", joint, tolerance))
    assert StudySettings.from_toml(file).scene.solver.energy_tolerance == tolerance
    ran = command("study", file, "-o", folder)
    assert ran.code == 0, ran.err
    assert command("report", folder, "-o", page).code == 0
    ds = open_study(folder)
    assert (ds["energy_error_share"].values > 0).all()
    assert (ds["snap_through_share"].values < 0.05).all()
    assert ds["snap_through_share"].attrs["tolerance"] == 0.05
    assert ((ds["snap_back_limited"].values > 0) == bool(joint)).all()
    for text in (ran.out, command("status", folder).out, page.read_text()):
        for words in (UNBALANCED, SNAP_BACK):
            assert (words in text) == bool(joint), words
