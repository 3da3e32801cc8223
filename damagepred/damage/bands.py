"""Width of a crack band: the openings of neighbouring joints, summed as one measures across them.

Equilibrium often does not determine how neighbouring joints share an opening; the reading of a gauge across all of them
is determined. A straight gauge of a given length crosses joints of one kind at right angles: head joints along a
course, bed joints upwards. It lies on masonry alone and begins at a contact or the end of a joint. Its reading is the
sum of the openings of the broken joints, and the width of the band is the largest reading. A stepped or diagonal crack
is read both ways; of the two components of its opening the larger counts, and the opening is at most 1.41 times that.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.damage.joints import JointMap, Profile


@dataclass(frozen=True)
class BandGauges:
    """Readings of gauges of one length on one wall, as sums of openings; k joints with q contacts, g gauges."""

    profile: Profile  # nodes of the mortar joints of the wall proper
    # (g, k q) or (g, k (q + 2)): share of the opening at each node in each reading across several joints
    sums: scipy.sparse.csr_array

    @classmethod
    @lru_cache(maxsize=8)
    def of_joints(cls, joints: JointMap, length: float) -> BandGauges:
        """Gauges of one length (m), which read joints up to this distance apart together."""
        chosen = np.flatnonzero(joints.is_wall)
        profile = joints.profile(chosen)
        parts = [_readings(joints, chosen, profile.way, axis, length) for axis in (0, 1)]
        return cls(profile, scipy.sparse.csr_array(scipy.sparse.vstack(parts)))

    def width(self, opening: FloatArray, cracked: BoolArray, threshold: float = 0.0) -> float:
        """Width of the widest crack band (m), from openings above a threshold at broken bonds (m, q)."""
        broken = cracked.ravel()[self.profile.contacts]
        if not broken.any():
            return 0.0
        gap = self.profile.of(opening)
        if self.profile.ends is not None:
            broken = np.column_stack((broken[:, 0], broken, broken[:, -1]))
        counted = np.where(broken & (gap > threshold), gap, 0.0).ravel()
        return float(max(counted.max(), (self.sums @ counted).max(initial=0.0)))


def _readings(
    joints: JointMap, chosen: IntArray, nodes: FloatArray, axis: int, length: float
) -> scipy.sparse.csr_array:
    """Readings of gauges along one axis that cross more than one joint."""
    start, end = joints.start[chosen], joints.end[chosen]
    along = end - start
    columns, size = nodes.shape[1], nodes.size
    number = np.flatnonzero(np.abs(along[:, axis]) < 1e-6 * np.abs(along[:, 1 - axis]))  # at right angles to the axis
    if not number.size:
        return scipy.sparse.csr_array((0, size))
    start, along, nodes = start[number], along[number], nodes[number]
    tangent = np.sign(along[:, 1 - axis])
    # the normal of a joint points from its first block to its second; its tangent is the normal turned clockwise
    forward = (tangent > 0) == (axis == 1)
    sides = joints.blocks[chosen[number]]
    behind, ahead = np.where(forward[:, None], sides, sides[:, ::-1]).T
    level = start[:, axis]
    position = start[:, 1 - axis, None] + tangent[:, None] * nodes
    low, high = position.min(axis=1), position.max(axis=1)
    origin, span = low.min(), 2.0 * (high.max() - low.min())
    sort = np.argsort(behind * span + (low - origin), kind="stable")
    keys = (behind * span + (low - origin))[sort]

    row, across = np.arange(position.size), position.ravel()
    joint = row // columns
    inside = across + 1e-5 * ((low + high)[joint] / 2 - across)  # where joints meet, on the side of the gauge
    rows, cells, shares = [row], [number[joint] * columns + row % columns], [np.ones(len(row))]
    last, base = joint, level[joint]
    while True:
        index = np.searchsorted(keys, ahead[last] * span + (inside - origin), side="right") - 1
        following = sort[np.maximum(index, 0)]
        ok = (index >= 0) & (ahead[last] >= 0) & (behind[following] == ahead[last]) & (inside <= high[following])
        ok &= (level[following] > level[last]) & (level[following] - base <= length * (1 + 1e-9))
        if not ok.any():
            break
        row, across, inside, base, last = row[ok], across[ok], inside[ok], base[ok], following[ok]
        way = np.clip(tangent[last] * (across - start[last, 1 - axis]), nodes[last, 0], nodes[last, -1])
        cell = np.clip((nodes[last] <= way[:, None] + 1e-12).sum(axis=1) - 1, 0, max(columns - 2, 0))
        gap = nodes[last, np.minimum(cell + 1, columns - 1)] - nodes[last, cell]
        share = np.where(gap > 0.0, (way - nodes[last, cell]) / np.where(gap > 0.0, gap, 1.0), 0.0)
        for node, weight in ((cell, 1.0 - share), (cell + 1, share)):
            some = weight > 1e-9
            rows.append(row[some])
            cells.append((number[last] * columns + node)[some])
            shares.append(weight[some])
    several = np.unique(np.concatenate([np.empty(0, dtype=np.int64), *rows[1:]]))
    data, where = np.concatenate(shares), (np.concatenate(rows), np.concatenate(cells))
    return scipy.sparse.csr_array((data, where), shape=(position.size, size))[several]
