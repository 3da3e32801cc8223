"""Static condensation (Guyan 1965) of elastic subtrees to superelements on their boundaries."""

from damagepred.kernels.jit import kernel, rule
from damagepred.kernels.linear.substitution import Substitution, add_product
from damagepred.kernels.structures import FLOAT_ROWS, FLOATS, INTEGERS, Structure


class Condensation(Structure):
    """Superelements of the condensed subtrees, made by ``StaticCondensation``; ``empty`` without them."""

    substitution = Substitution.kind
    """Of the condensed fronts, with one row for every degree of freedom."""
    boundary_dofs = INTEGERS
    first_boundary = INTEGERS
    stiffness = FLOATS
    """Active degrees of freedom on their boundaries, first of each, and Schur complements there."""
    boundary = FLOAT_ROWS
    """Room for displacements of the boundaries, and for the forces that resist them."""
    dofs = INTEGERS
    """Degrees of freedom in the order of the fronts."""
    particular = FLOAT_ROWS
    """Solution under dead and under live load, active fronts fixed."""
    particular_in_state = FLOAT_ROWS
    current = FLOAT_ROWS
    """Room for the particular solution of a state, and for displacements, in the order of the fronts."""
    loaded_dofs = INTEGERS
    loads = FLOAT_ROWS
    """Dead and live load on condensed subtrees, and the negative ones condensed to their boundaries."""


@rule
def _resist(condensation, displacement):
    """Fill ``boundary`` with the displacements of the boundaries (row 0) and stiffness times them (row 1)."""
    dofs, first, stiffness = condensation.boundary_dofs, condensation.first_boundary, condensation.stiffness
    rows, at = condensation.boundary, 0
    u, resisting = rows[:1], rows[1:2]
    for i in range(dofs.size):
        u[0, i], resisting[0, i] = displacement[dofs[i]], 0.0
    for k in range(first.size - 1):
        size = first[k + 1] - first[k]
        add_product(1.0, stiffness[at : at + size * size], size, size, u, first[k], resisting, first[k])
        at += size * size


@kernel
def condense_forces(substitution, force, particular):
    """Condense ``force``, in place, on condensed fronts to their boundaries; ``particular``: solution, these fixed."""
    substitution.forward(substitution.factors, substitution.rows, force, particular)


@kernel
def subtract_boundary_forces(condensation, displacement, force):
    """Subtract the forces by which the superelements resist the displacements of their boundaries."""
    _resist(condensation, displacement)
    dofs, rows = condensation.boundary_dofs, condensation.boundary
    for i in range(dofs.size):
        force[dofs[i]] -= rows[1, i]


@kernel
def recover(condensation, displacement, load, live):
    """Recover the displacements of condensed subtrees at factors of dead and live load, by back substitution."""
    dofs, by_load, substitution = condensation.dofs, condensation.particular, condensation.substitution
    particular, current = condensation.particular_in_state, condensation.current
    for i in range(dofs.size):
        current[0, i] = displacement[dofs[i]]
        particular[0, i] = load * by_load[0, i] + live * by_load[1, i]
    substitution.back(substitution.factors, substitution.rows, current, particular)
    for i in range(dofs.size):
        displacement[dofs[i]] = current[0, i]


@kernel
def elastic_energy(condensation, displacement, load, live):
    """Half the work of the loads on condensed subtrees and of the forces on their boundaries (J)."""
    work, dofs, loads = 0.0, condensation.loaded_dofs, condensation.loads
    for i in range(dofs.size):
        work += (load * loads[0, i] + live * loads[1, i]) * displacement[dofs[i]]
    _resist(condensation, displacement)
    rows = condensation.boundary
    for i in range(rows.shape[1]):
        work += rows[0, i] * rows[1, i]
    return 0.5 * work
