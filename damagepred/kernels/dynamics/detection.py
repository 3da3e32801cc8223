"""Which blocks are near which boundary points."""

import numpy as np

from damagepred.kernels.dynamics.contact import face_frame, signed_distances
from damagepred.kernels.jit import kernel, rule


@rule
def _append_if_near(bodies, i, other, pose, strains, low, high, margin, polygon, edge, gap, count):
    """Append a block to the neighbour list of point i if it is within the margin; return the length of the list."""
    x, y, along_x, along_y = face_frame(bodies.points, i, bodies.edges, pose, strains)
    own = bodies.edges[bodies.points[i].own_edge].polygon
    if (other == own) | (high[other, 0] < x - margin) | (low[other, 0] > x + margin):
        return count
    if (high[other, 1] < y - margin) | (low[other, 1] > y + margin):
        return count
    faced, which, others = signed_distances(x, y, along_x, along_y, bodies, other, pose, strains)
    if (faced >= margin) | (others >= margin):
        return count
    if count < polygon.size:
        polygon[count] = other
        edge[count] = which
        gap[count] = faced
    return count + 1


@kernel
def find_neighbours(
    bodies, left, pose, strains, low, high, narrow, start, widest, wide, margin, first, polygon, edge, gap
):
    """Fill the neighbour list (Verlet 1967) of all points: other blocks nearer than ``margin``.

    The narrow blocks are sorted by their left ends, so a binary search finds the first that may be near.

    Parameters
    ----------
    bodies, pose, strains
        See ``damagepred.kernels.dynamics.contact.contact_forces``.
    left : array (p,)
        Coordinate x of the points (m).
    low, high : array (polygons, 2)
        Bounding boxes of the blocks (m).
    narrow, wide : array of int
        Blocks found by the binary search, and those tried for every point.
    start : array
        Left end of the narrow blocks, rising (m).
    widest : float
        Width of the widest of them (m).
    margin : float
        Distance below which a block is a neighbour (m).
    first : array of int (p + 1,)
        Filled: where the list of each point begins.
    polygon, edge, gap : array (k,)
        Filled up to their size: block, its edge that the point's face looks at, and signed distance from it (m).

    Returns
    -------
    int
        Length of the whole list.
    """
    count = 0
    for i in range(left.size):
        first[i] = count
        x = left[i]
        begin = np.searchsorted(start, x - margin - widest)
        for s in range(begin, narrow.size):
            if start[s] > x + margin:
                break
            count = _append_if_near(bodies, i, narrow[s], pose, strains, low, high, margin, polygon, edge, gap, count)
        for w in range(wide.size):
            count = _append_if_near(bodies, i, wide[w], pose, strains, low, high, margin, polygon, edge, gap, count)
    first[left.size] = count
    return count
