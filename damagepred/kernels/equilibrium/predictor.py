"""Prediction of the next equilibrium with the last tangent, and of the bond that fails first on the way (Rots 2001)."""

import numpy as np

from damagepred.kernels.equilibrium.completion import complete
from damagepred.kernels.equilibrium.residual import solve_step
from damagepred.kernels.equilibrium.vectors import move_along
from damagepred.kernels.interface.residual import within_limit
from damagepred.kernels.jit import kernel, law


@law
def _allowed_overload(bonds, joints, p, tolerance):
    """Return a tolerance, or the overload of a weak bond, whose failure releases next to no energy."""
    weak = p.tensile_strength < joints.block_stress and not p.brittle_shear
    return bonds.weak_bond_overload if weak else tolerance


@kernel
def interpolate_event(bonds, joints, law, history, listed, displacement, aim):
    """Share of a step at which the first bond reaches its strength and a share ``aim`` of its event tolerance.

    Bond loads are taken as linear along the step: those at its end are in ``bonds``; history and displacement are
    those at its start. The share is 1 if no bond of the listed interfaces fails.
    """
    properties, count = joints.properties, 0
    after, start, overloaded = bonds.load, bonds.load_at_start, bonds.overloaded
    for i in listed:
        least, fails = 1.0 + _allowed_overload(bonds, joints, properties[i], bonds.overload_tolerance), False
        for k in range(after.shape[1]):
            fails |= after[i, k] > least
        if fails:
            overloaded[count] = i
            count += 1
    share = np.inf if count > 0 else 1.0
    law.bond_loads(joints, history, overloaded[:count], displacement, start)
    for i in overloaded[:count]:
        least = 1.0 + _allowed_overload(bonds, joints, properties[i], bonds.overload_tolerance)
        wanted = 1.0 + aim * _allowed_overload(bonds, joints, properties[i], bonds.event_tolerance)
        for k in range(after.shape[1]):
            if after[i, k] > least:
                share = min(share, (wanted - start[i, k]) / (after[i, k] - start[i, k]))
    return share


@kernel
def predict(wall, state, history, increment, prescribed_ahead, start, ahead, bonds_of_all, aim):
    """Predict the displacements ``ahead`` at the end of a step with the tangent of the last equilibrium.

    ``state`` is at the end of the step, ``history`` at its start; ``increment`` is that of the load. Supports move to
    ``prescribed_ahead``. Returns whether displacements are below the limit, and the share of the step to the next event
    in active interfaces, or in all.
    """
    freedoms, interfaces, step = wall.freedoms, wall.interfaces, wall.room[0]
    solve_step(wall, state, wall.tangent, True, start, increment, step)
    move_along(start, 1.0, step, ahead)
    prescribed = freedoms.prescribed
    for i in range(prescribed.size):
        ahead[prescribed[i]] = prescribed_ahead[i]
    if not within_limit(ahead, freedoms.free, freedoms.arms, state.limit):
        return False, 1.0
    if bonds_of_all:
        complete(wall, state, ahead)
        return True, interpolate_event(wall.bonds, wall.joints, wall.law, history, interfaces.all, start, aim)
    wall.law.bond_loads(wall.joints, state.history, interfaces.active, ahead, wall.bonds.load)
    return True, interpolate_event(wall.bonds, wall.joints, wall.law, history, interfaces.active, start, aim)
