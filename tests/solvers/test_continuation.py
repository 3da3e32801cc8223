"""Continuation of the quasi-static solver: events, snap-through, symmetry, collapse, errors, energy."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred import solve
from damagepred.archive.cautions import wall_cautions
from damagepred.assembly import Assembly, Model, wall_model
from damagepred.assembly.assembly import rectangle
from damagepred.enumerations import ContactState
from damagepred.errors import ConvergenceError
from damagepred.kernels.equilibrium.predictor import EVENT_TOLERANCE, OVERLOAD_TOLERANCE
from damagepred.scene import BlockMaterial, Joint, Loads, Movement, Scene, Solver, Wall
from damagepred.solvers import solve_path
from damagepred.solvers.quasi_static.continuation import Continuation
from damagepred.solvers.quasi_static.dynamic_relaxation import FALLBACK_RESIDUAL_TOLERANCE
from damagepred.solvers.quasi_static.equilibrium import Equilibrium
from damagepred.solvers.quasi_static.stepper import quasi_static_path
from damagepred.solvers.state.wall_state import State
from tests.properties.statics import unbalanced
from tests.properties.test_quasi_static_laws import random_wall
from tests.solvers.walls import small_scene

QUASI_STATIC = Solver(blocks="rigid")
WHOLE = Solver(blocks="rigid", symmetric_half=False)
WEAK = Joint(tensile_strength=0.1e6, cohesion=0.1e6)


def cracking(**other: object) -> Scene:
    """A symmetric wall that cracks."""
    return Scene(
        wall=Wall(length=2.4, height=0.6, block_length=0.3, block_height=0.15),
        **{
            "loads": Loads(roof=1000.0),
            "joint": WEAK,
            "movement": Movement(central_deflection=3e-3, increments=3),
            "solver": QUASI_STATIC,
            **other,
        },
    )


def with_one_weak_bond(share: float, density: float = 2000.0) -> tuple[Model, int]:
    """Return a wall with one bond that breaks at a share of the movement, and its interface."""
    joint = Joint(tensile_strength=1e8, cohesion=1e9)
    block = BlockMaterial(density=density)
    movement = Movement(central_deflection=1e-4, kind="doming")
    loads = Loads(roof=0.5 * density)
    scene = cracking(joint=joint, block=block, loads=loads, movement=movement)
    model = wall_model(scene)
    first, last = solve_path(model, WHOLE, 1)  # elastic, so all is linear
    before, after = first.normal_stress, last.normal_stress
    interface = int(np.argmax((after - before).max(axis=1)))
    strength = float((before + share * (after - before))[interface].max())
    assert strength > 0
    law = model.properties
    weak = law.tensile_strength.copy()
    weak[interface] = strength
    return replace(model, properties=law._replace(tensile_strength=weak)), interface


@pytest.mark.parametrize("increments", [1, 3, 10])
@pytest.mark.parametrize("condense", [True, False])
def test_a_bond_breaks_at_the_movement_that_reaches_its_strength(monkeypatch, increments, condense) -> None:
    model, interface = with_one_weak_bond(0.62)
    seen: list[tuple[float, np.ndarray]] = []
    original = Continuation.fail_bonds

    def fail_bonds(self: Continuation, state: State, heaviest: float) -> np.ndarray:
        seen.append((state.load_factor, self.equilibrium.bond_load.copy()))
        return original(self, state, heaviest)

    monkeypatch.setattr(Continuation, "fail_bonds", fail_bonds)
    *_, last = quasi_static_path(model, replace(WHOLE, condense=condense), increments)
    progress, load = seen[0]
    assert progress == pytest.approx(0.62, rel=0.01)
    assert progress >= 0.62 * (1 - 1e-4)
    assert int(load.max(axis=1).argmax()) == interface
    assert 1.0 + OVERLOAD_TOLERANCE < load.max() <= 1.0 + EVENT_TOLERANCE
    assert (np.flatnonzero((last.state == ContactState.CRACKED).any(axis=1)) == [interface]).all()


def test_bonds_break_one_event_after_the_other_and_never_heal(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = cracking()
    model = wall_model(scene)
    progress: list[float] = []
    cracked: list[int] = []
    original = Continuation.fail_bonds

    def fail_bonds(self: Continuation, state: State, heaviest: float) -> np.ndarray:
        progress.append(state.load_factor)
        before = state.history.cracked.copy()
        again = original(self, state, heaviest)
        assert state.history.cracked[before].all()
        cracked.append(int(state.history.cracked.sum()))
        return again

    monkeypatch.setattr(Continuation, "fail_bonds", fail_bonds)
    steps = list(quasi_static_path(model, WHOLE, 3))
    assert len(progress) > 5
    assert (np.diff(progress) >= 0).all()
    assert (np.diff(cracked) > 0).all()
    assert sum(s.counters.events for s in steps) == len(progress)


@pytest.mark.parametrize("law", ["paper", "brittle shear", "residual strength"])
def test_dynamic_relaxation_finds_the_same_equilibrium(law: str) -> None:
    _, model = random_wall(law, 1)
    path = Continuation(model, WHOLE)
    assert path.advance(1.0, 0.02) < path.tolerance
    start = path.state.at(1.0, 0.021)
    direct = start.copy()
    assert path.equilibrium.find(direct) < path.tolerance
    found, worst = path.snap_through(start, 0.02)
    assert worst < path.tolerance
    assert path.equilibrium.residual(found, found.displacement)[1] < path.tolerance
    moved = np.abs(direct.displacement - path.state.displacement).max()
    # not exactly: friction slips in both directions during relaxation
    assert np.abs(found.displacement - direct.displacement).max() < 0.6 * moved
    # the bonds have waited
    np.testing.assert_array_equal(found.history.cracked, start.history.cracked)


@pytest.mark.parametrize("law", ["paper", "softening", "residual strength"])
def test_a_path_continues_after_snap_through(monkeypatch: pytest.MonkeyPatch, law: str) -> None:
    """Newton's method is disabled for some steps: dynamic relaxation must find the equilibrium."""
    scene, model = random_wall(law, 1)
    original, hidden = Equilibrium.find, []

    def find(self: Equilibrium, state: State, start: np.ndarray | None = None, near: bool = False) -> float:
        if 0.2 < state.load_factor <= 0.4 and len(hidden) < 8:
            hidden.append(state.load_factor)
            return 1.0
        return original(self, state, start)

    monkeypatch.setattr(Equilibrium, "find", find)
    steps = list(quasi_static_path(model, WHOLE, scene.movement.increments))
    assert len(hidden) == 8
    assert len(steps) == scene.movement.increments + 1
    for step in steps:
        assert np.abs(unbalanced(model, step)).max() < 1.05e-6


