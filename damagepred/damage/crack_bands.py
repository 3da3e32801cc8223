"""Width of a crack band: the openings of neighbouring joints, summed as one measures across them.

Equilibrium often does not determine how neighbouring joints share an opening; the reading of a gauge across all of them
is determined. A straight gauge of a given length crosses joints of one kind at right angles: head joints along a
course, bed joints upwards. It lies on masonry alone and begins at a contact or the end of a joint. Its reading is the
sum of the openings of the broken joints, and the width of the band is the largest reading. A stepped or diagonal crack
is read both ways; of the two components of its opening the larger counts, and the opening is at most 1.41 times that.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.damage.joints import JointMap, Profile

PARALLEL = 1e-6
"""Slope of a joint, relative to the normal of a gauge, below which the gauge crosses it at right angles (1)."""
TO_THE_MIDDLE = 1e-5  # shift of a gauge towards the middle of the joint that it starts at (1)
ROUNDING = 1e-9  # relative rounding of lengths, and the least weight of a node in a reading (1)


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
    """Weights (gauges, nodes) of openings read across several joints; ``nodes`` (k, q or q + 2): way along each (m)."""
    start, end = joints.start[chosen], joints.end[chosen]
    along = end - start
    columns, size = nodes.shape[1], nodes.size
    across_axis = np.flatnonzero(np.abs(along[:, axis]) < PARALLEL * np.abs(along[:, 1 - axis]))
    if not across_axis.size:
        return scipy.sparse.csr_array((0, size))
    start, along, nodes = start[across_axis], along[across_axis], nodes[across_axis]
    tangent = np.sign(along[:, 1 - axis])
    # the normal of a joint points from its first block to its second; its tangent is the normal turned clockwise
    forward = (tangent > 0) == (axis == 1)
    sides = joints.blocks[chosen[across_axis]]
    behind, ahead = np.where(forward[:, None], sides, sides[:, ::-1]).T
    level = start[:, axis]
    positions = start[:, 1 - axis, None] + tangent[:, None] * nodes
    low, high = positions.min(axis=1), positions.max(axis=1)
    # joints by the block behind them, then by position: one search finds the joint ahead of a block at a position
    origin, span = low.min(), 2.0 * (high.max() - low.min())
    order = np.argsort(behind * span + (low - origin), kind="stable")
    keys = (behind * span + (low - origin))[order]

    gauge, position = np.arange(positions.size), positions.ravel()
    joint = gauge // columns
    # where two joints meet, the gauge reads the one on its side
    shifted = position + TO_THE_MIDDLE * ((low + high)[joint] / 2 - position)
    start_level = level[joint]
    gauges, places, weights = [gauge], [across_axis[joint] * columns + gauge % columns], [np.ones(len(gauge))]
    while True:
        index = np.searchsorted(keys, ahead[joint] * span + (shifted - origin), side="right") - 1
        following = order[np.maximum(index, 0)]
        meets = (index >= 0) & (ahead[joint] >= 0) & (behind[following] == ahead[joint]) & (shifted <= high[following])
        meets &= (level[following] > level[joint]) & (level[following] - start_level <= length * (1 + ROUNDING))
        if not meets.any():
            break
        gauge, position, shifted, start_level = gauge[meets], position[meets], shifted[meets], start_level[meets]
        joint = following[meets]
        for node, weight in _between_nodes(nodes[joint], tangent[joint] * (position - start[joint, 1 - axis])):
            counts = weight > ROUNDING
            gauges.append(gauge[counts])
            places.append((across_axis[joint] * columns + node)[counts])
            weights.append(weight[counts])
    several = np.unique(np.concatenate([np.empty(0, dtype=np.int64), *gauges[1:]]))
    entries = (np.concatenate(weights), (np.concatenate(gauges), np.concatenate(places)))
    return scipy.sparse.csr_array(entries, shape=(positions.size, size))[several]


def _between_nodes(nodes: FloatArray, position: FloatArray) -> Iterator[tuple[IntArray, FloatArray]]:
    """The two nodes (g, n) nearest to positions (g,) along their joints, with their weights in linear interpolation."""
    row, last = np.arange(len(nodes)), nodes.shape[1] - 1
    position = np.clip(position, nodes[:, 0], nodes[:, -1])
    first = np.clip((nodes <= position[:, None] + 1e-12).sum(axis=1) - 1, 0, max(last - 1, 0))
    distance = nodes[row, np.minimum(first + 1, last)] - nodes[row, first]
    share = np.where(distance > 0.0, (position - nodes[row, first]) / np.where(distance > 0.0, distance, 1.0), 0.0)
    yield first, 1.0 - share
    yield first + 1, share
