"""Forces of interfaces on the blocks they join, from the displacements of the blocks.

An interface is a straight edge, so the opening along it is linear and the shear constant: both follow from three
numbers (opening and shear at its middle, relative rotation). The contacts, its integration points, share them.
"""

import numpy as np

from damagepred.kernels.explicit.tiles import LANES
from damagepred.kernels.jit import kernel, law
from damagepred.kernels.joint.law import damage_rate, joint_law, slip_compliance, slip_weight_of

Y, TURN = np.uint64(1), np.uint64(2)


@law
def midpoint_displacement(normal, arm_a, arm_b, drift, turn_a, turn_b):
    """Return opening and shear (m) in the middle of an interface.

    Parameters
    ----------
    normal : tuple of float
        Unit normal from block a to block b.
    arm_a, arm_b : tuple of float
        Displacement along (normal, tangent) for a unit rotation of the block (m).
    drift : tuple of float
        Displacement of b's centroid less that of a's (m).
    turn_a, turn_b : float
        Rotations.
    """
    opening = normal[0] * drift[0] + normal[1] * drift[1] + arm_b[0] * turn_b - arm_a[0] * turn_a
    shear = normal[1] * drift[0] - normal[0] * drift[1] + arm_b[1] * turn_b - arm_a[1] * turn_a
    return opening, shear


@law
def interface_displacement(interfaces, displacement, i):
    """Return opening and shear in the middle of interface i, and its relative rotation."""
    a, b = 3 * interfaces.body_a[i], 3 * interfaces.body_b[i]
    turn_a, turn_b = displacement[a + 2], displacement[b + 2]
    opening, shear = midpoint_displacement(
        (interfaces.normal_x[i], interfaces.normal_y[i]),
        (interfaces.arm_normal_a[i], interfaces.arm_shear_a[i]),
        (interfaces.arm_normal_b[i], interfaces.arm_shear_b[i]),
        (displacement[b] - displacement[a], displacement[b + 1] - displacement[a + 1]),
        turn_a,
        turn_b,
    )
    return opening, shear, turn_b - turn_a


@law
def scatter_interface_force(interfaces, i, normal, shear, moment, force):
    """Add to ``force`` what interface i does to its bodies, by its forces (N) and the moment about its middle (N m)."""
    n_x, n_y = interfaces.normal_x[i], interfaces.normal_y[i]
    pull_x, pull_y = normal * n_x + shear * n_y, normal * n_y - shear * n_x
    a, b = 3 * interfaces.body_a[i], 3 * interfaces.body_b[i]
    force[a] += pull_x
    force[a + 1] += pull_y
    force[a + 2] += normal * interfaces.arm_normal_a[i] + shear * interfaces.arm_shear_a[i] + moment
    force[b] -= pull_x
    force[b + 1] -= pull_y
    force[b + 2] -= normal * interfaces.arm_normal_b[i] + shear * interfaces.arm_shear_b[i] + moment


@law
def gather(tile, displacement):
    """Bring the displacements of the blocks to the interfaces that join them."""
    for i in range(LANES):
        a, b = tile.dof_a[i], tile.dof_b[i]
        tile.drift_x[i] = displacement[b] - displacement[a]
        tile.drift_y[i] = displacement[b + Y] - displacement[a + Y]
        tile.turn_a[i] = displacement[a + TURN]
        tile.turn_b[i] = displacement[b + TURN]


