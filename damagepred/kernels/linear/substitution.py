"""Forward elimination and back substitution with the factors of some fronts."""

from numba import types

from damagepred.kernels.jit import law, phase
from damagepred.kernels.linear.dense import multiply
from damagepred.kernels.linear.factors import Factors
from damagepred.kernels.structures import FLAGS, FLOAT_ROWS, FLOATS, INTEGERS, Structure


class Rows(Structure):
    """Places of some fronts' degrees of freedom in right-hand sides and solutions."""

    fronts = INTEGERS
    """The fronts, from the root on."""
    row_start = INTEGERS
    boundary_row = INTEGERS
    """Where the rows of each front begin, and the rows of its boundary."""
    reached = FLAGS
    """Fronts on which there are forces; callers set it, and forward elimination adds their ancestors."""
    gathered = FLOAT_ROWS
    """Displacements of, or forces on, a boundary."""


@law
def add_row(amount, row, total):
    """Add a multiple of a row to another (axpy)."""
    for j in range(row.size):
        total[j] += amount * row[j]


@law
def add_product(sign, matrix, rows, columns, force, first, product, to):
    """Add the product of a matrix and a part of each force, or its negative, to a part of each product.

    The matrix lies column by column; of each force, entries from ``first`` on are taken, and entries of the product
    from ``to`` on are added to.
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


SUBSTITUTE = types.void(Factors.kind, Rows.kind, FLOAT_ROWS, FLOAT_ROWS)


@phase(SUBSTITUTE)
def forward(factors, rows, force, particular):
    """Forward elimination: condense forces on the ancestors, and solve with these fixed.

    ``force`` is changed in place and is zero on fronts that are not ``reached``; ``particular`` takes the solution with
    ancestors fixed. Entries of both follow ``rows``.
    """
    tree, fronts, reached = factors.tree, rows.fronts, rows.reached
    start, first, parent, row_start = tree.start, tree.first_boundary, tree.parent, rows.row_start
    edges = rows.gathered[: force.shape[0]]
    particular[:] = 0.0
    for f in range(fronts.size - 1, -1, -1):
        k = fronts[f]
        if not reached[k]:
            continue
        size, a, edge = start[k + 1] - start[k], row_start[k], rows.boundary_row[first[k] : first[k + 1]]
        add_product(1.0, factors.inverses[tree.inverse_start[k] :], size, size, force, a, particular, a)
        if edge.size == 0:
            continue
        reached[parent[k]] = True
        for m in range(force.shape[0]):
            for i in range(edge.size):
                edges[m, i] = 0.0
        add_product(1.0, factors.coupling[tree.coupling_start[k] :], edge.size, size, particular, a, edges, 0)
        for m in range(force.shape[0]):
            for i in range(edge.size):
                force[m, edge[i]] -= edges[m, i]


@phase(SUBSTITUTE)
def back(factors, rows, displacement, particular):
    """Back substitution: ``displacement`` of each front is its particular solution less A^-1 B times its ancestors'."""
    tree, edges = factors.tree, rows.gathered[: displacement.shape[0]]
    start, first, row_start = tree.start, tree.first_boundary, rows.row_start
    for k in rows.fronts:
        size, a, edge = start[k + 1] - start[k], row_start[k], rows.boundary_row[first[k] : first[k + 1]]
        for m in range(displacement.shape[0]):
            for i in range(a, a + size):
                displacement[m, i] = particular[m, i]
            for i in range(edge.size):
                edges[m, i] = displacement[m, edge[i]]
        add_product(-1.0, factors.upper[tree.coupling_start[k] :], size, edge.size, edges, 0, displacement, a)


SOLVE_COLUMNS = types.void(Factors.kind, Rows.kind, types.int64, FLOATS, FLOATS)


@phase(SOLVE_COLUMNS)
def solve_columns(factors, rows, columns, force, displacement):
    """Forward elimination and back substitution of many right-hand sides, one per column, by products of matrices.

    Flat arrays with ``columns`` entries per degree of freedom; forces, zero on fronts not ``reached``, are overwritten.
    """
    tree, dense, fronts, reached, n = factors.tree, factors.dense, rows.fronts, rows.reached, columns
    edges = rows.gathered.reshape(rows.gathered.size)
    start, first, parent, row_start = tree.start, tree.first_boundary, tree.parent, rows.row_start
    inverse_start, coupling_start = tree.inverse_start, tree.coupling_start
    for f in range(fronts.size - 1, -1, -1):
        k = fronts[f]
        size, row, edge = start[k + 1] - start[k], row_start[k], rows.boundary_row[first[k] : first[k + 1]]
        solution = displacement[row * n : (row + size) * n]
        if not reached[k]:
            solution[:] = 0.0
            continue
        inverse = factors.inverses[inverse_start[k] :]
        multiply(dense, True, n, size, size, 1.0, force[row * n :], n, inverse, size, 0.0, solution)
        if edge.size == 0:
            continue
        reached[parent[k]] = True
        coupling = factors.coupling[coupling_start[k] :]
        multiply(dense, True, n, edge.size, size, 1.0, solution, n, coupling, edge.size, 0.0, edges)
        for i in range(edge.size):
            add_row(-1.0, edges[i * n : (i + 1) * n], force[edge[i] * n : (edge[i] + 1) * n])
    for k in fronts:
        size, row, edge = start[k + 1] - start[k], row_start[k], rows.boundary_row[first[k] : first[k + 1]]
        for i in range(edge.size):
            for j in range(n):
                edges[i * n + j] = displacement[edge[i] * n + j]
        solution = displacement[row * n : (row + size) * n]
        upper = factors.upper[coupling_start[k] :]
        multiply(dense, True, n, size, edge.size, -1.0, edges, n, upper, size, 1.0, solution)


class Substitution(Structure):
    """Factors, the fronts that are solved for, and the functions that do it."""

    factors = Factors.kind
    rows = Rows.kind
    particular = FLOAT_ROWS
    """Particular solutions."""
    forward = types.FunctionType(SUBSTITUTE)
    back = types.FunctionType(SUBSTITUTE)
    solve_columns = types.FunctionType(SOLVE_COLUMNS)


@law
def solve_factorised(substitution, right):
    """Solve for rows of forces, in the order of the fronts; they become displacements."""
    particular = substitution.particular[: right.shape[0]]
    substitution.forward(substitution.factors, substitution.rows, right, particular)
    substitution.back(substitution.factors, substitution.rows, right, particular)
