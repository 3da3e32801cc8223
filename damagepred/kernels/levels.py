"""Block tridiagonal stiffness of levels of blocks: making it, passing it on, and solving with it.

Matrices of a level stand here transposed: what the inverse makes of a displacement is then a sum of its rows, which the
compiler works on many numbers at a time.

Kinematics of interface i are three rows (opening, shear, relative rotation) over the degrees of freedom of its two
sides, w in all: three of a rigid block, or x and y of the two gridpoints at the ends of a facet. Its stiffness is a 3 x
3 matrix between them, not symmetric where sliding joints dilate less than they rub.
"""

import numpy as np

from damagepred.kernels.jit import kernel, law


@law
def between_sides(rows, stiffness, matrix):
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


@kernel
def add_within(listed, ties, stiffness, place, level, k, matrix):
    """Add what some interfaces contribute to the stiffness within level k.

    Parameters
    ----------
    listed : array of int
        The interfaces; parts of them that belong to other levels are left out.
    ties : NamedTuple of arrays
        Kinematics; see ``damagepred.solvers.quasi_static.ties``.
    stiffness : array (m, 9)
        Of each interface.
    place : array of int (size,)
        Place of each degree of freedom in its level, -1 if it is held.
    level : array of int (size,)
        Level of each degree of freedom.
    matrix : array
        Of the level, added to, transposed.
    """
    width = ties.dof.shape[1]
    whole = np.empty((width, width))
    for i in listed:
        between_sides(ties.rows[i], stiffness[i], whole)
        for r in range(width):
            row = ties.dof[i, r]
            if row < 0 or level[row] != k or place[row] < 0:
                continue
            for c in range(width):
                column = ties.dof[i, c]
                if column >= 0 and level[column] == k and place[column] >= 0:
                    matrix[place[column], place[row]] += whole[r, c]


@kernel
def couplings(bridges, far_is_b, ties, stiffness, up, down):
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
    width = ties.dof.shape[1]
    side, whole = width // 2, np.empty((width, width))
    for e in range(bridges.size):
        i = bridges[e]
        between_sides(ties.rows[i], stiffness[i], whole)
        at_far, at_near = (side, 0) if far_is_b[e] else (0, side)
        for r in range(side):
            for c in range(side):
                up[e, r, c] = whole[at_near + r, at_far + c]
                down[e, r, c] = whole[at_far + r, at_near + c]


@kernel
def pass_on(listed, at_far, at_near, up, down, inverse, work, condensed):
    """Set ``condensed`` to what a level, eliminated, takes from the stiffness of the next level nearer to the ground.

    Parameters
    ----------
    listed : slice as (first, last)
        Bridges between the two levels.
    at_far, at_near : array of int (b, w / 2)
        Place of the degrees of freedom of a bridge's sides in their levels, -1 where held.
    up, down : array (b, w / 2, w / 2)
        See ``couplings``.
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


@law
def add_row(amount, row, total):
    """Add a row, times an amount, to another."""
    for j in range(row.size):
        total[j] += amount * row[j]


@law
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
    for j in range(force.shape[0]):
        add_row(
            1.0, np.dot(force[j][from_place : from_place + size], inverse), displacement[j][to_place : to_place + size]
        )


@law
def push(first, last, at_here, at_there, coupling, displacement, there, force, here):
    """Subtract from the forces of one level what the displacements of its neighbour make there.

    Parameters
    ----------
    displacement, there, force, here
        Arrays (r, ...) and where in their rows the levels begin.
    """
    if at_here.shape[1] == 3:  # known when compiling, the loops over it are written out
        push_sides(3, first, last, at_here, at_there, coupling, displacement, there, force, here)
    else:
        push_sides(at_here.shape[1], first, last, at_here, at_there, coupling, displacement, there, force, here)


@law
def push_sides(side, first, last, at_here, at_there, coupling, displacement, there, force, here):
    """Do what ``push`` does, with that many degrees of freedom of a side."""
    for e in range(first, last):
        for r in range(side):
            if at_here[e, r] < 0:
                continue
            for c in range(side):
                if at_there[e, c] < 0:
                    continue
                for j in range(force.shape[0]):
                    force[j, here + at_here[e, r]] -= coupling[e, r, c] * displacement[j, there + at_there[e, c]]


@kernel
def hang(start, inverses, at_inverse, first_bridge, at_far, at_near, up, last, force, hanging):
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
        See ``pass_on``.
    last : int
        The last level to be eliminated.
    force : array (r, degrees of freedom)
        In the order of the levels; the force that comes down is added to the next level.
    hanging : array (r, degrees of freedom)
        Zeros; filled with the displacement with all nearer levels held.
    """
    for k in range(start.size - 2, last - 1, -1):
        a = start[k]
        multiply(inverses, at_inverse[k], start[k + 1] - a, force, a, hanging, a)
        if k > 0:
            push(first_bridge[k], first_bridge[k + 1], at_near, at_far, up, hanging, a, force, start[k - 1])


