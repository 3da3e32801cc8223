"""Low-rank correction of a factorised system for a few changed interfaces, by the Woodbury identity (Hager 1989).

A change D of the interface stiffness and the compliance C turn relative displacements x of the factorised system into
correction forces p = D (x - C p), so (1 + D C) p = D x. A relative displacement is the opening (j = 0), shear (1) or
rotation (2) of an interface i; a unit load 3 i + j is the pair of unit forces along it.
"""

import numpy as np
from numba import types

from damagepred.kernels.jit import law, phase, rule
from damagepred.kernels.linear.dense import factorise_dense, solve_dense
from damagepred.kernels.linear.substitution import Substitution, add_row, solve_factorised
from damagepred.kernels.structures import FLOAT_ROWS, FLOATS, INTEGER_ROWS, INTEGERS, INTEGERS_32, Structure

TOLERANCE = 1e-6
"""Residual of the correction forces over their largest, beyond which the system is refactorised (1)."""
MAX_LOOP_ROWS = 8
"""Right-hand sides up to which loops are faster than matrix products of BLAS."""


class Correction(Structure):
    """Responses to unit loads in changed interfaces, and factors of the last correction.

    They belong to one factorisation: ``discard_responses`` empties them before the next. n interfaces may have a slot.
    """

    index = INTEGERS
    """Index of each degree of freedom among the active ones, -1 where prescribed or condensed."""
    slot = INTEGERS
    interface_of_slot = INTEGERS
    """Slot of an interface (m,) among those with responses, -1 for none; and the interface in each slot (n,)."""
    load_slot = INTEGER_ROWS
    """Slot of the response to unit opening, shear and rotation forces in an interface (m, 3), -1 for none."""
    response = FLOAT_ROWS
    """Displacements for unit loads (3 n, a)."""
    compliance = FLOAT_ROWS
    """Opening, shear and rotation of interfaces with a slot for unit loads, one row per load (3 n, 3 n)."""
    change = FLOAT_ROWS
    changed_rows = INTEGERS
    """D of changed interfaces (n, 9), and which of its rows are not 0: 3 s + j for row j of changed interface s."""
    relative = FLOAT_ROWS
    force = FLOATS
    """Relative displacements x (2, 3 n) and correction forces p of each right-hand side."""
    capacitance = FLOATS
    pivots = INTEGERS_32
    """Factors of 1 + D C, and their exchanges of rows."""
    corrected = INTEGERS
    corrected_count = types.int64
    """Changed interfaces of these factors, and their number, 0 if there are none."""
    unit = FLOATS
    unit_response = FLOATS
    """Unit loads, one per column, and the displacements for them."""
    occupied = types.int64
    loads = types.int64
    """Interfaces with a slot, and unit loads with a response."""


@law
def discard_responses(correction):
    """Discard all unit-load responses, and the factors of the last correction."""
    slot, interface_of_slot, load_slot = correction.slot, correction.interface_of_slot, correction.load_slot
    for s in range(correction.occupied):
        i = interface_of_slot[s]
        slot[i] = load_slot[i, 0] = load_slot[i, 1] = load_slot[i, 2] = -1
    correction.occupied = correction.loads = correction.corrected_count = 0


@law
def _relative_displacement(dofs, rows, index, displacement, i, j):
    """Relative displacement j of interface i: row j of B times the displacement of active degrees of freedom."""
    total = 0.0
    for r in range(dofs.shape[1]):
        dof = dofs[i, r]
        if dof >= 0 and index[dof] >= 0:
            total += rows[i, j, r] * displacement[index[dof]]
    return total


@rule
def _relative_displacements(correction, tree, changed, solutions):
    """Fill ``relative`` with the relative displacements of changed interfaces in each solution."""
    relative, dofs, rows, index = correction.relative, tree.dof, tree.strain_displacement, correction.index
    for m in range(solutions.shape[0]):
        for s in range(changed.size):
            for j in range(3):
                relative[m, 3 * s + j] = _relative_displacement(dofs, rows, index, solutions[m], changed[s], j)


@rule
def _set_unit_loads(correction, tree, loads, force, between_loads, between_dofs):
    """Fill ``force`` with unit loads: force c at active degree of freedom d is at c between_loads + d between_dofs."""
    dofs, rows, index = tree.dof, tree.strain_displacement, correction.index
    force[:] = 0.0
    for c in range(loads.size):
        i, j = loads[c] // 3, loads[c] % 3
        for r in range(dofs.shape[1]):
            dof = dofs[i, r]
            if dof >= 0 and index[dof] >= 0:
                force[c * between_loads + index[dof] * between_dofs] += rows[i, j, r]


@law
def _register(correction, loads):
    """Give unit loads, whose responses have been computed, and their interfaces the next slots."""
    slot, interface_of_slot, load_slot = correction.slot, correction.interface_of_slot, correction.load_slot
    for load in loads:
        i, j = load // 3, load % 3
        if slot[i] < 0:
            interface_of_slot[correction.occupied], slot[i] = i, correction.occupied
            correction.occupied += 1
        load_slot[i, j] = correction.loads
        correction.loads += 1


