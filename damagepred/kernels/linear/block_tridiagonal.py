"""Block tridiagonal stiffness of levels of blocks: making it, passing it on, and solving with it.

Matrices of a level stand here transposed: what the inverse makes of a displacement is then a sum of its rows, which the
compiler works on many numbers at a time.

Kinematics of interface i are three rows (opening, shear, relative rotation) over the degrees of freedom of its two
sides, w in all: three of a rigid block, or x and y of the two gridpoints at the ends of a facet. Its stiffness is a 3 x
3 matrix between them, not symmetric where sliding joints dilate less than they rub.
"""

import numpy as np

from damagepred.kernels.jit import kernel, kernel_making_arrays, law, law_making_arrays

FEW = 8
"""Right-hand sides up to which an inverse is multiplied by hand; beyond that BLAS is faster."""


@law
def interface_stiffness(rows, stiffness, matrix):
    """Fill the stiffness (w, w) of an interface between the degrees of freedom of its sides.

    Parameters
    ----------
    rows : array (3, w)
        Kinematics.
    stiffness : array (9,)
        Of the interface, row by row.
    """
    for r in range(rows.shape[1]):
        for j in range(3):
            left = rows[0, r] * stiffness[j] + rows[1, r] * stiffness[3 + j] + rows[2, r] * stiffness[6 + j]
            if j == 0:
                for c in range(rows.shape[1]):
                    matrix[r, c] = left * rows[0, c]
            else:
                for c in range(rows.shape[1]):
                    matrix[r, c] += left * rows[j, c]


@kernel_making_arrays
def assemble_level(listed, kinematics, stiffness, place, level, k, matrix):
    """Add what some interfaces contribute to the stiffness within level k.

    Parameters
    ----------
    listed : array of int
        The interfaces; parts of them that belong to other levels are left out.
    kinematics : NamedTuple of arrays
        Kinematics; see ``damagepred.solvers.quasi_static.interface_kinematics``.
    stiffness : array (m, 9)
        Of each interface.
    place : array of int (size,)
        Place of each degree of freedom in its level, -1 if it is held.
    level : array of int (size,)
        Level of each degree of freedom.
    matrix : array
        Of the level, added to, transposed.
    """
    width = kinematics.dof.shape[1]
    whole = np.empty((width, width))
    for i in listed:
        interface_stiffness(kinematics.rows[i], stiffness[i], whole)
        for r in range(width):
            row = kinematics.dof[i, r]
            if row < 0 or level[row] != k or place[row] < 0:
                continue
            for c in range(width):
                column = kinematics.dof[i, c]
                if column >= 0 and level[column] == k and place[column] >= 0:
                    matrix[place[column], place[row]] += whole[r, c]


@kernel_making_arrays
def assemble_couplings(bridges, far_is_b, kinematics, stiffness, up, down):
    """Fill the stiffness between the sides of bridging interfaces.

    Parameters
    ----------
    bridges : array of int (b,)
        Interfaces between neighbouring levels.
    far_is_b : array of bool (b,)
        Whether block b is the one farther from the ground, or a.
    up, down : array (b, w / 2, w / 2)
        Filled: force on the nearer side for displacements of the farther, and the other way round.
    """
    width = kinematics.dof.shape[1]
    side, whole = width // 2, np.empty((width, width))
    for e in range(bridges.size):
        i = bridges[e]
        interface_stiffness(kinematics.rows[i], stiffness[i], whole)
        at_far, at_near = (side, 0) if far_is_b[e] else (0, side)
        for r in range(side):
            for c in range(side):
                up[e, r, c] = whole[at_near + r, at_far + c]
                down[e, r, c] = whole[at_far + r, at_near + c]