@kernel
def reach(start, inverses, at_inverse, first_bridge, at_far, at_near, down, first, load, hanging, displacement):
    """Fill the displacements of levels ``first`` and beyond from those of the nearer ones.

    Parameters
    ----------
    start, inverses, at_inverse, first_bridge, at_far, at_near, down
        See ``hang``.
    load : float
        Share of the forces that made ``hanging``.
    hanging, displacement : array (r, degrees of freedom)
        In the order of the levels.
    """
    pull = np.empty_like(displacement)
    for k in range(first, start.size - 1):
        a, b = start[k], start[k + 1]
        for j in range(displacement.shape[0]):
            for i in range(a, b):
                displacement[j, i] = load * hanging[j, i]
                pull[j, i] = 0.0
        push(first_bridge[k], first_bridge[k + 1], at_far, at_near, down, displacement, start[k - 1], pull, a)
        multiply(inverses, at_inverse[k], b - a, pull, a, displacement, a)


@kernel
def sweep(start, inverses, at_inverse, first_bridge, at_far, at_near, up, down, force, hanging):
    """Turn forces (r, degrees of freedom) into displacements: levels from far to near, and back; see ``hang``."""
    hang(start, inverses, at_inverse, first_bridge, at_far, at_near, up, 0, force, hanging)
    for j in range(force.shape[0]):
        for i in range(start[1]):
            force[j, i] = hanging[j, i]
    reach(start, inverses, at_inverse, first_bridge, at_far, at_near, down, 1, 1.0, hanging, force)


@kernel
def loose_springs(listed, ties, order, rows_of_force):
    """Add the kinematics of interfaces as rows of unit forces.

    Parameters
    ----------
    listed : array of int
        The interfaces, three rows each.
    ties : NamedTuple of arrays
        Kinematics.
    order : array of int (size,)
        Place of each degree of freedom in the order of the levels, -1 where held or not in play.
    rows_of_force : array (3 * listed, degrees of freedom in play)
        Added to.
    """
    for s in range(listed.size):
        i = listed[s]
        for r in range(ties.dof.shape[1]):
            dof = ties.dof[i, r]
            if dof >= 0 and order[dof] >= 0:
                for j in range(3):
                    rows_of_force[3 * s + j, order[dof]] += ties.rows[i, j, r]


@kernel
def relative_displacements(listed, ties, order, displacement, relative):
    """Fill opening, shear and rotation of interfaces for displacements.

    Parameters
    ----------
    listed, ties, order
        As ``loose_springs``.
    displacement : array (r, degrees of freedom in play)
        Rows of displacements in the order of the levels.
    relative : array (3 * listed, r)
        Filled.
    """
    relative[:] = 0.0
    for s in range(listed.size):
        i = listed[s]
        for r in range(ties.dof.shape[1]):
            dof = ties.dof[i, r]
            if dof < 0 or order[dof] < 0:
                continue
            for j in range(3):
                for m in range(displacement.shape[0]):
                    relative[3 * s + j, m] += ties.rows[i, j, r] * displacement[m, order[dof]]


@kernel
def take_away(amounts, slots, rows, vector):
    """Subtract rows 3 s, 3 s + 1 and 3 s + 2 of ``rows``, times ``amounts``, from a vector, for all slots s."""
    for s in range(slots.size):
        for j in range(3):
            amount, row = amounts[3 * s + j], rows[3 * slots[s] + j]
            for i in range(vector.size):
                vector[i] -= amount * row[i]


@kernel
def with_changes(compliance, slots, change, matrix):
    """Set ``matrix`` to 1 + compliance times the changes of stiffness.

    Parameters
    ----------
    compliance : array
        Relative displacements of interfaces for unit forces in them.
    slots : array of int (s,)
        Those that change: rows and columns 3 slot to 3 slot + 2 of the compliance.
    change : array (s, 9)
        Change of the stiffness of each.
    matrix : array (3 s, 3 s)
        Filled.
    """
    for r in range(matrix.shape[0]):
        row = compliance[3 * slots[r // 3] + r % 3]
        for s in range(slots.size):
            for c in range(3):
                total = 0.0
                for j in range(3):
                    total += row[3 * slots[s] + j] * change[s, 3 * j + c]
                matrix[r, 3 * s + c] = total
        matrix[r, r] += 1.0
