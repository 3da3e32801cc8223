"""Post-processing of a converged equilibrium: tangent, recovery of condensed subtrees, bond loads."""

from typing import NamedTuple

from damagepred.kernels.equilibrium.vectors import copy
from damagepred.kernels.interface.residual import within_limit
from damagepred.kernels.jit import kernel, rule
from damagepred.kernels.linear.condensation import recover


class Completed(NamedTuple):
    """Findings at an equilibrium.

    Attributes
    ----------
    within : bool
        Whether displacements are below the limit of the state.
    sliding : int
        Condensed interfaces that leave the elastic range.
    bond_load, condensed_load : float
        Largest load of a bond of active and of condensed interfaces, 1 at its strength.
    """

    within: bool
    sliding: int
    bond_load: float
    condensed_load: float


@rule
def _add_moving_forces(wall, state, history, displacement):
    """Add the forces of sections, and of the joints that ground and supports move, to the rate."""
    law, moving, stiffness = wall.law, wall.interfaces.moving, wall.stiffness
    law.add_section_forces(wall.sections, state.sections, wall.joints, displacement, wall.rate, stiffness)
    law.add_forces(wall.joints, history, wall.bounds, moving, True, displacement, wall.rate, stiffness)


@kernel
def store_tangent(wall, state, ahead, support_step, displacement):
    """Store the tangents of the active interfaces, and the force of the joints per load factor, at an equilibrium.

    Where ground and supports move, the rate of the force is a forward difference: ``ahead`` and ``support_step`` are
    history with the ground, and movement of the prescribed degrees of freedom, a small step of the load factor ahead.
    """
    stiffness, tangent, interfaces = wall.stiffness, wall.tangent, wall.interfaces
    for i in interfaces.active:
        for j in range(9):
            tangent[i, j] = stiffness[i, j]
    rate, moved, prescribed = wall.rate, wall.room[1], wall.freedoms.prescribed
    for i in range(rate.size):
        rate[i] = 0.0
    if interfaces.moving.size == 0:
        return
    _add_moving_forces(wall, state, state.history, displacement)
    for i in range(rate.size):
        rate[i] = -rate[i]
    copy(displacement, moved)
    for i in range(prescribed.size):
        moved[prescribed[i]] += support_step[i]
    _add_moving_forces(wall, state, ahead, moved)
    for i in range(rate.size):
        rate[i] /= wall.rate_step


@kernel
def complete(wall, state, displacement):
    """Recover the displacements of the condensed subtrees, check the interfaces in them, and compute all bond loads."""
    within = within_limit(displacement, wall.freedoms.free, wall.freedoms.arms, state.limit)
    interfaces, bonds, sliding, condensed_load = wall.interfaces, wall.bonds, 0, 0.0
    bond_load = wall.law.bond_loads(wall.joints, state.history, interfaces.active, displacement, bonds.load)
    if interfaces.condensed.size > 0:
        recover(wall.condensation, displacement, state.load, state.live)
        condensed_load = wall.law.check_elastic(
            wall.joints, state.history, interfaces.condensed, displacement, bonds.slides, bonds.load
        )
        for i in interfaces.condensed:
            sliding += bonds.slides[i]
    return Completed(within, sliding, bond_load, condensed_load)
