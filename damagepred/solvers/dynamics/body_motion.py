"""Poses, velocities, forces and strains of all bodies in a dynamic run."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.errors import InputError
from damagepred.solvers.dynamics.body_arrays import BodyArrays
from damagepred.solvers.system.discrete_system import DiscreteSystem


class BlockStrains(NamedTuple):
    """Strain (1) and curvature (1/m) of d elastic blocks; a last row stands for all rigid blocks and stays 0."""

    number: IntArray  # (n + 1,) row of each body
    axis: FloatArray  # (d + 1, 2) unit vector along the bed in the reference state
    poisson_ratio: FloatArray  # (d + 1,)
    bow: FloatArray  # (d + 1, 2) -b^2/24 and -h^2/24 (m2)
    own: FloatArray  # (p, 2, 2) displacement x, y of each boundary point per unit strain and curvature
    target: FloatArray  # (p, 2, 2) displacement of the position it faces, along the edge and outwards
    displacement: FloatArray  # (d + 1, 2)
    velocity: FloatArray  # (d + 1, 2) half a step ago (1/s)
    force: FloatArray  # (d + 1, 2) generalised, of contacts and the block itself (N m, N m2)
    load: FloatArray  # (d + 1, 2) 0: loads do no work on strains
    inverse_mass: FloatArray  # (d + 1, 2) 1 / (rho t h b^3/12) and 1 / (rho t (h b^5/720 + b^3 h^3/144))
    stiffness: FloatArray  # (d + 1, 2) E b h t and E b t h^3/12
    damping: FloatArray  # (d + 1, 2) stiffness-proportional damping force of the last step
    work: FloatArray  # (1,) of that damping (J)


def block_strains(model: Model, bodies: BodyArrays) -> BlockStrains | None:
    """Strain and curvature of the elastic blocks of a model at rest; None without elastic blocks."""
    # along a joint a side moves as in the static solvers: as the straight line that fits the block's field best
    elastic, sides = model.elastic, model.interfaces.elastic
    if elastic is None or sides is None:
        return None
    points, face, count = bodies.points, model.interfaces, len(elastic.block)
    number = np.where(elastic.number < 0, count, elastic.number)
    own_motion, target = np.zeros((2, len(points), 2, 2))
    free = np.flatnonzero(number[points["body"]] < count)
    arm = np.column_stack((points["x"], points["y"]))
    own_motion[free] = elastic.unit_displacements(number[points["body"][free]], arm[free])
    # both sides of the contacts
    normal = np.column_stack((face.normal_x, face.normal_y))
    tangent = np.column_stack((face.normal_y, -face.normal_x))
    opening = sides.rows[:, :, None, 0] + face.contact_offset[:, None, :, None] * sides.rows[:, :, None, 2]
    moved = normal[:, None, None, :, None] * opening[..., None, :]
    moved += (tangent[:, None, :, None] * sides.rows[:, :, 1, None, :])[:, :, None]
    moved *= np.array([-1.0, 1.0])[:, None, None, None]
    joined = moved.size // 4
    own_motion[:joined] = moved[:, ::-1].reshape(-1, 2, 2)  # the points of block b come first
    target[:joined] = along_and_outwards(bodies.edges[points["target"][:joined]]) @ moved.reshape(-1, 2, 2)
    zeros, inverse, stiffness = np.zeros((count + 1, 2)), np.zeros((count + 1, 2)), np.zeros((count + 1, 2))
    mass = strain_mass(model)
    np.divide(1.0, mass, out=inverse[:-1], where=mass > 0)
    stiffness[:-1] = DiscreteSystem.of(model).strain_stiffness.reshape(-1, 2)
    return BlockStrains(
        number=number,
        axis=np.vstack((elastic.axis, (1.0, 0.0))),
        poisson_ratio=np.append(elastic.poisson_ratio, 0.0),
        bow=-(np.vstack((np.column_stack((elastic.length, elastic.height)), (0.0, 0.0))) ** 2) / 24.0,
        own=own_motion,
        target=target,
        displacement=zeros,
        velocity=zeros.copy(),
        force=zeros.copy(),
        load=zeros.copy(),
        inverse_mass=inverse,
        stiffness=stiffness,
        damping=zeros.copy(),
        work=np.zeros(1),
    )


def along_and_outwards(edges: NDArray[Any]) -> FloatArray:
    """Directions along edges, records (p,) of ``EDGE``, and out of their blocks, as rows (p, 2, 2)."""
    t_x, t_y = edges["along_x"], edges["along_y"]
    return np.stack((np.stack((t_x, t_y), axis=1), np.stack((-t_y, t_x), axis=1)), axis=1)


def strain_mass(model: Model) -> FloatArray:
    """Generalised mass of strain (kg m2) and curvature (kg m4) of elastic blocks (d, 2), without contraction."""
    elastic = model.elastic
    assert elastic is not None
    b, h = elastic.length, elastic.height
    per_volume = (model.density * model.block_law.thickness)[elastic.block]
    return per_volume[:, None] * np.column_stack((h * b**3 / 12.0, h * b**5 / 720.0 + b**3 * h**3 / 144.0))


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
