"""Blocks that fall, slide, break and come to rest: properties without a closed form."""

from dataclasses import replace

import numpy as np
import pytest

import damagepred
from damagepred import Assembly, Scene
from damagepred.assembly.assembly import rectangle
from damagepred.enumerations import ContactState
from damagepred.scene import BaseMotion, BlockMaterial, Dynamics, Joint, Movement, Wall
from damagepred.solvers.dynamics.run import DynamicRun
from tests.solvers.dynamic_scenes import STIFF, THICKNESS, G, deepest, dry, run, stack, started, turned

GENTLE = {"damping": "rayleigh", "damping_ratio": 0.6, "frequency": 0.02, "second_frequency": 2000.0}
"""Damps impacts, and hardly affects free fall."""
WEIGHT = 0.24 * 0.075 * THICKNESS * 2000.0 * G


def table(speed: float = 1.2, mirror: bool = False, shift: float = 0.0, angle: float = 0.0) -> Assembly:
    """A brick (2) slides on a table (0) above a floor (1)."""
    sign = -1.0 if mirror else 1.0
    gravity = turned([0.0, -G], angle)
    assembly = Assembly(gravity=(gravity[0], gravity[1]), joint=dry(1e10, 0.3), thickness=THICKNESS)
    for corners in (
        rectangle(-1.0, 0.2, 0.0, 0.3),
        rectangle(-2.0, -0.1, 2.0, 0.0),
        rectangle(-0.3, 0.3, -0.06, 0.375),
    ):
        polygon = np.array(corners) * [sign, 1.0]
        assembly.add_block(turned(polygon, angle, (shift, shift)))
    velocity = turned([sign * speed, 0.0], angle)
    assembly.set_velocity(2, x=velocity[0], y=velocity[1])
    assembly.support(0)
    assembly.support(1)
    return assembly


def test_a_brick_slides_off_a_table_falls_and_comes_to_rest() -> None:
    ds = run(table(), 3.0, 150, stop_at_rest=True, **GENTLE)
    assert ds.attrs["status"] == "collapsed"
    assert ds["time"].values[-1] < 2.9, "it comes to rest before the end"
    lies = ds["block_y"].values[2] + ds["block_displacement_y"].values[-1, 2]
    turns = ds["block_rotation"].values[-1, 2] / (np.pi / 2)
    assert turns == pytest.approx(round(turns), abs=1e-3)
    half = 0.0375 if round(turns) % 2 == 0 else 0.12
    assert lies == pytest.approx(half, abs=1e-5)
    floor = ds["block_support_force_y"].values[-1, 1] - 4.0 * 0.1 * THICKNESS * 2000.0 * G
    assert floor == pytest.approx(WEIGHT, rel=1e-3)
    assert ds["searches"].values[-1] > 5
    assert max(deepest(ds, step) for step in range(0, ds.sizes["increment"], 10)) < 2e-4
    taken = sum(float(ds[f"{name}_work"].values[-1]) for name in ("friction", "damping"))
    assert abs(ds["energy_error"].values).max() < 0.01 * taken


def test_a_mirrored_scene_gives_the_mirror_image() -> None:
    here, there = (run(table(mirror=mirror), 0.45, 9, **GENTLE) for mirror in (False, True))
    scale = np.abs(here["block_displacement_x"].values).max()
    assert np.abs(here["block_rotation"].values[-1, 2]) > 0.05
    np.testing.assert_allclose(
        here["block_displacement_x"].values, -there["block_displacement_x"].values, atol=1e-6 * scale
    )
    np.testing.assert_allclose(here["block_rotation"].values, -there["block_rotation"].values, atol=1e-6)


@pytest.mark.parametrize(("shift", "angle"), [(1e4, 0.0), (0.0, 2.0)])
def test_results_do_not_depend_on_place_or_direction(shift: float, angle: float) -> None:
    """Up to the first impact, after which rounding grows. Built 10 km from the origin; rotated."""
    here, there = run(table(), 0.35, 7, **GENTLE), run(table(shift=shift, angle=angle), 0.35, 7, **GENTLE)
    moved = [np.stack([ds[f"block_displacement_{a}"].values[:, 2] for a in "xy"], axis=1) for ds in (here, there)]
    assert np.abs(moved[0]).max() > 0.2
    np.testing.assert_allclose(turned(moved[0], angle), moved[1], atol=1e-6)
    np.testing.assert_allclose(here["block_rotation"].values, there["block_rotation"].values, atol=1e-5)


