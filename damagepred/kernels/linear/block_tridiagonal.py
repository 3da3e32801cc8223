"""Direct solution of block tridiagonal equations: Schur complements, forward elimination and back substitution.

Levels are ordered by their distance from the ground. Elimination runs from the farthest level to the nearest, so a
change in one level leaves the factors of all farther ones as they are. Inverses are stored transposed: a product with
one is then a sum of its rows, which the compiler vectorises.
"""

from damagepred.kernels.jit import Unit, law, rule
from damagepred.kernels.linear.assembly import (
    add_to_diagonal,
    farthest_unsymmetric,
)
from damagepred.kernels.linear.lapack import multiply
from damagepred.kernels.linear.table import system_at
from damagepred.kernels.table import float_blocks, float_rows, floats, integer_rows, integers, part, run


@Unit
def schur_complement(address):
    """Compute what eliminating level ``k`` subtracts from the next level: K_nf K_ff^-1 K_fn.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations.
    """
    system = system_at(address)
    k, work = system.k, float_rows(system.scratch)[1]
    pairs, start, at = integers(system.first_pair), integers(system.start), integers(system.inverse_start)
    far_index, near_index = integer_rows(system.far_index), integer_rows(system.near_index)
    near_far, far_near = float_blocks(system.near_far), float_blocks(system.far_near)
    first, last, size, nearer = pairs[k], pairs[k + 1], start[k + 1] - start[k], start[k] - start[k - 1]
    inverses, complement = floats(system.inverses), part(floats(system.complements), at[k - 1], nearer * nearer)
    side = far_index.shape[1]
    for j in range(nearer * size):
        work[j] = 0.0
    for e in range(first, last):
        for r in range(side):
            if far_index[e, r] < 0:
                continue
            row = part(inverses, at[k] + far_index[e, r] * size, size)
            for c in range(side):
                if near_index[e, c] >= 0:
                    add_row(far_near[e, r, c], row, part(work, near_index[e, c] * size, size))
    for j in range(nearer * nearer):
        complement[j] = 0.0
    for m in range(nearer):
        row, total = part(work, m * size, size), part(complement, m * nearer, nearer)
        for e in range(first, last):
            for r in range(side):
                if near_index[e, r] < 0:
                    continue
                pull = 0.0
                for c in range(side):
                    if far_index[e, c] >= 0:
                        pull += near_far[e, r, c] * row[far_index[e, c]]
                total[near_index[e, r]] += pull


@Unit
def eliminate(address):
    """Set the stiffness of changed interfaces, and eliminate all levels from ``farthest`` to ``nearest``.

    If the levels are ``elastic``, they are to be condensed, and not regularised: that would hold them in space;
    ``held`` tells whether nearer levels hold them.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations.
    """
    system = system_at(address)
    elastic, farthest, work = system.elastic != 0, system.farthest, float_rows(system.scratch)
    run(system.set_stiffness, address)
    starts, inverse_start, matrix = integers(system.start), integers(system.inverse_start), work[0]
    complements = floats(system.complements)
    run(system.assemble_couplings, address)
    # Schur complements inherit symmetry from farther levels
    level, stiffness, unsymmetric = integers(system.interface_level), float_rows(system.stiffness), -1
    if not elastic:
        unsymmetric = max(farthest_unsymmetric(integers(system.active), level, stiffness), system.blocks_level)
    system.held = 1
    for k in range(farthest, system.nearest - 1, -1):
        start, first, size, system.k = starts[k], inverse_start[k], starts[k + 1] - starts[k], k
        if size > 0:
            run(system.assemble_level, address)
            add_to_diagonal(floats(system.strain_stiffness), start, size, matrix)
            if system.has_blocks != 0:
                run(system.assemble_blocks, address)
            if not elastic:
                add_to_diagonal(floats(system.regularisation), start, size, matrix)
            if k + 1 < starts.size - 1:
                add_row(-1.0, part(complements, first, size * size), matrix)
            system.matrix_size, system.inverse_first, system.symmetric = size, first, k > unsymmetric
            run(system.invert, address)
            if elastic and system.pivot_ratio < system.singular_pivot_ratio:
                system.held = 0
                return
        if k > 0:
            run(system.schur_complement, address)


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


@rule
def _multiply(inverses, at, size, force, from_start, displacement, to_start):
    """Add the product of a level's inverse, ``inverses`` from ``at`` on, and its forces to displacements, all rows."""
    rest = size % 4
    for i in range(0, size - rest, 4):  # four rows of the inverse at a time
        rows = part(inverses, at + i * size, 4 * size)
        first, second = part(rows, 0, size), part(rows, size, size)
        third, fourth = part(rows, 2 * size, size), part(rows, 3 * size, size)
        for j in range(force.shape[0]):
            a, b = force[j, from_start + i], force[j, from_start + i + 1]
            c, d = force[j, from_start + i + 2], force[j, from_start + i + 3]
            total = part(displacement[j], to_start, size)
            for k in range(size):
                total[k] += a * first[k] + b * second[k] + c * third[k] + d * fourth[k]
    for i in range(size - rest, size):
        for j in range(force.shape[0]):
            add_row(
                force[j, from_start + i],
                part(inverses, at + i * size, size),
                part(displacement[j], to_start, size),
            )


