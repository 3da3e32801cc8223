"""Superelement of a yielding block in the quasi-static solver: equilibrium of its interior, static condensation."""

from typing import NamedTuple

import numpy as np

from damagepred.kernels.jit import kernel_making_arrays, law
from damagepred.kernels.zone.law import zone_return, zone_tangent


class InteriorOptions(NamedTuple):
    """Options of Newton's method for the equilibrium inside a block.

    Attributes
    ----------
    max_iterations : int
        Newton iterations.
    max_line_search_steps : int
        Reductions of a Newton step.
    slope_ratio : float
        Slope of the energy at the end of a step, over that at its start, that ends the line search (1).
    residual_stiffness : float
        Share of the elastic moduli added to the tangent of yielding zones, so that it is not singular (1).
    """

    max_iterations: int = 200
    max_line_search_steps: int = 20
    slope_ratio: float = 0.5
    residual_stiffness: float = 1e-5


OPTIONS = InteriorOptions()


@law
def _trial_stress(zones, z, slopes, moduli, plastic, bending, u):
    """Return the elastic trial stress s_xx, s_yy, s_xy, s_zz (Pa) of a zone."""
    a, b, c, first = 2 * zones[z, 0], 2 * zones[z, 1], 2 * zones[z, 2], z - z % 4
    q_x, q_y, bent = 0.0, 0.0, bending.strain[z]
    for k in range(first, first + 4):
        q_x += bending.gamma[k] * u[2 * zones[k, 0]]
        q_y += bending.gamma[k] * u[2 * zones[k, 0] + 1]
    x_b, y_b, x_c, y_c = u[b] - u[a], u[b + 1] - u[a + 1], u[c] - u[a], u[c + 1] - u[a + 1]
    e_xx = slopes[0] * x_b + slopes[2] * x_c + bent[0, 0] * q_x + bent[0, 1] * q_y - plastic[0]
    e_yy = slopes[1] * y_b + slopes[3] * y_c + bent[1, 0] * q_x + bent[1, 1] * q_y - plastic[1]
    g_xy = slopes[1] * x_b + slopes[3] * x_c + slopes[0] * y_b + slopes[2] * y_c
    g_xy += bent[2, 0] * q_x + bent[2, 1] * q_y - plastic[2]
    e_zz = -plastic[3]
    c11, c12, c33, c13, czz = moduli[0], moduli[1], moduli[2], moduli[3], moduli[4]
    return (
        c11 * e_xx + c12 * e_yy + c13 * e_zz,
        c12 * e_xx + c11 * e_yy + c13 * e_zz,
        c33 * g_xy,
        c13 * (e_xx + e_yy) + czz * e_zz,
    )


@law
def _as_tuple(values):
    """Return seven numbers as a tuple."""
    return values[0], values[1], values[2], values[3], values[4], values[5], values[6]


