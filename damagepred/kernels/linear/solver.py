"""Solution of the tangent equations: the last factorisation, corrected for few changes, or a new one."""

from numba import types

from damagepred.kernels.jit import kernel, law, phase
from damagepred.kernels.linear.correction import CORRECT, RESPOND, Correction, discard_responses
from damagepred.kernels.linear.factors import ELIMINATE
from damagepred.kernels.linear.substitution import Substitution, solve_factorised
from damagepred.kernels.structures import FLAGS, FLOAT_ROWS, FLOATS, INTEGERS, Structure

ITERATIONS, FACTORISATIONS, CORRECTIONS = 0, 1, 2
"""Places in ``Solver.counts``."""

CALL_OVERHEAD = 2.3e5
"""Cost of a batch of unit-load responses, whatever its size (operations). Only ratios of these costs count."""
RESPONSE_WEIGHT, SOLUTION_WEIGHT, VECTOR_WEIGHT = 140.0, 420.0, 5.0
"""Operations per degree of freedom of a unit-load response beside its products, per entry of the capacitance equations,
and per entry in sums of vectors."""

REFACTORISATION_RATIO = 1.5
"""Cost of all corrections since the last factorisation over the cost of a new one, from which a new one is made (1)."""
RESPONSE_BATCH = 96
"""Unit loads whose responses are computed at a time."""


class Solver(Structure):
    """Linear solver: factors of the active fronts, and their corrections; ``MultifrontalSystem.activate`` makes it."""

    substitution = Substitution.kind
    correction = Correction.kind
    factorisation_cost = FLOATS
    solution_cost = types.float64
    spent = types.float64
    """Operations for each front, for one solution, and for all corrections since the last factorisation: of matrix
    products, others weighted by how slow they are."""
    active = INTEGERS
    active_dofs = INTEGERS
    """Interfaces and degrees of freedom of active fronts."""
    target = FLOAT_ROWS
    """Stiffness of the interfaces in the next solution (m, 9)."""
    changed = INTEGERS
    """Room for interfaces whose stiffness differs from the factorised one."""
    new = INTEGERS
    """Room for unit loads of their changed rows without response, 3 i + j."""
    right = FLOAT_ROWS
    """Right-hand sides in the order of the fronts, which become solutions."""
    stale = FLAGS
    """Fronts that the next factorisation must eliminate: newly active fronts, and fronts of yielding blocks."""
    must_factorise = FLAGS
    """Whether the next solution needs a factorisation: one entry, which Python may set."""
    counts = INTEGERS
    """Number of iterations, factorisations and corrections."""
    eliminate = types.FunctionType(ELIMINATE)
    respond = types.FunctionType(RESPOND)
    correct = types.FunctionType(CORRECT)


@law
def _list_changed(solver, stiffness):
    """List in ``changed`` the active interfaces whose stiffness differs from the factorised one; set the target.

    Returns the numbers of changed interfaces, changed rows, rows without response, and interfaces without any.
    """
    count, new, rows, unknown = 0, 0, 0, 0
    changed, listed, target = solver.changed, solver.new, solver.target
    slot, load_slot = solver.correction.slot, solver.correction.load_slot
    factorised = solver.substitution.factors.stiffness
    for i in solver.active:
        same = True
        for j in range(9):
            same &= stiffness[i, j] == factorised[i, j]
            target[i, j] = stiffness[i, j]
        if same:
            continue
        changed[count] = i
        count += 1
        for j in range(3):
            differs = False
            for k in range(3 * j, 3 * j + 3):
                differs |= stiffness[i, k] != factorised[i, k]
            rows += differs
            if differs and load_slot[i, j] < 0:
                listed[new] = 3 * i + j
                new += 1
        unknown += slot[i] < 0
    return count, rows, new, unknown


@law
def correction_cost(solution_cost, size, rows, new):
    """Weighted operations of a correction of ``size`` degrees of freedom.

    Each changed row of the stiffness has a correction force; unit loads without response take one solution each.
    """
    forces, cost = float(rows), 0.0
    if new > 0:
        cost = CALL_OVERHEAD + float(new) * (solution_cost + RESPONSE_WEIGHT * size)
    return cost + VECTOR_WEIGHT * forces * size + SOLUTION_WEIGHT * forces * forces


