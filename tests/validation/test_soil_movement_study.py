"""studies/soil_movement: settings from the tables, a study read at movements of its paths, a wall."""

import importlib
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.campaign.settings import StudySettings
from damagepred.enumerations import SampleStatus
from damagepred.uq.variable import Variable

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


def test_scatter_is_that_of_the_tables() -> None:
    tables: dict[str, dict] = {}
    for name in ("masonry", "ground"):
        tables |= tomllib.loads((ROOT / "data" / "statistics" / f"{name}.toml").read_text())
    settings = StudySettings.from_toml(STUDY / "house.toml")
    marginals = settings.design().marginals
    keys = ("distribution", "mean", "cov", "lower", "upper")
    for place in settings.variables:
        given = Variable(**{k: v for k, v in tables[place].items() if k in keys}).frozen(place, "1")
        for share in (0.05, 0.5, 0.95):
            assert marginals[place].ppf(share) == pytest.approx(given.ppf(share), rel=1e-9), place


def test_footings_are_the_standard_ones_and_increments_do_not_grow() -> None:
    run = module("run")
    seen = set()
    for footing in run.FOOTINGS:
        scene = run.settings(footing, "dishing", 75.0).scene
        seen.add((scene.footing.depth, scene.footing.width, scene.footing.concrete.bottom))
        assert scene.mound.surface_movement == pytest.approx(0.075)
        assert scene.mound.surface_movement / scene.movement.increments <= 0.0101
        assert scene.movement.kind == "dishing"
    assert seen == {(0.4, 0.3, "3-L11TM"), (0.5, 0.3, "3-L12TM"), (0.9, 0.4, "4-L12TM")}


def study(paths: list[list[int]], status: list[int]) -> xr.Dataset:
    category = np.array(paths, dtype=np.int8)
    both = ("sample", "increment")
    return xr.Dataset(
        {"damage_category": (both, category), "status": ("sample", np.array(status, dtype=np.int8))},
        coords={"surface_movement": (both, np.zeros(category.shape), {"units": "m"}), "sample": np.arange(len(paths))},
    )


def test_a_study_is_read_at_a_movement_of_its_paths() -> None:
    stripes = module("stripes")
    ds = study([[0, 1, 2], [0, 0, 0], [0, 1, -1]], [COMPLETE, COMPLETE, FAILED])
    ds["surface_movement"].values[:] = [0.0, 0.02, 0.06]
    first, end = stripes.read_at(ds, 0.02), stripes.read_at(ds, 0.06)
    assert first["damage_category"].values.tolist() == [[0, 1], [0, 0], [0, 1]]
    assert end["damage_category"].shape == (3, 3)
    # the wall that failed later is known at the first movement, and at the end for what it had reached
    assert [(r["reached"], r["walls"]) for r in stripes.shares(first)][:2] == [(2, 3), (0, 3)]
    assert [(r["reached"], r["walls"]) for r in stripes.shares(end)][:2] == [(2, 3), (1, 2)]


def test_shares_leave_out_what_is_not_known_and_bound_what_never_happened() -> None:
    stripes = module("stripes")
    rows = stripes.shares(study([[0, 2, 2], [0, 0, 0], [0, 1, -1], [0, 0, 0]], [COMPLETE, COMPLETE, FAILED, COMPLETE]))
    assert [(r["reached"], r["walls"]) for r in rows] == [(2, 4), (1, 3), (0, 3), (0, 3)]
    assert all(r["lower"] <= r["share"] <= r["upper"] for r in rows)
    # Wilson's bound for none of three at 90 %: z^2 / (n + z^2), z = 1.645
    assert rows[2]["upper"] == pytest.approx(1.6449**2 / (3 + 1.6449**2), rel=1e-4)
    assert {r["failed"] for r in rows} == {1}


def test_thirds_of_an_input_hold_all_walls_once() -> None:
    stripes = module("stripes")
    ds = study([[0, 0]] * 4 + [[0, 1]] * 3, [COMPLETE] * 7)
    ds["soil"] = "sample", np.arange(7.0)
    rows = [row for row in stripes.by_thirds(ds, "soil") if row["category"] == 1]
    assert [row["walls"] for row in rows] == [2, 2, 3]
    assert [row["reached"] for row in rows] == [0, 0, 3]


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
