"""Driver on a wall of one number, step control by the energy balance, and the bed under a footing."""

from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import damagepred
from damagepred import Assembly
from damagepred.assembly import Model, wall_model
from damagepred.assembly.assembly import rectangle
from damagepred.damage import load_table
from damagepred.diagnostics import Counters
from damagepred.enumerations import ContactKind
from damagepred.errors import ConvergenceError
from damagepred.results.rejudge import footing_gap_note
from damagepred.scene import Damage, Dpc, Footing, Joint, Movement, Scene, Solver, Wall
from damagepred.solvers import solve_path
from damagepred.solvers.driver import Bracket, Outcome, _locate_zero_support_load, _Start, follow_movement
from damagepred.solvers.quasi_static import step_control
from damagepred.solvers.quasi_static.energy_balance import EnergyBalance
from damagepred.solvers.quasi_static.step_control import COLLAPSE_BRACKET, MAX_EVENT_CUTS, MAX_HALVINGS, StepControl
from damagepred.solvers.state.increment import Increment
from damagepred.solvers.state.wall_state import State
from tests.solvers.walls import stack

DATA = Path(__file__).parents[2] / "data"
DRY = Joint(tensile_strength=0.0, cohesion=0.0)


@pytest.mark.parametrize("name", ["dishing", "doming", "window_dishing", "window_doming"])
def test_the_tested_walls_balance_at_twenty_increments(name: str) -> None:
    """Without step control the energy error of the solid walls is 8.1 and 6.8 % of the work."""
    scene = Scene.from_toml(DATA / f"bryant_{name}.toml")
    assert scene.movement.increments == 20
    ds = damagepred.solve(scene)
    assert ds["energy_error"][-1] < 0.01 * np.abs(ds["external_work"]).max()


def over_a_gap() -> Assembly:
    """Return a dry wall in running bond whose three middle bricks lose their ground."""
    wall = Assembly(thickness=0.11, joint=DRY)
    for course in range(6):
        inner = [0.24 * (i + 0.5 * (course % 2)) for i in range(1 - course % 2, 5)]
        for left, right in pairwise([0.0, *inner, 1.2]):
            wall.add_block(rectangle(left, 0.075 * course, right, 0.075 * (course + 1)))
    for left, right, drop in ((-0.2, 0.239, 0.0), (0.241, 0.959, 8e-3), (0.961, 1.4, 0.0)):
        piece = wall.add_block(rectangle(left, -0.2, right, 0.0))
        wall.support(piece)
        if drop:
            wall.move(piece, y=-drop)
    return wall


def test_few_increments_follow_a_dry_wall_over_a_gap_as_many_do_and_cost_less() -> None:
    """In its first steps friction decides which of the bricks it holds."""
    model = over_a_gap().build(Solver())
    friction, iterations = [], []
    for count in (1, 5, 20, 80):
        path = list(solve_path(model, Solver(), count))
        friction.append(path[-1].energy.friction_work)
        iterations.append(sum(step.counters.newton_iterations for step in path))
    np.testing.assert_allclose(friction, friction[-1], rtol=1e-3)
    assert iterations == sorted(iterations)


GOAL = (1.0, 0.2)


def started(locates_collapse: bool = False) -> tuple[StepControl, State]:
    """Return the step control of an increment from dead load to 20 % of the movement."""
    state = replace(State.rest(stack(2, Solver())), load=1.0)
    return StepControl.start(state, GOAL, locates_collapse), state


def load_factor(target: tuple[float, float]) -> float:
    assert target[0] == 1.0
    return target[1]


def test_an_increment_starts_with_its_goal_and_limits_in_proportion() -> None:
    control, state = started()
    assert control.target(state) == GOAL
    assert control.minimum_step == 0.2 / 2**MAX_HALVINGS
    assert control.minimum_event_step == 0.2 * step_control.MINIMUM_EVENT_STEP
    assert control.collapse_bracket >= control.minimum_step
    assert started(locates_collapse=True)[0].collapse_bracket == COLLAPSE_BRACKET


