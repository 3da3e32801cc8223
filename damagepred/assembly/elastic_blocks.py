"""Elastic blocks: rectangles with an axial strain along their bed and a curvature.

In axes of the block, x along its bed, origin in the centre, length b, height h, its displacement is

    u = eps x - kap x y,    v = kap (x^2/2 - b^2/24) - nu eps y + nu kap (y^2/2 - h^2/24)

on top of the rigid motion, with axial strain eps and curvature kap: uniaxial stress along x. The remaining elasticity
is lumped into the bed joints: (1 - nu^2)/E across them and 1/G in shear. Along an interface, the block's side moves as
a straight line: the mean of the field, and its slope at the middle. For this, beds are cut into parts of half a block.
The two halves of a brick that may break share strain and curvature: each has the field from its own centroid.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly.geometry import SharedEdges
from damagepred.kernels.dynamics.strains import unit_displacements
from damagepred.kernels.interface.kinematics import ElasticSides


class ElasticBlocks(NamedTuple):
    """Blocks with an axial strain (1) and a curvature (1/m), d of them: the last degrees of freedom, in pairs."""

    block: IntArray  # (d,): number of the block, or of the first of its two halves
    number: IntArray  # (n + 1,): index of each block in this list, -1 if it is rigid; the ground last
    axis: FloatArray  # (d, 2): unit vector along the beds: the more level side of the rectangle
    length: FloatArray  # (d,): size along the axis and across (m), of a half where there are two
    height: FloatArray
    poisson_ratio: FloatArray  # (d,)

    @property
    def halves(self) -> IntArray:
        """Number of blocks (d,) that share each strain: 1, or 2 halves of a brick."""
        return np.bincount(self.number[self.number >= 0], minlength=len(self.block))

    def along(self, block: IntArray, direction: FloatArray) -> BoolArray:
        """Whether directions (m, 2) are nearer to the axis of elastic blocks than to their other side."""
        number = self.number[block]
        return (number >= 0) & (np.abs((self.axis[number] * direction).sum(axis=1)) > np.sqrt(0.5))

    def unit_displacements(self, number: IntArray, arm: FloatArray, edge: FloatArray | None = None) -> FloatArray:
        """Displacement x, y of points (p, 2, 2), or its mean along an edge, per unit strain (m) and curvature (m2)."""
        axis, across = self.axis[number], np.column_stack((-self.axis[number, 1], self.axis[number, 0]))
        x, y = (arm * axis).sum(axis=1), (arm * across).sum(axis=1)
        bow_x, bow_y = -(self.length[number] ** 2) / 24.0, -(self.height[number] ** 2) / 24.0
        if edge is not None:  # means of x^2/2 - b^2/24 and of y^2/2 - h^2/24
            bow_x = ((edge * axis).sum(axis=1) ** 2 - self.length[number] ** 2) / 24.0
            bow_y = ((edge * across).sum(axis=1) ** 2 - self.height[number] ** 2) / 24.0
        along_s, across_s, along_k, across_k = unit_displacements(x, y, self.poisson_ratio[number], bow_x, bow_y)
        strained = along_s[:, None] * axis + across_s[:, None] * across
        return np.stack((strained, along_k[:, None] * axis + across_k[:, None] * across), axis=2)

    def taken(self, blocks: IntArray) -> ElasticBlocks:
        """Elastic blocks among a list of blocks, with the numbers of the list."""
        number = self.number[blocks]
        listed = np.flatnonzero(number >= 0)
        shared, first, position = np.unique(number[listed], return_index=True, return_inverse=True)
        new_number = np.full(len(blocks) + 1, -1)
        new_number[listed] = position
        return ElasticBlocks(listed[first], new_number, *(values[shared] for values in self[2:]))

    def parts(self, edges: SharedEdges, on_rigid: int) -> IntArray:
        """Number of parts per common edge (m,): two per length between bending blocks, else ``on_rigid``."""
        reach = edges.end - edges.start
        size = np.hypot(*reach.T)
        count, bends = np.ones(len(size), dtype=np.int64), [self.number[side] >= 0 for side in (edges.a, edges.b)]
        for side in (edges.a, edges.b):
            bed = self.along(side, reach / size[:, None])
            share = size / (self.halves * self.length)[self.number[side]] * np.where(bends[0] & bends[1], 2, on_rigid)
            count = np.where(bed, np.maximum(count, np.ceil(share * (1 - 1e-9)).astype(np.int64)), count)
        return count


def elastic_blocks(
    polygons: list[FloatArray], elastic: list[bool], poisson_ratio: list[float], left_halves: Collection[int] = ()
) -> ElasticBlocks | None:
    """Elastic blocks: the rectangles among the chosen polygons, a right half after its left half; None without any."""
    rectangles = [(i, sides) for i, polygon in enumerate(polygons) if elastic[i] and (sides := _rectangle(polygon))]
    if not rectangles:
        return None
    found = {i for i, _ in rectangles}
    right = {i + 1 for i in left_halves if i in found and i + 1 in found}
    rectangles = [(i, sides) for i, sides in rectangles if i not in right]
    block = np.array([i for i, _ in rectangles])
    number = np.full(len(polygons) + 1, -1)
    number[block] = np.arange(len(block))
    for i in right:
        number[i] = number[i - 1]
    axis_x, axis_y, length, height = np.array([sides for _, sides in rectangles]).T
    ratio = np.array(poisson_ratio)[block]
    return ElasticBlocks(block, number, np.column_stack((axis_x, axis_y)), length, height, ratio)


def _rectangle(polygon: FloatArray) -> tuple[float, float, float, float] | None:
    """Axis (x, y), length and height of a rectangle; None if the polygon is not a rectangle."""
    if len(polygon) != 4:
        return None
    (ax, ay), (bx, by), (cx, cy) = (np.roll(polygon, -1, axis=0) - polygon)[:3].tolist()
    a, b = float(np.hypot(ax, ay)), float(np.hypot(bx, by))
    near = 1e-9 * (a + b)
    if abs(ax + cx) > near or abs(ay + cy) > near or abs(ax * bx + ay * by) > near * min(a, b):
        return None
    if abs(ax) * b < abs(bx) * a:
        ax, ay, a, b = bx, by, b, a
    sign = 1.0 if ax > 0.0 else -1.0
    return sign * ax / a, sign * ay / a, a, b


def elastic_sides(
    elastic: ElasticBlocks,
    sides: tuple[IntArray, IntArray],
    middle: FloatArray,
    normal: FloatArray,
    length: FloatArray,
    centre: FloatArray,
) -> ElasticSides:
    """Displacement of the sides of m interfaces by elastic blocks; middle, normal (m, 2), centre (n, 2)."""
    dof = np.full((len(length), 2), -1, dtype=np.int64)
    rows = np.zeros((len(length), 2, 3, 2))
    tangent = np.column_stack((normal[:, 1], -normal[:, 0]))
    for side, sign in enumerate((-1.0, 1.0)):
        number = elastic.number[sides[side]]
        bends = np.flatnonzero(number >= 0)
        number = number[bends]
        n, t = normal[bends], tangent[bends]
        arm = middle[bends] - centre[sides[side][bends]]
        moved = elastic.unit_displacements(number, arm, length[bends, None] * t)
        rows[bends, side, 0] = sign * np.einsum("ik,ikc->ic", n, moved)
        rows[bends, side, 1] = sign * np.einsum("ik,ikc->ic", t, moved)
        rows[bends, side, 2, 1] = sign * (arm * elastic.axis[number]).sum(axis=1)
        dof[bends, side] = 3 * len(elastic.number) + 2 * number
    same = (dof[:, 0] == dof[:, 1]) & (dof[:, 0] >= 0)  # between two halves: one row for both
    rows[same, 0] += rows[same, 1]
    rows[same, 1], dof[same, 1] = 0.0, -1
    return ElasticSides(dof, rows)
