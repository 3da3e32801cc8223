"""Elastic blocks: rectangles that stretch along their bed and bend, besides their rigid motion.

In axes of the block, x along its bed, origin in the centre, length b, height h, thickness t, its displacement is

    u = eps x - kap x y,    v = kap (x^2/2 - b^2/24) - nu eps y + nu kap (y^2/2 - h^2/24)

besides the rigid motion, with axial strain eps and curvature kap: uniaxial stress along x, with contraction by
Poisson's ratio nu. Its strain energy is (E b h t eps^2 + E b t h^3/12 kap^2)/2. Self weight does no work on the two.

The rest of its elasticity is lumped into the bed joints, upright with (1 - nu^2)/E, as the contraction comes on top,
and in shear with 1/G. Head joints are those of the mortar alone: their normal stress is that of the strain, and the
shear of a block counts once, as its shear stress is the same along both joints. Lumping all elasticity into the joints
makes running bond 50 % too stiff along the wall, where bed joints carry what a stretching brick would not, and up to
12 % (stack bond 37 %) too soft in shear.

Along an interface, the block's side moves as a straight piece: the mean of the field, and its slope at the middle,
which is its best fit. Between two elastic blocks of equal strain and curvature, as in a wall under homogeneous strain,
that is exact. Beds are cut into parts of half a block for it, and finer on bodies that do not bend.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly.geometry import SharedEdges
from damagepred.kernels.dynamics.strains import unit_displacements


class ElasticBlocks(NamedTuple):
    """Blocks with an axial strain and a curvature, d of them.

    Their degrees of freedom stand after those of all blocks and the ground: strain (1) and curvature (1/m) of each.

    Attributes
    ----------
    block : array of int (d,)
        Number of each.
    number : array of int (n + 1,)
        Place of each block in this list, -1 if it is rigid; the ground last.
    axis : array (d, 2)
        Unit vector along the beds: of the sides of the rectangle the one nearer to the level.
    length, height : array (d,)
        Along the axis and across (m).
    poisson_ratio : array (d,)
        Contraction across the axis over the strain along it (1).
    """

    block: IntArray
    number: IntArray
    axis: FloatArray
    length: FloatArray
    height: FloatArray
    poisson_ratio: FloatArray

    def along(self, block: IntArray, direction: FloatArray) -> BoolArray:
        """Return whether a direction is nearer to the axis of an elastic block than to its other side.

        Parameters
        ----------
        block : array of int (m,)
            Blocks, or the ground; False for those that are not elastic.
        direction : array (m, 2)
            Unit vectors.
        """
        number = self.number[block]
        return (number >= 0) & (np.abs((self.axis[number] * direction).sum(axis=1)) > np.sqrt(0.5))

    def unit_displacements(self, number: IntArray, arm: FloatArray, edge: FloatArray | None = None) -> FloatArray:
        """Return displacement x, y of places (p, 2, 2) of blocks for a unit strain (m) and a unit curvature (m2).

        Parameters
        ----------
        number : array of int (p,)
            Place of the block in this list.
        arm : array (p, 2)
            From its centroid (m).
        edge : array (p, 2), optional
            Straight edge whose middle the place is (m): the mean along it.
        """
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
        """Return the elastic ones among a list of blocks, which are numbered anew in its order."""
        number = self.number[blocks]
        here = np.flatnonzero(number >= 0)
        anew = np.full(len(blocks) + 1, -1)
        anew[here] = np.arange(len(here))
        return ElasticBlocks(here, anew, *(values[number[here]] for values in self[2:]))

    def parts(self, edges: SharedEdges, on_rigid: int) -> IntArray:
        """Return into how many parts each common edge (m,) is cut, so that its sides are straight enough.

        Parameters
        ----------
        edges : SharedEdges
            Common edges.
        on_rigid : int
            Parts along the length of a block that lies on a body that does not bend; two on one that does.
        """
        reach = edges.end - edges.start
        size = np.hypot(*reach.T)
        found, bends = np.ones(len(size), dtype=np.int64), [self.number[side] >= 0 for side in (edges.a, edges.b)]
        for side in (edges.a, edges.b):
            bed = self.along(side, reach / size[:, None])
            share = size / self.length[self.number[side]] * np.where(bends[0] & bends[1], 2, on_rigid)
            found = np.where(bed, np.maximum(found, np.ceil(share * (1 - 1e-9)).astype(np.int64)), found)
        return found


class ElasticSides(NamedTuple):
    """How elastic blocks move the sides of m interfaces, with strain and curvature.

    Attributes
    ----------
    dof : array of int (m, 2)
        Degree of freedom of the strain of block a and block b, that of the curvature follows; -1 if it is rigid.
    rows : array (m, 2, 3, 2)
        Opening and shear at the middle (m), and relative rotation, of the interface, for a unit strain and a unit
        curvature (1/m) of either block.
    """

    dof: IntArray
    rows: FloatArray


def elastic_blocks(polygons: list[FloatArray], elastic: list[bool], poisson_ratio: list[float]) -> ElasticBlocks | None:
    """Return the elastic ones of the blocks: rectangles among those that shall be; None if there are none.

    Parameters
    ----------
    polygons : list of array (v, 2)
        All n blocks, corners counter-clockwise (m).
    elastic : list of bool
        Which of them shall be elastic. Others than rectangles stay rigid.
    poisson_ratio : list of float
        Of each block.
    """
    found = [(i, sides) for i, polygon in enumerate(polygons) if elastic[i] and (sides := _rectangle(polygon))]
    if not found:
        return None
    block = np.array([i for i, _ in found])
    number = np.full(len(polygons) + 1, -1)
    number[block] = np.arange(len(block))
    axis_x, axis_y, length, height = np.array([sides for _, sides in found]).T
    ratio = np.array(poisson_ratio)[block]
    return ElasticBlocks(block, number, np.column_stack((axis_x, axis_y)), length, height, ratio)


def _rectangle(polygon: FloatArray) -> tuple[float, float, float, float] | None:
    """Return axis (x, y), length and height of a rectangle; None of another polygon."""
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
    """Return how elastic blocks move the sides of interfaces.

    Parameters
    ----------
    elastic : ElasticBlocks
        Of n blocks.
    sides : tuple of array of int (m,)
        Blocks a and b of each interface.
    middle, normal : array (m, 2)
        Of each interface (m, 1).
    length : array (m,)
        Of each interface (m).
    centre : array (n, 2)
        Centroids of the blocks (m).
    """
    dof = np.full((len(length), 2), -1, dtype=np.int64)
    rows = np.zeros((len(length), 2, 3, 2))
    tangent = np.column_stack((normal[:, 1], -normal[:, 0]))
    for side, sign in enumerate((-1.0, 1.0)):
        number = elastic.number[sides[side]]
        here = np.flatnonzero(number >= 0)
        number = number[here]
        n, t = normal[here], tangent[here]
        arm = middle[here] - centre[elastic.block[number]]
        moved = elastic.unit_displacements(number, arm, length[here, None] * t)
        rows[here, side, 0] = sign * np.einsum("ik,ikc->ic", n, moved)
        rows[here, side, 1] = sign * np.einsum("ik,ikc->ic", t, moved)
        rows[here, side, 2, 1] = sign * (arm * elastic.axis[number]).sum(axis=1)
        dof[here, side] = 3 * len(elastic.number) + 2 * number
    return ElasticSides(dof, rows)
