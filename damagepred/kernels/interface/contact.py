"""Explicit update of contacts: forces of interfaces on the blocks, in tiles, and the fields at a displacement."""

import numpy as np

from damagepred.kernels.explicit.tiles import LANES
from damagepred.kernels.interface.kinematics import ground_at, interface_displacement, midpoint_displacement
from damagepred.kernels.jit import kernel, law
from damagepred.kernels.joint.explicit_update import explicit_update
from damagepred.kernels.joint.parameters import of_lane
from damagepred.kernels.joint.softening import Softening

Y, TURN = np.uint64(1), np.uint64(2)
ALL_SHAPES = Softening(True)


@law
def gather(tile, elastic, displacement):
    """Gather the displacements of the blocks at the interfaces of a tile."""
    for i in range(LANES):
        a, b = tile.dof_a[i], tile.dof_b[i]
        tile.drift_x[i] = displacement[b] - displacement[a]
        tile.drift_y[i] = displacement[b + Y] - displacement[a + Y]
        tile.turn_a[i] = displacement[a + TURN]
        tile.turn_b[i] = displacement[b + TURN]
    if elastic is not None:
        for i in range(LANES):
            a, b = tile.strain_dof_a[i], tile.strain_dof_b[i]
            tile.strain_a[i], tile.curvature_a[i] = displacement[a], displacement[a + Y]
            tile.strain_b[i], tile.curvature_b[i] = displacement[b], displacement[b + Y]


@law
def contact_forces(tile, ground, special, softening, elastic, load_factor):
    """Update the history variables of all contacts of a tile, and its forces on the blocks."""
    for i in range(LANES):
        n_x, n_y = tile.normal_x[i], tile.normal_y[i]
        arm_a = (tile.arm_normal_a[i], tile.arm_shear_a[i])
        arm_b = (tile.arm_normal_b[i], tile.arm_shear_b[i])
        drift = (tile.drift_x[i], tile.drift_y[i])
        turn_a, turn_b = tile.turn_a[i], tile.turn_b[i]
        opening, shear = midpoint_displacement((n_x, n_y), arm_a, arm_b, drift, turn_a, turn_b)
        if elastic is not None:
            strain_a, curvature_a = tile.strain_a[i], tile.curvature_a[i]
            strain_b, curvature_b = tile.strain_b[i], tile.curvature_b[i]
            opening += tile.rows_a[0, i] * strain_a + tile.rows_a[1, i] * curvature_a
            opening += tile.rows_b[0, i] * strain_b + tile.rows_b[1, i] * curvature_b
            shear += tile.rows_a[2, i] * strain_a + tile.rows_a[3, i] * curvature_a
            shear += tile.rows_b[2, i] * strain_b + tile.rows_b[3, i] * curvature_b
            turn_b += tile.rows_a[4, i] * curvature_a + tile.rows_b[4, i] * curvature_b
        parameters = of_lane(tile, i)
        total_n, total_s, total_m = 0.0, 0.0, 0.0
        for k in range(tile.slip.shape[0]):
            offset = tile.contact_offset[k, i]
            u_n = opening + offset * (turn_b - turn_a)
            u_s = shear
            if ground is not None:
                u_n -= ground.normal_start[k, i] + load_factor * ground.normal[k, i]
                u_s -= ground.shear_start[k, i] + load_factor * ground.shear[k, i]
            dilatant_opening, kappa = 0.0, 0.0
            if special is not None:
                dilatant_opening = tile.dilatant_opening[k, i]
            if softening is not None:
                kappa = tile.kappa[k, i]
            history = tile.slip[k, i], dilatant_opening, tile.cracked[k, i] != 0.0, kappa
            sigma, tau, slip, dilatant_opening, cracked, kappa = explicit_update(
                u_n, u_s, history, parameters, special, softening
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
            total_m += area * offset * sigma
        pull_x = total_n * n_x + total_s * n_y
        pull_y = total_n * n_y - total_s * n_x
        tile.on_a[0, i] = pull_x
        tile.on_a[1, i] = pull_y
        tile.on_a[2, i] = total_n * arm_a[0] + total_s * arm_a[1] + total_m
        tile.on_b[0, i] = -pull_x
        tile.on_b[1, i] = -pull_y
        tile.on_b[2, i] = -(total_n * arm_b[0] + total_s * arm_b[1] + total_m)
        if elastic is not None:
            tile.on_a[3, i] = -(tile.rows_a[0, i] * total_n + tile.rows_a[2, i] * total_s)
            tile.on_a[4, i] = -(tile.rows_a[1, i] * total_n + tile.rows_a[3, i] * total_s + tile.rows_a[4, i] * total_m)
            tile.on_b[3, i] = -(tile.rows_b[0, i] * total_n + tile.rows_b[2, i] * total_s)
            tile.on_b[4, i] = -(tile.rows_b[1, i] * total_n + tile.rows_b[3, i] * total_s + tile.rows_b[4, i] * total_m)


@kernel
def contact_fields(interfaces, ground, history, displacement, fields):
    """Fill opening, shear displacement (m), normal and shear stress (Pa) of all contacts, (4, m, q); update history."""
    first_ground = interfaces.edge.size - ground.normal.shape[0]
    slips, openings, cracks, kappas = history
    for i in range(interfaces.edge.size):
        middle, along, turn = interface_displacement(interfaces.edge[i], interfaces.elastic, displacement, i)
        parameters = interfaces.properties[i]
        for k in range(interfaces.contact_area.shape[1]):
            u_n = middle + interfaces.contact_offset[i, k] * turn - ground_at(ground.normal, first_ground, i, k)
            u_s = along - ground_at(ground.shear, first_ground, i, k)
            before = slips[i, k], openings[i, k], cracks[i, k], kappas[i, k]
            sigma, tau, slips[i, k], openings[i, k], cracks[i, k], kappas[i, k] = explicit_update(
                u_n, u_s, before, parameters, True, ALL_SHAPES
            )
            fields[0, i, k], fields[1, i, k], fields[2, i, k], fields[3, i, k] = u_n, u_s, sigma, tau
