"""The audit of random scenes: its scenes, and its checks on right and wrong results."""

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.enumerations import ContactKind
from damagepred.scene import (
    Damage,
    Dpc,
    Footing,
    HeadJoint,
    HeadJointFactors,
    Joint,
    Loads,
    Mound,
    Movement,
    Opening,
    Rig,
    Scene,
    Soil,
    Solver,
    Wall,
)

FOOTING_BED = ContactKind.FOOTING_INTERFACE
STUDIES = Path(__file__).parents[2] / "studies"
FOLDERS = [str(STUDIES / "audit")]
WALL = Wall(length=1.2, height=0.6, block_length=0.3, block_height=0.15)


@pytest.fixture(scope="module", autouse=True)
def _audited() -> Iterator[None]:
    sys.path[:0] = FOLDERS
    yield
    for folder in FOLDERS:
        sys.path.remove(folder)


def checked(ds: xr.Dataset) -> dict[str, Any]:
    from audited.checks import check
    from audited.wall import ArchivedWall

    return {one.check: one for one in check(ArchivedWall(ds))}


def cracked_scene() -> Scene:
    """A wall with dpc and opening that cracks, with bonds that soften."""
    return Scene(
        wall=WALL,
        joint=Joint(tensile_strength=0.05e6, cohesion=0.06e6, fracture_energy=5.0),
        dpc=Dpc(course=1),
        opening=(Opening(x=0.45, y=0.3, width=0.3, height=0.3),),
        movement=Movement(kind="doming", central_deflection=4e-3, increments=5),
        loads=Loads(roof=5000.0),
        damage=Damage(dpc_threshold=1e-4),
    )


@pytest.fixture(scope="module")
def softened() -> xr.Dataset:
    return damagepred.solve(cracked_scene())


@pytest.fixture(scope="module")
def brittle() -> xr.Dataset:
    joint = Joint(tensile_strength=0.05e6, cohesion=0.06e6)
    return damagepred.solve(replace(cracked_scene(), joint=joint, dpc=None))


@pytest.fixture(scope="module")
def bent() -> xr.Dataset:
    """Elastic blocks, head joints of their own, and exponential softening."""
    joint = Joint(tensile_strength=0.05e6, cohesion=0.06e6, fracture_energy=5.0, softening="exponential")
    heads = HeadJoint(factor=HeadJointFactors(tensile_strength=0.6, friction=0.8, fracture_energy=0.7))
    elastic = replace(cracked_scene(), joint=joint, head_joint=heads, solver=Solver(blocks="elastic"))
    return damagepred.solve(elastic)


def test_a_scene_follows_from_seed_and_number_alone() -> None:
    from audited.scenes import scene_of

    assert scene_of(3, 17) == scene_of(3, 17)
    assert scene_of(3, 17).scene != scene_of(3, 18).scene
    assert scene_of(3, 17).scene != scene_of(4, 17).scene


def test_all_laws_movements_and_grounds_are_drawn() -> None:
    from audited.scenes import scene_of

    drawn = [scene_of(1, number) for number in range(250)]
    found = {name for one in drawn for name in one.features}
    shapes = {one.scene.movement.shape for one in drawn}
    assert shapes == {"three_loads", "parabola", "arc", "table", "jacks", "mound"}
    assert {
        "brittle",
        "softening",
        "exponential softening",
        "head joints of their own",
        "elastic blocks",
        "softening by slip",
        "brittle shear",
        "cap",
        "dilation",
        "residual values",
        "residual friction",
        "no strength",
        "cohesion without tension",
        "control joint",
        "dpc",
        "opening",
        "roof",
        "stack bond",
        "jacks by load",
        "jacks by deflection",
        "footing of reinforced concrete",
        "joint of the footing",
        "deformable blocks",
        *(f"mound, {shape}" for shape in ("walsh", "mitchell", "tree", "pipe", "tunnel", "table")),
    } <= found


