"""Poses, velocities and forces of all bodies in a dynamic run."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.errors import InputError
from damagepred.solvers.dynamics.strains import BlockStrains
from damagepred.solvers.system.discrete_system import DiscreteSystem


class Motion(NamedTuple):
    """Bodies: n blocks, then the ground."""

    reference: FloatArray  # (n + 1, 2) initial centroids, from the run's origin (m)
    pose: FloatArray  # (n + 1, 4) x, y (m), cosine and sine of the rotation
    force: FloatArray  # (n + 1, 3) of contacts (N, N, N m)
    load: FloatArray  # (n + 1, 3) present dead and live load (N, N m)
    live_load: FloatArray  # (n + 1, 3) at full movement (N, N m)
    inverse_mass: FloatArray  # (n + 1, 3) 1 / mass, 0 where prescribed
    velocity: FloatArray  # (n + 1, 3) half a step ago (m/s, rad/s)
    displacement: FloatArray  # (n + 1, 3) from the reference (m, rad)
    held: IntArray  # (h,) prescribed degrees of freedom, 3 block + axis
    held_start: FloatArray  # (h,) their displacement at the start (m, rad)
    held_displacement: FloatArray  # (h,) its change at full movement (m, rad)
    strains: BlockStrains | None = None


def motion_of(model: Model, origin: FloatArray) -> Motion:
    """Bodies of a model at rest in their initial positions."""
    n = model.n_blocks
    mass = np.column_stack((model.mass, model.mass, model.density * model.blocks.polar * model.block_law.thickness))
    inverse = np.zeros((n + 1, 3))
    np.divide(1.0, mass, out=inverse[:-1], where=mass > 0)
    whole = model.supports.prescribed < 3 * (n + 1)
    held = model.supports.prescribed[whole]
    inverse.ravel()[held] = 0.0
    free = np.ones((n, 3), dtype=np.bool_)
    free.ravel()[held] = False
    system = DiscreteSystem.of(model)
    load, live = (values[: 3 * (n + 1)].reshape(-1, 3).copy() for values in (system.dead_load, system.live_load))
    bare = np.flatnonzero((free & (mass == 0)).any(axis=1))
    if bare.size:
        raise InputError(
            f"{model.describe_block(int(bare[0]))} has no mass, so it cannot move in time: give its material a "
            f"density greater than 0, or hold it."
        )
    reference = np.zeros((n + 1, 2))
    reference[:-1] = np.column_stack((model.blocks.x, model.blocks.y)) - origin
    pose = np.zeros((n + 1, 4))
    pose[:, :2], pose[:, 2] = reference, 1.0
    return Motion(
        reference=reference,
        pose=pose,
        force=np.zeros((n + 1, 3)),
        load=load,
        live_load=live,
        inverse_mass=inverse,
        velocity=np.zeros((n + 1, 3)),
        displacement=np.zeros((n + 1, 3)),
        held=held,
        held_start=np.zeros(len(held)),
        held_displacement=model.supports.prescribed_displacement[whole],
    )


def moving_parts(motion: Motion) -> tuple[Motion | BlockStrains, ...]:
    """Bodies, and strains of elastic blocks."""
    return (motion,) if motion.strains is None else (motion, motion.strains)


def mass_of(moving: Motion | BlockStrains) -> FloatArray:
    """Mass of each degree of freedom, 0 where prescribed."""
    inverse = moving.inverse_mass
    return np.divide(1.0, inverse, out=np.zeros_like(inverse), where=inverse > 0)


def base_velocity(moving: Any, motion: Motion) -> FloatArray:
    """Velocity of the base in the directions of a part: x, y (m/s) and rotation; 0 for strains."""
    if moving is motion.strains:
        return np.zeros(2)
    return np.array([*motion.velocity[-1, :2], 0.0])[: moving.velocity.shape[1]]


def update_poses(motion: Motion) -> None:
    """Update the poses of blocks from their displacements."""
    motion.pose[:, :2] = motion.reference + motion.displacement[:, :2]
    motion.pose[:, 2] = np.cos(motion.displacement[:, 2])
    motion.pose[:, 3] = np.sin(motion.displacement[:, 2])
