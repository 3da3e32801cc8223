"""Forces and stiffness of all joints with their friction limits frozen, for the quasi-static solver.

With the largest shear stress of each contact frozen at ``bound`` and the opening by dilation at ``dilated``, every
contact is a spring with an energy that is convex in the displacements:

    sigma = k_n (u_n - d), only compression once cracked;   tau = k_s (u_s - s) cut to +/- bound

so its equilibrium is the minimum of an energy. Where the bounds agree with C - sigma tan(phi), this is the joint law.
"""

import numpy as np

from damagepred.kernels.contact import relative
from damagepred.kernels.jit import kernel, law

NO_LIMIT = 1e30
"""Shear stress that no joint reaches (Pa)."""


@law
def shear_limit(properties, cracked, sigma, i):
    """Return the largest shear stress (Pa) that a contact of interface i carries at a normal stress."""
    if not cracked:
        if properties.brittle_shear[i]:
            return NO_LIMIT  # it breaks there, and does not slide
        return max(properties.cohesion[i] - sigma * properties.friction[i], 0.0)
    if sigma > 0.0:
        return 0.0
    return max(properties.residual_cohesion[i] - sigma * properties.residual_friction[i], 0.0)


@kernel
def joint_forces(
    active, interfaces, properties, ground, memory, bound, dilated, live, displacement, progress, force, pattern
):
    """Add the forces of all contacts to ``force`` and note which springs act in ``pattern``.

    Parameters
    ----------
    active : array of int
        Interfaces to look at; so for all functions here.
    interfaces, properties, ground, memory : NamedTuple of arrays
        Model and memory of its joints.
    bound, dilated : array (m, q)
        Largest shear stress of each contact (Pa), and its opening by dilation (m), where frozen.
    live : bool
        Whether the limits follow the normal stress instead.
    displacement, force : array (3 (n + 1),)
        Of the blocks and the ground.
    progress : float
        Share of the full movement.
    pattern : array of int (m,)
        Four bits a contact: 1 the normal spring acts, 2 the shear spring acts, 4 or 8 it slips forwards or backwards
        at a limit that follows the normal stress.
    """
    first_ground = interfaces.block_a.size - ground.normal.shape[0]
    for i in active:
        opening, shear, turn = relative(interfaces, displacement, i)
        n_x, n_y = interfaces.normal_x[i], interfaces.normal_y[i]
        k_n, k_s = properties.normal_stiffness[i], properties.shear_stiffness[i]
        total_n, total_s, total_m, bits = 0.0, 0.0, 0.0, 0
        for k in range(interfaces.contact_area.shape[1]):
            at, area = interfaces.contact_offset[i, k], interfaces.contact_area[i, k]
            u_n, u_s = opening + at * turn, shear
            if i >= first_ground:
                u_n -= progress * ground.normal[i - first_ground, k]
                u_s -= progress * ground.shear[i - first_ground, k]
            u_n -= dilated[i, k]
            u_s -= memory.slip[i, k]
            pressed = u_n < 0.0 or not memory.cracked[i, k]
            if pressed:
                bits |= 1 << (4 * k)
                total_n += area * k_n * u_n
                total_m += area * at * k_n * u_n
            tau, limit = k_s * u_s, bound[i, k]
            if live:
                limit = shear_limit(properties, memory.cracked[i, k], k_n * u_n, i)
            if abs(tau) <= limit:
                if limit > 0.0:
                    bits |= 2 << (4 * k)
            else:
                if live and pressed and limit > 0.0:
                    bits |= (4 if tau > 0.0 else 8) << (4 * k)
                tau = np.copysign(limit, tau)
            total_s += area * tau
        pattern[i] = bits
        pull_x = total_n * n_x + total_s * n_y
        pull_y = total_n * n_y - total_s * n_x
        a, b = 3 * interfaces.block_a[i], 3 * interfaces.block_b[i]
        force[a] += pull_x
        force[a + 1] += pull_y
        force[a + 2] += total_n * interfaces.arm_normal_a[i] + total_s * interfaces.arm_shear_a[i] + total_m
        force[b] -= pull_x
        force[b + 1] -= pull_y
        force[b + 2] -= total_n * interfaces.arm_normal_b[i] + total_s * interfaces.arm_shear_b[i] + total_m


