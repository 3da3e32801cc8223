"""Low-rank correction of a factorised system for a few changed interfaces, by the Woodbury identity (Hager 1989).

A change D of the interface stiffness and the compliance C turn relative displacements x of the factorised system into
correction forces p = D (x - C p), so (1 + D C) p = D x.
"""

import numpy as np

from damagepred.kernels.jit import Unit, law
from damagepred.kernels.linear.lapack import solve_dense
from damagepred.kernels.linear.multifrontal import add_row
from damagepred.kernels.linear.table import system_at
from damagepred.kernels.table import flags, float_blocks, float_rows, floats, integer_rows, integers, part, run


@law
def _relative_displacement(dofs, rows, index, displacement, i, j):
    """Return opening (j = 0), shear (1) or rotation (2) of interface i."""
    total = 0.0
    for r in range(dofs.shape[1]):
        dof = dofs[i, r]
        if dof >= 0 and index[dof] >= 0:
            total += rows[i, j, r] * displacement[index[dof]]
    return total


@Unit
def relative_displacements(address):
    """Compute opening, shear and rotation of changed interfaces from the solutions in ``rows``.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations.
    """
    system = system_at(address)
    changed, relative = part(integers(system.changed), 0, system.changed_count), float_rows(system.relative)
    displacement = part(float_rows(system.rows), 0, system.row_count)
    dofs, rows, index = integer_rows(system.dof), float_blocks(system.strain_displacement), integers(system.index)
    for m in range(displacement.shape[0]):
        for s in range(changed.size):
            for j in range(3):
                relative[m, 3 * s + j] = _relative_displacement(dofs, rows, index, displacement[m], changed[s], j)


@law
def _add_unit_loads(system, listed, columns, force):
    """Add unit opening, shear and rotation forces of interfaces, one a column."""
    dofs, rows, index = integer_rows(system.dof), float_blocks(system.strain_displacement), integers(system.index)
    for s in range(listed.size):
        i = listed[s]
        for r in range(dofs.shape[1]):
            dof = dofs[i, r]
            if dof >= 0 and index[dof] >= 0:
                for j in range(3):
                    force[index[dof] * columns + 3 * s + j] += rows[i, j, r]


@law
def solve_factorised(system, right):
    """Solve for rows of forces with the factorised stiffness; they become displacements.

    Parameters
    ----------
    system : SYSTEM
        The tangent equations; ``reached`` tells on which fronts there are forces.
    right : array (r, active degrees of freedom)
        The forces, in the order of the fronts.
    """
    count = right.shape[0]
    system.current.address, system.particular.address = right.ctypes.data, system.room.address
    system.current.rows = system.particular.rows = count
    system.current.columns = system.particular.columns = right.shape[1]
    run(system.forward, system.here)
    run(system.back, system.here)


@Unit
def respond(address):
    """Compute the response to unit loads in new interfaces, and the compliance between all that have a slot.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations; the new interfaces are ``new`` from ``first_new`` to ``last_new``.
    """
    system = system_at(address)
    new = part(integers(system.new), system.first_new, system.last_new - system.first_new)
    front, reached = integers(system.interface_front), flags(system.reached)
    for k in range(reached.size):
        reached[k] = False
    for i in new:
        if front[i] >= 0:
            reached[front[i]] = True
    size, columns, first = integers(system.active_dofs).size, 3 * new.size, 3 * system.occupied
    response, found = float_rows(system.response), floats(system.unit_response)
    added, force = part(response, first, columns), part(floats(system.unit), 0, size * columns)
    for j in range(force.size):
        force[j] = 0.0
    _add_unit_loads(system, new, columns, force)
    few = columns <= system.loop_rows
    if not few:
        system.columns = columns
        run(system.solve_columns, address)
    for i in range(size):
        for c in range(columns):
            added[c, i] = force[i * columns + c] if few else found[i * columns + c]
    if few:
        solve_factorised(system, added)
    slot, interface_of_slot = integers(system.slot), integers(system.interface_of_slot)
    for s in range(new.size):
        interface_of_slot[system.occupied + s] = new[s]
        slot[new[s]] = system.occupied + s
    system.columns = columns
    run(system.add_compliance, address)
    system.occupied += new.size


