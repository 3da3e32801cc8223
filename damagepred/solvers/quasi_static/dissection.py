"""Nested dissection of a wall (George 1973): separators, and the parts that they leave."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True)
class Dissection:
    """Order of the nodes of a wall.

    Attributes
    ----------
    place : array (2, n)
        Coordinates of the blocks of the nodes, equal to the last digit where they are in line.
    weight, block : array of int (n,)
        Number of degrees of freedom of each node, and its block.
    sides : array of int (m, 2, w / 2)
        Nodes of the two sides of each interface, -1 where there are fewer.
    blocks : array of int (2, m)
        Blocks of the two sides.
    smallest : int
        Degrees of freedom up to which a part is one front.
    """

    place: FloatArray
    weight: IntArray
    block: IntArray
    sides: IntArray
    blocks: IntArray
    smallest: int

    def order(self, front: IntArray, first: int, nodes: IntArray) -> None:
        """Set the front of each listed node: separators before the parts that they leave.

        Parameters
        ----------
        front : array of int (n,)
            Front of each node; filled.
        first : int
            Number of the first front.
        nodes : array of int
            Nodes without a front.
        """
        within = np.zeros(int(self.block.max(initial=0)) + 1, dtype=np.bool_)
        left, separates = within.copy(), np.zeros(len(self.block) + 1, dtype=np.bool_)  # the last for -1
        parts = [(nodes, self._interfaces(np.arange(self.blocks.shape[1]), within, nodes))]
        while parts:
            nodes, listed = parts.pop()
            cut = self._cut(nodes, listed, left, separates) if self.weight[nodes].sum() > self.smallest else None
            if cut is None:
                front[nodes] = first
                first += len(nodes) > 0
                continue
            on_left, separates[cut] = left[self.block[nodes]], True
            parted = separates[nodes]
            separates[cut] = False
            front[nodes[parted]] = first
            first += bool(parted.any())
            halves = nodes[~parted & ~on_left], nodes[~parted & on_left]
            parts += [(half, self._interfaces(listed, within, half)) for half in halves]

    def _interfaces(self, listed: IntArray, within: BoolArray, nodes: IntArray) -> IntArray:
        """Return those of the listed interfaces that lie between blocks of some nodes."""
        own = self.block[nodes]
        within[own] = True
        found = listed[within[self.blocks[:, listed]].all(axis=0)]
        within[own] = False
        return found

    def _cut(self, nodes: IntArray, listed: IntArray, left: BoolArray, separates: BoolArray) -> IntArray | None:
        """Return the lightest separator of a part, nodes on one side of a cut along one axis; None if there is none.

        ``left`` becomes the half of each block.
        """
        own, weight, best, least = self.block[nodes], self.weight[nodes], None, np.inf
        for values in self.place[:, nodes]:
            median = _median(values, weight)
            if median == np.inf:
                continue
            half = values < median
            left[own] = half
            on_left = left[self.blocks[:, listed]]
            cut = on_left[0] != on_left[1]
            for side in (True, False):
                separator = self.sides[listed[cut], np.where(on_left[0, cut] == side, 0, 1)].ravel()
                separates[separator] = True
                total = weight[separates[nodes]].sum()
                separates[separator] = False
                if total < least:
                    least, best, best_half = total, separator, half
        if best is not None:
            left[own] = best_half
        return best


def _median(values: FloatArray, weight: IntArray) -> float:
    """Return the value up to which half the weight lies; a larger one than the least, infinite if there is none."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weight[order])
    ordered = values[order]
    above = ordered[max(np.searchsorted(total, 0.5 * total[-1]), np.searchsorted(ordered, ordered[0], "right")) :]
    return above[0] if len(above) else np.inf