def test_sound_results_pass(softened: xr.Dataset, brittle: xr.Dataset, bent: xr.Dataset) -> None:
    for ds in (softened, brittle, bent):
        assert (ds["contact_state"] == 1).any()
        assert not [one for one in checked(ds).values() if not one.stated]


def changed(ds: xr.Dataset, name: str, change: Callable[[np.ndarray], np.ndarray]) -> xr.Dataset:
    """Return a copy of a dataset in which a variable is another."""
    copy = ds.copy(deep=True)
    copy[name].values[...] = change(copy[name].values.copy())
    return copy


def at(step: int, contact: int, value: Callable[[float], float]) -> Callable[[np.ndarray], np.ndarray]:
    """Change one value of an array (increments, contacts)."""

    def change(values: np.ndarray) -> np.ndarray:
        values[step, contact] = value(values[step, contact])
        return values

    return change


def last(value: Callable[[float], float]) -> Callable[[np.ndarray], np.ndarray]:
    """Change the last value of an array (increments,)."""

    def change(values: np.ndarray) -> np.ndarray:
        values[-1] = value(values[-1])
        return values

    return change


def places(ds: xr.Dataset) -> dict[str, int]:
    """Return contacts to spoil: one intact and pressed, one cracked and open, one of the dpc."""
    state, opening, kind = (ds[f"contact_{n}"].values for n in ("state", "opening", "kind"))
    return {
        "intact": int(np.flatnonzero((state == 0).all(axis=0) & (opening[-1] < 0) & (kind == 0))[0]),
        "open": int(np.flatnonzero((state[-1] == 1) & (opening[-1] > 0.5e-4) & (kind < 2))[0]),
        "dpc": int(np.flatnonzero(kind == 2)[0]) if (kind == 2).any() else -1,
    }


SPOILT: dict[str, tuple[str, str, str, Callable[[Any], Any]]] = {
    # check that must see it: dataset, variable, place, change
    "equilibrium": ("softened", "contact_normal_stress", "intact", lambda v: v * (1 + 1e-4)),
    "reaction": ("softened", "base_reaction", "", lambda v: v + 1.0),
    "compatibility": ("softened", "contact_opening", "intact", lambda v: v - 1e-9),
    "tension": ("softened", "contact_normal_stress", "intact", lambda v: 0.06e6),
    "tension in the dpc": ("softened", "contact_normal_stress", "dpc", lambda v: 2e3),
    "shear": ("softened", "contact_shear_stress", "intact", lambda v: 0.2e6),
    "elastic relation": ("softened", "contact_normal_stress", "intact", lambda v: v * (1 + 1e-4)),
    "elastic shear": ("softened", "contact_slip", "intact", lambda v: v + 1e-8),
    "states": ("softened", "contact_slip", "intact", lambda v: v + 1e-8),
    "open contacts": ("brittle", "contact_normal_stress", "open", lambda v: -2e3),
    "cracks stay": ("softened", "contact_state", "open", lambda v: 0),
    "energy balance": ("softened", "released_energy", "", lambda v: v + 1.0),
    "elastic energy": ("softened", "elastic_energy", "", lambda v: v * 1.001),
    "fracture energy": ("softened", "fracture_work", "", lambda v: v * 40 + 5.0),
    "dissipation": ("softened", "friction_work", "", lambda v: -1.0),
    "work put in": ("softened", "friction_work", "", lambda v: v + 1e3),
    "damage category": ("softened", "damage_category", "", lambda v: v + 1),
    "crack width max": ("softened", "crack_width_max", "", lambda v: v * (1 + 1e-6)),
    "crack band width max": ("softened", "crack_band_width_max", "", lambda v: v * (1 + 1e-6)),
    "damage category band": ("softened", "damage_category_band", "", lambda v: v - 1),
    "footing opening max": ("brittle", "footing_opening_max", "", lambda v: v + 1e-8),
    "footing separation length": ("brittle", "footing_separation_length", "", lambda v: v + 1e-4),
    "dpc opening max": ("softened", "dpc_opening_max", "", lambda v: v + 1e-8),
    "dpc separation length": ("softened", "dpc_separation_length", "", lambda v: v + 1e-4),
    "crack count": ("softened", "crack_count", "", lambda v: v + 1),
    "stress resultants": ("bent", "block_curvature", "intact", lambda v: v * (1 + 1e-3)),
    "finite": ("softened", "block_rotation", "intact", lambda v: np.nan),
}


