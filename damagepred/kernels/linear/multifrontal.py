"""Multifrontal solution of the tangent equations (Duff and Reid 1983): elimination, forward and back substitution.

A front is the dense stiffness of the degrees of freedom that are eliminated in it and of its boundary, those of its
ancestors that they are coupled with. Its Schur complement on the boundary is assembled in its parent. A change in one
front leaves the factors of all others but its ancestors as they are.
"""

from damagepred.kernels.jit import Unit, law
from damagepred.kernels.linear.assembly import add_to_diagonal, is_symmetric
from damagepred.kernels.linear.lapack import multiply
from damagepred.kernels.linear.table import system_at
from damagepred.kernels.table import flags, float_rows, floats, integers, run


@law
def _assemble_children(system, k, rows, matrix):
    """Add the Schur complements of the children of front k to its matrix (extend-add)."""
    first, index = integers(system.first_boundary), integers(system.boundary_in_parent)
    children, at = integers(system.first_child), integers(system.complement_start)
    for c in integers(system.children)[children[k] : children[k + 1]]:
        places = index[first[c] : first[c + 1]]
        complement = floats(system.complements)[at[c] :]
        for j in range(places.size):
            column, own = matrix[places[j] * rows :], complement[j * places.size : (j + 1) * places.size]
            for i in range(places.size):
                column[places[i]] += own[i]


@law
def _find_unsymmetric(system, k):
    """Find whether the matrix of front k may be unsymmetric: by an interface or block of it, or by a child."""
    unsymmetric, stiffness = flags(system.unsymmetric), float_rows(system.stiffness)
    first, children = integers(system.first_interface), integers(system.first_child)
    found = flags(system.yields)[k]
    for i in integers(system.front_interfaces)[first[k] : first[k + 1]]:
        found |= not is_symmetric(stiffness[i])
    for c in integers(system.children)[children[k] : children[k + 1]]:
        found |= unsymmetric[c]
    unsymmetric[k] = found
    return found


@Unit
def eliminate(address):
    """Set the stiffness of changed interfaces, and eliminate the fronts that are ``outdated``.

    If they are ``elastic``, they are to be condensed, and not regularised: that would hold them in space; ``held``
    tells whether their ancestors hold them.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations.
    """
    system = system_at(address)
    run(system.set_stiffness, address)
    start, boundary, inverse_start = (
        integers(system.start),
        integers(system.first_boundary),
        integers(system.inverse_start),
    )
    at, complement_start, outdated = (
        integers(system.coupling_start),
        integers(system.complement_start),
        flags(system.outdated),
    )
    matrix = floats(system.scratch)
    system.held = 1
    for k in range(outdated.size - 1, -1, -1):
        if not outdated[k]:
            continue
        size, edge = start[k + 1] - start[k], boundary[k + 1] - boundary[k]
        rows = size + edge
        system.k, system.matrix_size, system.matrix_rows = k, size, rows
        run(system.assemble_front, address)
        if system.assemble_blocks != 0:
            run(system.assemble_blocks, address)
        add_to_diagonal(floats(system.strain_stiffness), start[k], size, rows, matrix)
        if system.elastic == 0:
            add_to_diagonal(floats(system.regularisation), start[k], size, rows, matrix)
        _assemble_children(system, k, rows, matrix)
        system.symmetric = not _find_unsymmetric(system, k)
        run(system.invert, address)
        if system.elastic != 0 and system.pivot_ratio < system.singular_pivot_ratio:
            system.held = 0
            return
        inverse, complement = floats(system.inverses)[inverse_start[k] :], floats(system.complements)
        coupling, upper = floats(system.coupling)[at[k] :], floats(system.upper)[at[k] :]
        multiply(system, False, size, edge, size, 1.0, inverse, size, matrix[size * rows :], rows, 0.0, upper)
        for j in range(size):
            for i in range(edge):
                coupling[j * edge + i] = matrix[j * rows + size + i]
        complement = complement[complement_start[k] :]
        for j in range(edge):
            for i in range(edge):
                complement[j * edge + i] = matrix[(size + j) * rows + size + i]
        multiply(system, False, edge, edge, size, -1.0, matrix[size:], rows, upper, size, 1.0, complement)


@law
def add_row(amount, row, total):
    """Add a multiple of a row to another (axpy).

    Parameters
    ----------
    amount : float
        The multiple.
    row, total : array (n,)
        The rows.
    """
    for j in range(row.size):
        total[j] += amount * row[j]


@law
def add_product(sign, matrix, rows, columns, force, first, product, to):
    """Add the product of a matrix and a part of each force, or its negative, to a part of each product.

    Parameters
    ----------
    sign : float
        1 or -1.
    matrix : array (rows * columns,)
        Column by column.
    rows, columns : int
        Its size.
    force, product : array (r, n)
        The products of each row are added to ``rows`` entries from ``to`` on.
    first, to : int
        First entries that are taken of each force, and of each product.
    """
    rest = columns % 4
    for i in range(0, columns - rest, 4):  # four columns at a time
        one, two = matrix[i * rows :], matrix[(i + 1) * rows :]
        three, four = matrix[(i + 2) * rows :], matrix[(i + 3) * rows :]
        for j in range(force.shape[0]):
            a, b = sign * force[j, first + i], sign * force[j, first + i + 1]
            c, d = sign * force[j, first + i + 2], sign * force[j, first + i + 3]
            total = product[j][to : to + rows]
            for r in range(rows):
                total[r] += a * one[r] + b * two[r] + c * three[r] + d * four[r]
    for i in range(columns - rest, columns):
        for j in range(force.shape[0]):
            add_row(sign * force[j, first + i], matrix[i * rows : (i + 1) * rows], product[j][to : to + rows])


