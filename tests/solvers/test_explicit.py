"""The explicit solver: largest stable time step, errors with increment and block, drag, and start."""

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import eigsh

from damagepred.assembly import Assembly
from damagepred.assembly.assembly import rectangle
from damagepred.enumerations import ContactState
from damagepred.errors import ConvergenceError, DivergenceError
from damagepred.kernels.explicit.motion import damped
from damagepred.scene import Solver
from damagepred.solvers.explicit import scheme
from damagepred.solvers.explicit.scheme import scaled_mass
from damagepred.solvers.explicit.stepper import ExplicitStepper, explicit_path
from damagepred.solvers.system.discrete_system import DiscreteSystem
from tests.solvers.walls import small_scene, small_wall, stack, weak_pair

LIMIT = 1.0 / np.sqrt(1.0 - 0.8)
"""Largest stable time step under local damping 0.8, 2/√(1 - α²), over the one that masses keep, 2/√(1 + α)."""


@pytest.mark.parametrize("damping", [0.0, 0.8])
@pytest.mark.parametrize("wall", ["solid", "window", "stack"])
def test_masses_keep_the_highest_frequency_below_the_limit(wall, damping):
    """omega_max^2 <= 4 / (1 + damping), by eigenvalues rather than by Gershgorin's bound."""
    model = {
        "solid": small_wall,
        "window": lambda: small_wall(0.48),
        "stack": lambda: stack(10, Solver(method="explicit")),
    }[wall]()
    mass = scaled_mass(model, damping, 1.0)
    free = np.isfinite(mass)
    scale = sparse.diags_array(1.0 / np.sqrt(mass[free]))
    stiffness = scale @ DiscreteSystem.of(model).elastic_stiffness[free][:, free] @ scale
    largest = eigsh(stiffness, k=1, which="LA", return_eigenvectors=False)[0]
    limit = 4.0 / (1.0 + damping)
    assert largest <= limit * (1 + 1e-9)
    assert largest > 0.5 * limit  # and the step is not shorter than necessary


def vibrating(safety: float, cycles: int, damping: float = 0.8) -> np.ndarray:
    """Energy of an intact, weightless wall after a random impulse, every 100 cycles."""
    model = small_wall()
    model.properties.tensile_strength[:] = 1e30
    model.properties.cohesion[:] = 1e30
    run = scheme.DampedTimeStepping(
        model, Solver(method="explicit", time_step_safety=min(safety, 1.0), damping=damping)
    )
    if safety > 1.0:
        run.motion.inverse_mass[:] *= safety**2
    run.motion.load[:] = 0.0
    rng = np.random.default_rng(0)
    run.motion.velocity[run.free] = 1e-6 * rng.normal(size=run.free.size) / run.arm[run.free]
    stiffness = DiscreteSystem.of(model).elastic_stiffness
    energy = [run.kinetic_energy()]
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(cycles // 100):
            run._cycle(100, 0.0, 0.0, 0.0)
            u = run.motion.displacement
            energy.append(run.kinetic_energy() + 0.5 * float(u @ (stiffness @ u)))
    return np.array(energy)


def test_the_full_time_step_is_stable_with_local_damping():
    energy = vibrating(1.0, 5000)
    assert energy.max() == energy[0]
    assert energy[-1] < 1e-4 * energy[0]


def test_a_time_step_beyond_the_limit_is_not_stable():
    energy = vibrating(1.5 * LIMIT, 2000)
    assert not energy[-1] < 1e6 * energy[0]  # NaN included


def test_the_time_step_has_a_margin_with_local_damping():
    energy = vibrating(0.9 * LIMIT, 2000)
    assert energy[-1] < 1e-4 * energy[0]


@pytest.mark.parametrize("elastic_start", [True, False])
def test_divergence_is_distinguished_from_collapse_and_names_increment_and_block(monkeypatch, elastic_start):
    model = small_wall()
    monkeypatch.setattr(scheme, "scaled_mass", lambda *a: scaled_mass(*a) / (1.5 * LIMIT) ** 2)
    with pytest.raises(DivergenceError, match=r"increment \d+ after .*block \d+ \(x = .*time_step_safety") as caught:
        list(explicit_path(model, small_scene().solver, 4, elastic_start=elastic_start))
    assert caught.value.increment in (0, 1)
    assert 0 <= caught.value.block < model.n_blocks


def test_a_displacement_that_is_not_a_number_is_detected():
    path = ExplicitStepper(small_wall(), Solver(method="explicit"))
    path.scheme.motion.velocity[3 * 17] = np.nan
    path.begin_increment(3)
    with pytest.raises(DivergenceError, match="no longer a number") as caught:
        path.equilibrate()
    assert caught.value.increment == 3
    assert caught.value.block >= 0


def test_an_increment_without_convergence_names_itself_and_a_block():
    settings = small_scene(maximum_cycles=50, ramp_cycles=50).solver
    with pytest.raises(ConvergenceError, match=r"increment 0 .* 50 cycles.*block \d+ \(x = ") as caught:
        list(explicit_path(small_wall(), settings, 4, elastic_start=False))
    assert caught.value.increment == 0
    assert caught.value.block >= 0


@pytest.mark.parametrize("zone_size", [0.0, 0.08])
def test_masses_do_not_depend_on_where_the_origin_is(zone_size):
    """The lever arm of the ground, which does not move, must not enter."""

    def masses(far: float) -> np.ndarray:
        wall = Assembly()
        for i in range(3):
            wall.add_block(rectangle(far, far + 0.075 * i, far + 0.24, far + 0.075 * (i + 1)), zone_size=zone_size)
        wall.rest_on_ground([0])
        return scaled_mass(wall.build(Solver(method="explicit")), 0.8, 0.9)

    near, far = masses(0.0), masses(1e4)
    moves = np.isfinite(near)
    np.testing.assert_array_equal(moves, np.isfinite(far))
    np.testing.assert_allclose(far[moves], near[moves], rtol=1e-9)


@pytest.mark.parametrize("beyond", [1.1, 1.2, 1.3, 1.5, 2.0])
def test_numerical_instability_is_not_reported_as_collapse(monkeypatch, beyond):
    """Divergence under the ramp of the dead load breaks joints, too; it must be distinguished from collapse."""
    settings = Solver(method="explicit", time_step_safety=1.0)
    model = stack(4, settings)
    monkeypatch.setattr(scheme, "scaled_mass", lambda *a: scaled_mass(*a) / (beyond * LIMIT) ** 2)
    with pytest.raises((DivergenceError, ConvergenceError), match="time_step_safety"):
        list(explicit_path(model, settings, 1, elastic_start=False))


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
