"""Cracks through bricks: yielded zones, and the pieces of joints that they touch."""

from __future__ import annotations

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.damage.tracing import Links, Pieces


def links_of(
    pieces: Pieces, open_pieces: BoolArray, x: FloatArray, y: FloatArray, zones: IntArray, yields: BoolArray
) -> Links:
    """Links of cracks through yielded zones (z,), between joint pieces that have opened or slid (p,).

    Yielded zones that share a gridpoint are linked from middle to middle; a zone with a piece of a cracked joint in
    its side is linked to the nearer end of that piece.
    """
    failed = zones[yields]
    cracked = np.flatnonzero(open_pieces)
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
    ends, positions = (
        [np.column_stack((number[first], number[second]))],
        [np.stack((middle[first], middle[second]), axis=1)],
    )
    # zones that a cracked piece touches: with its ends or its middle
    piece_ends = pieces.place[cracked]
    for point in (piece_ends[:, 0], piece_ends[:, 1], piece_ends.mean(axis=1)):
        for rows in np.array_split(np.arange(len(failed)), len(failed) // 256 + 1):
            zone, piece = np.nonzero(_inside(corner[rows], point))
            zone = rows[zone]
            gap = np.linalg.norm(piece_ends[piece] - middle[zone][:, None], axis=-1)
            nearer = gap.argmin(axis=1)
            ends.append(np.column_stack((pieces.ends[cracked[piece], nearer], number[zone])))
            positions.append(np.stack((piece_ends[piece, nearer], middle[zone]), axis=1))
    return Links(np.concatenate(ends), np.concatenate(positions))


def _inside(corner: FloatArray, point: FloatArray) -> BoolArray:
    """Which triangles (t, 3, 2) contain which points (p, 2), sides included: array (t, p)."""
    inside = np.ones((len(corner), len(point)), dtype=np.bool_)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        edge = corner[:, b] - corner[:, a]
        arm = point[None] - corner[:, None, a]
        area = edge[:, None, 0] * arm[..., 1] - edge[:, None, 1] * arm[..., 0]
        inside &= area >= -1e-6 * (edge**2).sum(axis=1)[:, None]
    return inside