def test_steps_without_equilibrium_are_halved_until_they_are_too_short() -> None:
    control, state = started()
    target, halvings = GOAL, 0
    while control.may_halve(target[1], allowed=MAX_HALVINGS):
        control.halve_step(state, target)
        target, halvings = control.target(state), halvings + 1
    assert halvings == MAX_HALVINGS
    assert load_factor(target) == 0.2 / 2**halvings
    assert not started()[0].may_halve(0.2, allowed=0)
    control.accept_step(target)
    assert (control.halvings, control.accepted_steps, control.next_point) == (halvings - 1, 1, None)


def test_a_rejected_target_is_approached_by_midpoints_and_tried_again() -> None:
    control, state = started()
    control.reject_target((1.0, 0.1))
    assert load_factor(control.target(state)) == 0.05
    state.load_factor = 0.1 - 0.9 * control.minimum_step
    assert load_factor(control.target(state)) == 0.1
    step = control.minimum_step
    control.accept_distant((1.0, 0.07))  # another target
    assert control.rejected_target == (1.0, 0.1)
    control.accept_distant((1.0, 0.1))
    assert (control.rejected_target, control.minimum_step) == (None, step * step_control.DISTANT_STEP_GROWTH)


def test_an_event_is_bracketed_interpolated_and_passed() -> None:
    control, state = started()
    control.bracket_event(state, (1.0, 0.1), 0.3)
    assert load_factor(control.target(state)) == pytest.approx(0.03)
    for share, kept in ((-1.0, step_control.MINIMUM_EVENT_SHARE), (2.0, step_control.MAXIMUM_EVENT_SHARE)):
        control.bracket_event(state, (1.0, 0.1), share)
        assert load_factor(control.target(state)) == pytest.approx(0.1 * kept)
    assert control.event_cuts == MAX_EVENT_CUTS - 1
    control.bracket_event(state, (1.0, 0.1), 0.3)  # interpolation is given up
    assert load_factor(control.target(state)) == pytest.approx(0.05)
    control.next_point = None
    assert load_factor(control.target(state)) == 0.1  # no farther than the overload
    control.pass_event()
    assert (control.overloaded_point, control.event_cuts, control.target(state)) == (None, 0, GOAL)


def test_an_overload_that_is_gone_in_smaller_steps_makes_steps_to_events_longer() -> None:
    control, state = started()
    control.bracket_event(state, (1.0, 0.1), 0.3)
    step = control.minimum_event_step
    control.accept_step((1.0, 0.03))
    assert control.overloaded_point == (1.0, 0.1)
    control.accept_step((1.0, 0.1))
    assert (control.overloaded_point, control.minimum_event_step) == (None, step * step_control.EVENT_STEP_GROWTH)


def test_the_energy_balance_shortens_steps() -> None:
    control, state = started()
    control.refine_step(0.04, 0.1, 1.0)
    assert load_factor(control.target(state)) == pytest.approx(0.04)


def test_collapse_is_bracketed_from_both_sides() -> None:
    control, state = started(locates_collapse=True)
    assert not control.has_located_collapse(state)
    control.reject_target((1.0, 0.1))
    control.bracket_collapse((1.0, 0.1), state.copy(), 0.7)
    assert (control.collapsed_state.load_factor, control.collapse_residual, control.rejected_target) == (0.1, 0.7, None)
    assert control.minimum_step == COLLAPSE_BRACKET
    assert load_factor(control.target(state)) == 0.05
    state.load_factor = 0.1 - 0.9 * COLLAPSE_BRACKET
    assert control.has_located_collapse(state)