@kernel_making_arrays
def internal_force(zones, slopes, volume, elasticity, strength, plastic, bending, u, force, stiffness):
    """Fill the internal force of a block's gridpoints and its consistent tangent; return the largest nodal force (N).

    Parameters
    ----------
    zones, slopes, volume, elasticity, strength, plastic, bending, u
        As ``condensed_response``.
    force : array (2 g,)
        Filled.
    stiffness : array (2 g, 2 g) or of no size
        Filled, unless it has no size.
    """
    moduli, limits = _as_tuple(elasticity), _as_tuple(strength)
    rows, tangent, dof = np.zeros((3, 10)), np.zeros((3, 3)), np.zeros(10, dtype=np.int64)
    force[:] = 0.0
    stiffness[:] = 0.0
    largest = 0.0
    for z in range(zones.shape[0]):
        t = _trial_stress(zones, z, slopes[z], moduli, plastic[z], bending, u)
        s_xx, s_yy, s_xy, _, _, _, _, _, how = zone_return(t[0], t[1], t[2], t[3], moduli, limits)
        first, number = z - z % 4, z % 4
        for k in range(4):
            dof[2 * k], dof[2 * k + 1] = 2 * zones[first + k, 0], 2 * zones[first + k, 0] + 1
            for j in range(3):
                rows[j, 2 * k] = bending.gamma[first + k] * bending.strain[z, j, 0]
                rows[j, 2 * k + 1] = bending.gamma[first + k] * bending.strain[z, j, 1]
        dof[8], dof[9] = 2 * zones[z, 2], 2 * zones[z, 2] + 1
        rows[:, 8:] = 0.0
        for k, x, y in (
            (number, -slopes[z, 0] - slopes[z, 2], -slopes[z, 1] - slopes[z, 3]),
            ((number + 1) % 4, slopes[z, 0], slopes[z, 1]),
            (4, slopes[z, 2], slopes[z, 3]),
        ):
            rows[0, 2 * k] += x
            rows[2, 2 * k + 1] += x
            rows[1, 2 * k + 1] += y
            rows[2, 2 * k] += y
        for i in range(10):
            nodal = volume[z] * (rows[0, i] * s_xx + rows[1, i] * s_yy + rows[2, i] * s_xy)
            force[dof[i]] += nodal
            largest = max(largest, abs(nodal))
        if stiffness.size == 0:
            continue
        if how == 0:
            tangent[0, 0] = tangent[1, 1] = moduli[0]
            tangent[0, 1] = tangent[1, 0] = moduli[1]
            tangent[2, 2] = moduli[2]
            tangent[0, 2] = tangent[2, 0] = tangent[1, 2] = tangent[2, 1] = 0.0
        else:
            d = zone_tangent(t[0], t[1], t[2], t[3], moduli, limits)
            for i in range(3):
                for j in range(3):
                    tangent[i, j] = d[3 * i + j]
            tangent[0, 0] += OPTIONS.residual_stiffness * moduli[0]
            tangent[1, 1] += OPTIONS.residual_stiffness * moduli[0]
            tangent[2, 2] += OPTIONS.residual_stiffness * moduli[2]
        for i in range(10):
            for k in range(3):
                left = 0.0
                for j in range(3):
                    left += rows[j, i] * tangent[j, k]
                left *= volume[z]
                for c in range(10):
                    stiffness[dof[i], dof[c]] += left * rows[k, c]
    return largest


