"""Solution of the tangent equations: the last factorisation, corrected for few changes, or a new one."""

from damagepred.kernels.jit import Unit, law
from damagepred.kernels.linear.table import system_at
from damagepred.kernels.linear.woodbury import solve_factorised
from damagepred.kernels.table import float_rows, floats, integers, part, run


@law
def _list_changed(system):
    """List the interfaces whose stiffness differs from the factorised one, and those of them without responses.

    Return their numbers, and the farthest level of one.
    """
    count, farthest, changed, level = 0, -1, integers(system.changed), integers(system.interface_level)
    factorised, target, wanted = float_rows(system.stiffness), float_rows(system.target), float_rows(system.wanted)
    listed, slot, new = integers(system.new), integers(system.slot), 0
    for i in integers(system.active):
        differs = False
        for j in range(9):
            target[i, j] = wanted[i, j]
            differs |= wanted[i, j] != factorised[i, j]
        if differs:
            changed[count] = i
            count += 1
            farthest = max(farthest, level[i])
            if slot[i] < 0:
                listed[new] = i
                new += 1
    return count, new, farthest


@law
def correction_cost(system, changed, new):
    """Return the cost of a Woodbury correction (weighted operations).

    Parameters
    ----------
    system : SYSTEM
        The tangent equations.
    changed, new : int
        Changed interfaces, two correction forces p each, and those of them without unit-load responses: three
        solutions each, of 4 operations for the square of the size of each level.
    """
    forces, levels, cost = float(2 * changed), system.active_levels, 0.0
    size, squares = floats(system.level_sizes)[levels], floats(system.level_squares)[levels]
    if new > 0:
        cost = system.call_overhead + system.product_weight * float(12 * new) * squares
    cost += system.solution_weight * 2.0 / 3.0 * forces * forces * forces
    return cost + system.vector_weight * forces * (5.0 * forces + 2.0 * size)


@law
def _refactorisation_pays(system, changed, new, farthest):
    """Whether changes exceed the memory for them, or all corrections would cost more than a factorisation.

    Ski rental: number and size of later changes are unknown; this rule costs at most twice the best in hindsight.
    """
    if changed == 0:
        return False
    if system.occupied + new > integers(system.interface_of_slot).size:
        return True
    system.spent += correction_cost(system, changed, new)
    return system.spent > floats(system.factorisation_cost)[farthest + 1]


@law
def _discard_responses(system):
    """Discard all unit-load responses."""
    slot, interface_of_slot = integers(system.slot), integers(system.interface_of_slot)
    for s in range(system.occupied):
        slot[interface_of_slot[s]] = -1
    system.occupied = 0


@law
def _factorise(system, count, farthest):
    """Factorise with the target stiffness of the listed interfaces."""
    _discard_responses(system)  # those of a new factorisation differ
    farthest = max(farthest, system.farthest_changed)
    if system.keep_farther_levels == 0:
        farthest = system.active_levels - 1
    system.farthest_changed, system.spent = -1, 0.0
    if farthest >= 0:
        system.factorisations += 1
        system.farthest, system.nearest, system.elastic, system.changed_count = farthest, 0, 0, count
        run(system.eliminate, system.here)


@law
def _gather(system, right):
    """Gather the right-hand sides in the order of the levels."""
    dofs, force = integers(system.active_dofs), float_rows(system.right)
    for m in range(system.row_count):
        for j in range(dofs.size):
            right[m, j] = force[m, dofs[j]]


@law
def _correct(system, count, new):
    """Correct the solution for the changed interfaces; return whether that is accurate."""
    for first in range(0, new, system.batch):
        system.first_new, system.last_new = first, min(first + system.batch, new)
        run(system.respond, system.here)
    system.changed_count = count
    run(system.correct, system.here)
    return system.accurate != 0


@Unit
def solve_tangent(address):
    """Solve the tangent equations with the stiffness ``wanted`` for the rows of ``right``; fill ``solution``.

    The solutions are 0 where prescribed or condensed.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations; their factors are corrected or made anew.
    """
    system = system_at(address)
    count, new, farthest = _list_changed(system)
    if system.farthest_changed >= 0 or _refactorisation_pays(system, count, new, farthest):
        _factorise(system, count, farthest)
        count = 0
    right, last = part(float_rows(system.rows), 0, system.row_count), system.active_levels - 1
    _gather(system, right)
    solve_factorised(system, right, last)
    if count > 0:
        if _correct(system, count, new):
            system.corrections += 1
        else:
            _factorise(system, count, farthest)
            _gather(system, right)
            solve_factorised(system, right, last)
    if system.keep_responses == 0:
        _discard_responses(system)
    solution, dofs = float_rows(system.solution), integers(system.active_dofs)
    for m in range(system.row_count):
        for i in range(solution.shape[1]):
            solution[m, i] = 0.0
        for j in range(dofs.size):
            solution[m, dofs[j]] = right[m, j]