@kernel
def schur_complement(listed, at_far, at_near, up, down, inverse, work, condensed):
    """Set ``condensed`` to what a level, eliminated, takes from the stiffness of the next level nearer to the ground.

    Parameters
    ----------
    listed : slice as (first, last)
        Bridges between the two levels.
    at_far, at_near : array of int (b, w / 2)
        Place of the degrees of freedom of a bridge's sides in their levels, -1 where held.
    up, down : array (b, w / 2, w / 2)
        See ``assemble_couplings``.
    inverse : array (size, size)
        Of the stiffness within the level, all that is farther having been eliminated; transposed.
    work : array (nearer size, size)
        Scratch.
    condensed : array (nearer size, nearer size)
        Filled, transposed.
    """
    first, last = listed
    side = at_far.shape[1]
    work[:] = 0.0
    for e in range(first, last):
        for r in range(side):
            if at_far[e, r] < 0:
                continue
            row = inverse[at_far[e, r]]
            for c in range(side):
                if at_near[e, c] >= 0:
                    add_row(down[e, r, c], row, work[at_near[e, c]])
    condensed[:] = 0.0
    for m in range(condensed.shape[0]):
        for e in range(first, last):
            for r in range(side):
                if at_near[e, r] < 0:
                    continue
                total = 0.0
                for c in range(side):
                    if at_far[e, c] >= 0:
                        total += up[e, r, c] * work[m, at_far[e, c]]
                condensed[m, at_near[e, r]] += total


@kernel
def mirror(half, whole):
    """Fill a symmetric matrix from its part above the diagonal, tile by tile."""
    size, tile = half.shape[0], 32
    for top in range(0, size, tile):
        for left in range(top, size, tile):
            for r in range(top, min(top + tile, size)):
                for c in range(max(left, r), min(left + tile, size)):
                    whole[r, c] = whole[c, r] = half[r, c]


@kernel
def farthest_unsymmetric(listed, level, stiffness):
    """Return the farthest level of an interface whose stiffness (m, 9) is not symmetric; -1 if all are."""
    farthest = -1
    for i in listed:
        row = stiffness[i]
        if row[1] != row[3] or row[2] != row[6] or row[5] != row[7]:
            farthest = max(farthest, level[i])
    return farthest


@law
def add_row(amount, row, total):
    """Add a row, times an amount, to another."""
    for j in range(row.size):
        total[j] += amount * row[j]


@law_making_arrays
def multiply(inverses, at, size, force, from_place, displacement, to_place):
    """Add what a level's (transposed) inverse makes of forces to displacements, one row after the other.

    Parameters
    ----------
    inverses, at, size
        Where the inverse begins, and its rows.
    force, from_place, displacement, to_place
        Arrays (r, ...) and where in their rows the level begins.
    """
    inverse = inverses[at : at + size * size].reshape((size, size))
    few = force.shape[0]
    if few > FEW:
        together = np.dot(np.ascontiguousarray(force[:, from_place : from_place + size]), inverse)
        for j in range(few):
            add_row(1.0, together[j], displacement[j][to_place : to_place + size])
    elif few == 1:
        add_row(
            1.0, np.dot(force[0][from_place : from_place + size], inverse), displacement[0][to_place : to_place + size]
        )
    else:
        multiply_few(inverse, force, from_place, displacement, to_place)


@law
def multiply_few(inverse, force, from_place, displacement, to_place):
    """Do what ``multiply`` does for a few rows: each part of the inverse is fetched once for all of them."""
    size, rest = inverse.shape[0], inverse.shape[0] % 4
    for i in range(0, size - rest, 4):
        first, second, third, fourth = inverse[i], inverse[i + 1], inverse[i + 2], inverse[i + 3]
        for j in range(force.shape[0]):
            a, b = force[j, from_place + i], force[j, from_place + i + 1]
            c, d = force[j, from_place + i + 2], force[j, from_place + i + 3]
            total = displacement[j][to_place : to_place + size]
            for k in range(size):
                total[k] += a * first[k] + b * second[k] + c * third[k] + d * fourth[k]
    for i in range(size - rest, size):
        for j in range(force.shape[0]):
            add_row(force[j, from_place + i], inverse[i], displacement[j][to_place : to_place + size])


