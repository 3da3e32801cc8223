"""Cracks through bricks: zones that have yielded, and which pieces of joints they touch."""

from __future__ import annotations

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.damage.tracing import Links, Pieces


def links_of(
    pieces: Pieces, part: BoolArray, x: FloatArray, y: FloatArray, zones: IntArray, yields: BoolArray
) -> Links:
    """Return the links by which cracks run through bricks in one state.

    Zones that have yielded and share a gridpoint are linked from middle to middle; a zone in whose side a piece of a
    cracked joint lies is linked to the nearer end of that piece.

    Parameters
    ----------
    pieces : Pieces
        The joints' pieces.
    part : array of bool (p,)
        Which of them have opened or slid.
    x, y : array (g,)
        Where the gridpoints are (m).
    zones : array of int (z, 3)
        Gridpoints of each zone, counter-clockwise; bricks share none.
    yields : array of bool (z,)
        Which zones yield, or have yielded.
    """
    failed = zones[yields]
    cracked = np.flatnonzero(part)
    if not len(failed) or not cracked.size:
        return Links.none()
    corner = np.stack((x[failed], y[failed]), axis=-1)
    middle = corner.mean(axis=1)
    number = pieces.points + np.arange(len(failed))
    # zones that share a gridpoint
    order = np.argsort(failed.ravel(), kind="stable")
    gridpoint, owner = failed.ravel()[order], order // 3
    same = np.flatnonzero(gridpoint[1:] == gridpoint[:-1])
    first, second = owner[same], owner[same + 1]
    ends, place = (
        [np.column_stack((number[first], number[second]))],
        [np.stack((middle[first], middle[second]), axis=1)],
    )
    # zones that a cracked piece touches: with its ends or its middle
    at = pieces.place[cracked]
    for point in (at[:, 0], at[:, 1], at.mean(axis=1)):
        for rows in np.array_split(np.arange(len(failed)), len(failed) // 256 + 1):
            zone, piece = np.nonzero(_inside(corner[rows], point))
            zone = rows[zone]
            gap = np.linalg.norm(at[piece] - middle[zone][:, None], axis=-1)
            nearer = gap.argmin(axis=1)
            ends.append(np.column_stack((pieces.ends[cracked[piece], nearer], number[zone])))
            place.append(np.stack((at[piece, nearer], middle[zone]), axis=1))
    return Links(np.concatenate(ends), np.concatenate(place))


def _inside(corner: FloatArray, point: FloatArray) -> BoolArray:
    """Return which triangles (t, 3, 2) hold which points (p, 2), their sides included: array (t, p)."""
    found = np.ones((len(corner), len(point)), dtype=np.bool_)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        edge = corner[:, b] - corner[:, a]
        arm = point[None] - corner[:, None, a]
        area = edge[:, None, 0] * arm[..., 1] - edge[:, None, 1] * arm[..., 0]
        found &= area >= -1e-6 * (edge**2).sum(axis=1)[:, None]
    return found
