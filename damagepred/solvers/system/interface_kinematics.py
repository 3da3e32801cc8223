"""Kinematics of interfaces: opening, shear and rotation for displacements of blocks and gridpoints."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.model import Interfaces
from damagepred.solvers.system.deformable_blocks import facets_of


class InterfaceKinematics(NamedTuple):
    """Kinematics of m interfaces with w degrees of freedom: 6 for rigid blocks, 8 for deformable, 10 for elastic."""

    # (m, w) side a, then side b: three of a rigid block, strain and curvature of an elastic block, or x and y of the
    # two gridpoints at the ends of a facet; -1 in unused places
    dof: IntArray
    rows: FloatArray  # (m, 3, w) opening and shear at the middle, and relative rotation, per unit displacement


def body_kinematics(face: Interfaces) -> FloatArray:
    """Opening and shear at the middle, and relative rotation, per unit displacement of two bodies (m, 3, 6)."""
    rows = np.zeros((len(face.kind), 3, 2, 3))
    arms = ((face.arm_normal_a, face.arm_shear_a), (face.arm_normal_b, face.arm_shear_b))
    for side, sign, (arm_normal, arm_shear) in zip((0, 1), (-1.0, 1.0), arms):
        rows[:, 0, side] = np.stack((sign * face.normal_x, sign * face.normal_y, sign * arm_normal), axis=-1)
        rows[:, 1, side] = np.stack((sign * face.normal_y, -sign * face.normal_x, sign * arm_shear), axis=-1)
        rows[:, 2, side, 2] = sign
    return rows.reshape(-1, 3, 6)


def interface_kinematics(model: Model) -> InterfaceKinematics:
    """Kinematics of a model's joints, with facets expressed by their gridpoints."""
    face = model.interfaces
    body = np.stack((face.body_a, face.body_b), axis=1)  # (m, 2)
    rows, dof = body_kinematics(face).reshape(-1, 3, 2, 3), 3 * body[:, :, None] + np.arange(3)
    if model.mesh is not None:
        of_bodies, whole = rows, body <= model.n_blocks
        rows, dof = np.pad(rows, ((0, 0), (0, 0), (0, 0), (0, 1))), np.full((*body.shape, 4), -1, dtype=np.int64)
        dof[..., :3][whole] = 3 * body[whole][:, None] + np.arange(3)
        facets = facets_of(model)
        piece = body[~whole] - model.n_blocks - 1
        dof[~whole] = np.stack([dofs[piece] for dofs in facets[:4]], axis=-1)
        follow = np.zeros((len(piece), 3, 4))  # the piece for its gridpoints
        follow[:, 0, 0] = follow[:, 1, 1] = facets.start_share[piece]
        follow[:, 0, 2] = follow[:, 1, 3] = facets.end_share[piece]
        turn_x, turn_y = facets.turn_x[piece], facets.turn_y[piece]
        follow[:, 2] = np.stack((-turn_x, -turn_y, turn_x, turn_y), axis=-1)
        rows.swapaxes(1, 2)[~whole] = of_bodies.swapaxes(1, 2)[~whole] @ follow
    if face.elastic is not None:
        rows = np.concatenate((rows, face.elastic.rows.swapaxes(1, 2)), axis=3)
        strain = face.elastic.dof[:, :, None]
        dof = np.concatenate((dof, strain, np.where(strain < 0, -1, strain + 1)), axis=2)
    count = len(face.kind)
    width = 2 * dof.shape[2]
    return InterfaceKinematics(dof.reshape(count, width), np.ascontiguousarray(rows.reshape(count, 3, width)))