@law
def subtract_coupling(first, last, at_here, at_there, coupling, displacement, there, force, here):
    """Subtract from the forces of one level what the displacements of its neighbour make there.

    Parameters
    ----------
    displacement, there, force, here
        Arrays (r, ...) and where in their rows the levels begin.
    """
    if at_here.shape[1] == 3:  # known when compiling, the loops over it are written out
        subtract_coupling_sides(3, first, last, at_here, at_there, coupling, displacement, there, force, here)
    else:
        subtract_coupling_sides(
            at_here.shape[1], first, last, at_here, at_there, coupling, displacement, there, force, here
        )


@law
def subtract_coupling_sides(side, first, last, at_here, at_there, coupling, displacement, there, force, here):
    """Do what ``subtract_coupling`` does, with that many degrees of freedom of a side."""
    for e in range(first, last):
        for r in range(side):
            if at_here[e, r] < 0:
                continue
            for c in range(side):
                if at_there[e, c] < 0:
                    continue
                for j in range(force.shape[0]):
                    force[j, here + at_here[e, r]] -= coupling[e, r, c] * displacement[j, there + at_there[e, c]]


@kernel_making_arrays
def forward_elimination(start, inverses, at_inverse, first_bridge, at_far, at_near, up, last, force, particular):
    """Eliminate levels from the farthest to ``last``: which forces come down, and where they would hang by themselves.

    Parameters
    ----------
    start : array of int (levels + 1,)
        Where each level starts in the order of the levels.
    inverses, at_inverse : array
        Inverse of each level's stiffness, transposed, one after the other, row by row; and where each begins.
    first_bridge : array of int
        Bridges between levels k and k - 1 are ``first_bridge[k]`` to ``first_bridge[k + 1]``.
    at_far, at_near, up
        See ``schur_complement``.
    last : int
        The last level to be eliminated.
    force : array (r, degrees of freedom)
        In the order of the levels; the force that comes down is added to the next level.
    particular : array (r, degrees of freedom)
        Zeros; filled with the displacement with all nearer levels held.
    """
    for k in range(start.size - 2, last - 1, -1):
        a = start[k]
        multiply(inverses, at_inverse[k], start[k + 1] - a, force, a, particular, a)
        if k > 0:
            subtract_coupling(
                first_bridge[k], first_bridge[k + 1], at_near, at_far, up, particular, a, force, start[k - 1]
            )


@kernel_making_arrays
def back_substitution(
    start, inverses, at_inverse, first_bridge, at_far, at_near, down, first, load, particular, displacement
):
    """Fill the displacements of levels ``first`` and beyond from those of the nearer ones.

    Parameters
    ----------
    start, inverses, at_inverse, first_bridge, at_far, at_near, down
        See ``forward_elimination``.
    load : float
        Share of the forces that made ``particular``.
    particular, displacement : array (r, degrees of freedom)
        In the order of the levels.
    """
    pull = np.empty_like(displacement)
    for k in range(first, start.size - 1):
        a, b = start[k], start[k + 1]
        for j in range(displacement.shape[0]):
            for i in range(a, b):
                displacement[j, i] = load * particular[j, i]
                pull[j, i] = 0.0
        subtract_coupling(
            first_bridge[k], first_bridge[k + 1], at_far, at_near, down, displacement, start[k - 1], pull, a
        )
        multiply(inverses, at_inverse[k], b - a, pull, a, displacement, a)


@kernel_making_arrays
def solve_rows(start, inverses, at_inverse, first_bridge, at_far, at_near, up, down, farthest, force, particular):
    """Solve for rows of forces (r, degrees of freedom): forward elimination, then back substitution.

    Beyond the level ``farthest`` there are no forces; ``particular`` is zero.
    """
    forward_elimination(
        start[: farthest + 2], inverses, at_inverse, first_bridge, at_far, at_near, up, 0, force, particular
    )
    for j in range(force.shape[0]):
        for i in range(start[1]):
            force[j, i] = particular[j, i]
    back_substitution(start, inverses, at_inverse, first_bridge, at_far, at_near, down, 1, 1.0, particular, force)


