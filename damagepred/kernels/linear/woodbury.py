"""Low-rank correction of a factorised system for a few changed interfaces, by the Woodbury identity (Hager 1989)."""

import numpy as np

from damagepred.kernels.jit import kernel, law
from damagepred.kernels.linear.block_tridiagonal import add_row


@kernel
def unit_loads(listed, kinematics, index, force):
    """Add unit opening, shear and rotation forces of interfaces, one a column.

    Parameters
    ----------
    listed : array of int
        The interfaces, three columns each.
    kinematics : NamedTuple of arrays
        Strain-displacement matrices; see ``damagepred.solvers.system.interface_kinematics``.
    index : array of int (size,)
        Index of each degree of freedom in the order of the levels, -1 where prescribed or condensed.
    force : array (active degrees of freedom, 3 * listed)
        Added to.
    """
    for s in range(listed.size):
        i = listed[s]
        for r in range(kinematics.dof.shape[1]):
            dof = kinematics.dof[i, r]
            if dof >= 0 and index[dof] >= 0:
                for j in range(3):
                    force[index[dof], 3 * s + j] += kinematics.rows[i, j, r]


@kernel
def relative_displacements(listed, kinematics, index, displacement, relative):
    """Compute opening, shear and rotation of interfaces from displacements.

    Parameters
    ----------
    listed, kinematics, index
        As ``unit_loads``.
    displacement : array (r, active degrees of freedom)
        Rows of displacements in the order of the levels.
    relative : array (3 * listed, r)
        Filled.
    """
    relative[:] = 0.0
    for s in range(listed.size):
        i = listed[s]
        for r in range(kinematics.dof.shape[1]):
            dof = kinematics.dof[i, r]
            if dof < 0 or index[dof] < 0:
                continue
            for j in range(3):
                for m in range(displacement.shape[0]):
                    relative[3 * s + j, m] += kinematics.rows[i, j, r] * displacement[m, index[dof]]


@kernel
def changed_interfaces(active, target, factorised, slot, level, changed):
    """List the interfaces whose stiffness differs from the factorised one.

    Parameters
    ----------
    active : array of int
        Active interfaces.
    target, factorised : array (m, 9)
        Stiffness of each interface.
    slot : array of int (m,)
        Slot of the unit-load responses of an interface, -1 if there are none yet.
    level : array of int (m,)
        Level of each interface.
    changed : array of int (m,)
        Filled with the changed interfaces.

    Returns
    -------
    int, int, int
        Number of changed interfaces, of those without a slot, and farthest level of one; -1 if there is none.
    """
    count, new, farthest = 0, 0, -1
    for i in active:
        for j in range(9):
            if target[i, j] != factorised[i, j]:
                changed[count] = i
                count += 1
                farthest = max(farthest, level[i])
                if slot[i] < 0:
                    new += 1
                break
    return count, new, farthest


@kernel
def stiffness_changes(changed, target, factorised, change, rows):
    """Compute the change D of the stiffness of interfaces, and list its rows that are not zero.

    A joint that slides changes its shear row alone.

    Parameters
    ----------
    changed : array of int (s,)
        The interfaces.
    target, factorised : array (m, 9)
        New and old stiffness of each interface.
    change : array (s, 9)
        Filled with their difference.
    rows : array of int (3 s,)
        Filled with 3 s + j: opening (0), shear (1) or rotation (2) of changed interface s.

    Returns
    -------
    int
        Number of rows.
    """
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
    return count


@law
def _correction_force(row, change, relative, m):
    """Return one component of the correction forces D x of right-hand side m."""
    s, j = row // 3, row % 3
    total = 0.0
    for k in range(3):
        total += change[s, 3 * j + k] * relative[3 * s + k, m]
    return total


@kernel
def capacitance_equations(compliance, slots, change, rows, relative, matrix, force):
    """Set up the capacitance equations of the Woodbury identity, (1 + D C) p = D x.

    A change D of the interface stiffness and the compliance C turn relative displacements x of the factorised system
    into correction forces p = D (x - C p).

    Parameters
    ----------
    compliance : array
        Relative displacements of interfaces for unit forces in them.
    slots : array of int (s,)
        Of the changed interfaces: rows and columns 3 slot to 3 slot + 2 of the compliance.
    change, rows : array (s, 9), array of int (p,)
        See ``stiffness_changes``.
    relative : array (3 s, r)
        Relative displacements x of the changed interfaces.
    matrix : array (p, p)
        Filled with 1 + D C, transposed.
    force : array (r, p)
        Filled with D x.
    """
    for r in range(rows.size):
        s, j = rows[r] // 3, rows[r] % 3
        first = compliance[3 * slots[s]]
        second, third = compliance[3 * slots[s] + 1], compliance[3 * slots[s] + 2]
        a, b, d = change[s, 3 * j], change[s, 3 * j + 1], change[s, 3 * j + 2]
        for c in range(rows.size):
            k = 3 * slots[rows[c] // 3] + rows[c] % 3
            matrix[c, r] = a * first[k] + b * second[k] + d * third[k]
        matrix[r, r] += 1.0
        for m in range(force.shape[0]):
            force[m, r] = _correction_force(rows[r], change, relative, m)


@kernel
def correction_agrees(rows, change, relative, force, share):
    """Whether the solution satisfies p = D x.

    Parameters
    ----------
    rows, change, relative, force
        As ``capacitance_equations``, at the solution; ``force`` is p.
    share : float
        Tolerance, relative to the largest force of a right-hand side (1).
    """
    for m in range(force.shape[0]):
        largest, apart = 0.0, 0.0
        for c in range(rows.size):
            difference = abs(_correction_force(rows[c], change, relative, m) - force[m, c])
            if not difference < np.inf:
                return False
            largest, apart = max(largest, abs(force[m, c])), max(apart, difference)
        if apart > share * largest:
            return False
    return True


@kernel
def subtract_correction(amounts, rows, slots, unit_load_response, displacement):
    """Subtract the response to the correction forces from displacements.

    Parameters
    ----------
    amounts : array (r, p)
        Correction forces.
    rows, slots
        As ``capacitance_equations``.
    unit_load_response : array (3 slots, active degrees of freedom)
        Displacements for unit forces in interfaces.
    displacement : array (r, active degrees of freedom)
        Updated.
    """
    for m in range(displacement.shape[0]):
        for c in range(rows.size):
            add_row(-amounts[m, c], unit_load_response[3 * slots[rows[c] // 3] + rows[c] % 3], displacement[m])
