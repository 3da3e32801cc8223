"""Nested dissection of a wall (George 1973): separators, and the parts that they leave."""

import numpy as np

from damagepred.kernels.jit import kernel_making_arrays, law


@kernel_making_arrays
def _median(values, weight):
    """Return the value below which about half the weight lies; a larger one than the least, if there is any."""
    order = np.argsort(values)
    half, total = 0.5 * weight.sum(), 0.0
    for i in order:
        total += weight[i]
        if total >= half and values[i] > values[order[0]]:
            return values[i]
    return values[order[-1]]


@law
def _mark_separator(cut, on_left, sides, block_a, left, front, marked):
    """Mark the nodes without a front of the cut interfaces' sides on the left, or on the right."""
    for i in cut:
        side = 0 if left[block_a[i]] == on_left else 1
        for node in sides[i, side]:
            if node >= 0 and front[node] < 0:
                marked[node] = True


@kernel_making_arrays
def _separate(nodes, listed, place, block, weight, sides, block_a, block_b, left, front, separates):
    """Find the lightest separator of a part: cuts along both axes, nodes on either side; return whether there is one.

    ``left`` becomes the half of each block, and ``separates`` tells which nodes are in the separator.
    """
    best, best_axis, best_side = np.inf, -1, True
    for turn in range(3):  # both axes, then the better one again
        axis = best_axis if turn == 2 else turn
        if axis < 0:
            return False
        values = place[axis, block[nodes]]
        middle = _median(values, weight[nodes])
        if middle == values.min():
            continue
        for j in range(nodes.size):
            left[block[nodes[j]]] = values[j] < middle
        cut = listed[left[block_a[listed]] != left[block_b[listed]]]
        for on_left in (True, False):
            if turn == 2 and on_left != best_side:
                continue
            _mark_separator(cut, on_left, sides, block_a, left, front, separates)
            total = 0.0
            for node in nodes:
                if separates[node]:
                    total += weight[node]
                    separates[node] = turn == 2
            if total < best:
                best, best_axis, best_side = total, axis, on_left
    return True


@kernel_making_arrays
def dissect(front, first, smallest, place, block, weight, sides, block_a, block_b):
    """Set the fronts of all nodes without one: separators before the parts that they leave.

    Parameters
    ----------
    front : array of int (nodes,)
        Front of each node, -1 if it has none yet; filled.
    first : int
        Number of the first front.
    smallest : int
        Degrees of freedom up to which a part is one front.
    place : array (2, blocks)
        Coordinates of the blocks, equal to the last digit where they are in line.
    block, weight : array of int (nodes,)
        Block of each node, and its number of degrees of freedom.
    sides : array of int (m, 2, w / 2)
        Nodes of the two sides of each interface, -1 where there are fewer.
    block_a, block_b : array of int (m,)
        Blocks of the two sides.
    """
    left, separates = np.zeros(place.shape[1], dtype=np.bool_), np.zeros(front.size, dtype=np.bool_)
    within = np.zeros(place.shape[1], dtype=np.bool_)
    everything = np.flatnonzero((front < 0) & (weight > 0))
    for node in everything:
        within[block[node]] = True
    parts = [(everything, np.flatnonzero(within[block_a] & within[block_b]))]
    while len(parts) > 0:
        nodes, listed = parts.pop()
        whole = weight[nodes].sum() <= smallest
        if whole or not _separate(nodes, listed, place, block, weight, sides, block_a, block_b, left, front, separates):
            front[nodes] = first
            first += nodes.size > 0
            continue
        separator = separates[nodes]
        front[nodes[separator]] = first
        first += separator.any()
        for node in nodes:
            separates[node] = False
            within[block[node]] = False
        on_left, rest = left[block[nodes]], ~separator
        for node in nodes[rest]:
            within[block[node]] = True
        listed = listed[within[block_a[listed]] & within[block_b[listed]]]
        a_left, b_left = left[block_a[listed]], left[block_b[listed]]
        parts.append((nodes[rest & ~on_left], listed[~a_left & ~b_left]))
        parts.append((nodes[rest & on_left], listed[a_left & b_left]))