@rule
def _subtract_coupling(first, last, at_here, at_there, coupling, displacement, there, force, here):
    """Subtract the product of a coupling block and the displacements of a neighbour level from forces."""
    side = at_here.shape[1]
    for e in range(first, last):
        for r in range(side):
            if at_here[e, r] < 0:
                continue
            for c in range(side):
                if at_there[e, c] < 0:
                    continue
                for j in range(force.shape[0]):
                    force[j, here + at_here[e, r]] -= coupling[e, r, c] * displacement[j, there + at_there[e, c]]


@Unit
def forward(address):
    """Eliminate levels from ``farthest`` to ``nearest``: condense forces, and solve with nearer levels fixed.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations: the condensed force of ``current`` is added to the next level;
        ``particular`` is filled with the particular solution, all nearer levels fixed.
    """
    system = system_at(address)
    force, particular = float_rows(system.current), float_rows(system.particular)
    start, coupling, at = integers(system.start), integers(system.first_pair), integers(system.inverse_start)
    far_index, near_index = integer_rows(system.far_index), integer_rows(system.near_index)
    near_far, inverses = float_blocks(system.near_far), floats(system.inverses)
    for m in range(force.shape[0]):
        for i in range(force.shape[1]):
            particular[m, i] = 0.0
    for k in range(system.farthest, system.nearest - 1, -1):
        a, first, end = start[k], coupling[k], coupling[k + 1]
        _multiply(inverses, at[k], start[k + 1] - a, force, a, particular, a)
        if k > 0:
            _subtract_coupling(first, end, near_index, far_index, near_far, particular, a, force, start[k - 1])


@Unit
def back(address):
    """Recover the displacements of levels ``first_back`` to ``last_back`` from those of the nearer ones.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations: ``current`` becomes the displacements; ``particular`` is the particular
        solution, and is overwritten. The ground, nearer than level 0, does not move.
    """
    system = system_at(address)
    displacement, particular = float_rows(system.current), float_rows(system.particular)
    start, coupling, at = integers(system.start), integers(system.first_pair), integers(system.inverse_start)
    far_index, near_index = integer_rows(system.far_index), integer_rows(system.near_index)
    far_near, inverses = float_blocks(system.far_near), floats(system.inverses)
    for k in range(system.first_back, system.last_back):
        a, b = start[k], start[k + 1]
        for j in range(displacement.shape[0]):
            for i in range(a, b):
                displacement[j, i] = particular[j, i]
                particular[j, i] = 0.0  # from here on forces of the nearer level
        if k > 0:
            _subtract_coupling(
                coupling[k], coupling[k + 1], far_index, near_index, far_near, displacement, start[k - 1], particular, a
            )
            _multiply(inverses, at[k], b - a, particular, a, displacement, a)


@Unit
def solve_columns(address):
    """Solve for the unit loads, one a column, by matrix products: forward elimination and back substitution.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations: ``columns`` columns of ``unit``, overwritten, beyond level ``farthest``
        all zero; the solution fills ``unit_response``.
    """
    system = system_at(address)
    active, farthest, columns = system.active_levels, system.farthest, system.columns
    force, displacement = floats(system.unit), floats(system.unit_response)
    start, pairs, first = integers(system.start), integers(system.first_pair), integers(system.inverse_start)
    far_index, near_index = integer_rows(system.far_index), integer_rows(system.near_index)
    near_far, far_near = float_blocks(system.near_far), float_blocks(system.far_near)
    inverses, r = floats(system.inverses), columns
    for k in range(farthest, -1, -1):
        a = start[k]
        multiply(system, r, start[k + 1] - a, inverses, first[k], force, a, 0.0, displacement, a)
        if k > 0:
            below = start[k - 1]
            here, nearer = part(displacement, a * r, (start[k + 1] - a) * r), part(force, below * r, (a - below) * r)
            _subtract_coupling_columns(pairs[k], pairs[k + 1], near_index, far_index, near_far, r, here, nearer)
    for k in range(1, active):
        a, size = start[k], start[k + 1] - start[k]
        below = start[k - 1]
        nearer, pull = part(displacement, below * r, (a - below) * r), part(force, a * r, size * r)
        for j in range(pull.size):
            pull[j] = 0.0
        _subtract_coupling_columns(pairs[k], pairs[k + 1], far_index, near_index, far_near, r, nearer, pull)
        known = 1.0 if k <= farthest else 0.0
        multiply(system, r, size, inverses, first[k], force, a, known, displacement, a)


@law
def _subtract_coupling_columns(first, last, at_here, at_there, coupling, columns, displacement, force):
    """Subtract as ``_subtract_coupling``, with one column for each right-hand side."""
    side = at_here.shape[1]
    for e in range(first, last):
        for r in range(side):
            here = at_here[e, r] * columns
            if here < 0:
                continue
            for c in range(side):
                there = at_there[e, c] * columns
                if there >= 0:
                    add_row(-coupling[e, r, c], part(displacement, there, columns), part(force, here, columns))
