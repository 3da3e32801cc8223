"""Prediction of the next equilibrium with the last tangent, and of the bond that fails first on the way (Rots 2001)."""

import numpy as np

from damagepred.kernels.equilibrium.completion import complete
from damagepred.kernels.equilibrium.vectors import move_along
from damagepred.kernels.interface.residual import within_limit
from damagepred.kernels.jit import kernel, law

OVERLOAD_TOLERANCE = 1e-6
"""Stress beyond the strength at which a bond fails, over the strength (1)."""
EVENT_TOLERANCE = 0.01
"""Overload up to which the load factor at which a bond fails is located, over the strength (1)."""
WEAK_BOND_OVERLOAD = 1.0
"""The same for weak bonds, over the stress of a block's weight (1). A bond is weak if its tensile strength is less than
that stress: its failure releases next to no energy."""


@law
def _allowed_overload(joints, p, tolerance):
    """Overload from which a bond counts as overloaded: a tolerance; more for weak bonds, which release little."""
    weak = p.tensile_strength < joints.block_stress and not p.brittle_shear
    return WEAK_BOND_OVERLOAD if weak else tolerance


@kernel
def interpolate_event(bonds, components, history, ground, listed, displacement, aim):
    """Share of a step at which the first bond of listed interfaces fails, 1 if none does: linear interpolation.

    A bond fails where its load is 1 plus ``aim`` times its event tolerance. ``bonds.load`` holds the loads at the end
    of the step; the loads at its start follow from history, ground and displacement there.
    """
    joints, count = components.joints, 0
    properties, after, start, overloaded = joints.properties, bonds.load, bonds.load_at_start, bonds.overloaded
    for i in listed:
        least, fails = 1.0 + _allowed_overload(joints, properties[i], OVERLOAD_TOLERANCE), False
        for k in range(after.shape[1]):
            fails |= after[i, k] > least
        if fails:
            overloaded[count] = i
            count += 1
    share = np.inf if count > 0 else 1.0
    components.law.bond_loads(joints, history, ground, overloaded[:count], displacement, start)
    for i in overloaded[:count]:
        least = 1.0 + _allowed_overload(joints, properties[i], OVERLOAD_TOLERANCE)
        wanted = 1.0 + aim * _allowed_overload(joints, properties[i], EVENT_TOLERANCE)
        for k in range(after.shape[1]):
            if after[i, k] > least:
                share = min(share, (wanted - start[i, k]) / (after[i, k] - start[i, k]))
    return share


@kernel
def predict(steps, wall, state, increment, prescribed_ahead, start, ahead, bonds_of_all, aim):
    """Fill displacements ``ahead`` at the end of a step with ``wall.tangent``; find the next event (Rots 2001).

    ``state`` has the loads at the end of the step, its other ground is at the start; ``increment`` is the increment of
    the force (N, N m), and prescribed degrees of freedom end at ``prescribed_ahead``. Returns whether displacements are
    below the limit, and the share of the step to the next event in active interfaces (``bonds_of_all``: in all).
    ``Continuation`` turns the share into the load factor of the next step.
    """
    freedoms, interfaces, components, step = wall.freedoms, wall.interfaces, wall.components, wall.room[0]
    steps.solve(wall, state, wall.tangent, True, start, increment, step)
    move_along(start, 1.0, step, ahead)
    prescribed = freedoms.prescribed
    for i in range(prescribed.size):
        ahead[prescribed[i]] = prescribed_ahead[i]
    if not within_limit(ahead, freedoms.free, freedoms.arms, state.limit):
        return False, 1.0
    if bonds_of_all or components.blocks.present:
        complete(wall, state, ahead)
    else:
        joints, bonds = components.joints, wall.bonds
        components.law.bond_loads(joints, state.history, state.ground, interfaces.active, ahead, bonds.load)
    listed = interfaces.all if bonds_of_all else interfaces.active
    return True, interpolate_event(wall.bonds, components, state.history, state.other_ground, listed, start, aim)
