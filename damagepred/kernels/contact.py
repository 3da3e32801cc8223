"""Forces of all interfaces on the blocks they join, from the displacements of the blocks.

An interface is a straight edge, so the opening along it is linear and the shear constant: both follow from three
numbers (opening and shear at its middle, relative rotation). The contacts, its integration points, share them.
"""

from damagepred.kernels.jit import kernel, law
from damagepred.kernels.joint import joint_law


@law
def contact_forces(interfaces, properties, ground, state, displacement, progress, force):
    """Add the forces of all contacts to ``force`` and bring ``state`` up to date.

    Parameters
    ----------
    interfaces, properties, ground, state : NamedTuple of arrays
        See ``damagepred.assembly.model`` and ``damagepred.solvers.state``.
    displacement, force : array (3 (blocks + 1),)
        x, y, rotation of each block and what acts on them (N, N, N m); the last block is the ground.
    progress : float
        Share of the full movement reached.
    """
    points = interfaces.contact_area.shape[1]
    first_ground = interfaces.block_a.size - ground.normal.shape[0]
    for i in range(interfaces.block_a.size):
        a, b = 3 * interfaces.block_a[i], 3 * interfaces.block_b[i]
        n_x, n_y = interfaces.normal_x[i], interfaces.normal_y[i]
        d_x = displacement[b] - displacement[a]
        d_y = displacement[b + 1] - displacement[a + 1]
        turn_a, turn_b = displacement[a + 2], displacement[b + 2]
        arm_na, arm_sa = interfaces.arm_normal_a[i], interfaces.arm_shear_a[i]
        arm_nb, arm_sb = interfaces.arm_normal_b[i], interfaces.arm_shear_b[i]
        opening = n_x * d_x + n_y * d_y + arm_nb * turn_b - arm_na * turn_a
        shear = n_y * d_x - n_x * d_y + arm_sb * turn_b - arm_sa * turn_a
        turn = turn_b - turn_a
        k_n, k_s = properties.normal_stiffness[i], properties.shear_stiffness[i]
        strength = (properties.tensile_strength[i], properties.cohesion[i], properties.friction[i])
        weakened = (
            properties.residual_tensile_strength[i],
            properties.residual_cohesion[i],
            properties.residual_friction[i],
        )
        psi, brittle = properties.dilation[i], properties.brittle_shear[i]
        total_n, total_s, total_m = 0.0, 0.0, 0.0
        for k in range(points):
            at = interfaces.contact_offset[i, k]
            u_n = opening + at * turn
            u_s = shear
            if i >= first_ground:
                u_n -= progress * ground.normal[i - first_ground, k]
                u_s -= progress * ground.shear[i - first_ground, k]
            sigma, tau, state.slip[i, k], state.dilated[i, k], state.cracked[i, k] = joint_law(
                u_n, u_s, state.slip[i, k], state.dilated[i, k], state.cracked[i, k],
                k_n, k_s, strength, weakened, psi, brittle,
            )  # fmt: skip
            area = interfaces.contact_area[i, k]
            total_n += area * sigma
            total_s += area * tau
            total_m += area * at * sigma
        pull_x = total_n * n_x + total_s * n_y
        pull_y = total_n * n_y - total_s * n_x
        force[a] += pull_x
        force[a + 1] += pull_y
        force[a + 2] += total_n * arm_na + total_s * arm_sa + total_m
        force[b] -= pull_x
        force[b + 1] -= pull_y
        force[b + 2] -= total_n * arm_nb + total_s * arm_sb + total_m


@kernel
def contact_fields(interfaces, properties, ground, state, displacement, progress, opening, shear, sigma, tau):
    """Fill opening, shear displacement (m), normal and shear stress (Pa) of all contacts, arrays (m, q); no memory moves.

    Parameters are those of ``contact_forces``.
    """
    first_ground = interfaces.block_a.size - ground.normal.shape[0]
    for i in range(interfaces.block_a.size):
        a, b = 3 * interfaces.block_a[i], 3 * interfaces.block_b[i]
        n_x, n_y = interfaces.normal_x[i], interfaces.normal_y[i]
        d_x = displacement[b] - displacement[a]
        d_y = displacement[b + 1] - displacement[a + 1]
        turn_a, turn_b = displacement[a + 2], displacement[b + 2]
        middle = (
            n_x * d_x + n_y * d_y + interfaces.arm_normal_b[i] * turn_b - interfaces.arm_normal_a[i] * turn_a
        )
        along = (
            n_y * d_x - n_x * d_y + interfaces.arm_shear_b[i] * turn_b - interfaces.arm_shear_a[i] * turn_a
        )
        strength = (properties.tensile_strength[i], properties.cohesion[i], properties.friction[i])
        weakened = (
            properties.residual_tensile_strength[i],
            properties.residual_cohesion[i],
            properties.residual_friction[i],
        )
        for k in range(interfaces.contact_area.shape[1]):
            u_n = middle + interfaces.contact_offset[i, k] * (turn_b - turn_a)
            u_s = along
            if i >= first_ground:
                u_n -= progress * ground.normal[i - first_ground, k]
                u_s -= progress * ground.shear[i - first_ground, k]
            opening[i, k] = u_n
            shear[i, k] = u_s
            sigma[i, k], tau[i, k], _, _, _ = joint_law(
                u_n, u_s, state.slip[i, k], state.dilated[i, k], state.cracked[i, k],
                properties.normal_stiffness[i], properties.shear_stiffness[i], strength, weakened,
                properties.dilation[i], properties.brittle_shear[i],
            )  # fmt: skip