def test_a_path_jumps_where_its_error_does_not_fall_with_the_step() -> None:
    control, _ = started()
    assert not control.is_jump(0.01, 1.0)  # nothing to compare with
    control.refine_step(0.04, 0.1, 1.0)
    assert control.is_jump(0.05, 0.76)
    assert not control.is_jump(0.05, 0.75)
    assert not control.is_jump(0.051, 0.9)  # hardly shorter


def test_what_a_jump_loses_is_released() -> None:
    before = EnergyBalance(np.zeros(3), external_work=5.0, elastic_energy=3.0, friction_work=1.0, energy_error=1.0)
    after = EnergyBalance(np.zeros(3), 9, 3, friction_work=2, fracture_work=0.5, energy_error=3.5, released_energy=0)
    after.count_as_snap_through(before)
    assert (after.energy_error, after.released_energy, after.snap_through_energy) == (1.0, 2.5, 2.5)
    gained = EnergyBalance(np.zeros(3), 5.0, 4.0, friction_work=1.0, energy_error=2.0)
    gained.count_as_snap_through(before)
    assert (gained.energy_error, gained.released_energy) == (2.0, 0.0)


NONE = np.zeros((1, 1))


@dataclass
class Scripted:
    """A stepper whose wall collapses and unloads its supports at given load factors."""

    collapses_at: float = np.inf
    unloads_at: float = np.inf
    hesitates: tuple[float, float] = (np.inf, np.inf)
    bracket: Bracket = field(default_factory=lambda: Bracket(1e-9, 1e-9, 1e-3))
    load_factor: float = 0.0
    tried: list[float] = field(default_factory=list)
    restored: list[float] = field(default_factory=list)
    number: int = -1

    def begin_increment(self, number: int) -> None:
        self.number = number

    def step_to(self, load_factor: float) -> Outcome:
        self.load_factor = load_factor
        self.tried.append(load_factor)
        if self.hesitates[0] < load_factor < self.hesitates[1]:
            raise ConvergenceError("neither", increment=self.number)
        fell = load_factor > self.collapses_at
        return Outcome(0.0, balanced=not fell, collapsed=fell)

    def support_load(self) -> float:
        return 100.0 * (self.unloads_at**3 - self.load_factor**3)

    def checkpoint(self) -> float:
        return self.load_factor

    def restore(self, checkpoint: float) -> None:
        self.load_factor = checkpoint
        self.restored.append(checkpoint)

    def report(self, outcome: Outcome) -> Increment:
        state = NONE.astype(np.int8)
        return Increment(self.number, self.load_factor, *[NONE] * 5, state, 0.0, collapsed=outcome.collapsed)

    def counters(self) -> Counters:
        return Counters(cycles=len(self.tried))

    def end_increment(self) -> None:
        """Do nothing."""

    def support_after_load(self) -> None:
        """Do nothing."""


def wall(live: bool = False) -> Model:
    """Return a stack, under live load if asked for."""
    model = stack(2, Solver())
    load = np.ones_like(model.supports.live_load) if live else np.zeros_like(model.supports.live_load)
    return replace(model, supports=model.supports._replace(live_load=load))


def test_collapse_is_bisected_under_live_load_alone() -> None:
    last = list(follow_movement(Scripted(collapses_at=0.6), wall(), 4))[-1]
    assert (last.number, last.load_factor, last.end.last_stable_load_factor) == (3, 0.75, 0.5)
    last = list(follow_movement(Scripted(collapses_at=0.6), wall(live=True), 4))[-1]
    assert last.end.last_stable_load_factor <= 0.6 < last.load_factor <= last.end.last_stable_load_factor + 1e-3
    located = Scripted(collapses_at=0.6, bracket=Bracket(1e-9, 1e-9))
    assert list(follow_movement(located, wall(live=True), 4))[-1].load_factor == 0.75


def test_bisection_ends_where_a_wall_neither_balances_nor_collapses() -> None:
    last = list(follow_movement(Scripted(collapses_at=0.6, hesitates=(0.6, 0.65)), wall(live=True), 4))[-1]
    assert (last.end.last_stable_load_factor, last.load_factor) == (0.5, 0.75)


