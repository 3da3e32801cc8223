"""The explicit solver: closed forms, symmetry, repeatability, and start."""

import dataclasses

import numpy as np
import pytest

from damagepred.assembly import Assembly, wall_model
from damagepred.assembly.assembly import rectangle
from damagepred.enumerations import ContactState
from damagepred.kernels.explicit.motion import damped
from damagepred.scene import Joint, Movement, Solver
from damagepred.solvers.driver import Outcome
from damagepred.solvers.explicit.stepper import ExplicitStepper, explicit_path
from damagepred.solvers.state.joint_history import fields_of
from tests.solvers.walls import small_scene, small_wall, weak_pair


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_drag_turns_with_the_motion(side: float) -> None:
    """By hand, with α = 0.8: a force of 3 slows 1 to rest in 1 / (1.8 · 3) of the step, then speeds up by 0.2 · 3."""
    assert damped(side, side * 0.5, 0.8) == pytest.approx(side * 1.1)
    assert damped(side, side * -0.5, 0.8) == pytest.approx(side * 0.1)
    assert damped(side, side * -3.0, 0.8) == pytest.approx(side * -0.6 * (1.0 - 1.0 / 5.4))
    for rest in (0.0, -0.0, 1e-18, -1e-18):  # continuous: the sign of what rounding leaves decides nothing
        assert damped(rest, side * 3.0, 0.8) == pytest.approx(side * 0.6, rel=1e-12)
    assert damped(side, side * -3.0, 0.0) == -2.0 * side


def test_rounding_is_not_amplified_within_some_cycles() -> None:
    """Two runs whose stiffnesses differ by 1e-12, begun at rest under a sudden movement of the ground."""
    model, settings = small_wall(), Solver(method="explicit")
    factor = 1.0 + 1e-12 * np.random.default_rng(50).uniform(-1.0, 1.0, len(model.properties.normal_stiffness))
    law = model.properties
    other = dataclasses.replace(model, properties=law._replace(normal_stiffness=factor * law.normal_stiffness))
    moved = []
    for wall in (model, other):
        stepper = ExplicitStepper(wall, settings)
        stepper.step_to(0.0)
        stepper.scheme._cycle(100, 1.0, 0.0, 1e-4)
        moved.append(stepper.scheme.motion.displacement.copy())
    assert np.abs(moved[0]).max() > 1e-5
    assert np.abs(moved[0] - moved[1]).max() < 1e-14


def test_a_wall_that_moves_steadily_does_not_ring(monkeypatch: pytest.MonkeyPatch) -> None:
    """Damping opposes what goes beyond the drift: with a drag of constant sign, forces were six times as large."""
    stepper = ExplicitStepper(small_wall(), Solver(method="explicit"))
    stepper.step_to(0.0)
    scheme, forces = stepper.scheme, []
    run = scheme._cycle

    def watched(*arguments: float) -> None:
        run(*arguments)
        forces.append(float(scheme.unbalanced_force_ratio().max()))

    monkeypatch.setattr(scheme, "_cycle", watched)
    for end in (0.125, 0.25):
        scheme.advance(10_000, load_factor_to=end, load_to=1.0)
        assert not scheme.motion.drift.any()
    assert len(forces) == 200
    assert np.median(forces) < 0.03


def test_elastic_start_is_harmless():
    model, settings = small_wall(), Solver(method="explicit", tolerance=1e-6)
    direct = next(explicit_path(model, settings, 4))
    cycled = next(explicit_path(model, settings, 4, elastic_start=False))
    for name in ("displacement", "normal_stress"):
        one, other = getattr(direct, name), getattr(cycled, name)
        assert np.abs(one - other).max() < 1e-4 * np.abs(one).max()
    assert (direct.state == ContactState.INTACT).all()
    assert direct.counters.cycles < cycled.counters.cycles / 5
    assert direct.base_reaction == pytest.approx(-model.supports.load[1::3].sum(), rel=1e-9)


def test_no_elastic_start_where_the_dpc_would_have_to_pull():
    """Beside the window the elastic dpc would be in tension: both settings then run the same cycles."""
    model, settings = small_wall(0.48), Solver(method="explicit", tolerance=1e-2)
    one, other = (next(explicit_path(model, settings, 4, elastic_start=start)) for start in (True, False))
    np.testing.assert_array_equal(one.displacement, other.displacement)
    assert one.counters.cycles == other.counters.cycles > settings.ramp_cycles


