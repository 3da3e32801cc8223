"""Assembly of the block tridiagonal stiffness of levels of blocks, from interfaces.

The strain-displacement matrix B of interface i has three rows (opening, shear, relative rotation) over the w degrees of
freedom of its two sides: three of a rigid block, or x and y of the two gridpoints at the ends of a facet. Its stiffness
D is a 3 x 3 matrix, unsymmetric where the flow rule is not associated. Matrices of a level are stored transposed.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.kernels.jit import kernel


class BlockPlaces(NamedTuple):
    """Where d deformable blocks act in the levels.

    Attributes
    ----------
    first_dof, dofs : array of int (d + 1,), array of int
        Where the degrees of freedom on the boundary of each block begin, and these.
    first_pair : array of int (d + 1,)
        Where the pairs of each block divided among two levels begin.
    pair : array of int (p,)
        Place among the pairs of ``Levels``.
    far, near : array of int (p, w / 2)
        Places on the boundary of the two sides of each pair, -1 where there are fewer.
    """

    first_dof: NDArray[np.int64]
    dofs: NDArray[np.int64]
    first_pair: NDArray[np.int64]
    pair: NDArray[np.int64]
    far: NDArray[np.int64]
    near: NDArray[np.int64]


@kernel
def assemble_blocks(blocks, places, first_entry, tangents, index_in_level, level, k, size, matrix):
    """Add the stiffness of deformable blocks to the diagonal block of level k.

    Parameters
    ----------
    blocks : array of int
        Those with degrees of freedom in the level.
    places : BlockPlaces
        Of all blocks.
    first_entry, tangents
        Stiffness of all blocks; see ``Superelements``.
    index_in_level, level
        As ``assemble_level``.
    k, size : int
        The level and its size.
    matrix : array
        Of the level, flat, added to, transposed.
    """
    for d in blocks:
        dofs = places.dofs[places.first_dof[d] : places.first_dof[d + 1]]
        for r in range(dofs.size):
            row, entry = index_in_level[dofs[r]], first_entry[d] + r * dofs.size
            if row < 0 or level[dofs[r]] != k:
                continue
            for c in range(dofs.size):
                if level[dofs[c]] == k and index_in_level[dofs[c]] >= 0:
                    matrix[index_in_level[dofs[c]] * size + row] += tangents[entry + c]


@kernel
def couple_blocks(blocks, places, first_entry, tangents, near_far, far_near):
    """Compute the couplings of blocks that are divided among two levels.

    Parameters
    ----------
    blocks : array of int
        The blocks.
    places, first_entry, tangents
        As ``assemble_blocks``.
    near_far, far_near : array (pairs, w / 2, w / 2)
        Filled for the pairs of these blocks; see ``assemble_couplings``.
    """
    side = places.far.shape[1]
    for d in blocks:
        count, at = places.first_dof[d + 1] - places.first_dof[d], first_entry[d]
        for p in range(places.first_pair[d], places.first_pair[d + 1]):
            pair = places.pair[p]
            for r in range(side):
                for c in range(side):
                    far, near = places.far[p, c], places.near[p, r]
                    if far >= 0 and near >= 0:
                        near_far[pair, r, c] = tangents[at + near * count + far]
                        far_near[pair, c, r] = tangents[at + far * count + near]


@kernel
def interface_stiffness(listed, kinematics, stiffness, matrices):
    """Compute the stiffness matrix B^T D B of interfaces between the degrees of freedom of their sides.

    Parameters
    ----------
    listed : array of int
        The interfaces.
    kinematics : NamedTuple of arrays
        Strain-displacement matrices; see ``damagepred.solvers.system.interface_kinematics``.
    stiffness : array (m, 9)
        Of each interface.
    matrices : array (m, w, w)
        Filled for the listed interfaces.
    """
    for i in listed:
        rows, d = kinematics.rows[i], stiffness[i]
        for r in range(rows.shape[1]):
            for c in range(rows.shape[1]):
                matrices[i, r, c] = 0.0
            for j in range(3):
                left = rows[0, r] * d[j] + rows[1, r] * d[3 + j] + rows[2, r] * d[6 + j]
                for c in range(rows.shape[1]):
                    matrices[i, r, c] += left * rows[j, c]


@kernel
def assemble_level(listed, dofs, matrices, index_in_level, level, k, matrix):
    """Add the stiffness of interfaces to the diagonal block of level k.

    Parameters
    ----------
    listed : array of int
        The interfaces; their degrees of freedom in other levels are left out.
    dofs : array of int (m, w)
        Degrees of freedom of the sides of each interface.
    matrices : array (m, w, w)
        See ``interface_stiffness``.
    index_in_level : array of int (size,)
        Index of each degree of freedom in its level, -1 if prescribed.
    level : array of int (size,)
        Level of each degree of freedom.
    k : int
        The level.
    matrix : array
        Of the level, added to, transposed.
    """
    width = dofs.shape[1]
    for i in listed:
        for r in range(width):
            row = dofs[i, r]
            if row < 0 or level[row] != k or index_in_level[row] < 0:
                continue
            for c in range(width):
                column = dofs[i, c]
                if column >= 0 and level[column] == k and index_in_level[column] >= 0:
                    matrix[index_in_level[column], index_in_level[row]] += matrices[i, r, c]


@kernel
def assemble_couplings(couplings, pair, far_is_b, matrices, near_far, far_near):
    """Compute the off-diagonal blocks: the stiffness between the sides of couplings.

    Parameters
    ----------
    couplings : array of int (b,)
        Interfaces between neighbouring levels.
    pair : array of int (b,)
        Pair of sides that each couples.
    far_is_b : array of bool (b,)
        Whether block b is the one farther from the ground, or a.
    matrices : array (m, w, w)
        See ``interface_stiffness``.
    near_far, far_near : array (pairs, w / 2, w / 2)
        Filled but for pairs of blocks: force on the nearer side for displacements of the farther, and the other way
        round.
    """
    side = matrices.shape[1] // 2
    for e in pair:
        for r in range(side):
            for c in range(side):
                near_far[e, r, c] = 0.0
                far_near[e, r, c] = 0.0
    for e in range(couplings.size):
        whole = matrices[couplings[e]]
        far_start, near_start = (side, 0) if far_is_b[e] else (0, side)
        for r in range(side):
            for c in range(side):
                near_far[pair[e], r, c] += whole[near_start + r, far_start + c]
                far_near[pair[e], r, c] += whole[far_start + r, near_start + c]


@kernel
def farthest_unsymmetric(listed, level, stiffness):
    """Return the farthest level of an interface whose stiffness is not symmetric; -1 if all are.

    Parameters
    ----------
    listed : array of int
        The interfaces.
    level : array of int (m,)
        Level of each interface.
    stiffness : array (m, 9)
        Of each interface.
    """
    farthest = -1
    for i in listed:
        row = stiffness[i]
        if row[1] != row[3] or row[2] != row[6] or row[5] != row[7]:
            farthest = max(farthest, level[i])
    return farthest


@kernel
def copy_rows(listed, source, target):
    """Copy rows of an array to another.

    Parameters
    ----------
    listed : array of int
        The rows.
    source, target : array (m, 9)
        From and to.
    """
    for i in listed:
        for j in range(9):
            target[i, j] = source[i, j]
