"""Small scenes for runs in time."""

import numpy as np
import xarray as xr

import damagepred
from damagepred.assembly import Assembly, Model
from damagepred.assembly.assembly import rectangle
from damagepred.one_wall.judged_path import dynamic_run
from damagepred.scene import Dynamics, Joint, Solver
from damagepred.solvers.dynamics.run import DynamicRun

G, THICKNESS, DENSITY = 9.81, 0.11, 2000.0
STIFF = Solver(lump_block_elasticity=False)
"""Joints alone are elastic."""


def dry(stiffness: float = 1e10, friction: float = 0.5) -> Joint:
    return Joint(
        normal_stiffness=stiffness, shear_stiffness=stiffness, tensile_strength=0, cohesion=0, friction=friction
    )


def turned(corners: object, angle: float, shift: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(corners, dtype=float) @ np.array([[c, s], [-s, c]]) + np.array(shift)


def on_plate(
    width: float = 0.6,
    height: float = 0.4,
    joint: Joint | None = None,
    slope: float = 0.0,
    tilt: float = 0.0,
    angle: float = 0.0,
    shift: tuple[float, float] = (0.0, 0.0),
) -> Assembly:
    """Return a block (1) on a fixed plate (0) inclined to the right by ``slope``; the block stands on its right
    corner if ``tilt`` is not 0; all is turned by ``angle`` and shifted."""
    gravity = turned([G * np.sin(slope), -G * np.cos(slope)], angle)
    assembly = Assembly(gravity=(gravity[0], gravity[1]), thickness=THICKNESS, joint=joint or dry())
    corners = turned(np.array(rectangle(-width, 0.0, 0.0, height)), -tilt)
    for polygon in (np.array(rectangle(-4.0, -0.2, 4.0, 0.0)), corners):
        assembly.add_block(turned(polygon, angle, shift))
    assembly.support(0)
    return assembly


def stack(count: int, stiffness: float = 82e9, width: float = 0.24, height: float = 0.1) -> Assembly:
    assembly = Assembly(thickness=THICKNESS, joint=Joint(normal_stiffness=stiffness))
    for i in range(count):
        assembly.add_block(rectangle(0.0, i * height, width, (i + 1) * height), course=i)
    assembly.rest_on_ground([0])
    return assembly


def pair(x: float = 1.0, y: float = 0.5, spin: float = 20.0, shift: float = 0.0, joint: Joint | None = None) -> Model:
    """Return two bonded bricks in free flight with rotation, without gravity."""
    assembly = Assembly(gravity=(0.0, 0.0), thickness=THICKNESS, joint=joint)
    for k, arm in enumerate((-0.0375, 0.0375)):
        assembly.add_block(rectangle(shift, shift + 0.075 * k, shift + 0.24, shift + 0.075 * (k + 1)))
        assembly.set_velocity(k, x=x - spin * arm, y=y, rotation=spin)
    return assembly.build(STIFF)


def run(
    assembly: Assembly, duration: float, outputs: int = 10, solver: Solver = STIFF, **settings: object
) -> xr.Dataset:
    dynamics = Dynamics(duration=duration, outputs=outputs, **settings)
    return damagepred.solve(assembly, solver=solver, dynamics=dynamics)


def started(model: Model, duration: float, outputs: int = 1, **settings: object) -> DynamicRun:
    return dynamic_run(model, STIFF, Dynamics(duration=duration, outputs=outputs, **settings))


def momentum(course: DynamicRun) -> np.ndarray:
    """Return momentum x, y and angular momentum about the origin, between two steps (velocities and poses there)."""
    motion, model = course.motion, course.model
    velocity = motion.velocity[:-1]
    half_back = motion.displacement[:-1] - 0.5 * course.timing.step * velocity
    place = motion.reference[:-1] + half_back[:, :2]
    mass, inertia = model.mass, model.density * model.blocks.polar * THICKNESS
    angular = mass * (place[:, 0] * velocity[:, 1] - place[:, 1] * velocity[:, 0]) + inertia * velocity[:, 2]
    return np.array([(mass * velocity[:, 0]).sum(), (mass * velocity[:, 1]).sum(), angular.sum()])


def deepest(ds: xr.Dataset, step: int = -1) -> float:
    """Return the largest penetration of a corner into another block (m)."""
    block = ds["vertex_block"].values
    x0, y0 = ds["block_x"].values, ds["block_y"].values
    turn = ds["block_rotation"].values[step][block]
    arm = np.column_stack((ds["vertex_x"].values - x0[block], ds["vertex_y"].values - y0[block]))
    c, s = np.cos(turn), np.sin(turn)
    place = np.column_stack((x0 + ds["block_displacement_x"][step], y0 + ds["block_displacement_y"][step]))
    corner = place[block] + np.column_stack((c * arm[:, 0] - s * arm[:, 1], s * arm[:, 0] + c * arm[:, 1]))
    depth = 0.0
    for b in range(len(x0)):
        own = corner[block == b]
        along = np.roll(own, -1, axis=0) - own
        normal = np.column_stack((along[:, 1], -along[:, 0])) / np.hypot(*along.T)[:, None]
        others = corner[block != b]
        gap = ((others[:, None] - own) * normal).sum(axis=2).max(axis=1)
        depth = max(depth, -float(gap.min(initial=0.0)))
    return depth