def test_an_unsupported_block_collapses():
    """A block below a joint without strength collapses with every start."""
    settings = Solver(method="explicit", tolerance=1e-3, ramp_cycles=100)
    rest = next(explicit_path(weak_pair(settings), settings, 1))
    assert rest.collapsed
    assert (rest.state == ContactState.CRACKED).all()


def test_slip_and_stress_of_a_state_belong_to_the_same_cycle():
    """A brick slides without friction: tau = k_s (u_s - s) is zero after any cycle."""
    pair = Assembly(joint=Joint(tensile_strength=0.0, cohesion=0.0, friction=0.0))
    base = pair.add_block(rectangle(0.0, 0.0, 0.24, 0.075))
    brick = pair.add_block(rectangle(0.0, 0.075, 0.24, 0.15))
    pair.support(base)
    pair.load(brick, x=1.0)
    model = pair.build()
    path = ExplicitStepper(model, Solver(method="explicit"))
    path.scheme.advance(500, 0.0, 1.0)
    picture, stiffness = path.report(Outcome(1.0, balanced=False, collapsed=False)), model.properties.shear_stiffness[0]
    moved = picture.displacement[brick] - picture.displacement[base]
    slid = moved[0] * model.interfaces.normal_y[0] * (1.0 if model.interfaces.block_a[0] == base else -1.0)
    assert abs(slid) > 1e-6
    elastic = stiffness * (slid - picture.slip)
    np.testing.assert_allclose(picture.shear_stress, elastic, atol=1e-9 * stiffness * abs(slid))


def test_the_weight_of_the_wall_reaches_the_ground_at_every_increment():
    model = small_wall()
    weight = -model.supports.load[1::3].sum()
    for increment in explicit_path(model, small_scene().solver, 4):
        assert increment.base_reaction == pytest.approx(weight, rel=5e-3)
        assert increment.unbalanced_force_ratio < 1e-2


@pytest.mark.parametrize("residual_cohesion", [0.0, 0.5e5])
def test_a_softening_wall_is_in_equilibrium_within_its_law(residual_cohesion):
    joint = Joint(tensile_strength=1e5, cohesion=1.5e5, fracture_energy=5.0, residual_cohesion=residual_cohesion)
    movement = Movement(kind="doming", central_deflection=4e-3, increments=4)
    scene = dataclasses.replace(small_scene(0.48, movement), joint=joint)
    model, law = wall_model(scene), wall_model(scene).properties
    path, kappa = ExplicitStepper(model, scene.solver), 0.0
    strength, critical = law.tensile_strength[:, None], law.critical_opening[:, None]
    elastic = strength / law.normal_stiffness[:, None]
    for number in range(5):
        path.apply(number / 4)
        assert not path.equilibrate().collapsed
        run = path.scheme
        history = run.joint_history()
        field = fields_of(model, history, run.motion.displacement, run.load_factor)
        bond = np.where(
            history.cracked & (critical > 0),
            np.clip((critical - history.kappa) / np.where(critical > 0, critical - elastic, 1.0), 0.0, 1.0),
            1.0 - history.cracked,
        )
        u, sigma, tau = field.opening - history.dilatant_opening, field.normal_stress, field.shear_stress
        pulled = strength * bond * np.minimum(u / np.where(history.kappa > 0, history.kappa, 1.0), 1.0)
        expected = np.where((u > 0) & history.cracked, pulled, law.normal_stiffness[:, None] * u)
        # the blocks have moved once since the joints were updated
        np.testing.assert_allclose(sigma, expected, atol=1e-4 * 1e5)
        left = law.residual_cohesion[:, None]
        limit = left + bond * (law.cohesion[:, None] - left) - sigma * law.friction[:, None]
        assert (np.abs(tau) <= np.maximum(limit, 0.0) * (1 + 1e-9) + 1e-4 * 1e5).all()
        assert (history.kappa >= np.where(history.cracked & (critical > 0), u, 0.0) * (1 - 1e-3)).all()
        assert (history.kappa >= kappa).all()  # the history keeps the largest opening
        kappa = history.kappa
    partly = history.cracked & (bond > 0.0)
    whole = history.cracked & (bond == 0.0) & (critical > 0)
    assert partly.sum() > 10
    assert whole.sum() > 10
