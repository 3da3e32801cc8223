"""Can a wall stand as it is cracked? Statics alone, by linear programming: a fall that it allows is not proven right.

Forces at the two ends of every interface are sought that keep all blocks in equilibrium, under pressure and friction,
and where bonds are whole with all of their cohesion and tension at once. That is more than the joint can carry, whose
stresses are not all at their limits together, and dilates as it slides, which the solvers' joints do not. So where
there are no such forces, the wall falls.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import coo_array, hstack

from damagepred.assembly import Model
from damagepred.solvers import ContactState, Increment

ENOUGH = 1e-7
"""Forces that are missing, over the mean weight of a block, that rounding explains."""


def cannot_stand(model: Model, step: Increment) -> bool:
    """Tell whether no forces keep the wall in equilibrium, bonds being broken as they are in an increment.

    Parameters
    ----------
    model : Model
        n blocks, m interfaces.
    step : Increment
        In which it fell.
    """
    face, law, n = model.interfaces, model.properties, model.n_blocks
    free = np.ones(3 * n, dtype=bool)
    free[model.supports.prescribed[model.supports.prescribed < free.size]] = False
    load = model.supports.load + step.progress * model.supports.live_load
    m = len(face.kind)
    area = face.contact_area
    # tension is positive
    whole = (step.state != ContactState.CRACKED) & (law.gap[:, None] == 0.0)
    half = 0.5 * face.length

    def carries(intact: np.ndarray, left: np.ndarray) -> np.ndarray:
        each = np.broadcast_to(np.where(whole, intact[:, None], left[:, None]), area.shape)
        return np.asarray((area * each).sum(axis=1))

    tension = carries(law.tensile_strength, law.residual_tensile_strength)
    cohesion = carries(law.cohesion, law.residual_cohesion)
    friction = np.where(whole.any(axis=1), np.maximum(law.friction, law.residual_friction), law.residual_friction)
    normal = np.column_stack((face.normal_x, face.normal_y))
    tangent = np.column_stack((face.normal_y, -face.normal_x))
    rows, columns, values = [], [], []
    centre = np.column_stack((model.blocks.x, model.blocks.y))
    for end, sign_end in enumerate((-1.0, 1.0)):
        where = np.column_stack((face.x, face.y)) + sign_end * half[:, None] * tangent
        for axis, direction in enumerate((normal, tangent)):
            column = 4 * np.arange(m) + 2 * end + axis
            for block, sign in ((face.block_a, 1.0), (face.block_b, -1.0)):  # tension pulls a along the normal
                inside = np.flatnonzero(block < n)
                b = block[inside]
                arm = where[inside] - centre[b]
                force = sign * direction[inside]
                turn = arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]
                for k, value in enumerate((force[:, 0], force[:, 1], turn)):
                    rows.append(3 * b + k)
                    columns.append(column[inside])
                    values.append(value)
    weight = model.mean_block_weight
    arms = np.sqrt(model.blocks.polar / model.blocks.area)
    scale = np.ones(3 * n)
    scale[2::3] /= arms
    row, column, value = (np.concatenate(part) for part in (rows, columns, values))
    forces = coo_array((value * scale[row], (row, column)), shape=(3 * n, 4 * m)).tocsr()[np.flatnonzero(free)]
    # what is missing, at least: a force either way on every degree of freedom
    count = int(free.sum())
    missing = coo_array((np.ones(count), (np.arange(count), np.arange(count))), shape=(count, count))
    equilibrium = hstack([forces, missing, -1.0 * missing])
    ends = np.arange(2 * m)
    bond = np.repeat(cohesion, 2) / weight
    mu = np.repeat(friction, 2)
    cone = coo_array(
        (
            np.concatenate((np.ones(2 * m), mu, -np.ones(2 * m), mu)),
            (np.concatenate((ends, ends, ends + 2 * m, ends + 2 * m)),
             np.concatenate((2 * ends + 1, 2 * ends, 2 * ends + 1, 2 * ends))),
        ),
        shape=(4 * m, 4 * m + 2 * count),
    )  # fmt: skip
    most = np.repeat(tension, 2) / weight
    least = -np.repeat(law.compressive_strength * area.sum(axis=1), 2) / weight
    bounds = [side for pair in zip(least, most, strict=True) for side in (pair, (None, None))]
    bounds += [(0.0, None)] * (2 * count)
    objective = np.concatenate((np.zeros(4 * m), np.ones(2 * count)))
    result = linprog(
        objective, A_ub=cone, b_ub=np.concatenate((bond, bond)), A_eq=equilibrium,
        b_eq=-(load * scale)[free] / weight, bounds=bounds, method="highs",
    )  # fmt: skip
    return bool(result.status == 0 and result.fun > ENOUGH)