@law
def contact_forces(tile, ground, special, softening, progress):
    """Apply the law to all contacts of a tile: its memory and its forces on the blocks are brought up to date.

    Parameters
    ----------
    tile : record
        See ``damagepred.kernels.explicit.tiles``.
    ground : record or None
        Movement of the ground under the tile as a straight line in the load factor, None if the tile does not touch
        the ground.
    special : bool or None
        None if no joint dilates, breaks or wears by slip or has a cap: what they need is then left out when compiling.
    softening : bool or None
        None if no bond softens.
    progress : float
        Load factor of the movement.
    """
    for i in range(LANES):
        n_x, n_y = tile.normal_x[i], tile.normal_y[i]
        arm_a = (tile.arm_normal_a[i], tile.arm_shear_a[i])
        arm_b = (tile.arm_normal_b[i], tile.arm_shear_b[i])
        drift = (tile.drift_x[i], tile.drift_y[i])
        turn_a, turn_b = tile.turn_a[i], tile.turn_b[i]
        opening, shear = midpoint_displacement((n_x, n_y), arm_a, arm_b, drift, turn_a, turn_b)
        stiffness = (tile.normal_stiffness[i], tile.shear_stiffness[i], tile.shear_compliance[i])
        strength = (tile.strength[0, i], tile.strength[1, i], tile.strength[2, i], tile.strength[3, i])
        residual_strength = (
            tile.residual_strength[0, i],
            tile.residual_strength[1, i],
            tile.residual_strength[2, i],
            tile.residual_strength[3, i],
        )
        psi, brittle_shear = 0.0, False
        cap = None
        slip_weight = None
        if special is not None:
            psi, brittle_shear = tile.dilation[i], tile.brittle_shear[i] != 0.0
            cap = (tile.cap[0, i], tile.cap[1, i], tile.cap[2, i])
            slip_weight = tile.slip_weight[i]
        softened = None
        if softening is not None:
            softened = (tile.critical_opening[i], tile.damage_rate[i])
        total_n, total_s, total_m = 0.0, 0.0, 0.0
        for k in range(tile.slip.shape[0]):
            at = tile.contact_offset[k, i]
            u_n = opening + at * (turn_b - turn_a)
            u_s = shear
            if ground is not None:
                u_n -= ground.normal_start[k, i] + progress * ground.normal[k, i]
                u_s -= ground.shear_start[k, i] + progress * ground.shear[k, i]
            dilatant_opening, kappa = 0.0, 0.0
            if special is not None:
                dilatant_opening = tile.dilatant_opening[k, i]
            if softening is not None:
                kappa = tile.kappa[k, i]
            sigma, tau, slip, dilatant_opening, cracked, kappa = joint_law(
                u_n,
                u_s,
                tile.slip[k, i],
                dilatant_opening,
                tile.cracked[k, i] != 0.0,
                kappa,
                stiffness,
                strength,
                residual_strength,
                softened,
                psi,
                brittle_shear,
                cap,
                slip_weight,
            )
            tile.slip[k, i] = slip
            tile.cracked[k, i] = cracked
            if special is not None:
                tile.dilatant_opening[k, i] = dilatant_opening
            if softening is not None:
                tile.kappa[k, i] = kappa
            area = tile.contact_area[k, i]
            total_n += area * sigma
            total_s += area * tau
            total_m += area * at * sigma
        pull_x = total_n * n_x + total_s * n_y
        pull_y = total_n * n_y - total_s * n_x
        tile.on_a[0, i] = pull_x
        tile.on_a[1, i] = pull_y
        tile.on_a[2, i] = total_n * arm_a[0] + total_s * arm_a[1] + total_m
        tile.on_b[0, i] = -pull_x
        tile.on_b[1, i] = -pull_y
        tile.on_b[2, i] = -(total_n * arm_b[0] + total_s * arm_b[1] + total_m)


@kernel
def contact_fields(interfaces, properties, ground, state, displacement, opening, shear, sigma, tau):
    """Fill opening, shear displacement (m), normal and shear stress (Pa) of all contacts.

    Parameters
    ----------
    interfaces, properties, ground : NamedTuple of arrays
        See ``damagepred.assembly.model``; the ground in its present state.
    state : NamedTuple of arrays
        See ``damagepred.solvers.state.joint_history``; brought up to date.
    displacement : array (3 (n + 1),)
        x, y (m), rotation of each block, the ground last.
    opening, shear, sigma, tau : array (m, q)
        Filled.
    """
    first_ground = interfaces.block_a.size - ground.normal.shape[0]
    for i in range(interfaces.block_a.size):
        middle, along, turn = interface_displacement(interfaces, displacement, i)
        k_n, k_s, psi = properties.normal_stiffness[i], properties.shear_stiffness[i], properties.dilation[i]
        friction, friction_left = properties.friction[i], properties.residual_friction[i]
        strength = (
            properties.tensile_strength[i],
            properties.cohesion[i],
            friction,
            slip_compliance(k_n, k_s, friction, psi),
        )
        residual_strength = (
            properties.residual_tensile_strength[i],
            properties.residual_cohesion[i],
            friction_left,
            slip_compliance(k_n, k_s, friction_left, psi),
        )
        critical = properties.critical_opening[i]
        strongest = properties.compressive_strength[i]
        cap = (strongest, strongest / k_n, 1.0 / properties.cap_shear[i])
        softening = (critical, damage_rate(k_n, properties.tensile_strength[i], critical))
        for k in range(interfaces.contact_area.shape[1]):
            u_n = middle + interfaces.contact_offset[i, k] * turn
            u_s = along
            if i >= first_ground:
                u_n -= ground.normal[i - first_ground, k]
                u_s -= ground.shear[i - first_ground, k]
            opening[i, k] = u_n
            shear[i, k] = u_s
            sigma[i, k], tau[i, k], slip, dilatant_opening, cracked, kappa = joint_law(
                u_n,
                u_s,
                state.slip[i, k],
                state.dilatant_opening[i, k],
                state.cracked[i, k],
                state.kappa[i, k],
                (k_n, k_s, 1.0 / k_s),
                strength,
                residual_strength,
                softening,
                psi,
                properties.brittle_shear[i],
                cap,
                slip_weight_of(properties, i),
            )
            state.slip[i, k], state.dilatant_opening[i, k] = slip, dilatant_opening
            state.cracked[i, k], state.kappa[i, k] = cracked, kappa