def test_an_accepted_state_moves_its_condensed_courses() -> None:
    """Condensed courses follow the others from any previous position."""
    model = wall_model(cracking(joint=Joint(tensile_strength=1e8, cohesion=1e9)))
    path = Continuation(model, WHOLE)
    assert path.advance(1.0, 0.5) < path.tolerance
    hidden = np.ones(model.size, dtype=np.bool_)
    hidden[path.equilibrium.free] = False
    hidden[model.supports.prescribed] = False
    state = path.state.copy()
    state.displacement[hidden] = 0.0
    assert path.equilibrium.accept_unconverged(state) < path.tolerance
    assert np.abs(path.state.displacement[hidden]).max() > 1e-6
    np.testing.assert_allclose(state.displacement, path.state.displacement, rtol=0, atol=1e-12)


def test_a_wall_whose_residual_stays_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, model = random_wall("paper", 1)
    briefly = replace(WHOLE, advanced={"dynamic_relaxation": {"max_cycles": 5_000}})
    monkeypatch.setattr(Equilibrium, "find", lambda self, state, start=None, near=False: 1.0)
    monkeypatch.setattr(
        Equilibrium, "newton", lambda self, state, start: (state.displacement, 1.01 * FALLBACK_RESIDUAL_TOLERANCE)
    )
    with pytest.raises(ConvergenceError, match="no equilibrium found"):
        list(quasi_static_path(model, briefly, scene.movement.increments))


def between_piers(strength: float) -> Assembly:
    """A brick glued between two piers, the right one of which is pulled away; the left joint has its own strength."""
    # hardly any friction: it must not wedge
    smooth = {"friction": 0.05, "brittle_shear": True}
    wall = Assembly(joint=Joint(tensile_strength=5e3, cohesion=5e3, **smooth), block=BlockMaterial(density=2000.0))
    piers = [wall.add_block(rectangle(x, 0.0, x + 0.2, 0.1)) for x in (0.0, 0.4)]
    brick = wall.add_block(rectangle(0.2, 0.0, 0.4, 0.1))
    for pier in piers:
        wall.support(pier)
    wall.set_joint(piers[0], brick, Joint(tensile_strength=strength, cohesion=strength, **smooth))
    wall.move(piers[1], x=5e-3)
    return wall


