"""Strain and curvature of elastic blocks in a dynamic run."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.solvers.dynamics.body_arrays import BodyArrays
from damagepred.solvers.system.discrete_system import DiscreteSystem


class BlockStrains(NamedTuple):
    """Strain (1) and curvature (1/m) of d elastic blocks; a last row stands for all rigid blocks and stays 0.

    Attributes
    ----------
    number : array of int (n + 1,)
        Row of each body.
    axis : array (d + 1, 2)
        Unit vector along the bed, before anything moved.
    poisson_ratio : array (d + 1,)
        Of the block (1).
    bow : array (d + 1, 2)
        -b^2/24 and -h^2/24 (m2).
    own : array (p, 2, 2)
        Displacement x, y of each boundary point in its block's frame, for a unit strain and a unit curvature.
    target : array (p, 2, 2)
        Displacement of the place that it faces, along the edge and outwards.
    displacement, velocity : array (d + 1, 2)
        Now; half a step ago (1/s).
    force, load : array (d + 1, 2)
        Generalised forces (N m, N m2) of contacts and of the block itself, and of loads, which do no work on them.
    inverse_mass, stiffness : array (d + 1, 2)
        Generalised: 1 / (rho t h b^3/12) and 1 / (rho t (h b^5/720 + b^3 h^3/144)); E b h t and E b t h^3/12.
    damping : array (d + 1, 2)
        Damping force of the last step, proportional to stiffness.
    work : array (1,)
        Work of that damping so far (J).
    """

    number: IntArray
    axis: FloatArray
    poisson_ratio: FloatArray
    bow: FloatArray
    own: FloatArray
    target: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    force: FloatArray
    load: FloatArray
    inverse_mass: FloatArray
    stiffness: FloatArray
    damping: FloatArray
    work: FloatArray


def block_strains(model: Model, bodies: BodyArrays) -> BlockStrains | None:
    """Return strain and curvature of the elastic blocks of a model, unstrained and at rest; None if there are none.

    Along a joint a side moves as in the static solvers: as the straight line that fits the block's field best.
    """
    elastic, sides = model.elastic, model.interfaces.elastic
    if elastic is None or sides is None:
        return None
    points, face, count = bodies.points, model.interfaces, len(elastic.block)
    number = np.where(elastic.number < 0, count, elastic.number)
    own, target = np.zeros((2, len(points), 2, 2))
    free = np.flatnonzero(number[points["body"]] < count)
    arm = np.column_stack((points["x"], points["y"]))
    own[free] = elastic.unit_displacements(number[points["body"][free]], arm[free])
    # both sides of the contacts
    normal = np.column_stack((face.normal_x, face.normal_y))
    tangent = np.column_stack((face.normal_y, -face.normal_x))
    opening = sides.rows[:, :, None, 0] + face.contact_offset[:, None, :, None] * sides.rows[:, :, None, 2]
    moved = normal[:, None, None, :, None] * opening[..., None, :]
    moved += (tangent[:, None, :, None] * sides.rows[:, :, 1, None, :])[:, :, None]
    moved *= np.array([-1.0, 1.0])[:, None, None, None]
    joined = moved.size // 4
    own[:joined] = moved[:, ::-1].reshape(-1, 2, 2)  # the points of block b come first
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
        own=own,
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
    """Return the directions along edges, records (p,) of ``EDGE``, and out of their blocks, as rows (p, 2, 2)."""
    t_x, t_y = edges["along_x"], edges["along_y"]
    return np.stack((np.stack((t_x, t_y), axis=1), np.stack((-t_y, t_x), axis=1)), axis=1)


def strain_mass(model: Model) -> FloatArray:
    """Return the generalised mass of strain (kg m2) and curvature (kg m4) of elastic blocks (d, 2).

    The inertia of the contraction across the axis is left out.
    """
    elastic = model.elastic
    assert elastic is not None
    b, h = elastic.length, elastic.height
    per_volume = (model.density * model.block_law.thickness)[elastic.block]
    return per_volume[:, None] * np.column_stack((h * b**3 / 12.0, h * b**5 / 720.0 + b**3 * h**3 / 144.0))
