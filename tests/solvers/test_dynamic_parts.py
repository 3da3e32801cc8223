"""Parts of the dynamic solver one by one: points, neighbours, base motion, time step, settings."""

from pathlib import Path

import numpy as np
import pytest
from scipy import integrate

import damagepred
from damagepred import Assembly, BaseMotion, BlockMaterial, Dynamics, Joint, Solver
from damagepred.assembly.assembly import rectangle
from damagepred.errors import DivergenceError, InputError
from damagepred.solvers.dynamics.base_motion import base_displacement, from_record
from damagepred.solvers.dynamics.body_arrays import body_arrays
from damagepred.solvers.dynamics.body_motion import motion_of
from damagepred.solvers.dynamics.contact_search import neighbour_list, world_coordinates
from tests.assembly.reference import voronoi
from tests.solvers.dynamic_scenes import STIFF, THICKNESS, dry, stack, started

ORIGIN = np.array([0.3, 0.2])


def cells(shift: float = 0.0) -> Assembly:
    assembly = Assembly(thickness=THICKNESS, joint=Joint(tensile_strength=1e9, cohesion=1e9))
    for corners in voronoi(np.random.default_rng(4), 20):
        assembly.add_block(corners + shift)
    assembly.support(0)
    return assembly


def test_neighbours_are_those_of_a_search_of_all_pairs() -> None:
    model = cells().build(STIFF)
    scene = body_arrays(model, ORIGIN)
    motion = motion_of(model, ORIGIN)
    random = np.random.default_rng(3)
    motion.displacement[:-1] = 0.2 * random.standard_normal((model.n_blocks, 3))
    from damagepred.solvers.dynamics.body_motion import update_poses

    update_poses(motion)
    margin = 0.03
    near = neighbour_list(scene, motion.pose, margin)
    at = world_coordinates(motion.pose, scene.points["body"], scene.points["x"], scene.points["y"])
    edges = scene.edges
    c, s = motion.pose[edges["body"], 2], motion.pose[edges["body"], 3]
    along = np.column_stack((c * edges["along_x"] - s * edges["along_y"], s * edges["along_x"] + c * edges["along_y"]))
    end = world_coordinates(motion.pose, edges["body"], edges["x"], edges["y"])
    gap = (at[:, None, :] - end) @ np.zeros(2) + (
        along[:, 0] * (at[:, None, 1] - end[:, 1]) - along[:, 1] * (at[:, None, 0] - end[:, 0])
    )
    largest = np.maximum.reduceat(gap, scene.first_edge[:-1], axis=1)
    own = edges["polygon"][scene.points["own_edge"]]
    expected = {(i, j) for i, j in np.argwhere(largest < margin).tolist() if own[i] != j}
    found = {(i, int(j)) for i in range(len(at)) for j in near.polygon[near.first[i] : near.first[i + 1]]}
    assert len(expected) > 100
    assert found == expected
    point = np.repeat(np.arange(len(at)), np.diff(near.first))
    np.testing.assert_array_equal(edges["polygon"][near.edge], near.polygon)
    np.testing.assert_allclose(near.distance, gap[point, near.edge], atol=1e-12)


@pytest.mark.parametrize("kind", ["half_sine", "full_sine", "rectangular"])
@pytest.mark.parametrize("peak", [3.0, -7.0])
def test_pulses_are_the_integral_of_their_acceleration(kind: str, peak: float) -> None:
    motion = BaseMotion(kind=kind, acceleration=peak, duration=0.4, start=0.1, direction="y")
    shape = {
        "half_sine": lambda t: np.sin(np.pi * t / 0.4),
        "full_sine": lambda t: np.sin(2 * np.pi * t / 0.4),
        "rectangular": lambda t: 1.0,
    }[kind]

    def rates(t: float, state: np.ndarray) -> list[float]:
        return [state[1], peak * shape(t - 0.1) if 0.1 < t < 0.5 else 0.0]

    time = np.array([0.05, 0.2, 0.37, 0.5, 0.9])
    exact = integrate.solve_ivp(rates, (0, 1), [0.0, 0.0], t_eval=time, max_step=1e-3, rtol=1e-9, atol=1e-12)
    found = base_displacement([motion])(time)
    assert not found[:, 0].any()
    np.testing.assert_allclose(found[:, 1], exact.y[0], atol=2e-4 * abs(peak))