def test_zero_support_load_is_approached_from_loaded_states() -> None:
    stepper = Scripted(unloads_at=0.6)
    _locate_zero_support_load(stepper, _Start(0.0, 0.0, stepper.support_load()), 1.0, stepper.step_to(1.0))
    assert stepper.load_factor == pytest.approx(0.6, abs=1e-9)
    assert stepper.restored == sorted(stepper.restored)
    assert 0.5 < stepper.restored[-1] < 0.6


MM = 1e-3
BED = ContactKind.FOOTING_INTERFACE
LOOSE = Joint(tensile_strength=0.0, cohesion=0.0)
STRONG = Joint(tensile_strength=1e8, cohesion=1e8)


def stands_on(kind: str, deflection: float, joint: Joint | None = LOOSE, **more) -> Scene:
    """A wall of unbreakable mortar on ground that deforms to a parabola."""
    return Scene(
        wall=Wall(length=2.88, height=0.6),
        joint=STRONG,
        footing=Footing(joint=joint),
        movement=Movement(kind=kind, central_deflection=deflection, increments=2, shape="parabola"),
        solver=Solver(blocks="rigid"),
        **more,
    )


def test_a_wall_that_spans_a_dish_gapes_in_its_middle():
    """It rests on its two ends, where a parabola lies higher by d than in the middle; threshold of 2 mm."""
    scene = stands_on("dishing", 6 * MM, damage=Damage(footing_threshold=2 * MM))
    wall = damagepred.solve(scene)
    assert float(wall["footing_opening_max"][-1]) == pytest.approx(6 * MM, rel=0.02)
    assert float(wall["footing_separation_length"][-1]) == pytest.approx(2.88 * np.sqrt(4 / 6), rel=0.02)


@pytest.mark.parametrize(("rule", "dpc", "counts"), [(False, None, False), (True, None, True), (True, Dpc(), False)])
def test_the_gap_counts_if_set_and_without_a_dpc(rule: bool, dpc: Dpc | None, counts: bool):
    wall = damagepred.solve(stands_on("doming", 7 * MM, dpc=dpc, damage=Damage(count_footing_gap=rule)))
    gap = np.maximum(wall["footing_opening_max"].values, wall["dpc_opening_max"].values)
    assert gap[-1] > 5 * MM
    expected = load_table("as2870").by_width(gap if counts else np.zeros(3))
    assert wall["damage_category"].values.tolist() == expected.tolist()
    assert wall["damage_category_band"].values.tolist() == expected.tolist()
    assert bool(footing_gap_note(wall)) == (not rule)


def test_a_gap_that_does_not_count_is_reported():
    wall = damagepred.solve(stands_on("doming", 7 * MM))
    assert "would be category 3" in footing_gap_note(wall)
    assert "--footing-gap" in footing_gap_note(wall)


@pytest.mark.parametrize("shape", ["parabola", "jacks", "mound"])
@pytest.mark.parametrize("footing", [None, "deformable"])
def test_the_bed_has_separate_properties_on_any_support(shape: str, footing: str | None):
    if shape != "parabola" and footing is not None:
        return
    own = Joint(tensile_strength=0.1e6, cohesion=0.2e6, friction=0.6, normal_stiffness=50e9)
    movement = Movement(shape=shape)
    solver = Solver(footing=footing)
    scene = Scene(wall=Wall(length=2.88, height=0.6), footing=Footing(joint=own), movement=movement, solver=solver)
    model = wall_model(scene)
    bed = model.interfaces.kind == BED
    assert bed.any()
    for name in ("tensile_strength", "cohesion", "friction"):
        values = getattr(model.properties, name)
        assert (values[bed] == getattr(own, name)).all()
        assert (values[~bed & (model.interfaces.kind <= 1)] == getattr(Joint(), name)).all()
