"""Assembly of the block tridiagonal stiffness of levels of blocks, from interfaces.

The strain-displacement matrix B of interface i has three rows (opening, shear, relative rotation) over the w degrees of
freedom of its two sides: three of a rigid block, or x and y of the two gridpoints at the ends of a facet. Its stiffness
D is a 3 x 3 matrix, unsymmetric where the flow rule is not associated. Matrices of a level are stored transposed.
"""

import numpy as np

from damagepred.kernels.jit import kernel, kernel_making_arrays, law


@law
def _interface_stiffness(rows, stiffness, matrix):
    """Compute the stiffness matrix B^T D B of an interface between the degrees of freedom of its sides."""
    for r in range(rows.shape[1]):
        for j in range(3):
            left = rows[0, r] * stiffness[j] + rows[1, r] * stiffness[3 + j] + rows[2, r] * stiffness[6 + j]
            if j == 0:
                for c in range(rows.shape[1]):
                    matrix[r, c] = left * rows[0, c]
            else:
                for c in range(rows.shape[1]):
                    matrix[r, c] += left * rows[j, c]


@kernel_making_arrays
def assemble_level(listed, kinematics, stiffness, index_in_level, level, k, matrix):
    """Add the stiffness of interfaces to the diagonal block of level k.

    Parameters
    ----------
    listed : array of int
        The interfaces; their degrees of freedom in other levels are left out.
    kinematics : NamedTuple of arrays
        Strain-displacement matrices; see ``damagepred.solvers.system.interface_kinematics``.
    stiffness : array (m, 9)
        Of each interface.
    index_in_level : array of int (size,)
        Index of each degree of freedom in its level, -1 if prescribed.
    level : array of int (size,)
        Level of each degree of freedom.
    k : int
        The level.
    matrix : array
        Of the level, added to, transposed.
    """
    width = kinematics.dof.shape[1]
    whole = np.empty((width, width))
    for i in listed:
        _interface_stiffness(kinematics.rows[i], stiffness[i], whole)
        for r in range(width):
            row = kinematics.dof[i, r]
            if row < 0 or level[row] != k or index_in_level[row] < 0:
                continue
            for c in range(width):
                column = kinematics.dof[i, c]
                if column >= 0 and level[column] == k and index_in_level[column] >= 0:
                    matrix[index_in_level[column], index_in_level[row]] += whole[r, c]


@kernel_making_arrays
def assemble_couplings(couplings, pair, far_is_b, kinematics, stiffness, near_far, far_near):
    """Compute the off-diagonal blocks: the stiffness between the sides of couplings.

    Parameters
    ----------
    couplings : array of int (b,)
        Interfaces between neighbouring levels.
    pair : array of int (b,)
        Pair of sides that each couples.
    far_is_b : array of bool (b,)
        Whether block b is the one farther from the ground, or a.
    kinematics, stiffness
        As ``assemble_level``.
    near_far, far_near : array (pairs, w / 2, w / 2)
        Filled: force on the nearer side for displacements of the farther, and the other way round.
    """
    width = kinematics.dof.shape[1]
    side, whole = width // 2, np.empty((width, width))
    near_far[:] = 0.0
    far_near[:] = 0.0
    for e in range(couplings.size):
        i = couplings[e]
        _interface_stiffness(kinematics.rows[i], stiffness[i], whole)
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
