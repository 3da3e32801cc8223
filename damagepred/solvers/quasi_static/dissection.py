"""Nested dissection of a wall (George 1973): separators, and the parts that they leave."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True)
class Dissection:
    """Order of elimination of the nodes of a wall: separators, and the parts that they leave."""

    place: FloatArray  # (2, n) Coordinates of the blocks of the nodes, equal to the last digit where they are in line
    weight: IntArray  # (n,) Number of degrees of freedom of each node, and its block
    block: IntArray
    sides: IntArray  # (m, 2, w / 2) Nodes of the two sides of each interface, -1 where there are fewer
    blocks: IntArray  # (2, m) Blocks of the two sides
    smallest: int  # degrees of freedom up to which a part is one front

    def order(self, front: IntArray, first: int, nodes: IntArray) -> None:
        """Set ``front`` of the listed nodes, numbered from ``first``: separators before the parts that they leave."""
        within = np.zeros(int(self.block.max(initial=0)) + 1, dtype=np.bool_)
        left, separates = within.copy(), np.zeros(len(self.block) + 1, dtype=np.bool_)  # the last for -1
        parts = [(nodes, np.arange(self.blocks.shape[1]))]
        while parts:
            nodes, listed = parts.pop()
            cut = None
            if self.weight[nodes].sum() > self.smallest:
                within[self.block[nodes]] = True
                first_in, second_in = within[self.blocks[:, listed]]
                within[self.block[nodes]] = False
                listed = listed[first_in & second_in]
                cut = self._cut(nodes, listed, left, separates)
            if cut is None:
                front[nodes] = first
                first += len(nodes) > 0
                continue
            separates[cut] = True
            parted, on_left = separates[nodes], left[self.block[nodes]]
            separates[cut] = False
            front[nodes[parted]] = first
            first += bool(parted.any())
            parts += [(nodes[~parted & ~on_left], listed), (nodes[~parted & on_left], listed)]

    def _cut(self, nodes: IntArray, listed: IntArray, left: BoolArray, separates: BoolArray) -> IntArray | None:
        """Lightest separator of a part, or None without any: nodes on one side of a cut at a median of x or y.

        ``listed`` are the interfaces inside the part. ``left`` becomes the half of each block; ``separates`` is room.
        """
        own, weight, best, least = self.block[nodes], self.weight[nodes], None, np.inf
        ends = self.blocks[:, listed]
        for values in self.place[:, nodes]:
            median = _median(values, weight)
            if median == np.inf:
                continue
            left[own] = half = values < median
            first_left, second_left = left[ends]
            cut = np.flatnonzero(first_left != second_left)
            first, second = self.sides[listed[cut]].swapaxes(0, 1)
            begins_left = first_left[cut, None]
            for separator in (np.where(begins_left, first, second), np.where(begins_left, second, first)):
                separates[separator] = True
                total = int(separates[nodes] @ weight)
                separates[separator] = False
                if total < least:
                    least, best, best_half = total, separator, half
        if best is not None:
            left[own] = best_half
        return best


def _median(values: FloatArray, weight: IntArray) -> float:
    """Weighted median, or the next larger value if that is the least; infinite if all are equal."""
    order = np.argsort(values)
    ordered, total = values[order], np.cumsum(weight[order])
    median = ordered[np.searchsorted(total, 0.5 * total[-1])]
    if median > ordered[0]:
        return float(median)
    return float(np.append(ordered[ordered > median], np.inf)[0])
