"""Steps after a solution of the active fronts: tangent for the next prediction, condensed parts, bond loads.

The solution is mostly an equilibrium that Newton's method has found. It may also be a prediction, the wall at rest, or
an iterate without equilibrium: ``complete`` and ``store_tangent`` take any displacements.
"""

from typing import NamedTuple

from damagepred.kernels.equilibrium.joints import internal_forces
from damagepred.kernels.equilibrium.vectors import copy
from damagepred.kernels.interface.residual import within_limit
from damagepred.kernels.jit import kernel
from damagepred.kernels.linear.condensation import recover

RATE_STEP = 1e-7
"""Increment of the load factor for the rate of the forces (1)."""


class Completed(NamedTuple):
    """Result of ``complete``, which kernels return as a plain tuple."""

    # a kernel that returns a named tuple runs Python code to do so: an interrupt there (Ctrl-C) ends the process

    within: bool = False  # whether displacements are below the limit of the state
    sliding: int = 0  # condensed interfaces that leave the elastic range
    bond_load: float = 0.0  # largest load of a bond of active and of condensed interfaces, 1 at its strength
    condensed_load: float = 0.0


@kernel
def store_tangent(wall, state, support_step, displacement):
    """Store the tangents of the last residual and the force per load factor in ``wall.tangent`` and ``wall.rate``.

    The last residual must be at ``displacement``. ``predict`` reads both. Where ground and supports move, or live
    load acts in deformable blocks, the rate is a forward difference over ``RATE_STEP``: ``state.other_ground`` and
    ``support_step`` are the ground, and the movement of the prescribed degrees of freedom, after that step. The
    difference overwrites ``wall.stiffness`` of the moving interfaces; the next residual fills it again.
    """
    stiffness, tangent, listed, components = wall.stiffness, wall.tangent, wall.interfaces.moving, wall.components
    for i in wall.interfaces.active:
        for j in range(9):
            tangent[i, j] = stiffness[i, j]
    rate, moved, prescribed = wall.rate, wall.room[1], wall.freedoms.prescribed
    rate[:] = 0.0
    if listed.size == 0 and not components.blocks.present:
        return
    internal_forces(components, state, state.ground, state.live, listed, True, False, displacement, rate, stiffness)
    for i in range(rate.size):
        rate[i] = -rate[i]
    copy(displacement, moved)
    for i in range(prescribed.size):
        moved[prescribed[i]] += support_step[i]
    ahead = state.live + RATE_STEP
    internal_forces(components, state, state.other_ground, ahead, listed, True, False, moved, rate, stiffness)
    for i in range(rate.size):
        rate[i] /= RATE_STEP


@kernel
def complete(wall, state, displacement):
    """Recover condensed subtrees and the inside of blocks, find condensed interfaces that slide, fill bond loads.

    ``displacement`` holds the active fronts, and gets all others. ``wall.bonds`` gets ``load``, and ``slides`` of
    condensed interfaces; ``Equilibrium.find`` makes their fronts active and seeks the equilibrium again. Returns the
    values of ``Completed``.
    """
    within = within_limit(displacement, wall.freedoms.free, wall.freedoms.arms, state.limit)
    interfaces, bonds, sliding, condensed_load = wall.interfaces, wall.bonds, 0, 0.0
    law, joints, blocks = wall.components.law, wall.components.joints, wall.components.blocks
    if interfaces.condensed.size > 0:
        recover(wall.condensation, displacement, state.load, state.live)
    if blocks.present and blocks.yielding.present:
        trial, correct_active = blocks.blocks.spare_trial, blocks.yielding.correct_active
        # the tangents stay as in the last residual
        correct_active(blocks.blocks, state.plastic, state.load, state.live, trial, displacement, wall.force)
    if blocks.present:
        blocks.recover(blocks.blocks, state.load, state.live, displacement)
    bond_load = law.bond_loads(joints, state.history, state.ground, interfaces.active, displacement, bonds.load)
    if interfaces.condensed.size > 0:
        condensed_load = law.check_elastic(
            joints, state.history, state.ground, interfaces.condensed, displacement, bonds.slides, bonds.load
        )
        for i in interfaces.condensed:
            sliding += bonds.slides[i]
    return within, sliding, bond_load, condensed_load
