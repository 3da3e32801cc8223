"""Tangent predictor, and the load factor at which the next bond fails."""

import numpy as np

from damagepred.kernels.equilibrium.joints import joint_parameters
from damagepred.kernels.equilibrium.problem import problem_at
from damagepred.kernels.equilibrium.vectors import move_along
from damagepred.kernels.interface.residual import within_limit
from damagepred.kernels.jit import Unit, law
from damagepred.kernels.table import flags, float_rows, floats, integers, put_back, replace, run


@Unit
def predict(address):
    """Predict the displacements at the end of a step with the tangent of the last equilibrium.

    Parameters
    ----------
    address : int
        Of the table of the wall: ``residual`` is the increment of the load, ``best`` is filled from ``start`` on, and
        ``within`` tells whether displacements are below the ``limit``. Supports move to ``prescribed_ahead``.
    """
    table = problem_at(address)
    table.bordered = 1
    run(table.compute_step, address)
    ahead = floats(table.best)
    move_along(floats(table.start), 1.0, floats(table.step), ahead)
    prescribed, displacement = integers(table.prescribed), floats(table.prescribed_ahead)
    for i in range(prescribed.size):
        ahead[prescribed[i]] = displacement[i]
    table.within = within_limit(ahead, flags(table.free), floats(table.arms), table.limit)


@law
def _is_weak(table, p):
    """Whether the failure of a bond releases next to no energy."""
    return p.tensile_strength < table.block_stress and not p.brittle_shear


@Unit
def interpolate_event(address):
    """Interpolate the share of a step at which the first bond reaches its strength and a share of its event tolerance.

    Bond loads are taken as linear along the step.

    Parameters
    ----------
    address : int
        Of the table of the wall: ``bond_load`` is that at the end of the step, ``displacement``, ground and history are
        those at its start, and ``aim`` is that share of the tolerance. ``share`` becomes 1 if no bond fails.
    """
    table = problem_at(address)
    after, start, overloaded = (
        float_rows(table.bond_load),
        float_rows(table.bond_load_at_start),
        integers(table.room_joints),
    )
    properties, count = joint_parameters(table.properties), 0
    for i in range(after.shape[0]):
        least = 1.0 + (table.weak_bond_overload if _is_weak(table, properties[i]) else table.overload_tolerance)
        fails = False
        for k in range(after.shape[1]):
            fails |= after[i, k] > least
        if fails:
            overloaded[count] = i
            count += 1
    table.share = np.inf if count > 0 else 1.0
    joints, load = replace(table.joints, table.room_joints), replace(table.bond_load, table.bond_load_at_start)
    table.joints.rows = count
    run(table.bond_loads, address)
    put_back(table.joints, joints)
    put_back(table.bond_load, load)
    for i in overloaded[:count]:
        weak = _is_weak(table, properties[i])
        least = 1.0 + (table.weak_bond_overload if weak else table.overload_tolerance)
        wanted = 1.0 + table.aim * (table.weak_bond_overload if weak else table.event_tolerance)
        for k in range(after.shape[1]):
            if after[i, k] > least:
                table.share = min(table.share, (wanted - start[i, k]) / (after[i, k] - start[i, k]))
