"""Kinematics of the joints: how opening, shear and rotation of an interface follow from what its sides are made of."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.solvers.system.deformable_blocks import facets_of


class InterfaceKinematics(NamedTuple):
    """For m interfaces, w degrees of freedom each: 6 in a wall of rigid blocks, 8 where any is deformable.

    Attributes
    ----------
    dof : array of int (m, w)
        Degrees of freedom of side a, then of side b: three of a rigid block, x and y of the two gridpoints at the ends
        of a facet; -1 where there are fewer.
    rows : array (m, 3, w)
        Opening and shear at the middle, and relative rotation, for unit displacements of each.
    """

    dof: IntArray
    rows: FloatArray


def interface_kinematics(model: Model) -> InterfaceKinematics:
    """Return the kinematics of a model's joints."""
    face, rigid = model.interfaces, model.mesh is None
    count, side = len(face.kind), 3 if rigid else 4
    dof, rows = np.full((count, 2, side), -1, dtype=np.int64), np.zeros((count, 3, 2, side))
    n_x, n_y = face.normal_x, face.normal_y
    sides = (
        (face.body_a, face.arm_normal_a, face.arm_shear_a, -1.0),
        (face.body_b, face.arm_normal_b, face.arm_shear_b, 1.0),
    )
    for s, (body, arm_normal, arm_shear, sign) in enumerate(sides):
        of_body = np.zeros((count, 3, 3))  # opening, shear, rotation for x, y, rotation of the body
        of_body[:, 0, 0], of_body[:, 0, 1], of_body[:, 0, 2] = sign * n_x, sign * n_y, sign * arm_normal
        of_body[:, 1, 0], of_body[:, 1, 1], of_body[:, 1, 2] = sign * n_y, -sign * n_x, sign * arm_shear
        of_body[:, 2, 2] = sign
        if rigid:
            dof[:, s] = 3 * body[:, None] + np.arange(3)
            rows[:, :, s] = of_body
            continue
        whole = body <= model.n_blocks
        dof[whole, s, :3] = 3 * body[whole, None] + np.arange(3)
        rows[whole, :, s, :3] = of_body[whole]
        facets = facets_of(model)
        f = body[~whole] - model.n_blocks - 1
        dof[~whole, s] = np.stack((facets.start_x[f], facets.start_y[f], facets.end_x[f], facets.end_y[f]), -1)
        follow = np.zeros((len(f), 3, 4))  # the facet for its gridpoints
        follow[:, 0, 0] = follow[:, 1, 1] = facets.start_share[f]
        follow[:, 0, 2] = follow[:, 1, 3] = facets.end_share[f]
        follow[:, 2] = np.stack((-facets.turn_x[f], -facets.turn_y[f], facets.turn_x[f], facets.turn_y[f]), -1)
        rows[~whole, :, s] = of_body[~whole] @ follow
    return InterfaceKinematics(dof.reshape(count, 2 * side), np.ascontiguousarray(rows.reshape(count, 3, 2 * side)))
