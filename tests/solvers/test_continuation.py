"""Continuation of the quasi-static solver: events, snap-through, symmetry, collapse, errors, energy."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from threadpoolctl import ThreadpoolController, threadpool_limits

import damagepred
from damagepred.assembly import Assembly, Model, wall_model
from damagepred.assembly.assembly import GRAVITY, rectangle
from damagepred.diagnostics import Energies, described
from damagepred.enumerations import ContactState
from damagepred.errors import ConvergenceError
from damagepred.kernels.equilibrium.joints import fill_bond_loads
from damagepred.one_wall.judged_path import model_of
from damagepred.scene import BlockMaterial, Dpc, Joint, Loads, Movement, Scene, Solver, Wall
from damagepred.solvers import solve_path
from damagepred.solvers.options import DEFAULTS
from damagepred.solvers.quasi_static import dynamic_relaxation as relaxation
from damagepred.solvers.quasi_static import linear_system, residual
from damagepred.solvers.quasi_static.continuation import Continuation
from damagepred.solvers.quasi_static.equilibrium import Equilibrium
from damagepred.solvers.quasi_static.stepper import quasi_static_path
from damagepred.solvers.state.wall_state import State
from tests.properties.test_quasi_static_laws import random_wall
from tests.solvers.test_symmetry_reduction import mirrored
from tests.solvers.walls import small_scene, weak_pair
from tests.validation.test_quasi_static_balance import unbalanced

CONTROL = DEFAULTS.continuation
QUALITY = ("joint_law_violation", *(name for name, d in described(Energies).items() if not d.in_time))
QUASI_STATIC = Solver(method="quasi_static")
WHOLE = Solver(method="quasi_static", symmetric_half=False)
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
        },  # type: ignore[arg-type]
    )


# -- which bond breaks next -------------------------------------------------------------------------------------------


def with_one_weak_bond(share: float, density: float = 2000.0) -> tuple[Model, int]:
    """Return a wall with one bond that breaks at a share of the movement, and its interface."""
    scene = cracking(
        joint=Joint(tensile_strength=1e8, cohesion=1e9),
        block=BlockMaterial(density=density),
        loads=Loads(roof=0.5 * density),
        movement=Movement(central_deflection=1e-4, kind="doming"),
    )
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


@pytest.mark.parametrize("share", [0.3, 0.62, 0.97])
@pytest.mark.parametrize("density", [0.0, 2000.0])
def test_the_tangent_predicts_the_movement_at_which_a_bond_breaks(share: float, density: float) -> None:
    model, _ = with_one_weak_bond(share, density)
    path = Continuation(model, WHOLE)
    assert path.advance(1.0, 0.0) < path.tolerance
    ahead, found = path.equilibrium.predict(path.state, (1.0, 1.0))
    assert found == pytest.approx(share, rel=0.01)
    # no joint slides: the tangent predictor is in equilibrium
    there = path.state.at(1.0, 1.0)
    start = path.state.displacement.copy()
    start[model.supports.prescribed] = model.supports.prescribed_displacement
    before = path.equilibrium.residual(there, start)[1]
    assert path.equilibrium.residual(there, ahead)[1] < 1e-4 * before


@pytest.mark.parametrize("increments", [1, 3, 10])
@pytest.mark.parametrize("condense", [True, False])
def test_a_bond_breaks_at_the_movement_that_reaches_its_strength(
    monkeypatch: pytest.MonkeyPatch, increments: int, condense: bool
) -> None:
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
    assert 1.0 + CONTROL.overload_tolerance < load.max() <= 1.0 + CONTROL.event_tolerance
    assert (np.flatnonzero((last.state == ContactState.CRACKED).any(axis=1)) == [interface]).all()


@pytest.mark.parametrize(
    "law",
    [
        {},
        {"dilation": 0.3},
        {"fracture_energy": 30.0},
        {"residual_tensile_strength": 0.02e6},
        {"brittle_shear": True},
        {"compressive_strength": 5e6},
    ],
    ids=str,
)
def test_bond_loads_are_those_of_the_present_state(law: dict, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are kept from the completion of the equilibrium, and equal those evaluated anew wherever they are taken."""
    original, condensed = Equilibrium.largest_bond_load, []

    def largest_bond_load(self: Equilibrium, state: State) -> float:
        heaviest, kept = original(self, state), self.bond_load.copy()
        inside, everything = self._in_state(state), self._all_interfaces
        u, load = state.displacement, self.bond_load
        assert heaviest == fill_bond_loads(self.components, inside, everything, u, load)
        np.testing.assert_array_equal(kept, self.bond_load)
        original(self, state)
        condensed.append(len(self.equations.active.condensed_interfaces))
        return heaviest

    monkeypatch.setattr(Equilibrium, "largest_bond_load", largest_bond_load)
    wall = Wall(length=3.6, height=1.5, block_length=0.3, block_height=0.15)
    scene = replace(cracking(joint=replace(WEAK, **law)), wall=wall)
    steps = list(quasi_static_path(wall_model(scene), WHOLE, 3))
    assert sum(step.counters.events for step in steps) > 3 or "fracture_energy" in law  # which has no events
    assert sum(count > 0 for count in condensed) > 3


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


