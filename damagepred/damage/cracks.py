"""Cracked joints joined into cracks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial.distance import cdist

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.damage.joints import JointMap

HAIRLINE = 0.05e-3
"""Opening or slip (m) from which a joint is part of a crack: below it no eye sees one."""


class Cracks(NamedTuple):
    """Separate cracks, widest first; c of them.

    Attributes
    ----------
    width : array (c,)
        Largest opening normal to the joint (m).
    x, y : array (c,)
        Where that is, or the contact nearest to it (m).
    joints : array of int (c,)
        Number of interfaces it runs through.
    displacement : array (k,)
        Of these and of cracks that only slid: largest sqrt(opening^2 + slip^2) (m).
    length : array (k,)
        Of their interfaces together (m).
    """

    width: FloatArray
    x: FloatArray
    y: FloatArray
    joints: IntArray
    displacement: FloatArray
    length: FloatArray


NO_CRACKS = Cracks(np.empty(0), np.empty(0), np.empty(0), np.empty(0, np.int64), np.empty(0), np.empty(0))


def find_cracks(joints: JointMap, opening: FloatArray, slip: FloatArray, cracked: BoolArray) -> Cracks:
    """Join the cracked joints of the wall proper into cracks.

    Two joints belong to one crack if they touch at a corner and each has opened or slid by more than a hairline, so a
    stepped crack is one crack, and two cracks with sound masonry between them are two.

    Parameters
    ----------
    joints : JointMap
        Where they lie.
    opening, slip : array (m, q)
        Opening normal to and slip along the joint at each contact (m).
    cracked : array of bool (m, q)
        Whether the bond is broken.
    """
    opening = joints.widest(opening)
    beyond = (cracked & (opening > HAIRLINE)) | (slip > HAIRLINE) | (slip < -HAIRLINE)
    part = np.zeros(len(joints.kind), dtype=np.bool_)
    part[np.flatnonzero(beyond) // opening.shape[1]] = True
    part &= joints.is_wall
    number = np.flatnonzero(part)
    if not number.size:
        return NO_CRACKS
    count, label = _connected(joints, part, number)
    width = np.where(cracked[number], np.maximum(opening[number], 0.0), 0.0)
    widest = width.argmax(axis=1)
    per_joint = width[np.arange(len(number)), widest]
    x, y = (at[number, widest] for at in (joints.contact_x, joints.contact_y))
    order = np.lexsort((y, x, -per_joint, label))  # of joints as wide as each other the place decides, not the number
    first = order[np.searchsorted(label[order], np.arange(count))]
    rank = first[np.argsort(-per_joint[first], kind="stable")]
    rank = rank[per_joint[rank] > 0.0]  # joints that only slid are no open crack
    displacement, length = np.zeros(count), np.zeros(count)
    np.add.at(length, label, joints.contact_length[number].sum(axis=1))
    np.maximum.at(displacement, label, np.hypot(width, slip[number]).max(axis=1))
    return Cracks(
        per_joint[rank],
        x[rank],
        y[rank],
        np.bincount(label, minlength=count)[label[rank]],
        displacement,
        length,
    )


def psi(cracks: Cracks) -> float:
    """Return the damage parameter Psi = 2 n^0.15 c^0.3 of n cracks (Korswagen 2024), 0 without a crack.

    c (mm) is the mean of their displacements c_i weighted by displacement and length: sum(c_i^2 L_i) / sum(c_i L_i).
    One crack of 0.1 mm has Psi = 1, the first that is seen; 1.5, 2.5 and 3.5 part the grades above.

    Parameters
    ----------
    cracks : Cracks
        Of the wall proper.
    """
    weight = cracks.displacement * cracks.length
    if not weight.any():
        return 0.0
    mean = 1e3 * float((cracks.displacement * weight).sum() / weight.sum())
    return float(2.0 * len(weight) ** 0.15 * mean**0.3)


def _connected(joints: JointMap, part: BoolArray, number: IntArray) -> tuple[int, NDArray[np.int32]]:
    """Return how many pieces interfaces ``number`` make, those where ``part`` is True, and the piece of each."""
    first, second = joints.wall_neighbours
    both = np.flatnonzero(part[first] & part[second])
    if not both.size:
        return len(number), np.arange(len(number), dtype=np.int32)
    a, b = np.searchsorted(number, first[both]), np.searchsorted(number, second[both])
    graph = sparse.csr_array((np.ones(len(a), dtype=np.int8), (a, b)), shape=(len(number),) * 2)
    count, label = connected_components(graph, directed=False)
    return int(count), label


def group_widths(cracks: Cracks, distance: float, counts: Sequence[int]) -> tuple[float, ...]:
    """Return for each count the width of the narrowest crack in the widest group of that many cracks (m), 0 if none.

    The rule of any damage table is then a comparison: a group of that many cracks of at least some width exists if, and
    only if, this width is as large.

    Parameters
    ----------
    cracks : Cracks
        The cracks.
    distance : float
        Within which of one of them they lie (m).
    counts : sequence of int
        Numbers of cracks, from 2.
    """
    total = len(cracks.width)
    if total < min(counts):
        return (0.0,) * len(counts)
    order = np.argsort(-cracks.width, kind="stable")
    width = cracks.width[order]
    so_far = np.cumsum(_near(cracks.x[order], cracks.y[order], distance), axis=1)  # around each, from the widest on
    found = []
    for count in counts:
        enough = so_far >= count
        last = enough.argmax(axis=1)
        found.append(float(np.where(enough[:, -1], np.minimum(width, width[last]), 0.0).max()))
    return tuple(found)


def _near(x: FloatArray, y: FloatArray, distance: float) -> BoolArray:
    place = np.column_stack((x, y))
    return np.asarray(cdist(place, place) <= distance * (1 + 1e-12))
