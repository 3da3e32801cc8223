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
    """Bodies: n blocks, then the ground.

    Attributes
    ----------
    reference : array (n + 1, 2)
        Initial centroids, from the run's origin (m).
    pose : array (n + 1, 4)
        x, y (m), cosine and sine of the rotation: all that contacts depend on.
    force : array (n + 1, 3)
        Of contacts on each body (N, N, N m).
    load, live_load : array (n + 1, 3)
        Load now, dead and live, and live load at full movement (N, N m).
    inverse_mass : array (n + 1, 3)
        1 / mass, 0 where prescribed.
    velocity : array (n + 1, 3)
        Half a step ago (m/s, rad/s).
    displacement : array (n + 1, 3)
        From the reference (m, rad).
    held : array of int (h,)
        Prescribed degrees of freedom, 3 block + axis.
    held_start, held_displacement : array (h,)
        Their displacement at the start, and its change at full movement (m, rad).
    strains : BlockStrains or None
        Strain and curvature of elastic blocks; None if there are none.
    """

    reference: FloatArray
    pose: FloatArray
    force: FloatArray
    load: FloatArray
    live_load: FloatArray
    inverse_mass: FloatArray
    velocity: FloatArray
    displacement: FloatArray
    held: IntArray
    held_start: FloatArray
    held_displacement: FloatArray
    strains: BlockStrains | None = None


def motion_of(model: Model, origin: FloatArray) -> Motion:
    """Return the bodies of a model at rest in their initial places."""
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
    place = np.zeros((n + 1, 2))
    place[:-1] = np.column_stack((model.blocks.x, model.blocks.y)) - origin
    pose = np.zeros((n + 1, 4))
    pose[:, :2], pose[:, 2] = place, 1.0
    return Motion(
        place,
        pose,
        np.zeros((n + 1, 3)),
        load,
        live,
        inverse,
        np.zeros((n + 1, 3)),
        np.zeros((n + 1, 3)),
        held,
        np.zeros(len(held)),
        model.supports.prescribed_displacement[whole],
    )


def base_velocity(part: Any, motion: Motion) -> FloatArray:
    """Return the velocity of the base in the directions of a part: x, y (m/s) and rotation; 0 for strains."""
    if part is motion.strains:
        return np.zeros(2)
    return np.array([*motion.velocity[-1, :2], 0.0])[: part.velocity.shape[1]]


def update_poses(motion: Motion) -> None:
    """Update the poses of blocks from their displacements."""
    motion.pose[:, :2] = motion.reference + motion.displacement[:, :2]
    motion.pose[:, 2] = np.cos(motion.displacement[:, 2])
    motion.pose[:, 3] = np.sin(motion.displacement[:, 2])