@kernel_making_arrays
def solve_columns(start, inverses, at_inverse, first_bridge, at_far, at_near, up, down, farthest, force, particular):
    """Turn many forces, side by side, into displacements; what ``solve_rows`` does for few, one below the other.

    Parameters
    ----------
    farthest : int
        Level beyond which there are no forces.
    force, particular : array (degrees of freedom, r)
        Forces, which become displacements; scratch of the same shape.
    """
    levels = start.size - 1
    for k in range(farthest, -1, -1):
        a, b = start[k], start[k + 1]
        inverse = inverses[at_inverse[k] : at_inverse[k + 1]].reshape((b - a, b - a))
        np.dot(inverse.T, force[a:b], particular[a:b])
        if k > 0:
            subtract_coupling_columns(
                first_bridge[k], first_bridge[k + 1], at_near, at_far, up, particular[a:b], force[start[k - 1] : a]
            )
    force[: start[1]] = particular[: start[1]]
    for k in range(1, levels):
        a, b = start[k], start[k + 1]
        inverse = inverses[at_inverse[k] : at_inverse[k + 1]].reshape((b - a, b - a))
        pull = np.zeros((b - a, force.shape[1]))
        subtract_coupling_columns(
            first_bridge[k], first_bridge[k + 1], at_far, at_near, down, force[start[k - 1] : a], pull
        )
        np.dot(inverse.T, pull, force[a:b])
        if k <= farthest:
            for i in range(a, b):
                add_row(1.0, particular[i], force[i])


@law
def subtract_coupling_columns(first, last, at_here, at_there, coupling, displacement, force):
    """Do what ``subtract_coupling`` does, for arrays (degrees of freedom of a level, r)."""
    side = at_here.shape[1]
    for e in range(first, last):
        for r in range(side):
            if at_here[e, r] < 0:
                continue
            row = force[at_here[e, r]]
            for c in range(side):
                if at_there[e, c] >= 0:
                    add_row(-coupling[e, r, c], displacement[at_there[e, c]], row)


@kernel
def unit_loads(listed, kinematics, order, force):
    """Add the kinematics of interfaces as unit forces, side by side.

    Parameters
    ----------
    listed : array of int
        The interfaces, three columns each.
    kinematics : NamedTuple of arrays
        Kinematics.
    order : array of int (size,)
        Place of each degree of freedom in the order of the levels, -1 where held or not in play.
    force : array (degrees of freedom in play, 3 * listed)
        Added to.
    """
    for s in range(listed.size):
        i = listed[s]
        for r in range(kinematics.dof.shape[1]):
            dof = kinematics.dof[i, r]
            if dof >= 0 and order[dof] >= 0:
                for j in range(3):
                    force[order[dof], 3 * s + j] += kinematics.rows[i, j, r]


@kernel
def relative_displacements(listed, kinematics, order, displacement, relative):
    """Fill opening, shear and rotation of interfaces for displacements.

    Parameters
    ----------
    listed, ties, order
        As ``unit_loads``.
    displacement : array (r, degrees of freedom in play)
        Rows of displacements in the order of the levels.
    relative : array (3 * listed, r)
        Filled.
    """
    relative[:] = 0.0
    for s in range(listed.size):
        i = listed[s]
        for r in range(kinematics.dof.shape[1]):
            dof = kinematics.dof[i, r]
            if dof < 0 or order[dof] < 0:
                continue
            for j in range(3):
                for m in range(displacement.shape[0]):
                    relative[3 * s + j, m] += kinematics.rows[i, j, r] * displacement[m, order[dof]]


@kernel
def copy_rows(listed, source, target):
    """Copy some rows of an array (m, 9) to another."""
    for i in listed:
        for j in range(9):
            target[i, j] = source[i, j]