@kernel
def friction_bounds(active, interfaces, properties, ground, memory, displacement, progress, bound, dilated):
    """Set each contact's largest shear stress (Pa) to what the present normal stress allows, and its dilation (m).

    Returns
    -------
    float
        Largest change of the force that dilation makes (N).
    """
    change = 0.0
    first_ground = interfaces.block_a.size - ground.normal.shape[0]
    for i in active:
        opening, shear, turn = relative(interfaces, displacement, i)
        k_n, k_s, psi = properties.normal_stiffness[i], properties.shear_stiffness[i], properties.dilation[i]
        for k in range(interfaces.contact_area.shape[1]):
            u_n, u_s = opening + interfaces.contact_offset[i, k] * turn, shear - memory.slip[i, k]
            if i >= first_ground:
                u_n -= progress * ground.normal[i - first_ground, k]
                u_s -= progress * ground.shear[i - first_ground, k]
            limit = shear_limit(properties, memory.cracked[i, k], k_n * (u_n - dilated[i, k]), i)
            bound[i, k] = limit
            if psi > 0.0 and limit > 0.0:
                travelled = max(abs(u_s) - limit / k_s, 0.0)
                target = memory.dilated[i, k] + psi * travelled
                change = max(change, k_n * abs(target - dilated[i, k]) * interfaces.contact_area[i, k])
                # half way: the more it dilates the more it is pressed and the less it slides
                dilated[i, k] += 0.5 * (target - dilated[i, k])
    return change


@law
def gained(new, old, bit):
    """Return 1 if a bit is new, -1 if it is gone, 0 if it stays."""
    return ((new >> bit) & 1) - ((old >> bit) & 1)


@kernel
def change_stiffness(
    active, interfaces, properties, memory, pattern, old,
    place, level, diagonal, down, up, at_diagonal, at_coupling, size,
):  # fmt: skip
    """Bring the levels' stiffness from one pattern of acting springs to another; return the farthest level changed.

    Parameters
    ----------
    memory : NamedTuple of arrays
        Tells which bonds are broken and so which friction a slipping contact has.
    pattern, old : array of int (m,)
        Acting springs wanted and those that the stiffness holds; ``old`` becomes ``pattern``.
    place : array of int (3 (n + 1),)
        Place of each degree of freedom in its level, -1 if it is held.
    level : array of int (n + 1,)
        Level of each block.
    diagonal, down, up : array
        Stiffness within each level; its rows and the columns of the next level nearer to the ground; those rows and its
        columns; one level after the other, row by row.
    at_diagonal, at_coupling, size : array of int (levels,)
        Where those of a level start, and its number of degrees of freedom.
    """
    farthest = -1
    row_n, row_s = np.empty(6), np.empty(6)
    for i in active:
        if pattern[i] == old[i]:
            continue
        a, b = interfaces.block_a[i], interfaces.block_b[i]
        n_x, n_y = interfaces.normal_x[i], interfaces.normal_y[i]
        # one row is the opening of a contact for unit displacements of the two blocks, the other the shear
        row_n[0], row_n[1], row_n[3], row_n[4] = -n_x, -n_y, n_x, n_y
        row_s[0], row_s[1], row_s[3], row_s[4] = -n_y, n_x, n_y, -n_x
        row_s[2], row_s[5] = -interfaces.arm_shear_a[i], interfaces.arm_shear_b[i]
        for k in range(interfaces.contact_area.shape[1]):
            gain_n = gained(pattern[i], old[i], 4 * k)
            gain_s = gained(pattern[i], old[i], 4 * k + 1)
            gain_c = gained(pattern[i], old[i], 4 * k + 2) - gained(pattern[i], old[i], 4 * k + 3)
            if gain_n == 0 and gain_s == 0 and gain_c == 0:
                continue
            at, area = interfaces.contact_offset[i, k], interfaces.contact_area[i, k]
            row_n[2] = -(interfaces.arm_normal_a[i] + at)
            row_n[5] = interfaces.arm_normal_b[i] + at
            stiff_n = gain_n * properties.normal_stiffness[i] * area
            stiff_s = gain_s * properties.shear_stiffness[i] * area
            # sliding forwards, the shear falls as the joint opens: the one part that is not symmetric
            friction = properties.residual_friction[i] if memory.cracked[i, k] else properties.friction[i]
            stiff_c = -gain_c * friction * properties.normal_stiffness[i] * area
            for r in range(6):
                block_r = a if r < 3 else b
                at_r = place[3 * block_r + r % 3]
                if at_r < 0:
                    continue
                level_r = level[block_r]
                for c in range(6):
                    block_c = a if c < 3 else b
                    at_c = place[3 * block_c + c % 3]
                    if at_c < 0:
                        continue
                    level_c = level[block_c]
                    value = (stiff_n * row_n[r] + stiff_c * row_s[r]) * row_n[c] + stiff_s * row_s[r] * row_s[c]
                    if level_r == level_c:
                        diagonal[at_diagonal[level_r] + at_r * size[level_r] + at_c] += value
                        farthest = max(farthest, level_r)
                    elif level_r == level_c + 1:
                        down[at_coupling[level_r] + at_r * size[level_c] + at_c] += value
                        farthest = max(farthest, level_r)
                    else:
                        up[at_coupling[level_c] + at_r * size[level_c] + at_c] += value
                        farthest = max(farthest, level_c)
        old[i] = pattern[i]
    return farthest