@Unit
def add_compliance(address):
    """Compute the relative displacements for new unit loads, and those of new interfaces for old ones.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations; the last ``columns`` of all responses are new.
    """
    system = system_at(address)
    columns, first = system.columns, 3 * system.occupied
    response, compliance = float_rows(system.response), float_rows(system.compliance)
    dofs, rows, index = integer_rows(system.dof), float_blocks(system.strain_displacement), integers(system.index)
    interface_of_slot = integers(system.interface_of_slot)
    for s in range((first + columns) // 3):
        own = first if 3 * s < first else 0
        for c in range(own, first + columns):
            for j in range(3):
                compliance[3 * s + j, c] = _relative_displacement(
                    dofs, rows, index, response[c], interface_of_slot[s], j
                )


@Unit
def stiffness_changes(address):
    """Compute the change D of the stiffness of changed interfaces, and list its rows that are not 0.

    A joint that slides changes its shear row alone.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations; ``columns`` becomes the number of rows.
    """
    system = system_at(address)
    changed, target = part(integers(system.changed), 0, system.changed_count), float_rows(system.target)
    factorised, change, rows = float_rows(system.stiffness), float_rows(system.change), integers(system.changed_rows)
    count = 0
    for s in range(changed.size):
        i = changed[s]
        for j in range(3):
            listed = False
            for k in range(3 * j, 3 * j + 3):
                change[s, k] = target[i, k] - factorised[i, k]
                listed |= change[s, k] != 0.0
            if listed:
                rows[count] = 3 * s + j
                count += 1
    system.columns = count


@law
def _correction_force(row, change, relative):
    """Return one component of the correction forces D x."""
    s, j = row // 3, row % 3
    first = part(relative, 3 * s, 3)
    return change[s, 3 * j] * first[0] + change[s, 3 * j + 1] * first[1] + change[s, 3 * j + 2] * first[2]


@Unit
def fill_capacitance(address):
    """Fill 1 + D C, transposed.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations; ``columns`` is its size.
    """
    system = system_at(address)
    changed, count = integers(system.changed), system.columns
    change, compliance, slots = float_rows(system.change), float_rows(system.compliance), integers(system.slot)
    rows, matrix = integers(system.changed_rows), floats(system.capacitance)
    for r in range(count):
        s, j = rows[r] // 3, rows[r] % 3
        slot = 3 * slots[changed[s]]
        a, b, d = change[s, 3 * j], change[s, 3 * j + 1], change[s, 3 * j + 2]
        for c in range(count):
            k = 3 * slots[changed[rows[c] // 3]] + rows[c] % 3
            matrix[c * count + r] = a * compliance[slot, k] + b * compliance[slot + 1, k] + d * compliance[slot + 2, k]
        matrix[r * count + r] += 1.0


@law
def _agrees(rows, count, change, relative, force, tolerance):
    """Whether the solution satisfies p = D x, within a share of the largest force."""
    largest, apart = 0.0, 0.0
    for c in range(count):
        difference = abs(_correction_force(rows[c], change, relative) - force[c])
        if not difference < np.inf:
            return False
        largest, apart = max(largest, abs(force[c])), max(apart, difference)
    return apart <= tolerance * largest


@Unit
def correct(address):
    """Correct solutions with the factorised stiffness for a few changed interfaces; all have a slot.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations; the solutions are the first rows of ``rows``, and ``accurate`` tells
        whether the correction is.
    """
    system = system_at(address)
    right, changed = (
        part(float_rows(system.rows), 0, system.row_count),
        part(integers(system.changed), 0, system.changed_count),
    )
    system.accurate = 0
    x, p, change = float_rows(system.relative), floats(system.correction_force), float_rows(system.change)
    rows, slots, response = integers(system.changed_rows), integers(system.slot), float_rows(system.response)
    run(system.stiffness_changes, address)
    count = system.columns
    run(system.relative_displacements, address)
    run(system.fill_capacitance, address)
    for m in range(right.shape[0]):
        for c in range(count):
            p[m * count + c] = _correction_force(rows[c], change, x[m])
    if not solve_dense(system, count, right.shape[0], floats(system.capacitance), p):
        return
    for m in range(right.shape[0]):
        for c in range(count):
            slot = 3 * slots[changed[rows[c] // 3]] + rows[c] % 3
            add_row(-p[m * count + c], response[slot], right[m])
    run(system.relative_displacements, address)
    accurate = True
    for m in range(right.shape[0]):
        accurate &= _agrees(rows, count, change, x[m], part(p, m * count, count), system.woodbury_tolerance)
    system.accurate = accurate
