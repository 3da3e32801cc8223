"""Limit analysis of dry walls by linear programming: rigid blocks, no tension, associated friction.

It shares nothing with the package: it finds the joints itself and knows only statics. The static theorem: the largest
factor on the live load for which forces exist that keep all blocks in equilibrium and obey n >= 0, |t| <= mu n. Each
joint carries its forces at its two ends, which is no restriction: two forces make any resultant within the joint.

The factor is that of joints that dilate when they slide. Joints that do not may collapse earlier; at low friction and
where walls turn rather than slide the two are close or the same.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import coo_array

from damagepred.arrays import FloatArray

Polygon = Sequence[tuple[float, float]]


class Joint(NamedTuple):
    """Common part of two blocks' edges: from ``start`` to ``end``, ``normal`` pointing from a to b."""

    a: int
    b: int
    start: FloatArray
    end: FloatArray
    normal: FloatArray


def area_and_centroid(corners: FloatArray) -> tuple[float, FloatArray]:
    """Return the area (m2, positive if counter-clockwise) and centroid (m) of a polygon."""
    after = np.roll(corners, -1, axis=0)
    cross = corners[:, 0] * after[:, 1] - after[:, 0] * corners[:, 1]
    area = cross.sum() / 2
    return float(area), ((corners + after) * cross[:, None]).sum(axis=0) / (6 * area)


def joints_between(blocks: Sequence[Polygon]) -> list[Joint]:
    """Return where edges of counter-clockwise blocks lie on each other."""
    polygons = [np.array(block, dtype=float) for block in blocks]
    size = max(float(np.ptp(p, axis=0).max()) for p in polygons)
    found = []
    for a, one in enumerate(polygons):
        for b in range(a + 1, len(polygons)):
            other = polygons[b]
            if (one.min(0) > other.max(0) + 1e-9 * size).any() or (other.min(0) > one.max(0) + 1e-9 * size).any():
                continue
            for start, end in zip(one, np.roll(one, -1, axis=0), strict=True):
                along = (end - start) / np.linalg.norm(end - start)
                normal = np.array([along[1], -along[0]])
                for first, last in zip(other, np.roll(other, -1, axis=0), strict=True):
                    if max(abs((first - start) @ normal), abs((last - start) @ normal)) > 1e-9 * size:
                        continue
                    low, high = max(0.0, (last - start) @ along), min((end - start) @ along, (first - start) @ along)
                    if high - low > 1e-9 * size:
                        found.append(Joint(a, b, start + low * along, start + high * along, normal))
    return found


def collapse_factor(blocks: Sequence[Polygon], held: set, friction: float, dead: FloatArray, live: FloatArray) -> float:
    """Return the largest factor on the live load."""
    joints = joints_between(blocks)
    centroid = [area_and_centroid(np.array(block, dtype=float))[1] for block in blocks]
    free = [i for i in range(len(blocks)) if i not in held]
    row = {block: 3 * i for i, block in enumerate(free)}
    count = 4 * len(joints)  # n and t at the start, n and t at the end; then the factor
    entries: list[tuple[int, int, float]] = []
    for i, joint in enumerate(joints):
        tangent = np.array([joint.normal[1], -joint.normal[0]])
        for k, place in enumerate((joint.start, joint.end)):
            for d, direction in enumerate((joint.normal, tangent)):
                for block, sign in ((joint.a, -1.0), (joint.b, 1.0)):  # n presses b along the normal, a against it
                    if block in held:
                        continue
                    arm = place - centroid[block]
                    force = sign * direction
                    column, at = 4 * i + 2 * k + d, row[block]
                    entries += [(at, column, force[0]), (at + 1, column, force[1])]
                    entries.append((at + 2, column, arm[0] * force[1] - arm[1] * force[0]))
    entries += [(row[b] + axis, count, live[b, axis]) for b in free for axis in range(3) if live[b, axis]]
    rows, columns, values = zip(*entries, strict=True)
    equilibrium = coo_array((values, (rows, columns)), shape=(3 * len(free), count + 1))
    pairs = np.arange(0, count, 2)
    cone = coo_array(
        (
            np.concatenate((np.full(2 * len(pairs), -friction), np.ones(len(pairs)), -np.ones(len(pairs)))),
            (np.tile(np.arange(2 * len(pairs)), 2), np.concatenate((pairs, pairs, pairs + 1, pairs + 1))),
        ),
        shape=(2 * len(pairs), count + 1),
    )
    bounds = [(0, None), (None, None)] * (2 * len(joints)) + [(0, None)]
    objective = np.zeros(count + 1)
    objective[-1] = -1.0
    b_ub = np.zeros(2 * len(pairs))
    b_eq = -dead[free].ravel()
    result = linprog(objective, A_ub=cone, b_ub=b_ub, A_eq=equilibrium, b_eq=b_eq, bounds=bounds, method="highs")
    if result.status != 0:
        raise ValueError(f"no collapse factor: {result.message}")
    return float(result.x[-1])
