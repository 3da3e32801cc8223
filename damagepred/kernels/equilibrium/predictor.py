"""Tangent predictor, and the share of a step at which the next bond fails."""

import numpy as np

from damagepred.kernels.equilibrium.joints import joint_parameters
from damagepred.kernels.equilibrium.problem import problem_at
from damagepred.kernels.equilibrium.vectors import move_along
from damagepred.kernels.interface.residual import within_limit
from damagepred.kernels.jit import Unit, law
from damagepred.kernels.table import float_rows, floats, integers, put_back, replace, run


@Unit
def predict(address):
    """Predict the displacements at the end of a step with the tangent of the last equilibrium, and the next event.

    Parameters
    ----------
    address : int
        Of the table of the wall: ``residual`` is the increment of the load, ``best`` is filled from ``start`` on, and
        ``within`` tells whether displacements are below the ``limit``. Then ``share`` is that of ``interpolate_event``,
        of active interfaces, or of all if ``bonds_of_all``. Supports move to ``prescribed_ahead``; the ground has
        moved already, from ``normal_at_start`` and ``shear_at_start``.
    """
    table = problem_at(address)
    table.bordered = 1
    run(table.compute_step, address)
    ahead = floats(table.best)
    move_along(floats(table.start), 1.0, floats(table.step), ahead)
    prescribed, displacement = integers(table.prescribed), floats(table.prescribed_ahead)
    for i in range(prescribed.size):
        ahead[prescribed[i]] = displacement[i]
    table.within, table.share = within_limit(ahead, integers(table.free), floats(table.arms), table.limit), 1.0
    if table.within == 0:
        return
    table.displacement.address = table.best.address
    run(table.complete if table.bonds_of_all != 0 else table.bond_loads, address)
    normal = replace(table.ground_normal, table.normal_at_start)
    shear = replace(table.ground_shear, table.shear_at_start)
    joints = replace(table.joints, table.all_joints if table.bonds_of_all != 0 else table.joints)
    table.displacement.address = table.start.address
    run(table.interpolate_event, address)
    put_back(table.joints, joints)
    put_back(table.ground_shear, shear)
    put_back(table.ground_normal, normal)


@law
def _allowed_overload(table, p, tolerance):
    """Return a tolerance, or the overload of a weak bond, whose failure releases next to no energy."""
    weak = p.tensile_strength < table.block_stress and not p.brittle_shear
    return table.weak_bond_overload if weak else tolerance


@Unit
def interpolate_event(address):
    """Interpolate the share of a step at which the first bond reaches its strength and a share of its event tolerance.

    Bond loads are taken as linear along the step.

    Parameters
    ----------
    address : int
        Of the table of the wall: ``bond_load`` of the interfaces in ``joints`` is that at the end of the step,
        ``displacement``, ground and history are those at its start, and ``aim`` is that share of the tolerance.
        ``share`` becomes 1 if no bond fails.
    """
    table = problem_at(address)
    after, start = float_rows(table.bond_load), float_rows(table.bond_load_at_start)
    overloaded = integers(table.room_joints)
    properties, count = joint_parameters(table.properties), 0
    for i in integers(table.joints):
        least, fails = 1.0 + _allowed_overload(table, properties[i], table.overload_tolerance), False
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
        least = 1.0 + _allowed_overload(table, properties[i], table.overload_tolerance)
        wanted = 1.0 + table.aim * _allowed_overload(table, properties[i], table.event_tolerance)
        for k in range(after.shape[1]):
            if after[i, k] > least:
                table.share = min(table.share, (wanted - start[i, k]) / (after[i, k] - start[i, k]))
