"""Which blocks are near which boundary points."""

import numpy as np

from damagepred.kernels.jit import kernel, rule
from damagepred.kernels.large_contact import least_depth


@rule
def note(x, y, own, other, edges, first_edge, pose, low, high, margin, polygon, gap, count):
    """Add block ``other`` to the list of a point at (x, y) if it is near; return the length of the list."""
    if (other == own) | (high[other, 0] < x - margin) | (low[other, 0] > x + margin):
        return count
    if (high[other, 1] < y - margin) | (low[other, 1] > y + margin):
        return count
    distance, _ = least_depth(x, y, edges, first_edge[other], first_edge[other + 1], pose)
    if distance >= margin:
        return count
    if count < polygon.size:
        polygon[count] = other
        gap[count] = distance
    return count + 1


@kernel
def near_pairs(
    points, at, edges, first_edge, pose, low, high, narrow, start, widest, wide, margin, first, polygon, gap
):
    """List the blocks that are nearer than ``margin`` to each point, those it belongs to left out.

    The narrow blocks are sorted by where they begin, so that those near a point stand side by side.

    Parameters
    ----------
    points, edges, first_edge, pose
        See ``damagepred.kernels.large_contact``.
    at : array (p, 2)
        Where the points are (m).
    low, high : array (polygons, 2)
        Boxes of the blocks (m).
    narrow, wide : array of int
        Blocks to search by place, and those to try for every point.
    start : array
        Left end of the narrow blocks, rising (m).
    widest : float
        Width of the widest of them (m).
    margin : float
        What is near (m).
    first : array of int (p + 1,)
        Filled: where the list of each point begins.
    polygon, gap : array (k,)
        Filled as far as they reach: block, and signed distance from its faces (m).

    Returns
    -------
    int
        Length of the whole list.
    """
    count = 0
    for i in range(points.size):
        first[i] = count
        x, y, own = at[i, 0], at[i, 1], edges[points[i].own_edge].polygon
        begin = np.searchsorted(start, x - margin - widest)
        for s in range(begin, narrow.size):
            if start[s] > x + margin:
                break
            count = note(x, y, own, narrow[s], edges, first_edge, pose, low, high, margin, polygon, gap, count)
        for w in range(wide.size):
            count = note(x, y, own, wide[w], edges, first_edge, pose, low, high, margin, polygon, gap, count)
    first[points.size] = count
    return count