def shaken(acceleration: float, **settings: object) -> Scene:
    pulse = BaseMotion(kind="full_sine", acceleration=acceleration, duration=0.4)
    joint = Joint(tensile_strength=0.0, cohesion=0.0, friction=0.6)
    given = {**GENTLE, "duration": 3.0, "outputs": 60, "stop_at_rest": True, **settings}
    return Scene(
        wall=Wall(length=0.48, height=0.9),
        joint=joint,
        movement=Movement(central_deflection=0.0),
        dynamics=Dynamics(base=(pulse,), **given),  # type: ignore[arg-type]
    )


@pytest.mark.slow
def test_a_dry_wall_loses_bricks_in_a_strong_pulse_and_comes_to_rest() -> None:
    ds = damagepred.solve(shaken(40.0))
    fallen = ds["block_displacement_y"].values[-1] < -0.07
    assert ds.attrs["status"] == "collapsed"
    assert fallen.sum() >= 3
    assert ds["time"].values[-1] < 2.9
    weight = ds.attrs["mean_block_weight"] * ds.sizes["block"]
    assert ds["base_reaction"].values[-1] == pytest.approx(weight, rel=0.01)
    assert max(deepest(ds, step) for step in range(ds.sizes["increment"])) < 1e-4
    assert abs(ds["energy_error"].values).max() < 0.01 * float(ds["external_work"].max())
    assert ds["damage_category"].values[-1] == 4


@pytest.mark.thorough
def test_a_wall_that_hardly_moves_is_searched_once() -> None:
    ds = damagepred.solve(shaken(0.5, duration=0.3, outputs=6))
    assert ds["searches"].values.tolist() == [1] * ds.sizes["increment"]
    assert ds.attrs["begins_in_equilibrium"] == 1
    without = damagepred.solve(shaken(0.5, duration=0.3, outputs=6, new_contacts=False))
    assert without["searches"].values.max() == 0
    assert without.attrs["time_step"] > ds.attrs["time_step"]
    scale = np.abs(ds["block_displacement_x"].values).max()
    np.testing.assert_allclose(
        ds["block_displacement_x"].values, without["block_displacement_x"].values, atol=1e-3 * scale
    )


def test_the_skin_of_the_neighbour_list_changes_nothing() -> None:
    near = run(table(), 0.5, 5, **GENTLE)
    far = run(table(), 0.5, 5, replace(STIFF, advanced={"dynamics": {"skin": 0.5}}), **GENTLE)
    assert far["searches"].values[-1] < near["searches"].values[-1]
    np.testing.assert_array_equal(near["block_displacement_x"].values, far["block_displacement_x"].values)


@pytest.mark.parametrize(("dpc", "deflection"), [(False, 5e-5), (True, 1e-3)])
def test_a_slow_movement_gives_the_equilibria_of_the_static_solver(dpc: bool, deflection: float) -> None:
    """Bonds hold in both: where they break, a run in time goes on from each break by itself."""
    tables = {
        "wall": {"length": 1.44, "height": 0.3},
        "movement": {"kind": "dishing", "central_deflection": deflection, "increments": 1},
        **({"dpc": {"course": 1}} if dpc else {}),
    }
    scene = Scene.from_dict(tables)
    still = damagepred.solve(scene, solver=replace(scene.solver, no_tension_subdivisions=1))  # as in runs in time
    slow = Dynamics(
        duration=0.4,
        outputs=2,
        movement_time=0.3,
        damping="rayleigh",
        damping_ratio=0.3,
        frequency=20.0,
        second_frequency=2000.0,
    )
    ds = damagepred.solve(scene, dynamics=slow)
    assert ds["progress"].values[-1] == 1.0
    for name in ("block_displacement_y", "contact_opening", "contact_normal_stress"):
        exact = still[name].values[-1]
        np.testing.assert_allclose(ds[name].values[-1], exact, atol=0.01 * np.abs(exact).max())
    taken = np.abs(ds["damping_work"].values).max()
    assert abs(ds["energy_error"].values).max() < 1e-3 * taken
    assert ds["searches"].values[-1] == 1


