"""Assembly of the block tridiagonal stiffness of levels of blocks, from interfaces.

The strain-displacement matrix B of interface i has three rows (opening, shear, relative rotation) over the w degrees of
freedom of its two sides: three of a rigid block, or x and y of the two gridpoints at the ends of a facet. Its stiffness
D is a 3 x 3 matrix, unsymmetric where the flow rule is not associated. Matrices of a level are stored transposed.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.kernels.jit import Unit, kernel, law
from damagepred.kernels.linear.table import system_at
from damagepred.kernels.table import flags, float_blocks, float_rows, floats, integer_rows, integers, part


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
def couple_blocks(blocks, places, first_entry, tangents, near_far, far_near):
    """Compute the couplings of blocks that are divided among two levels.

    Parameters
    ----------
    blocks : array of int
        The blocks.
    places : BlockPlaces
        Of all blocks.
    first_entry, tangents : array
        Stiffness of all blocks; see ``Superelements``.
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


@Unit
def set_stiffness(address):
    """Set the factorised stiffness D of changed interfaces, and B^T D B between the degrees of freedom of their sides.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations: ``changed_count`` interfaces in ``changed``, and ``target``.
    """
    system = system_at(address)
    listed, stiffness = part(integers(system.changed), 0, system.changed_count), float_rows(system.target)
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


@Unit
def assemble_level(address):
    """Compute the stiffness of interfaces within level ``k``, the displacements of all other levels held.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations; the matrix is the first row of ``scratch``, flat and transposed.
    """
    system = system_at(address)
    k, first, start = system.k, integers(system.first_interface), integers(system.start)
    size, matrix = start[k + 1] - start[k], float_rows(system.scratch)[0]
    interfaces = integers(system.level_interfaces)[first[k] : first[k + 1]]
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


@Unit
def assemble_blocks(address):
    """Add the stiffness of deformable blocks to that within level ``k``.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations; the matrix is the first row of ``scratch``, flat and transposed.
    """
    system = system_at(address)
    k, first, start = system.k, integers(system.first_block), integers(system.start)
    size, matrix = start[k + 1] - start[k], float_rows(system.scratch)[0]
    first_dof, all_dofs = integers(system.block_first_dof), integers(system.block_dofs)
    first_entry, tangents = integers(system.first_entry), floats(system.tangents)
    index, level = integers(system.index_in_level), integers(system.level_of_dof)
    for d in integers(system.level_blocks)[first[k] : first[k + 1]]:
        dofs = all_dofs[first_dof[d] : first_dof[d + 1]]
        for r in range(dofs.size):
            row, entry = index[dofs[r]], first_entry[d] + r * dofs.size
            if row < 0 or level[dofs[r]] != k:
                continue
            for c in range(dofs.size):
                if level[dofs[c]] == k and index[dofs[c]] >= 0:
                    matrix[index[dofs[c]] * size + row] += tangents[entry + c]


@Unit
def assemble_couplings(address):
    """Compute the off-diagonal blocks up to level ``farthest``: the stiffness between the sides of couplings.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations: ``near_far`` is the force on the nearer side for displacements of the
        farther, ``far_near`` the other way round. Pairs of divided blocks stay as they are.
    """
    system = system_at(address)
    last = integers(system.first_coupling)[system.farthest + 1]
    couplings, pair, far_is_b = part(integers(system.couplings), 0, last), integers(system.pair), flags(system.far_is_b)
    near_far, far_near = float_blocks(system.near_far), float_blocks(system.far_near)
    matrices = float_blocks(system.matrices)
    side = matrices.shape[1] // 2
    for e in part(pair, 0, last):
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
