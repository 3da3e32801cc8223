"""Units of the condensed subtrees: superelements on their boundaries, recovery of their displacements, their energy."""

from damagepred.kernels.jit import Unit
from damagepred.kernels.linear.multifrontal import add_product
from damagepred.kernels.table import float_rows, floats, integers, part, run, table_at, table_type

CONDENSATION = table_type(
    "boundary_dofs first_boundary stiffness boundary_room dofs particular particular_in_state current loaded_dofs "
    "loads displacement force",
    integers="system back resist",
    numbers="load live energy",
)
"""Attributes, with b boundary degrees of freedom, counted once for each superelement.

boundary_dofs, first_boundary : array of int
    Degrees of freedom of each superelement, one after the other, and where those of each begin.
stiffness : array
    Symmetric stiffness of each superelement, one matrix after the other.
boundary_room : array (2, b)
    Displacements of the boundaries, and forces by which the superelements resist them.
dofs : array of int
    All degrees of freedom in the order of the fronts.
particular : array (2, degrees of freedom)
    Displacements under dead and live load at load factor 1, the active fronts fixed.
particular_in_state, current : array (1, degrees of freedom)
    Those under the present load, and displacements, both in the order of the fronts; of ``system``.
loaded_dofs, loads : array of int (n,), array (2, n)
    Condensed degrees of freedom, and their dead and live load at load factor 1; and those of the boundaries, with the
    condensed load subtracted.
displacement, force : array (size,)
    Of all degrees of freedom.
load, live : float
    Load factors of dead and live load.
system, back, resist : int
    Addresses of the table of the tangent equations with the condensed fronts, and of units.
energy : float
    Elastic energy of the condensed subtrees (J).
"""
condensation_at = table_at(CONDENSATION, "CONDENSATION")
"""What gives the table at an address."""


@Unit
def resist(address):
    """Gather displacements of the boundaries, and the forces by which the superelements resist them.

    Parameters
    ----------
    address : int
        Of the table; both are in ``boundary_room``.
    """
    table = condensation_at(address)
    dofs, first, stiffness = integers(table.boundary_dofs), integers(table.first_boundary), floats(table.stiffness)
    displacement, room, at = floats(table.displacement), float_rows(table.boundary_room), 0
    u, resisting = part(room, 0, 1), part(room, 1, 1)
    for i in range(dofs.size):
        u[0, i], resisting[0, i] = displacement[dofs[i]], 0.0
    for k in range(first.size - 1):
        size = first[k + 1] - first[k]
        add_product(1.0, part(stiffness, at, size * size), size, size, u, first[k], resisting, first[k])
        at += size * size


@Unit
def subtract_boundary_forces(address):
    """Subtract the forces by which the superelements resist the displacements of their boundaries from ``force``.

    Parameters
    ----------
    address : int
        Of the table.
    """
    table = condensation_at(address)
    run(table.resist, address)
    dofs, force, room = integers(table.boundary_dofs), floats(table.force), float_rows(table.boundary_room)
    for i in range(dofs.size):
        force[dofs[i]] -= room[1, i]


@Unit
def recover(address):
    """Recover the displacements of the condensed subtrees from those of their boundaries by back substitution.

    Parameters
    ----------
    address : int
        Of the table; ``displacement`` is updated.
    """
    table = condensation_at(address)
    dofs, displacement, by_load = integers(table.dofs), floats(table.displacement), float_rows(table.particular)
    particular, current = float_rows(table.particular_in_state), float_rows(table.current)
    for i in range(dofs.size):
        current[0, i] = displacement[dofs[i]]
        particular[0, i] = table.load * by_load[0, i] + table.live * by_load[1, i]
    run(table.back, table.system)
    for i in range(dofs.size):
        displacement[dofs[i]] = current[0, i]


@Unit
def elastic_energy(address):
    """Set ``energy`` to half the work of the loads on condensed subtrees and of the forces on their boundaries.

    Parameters
    ----------
    address : int
        Of the table.
    """
    table, work = condensation_at(address), 0.0
    dofs, loads, displacement = integers(table.loaded_dofs), float_rows(table.loads), floats(table.displacement)
    for i in range(dofs.size):
        work += (table.load * loads[0, i] + table.live * loads[1, i]) * displacement[dofs[i]]
    run(table.resist, address)
    room = float_rows(table.boundary_room)
    for i in range(room.shape[1]):
        work += room[0, i] * room[1, i]
    table.energy = 0.5 * work
