"""Cautions of a run: energy errors, and joints whose bond could not soften."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred.archive.cautions import study_cautions, wall_cautions
from damagepred.archive.folder import open_study
from damagepred.campaign.settings import StudySettings
from damagepred.enumerations import ContactKind, ContactState
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
INTACT, CRACKED, SLIPPING = ContactState
BED, HEAD, DPC, *_ = ContactKind
UNBALANCED, SNAP_BACK = "more than energy_tolerance", "(snap-back)"


def test_every_number_of_a_caution() -> None:
    """Of a wall, and counted over those of a study; what is not beyond its limit is not said."""
    shares = {"energy_error_share": 0.03, "energy_tolerance": 0.02, "snap_through_share": 0.07}
    wall = xr.Dataset(attrs=shares | {"snap_through_tolerance": 0.05, "snap_back_limited_joints": 9})
    energy, snap_through, bonds = wall_cautions(wall)
    assert energy.startswith("Energy that does not balance is 0.03 of the largest work done, more than energy_toleran")
    assert "energy_tolerance = 0.02: the steps" in energy
    assert "snap-through is 0.07 of the largest work done, more than snap_through_tolerance = 0.05: no" in snap_through
    assert bonds.startswith("In 9 joints the bond breaks at once: fracture_energy")
    assert wall_cautions(wall.assign_attrs(energy_tolerance=0.03, snap_back_limited_joints=0)) == [snap_through]
    assert wall_cautions(wall.assign_attrs(snap_through_tolerance=0.07)) == [energy, bonds]
    both = ("increment", "contact")
    state = [[INTACT, INTACT, CRACKED, INTACT, INTACT], [INTACT, CRACKED, CRACKED, SLIPPING, CRACKED]]
    explicit = xr.Dataset(
        {"contact_state": (both, state), "contact_kind": ("contact", [BED, HEAD, DPC, BED, HEAD])},
        attrs={"solver_method": "explicit"},
    )
    (undetermined,) = wall_cautions(explicit)
    assert undetermined.startswith("In 2 contacts of bed and head joints the wall has cracked: the explicit solver")
    assert wall_cautions(explicit.isel(contact=[0, 2, 3])) == []
    still = explicit.assign_attrs(solver_method="quasi_static")
    assert wall_cautions(still) == []
    study = xr.Dataset(
        {
            "energy_error_share": ("sample", [0.01, 0.03, 0.04, np.nan, 0.02], {"tolerance": 0.02}),
            "snap_through_share": ("sample", [0.09, 0.01, 0.02, np.nan, 0.03], {"tolerance": 0.05}),
            "snap_back_limited": ("sample", [-1.0, 0.0, 4.0, 7.0, 5.0]),
        }
    )
    energy, snap_through, bonds = study_cautions(study)
    assert energy.startswith("In 2 walls energy that does not balance is more than energy_tolerance = 0.02 of")
    assert ", 0.04 at most: the steps" in energy
    assert snap_through.startswith("In 1 walls energy set free in snap-through is more than snap_through_tolerance = 0")
    assert ", 0.09 at most: no" in snap_through
    assert bonds.startswith("In 3 walls bonds break at once, in 7 joints of a wall at most: fracture_energy")
    study["snap_through_share"].attrs["tolerance"] = 0.09
    assert study_cautions(study.drop_vars("snap_back_limited")) == [energy]


@pytest.mark.parametrize(
    ("progress", "passes"),
    [
        ([0.0, 0.5, 1.0, 0.5, 1.0, 0.5, 1.0, 0.5, 1.0], None),  # turns, without a pass of zero
        ([0.0, 1.0, 0.0, -1.0, 0.0, 1.0], None),  # dishing, doming, dishing
        ([0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0], 3),
        ([0.0, 1.0, -0.5, 0.5, 0.0, 0.0, -0.1, 0.7], 4),
        ([0.0, 1.0, -0.5, 0.5, np.nan], None),
    ],
)
def test_a_history_that_passes_zero_often_is_undetermined(progress: list[float], passes: int | None) -> None:
    state = np.full((len(progress), 3), INTACT)
    state[1:, :2] = CRACKED
    wall = xr.Dataset(
        {
            "contact_state": (("increment", "contact"), state),
            "contact_kind": ("contact", [BED, DPC, HEAD]),
            "progress": ("increment", progress),
        },
        attrs={"solver_method": "quasi_static"},
    )
    said = wall_cautions(wall)
    assert len(said) == (passes is not None)
    assert all(
        one.startswith(
            f"In 1 contacts of bed and head joints the wall has cracked: the movement passes zero {passes} times"
        )
        for one in said
    )
    assert wall_cautions(wall.isel(contact=[1, 2])) == []  # only the dpc opens
    assert len(wall_cautions(wall.assign_attrs(solver_method="explicit"))) == 1 + len(said)


@pytest.mark.thorough
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


@pytest.mark.parametrize(
    ("cohesion", "joint", "named"),
    [(8e3, "", True), (12e3, "", False), (8e3, "fracture_energy = 5.0", False), (0.0, "", False)],
)
def test_small_bonds_that_break_at_once_are_named(cohesion: float, joint: str, named: bool) -> None:
    """Bonds below 10 kPa: the two solvers may end in different equilibria; not dry joints, not where bonds soften."""
    wall = xr.Dataset(
        {
            "contact_state": (("increment", "contact"), np.full((2, 3), CRACKED)),
            "contact_kind": ("contact", [BED, DPC, HEAD]),
            "contact_cohesion": ("contact", [cohesion, 0.0, 2e5]),
            "contact_tensile_strength": ("contact", [min(cohesion, 2e4), 0.0, 1e5]),
        },
        attrs={"solver_method": "quasi_static", "scene": f"[joint]\n{joint}\n"},
    )
    said = wall_cautions(wall)
    assert len(said) == named
    assert all("bonds of less than 10 kPa break at once" in one for one in said)