def test_a_live_load_does_its_work() -> None:
    joint = Joint(normal_stiffness=1e9, shear_stiffness=1e9, tensile_strength=1e9, cohesion=1e9)
    assembly = Assembly(gravity=(0.0, 0.0), joint=joint, thickness=THICKNESS)
    assembly.rest_on_ground([assembly.add_block(rectangle(0.0, 0.0, 0.24, 0.1))])
    assembly.push(0, y=-1000.0)
    ds = run(assembly, 0.1, 4, movement_time=0.05)
    sag = 1000.0 / (1e9 * 0.24 * THICKNESS)
    assert ds["block_displacement_y"].values[-1, 0] == pytest.approx(-sag, rel=1e-3)
    assert ds["external_work"].values[-1] == pytest.approx(0.5 * 1000.0 * sag, rel=1e-3)
    assert abs(ds["energy_error"].values[-1]) < 1e-9


def torn(joint: Joint, speed: float, slide: float = 0.0, safety: float = 0.1) -> DynamicRun:
    """Return the run of two bonded bricks that fly apart, each at a speed, and slide past each other at another."""
    assembly = Assembly(gravity=(0.0, 0.0), thickness=THICKNESS, joint=joint)
    for k, sign in enumerate((-1.0, 1.0)):
        assembly.add_block(rectangle(0.0, 0.075 * k, 0.24, 0.075 * (k + 1)))
        assembly.set_velocity(k, y=sign * speed, x=sign * slide)
    course = started(assembly.build(STIFF), 0.01, 4, start="unstressed", time_step_safety=safety)
    *_, last = iter(course)
    assert (last.state == ContactState.CRACKED).all()
    return course


def test_slip_that_breaks_a_softening_bond_sets_free_what_it_holds() -> None:
    """So fast that the path is straight: fracture takes G_f (1 - b) at the opening at which slip breaks the rest."""
    strength, energy, cohesion, friction, slide = 1e5, 2.0, 0.2e6, 0.75, 0.14
    brittle = Joint(
        tensile_strength=strength, cohesion=cohesion, friction=friction, fracture_energy=energy, brittle_shear=True
    )
    balance = torn(brittle, 0.5, slide * 0.5, 2e-3).energy.balance()
    first, last = strength / 82e9, 2 * energy / strength
    # 36e9 slide u = b (C - f_t tan phi)
    carried = cohesion - strength * friction
    bond = 36e9 * slide * last / (carried + 36e9 * slide * (last - first))
    assert 0.2 < bond < 0.8
    assert balance.fracture_work == pytest.approx(energy * (1.0 - bond) * 0.24 * THICKNESS, rel=0.03)
    held = 0.5 * bond * strength * (last - bond * (last - first)) * 0.24 * THICKNESS
    assert balance.released_energy == pytest.approx(held, rel=0.05)
    assert abs(balance.energy_error) < 1e-2 * held


def test_interrupting_keeps_what_was_reached() -> None:
    def stop(step: object) -> None:
        if step.increment.number == 2:  # type: ignore[attr-defined]
            raise KeyboardInterrupt

    ds = damagepred.solve(
        table(), solver=STIFF, dynamics=Dynamics(duration=0.1, outputs=10), on_step=stop, on_failure="return"
    )
    assert ds.attrs["status"] == "interrupted"
    assert ds.sizes["increment"] == 3


def test_crushing_joints_close_for_good() -> None:
    """Pressed to its strength by a live load twice as strong for a moment, a joint keeps what it was crushed by."""
    soft = Joint(normal_stiffness=1e9, tensile_strength=0.0, cohesion=0.0, compressive_strength=1e4)
    assembly = Assembly(gravity=(0.0, 0.0), joint=soft, thickness=THICKNESS)
    assembly.rest_on_ground([assembly.add_block(rectangle(0.0, 0.0, 0.24, 0.1))])
    strength = 1e4 * 0.24 * THICKNESS
    assembly.push(0, y=-0.9 * strength)
    assembly.set_velocity(0, y=-0.05)
    ds = run(assembly, 0.1, 50, movement_time=1e-3, damping="viscous", damping_ratio=0.2, frequency=300.0)
    crushed = -ds["block_displacement_y"].values[-1, 0] - 0.9e4 / 1e9
    assert ds["contact_normal_stress"].values.min() >= -1e4
    assert ds["contact_normal_stress"].values[-1] == pytest.approx(-0.9e4, rel=1e-3)
    assert ds["friction_work"].values[-1] == pytest.approx(strength * crushed, rel=1e-3)
    assert crushed > 1e-6
    assert abs(ds["energy_error"].values[-1]) < 1e-3 * ds["friction_work"].values[-1]


