"""Assembly of the stiffness of fronts, from interfaces and deformable blocks.

The strain-displacement matrix B of interface i has three rows (opening, shear, relative rotation) over the w degrees of
freedom of its two sides: three of a rigid block, or x and y of the two gridpoints at the ends of a facet. Its stiffness
D is a 3 x 3 matrix, unsymmetric where the flow rule is not associated.
"""

from damagepred.kernels.jit import Unit, law
from damagepred.kernels.linear.table import system_at
from damagepred.kernels.table import float_blocks, float_rows, floats, integer_rows, integers, part


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
def assemble_front(address):
    """Compute the stiffness of the interfaces assembled in front ``k``, its own degrees of freedom before the boundary.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations; the matrix of ``matrix_rows`` rows fills ``scratch``, column by column.
    """
    system = system_at(address)
    first, n, matrix = integers(system.first_interface), system.matrix_rows, floats(system.scratch)
    indices, matrices = integer_rows(system.interface_index), float_blocks(system.matrices)
    for j in range(n * n):
        matrix[j] = 0.0
    for i in integers(system.front_interfaces)[first[system.k] : first[system.k + 1]]:
        index = indices[i]
        for c in range(index.size):
            if index[c] < 0:
                continue
            for r in range(index.size):
                if index[r] >= 0:
                    matrix[index[c] * n + index[r]] += matrices[i, r, c]


@law
def add_to_diagonal(values, start, size, rows, matrix):
    """Add the values of a front, which begin at ``start``, to the diagonal of its matrix.

    Parameters
    ----------
    values : array (degrees of freedom,)
        In the order of the fronts.
    start, size, rows : int
        First degree of freedom of the front, its size, and that of its matrix.
    matrix : array
        Flat; added to.
    """
    for j in range(size):
        matrix[j * rows + j] += values[start + j]


@Unit
def assemble_blocks(address):
    """Add the stiffness of deformable blocks to that of front ``k``.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations; see ``assemble_front``.
    """
    system = system_at(address)
    first, n, matrix = integers(system.first_block), system.matrix_rows, floats(system.scratch)
    first_dof, indices = integers(system.block_first_dof), integers(system.block_index)
    first_entry, tangents = integers(system.first_entry), floats(system.tangents)
    for d in integers(system.front_blocks)[first[system.k] : first[system.k + 1]]:
        index = indices[first_dof[d] : first_dof[d + 1]]
        for r in range(index.size):
            if index[r] < 0:
                continue
            entry = first_entry[d] + r * index.size
            for c in range(index.size):
                if index[c] >= 0:
                    matrix[index[c] * n + index[r]] += tangents[entry + c]


@law
def is_symmetric(stiffness):
    """Whether the stiffness of an interface is symmetric.

    Parameters
    ----------
    stiffness : array (9,)
        Row by row.
    """
    return stiffness[1] == stiffness[3] and stiffness[2] == stiffness[6] and stiffness[5] == stiffness[7]
