"""The explicit solver: closed forms, symmetry, repeatability, and start."""

import numpy as np
import pytest

from damagepred.enumerations import ContactState
from damagepred.kernels.explicit.motion import damped
from damagepred.scene import Solver
from damagepred.solvers.explicit.stepper import ExplicitStepper, explicit_path
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


def test_the_weight_of_the_wall_reaches_the_ground_at_every_increment():
    model = small_wall()
    weight = -model.supports.load[1::3].sum()
    for increment in explicit_path(model, small_scene().solver, 4):
        assert increment.base_reaction == pytest.approx(weight, rel=5e-3)
        assert increment.residuals.unbalanced_force_ratio < 1e-2
