"""Low-rank correction of a factorised system for a few changed interfaces, by the Woodbury identity (Hager 1989).

A change D of the interface stiffness and the compliance C turn relative displacements x of the factorised system into
correction forces p = D (x - C p), so (1 + D C) p = D x.
"""

import numpy as np

from damagepred.kernels.jit import Unit, law
from damagepred.kernels.linear.lapack import factorise_dense, solve_dense
from damagepred.kernels.linear.multifrontal import add_row
from damagepred.kernels.linear.table import system_at
from damagepred.kernels.table import (
    flags,
    float_blocks,
    float_rows,
    floats,
    integer_rows,
    integers,
    integers32,
    part,
    run,
)


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
def _set_unit_loads(system, listed, force, between_loads, between_dofs):
    """Set unit opening (j = 0), shear (1) or rotation (2) forces of interfaces i, given as 3 i + j; a row or column."""
    dofs, rows, index = integer_rows(system.dof), float_blocks(system.strain_displacement), integers(system.index)
    for at in range(force.size):
        force[at] = 0.0
    for c in range(listed.size):
        i, j = listed[c] // 3, listed[c] % 3
        for r in range(dofs.shape[1]):
            dof = dofs[i, r]
            if dof >= 0 and index[dof] >= 0:
                force[c * between_loads + index[dof] * between_dofs] += rows[i, j, r]


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


@law
def _register(system, new):
    """Give new unit loads, and their interfaces, a slot; return the number of interfaces that had one before."""
    slot, interface_of_slot, before = integers(system.slot), integers(system.interface_of_slot), system.occupied
    load_slot = integer_rows(system.load_slot)
    for load in new:
        i, j = load // 3, load % 3
        if slot[i] < 0:
            interface_of_slot[system.occupied], slot[i] = i, system.occupied
            system.occupied += 1
        load_slot[i, j] = system.loads
        system.loads += 1
    return before


@Unit
def respond(address):
    """Compute the responses to new unit loads, and the compliance between all interfaces and unit loads with a slot.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations; the unit loads are ``new`` from ``first_new`` to ``last_new``.
    """
    system = system_at(address)
    new = part(integers(system.new), system.first_new, system.last_new - system.first_new)
    front, reached = integers(system.interface_front), flags(system.reached)
    for k in range(reached.size):
        reached[k] = False
    for load in new:
        if front[load // 3] >= 0:
            reached[front[load // 3]] = True
    size, columns, first = integers(system.active_dofs).size, new.size, system.loads
    added = part(float_rows(system.response), first, columns)
    if columns <= system.loop_rows:
        _set_unit_loads(system, new, part(floats(system.response), first * size, columns * size), size, 1)
        solve_factorised(system, added)
    else:
        found = floats(system.unit_response)
        _set_unit_loads(system, new, part(floats(system.unit), 0, size * columns), 1, columns)
        system.columns = columns
        run(system.solve_columns, address)
        for i in range(size):
            for c in range(columns):
                added[c, i] = found[i * columns + c]
    system.known_interfaces, system.known_loads = _register(system, new), first
    run(system.add_compliance, address)


@Unit
def add_compliance(address):
    """Compute the relative displacements in all interfaces for new unit loads, and in new interfaces for all.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations; those from ``known_interfaces`` and ``known_loads`` on are new.
    """
    system = system_at(address)
    response, compliance = float_rows(system.response), float_rows(system.compliance)
    dofs, rows, index = integer_rows(system.dof), float_blocks(system.strain_displacement), integers(system.index)
    interface_of_slot = integers(system.interface_of_slot)
    for c in range(system.loads):
        for s in range(system.known_interfaces if c < system.known_loads else 0, system.occupied):
            for j in range(3):
                compliance[c, 3 * s + j] = _relative_displacement(
                    dofs, rows, index, response[c], interface_of_slot[s], j
                )


@Unit
def stiffness_changes(address):
    """Compute the change D of the stiffness of changed interfaces, and list its rows that are not 0.

    A joint that slides changes its shear row alone.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations; ``columns`` becomes the number of rows, and ``factorised`` tells whether
        the change is that of the last correction.
    """
    system = system_at(address)
    changed, target = part(integers(system.changed), 0, system.changed_count), float_rows(system.target)
    factorised, change, rows = float_rows(system.stiffness), float_rows(system.change), integers(system.changed_rows)
    corrected, count, same = integers(system.corrected), 0, system.changed_count == system.corrected_count
    for s in range(changed.size):
        i = changed[s]
        same &= corrected[s] == i
        corrected[s] = i
        for j in range(3):
            listed = False
            for k in range(3 * j, 3 * j + 3):
                difference = target[i, k] - factorised[i, k]
                same &= change[s, k] == difference
                change[s, k] = difference
                listed |= difference != 0.0
            if listed:
                rows[count] = 3 * s + j
                count += 1
    system.columns, system.factorised = count, same


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
    change, compliance = float_rows(system.change), float_rows(system.compliance)
    slot, load_slot = integers(system.slot), integer_rows(system.load_slot)
    rows, matrix = integers(system.changed_rows), floats(system.capacitance)
    for c in range(count):
        relative = compliance[load_slot[changed[rows[c] // 3], rows[c] % 3]]
        for r in range(count):
            s, j = rows[r] // 3, rows[r] % 3
            at = 3 * slot[changed[s]]
            force = change[s, 3 * j] * relative[at] + change[s, 3 * j + 1] * relative[at + 1]
            matrix[c * count + r] = force + change[s, 3 * j + 2] * relative[at + 2]
        matrix[c * count + c] += 1.0


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
    rows, load_slot, response = (
        integers(system.changed_rows),
        integer_rows(system.load_slot),
        float_rows(system.response),
    )
    run(system.stiffness_changes, address)
    count = system.columns
    run(system.relative_displacements, address)
    factors, pivots = floats(system.capacitance), integers32(system.capacitance_pivots)
    if system.factorised == 0:
        run(system.fill_capacitance, address)
        system.corrected_count = changed.size if factorise_dense(system, count, factors, pivots) else 0
        if system.corrected_count == 0:
            return
    for m in range(right.shape[0]):
        for c in range(count):
            p[m * count + c] = _correction_force(rows[c], change, x[m])
    solve_dense(system, count, right.shape[0], factors, pivots, p)
    for m in range(right.shape[0]):
        for c in range(count):
            add_row(-p[m * count + c], response[load_slot[changed[rows[c] // 3], rows[c] % 3]], right[m])
    run(system.relative_displacements, address)
    accurate = True
    for m in range(right.shape[0]):
        accurate &= _agrees(rows, count, change, x[m], part(p, m * count, count), system.woodbury_tolerance)
    system.accurate = accurate
