"""Prediction of the next equilibrium with the last tangent, and of the bond that fails first on the way (Rots 2001)."""

import numpy as np

from damagepred.kernels.equilibrium.completion import complete
from damagepred.kernels.equilibrium.vectors import move_along
from damagepred.kernels.interface.residual import within_limit
from damagepred.kernels.jit import kernel, law


@law
def _allowed_overload(bonds, joints, p, tolerance):
    """Return a tolerance, or the overload of a weak bond, whose failure releases next to no energy."""
    weak = p.tensile_strength < joints.block_stress and not p.brittle_shear
    return bonds.weak_bond_overload if weak else tolerance


@kernel
def interpolate_event(bonds, components, history, ground, listed, displacement, aim):
    """Share of a step at which the first bond reaches its strength and a share ``aim`` of its event tolerance.

    Bond loads are taken as linear along the step: ``bonds`` holds the loads at its end; history, ground and
    displacement hold at its start. The share is 1 if no bond of the listed interfaces fails.
    """
    joints, count = components.joints, 0
    properties, after, start, overloaded = joints.properties, bonds.load, bonds.load_at_start, bonds.overloaded
    for i in listed:
        least, fails = 1.0 + _allowed_overload(bonds, joints, properties[i], bonds.overload_tolerance), False
        for k in range(after.shape[1]):
            fails |= after[i, k] > least
        if fails:
            overloaded[count] = i
            count += 1
    share = np.inf if count > 0 else 1.0
    components.law.bond_loads(joints, history, ground, overloaded[:count], displacement, start)
    for i in overloaded[:count]:
        least = 1.0 + _allowed_overload(bonds, joints, properties[i], bonds.overload_tolerance)
        wanted = 1.0 + aim * _allowed_overload(bonds, joints, properties[i], bonds.event_tolerance)
        for k in range(after.shape[1]):
            if after[i, k] > least:
                share = min(share, (wanted - start[i, k]) / (after[i, k] - start[i, k]))
    return share


@kernel
def predict(steps, wall, state, increment, prescribed_ahead, start, ahead, bonds_of_all, aim):
    """Predict displacements ``ahead`` with the last tangent, and the next event (sequentially linear; Rots 2001).

    ``state`` is at the end of the step, its other ground at the start; ``increment`` is the load's increment. Supports
    move to ``prescribed_ahead``. Returns whether displacements are below the limit, and the share of the step to the
    next event in active interfaces, or in all.
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