def test_records_of_acceleration_and_velocity_give_the_same_motion(tmp_path: Path) -> None:
    time = np.linspace(0.0, 1.0, 2001)
    acceleration = 2.0 * np.sin(7 * time) * np.exp(-time)
    velocity = integrate.cumulative_simpson(acceleration, x=time, initial=0)
    way = integrate.cumulative_simpson(velocity, x=time, initial=0)
    probe = np.array([0.0, 0.1234, 0.5, 0.98765, 1.0, 1.5])
    exact = np.interp(probe, time, way) + velocity[-1] * np.maximum(probe - 1.0, 0.0)
    for values, quantity in ((acceleration, "acceleration"), (velocity, "velocity")):
        np.testing.assert_allclose(from_record(time, values, quantity, "none")(probe), exact, atol=2e-6)
    np.testing.assert_allclose(from_record(time, way, "displacement", "none")(probe)[:-1], exact[:-1], atol=2e-6)
    rest = from_record(time, acceleration, "acceleration", "velocity")
    late = rest(np.array([1.0, 2.0]))
    assert late[1] == pytest.approx(late[0], abs=1e-12), "at rest at the end"
    file = tmp_path / "record.csv"
    file.write_text("time (s); m/s2\n" + "\n".join(f"{t:.6f}; {a:.9g}" for t, a in zip(time, acceleration)))
    read = base_displacement([BaseMotion(file=str(file), scale=2.0)])(probe)
    np.testing.assert_allclose(read[:, 0], 2 * exact, atol=4e-6)


def test_scenes_that_cannot_be_run_in_time_are_refused(tmp_path: Path) -> None:
    missing = Dynamics(base=(BaseMotion(file=str(tmp_path / "none.csv")),))
    with pytest.raises(InputError, match=r"none\.csv"):
        damagepred.solve(stack(1), dynamics=missing)
    empty = tmp_path / "empty.csv"
    empty.write_text("time, value\n0.0, 1.0\n")
    with pytest.raises(InputError, match="two lines or more"):
        damagepred.solve(stack(1), dynamics=Dynamics(base=(BaseMotion(file=str(empty)),)))
    with pytest.raises(InputError, match="lobatto"):
        damagepred.solve(stack(1), solver=Solver(quadrature="midpoint"), dynamics=Dynamics())
    weightless = Assembly()
    weightless.add_block(rectangle(0, 0, 1, 1), BlockMaterial(density=0.0))
    with pytest.raises(InputError, match="has no mass"):
        damagepred.solve(weightless, dynamics=Dynamics())
    with pytest.raises(InputError, match="no such block"):
        weightless.set_velocity(3, x=1.0)
    with pytest.raises(InputError, match="must be a finite number"):
        weightless.set_velocity(0, x=np.inf)


def test_a_study_of_runs_in_time_is_refused(tmp_path: Path) -> None:
    from damagepred.campaign.settings import StudySettings

    file = tmp_path / "study.toml"
    file.write_text("[study]\nsamples = 2\n[scene.dynamics]\nduration = 1.0\n")
    with pytest.raises(InputError, match=r"\[scene.dynamics\]: a study follows the movement"):
        StudySettings.from_toml(file)


@pytest.mark.parametrize(("faster", "diverges"), [(1.15, False), (2.0, True)])
def test_a_run_that_gains_half_of_its_energy_has_diverged(faster: float, diverges: bool) -> None:
    """The energy balance reports a gain of a third; a threefold energy ends the run."""
    flying = Assembly(gravity=(0.0, 0.0), thickness=THICKNESS, joint=dry(1e9, 0.3))
    flying.set_velocity(flying.add_block(rectangle(0.0, 0.0, 0.24, 0.075)), x=1.0)
    course = started(flying.build(STIFF), 0.1, 10)
    course.advance()
    had = course.energy.balance().kinetic_energy
    course.motion.velocity[:] *= faster
    if diverges:
        with pytest.raises(
            DivergenceError, match=r"more energy than was put in; fastest is block 0 .*time_step_safety"
        ):
            course.advance()
    else:
        course.advance()
    balance = course.energy.balance()
    assert balance.kinetic_energy < 5.0 * had
    assert balance.energy_error == pytest.approx(had * (1.0 - faster**2), rel=1e-9)


@pytest.mark.parametrize(
    ("time", "values"), [((0.0, 1.0), (0.0, 1e7)), ((0.0, 1.0), (1.0, 1e15)), ((0.0, 1e-9), (0.0, 1.0))]
)
def test_a_record_beyond_all_bounds_is_refused(time: tuple[float, ...], values: tuple[float, ...]) -> None:
    motion = BaseMotion(kind="record", time=time, values=values, scale=10.0)
    with np.errstate(all="raise"), pytest.raises(InputError, match="the record reaches"):
        base_displacement([motion])
