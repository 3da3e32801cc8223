"""Factors of a wall's stiffness: assembly of fronts and their elimination (multifrontal method, Duff and Reid 1983).

A front is the dense stiffness of the degrees of freedom that are eliminated in it and of its boundary, the ones of its
ancestors that they are coupled with. Its Schur complement on the boundary is assembled in its parent. A change in one
front leaves the factors of all others but its ancestors as they are.

The strain-displacement matrix B of interface i has three rows (opening, shear, relative rotation) over the w degrees of
freedom of its two sides: three of a rigid block, or x and y of the two gridpoints at the ends of a facet. Its stiffness
D is a 3 x 3 matrix, unsymmetric where the flow rule is not associated.
"""

from numba import types

from damagepred.kernels.jit import law, phase, rule
from damagepred.kernels.linear.dense import INVERT, SINGULAR_PIVOT_RATIO, Dense, multiply
from damagepred.kernels.structures import (
    FLAGS,
    FLOAT_BLOCKS,
    FLOAT_ROWS,
    FLOATS,
    INTEGER_ROWS,
    INTEGERS,
    Structure,
)


class Tree(Structure):
    """Elimination tree (Liu 1990) of F fronts, parents before children; it does not change."""

    start = INTEGERS
    """First degree of freedom of each front (F + 1,), in the order of the fronts."""
    parent = INTEGERS
    children = INTEGERS
    first_child = INTEGERS
    first_boundary = INTEGERS
    """Where the boundary of each front begins (F + 1,)."""
    boundary_in_parent = INTEGERS
    """Index of each degree of freedom of the boundaries in the parent's matrix."""
    inverse_start = INTEGERS
    coupling_start = INTEGERS
    complement_start = INTEGERS
    """First entry of each front's matrices in ``Factors``."""
    dof = INTEGER_ROWS
    """Degrees of freedom of the sides of the interfaces (m, w), -1 for none."""
    strain_displacement = FLOAT_BLOCKS
    """B of each interface (m, 3, w)."""
    front_interfaces = INTEGERS
    first_interface = INTEGERS
    """Interfaces front by front, and first interface of each."""
    interface_front = INTEGERS
    """Front of each interface, -1 for none."""
    interface_index = INTEGER_ROWS
    """Indices of ``dof`` in the front's matrix (m, w), -1 for none."""
    strain_stiffness = FLOATS
    regularisation = FLOATS
    """Added to the diagonal: stiffness of strains of elastic blocks, and springs that hold detached blocks (N/m)."""


class BlockTangents(Structure):
    """Tangents of the deformable blocks on their boundaries."""

    front_blocks = INTEGERS
    first_block = INTEGERS
    """Blocks front by front, and first block of each (F + 1,)."""
    first_dof = INTEGERS
    index = INTEGERS
    """Indices of the boundary of each block in its front's matrix, and first index of each."""
    first_entry = INTEGERS
    tangents = FLOATS
    """Tangent of each block row by row (N/m), and where it begins."""
    front = INTEGERS
    """Front of each block."""


class Factors(Structure):
    """Factors of all fronts.

    Of the front [[A, B], [C, D]], own degrees of freedom before the boundary, these are the inverse A^-1, the coupling
    C, the upper factor A^-1 B and the Schur complement D - C A^-1 B, each column by column.
    """

    tree = Tree.kind
    blocks = BlockTangents.kind
    dense = Dense.kind
    inverses = FLOATS
    coupling = FLOATS
    upper = FLOATS
    complements = FLOATS
    stiffness = FLOAT_ROWS
    """Factorised stiffness D of each interface (m, 9)."""
    matrices = FLOAT_BLOCKS
    """B^T D B of each interface."""
    yields = FLAGS
    """Fronts with a deformable block that yields (``update_block_tangents``)."""
    unsymmetric = FLAGS
    """Fronts whose matrix may be unsymmetric."""
    outdated = FLAGS
    """Fronts that the next elimination computes; set by the caller of ``eliminate``."""
    front = FLOATS
    """Matrix of the front at work."""
    invert = types.FunctionType(INVERT)


@rule
def _set_stiffness(factors, changed, target):
    """Set the factorised stiffness D of changed interfaces, and B^T D B."""
    matrices, factorised, displacements = factors.matrices, factors.stiffness, factors.tree.strain_displacement
    for i in changed:
        rows, d = displacements[i], factorised[i]
        for j in range(9):
            d[j] = target[i, j]
        for r in range(rows.shape[1]):
            for c in range(rows.shape[1]):
                matrices[i, r, c] = 0.0
            for j in range(3):
                left = rows[0, r] * d[j] + rows[1, r] * d[3 + j] + rows[2, r] * d[6 + j]
                for c in range(rows.shape[1]):
                    matrices[i, r, c] += left * rows[j, c]