@kernel_making_arrays
def changed_interfaces(active, wanted, factorised, slot):
    """Return the active interfaces whose stiffness is not as it was factorised, and how many of them have no slot yet.

    Parameters
    ----------
    active : array of int
        Interfaces to look at.
    wanted, factorised : array (m, 9)
        Stiffness of each interface.
    slot : array of int (m,)
        Where the answer of the wall to forces in an interface is kept, -1 if it is not.
    """
    changed, count, new = np.empty(active.size, np.int64), 0, 0
    for i in active:
        for j in range(9):
            if wanted[i, j] != factorised[i, j]:
                changed[count] = i
                count += 1
                if slot[i] < 0:
                    new += 1
                break
    return changed[:count], new


@kernel_making_arrays
def capacitance_matrix(compliance, slots, change):
    """Return which forces of changed interfaces the change makes, and the matrix that these follow from.

    With a change D of the stiffness and the compliance C, displacements x without the change make forces
    p = D (x - C p) with it, so (1 + D C) p = D x. Rows of D without entries make no force and are left out: a joint
    that slides changes its shear force alone.

    Parameters
    ----------
    compliance : array
        Relative displacements of interfaces for unit forces in them.
    slots : array of int (s,)
        Those that change: rows and columns 3 slot to 3 slot + 2 of the compliance.
    change : array (s, 9)
        Change of the stiffness of each.

    Returns
    -------
    rows : array of int (p,)
        3 s + j: opening (0), shear (1) or rotation (2) of changed interface s.
    matrix : array (p, p)
        Transposed.
    """
    rows, count = np.empty(3 * slots.size, np.int64), 0
    for s in range(slots.size):
        for j in range(3):
            if change[s, 3 * j] != 0.0 or change[s, 3 * j + 1] != 0.0 or change[s, 3 * j + 2] != 0.0:
                rows[count] = 3 * s + j
                count += 1
    rows = rows[:count]
    columns, matrix = np.empty(count, np.int64), np.empty((count, count))
    for c in range(count):
        columns[c] = 3 * slots[rows[c] // 3] + rows[c] % 3
    for r in range(count):
        s, j = rows[r] // 3, rows[r] % 3
        first = compliance[3 * slots[s]]
        second, third = compliance[3 * slots[s] + 1], compliance[3 * slots[s] + 2]
        a, b, d = change[s, 3 * j], change[s, 3 * j + 1], change[s, 3 * j + 2]
        for c in range(count):
            k = columns[c]
            matrix[c, r] = a * first[k] + b * second[k] + d * third[k]
        matrix[r, r] += 1.0
    return rows, matrix


@kernel
def correction_forces(rows, change, moved, force):
    """Fill the forces (r, p) that a change of stiffness makes of relative displacements (3 s, r) of its interfaces."""
    for c in range(rows.size):
        s, j = rows[c] // 3, rows[c] % 3
        for m in range(force.shape[0]):
            total = 0.0
            for k in range(3):
                total += change[s, 3 * j + k] * moved[3 * s + k, m]
            force[m, c] = total


@kernel_making_arrays
def correction_agrees(rows, change, moved, force, share):
    """Whether forces (r, p) equal those of ``correction_forces`` at the result, to a share of the largest of a row."""
    again = np.empty_like(force)
    correction_forces(rows, change, moved, again)
    for m in range(force.shape[0]):
        largest, apart = 0.0, 0.0
        for c in range(rows.size):
            difference = abs(again[m, c] - force[m, c])
            if not difference < np.inf:
                return False
            largest, apart = max(largest, abs(force[m, c])), max(apart, difference)
        if apart > share * largest:
            return False
    return True


@kernel
def subtract_correction(amounts, rows, slots, unit_load_response, displacement):
    """Subtract the response to forces (r, p) in changed interfaces from displacements (r, ...)."""
    for m in range(displacement.shape[0]):
        for c in range(rows.size):
            add_row(-amounts[m, c], unit_load_response[3 * slots[rows[c] // 3] + rows[c] % 3], displacement[m])
