"""Cracked joints joined into cracks."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial.distance import cdist

from damagepred.damage.joints import JointMap

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

HAIRLINE = 0.05e-3
"""Opening or slip (m) from which a joint is part of a crack: below it no eye sees one."""


class Cracks(NamedTuple):
    """Separate cracks, widest first; c of them.

    Attributes
    ----------
    width : array (c,)
        Largest opening normal to the joint (m).
    x, y : array (c,)
        Where that is (m).
    joints : array of int (c,)
        Number of interfaces it runs through.
    """

    width: FloatArray
    x: FloatArray
    y: FloatArray
    joints: NDArray[np.int64]


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
    width = np.where(cracked, np.maximum(opening, 0.0), 0.0)
    part = joints.is_wall & ((width.max(axis=1) > HAIRLINE) | (np.abs(slip).max(axis=1) > HAIRLINE))
    number = np.flatnonzero(part)
    if not number.size:
        none = np.empty(0)
        return Cracks(none, none, none, np.empty(0, np.int64))
    touching = joints.corners[number]
    count, label = connected_components(sparse.csr_array(touching.astype(np.int32) @ touching.T), directed=False)
    widest = width[number].argmax(axis=1)
    per_joint = width[number, widest]
    order = np.lexsort((-per_joint, label))
    first = order[np.searchsorted(label[order], np.arange(count))]
    rank = first[np.argsort(-per_joint[first], kind="stable")]
    rank = rank[per_joint[rank] > 0.0]  # joints that only slid are no open crack
    return Cracks(
        per_joint[rank],
        joints.contact_x[number[rank], widest[rank]],
        joints.contact_y[number[rank], widest[rank]],
        np.bincount(label, minlength=count)[label[rank]],
    )


def largest_group(cracks: Cracks, width: float, distance: float) -> int:
    """Return how many cracks of at least ``width`` (m) lie within ``distance`` (m) of one of them, itself included.

    Parameters
    ----------
    cracks : Cracks
        The cracks; where a crack is widest is where it is.
    width, distance : float
        What counts (m).
    """
    wide = cracks.width >= width * (1 - 1e-12)
    if not wide.any():
        return 0
    place = np.column_stack((cracks.x[wide], cracks.y[wide]))
    return int((cdist(place, place) <= distance * (1 + 1e-12)).sum(axis=1).max())