@pytest.mark.parametrize("seen_by", SPOILT)
def test_a_wrong_result_is_detected(seen_by: str, request: pytest.FixtureRequest) -> None:
    which, name, place, change = SPOILT[seen_by]
    ds = request.getfixturevalue(which)
    if name in ("block_rotation", "block_curvature"):
        spoilt = changed(ds, name, at(-1, 0, change))
    else:
        spoilt = changed(ds, name, at(-1, places(ds)[place], change) if place else last(change))
    assert seen_by in {one.check for one in checked(spoilt).values() if not one.stated}


@pytest.mark.parametrize(
    ("before", "after"), [('softening = "exponential"', ""), ("tensile_strength = 0.6", "tensile_strength = 0.5")]
)
def test_a_wrong_law_is_detected(bent: xr.Dataset, before: str, after: str) -> None:
    assert before in bent.attrs["scene"]
    wrong = bent.assign_attrs(scene=bent.attrs["scene"].replace(before, after))
    assert {"tension", "shear", "fracture energy"} & {one.check for one in checked(wrong).values() if not one.stated}


def test_a_wrong_breaking_of_a_bond_is_detected(softened: xr.Dataset) -> None:
    broke = np.flatnonzero(~np.isnan(softened["contact_broken_at"].values))
    for wrong in (1.5, -0.1, np.nan):
        spoilt = softened.copy(deep=True)
        spoilt["contact_broken_at"].values[broke[0]] = wrong
        assert "broken at" in checked(spoilt)


def test_a_wrong_status_is_detected(softened: xr.Dataset) -> None:
    assert "status" in checked(softened.isel(increment=slice(0, -1)))
    assert "status" in checked(softened.assign_attrs(status="running"))


def test_a_large_energy_error_and_a_missed_tolerance_are_reported(softened: xr.Dataset) -> None:
    found = checked(changed(softened, "energy_error", lambda v: v + softened["external_work"].values))
    assert found["energy error"].stated
    found = checked(changed(softened, "unbalanced_force_ratio", last(lambda v: 5e-4)))
    assert found["tolerance"].stated
    assert not checked(changed(softened, "unbalanced_force_ratio", last(lambda v: 5e-3)))["tolerance"].stated


@pytest.mark.parametrize("shape", ["jacks", "mound"])
def test_walls_on_a_footing_pass(shape: Any) -> None:
    scene = Scene(
        wall=WALL,
        joint=Joint(tensile_strength=0.05e6, cohesion=0.06e6),
        movement=Movement(shape=shape, kind="doming", central_deflection=1e-3, increments=4),
        footing=Footing(joint=Joint(tensile_strength=0.0, cohesion=0.0)),
        rig=Rig(stop_at_zero=False),
        mound=Mound(shape="pipe", surface_movement=0.01),
        soil=Soil(shrinking_stiffness=2e7),
    )
    assert not [one for one in checked(damagepred.solve(scene)).values() if not one.stated]


def test_a_joint_on_a_footing_narrower_than_the_wall_keeps_its_length() -> None:
    """Its area is that of the footing's width, its length that of the brick: the gap is measured along all of it."""
    scene = Scene(
        wall=WALL,
        footing=Footing(width=0.08, joint=Joint(tensile_strength=0.0, cohesion=0.0)),
        movement=Movement(kind="doming", shape="jacks", central_deflection=2e-3, increments=3),
        rig=Rig(support="held", stop_at_zero=False),
        damage=Damage(footing_threshold=1e-4),
    )
    ds = damagepred.solve(scene)
    assert float(ds["footing_separation_length"][-1]) > 0.3
    assert not checked(ds)
    bed = ds["contact_kind"].values == FOOTING_BED
    assert ds["contact_length"].values[bed].sum() == pytest.approx(WALL.length, rel=1e-12)
    np.testing.assert_allclose(ds["contact_thickness"].values[bed], 0.08, rtol=1e-12)


