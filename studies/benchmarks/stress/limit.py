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
from scipy.sparse import coo_array, csr_array, hstack

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.enumerations import ContactState
from damagepred.solvers import Increment

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
    length : array (m,)
        Of the interfaces (m).
    tension, pressure, cohesion : array (m,)
        Largest tension, pressure and bond in shear of each interface (N).
    friction : array (m,)
        Its friction.
    centre : array (n, 2)
        Centroids of the blocks (m).
    gyration : array (n,)
        Their radii of gyration (m).
    load : array (n, 3)
        On each block (N, N m).
    free : array of bool (n, 3)
        Free degrees of freedom.
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


def cannot_stand(model: Model, step: Increment) -> bool:
    """Return whether no forces keep the wall in equilibrium, with the broken bonds of an increment.

    Parameters
    ----------
    model : Model
        n blocks, m interfaces.
    step : Increment
        Increment of the collapse.
    """
    face, law, n = model.interfaces, model.properties, model.n_blocks
    free = np.ones(3 * n, dtype=bool)
    free[model.supports.prescribed[model.supports.prescribed < free.size]] = False
    load = model.supports.load + step.load_factor * model.supports.live_load
    area = face.contact_area
    # tension is positive
    whole = (step.state != ContactState.CRACKED) & (law.gap[:, None] == 0.0)

    def carries(intact: np.ndarray, left: np.ndarray) -> np.ndarray:
        each = np.broadcast_to(np.where(whole, intact[:, None], left[:, None]), area.shape)
        return np.asarray((area * each).sum(axis=1))

    return out_of_reach(
        Statics(
            face.block_a,
            face.block_b,
            np.column_stack((face.x, face.y)),
            np.column_stack((face.normal_x, face.normal_y)),
            face.length,
            carries(law.tensile_strength, law.residual_tensile_strength),
            law.compressive_strength * area.sum(axis=1),
            carries(law.cohesion, law.residual_cohesion),
            np.where(whole.any(axis=1), np.maximum(law.friction, law.residual_friction), law.residual_friction),
            np.column_stack((model.blocks.x, model.blocks.y)),
            np.sqrt(model.blocks.polar / model.blocks.area),
            load.reshape(n, 3),
            free.reshape(n, 3),
            np.zeros((n, 3, 0)),
            model.mean_block_weight,
        )
    )


def out_of_reach(wall: Statics) -> bool:
    """Return whether no forces within the strengths of the interfaces keep the blocks in equilibrium.

    Parameters
    ----------
    wall : Statics
        The wall.
    """
    n, m, weight = len(wall.centre), len(wall.length), wall.weight
    tangent = np.column_stack((wall.normal[:, 1], -wall.normal[:, 0]))
    rows, columns, values = [], [], []
    for end, sign_end in enumerate((-0.5, 0.5)):
        where = wall.middle + sign_end * wall.length[:, None] * tangent
        for axis, direction in enumerate((wall.normal, tangent)):
            column = 4 * np.arange(m) + 2 * end + axis
            for block, sign in ((wall.block_a, 1.0), (wall.block_b, -1.0)):  # tension pulls a along the normal
                inside = np.flatnonzero(block < n)
                b = block[inside]
                arm = where[inside] - wall.centre[b]
                force = sign * direction[inside]
                turn = arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]
                for k, value in enumerate((force[:, 0], force[:, 1], turn)):
                    rows.append(3 * b + k)
                    columns.append(column[inside])
                    values.append(value)
    scale = np.ones(3 * n)
    scale[2::3] /= wall.gyration
    free = np.flatnonzero(wall.free.ravel())
    row, column, value = (np.concatenate(part) for part in (rows, columns, values))
    forces = coo_array((value * scale[row], (row, column)), shape=(3 * n, 4 * m)).tocsr()[free]
    unknown = csr_array((wall.reactions.reshape(3 * n, -1) * scale[:, None])[free])
    # minimise the missing forces: one in each direction on every degree of freedom
    count, reactions = len(free), unknown.shape[1]
    missing = coo_array((np.ones(count), (np.arange(count), np.arange(count))), shape=(count, count))
    equilibrium = hstack([forces, unknown, missing, -1.0 * missing])
    ends = np.arange(2 * m)
    bond = np.repeat(wall.cohesion, 2) / weight
    mu = np.repeat(wall.friction, 2)
    cone = coo_array(
        (
            np.concatenate((np.ones(2 * m), mu, -np.ones(2 * m), mu)),
            (
                np.concatenate((ends, ends, ends + 2 * m, ends + 2 * m)),
                np.concatenate((2 * ends + 1, 2 * ends, 2 * ends + 1, 2 * ends)),
            ),
        ),
        shape=(4 * m, 4 * m + reactions + 2 * count),
    )
    most = np.repeat(wall.tension, 2) / weight
    least = -np.repeat(wall.pressure, 2) / weight
    bounds = [side for pair in zip(least, most, strict=True) for side in (pair, (None, None))]
    bounds += [(None, None)] * reactions + [(0.0, None)] * (2 * count)
    objective = np.concatenate((np.zeros(4 * m + reactions), np.ones(2 * count)))
    result = linprog(
        objective,
        A_ub=cone,
        b_ub=np.concatenate((bond, bond)),
        A_eq=equilibrium,
        b_eq=-(wall.load.ravel() * scale)[free] / weight,
        bounds=bounds,
        method="highs",
    )
    return bool(result.status == 0 and result.fun > ENOUGH)