def test_what_is_held_after_the_load_stays_where_it_stands() -> None:
    assembly = stack(3)
    assembly.hold_after_load(2)
    assembly.move(2, x=1e-5)
    still = damagepred.solve(assembly, solver=STIFF, increments=1)
    slow = {"damping": "rayleigh", "damping_ratio": 0.5, "frequency": 5.0, "second_frequency": 3000.0}
    ds = run(assembly, 0.3, 3, movement_time=0.2, **slow)
    for axis in "xy":
        exact = still[f"block_displacement_{axis}"].values[-1]
        np.testing.assert_allclose(ds[f"block_displacement_{axis}"].values[-1], exact, atol=1e-3 * np.abs(exact).max())
    pushed = ds["block_support_force_x"].values[-1, 2]
    assert pushed == pytest.approx(still["block_support_force_x"].values[-1, 2], rel=1e-3)
    assert ds["external_work"].values[-1] == pytest.approx(0.5 * 1e-5 * pushed, rel=0.01)


def test_damping_by_mass_is_that_of_motion_relative_to_the_base() -> None:
    """A bonded block on ground under constant acceleration a: an oscillator under -a, whatever the ground's speed."""
    ratio, acceleration, stiffness = 0.2, 2.0, 1e8
    omega = np.sqrt(stiffness / (2000.0 * 0.1))
    time = 4 * 2 * np.pi / omega
    wall = Assembly(thickness=THICKNESS, gravity=(0.0, 0.0), joint=Joint(normal_stiffness=stiffness))
    stiff = BlockMaterial(elastic_modulus=1e11, poisson_ratio=0.0)
    wall.rest_on_ground([wall.add_block(rectangle(0.0, 0.0, 0.2, 0.1), stiff)])
    base = BaseMotion(kind="rectangular", direction="y", acceleration=acceleration, duration=2 * time)
    ds = run(
        wall,
        time,
        80,
        damping="viscous",
        damping_ratio=ratio,
        frequency=omega / (2 * np.pi),
        base=(base,),
        new_contacts=False,
        time_step_safety=0.02,
    )
    t, damped = ds["time"].values, omega * np.sqrt(1 - ratio**2)
    swing = np.cos(damped * t) + ratio * omega / damped * np.sin(damped * t)
    exact = -acceleration / omega**2 * (1 - np.exp(-ratio * omega * t) * swing)
    np.testing.assert_allclose(
        ds["block_displacement_y"].values[:, 0], exact, rtol=0, atol=0.01 * acceleration / omega**2
    )
    # elastic joints balance to the last digits, whatever the base does to what is damped
    assert np.abs(ds["energy_error"].values).max() < 1e-9 * float(ds["external_work"].max())


def test_a_bond_broken_by_slip_slides_with_its_residual_friction() -> None:
    """A block on an incline breaks its bond by its own weight and then slides with a = g (sin - mu cos)."""
    angle, left, duration = np.arctan(0.75), 0.3, 0.3
    # shear 1177 Pa, pressure 1570 Pa: more than 300 + 0.5 * 1570
    joint = replace(dry(1e10, 0.5), tensile_strength=500.0, cohesion=300.0, residual_friction=left, brittle_shear=True)
    wall = Assembly(gravity=(G * np.sin(angle), -G * np.cos(angle)), thickness=THICKNESS, joint=joint)
    for corners in (rectangle(-0.5, -0.1, 1.0, 0.0), rectangle(0.0, 0.0, 0.24, 0.1)):
        wall.add_block(corners)
    wall.support(0)
    ds = run(wall, duration, 10, start="unstressed")
    exact = 0.5 * G * (np.sin(angle) - left * np.cos(angle)) * ds["time"].values ** 2
    np.testing.assert_allclose(ds["block_displacement_x"].values[1:, 1], exact[1:], rtol=0.02)
    rubbed = left * 2000.0 * 0.24 * 0.1 * THICKNESS * G * np.cos(angle) * exact[-1]
    assert float(ds["friction_work"][-1]) == pytest.approx(rubbed, rel=0.02)