@pytest.mark.parametrize("condense", [True, False])
def test_a_wall_whose_support_is_pulled_away_collapses(condense: bool) -> None:
    # the left joint alone would carry 24 kPa at its top
    settings = Solver(method="quasi_static", condense=condense)
    ds = damagepred.solve(between_piers(8e3), increments=4, solver=settings)
    assert ds.attrs["status"] == "collapsed"
    assert "collapsed in increment" in ds.attrs["status_message"]
    assert ds.sizes["increment"] <= 5
    assert int(ds["damage_category"].values[-1]) == int(ds["damage_category"].values.max())
    # strong enough, it stays up
    assert damagepred.solve(between_piers(0.1e6), increments=4, solver=settings).attrs["status"] == "complete"


@pytest.mark.parametrize("half", [True, False])
def test_an_increment_without_equilibrium_names_itself_and_a_block(monkeypatch: pytest.MonkeyPatch, half: bool) -> None:
    original = Equilibrium.find

    def find(self: Equilibrium, state: State, start: np.ndarray | None = None, near: bool = False) -> float:
        return 1.0 if state.load_factor > 0.3 else original(self, state, start)

    monkeypatch.setattr(Equilibrium, "find", find)
    monkeypatch.setattr(Continuation, "snap_through", lambda self, state, *_, **__: (state, 0.5))
    model = wall_model(small_scene())
    settings, steps = Solver(method="quasi_static", symmetric_half=half), []
    with pytest.raises(ConvergenceError, match=r"increment 2: no equilibrium .* block \d+ \(x = ") as caught:
        steps.extend(solve_path(model, settings, 4))
    assert caught.value.increment == 2
    assert 0 <= caught.value.block < model.n_blocks
    ds = damagepred.solve(small_scene(method="quasi_static"), on_failure="return")
    assert ds.attrs["status"] == "failed"
    assert "increment 2" in ds.attrs["status_message"]


DATA = Path(__file__).resolve().parents[2] / "data"
DRY = Joint(tensile_strength=0.0, cohesion=0.0)
DEFLECTION = 4e-3


def dry_wall(kind: str, length: float, height: float, increments: int, **solver: float) -> xr.Dataset:
    movement = Movement(kind=kind, central_deflection=DEFLECTION, increments=increments)
    wall = Wall(length=length, height=height)
    return solve(Scene(wall=wall, joint=DRY, movement=movement, solver=Solver(**solver)))


def difference(one: xr.Dataset, other: xr.Dataset) -> float:
    """Largest difference of a block's final position, over the movement."""
    x, y = (one[f"block_displacement_{a}"].values[-1] - other[f"block_displacement_{a}"].values[-1] for a in "xy")
    return float(np.hypot(x, y).max()) / DEFLECTION


def said(ds: xr.Dataset) -> bool:
    return any("snap-through" in line for line in wall_cautions(ds))


@pytest.mark.thorough
def test_dependence_on_increments_is_reported() -> None:
    """In one increment the wall snaps through, in 160 it is followed; final positions differ."""
    coarse, fine = (dry_wall("doming", 3.36, 1.5, n) for n in (1, 160))
    assert difference(coarse, fine) > 0.1
    assert said(coarse)
    assert not said(fine)
    share = coarse["snap_through_energy"].values.max() / np.abs(coarse["external_work"].values).max()
    assert coarse.attrs["snap_through_share"] == pytest.approx(share)
    assert (coarse["snap_through_energy"].values <= coarse["released_energy"].values).all()
    assert (np.diff(coarse["snap_through_energy"].values) >= 0.0).all()
    assert f"{share:.2g} of the largest work done" in wall_cautions(coarse)[-1]
    coarse.attrs["snap_through_tolerance"] = 1.0
    assert not said(coarse)


@pytest.mark.parametrize("name", ["dishing", "window_doming"])
def test_bonds_that_break_are_no_snap_through(name: str) -> None:
    """They release energy, and equilibrium is near."""
    ds = solve(Scene.from_toml(DATA / f"bryant_{name}.toml"))
    assert ds["released_energy"].values[-1] > 0.01 * ds["external_work"].values[-1]
    assert ds.attrs["snap_through_share"] < 1e-3
    assert not said(ds)
