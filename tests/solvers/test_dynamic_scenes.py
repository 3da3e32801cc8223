"""Blocks that fall, slide, break and come to rest: properties without a closed form."""

from dataclasses import replace

import numpy as np
import pytest

import damagepred
from damagepred import Assembly, BaseMotion, BlockMaterial, Dynamics, Joint, Movement, Scene, Solver, Wall
from damagepred.assembly.assembly import rectangle
from tests.solvers.dynamic_scenes import STIFF, THICKNESS, G, deepest, dry, run, turned

GENTLE = {"damping": "rayleigh", "damping_ratio": 0.6, "frequency": 0.02, "second_frequency": 2000.0}
"""Damps impacts, and hardly affects free fall."""
WEIGHT = 0.24 * 0.075 * THICKNESS * 2000.0 * G


def table(speed: float = 1.2, mirror: bool = False, shift: float = 0.0, angle: float = 0.0) -> Assembly:
    """A brick (2) slides on a table (0) above a floor (1)."""
    sign = -1.0 if mirror else 1.0
    gravity = turned([0.0, -G], angle)
    assembly = Assembly(gravity=(gravity[0], gravity[1]), joint=dry(1e10, 0.3), thickness=THICKNESS)
    for corners in (rectangle(-1.0, 0.2, 0.0, 0.3), rectangle(-2, -0.1, 2, 0.0), rectangle(-0.3, 0.3, -0.06, 0.375)):
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
    np.testing.assert_allclose(here["block_displacement_x"], -there["block_displacement_x"], atol=1e-6 * scale)
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
        solver=Solver(blocks="rigid"),
        dynamics=Dynamics(base=(pulse,), **given),
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
    np.testing.assert_allclose(ds["block_displacement_x"], without["block_displacement_x"], atol=1e-3 * scale)


def test_the_skin_of_the_neighbour_list_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    near = run(table(), 0.5, 5, **GENTLE)
    monkeypatch.setattr("damagepred.solvers.dynamics.run.SKIN", 0.5)
    far = run(table(), 0.5, 5, **GENTLE)
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


def test_interrupting_keeps_what_was_reached() -> None:
    def stop(step: object) -> None:
        if step.increment.number == 2:
            raise KeyboardInterrupt

    ds = damagepred.solve(
        table(), solver=STIFF, dynamics=Dynamics(duration=0.1, outputs=10), on_step=stop, on_failure="return"
    )
    assert ds.attrs["status"] == "interrupted"
    assert ds.sizes["increment"] == 3


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
    np.testing.assert_allclose(ds["block_displacement_y"][:, 0], exact, rtol=0, atol=0.01 * acceleration / omega**2)
    # elastic joints balance to the last digits, whatever the base does to what is damped
    assert np.abs(ds["energy_error"].values).max() < 1e-9 * float(ds["external_work"].max())
