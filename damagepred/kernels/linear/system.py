"""Solution of the tangent equations: the last factorisation, corrected for few changes, or a new one."""

from damagepred.kernels.jit import Unit, law
from damagepred.kernels.linear.table import system_at
from damagepred.kernels.linear.woodbury import solve_factorised
from damagepred.kernels.table import flags, float_rows, floats, integer_rows, integers, part, run


@law
def _list_changed(system):
    """List the interfaces whose stiffness differs from the factorised one, and unit loads that have no response yet.

    Return their numbers, that of the rows that differ, and that of listed interfaces without any response.
    """
    count, new, rows, unknown = 0, 0, 0, 0
    changed, listed = integers(system.changed), integers(system.new)
    slot, load_slot = integers(system.slot), integer_rows(system.load_slot)
    factorised, target, wanted = float_rows(system.stiffness), float_rows(system.target), float_rows(system.wanted)
    for i in integers(system.active):
        same = True
        for j in range(9):
            same &= wanted[i, j] == factorised[i, j]
        if same:
            continue
        differing = 0
        for j in range(3):
            differs = False
            for k in range(3 * j, 3 * j + 3):
                target[i, k] = wanted[i, k]
                differs |= wanted[i, k] != factorised[i, k]
            if differs:
                differing += 1
                if load_slot[i, j] < 0:
                    listed[new] = 3 * i + j
                    new += 1
        if differing > 0:
            changed[count] = i
            count += 1
            rows += differing
            unknown += slot[i] < 0
    return count, rows, new, unknown


@law
def correction_cost(system, rows, new):
    """Return the cost of a Woodbury correction (weighted operations).

    Parameters
    ----------
    system : SYSTEM
        The tangent equations.
    rows, new : int
        Changed rows of the stiffness of the interfaces, each with a correction force, and the unit loads of them that
        have no response yet: one solution each.
    """
    forces, size, cost = float(rows), float(integers(system.active_dofs).size), 0.0
    if new > 0:
        response = system.product_weight * system.solution_operations + system.response_weight * size
        cost = system.call_overhead + float(new) * response
    return cost + system.vector_weight * forces * size + system.solution_weight * forces * forces


@law
def _mark_outdated(system, count):
    """Mark the fronts of changed interfaces, stale ones, and their ancestors; return the cost of eliminating them."""
    outdated, stale, front = flags(system.outdated), flags(system.stale), integers(system.interface_front)
    parent, costs, total = integers(system.parent), floats(system.factorisation_cost), 0.0
    for k in range(outdated.size):
        outdated[k] = stale[k]
    if system.keep_unchanged_fronts == 0:
        for k in integers(system.fronts):
            outdated[k] = True
    for i in integers(system.changed)[:count]:
        if front[i] >= 0:
            outdated[front[i]] = True
    for k in range(outdated.size - 1, -1, -1):
        if outdated[k]:
            total += costs[k]
            if parent[k] >= 0:
                outdated[parent[k]] = True
    return total


@law
def _refactorisation_pays(system, changed, rows, new, unknown):
    """Whether changes exceed the memory for them, or all corrections would cost a multiple of a factorisation.

    Ski rental: number and size of later changes are unknown; a multiple of 1 costs at most twice the best in hindsight.
    A factorisation also discards the unit-load responses, of which later changes would have used some.
    """
    if changed == 0:
        return False
    if system.occupied + unknown > integers(system.interface_of_slot).size:
        return True
    system.spent += correction_cost(system, rows, new)
    return system.spent > system.refactorisation_ratio * _mark_outdated(system, changed)


@law
def _discard_responses(system):
    """Discard all unit-load responses."""
    slot, interface_of_slot = integers(system.slot), integers(system.interface_of_slot)
    load_slot = integer_rows(system.load_slot)
    for s in range(system.occupied):
        i = interface_of_slot[s]
        slot[i] = load_slot[i, 0] = load_slot[i, 1] = load_slot[i, 2] = -1
    system.occupied = system.loads = system.corrected_count = 0


@law
def _factorise(system, count):
    """Factorise with the target stiffness of the listed interfaces."""
    _discard_responses(system)  # those of a new factorisation differ
    _mark_outdated(system, count)
    system.factorisations += 1
    system.elastic, system.changed_count = 0, count
    run(system.eliminate, system.here)
    stale = flags(system.stale)
    for k in range(stale.size):
        stale[k] = False
    system.any_stale, system.spent = 0, 0.0


@law
def _solve_all(system, right):
    """Solve for the right-hand sides, with forces on all fronts."""
    reached = flags(system.reached)
    for k in range(reached.size):
        reached[k] = True
    _gather(system, right)
    solve_factorised(system, right)


@law
def _gather(system, right):
    """Gather the right-hand sides in the order of the fronts."""
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
    count, rows, new, unknown = _list_changed(system)
    if system.any_stale != 0 or _refactorisation_pays(system, count, rows, new, unknown):
        _factorise(system, count)
        count = 0
    right = part(float_rows(system.rows), 0, system.row_count)
    _solve_all(system, right)
    if count > 0:
        if _correct(system, count, new):
            system.corrections += 1
        else:
            _factorise(system, count)
            _solve_all(system, right)
    if system.keep_responses == 0:
        _discard_responses(system)
    solution, dofs = float_rows(system.solution), integers(system.active_dofs)
    for m in range(system.row_count):
        for i in range(solution.shape[1]):
            solution[m, i] = 0.0
        for j in range(dofs.size):
            solution[m, dofs[j]] = right[m, j]