@rule
def _assemble_front(factors, k, n):
    """Stiffness of the interfaces and deformable blocks of front k, a matrix of n rows, column by column."""
    tree, matrix, matrices = factors.tree, factors.front, factors.matrices
    first, indices = tree.first_interface, tree.interface_index
    matrix[: n * n] = 0.0
    for i in tree.front_interfaces[first[k] : first[k + 1]]:
        index = indices[i]
        for c in range(index.size):
            if index[c] < 0:
                continue
            for r in range(index.size):
                if index[r] >= 0:
                    matrix[index[c] * n + index[r]] += matrices[i, r, c]
    blocks = factors.blocks
    first, first_dof, first_entry, tangents = blocks.first_block, blocks.first_dof, blocks.first_entry, blocks.tangents
    for d in blocks.front_blocks[first[k] : first[k + 1]]:
        index = blocks.index[first_dof[d] : first_dof[d + 1]]
        for r in range(index.size):
            if index[r] < 0:
                continue
            entry = first_entry[d] + r * index.size
            for c in range(index.size):
                if index[c] >= 0:
                    matrix[index[c] * n + index[r]] += tangents[entry + c]


@law
def _add_to_diagonal(values, start, size, rows, matrix):
    """Add the ``size`` values of a front, from ``start`` on, to the diagonal of its matrix of ``rows`` rows."""
    for j in range(size):
        matrix[j * rows + j] += values[start + j]


@law
def _assemble_children(factors, complements, k, rows, matrix):
    """Add the Schur complements of the children of front k to its matrix (extend-add)."""
    tree = factors.tree
    first, index, children, start = (
        tree.first_boundary,
        tree.boundary_in_parent,
        tree.first_child,
        tree.complement_start,
    )
    for c in tree.children[children[k] : children[k + 1]]:
        places = index[first[c] : first[c + 1]]
        complement = complements[start[c] :]
        for j in range(places.size):
            column, own = matrix[places[j] * rows :], complement[j * places.size : (j + 1) * places.size]
            for i in range(places.size):
                column[places[i]] += own[i]


@law
def _is_symmetric(stiffness):
    """Whether the stiffness (9,) of an interface is symmetric."""
    return stiffness[1] == stiffness[3] and stiffness[2] == stiffness[6] and stiffness[5] == stiffness[7]


@law
def _find_unsymmetric(factors, k):
    """Set ``unsymmetric`` of front k: by an interface or block of it, or by a child; return it."""
    tree, unsymmetric, stiffness = factors.tree, factors.unsymmetric, factors.stiffness
    first, children = tree.first_interface, tree.first_child
    found = factors.yields[k]
    for i in tree.front_interfaces[first[k] : first[k + 1]]:
        found |= not _is_symmetric(stiffness[i])
    for c in tree.children[children[k] : children[k + 1]]:
        found |= unsymmetric[c]
    unsymmetric[k] = found
    return found


ELIMINATE = types.boolean(Factors.kind, INTEGERS, FLOAT_ROWS, FLOATS, types.boolean)


@phase(ELIMINATE)
def eliminate(factors, changed, target, complements, elastic):
    """Eliminate the ``outdated`` fronts, children first (multifrontal method, Duff and Reid 1983).

    The stiffness of ``changed`` interfaces becomes ``target``; ``complements`` takes the Schur complements. ``elastic``
    fronts, which are condensed, are not regularised: that would hold them in space. False: an elastic front is
    singular, as nothing outside holds it.
    """
    _set_stiffness(factors, changed, target)
    tree, dense, outdated, matrix = factors.tree, factors.dense, factors.outdated, factors.front
    start, boundary = tree.start, tree.first_boundary
    for k in range(outdated.size - 1, -1, -1):
        if not outdated[k]:
            continue
        size, beyond = start[k + 1] - start[k], boundary[k + 1] - boundary[k]
        rows = size + beyond
        _assemble_front(factors, k, rows)
        _add_to_diagonal(tree.strain_stiffness, start[k], size, rows, matrix)
        if not elastic:
            _add_to_diagonal(tree.regularisation, start[k], size, rows, matrix)
        _assemble_children(factors, complements, k, rows, matrix)
        symmetric, inverse = not _find_unsymmetric(factors, k), factors.inverses[tree.inverse_start[k] :]
        pivot_ratio = factors.invert(dense, size, rows, matrix, symmetric, inverse)
        if elastic and pivot_ratio < SINGULAR_PIVOT_RATIO:
            return False
        coupling, upper = factors.coupling[tree.coupling_start[k] :], factors.upper[tree.coupling_start[k] :]
        # upper = inverse @ B, complement = D - B.T @ upper, of the front [[A, B], [B.T, D]]
        multiply(dense, False, size, beyond, size, 1.0, inverse, size, matrix[size * rows :], rows, 0.0, upper)
        for j in range(size):
            for i in range(beyond):
                coupling[j * beyond + i] = matrix[j * rows + size + i]
        complement = complements[tree.complement_start[k] :]
        for j in range(beyond):
            for i in range(beyond):
                complement[j * beyond + i] = matrix[(size + j) * rows + size + i]
        multiply(dense, False, beyond, beyond, size, -1.0, matrix[size:], rows, upper, size, 1.0, complement)
    return True
