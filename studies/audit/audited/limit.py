"""Static limit analysis of a cracked wall by linear programming: a sufficient proof of collapse.

The linear program searches forces at the two ends of every interface that keep all blocks in equilibrium, with pressure
and friction, and the full cohesion and tension of intact bonds. This overestimates the strength of a joint, whose
stresses are not all at their limits together, and assumes dilatant sliding. So where no such forces exist, the wall
collapses.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import block_array, coo_array, csr_array, eye_array, hstack, kron

from damagepred.arrays import BoolArray, FloatArray, IntArray

ENOUGH = 1e-7
"""Missing force that rounding explains, over the mean weight of a block."""


class Statics(NamedTuple):
    """Blocks and interfaces with their strengths; n blocks, m interfaces, SI, tension positive.

    Attributes
    ----------
    block_a, block_b : array of int (m,)
        Blocks that an interface joins, n is the ground; its normal points from a to b.
    middle, normal : array (m, 2)
        Of the interfaces (m, 1).
    length, tension, pressure, cohesion, friction : array (m,)
        Length (m), largest tension, pressure and bond in shear (N), and friction (1) of the interfaces.
    centre, gyration : array (n, 2), array (n,)
        Centroids and radii of gyration of the blocks (m).
    load, free : array (n, 3)
        Load on each block (N, N m), and whether its degrees of freedom are free.
    reactions : array (n, 3, k)
        Directions of k loads of unknown size (per N).
    weight : float
        Reference force (N).
    """

    block_a: IntArray
    block_b: IntArray
    middle: FloatArray
    normal: FloatArray
    length: FloatArray
    tension: FloatArray
    pressure: FloatArray
    cohesion: FloatArray
    friction: FloatArray
    centre: FloatArray
    gyration: FloatArray
    load: FloatArray
    free: BoolArray
    reactions: FloatArray
    weight: float


def out_of_reach(wall: Statics) -> bool:
    """Return whether no forces within the strengths of the interfaces keep the blocks of a wall in equilibrium.

    Unknowns are the normal and shear force at both ends of each interface, the reactions, and the missing forces: one
    in each direction on every degree of freedom, whose sum is minimised.
    """
    n, m, weight = len(wall.centre), len(wall.length), wall.weight
    tangent = np.column_stack((wall.normal[:, 1], -wall.normal[:, 0]))
    entries = []
    for column, (end, direction) in enumerate((e, d) for e in (-0.5, 0.5) for d in (wall.normal, tangent)):
        where = wall.middle + end * wall.length[:, None] * tangent
        for block, sign in ((wall.block_a, 1.0), (wall.block_b, -1.0)):  # tension pulls a along the normal
            inside = np.flatnonzero(block < n)
            b, force = block[inside], sign * direction[inside]
            arm = where[inside] - wall.centre[b]
            turn = (arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]) / wall.gyration[b]
            for k, value in enumerate((force[:, 0], force[:, 1], turn)):
                entries.append((value, 3 * b + k, 4 * inside + column))
    values, rows, columns = map(np.concatenate, zip(*entries, strict=True))
    scale = np.ones((n, 3))
    scale[:, 2] /= wall.gyration
    free = np.flatnonzero(wall.free.ravel())
    forces = coo_array((values, (rows, columns)), shape=(3 * n, 4 * m)).tocsr()[free]
    unknown = csr_array((wall.reactions * scale[..., None]).reshape(3 * n, -1)[free])
    count, others = len(free), unknown.shape[1] + 2 * len(free)
    missing = eye_array(count)
    mu = np.repeat(wall.friction, 2)
    pairs = eye_array(2 * m)  # at each end: mu times normal force, plus and minus the shear force, below the bond
    sides = [kron(pairs.multiply(mu[:, None]), [[1.0, 0.0]]) + kron(pairs, [[0.0, sign]]) for sign in (1.0, -1.0)]
    bounds = np.full((4 * m + others, 2), [-np.inf, np.inf])
    bounds[: 4 * m : 2] = np.repeat(np.column_stack((-wall.pressure, wall.tension)) / weight, 2, axis=0)
    bounds[-2 * count :, 0] = 0.0
    result = linprog(
        np.repeat((0.0, 1.0), (4 * m + unknown.shape[1], 2 * count)),
        A_ub=block_array([[side, csr_array((2 * m, others))] for side in sides]),
        b_ub=np.tile(np.repeat(wall.cohesion, 2) / weight, 2),
        A_eq=hstack([forces, unknown, missing, -missing]),
        b_eq=-(wall.load * scale).ravel()[free] / weight,
        bounds=bounds,
        method="highs",
    )
    return bool(result.status == 0 and result.fun > ENOUGH)