# -- symmetry ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["dishing", "doming"])
@pytest.mark.parametrize("dpc", [None, Dpc(course=1, friction=0.4)])
def test_a_symmetric_wall_solved_in_full_cracks_symmetrically(kind: str, dpc: Dpc | None) -> None:
    scene = cracking(dpc=dpc)
    scene = replace(scene, movement=replace(scene.movement, kind=kind))
    model = wall_model(scene)
    cracked = 0
    for step in solve_path(model, WHOLE, 3):
        image = mirrored(model, step)
        bonded = (model.properties.tensile_strength > 0)[:, None]  # unstressed joints open by rounding
        here, there = (v.state == ContactState.CRACKED for v in (step, image))
        np.testing.assert_array_equal(here & bonded, there & bonded)
        cracked = int((here & bonded).sum())
    assert cracked > 5, "nothing to check"


# -- jumps ------------------------------------------------------------------------------------------------------------


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


def test_a_broken_bond_parts_where_it_opens_by_less_than_it_once_bore() -> None:
    """A block is carried by the bond above it; the broken one below opens by weight over the bond's stiffness."""
    joint = Joint(tensile_strength=1e6, cohesion=1e6, residual_tensile_strength=0.0)
    column = Assembly(joint=joint, gravity=(0.0, GRAVITY))
    low, middle, high = (column.add_block(rectangle(0.0, y, 0.2, y + 0.1)) for y in (0.0, 0.1, 0.2))
    column.support(low)
    column.support(high)
    model = column.build(QUASI_STATIC)
    face = model.interfaces
    beneath = (face.block_a == low) | (face.block_b == low)
    start = State.rest(model).at(1.0, 0.0)
    start.history.cracked[beneath] = True
    *_, last = relaxation.relax_dynamically(model, start, 0.0, cycles_share=0.01)
    weight = 0.2 * 0.1 * 0.11 * model.density[middle] * GRAVITY
    springs = model.properties.normal_stiffness * face.contact_area.sum(axis=1)
    assert last.displacement[3 * middle + 1] == pytest.approx(weight / springs[~beneath][0], rel=1e-3)
    np.testing.assert_array_equal(last.history.kappa == np.inf, beneath[:, None] & last.history.cracked)
    assert last.history.cracked[beneath].all()


@pytest.mark.thorough
def test_jumps_end_in_equilibrium(monkeypatch: pytest.MonkeyPatch) -> None:
    """A wall without bond in which something slides unstably."""
    jumps: list[float] = []
    original = Continuation.snap_through

    def snap_through(
        self: Continuation, state: State, start_load_factor: float, cycles_share: float = 1.0
    ) -> tuple[State, float]:
        found, worst = original(self, state, start_load_factor, cycles_share)
        jumps.append(worst)
        return found, worst

    monkeypatch.setattr(Continuation, "snap_through", snap_through)
    scene = Scene(
        wall=Wall(length=3.36, height=1.5),
        joint=Joint(tensile_strength=0.0, cohesion=0.0),
        movement=Movement(kind="doming", central_deflection=4e-3, increments=2),
    )
    model = wall_model(scene)
    steps = list(solve_path(model, Solver(method="quasi_static"), scene.movement.increments))
    assert len(steps) == scene.movement.increments + 1
    for step in steps:
        assert np.abs(unbalanced(model, step)).max() < 1.05e-6
    assert jumps, "nothing to check: look for other walls"
    assert max(jumps) < 1e-6


def test_a_dilatant_wall_is_not_thrown_off_by_its_ground() -> None:
    """Dilatant joints: the wall snaps through repeatedly, and stands, as in the explicit solver."""
    climbing = Joint(
        normal_stiffness=1e10, shear_stiffness=1e9, tensile_strength=4e6, cohesion=0.0, friction=0.75, dilation=0.74
    )
    brick = {"block_length": 0.456, "block_height": 0.147}
    scene = Scene(
        wall=Wall(length=4 * 0.456, height=4 * 0.147, thickness=0.1, **brick),
        joint=climbing,
        block=BlockMaterial(density=450.0),
        movement=Movement(kind="doming", central_deflection=1e-2, shape="parabola"),
    )
    last = list(solve_path(model_of(scene), WHOLE, 1))[-1]
    slowly = list(solve_path(model_of(scene), Solver(method="explicit"), 1))[-1]
    assert not last.collapsed
    assert not slowly.collapsed
    # the dilatant opening depends on the path
    assert np.abs(last.displacement).max() < 2e-2
    assert last.energy.released_energy >= 0.0


