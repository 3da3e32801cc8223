"""Cracked joints joined into cracks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.damage.joints import JointMap

HAIRLINE = 0.05e-3
"""Smallest opening or slip (m) of a joint in a crack: smaller ones are invisible."""


class Cracks(NamedTuple):
    """Separate cracks, widest first; c with an open joint, k with cracks that only slid."""

    width: FloatArray  # (c,): largest opening normal to the joint (m)
    x: FloatArray  # (c,): position of the largest opening (m)
    y: FloatArray
    joints: IntArray  # (c,): number of interfaces
    displacement: FloatArray  # (k,): largest sqrt(opening^2 + slip^2) (m)
    length: FloatArray  # (k,): total length of the interfaces (m)


NO_CRACKS = Cracks(np.empty(0), np.empty(0), np.empty(0), np.empty(0, np.int64), np.empty(0), np.empty(0))


def find_cracks(joints: JointMap, opening: FloatArray, slip: FloatArray, cracked: BoolArray) -> Cracks:
    """Cracks of the wall proper: joints beyond a hairline that touch; from opening, slip (m), broken bonds (m, q)."""
    opening = joints.widest(opening)
    beyond = (cracked & (opening > HAIRLINE)) | (slip > HAIRLINE) | (slip < -HAIRLINE)
    chosen = np.zeros(len(joints.kind), dtype=np.bool_)
    chosen[np.flatnonzero(beyond) // opening.shape[1]] = True
    chosen &= joints.is_wall
    number = np.flatnonzero(chosen)
    if not number.size:
        return NO_CRACKS
    count, label = _connected(joints, chosen, number)
    width = np.where(cracked[number], np.maximum(opening[number], 0.0), 0.0)
    widest = width.argmax(axis=1)
    per_joint = width[np.arange(len(number)), widest]
    x, y = (coordinate[number, widest] for coordinate in (joints.contact_x, joints.contact_y))
    order = np.lexsort((y, x, -per_joint, label))  # ties are ordered by position, not by number
    first = order[np.searchsorted(label[order], np.arange(count))]
    rank = first[np.argsort(-per_joint[first], kind="stable")]
    rank = rank[per_joint[rank] > 0.0]  # joints that only slid are no open crack
    displacement, length = np.zeros(count), np.zeros(count)
    np.add.at(length, label, joints.contact_length[number].sum(axis=1))
    np.maximum.at(displacement, label, np.hypot(width, slip[number]).max(axis=1))
    return Cracks(
        per_joint[rank], x[rank], y[rank], np.bincount(label, minlength=count)[label[rank]], displacement, length
    )


def psi(cracks: Cracks) -> float:
    """Damage parameter Psi = 2 n^0.15 c^0.3 of n cracks (Korswagen 2024), c = sum(c_i^2 L_i) / sum(c_i L_i) in mm."""
    weight = cracks.displacement * cracks.length
    if not weight.any():
        return 0.0
    mean = 1e3 * float((cracks.displacement * weight).sum() / weight.sum())
    return float(2.0 * len(weight) ** 0.15 * mean**0.3)


def _connected(joints: JointMap, chosen: BoolArray, number: IntArray) -> tuple[int, NDArray[np.int32]]:
    """Number of connected pieces of the chosen interfaces, and the piece of each."""
    first, second = joints.wall_neighbours
    both = np.flatnonzero(chosen[first] & chosen[second])
    if not both.size:
        return len(number), np.arange(len(number), dtype=np.int32)
    a, b = np.searchsorted(number, first[both]), np.searchsorted(number, second[both])
    graph = scipy.sparse.csr_array((np.ones(len(a), dtype=np.int8), (a, b)), shape=(len(number),) * 2)
    count, label = scipy.sparse.csgraph.connected_components(graph, directed=False)
    return int(count), label


def group_widths(cracks: Cracks, distance: float, counts: Sequence[int]) -> tuple[float, ...]:
    """Width of the narrowest crack in the widest group of each count of cracks within a distance (m), otherwise 0."""
    # a group of cracks of at least some width exists if, and only if, this width is as large
    total = len(cracks.width)
    if total < min(counts):
        return (0.0,) * len(counts)
    order = np.argsort(-cracks.width, kind="stable")
    width = cracks.width[order]
    position = np.column_stack((cracks.x, cracks.y))[order]
    near = scipy.spatial.distance.cdist(position, position) <= distance * (1 + 1e-12)
    within = np.cumsum(near, axis=1)  # around each crack, widest first
    widths = []
    for count in counts:
        enough = within >= count
        last = enough.argmax(axis=1)
        widths.append(float(np.where(enough[:, -1], np.minimum(width, width[last]), 0.0).max()))
    return tuple(widths)