def test_no_slope_where_a_door_leaves_no_two_bricks_far_enough_apart() -> None:
    scene = Scene(
        wall=Wall(length=1.92, height=0.56, block_length=0.48, block_height=0.14),
        opening=(Opening(kind="door", x=0.81, width=0.66, height=0.3),),
        movement=Movement(kind="doming", central_deflection=1e-4, increments=1),
    )
    ds = damagepred.solve(scene)
    assert np.isnan(ds["base_slope_max"]).all()  # centroids 0.41 and 1.02 m apart
    assert np.isfinite(ds["slope_max"]).all()
    assert not checked(ds)
    spoilt = ds.assign(slope_max=ds["slope_max"] * np.nan)
    assert "finite" in checked(spoilt)


def test_the_category_is_read_from_the_table() -> None:
    from audited.damage import category, highest

    rules = {"table": "as2870", "plasterboard": False, "count_rule": True}
    widths = {0.0: 0, 0.05e-3: 0, 0.1e-3: 1, 0.99e-3: 1, 1e-3: 2, 4.9e-3: 2, 5e-3: 3, 15e-3: 4, 0.1: 4}
    assert {w: category(w, 0.0, rules) for w in widths} == widths
    assert category(3.5e-3, 3.2e-3, rules) == 3
    assert category(3.5e-3, 3.2e-3, rules | {"count_rule": False}) == 2
    assert category(1.2e-3, 0.0, rules | {"plasterboard": True}) == 1
    assert highest({"table": "bre251"}) == 5


def test_limit_analysis_of_an_archive_proves_collapse() -> None:
    """A jack load above the total weight lifts the footing off its unilateral supports."""
    from audited.collapse import must_collapse
    from audited.wall import ArchivedWall

    def on_a_jack(load: float) -> xr.Dataset:
        rig = Rig(supports=(0.0, 1.2), jacks=(0.6,), support="lift_off", control="load", jack_load=load)
        scene = Scene(wall=WALL, movement=Movement(shape="jacks", increments=2), rig=replace(rig, stop_at_zero=False))
        return damagepred.solve(scene, on_failure="return")

    stands, falls = on_a_jack(0.0), on_a_jack(2e4)
    assert (stands.attrs["status"], falls.attrs["status"]) == ("complete", "collapsed")
    assert not must_collapse(ArchivedWall(stands))
    assert must_collapse(ArchivedWall(falls))


def test_twenty_scenes_by_both_solvers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The small command: no silent violation, and no traceback."""
    from audited import campaign, page

    rows = [campaign.one(job) for job in campaign.jobs(6, 10)]
    assert {row["outcome"] for row in rows} <= {"solved", "limit", "collapsed", "gave up"}
    assert [row["words"] for row in rows if row["silent"]] == []
    solved = [row["outcome"] in ("solved", "limit") for row in rows if row["solver"] == "quasi_static"]
    assert np.mean(solved) > 0.8

    monkeypatch.setattr(campaign, "warm_up", lambda: None)
    monkeypatch.setattr(campaign, "one", _kept_or_dies)
    file = tmp_path / "rows.csv"
    campaign.run(campaign.jobs(6, 2), file, limit=30.0)
    campaign.run(campaign.jobs(6, 3), file, limit=30.0)
    table = page.read(file)
    assert list(table["scene"]) == [0, 0, 1, 1, 2, 2]
    assert list(table["outcome"]) == ["solved", "solved", "died", "died", "solved", "solved"]
    assert "| died |" in page.text(table)


def _kept_or_dies(job: Any) -> dict[str, Any]:
    from audited import campaign

    if job.scene == 1:
        import os

        os._exit(3)
    return campaign.empty_row(job) | {"outcome": "solved", "seconds": 0.1, "crack_width": 0.0, "features": "dpc"}