def test_a_bond_without_tensile_strength_carries_at_most_the_tolerance() -> None:
    """A bond with cohesion breaks at the first tension, anywhere in the wall."""
    plain = Joint(normal_stiffness=2.8e9, shear_stiffness=2.8e9, tensile_strength=0.0, cohesion=447.0, friction=2.0)
    stacked = Wall(length=0.936, height=1.188, block_length=0.117, block_height=0.198, thickness=0.08, bond="stack")
    scene = Scene(
        wall=stacked,
        joint=plain,
        block=BlockMaterial(density=3987.0, elastic_modulus=86.5e9),
        movement=Movement(kind="doming", central_deflection=2.44e-5, shape="three_loads"),
    )
    model = model_of(scene)
    for step in solve_path(model, WHOLE, 5):
        pulls = step.normal_stress * model.interfaces.contact_area
        assert pulls.max() < 1.05e-6 * model.mean_block_weight


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
        Equilibrium, "find_nearby", lambda self, state: (1.01 * CONTROL.fallback_residual_tolerance, state.displacement)
    )
    with pytest.raises(ConvergenceError, match="no equilibrium found"):
        list(quasi_static_path(model, briefly, scene.movement.increments))


# -- collapse and errors ----------------------------------------------------------------------------------------------


def on_a_plate(joint: Joint, drop: float) -> Assembly:
    """A brick on a plate that is pulled from under it, and a second brick that stays."""
    wall = Assembly(joint=joint)
    for x in (0.0, 0.5):
        plate = wall.add_block(rectangle(x, -0.1, x + 0.2, 0.0))
        wall.add_block(rectangle(x, 0.0, x + 0.2, 0.1))
        wall.support(plate)
    wall.move(0, y=-drop)
    return wall


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


def test_blocks_that_follow_their_support_do_not_collapse() -> None:
    ds = damagepred.solve(on_a_plate(Joint(), 5e-3), increments=4, solver=QUASI_STATIC)
    assert ds.attrs["status"] == "complete"
    assert ds["block_displacement_y"].values[-1, 1] == pytest.approx(-5e-3, abs=1e-5)


def test_an_unsupported_block_is_a_collapse_at_once() -> None:
    path = list(quasi_static_path(weak_pair(QUASI_STATIC), QUASI_STATIC, 3))
    assert [p.collapsed for p in path] == [True]
    assert path[0].number == 0


@pytest.mark.parametrize("half", [True, False])
def test_an_increment_without_equilibrium_names_itself_and_a_block(monkeypatch: pytest.MonkeyPatch, half: bool) -> None:
    original = Equilibrium.find

    def find(self: Equilibrium, state: State, start: np.ndarray | None = None, near: bool = False) -> float:
        return 1.0 if state.load_factor > 0.3 else original(self, state, start)

    monkeypatch.setattr(Equilibrium, "find", find)
    monkeypatch.setattr(
        Continuation, "snap_through", lambda self, state, start_load_factor, cycles_share=1.0: (state, 0.5)
    )
    model = wall_model(small_scene())
    settings, steps = Solver(method="quasi_static", symmetric_half=half), []
    with pytest.raises(ConvergenceError, match=r"increment 2: no equilibrium .* block \d+ \(x = ") as caught:
        steps.extend(solve_path(model, settings, 4))
    assert caught.value.increment == 2
    assert 0 <= caught.value.block < model.n_blocks
    ds = damagepred.solve(small_scene(method="quasi_static"), on_failure="return")  # type: ignore[arg-type]
    assert ds.attrs["status"] == "failed"
    assert "increment 2" in ds.attrs["status_message"]


# -- what an increment tells of itself --------------------------------------------------------------------------------


def test_quality_of_a_quasi_static_path_is_on_record() -> None:
    ds = damagepred.solve(cracking())
    for name in QUALITY:
        assert ds[name].dims == ("increment",)
        assert np.isfinite(ds[name].values).all(), name
        assert ds[name].attrs["units"] in ("J", "Pa")
    assert (np.diff(ds["released_energy"].values) >= -1e-9).all()
    assert ds["released_energy"].values[-1] > 0
    assert (ds["fracture_work"].values == 0).all()  # brittle bonds dissipate none
    assert (np.diff(ds["energy_error"].values) >= 0).all()


def test_every_factorisation_is_made_with_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    """With more threads sums are rounded otherwise, and a replayed sample differs from that of its study."""
    threads: set[int] = set()

    def counted(kernel: Callable[..., Any]) -> Callable[..., Any]:
        def called(*arguments: Any) -> Any:
            libraries = ThreadpoolController().select(user_api="blas").info()
            threads.update(library["num_threads"] for library in libraries)
            return kernel(*arguments)

        return called

    monkeypatch.setattr(residual, "run_newton", counted(residual.run_newton))
    monkeypatch.setattr(linear_system, "solve_from_python", counted(linear_system.solve_from_python))
    with threadpool_limits(2, user_api="blas"):
        list(solve_path(wall_model(small_scene()), WHOLE, 2))
    assert threads == {1}
