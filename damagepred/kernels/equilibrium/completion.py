"""What follows an equilibrium of the active fronts: its linearisation, and the condensed subtrees."""

from damagepred.kernels.equilibrium.problem import problem_at
from damagepred.kernels.equilibrium.vectors import copy
from damagepred.kernels.interface.residual import within_limit
from damagepred.kernels.jit import Unit
from damagepred.kernels.linear.condensation import condensation_at
from damagepred.kernels.table import float_rows, floats, integers, put_back, replace, run


@Unit
def store_tangent(address):
    """Store the tangents of the active interfaces, and the force of the joints per load factor, at an equilibrium.

    Ground and supports move: the rate of the force is a forward difference.

    Parameters
    ----------
    address : int
        Of the table of the wall: ``tangent`` and ``rate`` are filled for the displacement ``best``.
    """
    table = problem_at(address)
    stiffness, tangent = float_rows(table.stiffness), float_rows(table.tangent)
    for i in integers(table.joints):
        for j in range(9):
            tangent[i, j] = stiffness[i, j]
    rate, moved = floats(table.rate), float_rows(table.room)[1]
    for i in range(rate.size):
        rate[i] = 0.0
    if integers(table.moving).size == 0:
        return
    joints, force = replace(table.joints, table.moving), replace(table.force, table.rate)
    normal, shear, table.coulomb = table.ground_normal.address, table.ground_shear.address, 1
    table.displacement.address = table.best.address
    run(table.add_joint_forces, address)
    for i in range(rate.size):
        rate[i] = -rate[i]
    copy(floats(table.best), moved)
    prescribed, step = integers(table.prescribed), floats(table.prescribed_step)
    for i in range(prescribed.size):
        moved[prescribed[i]] += step[i]
    table.displacement.address = moved.ctypes.data
    table.ground_normal.address, table.ground_shear.address = table.normal_ahead.address, table.shear_ahead.address
    run(table.add_joint_forces, address)
    for i in range(rate.size):
        rate[i] /= table.rate_step
    table.ground_normal.address, table.ground_shear.address = normal, shear
    put_back(table.joints, joints)
    put_back(table.force, force)


@Unit
def complete(address):
    """Recover the displacements of the condensed subtrees, check the interfaces in them, and compute all bond loads.

    Parameters
    ----------
    address : int
        Of the table of the wall: ``best`` is completed, ``within`` tells whether displacements are below the ``limit``,
        and the results of ``bond_loads`` and ``check_condensed`` are filled.
    """
    table = problem_at(address)
    best, table.displacement.address = floats(table.best), table.best.address
    table.within = within_limit(best, integers(table.free), floats(table.arms), table.limit)
    table.sliding, table.largest_condensed_load = 0, 0.0
    run(table.bond_loads, address)
    if table.condensation == 0:
        return
    condensation_at(table.condensation).displacement.address = table.best.address
    run(table.recover, table.condensation)
    joints = replace(table.joints, table.condensed)
    run(table.check_condensed, address)
    put_back(table.joints, joints)
