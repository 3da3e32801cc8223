"""Parts of the dynamic solver one by one: points, neighbours, base motion, time step, settings."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import integrate

import damagepred
from damagepred import Assembly, Scene
from damagepred.assembly.assembly import rectangle
from damagepred.errors import DivergenceError, InputError
from damagepred.kernels.dynamics.contact import BONDED, FREE
from damagepred.scene import BaseMotion, BlockMaterial, Dynamics, Joint, Solver
from damagepred.solvers.dynamics.base_motion import base_displacement, from_record
from damagepred.solvers.dynamics.body_arrays import body_arrays
from damagepred.solvers.dynamics.body_motion import motion_of
from damagepred.solvers.dynamics.contact_search import neighbour_list, world_coordinates
from damagepred.solvers.dynamics.options import DEFAULTS
from damagepred.solvers.dynamics.time_step import time_step
from damagepred.solvers.system.discrete_system import DiscreteSystem
from tests.assembly.reference import voronoi
from tests.solvers.dynamic_scenes import STIFF, THICKNESS, dry, on_plate, stack, started

ORIGIN = np.array([0.3, 0.2])


def cells(shift: float = 0.0) -> Assembly:
    assembly = Assembly(thickness=THICKNESS, joint=Joint(tensile_strength=1e9, cohesion=1e9))
    for corners in voronoi(np.random.default_rng(4), 20):
        assembly.add_block(corners + shift)
    assembly.support(0)
    return assembly


@pytest.mark.parametrize("assembly", [cells(), stack(3), on_plate()])
def test_points_cover_every_face_once(assembly: Assembly) -> None:
    model = assembly.build(STIFF)
    scene = body_arrays(model, ORIGIN, DEFAULTS)
    points, edges = scene.points, scene.edges
    own = edges["polygon"][points["own_edge"]] < model.n_blocks
    covered = np.bincount(points["own_edge"][own], 2 * points["area"][own] / THICKNESS, len(edges))
    faces = edges["polygon"] < model.n_blocks
    np.testing.assert_allclose(covered[faces], edges["length"][faces], rtol=1e-9)
    # each lies on its face, between its ends
    e = edges[points["own_edge"]]
    x, y = points["x"] - e["x"], points["y"] - e["y"]
    assert np.abs(e["along_x"] * y - e["along_y"] * x).max() < 1e-12
    along = e["along_x"] * x + e["along_y"] * y
    assert ((along > e["low"] - 1e-12) & (along < e["length"] + 1e-12)).all()
    # every corner has a point on both its faces
    ends = np.unique(np.column_stack((points["own_edge"], np.round(along / e["length"], 9)))[own], axis=0)
    for edge in np.flatnonzero(faces):
        assert {0.0, 1.0} <= set(ends[ends[:, 0] == edge][:, 1])


def test_forces_are_those_of_small_displacements() -> None:
    """The stiffness of all points together, by differences, is that of the contacts of the static solvers."""
    from damagepred.kernels.dynamics.cycle import first_forces
    from damagepred.solvers.dynamics.body_motion import update_poses
    from damagepred.solvers.dynamics.energy_balance import EnergyTerms

    model = cells().build(STIFF)
    course = started(model, 1e-4, start="unstressed", new_contacts=False)
    exact = DiscreteSystem.of(model).elastic_stiffness.toarray()
    random = np.random.default_rng(2)
    small = 1e-9 * random.standard_normal((model.n_blocks + 1, 3))
    small[-1, 2] = 0.0  # the ground does not turn
    course.motion.displacement[:] = small
    update_poses(course.motion)
    first_forces(
        course.bodies,
        course.search.neighbours,
        course.motion,
        None,
        None,
        False,
        EnergyTerms(np.zeros(4), np.zeros(3)),
    )
    found = -course.motion.force[:-1]
    expected = (exact @ small.ravel()).reshape(-1, 3)[:-1]
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


def test_neighbours_are_those_of_a_search_of_all_pairs() -> None:
    model = cells().build(STIFF)
    scene = body_arrays(model, ORIGIN, DEFAULTS)
    motion = motion_of(model, ORIGIN)
    random = np.random.default_rng(3)
    motion.displacement[:-1] = 0.2 * random.standard_normal((model.n_blocks, 3))
    from damagepred.solvers.dynamics.body_motion import update_poses

    update_poses(motion)
    margin = 0.03
    near = neighbour_list(scene, motion.pose, margin, DEFAULTS.wide_block_ratio)
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
    motion = BaseMotion(kind=kind, acceleration=peak, duration=0.4, start=0.1, direction="y")  # type: ignore[arg-type]
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


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"duration": 0}, r"\[dynamics\] duration = 0: must be greater than 0 s"),
        ({"duration": "5 m"}, "wrong kind of unit"),
        ({"damping": "some"}, "must be 'none', 'viscous', 'rayleigh' or 'local'"),
        ({"damping": "rayleigh", "frequency": 200}, "second_frequency = 100 Hz: must be above frequency = 200 Hz"),
        ({"base": [{"kind": "half_sine"}]}, "needs one greater than 0 s"),
        ({"base": [{}]}, "a record needs two points or more"),
        ({"base": [{"time": [0, 1, 1], "values": [0, 1, 2]}]}, "time: must rise"),
        ({"base": [{"kind": "full_sine", "duration": 1, "file": "a.csv"}]}, "only read with kind = 'record'"),
        ({"bse": []}, "unknown key"),
    ],
)
def test_bad_settings_are_named(tables: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Scene.from_dict({"dynamics": tables})


def test_settings_go_through_toml() -> None:
    scene = Scene.from_dict(
        {
            "dynamics": {
                "duration": "1500 ms",
                "base": [
                    {"kind": "half_sine", "acceleration": "3 m/s2", "duration": 0.2},
                    {"time": [0, 1.0], "values": [0, 0.2], "direction": "y"},
                ],
            }
        }
    )
    assert scene.dynamics is not None
    assert scene.dynamics.duration == 1.5
    assert Scene.from_dict(scene.to_dict()) == scene
    assert "dynamics.base.1.acceleration" in scene.number_places()


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


def test_damping_takes_its_share_of_the_time_step() -> None:
    omega = 1000.0
    bare = time_step(omega, Dynamics(time_step_safety=1.0))
    assert bare == pytest.approx(2 / omega)
    assert time_step(omega, Dynamics(time_step_safety=1.0, damping="viscous")) == bare
    local = time_step(omega, Dynamics(time_step_safety=1.0, damping="local", local_damping=0.8))
    assert local == pytest.approx(bare / np.sqrt(1.8))
    settings = Dynamics(time_step_safety=1.0, damping="rayleigh", damping_ratio=0.2)
    xi = 0.5 * settings.stiffness_damping * omega
    assert time_step(omega, settings) == pytest.approx(bare * (np.sqrt(1 + xi * xi) - xi))


def test_energy_of_a_first_state_and_points() -> None:
    course = started(stack(2).build(STIFF), 1e-3)
    assert course.begins_in_equilibrium
    status = course.bodies.points["status"]
    assert (status[: 2 * course.model.n_contacts] == BONDED).all()
    assert (status[2 * course.model.n_contacts :] == FREE).all()
    assert course.energy.balance().energy_error == 0.0


def test_steps_are_counted_in_any_batches() -> None:
    """The clock may be checked many times before an output."""
    course = started(stack(2).build(STIFF), 0.01, 2)
    course.options = replace(DEFAULTS, point_steps_per_check=7 * len(course.bodies.points))
    assert course.timing.steps > 20
    assert [step.counters.cycles for step in course] == [0, course.timing.steps, course.timing.steps]


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


def test_undamped_dry_joints_are_given_shorter_steps() -> None:
    assert Dynamics().step_share(dry=True) == 0.25
    assert Dynamics().step_share(dry=False) == Dynamics(damping="viscous").step_share(dry=True) == 0.5
    assert Dynamics(time_step_safety=0.7).step_share(dry=True) == 0.7
    for wall, share in ((on_plate(), 0.25), (stack(2), 0.5)):
        course = started(wall.build(STIFF), 0.1)
        assert course.timing.step == pytest.approx(share * 2.0 / course.frequency.touched, rel=0.01)


@pytest.mark.parametrize(
    ("time", "values"), [((0.0, 1.0), (0.0, 1e7)), ((0.0, 1.0), (1.0, 1e15)), ((0.0, 1e-9), (0.0, 1.0))]
)
def test_a_record_beyond_all_bounds_is_refused(time: tuple[float, ...], values: tuple[float, ...]) -> None:
    motion = BaseMotion(kind="record", time=time, values=values, scale=10.0)
    with np.errstate(all="raise"), pytest.raises(InputError, match="the record reaches"):
        base_displacement([motion])