@law
def _mark_outdated(solver, changed):
    """Mark the fronts of changed interfaces, stale ones, and their ancestors; the cost of eliminating them."""
    factors, stale, costs, total = solver.substitution.factors, solver.stale, solver.factorisation_cost, 0.0
    outdated, front, parent = factors.outdated, factors.tree.interface_front, factors.tree.parent
    outdated[:] = stale
    for i in changed:
        if front[i] >= 0:
            outdated[front[i]] = True
    for k in range(outdated.size - 1, -1, -1):
        if outdated[k]:
            total += costs[k]
            if parent[k] >= 0:
                outdated[parent[k]] = True
    return total


@law
def _refactorisation_pays(solver, changed, rows, new, unknown):
    """Whether corrections since the last factorisation would cost more than a new one, or take too much memory.

    That costs at most a fixed multiple of the best choice in hindsight (ski rental; Karlin et al. 1988).
    """
    if changed.size == 0:
        return False
    correction, size = solver.correction, float(solver.active_dofs.size)
    if correction.occupied + unknown > correction.interface_of_slot.size:
        return True
    solver.spent += correction_cost(solver.solution_cost, size, rows, new)
    return solver.spent > REFACTORISATION_RATIO * _mark_outdated(solver, changed)


@law
def _factorise(solver, changed):
    """Factorise with the target stiffness of changed interfaces."""
    factors, stale = solver.substitution.factors, solver.stale
    discard_responses(solver.correction)  # corrections of a new factorisation differ
    _mark_outdated(solver, changed)
    solver.counts[FACTORISATIONS] += 1
    solver.eliminate(factors, changed, solver.target, factors.complements, False)
    stale[:] = False
    solver.must_factorise[0], solver.spent = False, 0.0


@law
def _solve_all(solver, force, right):
    """Solve with the present factors: copy ``force`` to ``right`` in the order of the fronts, and solve in place."""
    reached, dofs = solver.substitution.rows.reached, solver.active_dofs
    reached[:] = True
    for m in range(force.shape[0]):
        for j in range(dofs.size):
            right[m, j] = force[m, dofs[j]]
    solve_factorised(solver.substitution, right)


@law
def _correct(solver, changed, new, right):
    """Compute missing responses, and correct the solutions ``right``; whether the correction is accurate."""
    correction, substitution = solver.correction, solver.substitution
    for first in range(0, new.size, RESPONSE_BATCH):
        solver.respond(correction, substitution, new[first : min(first + RESPONSE_BATCH, new.size)])
    return solver.correct(correction, substitution, changed, solver.target, right)


SOLVE_TANGENT = types.void(Solver.kind, FLOAT_ROWS, FLOAT_ROWS, FLOAT_ROWS)


@phase(SOLVE_TANGENT)
def solve_tangent(solver, stiffness, force, displacement):
    """Solve the tangent equations for rows of forces; displacements are 0 where prescribed or condensed.

    Where ``stiffness`` (m, 9) differs from the factorised one, solutions are corrected or fronts factorised again.
    """
    count, rows, new, unknown = _list_changed(solver, stiffness)
    changed, right = solver.changed[:count], solver.right[: force.shape[0]]
    if solver.must_factorise[0] or _refactorisation_pays(solver, changed, rows, new, unknown):
        _factorise(solver, changed)
        count = 0
    _solve_all(solver, force, right)
    if count > 0:
        if _correct(solver, changed, solver.new[:new], right):
            solver.counts[CORRECTIONS] += 1
        else:
            _factorise(solver, changed)
            _solve_all(solver, force, right)
    dofs = solver.active_dofs
    displacement[:] = 0.0
    for m in range(force.shape[0]):
        for j in range(dofs.size):
            displacement[m, dofs[j]] = right[m, j]


class TangentSolution(Structure):
    """The function ``solve_tangent``, for calls from Python."""

    solve = types.FunctionType(SOLVE_TANGENT)


@kernel
def solve_from_python(solution, solver, stiffness, force, displacement):
    """Solve the tangent equations; see ``solve_tangent``."""
    solution.solve(solver, stiffness, force, displacement)


@kernel
def eliminate_outdated(solver, changed, complements, elastic):
    """Eliminate the outdated fronts; see ``damagepred.kernels.linear.factors.eliminate``."""
    return solver.eliminate(solver.substitution.factors, changed, solver.target, complements, elastic)