@kernel_making_arrays
def condensed_response(
    zones,
    slopes,
    volume,
    elasticity,
    strength,
    plastic,
    bending,
    place,
    count,
    flexibility,
    load,
    tolerance,
    u,
    boundary_force,
    boundary_stiffness,
):
    """Compute the internal force and tangent of a yielding block, statically condensed to its boundary.

    The interior is in equilibrium by Newton's method with line search; the tangent is the Schur complement.

    Parameters
    ----------
    zones : array of int (z, 3)
        Gridpoints by the block's own numbers.
    slopes : array (z, 4)
        Of the second and third shape function, x and y (1/m).
    volume : array (z,)
        Area times thickness (m3).
    elasticity, strength : array (7,)
        See ``damagepred.kernels.zone.law``.
    plastic : array (z, 4)
        Plastic strain of the last equilibrium.
    bending : NamedTuple of arrays
        See ``damagepred.solvers.system.deformable_blocks.Bending``, of these zones.
    place : array of int (2 g,)
        The block's degrees of freedom: the boundary's, then the interior's.
    count : int
        How many are of the boundary, r.
    flexibility : array (i, i)
        Inverse of the interior's elastic stiffness (m/N): descent direction where Newton's is none.
    load : array (i,)
        Load on the interior (N).
    tolerance : float
        Largest residual force over the largest nodal force of a zone (1).
    u : array (2 g,)
        Displacement (m); the interior's is changed.
    boundary_force : array (r,)
        Filled: internal force at the boundary (N); NaN if the interior finds no equilibrium.
    boundary_stiffness : array (r, r)
        Filled: its derivatives with the boundary's displacement (N/m).
    """
    size = u.size
    boundary, interior = place[:count], place[count:]
    force, stiffness = np.zeros(size), np.zeros((size, size))
    nothing = np.zeros((0, 0))
    largest = internal_force(zones, slopes, volume, elasticity, strength, plastic, bending, u, force, stiffness)
    residual = load - force[interior]
    largest_residual = np.abs(residual).max() if residual.size > 0 else 0.0
    interior_stiffness = np.zeros((interior.size, interior.size))
    for _ in range(OPTIONS.max_iterations):
        if not largest_residual > tolerance * largest:
            break
        for i in range(interior.size):
            for j in range(interior.size):
                interior_stiffness[i, j] = stiffness[interior[i], interior[j]]
        step = np.linalg.solve(interior_stiffness, residual)
        slope = np.dot(residual, step)
        if not slope > 0.0:
            step = flexibility @ residual
            slope = np.dot(residual, step)
        # line search: to where the energy no longer decreases along the step
        start, share = u[interior].copy(), 1.0
        for _ in range(OPTIONS.max_line_search_steps):
            for i in range(interior.size):
                u[interior[i]] = start[i] + share * step[i]
            largest = internal_force(zones, slopes, volume, elasticity, strength, plastic, bending, u, force, nothing)
            residual = load - force[interior]
            now = np.dot(residual, step)
            if now >= -OPTIONS.slope_ratio * slope:
                break
            share *= min(max(slope / (slope - now), 0.1), 0.9)
        largest_residual = np.abs(residual).max()
        internal_force(zones, slopes, volume, elasticity, strength, plastic, bending, u, force, stiffness)
    if not largest_residual <= 1e3 * tolerance * largest:
        boundary_force[:] = np.nan
        for i in range(count):
            for j in range(count):
                boundary_stiffness[i, j] = stiffness[i, j]
        return
    for i in range(count):
        boundary_force[i] = force[boundary[i]]
        for j in range(count):
            boundary_stiffness[i, j] = stiffness[boundary[i], boundary[j]]
    if interior.size == 0:
        return
    across = np.zeros((interior.size, count))
    for i in range(interior.size):
        for j in range(interior.size):
            interior_stiffness[i, j] = stiffness[interior[i], interior[j]]
        for j in range(count):
            across[i, j] = stiffness[interior[i], boundary[j]]
    recovery = np.linalg.solve(interior_stiffness, across)
    for i in range(count):
        for k in range(interior.size):
            left = stiffness[boundary[i], interior[k]]
            for j in range(count):
                boundary_stiffness[i, j] -= left * recovery[k, j]


@kernel_making_arrays
def commit_plastic_strain(zones, slopes, volume, elasticity, strength, bending, u, plastic, state):
    """Commit the plastic strain of a block at an equilibrium; return the plastic work (J).

    Parameters
    ----------
    zones, slopes, volume, elasticity, strength, bending, u
        As ``condensed_response``.
    plastic : array (z, 4)
        Plastic strain, brought up to date.
    state : array of int8 (z,)
        Filled: what yields now.
    """
    moduli, limits = _as_tuple(elasticity), _as_tuple(strength)
    work = 0.0
    for z in range(zones.shape[0]):
        t = _trial_stress(zones, z, slopes[z], moduli, plastic[z], bending, u)
        s_xx, s_yy, s_xy, s_zz, p_xx, p_yy, p_xy, p_zz, how = zone_return(t[0], t[1], t[2], t[3], moduli, limits)
        state[z] = how
        if how != 0:
            plastic[z, 0] += p_xx
            plastic[z, 1] += p_yy
            plastic[z, 2] += p_xy
            plastic[z, 3] += p_zz
            work += volume[z] * (s_xx * p_xx + s_yy * p_yy + s_xy * p_xy + s_zz * p_zz)
    return work
