"""Facets of deformable blocks, and the pieces of them that interfaces join, as bodies for contacts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.solvers.dynamics.options import DEFAULTS, DynamicsOptions


class FacetBodies(NamedTuple):
    """All facets of deformable blocks, then the pieces (``Mesh.piece_facet``) that do not lie in the middle of theirs.

    They are the bodies from number n + 1; the others are their facet.

    Attributes
    ----------
    start, end : array of int (s,)
        Gridpoints, counter-clockwise.
    share : array (s,)
        Place of the body between them: 1/2 for facets.
    block, face : array of int (s,)
        Block, and number of the straight face, of all faces.
    place, x_start, x_end : array (s, 2)
        Of the body and the two gridpoints (m).
    face_low, face_high : array (s,)
        Ends of the face, clockwise from the end of the facet (m).
    facets : int
        Number of facets, which come first.
    piece : array of int (p,)
        Body of each piece.
    """

    start: IntArray
    end: IntArray
    share: FloatArray
    block: IntArray
    face: IntArray
    place: FloatArray
    x_start: FloatArray
    x_end: FloatArray
    face_low: FloatArray
    face_high: FloatArray
    facets: int
    piece: IntArray


def facet_bodies(model: Model, options: DynamicsOptions = DEFAULTS) -> FacetBodies:
    """Return the facets and pieces of a model; none if all blocks are rigid."""
    mesh = model.mesh
    if mesh is None:
        none, real, pairs = np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 2))
        return FacetBodies(none, none, real, none, none, pairs, pairs, pairs, real, real, 0, none)
    count = len(mesh.facets)
    own = np.abs(mesh.piece_place - 0.5) > options.middle_tolerance
    piece = np.where(own, count + np.cumsum(own) - 1, mesh.piece_facet)
    facet = np.concatenate((np.arange(count), mesh.piece_facet[own]))
    share = np.concatenate((np.full(count, 0.5), mesh.piece_place[own]))
    at = np.column_stack((mesh.x, mesh.y))
    start, end = mesh.facets[:, 0], mesh.facets[:, 1]
    way = (at[end] - at[start]) / np.hypot(*(at[end] - at[start]).T)[:, None]
    # facets begin in a corner, block by block
    turns = np.ones(count, dtype=np.bool_)
    turns[1:] = np.abs(way[:-1, 0] * way[1:, 1] - way[:-1, 1] * way[1:, 0]) > options.corner_sine
    turns[mesh.first_facet[:-1]] = True
    face = np.cumsum(turns) - 1
    last = np.append(np.flatnonzero(turns)[1:], count) - 1
    clockwise_first, clockwise_last = at[end[last]][face], at[start[np.flatnonzero(turns)]][face]
    low = -((clockwise_first - at[end]) * way).sum(axis=1)
    high = -((clockwise_last - at[end]) * way).sum(axis=1)
    place = (1.0 - share)[:, None] * at[start[facet]] + share[:, None] * at[end[facet]]
    return FacetBodies(
        start[facet],
        end[facet],
        share,
        mesh.facet_block[facet],
        face[facet],
        place,
        at[start[facet]],
        at[end[facet]],
        low[facet],
        high[facet],
        count,
        piece,
    )