@rule
def _add_compliance(correction, tree, known_interfaces, known_loads):
    """Fill the compliance C of new unit loads and new interfaces, beyond the numbers known before."""
    response, compliance, interface_of_slot = correction.response, correction.compliance, correction.interface_of_slot
    dofs, rows, index = tree.dof, tree.strain_displacement, correction.index
    for c in range(correction.loads):
        for s in range(known_interfaces if c < known_loads else 0, correction.occupied):
            for j in range(3):
                compliance[c, 3 * s + j] = _relative_displacement(
                    dofs, rows, index, response[c], interface_of_slot[s], j
                )


RESPOND = types.void(Correction.kind, Substitution.kind, INTEGERS)


@phase(RESPOND)
def respond(correction, substitution, loads):
    """Compute the responses to new unit loads, give them slots, and extend the compliance."""
    tree, reached = substitution.factors.tree, substitution.rows.reached
    front = tree.interface_front
    reached[:] = False
    for load in loads:
        if front[load // 3] >= 0:
            reached[front[load // 3]] = True
    response, count, first = correction.response, loads.size, correction.loads
    size, known = response.shape[1], correction.occupied
    added = response[first : first + count]
    if count <= MAX_LOOP_ROWS:
        _set_unit_loads(correction, tree, loads, added.reshape(count * size), size, 1)
        solve_factorised(substitution, added)
    else:
        unit, found = correction.unit[: size * count], correction.unit_response
        _set_unit_loads(correction, tree, loads, unit, 1, count)
        substitution.solve_columns(substitution.factors, substitution.rows, count, unit, found)
        for i in range(size):
            for c in range(count):
                added[c, i] = found[i * count + c]
    _register(correction, loads)
    _add_compliance(correction, tree, known, first)


@rule
def _stiffness_changes(correction, factorised, changed, target):
    """Fill D, the target less the factorised stiffness of changed interfaces, and list its rows that are not 0.

    D goes to ``change``, the rows to ``changed_rows``: a joint that slides changes its shear row alone. Returns the
    number of rows, and whether D equals the D of the last correction, whose factors of 1 + D C then serve again.
    """
    change, rows, corrected = correction.change, correction.changed_rows, correction.corrected
    count, same = 0, changed.size == correction.corrected_count
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
    return count, same


@law
def _correction_force(row, change, relative):
    """Component of D x in a changed row 3 s + j, j of the changed interface number s."""
    s, j = row // 3, row % 3
    first = relative[3 * s : 3 * s + 3]
    return change[s, 3 * j] * first[0] + change[s, 3 * j + 1] * first[1] + change[s, 3 * j + 2] * first[2]


@rule
def _fill_capacitance(correction, changed, count):
    """Fill the capacitance 1 + D C of ``count`` changed rows, column by column: column c by a unit load in row c."""
    change, compliance, matrix = correction.change, correction.compliance, correction.capacitance
    slot, load_slot, rows = correction.slot, correction.load_slot, correction.changed_rows
    for c in range(count):
        relative = compliance[load_slot[changed[rows[c] // 3], rows[c] % 3]]
        for r in range(count):
            s, j = rows[r] // 3, rows[r] % 3
            at = 3 * slot[changed[s]]
            force = change[s, 3 * j] * relative[at] + change[s, 3 * j + 1] * relative[at + 1]
            matrix[c * count + r] = force + change[s, 3 * j + 2] * relative[at + 2]
        matrix[c * count + c] += 1.0


@law
def _agrees(rows, count, change, relative, force):
    """Whether correction forces p (``force``) equal D x of the corrected solution, within a share of the largest."""
    largest, apart = 0.0, 0.0
    for c in range(count):
        difference = abs(_correction_force(rows[c], change, relative) - force[c])
        if not difference < np.inf:
            return False
        largest, apart = max(largest, abs(force[c])), max(apart, difference)
    return apart <= TOLERANCE * largest


CORRECT = types.boolean(Correction.kind, Substitution.kind, INTEGERS, FLOAT_ROWS, FLOAT_ROWS)


@phase(CORRECT)
def correct(correction, substitution, changed, target, solutions):
    """Correct solutions of the factorised system, in place, by the Woodbury identity (Hager 1989).

    All changed rows must have a response. Returns False if 1 + D C is singular or the solutions violate p = D x.
    """
    tree, dense = substitution.factors.tree, substitution.factors.dense
    count, same = _stiffness_changes(correction, substitution.factors.stiffness, changed, target)
    x, p, change = correction.relative, correction.force, correction.change
    rows, load_slot, response = correction.changed_rows, correction.load_slot, correction.response
    factors, pivots = correction.capacitance, correction.pivots
    _relative_displacements(correction, tree, changed, solutions)
    if not same:
        _fill_capacitance(correction, changed, count)
        correction.corrected_count = changed.size if factorise_dense(dense, count, factors, pivots) else 0
        if correction.corrected_count == 0:
            return False
    for m in range(solutions.shape[0]):
        for c in range(count):
            p[m * count + c] = _correction_force(rows[c], change, x[m])
    solve_dense(dense, count, solutions.shape[0], factors, pivots, p)
    for m in range(solutions.shape[0]):
        for c in range(count):
            add_row(-p[m * count + c], response[load_slot[changed[rows[c] // 3], rows[c] % 3]], solutions[m])
    _relative_displacements(correction, tree, changed, solutions)
    accurate = True
    for m in range(solutions.shape[0]):
        accurate &= _agrees(rows, count, change, x[m], p[m * count : m * count + count])
    return accurate
