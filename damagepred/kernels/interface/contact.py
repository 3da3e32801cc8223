"""Explicit update of contacts: forces of interfaces on the blocks, in tiles, and the fields at a displacement."""

import numpy as np

from damagepred.kernels.explicit.tiles import LANES
from damagepred.kernels.interface.kinematics import interface_displacement, midpoint_displacement
from damagepred.kernels.jit import kernel, law
from damagepred.kernels.joint.law import joint_law
from damagepred.kernels.joint.limits import slip_compliance
from damagepred.kernels.joint.softening import damage_rate, slip_weight_of

Y, TURN = np.uint64(1), np.uint64(2)


@law
def gather(tile, displacement):
    """Gather the displacements of the blocks at the interfaces of a tile.

    Parameters
    ----------
    tile : record
        See ``damagepred.kernels.explicit.tiles``.
    displacement : array (size,)
        x, y (m) and rotation of each body.
    """
    for i in range(LANES):
        a, b = tile.dof_a[i], tile.dof_b[i]
        tile.drift_x[i] = displacement[b] - displacement[a]
        tile.drift_y[i] = displacement[b + Y] - displacement[a + Y]
        tile.turn_a[i] = displacement[a + TURN]
        tile.turn_b[i] = displacement[b + TURN]


@law
def contact_forces(tile, ground, special, softening, load_factor):
    """Update the history variables of all contacts of a tile, and its forces on the blocks.

    Parameters
    ----------
    tile : record
        See ``damagepred.kernels.explicit.tiles``.
    ground : record or None
        Movement of the ground under the tile as a straight line in the load factor, None if the tile does not touch
        the ground.
    special : bool or None
        None if no joint dilates, breaks or softens by slip or has a cap: these are then left out at compile time.
    softening : bool or None
        None if no bond softens.
    load_factor : float
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
                u_n -= ground.normal_start[k, i] + load_factor * ground.normal[k, i]
                u_s -= ground.shear_start[k, i] + load_factor * ground.shear[k, i]
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
        friction, residual_friction = properties.friction[i], properties.residual_friction[i]
        strength = (
            properties.tensile_strength[i],
            properties.cohesion[i],
            friction,
            slip_compliance(k_n, k_s, friction, psi),
        )
        residual_strength = (
            properties.residual_tensile_strength[i],
            properties.residual_cohesion[i],
            residual_friction,
            slip_compliance(k_n, k_s, residual_friction, psi),
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
