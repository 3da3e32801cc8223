"""Nested dissection of a wall (George 1973): separators, and the parts that they leave."""

import numpy as np

from damagepred.kernels.jit import kernel, law

BISECTIONS = 60
"""Bisections that find the median: the interval left is as small as rounding."""


@law
def _median(nodes, values, weight):
    """Return the value below which about half the weight lies; a larger one than the least, if there is any.

    By bisection: code that sorts takes far longer to compile than all the rest.
    """
    half, low, high = 0.0, np.inf, -np.inf
    for node in nodes:
        half += 0.5 * weight[node]
        low, high = min(low, values[node]), max(high, values[node])
    for _ in range(BISECTIONS):
        middle, below = 0.5 * (low + high), 0.0
        for node in nodes:
            below += weight[node] if values[node] <= middle else 0
        low, high = (low, middle) if below >= half else (middle, high)
    found = np.inf
    for node in nodes:
        if low < values[node] < found:
            found = values[node]
    return found


@law
def _mark_separator(listed, on_left, sides, block_a, block_b, left, front, separates):
    """Mark the nodes without a front on the left, or on the right, of the interfaces that are cut."""
    for i in listed:
        if left[block_a[i]] != left[block_b[i]]:
            side = 0 if left[block_a[i]] == on_left else 1
            for node in sides[i, side]:
                if node >= 0 and front[node] < 0:
                    separates[node] = True


@law
def _separate(nodes, listed, place, weight, block, sides, block_a, block_b, left, front, separates):
    """Find the lightest separator of a part: cuts along both axes, nodes on either side; return whether there is one.

    ``left`` becomes the half of each block, and ``separates`` tells which nodes are in the separator.
    """
    best, best_axis, best_side = np.inf, -1, True
    for turn in range(3):  # both axes, then the better one again
        axis = best_axis if turn == 2 else turn
        if axis < 0:
            return False
        values, least = place[axis], np.inf
        middle = _median(nodes, values, weight)
        for node in nodes:
            least = min(least, values[node])
            left[block[node]] = values[node] < middle
        if middle == least or middle == np.inf:
            continue
        for on_left in (True, False):
            if turn == 2 and on_left != best_side:
                continue
            _mark_separator(listed, on_left, sides, block_a, block_b, left, front, separates)
            total = 0.0
            for node in nodes:
                if separates[node]:
                    total += weight[node]
                    separates[node] = turn == 2
            if total < best:
                best, best_axis, best_side = total, axis, on_left
    return True


@law
def _part_nodes(nodes, room, block, left, separates, within):
    """Put the nodes on the left first, those on the right next, and the separator last; return how many are where."""
    for j in range(nodes.size):
        room[j] = nodes[j]
        within[block[nodes[j]]] = False
    on_left, on_right, end = 0, 0, nodes.size
    for turn in range(2):
        for j in range(end):
            node = room[j]
            if not separates[node] and left[block[node]] == (turn == 0):
                nodes[on_left + on_right] = node
                within[block[node]] = True
                on_left, on_right = on_left + (turn == 0), on_right + (turn == 1)
    at = on_left + on_right
    for j in range(end):
        if separates[room[j]]:
            nodes[at] = room[j]
            at += 1
    return on_left, on_right


@law
def _part_interfaces(listed, room, block_a, block_b, left, within):
    """Put the interfaces within the left half first, and those within the right one next; return how many there are."""
    for j in range(listed.size):
        room[j] = listed[j]
    on_left, on_right, end = 0, 0, listed.size
    for turn in range(2):
        for j in range(end):
            i = room[j]
            a, b = block_a[i], block_b[i]
            if within[a] and within[b] and left[a] == (turn == 0) and left[b] == (turn == 0):
                listed[on_left + on_right] = i
                on_left, on_right = on_left + (turn == 0), on_right + (turn == 1)
    return on_left, on_right


@kernel
def dissect(front, first, smallest, place, weight, block, sides, block_a, block_b, nodes, listed, parts, room, marks):
    """Set the fronts of all nodes listed: separators before the parts that they leave.

    Parameters
    ----------
    front : array of int (n,)
        Front of each node, -1 if it has none yet; filled.
    first : int
        Number of the first front.
    smallest : int
        Degrees of freedom up to which a part is one front.
    place : array (2, n)
        Coordinates of the blocks of the nodes, equal to the last digit where they are in line.
    weight, block : array of int (n,)
        Number of degrees of freedom of each node, and its block.
    sides : array of int (m, 2, w / 2)
        Nodes of the two sides of each interface, -1 where there are fewer.
    block_a, block_b : array of int (m,)
        Blocks of the two sides.
    nodes, listed : array of int
        Nodes without a front, and interfaces between their blocks; reordered.
    parts : array of int (n + 1, 4)
        Scratch: where the nodes and interfaces of parts yet to be separated begin and end.
    room : array of int
        Scratch, as long as the longer of ``nodes`` and ``listed``.
    marks : array of bool (3, n)
        Scratch, all false: separator, left half, and blocks within it.
    """
    separates, left, within = marks[0], marks[1], marks[2]
    parts[0, 0], parts[0, 1], parts[0, 2], parts[0, 3] = 0, nodes.size, 0, listed.size
    count = 1
    while count > 0:
        count -= 1
        start, end, face, last = parts[count, 0], parts[count, 1], parts[count, 2], parts[count, 3]
        own, faces, total = nodes[start:end], listed[face:last], 0
        for node in own:
            total += weight[node]
        if total <= smallest or not _separate(
            own, faces, place, weight, block, sides, block_a, block_b, left, front, separates
        ):
            for node in own:
                front[node] = first
            first += own.size > 0
            continue
        on_left, on_right = _part_nodes(own, room, block, left, separates, within)
        middle = start + on_left
        for node in own[on_left + on_right :]:
            front[node], separates[node] = first, False
        first += on_left + on_right < own.size
        in_left, in_right = _part_interfaces(faces, room, block_a, block_b, left, within)
        parts[count, 0], parts[count, 1] = middle, middle + on_right
        parts[count, 2], parts[count, 3] = face + in_left, face + in_left + in_right
        parts[count + 1, 0], parts[count + 1, 1] = start, middle
        parts[count + 1, 2], parts[count + 1, 3] = face, face + in_left
        count += 2
