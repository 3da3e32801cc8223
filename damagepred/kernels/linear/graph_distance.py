"""Breadth-first distance of blocks, counted in joints, from the nearest of some roots."""

import numpy as np

from damagepred.kernels.jit import kernel_making_arrays


@kernel_making_arrays
def joints_away(start, end, count, roots):
    """Return over how many joints each block is reached from the nearest root; -1 where there is no way.

    Parameters
    ----------
    start, end : array of int (m,)
        Blocks that each joint connects.
    count : int
        Number of blocks.
    roots : array of int
        Blocks to begin at.

    Returns
    -------
    array of int (count,)
    """
    first = np.zeros(count + 1, dtype=np.int64)
    for j in range(len(start)):
        first[start[j] + 1] += 1
        first[end[j] + 1] += 1
    for i in range(count):
        first[i + 1] += first[i]
    other = np.empty(2 * len(start), dtype=np.int64)
    place = first[:count].copy()
    for j in range(len(start)):
        other[place[start[j]]] = end[j]
        place[start[j]] += 1
        other[place[end[j]]] = start[j]
        place[end[j]] += 1
    away = np.full(count, -1, dtype=np.int64)
    queue = np.empty(count, dtype=np.int64)
    waiting = 0
    for i in range(len(roots)):
        if away[roots[i]] < 0:
            away[roots[i]] = 0
            queue[waiting] = roots[i]
            waiting += 1
    done = 0
    while done < waiting:
        block = queue[done]
        done += 1
        for k in range(first[block], first[block + 1]):
            if away[other[k]] < 0:
                away[other[k]] = away[block] + 1
                queue[waiting] = other[k]
                waiting += 1
    return away
