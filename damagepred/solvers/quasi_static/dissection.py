"""Nested dissection of a wall (George 1973): separators, and the parts that they leave."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True)
class Dissection:
    """Order of elimination of the nodes of a wall or house: separators, and the parts that they leave."""

    place: FloatArray  # (d, n) Coordinates of the blocks of the nodes, equal to the last digit where they are in line
    weight: IntArray  # (n,) Number of degrees of freedom of each node, and its block
    block: IntArray
    sides: IntArray  # (m, 2, w / 2) Nodes of the two sides of each interface, -1 where there are fewer
    blocks: IntArray  # (2, m) Blocks of the two sides
    shares: tuple[float, ...] = (0.5,)  # of the weight of a part, before a cut

    def divide(self, nodes: IntArray, largest: Callable[[IntArray], float]) -> Iterator[tuple[IntArray, bool]]:
        """Separators of nodes (True), lighter than ``largest`` of their part, and the parts that they leave (False)."""
        within = np.zeros(int(self.block.max(initial=0)) + 1, dtype=np.bool_)
        left, separates = within.copy(), np.zeros(len(self.block) + 1, dtype=np.bool_)  # the last for -1
        parts = [(nodes, np.arange(self.blocks.shape[1]))]
        while parts:
            nodes, listed = parts.pop()
            cut, limit = None, largest(nodes)
            if limit > 0.0:
                within[self.block[nodes]] = True
                first_in, second_in = within[self.blocks[:, listed]]
                within[self.block[nodes]] = False
                listed = listed[first_in & second_in]
                cut = self._cut(nodes, listed, left, separates, limit)
            if cut is None:
                if len(nodes):
                    yield nodes, False
                continue
            separates[cut] = True
            parted, on_left = separates[nodes], left[self.block[nodes]]
            separates[cut] = False
            if parted.any():
                yield nodes[parted], True
            parts += [(nodes[~parted & ~on_left], listed), (nodes[~parted & on_left], listed)]

    def _cut(
        self, nodes: IntArray, listed: IntArray, left: BoolArray, separates: BoolArray, least: float
    ) -> IntArray | None:
        """Lightest separator of a part below ``least``, or None; ``left`` becomes the half of each block."""
        own, weight, best = self.block[nodes], self.weight[nodes], None
        ends = self.blocks[:, listed]
        for values, share in product(self.place[:, nodes], self.shares):
            cut_at = _quantile(values, weight, share)
            if cut_at == np.inf:
                continue
            left[own] = half = values < cut_at
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


def _quantile(values: FloatArray, weight: IntArray, share: float) -> float:
    """Weighted quantile, or the next larger value if that is the least; infinite if all are equal."""
    order = np.argsort(values)
    ordered, total = values[order], np.cumsum(weight[order])
    quantile = ordered[np.searchsorted(total, share * total[-1])]
    if quantile > ordered[0]:
        return float(quantile)
    return float(np.append(ordered[ordered > quantile], np.inf)[0])