@Unit
def forward(address):
    """Eliminate ``fronts``: condense forces on their ancestors, and solve with these fixed.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations: the condensed forces are added to ``current``, on fronts that are
        ``reached``, and reach their parents; ``particular`` is filled with the particular solution, ancestors fixed.
    """
    system = system_at(address)
    force, particular, edges = float_rows(system.current), float_rows(system.particular), float_rows(system.gathered)
    fronts, parent, reached = integers(system.fronts), integers(system.parent), flags(system.reached)
    start, first, row_start = integers(system.start), integers(system.first_boundary), integers(system.row_start)
    inverse_start, at, boundary = (
        integers(system.inverse_start),
        integers(system.coupling_start),
        integers(system.boundary_row),
    )
    edges = edges[: force.shape[0]]
    for m in range(force.shape[0]):
        for i in range(force.shape[1]):
            particular[m, i] = 0.0
    for f in range(fronts.size - 1, -1, -1):
        k = fronts[f]
        if not reached[k]:
            continue
        size, a, rows = start[k + 1] - start[k], row_start[k], boundary[first[k] : first[k + 1]]
        add_product(1.0, floats(system.inverses)[inverse_start[k] :], size, size, force, a, particular, a)
        if rows.size == 0:
            continue
        reached[parent[k]] = True
        for m in range(force.shape[0]):
            for i in range(rows.size):
                edges[m, i] = 0.0
        add_product(1.0, floats(system.coupling)[at[k] :], rows.size, size, particular, a, edges, 0)
        for m in range(force.shape[0]):
            for i in range(rows.size):
                force[m, rows[i]] -= edges[m, i]


@Unit
def back(address):
    """Recover the displacements of ``fronts`` from those of their ancestors.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations: ``current`` becomes the displacements; ``particular`` is the particular
        solution.
    """
    system = system_at(address)
    displacement, particular = float_rows(system.current), float_rows(system.particular)
    edges = float_rows(system.gathered)[: displacement.shape[0]]
    start, first, row_start = integers(system.start), integers(system.first_boundary), integers(system.row_start)
    at, boundary = integers(system.coupling_start), integers(system.boundary_row)
    for k in integers(system.fronts):
        size, a, rows = start[k + 1] - start[k], row_start[k], boundary[first[k] : first[k + 1]]
        for m in range(displacement.shape[0]):
            for i in range(a, a + size):
                displacement[m, i] = particular[m, i]
            for i in range(rows.size):
                edges[m, i] = displacement[m, rows[i]]
        add_product(-1.0, floats(system.upper)[at[k] :], size, rows.size, edges, 0, displacement, a)


@Unit
def solve_columns(address):
    """Solve for the unit loads, one a column, by matrix products: forward elimination and back substitution.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations: ``columns`` columns of ``unit``, overwritten, all zero on active fronts
        that are not ``reached``; the solution fills ``unit_response``.
    """
    system = system_at(address)
    r, force, displacement = system.columns, floats(system.unit), floats(system.unit_response)
    edges, fronts, parent = floats(system.gathered_columns), integers(system.fronts), integers(system.parent)
    start, first, row_start = integers(system.start), integers(system.first_boundary), integers(system.row_start)
    inverse_start, at, boundary = (
        integers(system.inverse_start),
        integers(system.coupling_start),
        integers(system.boundary_row),
    )
    reached = flags(system.reached)
    for f in range(fronts.size - 1, -1, -1):
        k = fronts[f]
        size, a, rows = start[k + 1] - start[k], row_start[k], boundary[first[k] : first[k + 1]]
        own, found = force[a * r :], displacement[a * r : (a + size) * r]
        if not reached[k]:
            for j in range(found.size):
                found[j] = 0.0
            continue
        multiply(
            system, True, r, size, size, 1.0, own, r, floats(system.inverses)[inverse_start[k] :], size, 0.0, found
        )
        if rows.size == 0:
            continue
        reached[parent[k]] = True
        multiply(
            system, True, r, rows.size, size, 1.0, found, r, floats(system.coupling)[at[k] :], rows.size, 0.0, edges
        )
        for i in range(rows.size):
            add_row(-1.0, edges[i * r : (i + 1) * r], force[rows[i] * r : (rows[i] + 1) * r])
    for k in fronts:
        size, a, rows = start[k + 1] - start[k], row_start[k], boundary[first[k] : first[k + 1]]
        for i in range(rows.size):
            for j in range(r):
                edges[i * r + j] = displacement[rows[i] * r + j]
        found = displacement[a * r : (a + size) * r]
        multiply(system, True, r, size, rows.size, -1.0, edges, r, floats(system.upper)[at[k] :], size, 1.0, found)
