"""studies/soil_movement: settings from the tables, a study read at movements of its paths, a wall."""

import importlib
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.enumerations import SampleStatus

ROOT = Path(__file__).resolve().parents[2]
STUDY = ROOT / "studies" / "soil_movement"
COMPLETE, _, FAILED, _ = SampleStatus


def module(name: str) -> ModuleType:
    sys.path.insert(0, str(STUDY))
    try:
        sys.modules.pop(name, None)
        return importlib.import_module(name)
    finally:
        sys.path.remove(str(STUDY))
        sys.modules.pop(name, None)


def study(paths: list[list[int]], status: list[int]) -> xr.Dataset:
    category = np.array(paths, dtype=np.int8)
    both = ("sample", "increment")
    return xr.Dataset(
        {"damage_category": (both, category), "status": ("sample", np.array(status, dtype=np.int8))},
        coords={"surface_movement": (both, np.zeros(category.shape), {"units": "m"}), "sample": np.arange(len(paths))},
    )


def test_shares_leave_out_what_is_not_known_and_bound_what_never_happened() -> None:
    stripes = module("stripes")
    rows = stripes.shares(study([[0, 2, 2], [0, 0, 0], [0, 1, -1], [0, 0, 0]], [COMPLETE, COMPLETE, FAILED, COMPLETE]))
    assert [(r["reached"], r["walls"]) for r in rows] == [(2, 4), (1, 3), (0, 3), (0, 3)]
    assert all(r["lower"] <= r["share"] <= r["upper"] for r in rows)
    # Wilson's bound for none of three at 90 %: z^2 / (n + z^2), z = 1.645
    assert rows[2]["upper"] == pytest.approx(1.6449**2 / (3 + 1.6449**2), rel=1e-4)
    assert {r["failed"] for r in rows} == {1}


def test_a_heavier_footing_bends_less() -> None:
    run = module("run")
    bent = {}
    for footing in ("light", "full_masonry"):
        wall = damagepred.solve(run.settings(footing, "doming", 40.0).scene)
        assert wall.attrs["status"] == "complete"
        bent[footing] = float(np.ptp(wall["central_deflection"].values))
    assert 0 < 1.3 * bent["full_masonry"] < bent["light"]


@pytest.mark.parametrize("kind", ["dishing", "doming"])
def test_softer_soil_bends_the_footing_less(kind: str) -> None:
    """So a stiffness that is too small is unsafe."""
    scene = module("run").settings("veneer", kind, 20.0).scene
    scene = replace(scene, solver=scene.solver.with_accuracy("draft"), movement=replace(scene.movement, increments=1))
    bent = []
    for stiffness in (1e6, 4e6):
        soil = replace(scene.soil, swelling_stiffness=stiffness, shrinking_stiffness=stiffness)
        ends = damagepred.solve(replace(scene, soil=soil))["block_displacement_y"].values
        bent.append(float(np.ptp(ends[-1] - ends[0])))
    assert 0 < 1.2 * bent[0] < bent[1]
