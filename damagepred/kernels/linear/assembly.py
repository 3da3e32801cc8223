"""Assembly of the block tridiagonal stiffness of levels of blocks, from interfaces.

The strain-displacement matrix B of interface i has three rows (opening, shear, relative rotation) over the w degrees of
freedom of its two sides: three of a rigid block, or x and y of the two gridpoints at the ends of a facet. Its stiffness
D is a 3 x 3 matrix, unsymmetric where the flow rule is not associated. Matrices of a level are stored transposed.
"""

from damagepred.kernels.jit import law
from damagepred.kernels.table import float_blocks, float_rows, integer_rows, integers


@law
def set_stiffness(system, listed, stiffness):
    """Set the factorised stiffness D of interfaces, and B^T D B between the degrees of freedom of their sides.

    Parameters
    ----------
    system : SYSTEM
        The tangent equations.
    listed : array of int
        Those whose stiffness is set.
    stiffness : array (m, 9)
        Of all interfaces.
    """
    matrices, factorised = float_blocks(system.matrices), float_rows(system.stiffness)
    displacements = float_blocks(system.strain_displacement)
    for i in listed:
        rows, d = displacements[i], factorised[i]
        for j in range(9):
            d[j] = stiffness[i, j]
        for r in range(rows.shape[1]):
            for c in range(rows.shape[1]):
                matrices[i, r, c] = 0.0
            for j in range(3):
                left = rows[0, r] * d[j] + rows[1, r] * d[3 + j] + rows[2, r] * d[6 + j]
                for c in range(rows.shape[1]):
                    matrices[i, r, c] += left * rows[j, c]


@law
def assemble_level(system, interfaces, k, size, matrix):
    """Compute the stiffness of interfaces within level k, the displacements of all other levels held.

    Parameters
    ----------
    system : SYSTEM
        The tangent equations.
    interfaces : array of int
        Those that are assembled; their degrees of freedom in other levels are left out.
    k, size : int
        The level and its size.
    matrix : array
        Flat; filled, transposed.
    """
    dofs, index = integer_rows(system.dof), integers(system.index_in_level)
    level, matrices = integers(system.level_of_dof), float_blocks(system.matrices)
    for j in range(size * size):
        matrix[j] = 0.0
    for i in interfaces:
        for r in range(dofs.shape[1]):
            row = dofs[i, r]
            if row < 0 or level[row] != k or index[row] < 0:
                continue
            for c in range(dofs.shape[1]):
                column = dofs[i, c]
                if column >= 0 and level[column] == k and index[column] >= 0:
                    matrix[index[column] * size + index[row]] += matrices[i, r, c]


@law
def add_to_diagonal(values, start, size, matrix):
    """Add the values of a level, which begin at ``start``, to the diagonal of its matrix.

    Parameters
    ----------
    values : array (degrees of freedom,)
        In the order of the levels.
    start, size : int
        First degree of freedom of the level, and its size.
    matrix : array
        Flat; added to.
    """
    for j in range(size):
        matrix[j * size + j] += values[start + j]


@law
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
        Filled: force on the nearer side for displacements of the farther, and the other way round.
    """
    side = matrices.shape[1] // 2
    for e in range(near_far.shape[0]):
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


@law
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
