"""Zones of deformable blocks that move as far as they like, their gridpoints, and the facets of their boundary.

With F = dx/dX the deformation gradient of a zone and F = R U its polar decomposition, a zone is strained by U - 1
(Biot), seen in a frame that turns with it. In the plane R is closed: its cosine and sine are F_xx + F_yy and
F_yx - F_xy over their common length, which is tr U. The law is that of small strains in that frame: T = C (U - 1 - p),
with p the plastic strain, brought back to what the zone bears.

With V the volume, V (U - 1 - p) : C : (U - 1 - p) / 2 is the energy held, and for any change of F

    T : dU = Q : (R^T dF),    Q = T but for Q_yx = T_xy - k, Q_xy = T_xy + k,
    k = (T_xy (U_xx - U_yy) - (T_xx - T_yy) U_xy) / tr U

as what R turns by is ((R^T dF)_yx - (R^T dF)_xy) / tr U. So the forces -V R Q grad N on the gridpoints are the exact
gradient of that energy at any rotation, and they turn nothing: Q U is symmetric. k is nothing in an elastic isotropic
zone, where T and U have the same axes; it is not with plastic strain or damping. Angles do not occur, nothing drifts,
and however far a block turns, what it holds depends on its strains alone.

Of the bending of its cell a zone is strained by B R^T q in addition (``Bending`` in
``damagepred.solvers.system.deformable_blocks``), with q the hourglass displacement of the cell, which turns as the
cell does. With a = B^T T and p = R^T q that adds V R a to what resists q, and, as p turns with R, -(a_x p_y - a_y p_x)
/ tr U to k. T and a are of the whole strain, k has U.

Contacts know bodies with poses, not gridpoints. A facet, and every place of a facet to which a joint belongs, is such a
body (``FACET_BODY``): its two gridpoints give its place, their chord its angle. The force (X, Y) and the moment M on it
are shared by the two gridpoints so that they do the same work: shares of (X, Y), and M over the length of the chord,
across it. Energy, momentum and angular momentum are conserved.
"""

import math

import numpy as np

from damagepred.kernels.dynamics.motion import BOUNDARY, advance_free, advance_prescribed, prescribed_power
from damagepred.kernels.jit import law, rule
from damagepred.kernels.zone.law import within_yield_surface, zone_return

YIELDING, ZONE_DAMPING, ZONE_TERMS = 0, 1, 2
"""What is counted while zones act (J): work of plastic strain, and of stiffness-proportional damping."""

ZONE = np.dtype(
    [
        ("a", "i8"),
        ("b", "i8"),
        ("c", "i8"),
        ("block", "i8"),
        ("history", "i8"),
        ("b_x", "f8"),
        ("b_y", "f8"),
        ("c_x", "f8"),
        ("c_y", "f8"),
        ("volume", "f8"),
        ("gamma", "f8"),
        ("xx_x", "f8"),
        ("xx_y", "f8"),
        ("yy_x", "f8"),
        ("yy_y", "f8"),
        ("xy_x", "f8"),
        ("xy_y", "f8"),
    ]
)
"""A zone: its gridpoints, block, place of its history variables, -1 if it stays elastic; slopes of the shape functions
of b and c (1/m); area times thickness (m3); share of a's displacement in the hourglass displacement of its cell of four
zones; by how much e_xx, e_yy, g_xy grow with that in x and in y (1/m)."""

FACET_BODY = np.dtype([("start", "i8"), ("end", "i8"), ("share", "f8"), ("along_x", "f8"), ("along_y", "f8")])
"""A body on a facet: the facet's gridpoints, counter-clockwise; where it is between them, 0 at the start, 1 at the end;
direction from start to end before anything moved."""


@law
def _displacement_gradient(zone, moved):
    """Return du_x/dX, du_x/dY, du_y/dX, du_y/dY of a constant-strain triangle."""
    x_b, y_b = moved[zone.b, 0] - moved[zone.a, 0], moved[zone.b, 1] - moved[zone.a, 1]
    x_c, y_c = moved[zone.c, 0] - moved[zone.a, 0], moved[zone.c, 1] - moved[zone.a, 1]
    return (
        zone.b_x * x_b + zone.c_x * x_c,
        zone.b_y * x_b + zone.c_y * x_c,
        zone.b_x * y_b + zone.c_x * y_c,
        zone.b_y * y_b + zone.c_y * y_c,
    )


@law
def _polar_decomposition(h_xx, h_xy, h_yx, h_yy):
    """Return U_xx - 1, U_yy - 1, U_xy, cosine and sine of R, and 1 / tr U of the polar decomposition F = R U.

    Closed form in the plane (Hoger and Carlson 1984).
    """
    trace, twist = 2.0 + h_xx + h_yy, h_yx - h_xy
    inverse = 1.0 / math.sqrt(trace * trace + twist * twist)
    c, s = trace * inverse, twist * inverse
    return (
        c * h_xx + s * h_yx + (c - 1.0),
        c * h_yy - s * h_xy + (c - 1.0),
        c * h_xy + s * (1.0 + h_yy),
        c,
        s,
        inverse,
    )


@law
def _plastic_stress(zone, e_xx, e_yy, g_xy, elasticity, strength, plastic, stress, state, terms):
    """Return the corotated stress s_xx, s_yy, s_xy (Pa) by Mohr-Coulomb return mapping; commit the zone's history."""
    c, b, m = elasticity, zone.block, zone.history
    t_xx, t_yy, p_zz = e_xx - plastic[m, 0], e_yy - plastic[m, 1], plastic[m, 3]
    s_xx = c[b, 0] * t_xx + c[b, 1] * t_yy - c[b, 3] * p_zz
    s_yy = c[b, 1] * t_xx + c[b, 0] * t_yy - c[b, 3] * p_zz
    s_xy = c[b, 2] * (g_xy - plastic[m, 2])
    s_zz = c[b, 3] * (t_xx + t_yy) - c[b, 4] * p_zz
    l = strength
    limits = (l[b, 0], l[b, 1], l[b, 2], l[b, 3], l[b, 4], l[b, 5], l[b, 6])
    state[m] = 0
    if not within_yield_surface(s_xx, s_yy, s_xy, s_zz, limits):
        s_xx, s_yy, s_xy, s_zz, p_xx, p_yy, p_xy, p_zz, how = zone_return(
            s_xx, s_yy, s_xy, s_zz, (c[b, 0], c[b, 1], c[b, 2], c[b, 3], c[b, 4], c[b, 5], c[b, 6]), limits
        )
        work = (s_xx + stress[m, 0]) * p_xx + (s_yy + stress[m, 1]) * p_yy
        work += (s_xy + stress[m, 2]) * p_xy + (s_zz + stress[m, 3]) * p_zz
        terms[YIELDING] += 0.5 * zone.volume * work
        plastic[m, 0] += p_xx
        plastic[m, 1] += p_yy
        plastic[m, 2] += p_xy
        plastic[m, 3] += p_zz
        state[m] = how
    stress[m, 0], stress[m, 1], stress[m, 2], stress[m, 3] = s_xx, s_yy, s_xy, s_zz
    return s_xx, s_yy, s_xy


@law
def _damped_stress(past, z, volume, e_xx, e_yy, g_xy, s_xx, s_yy, s_xy, per_step, terms):
    """Return s_xx, s_yy, s_xy (Pa) with stiffness-proportional (Rayleigh) damping, and count its work."""
    d_xx, d_yy = per_step * (s_xx - past[z, 3]), per_step * (s_yy - past[z, 4])
    d_xy = per_step * (s_xy - past[z, 5])
    work = (d_xx + past[z, 6]) * (e_xx - past[z, 0]) + (d_yy + past[z, 7]) * (e_yy - past[z, 1])
    work += (d_xy + past[z, 8]) * (g_xy - past[z, 2])
    terms[ZONE_DAMPING] += 0.5 * volume * work
    past[z, 0], past[z, 1], past[z, 2] = e_xx, e_yy, g_xy
    past[z, 3], past[z, 4], past[z, 5] = s_xx, s_yy, s_xy
    past[z, 6], past[z, 7], past[z, 8] = d_xx, d_yy, d_xy
    return s_xx + d_xx, s_yy + d_yy, s_xy + d_xy


@rule
def zone_forces(grid, per_step):
    """Add the internal forces of all zones to the forces on gridpoints (corotational constant-strain triangles).

    Parameters
    ----------
    grid : NamedTuple of arrays
        See ``damagepred.solvers.dynamics.gridpoints``.
    per_step : float
        Stiffness-proportional damping over the time step (1).
    """
    moved, force, zones, moduli = grid.displacement, grid.force, grid.zones, grid.elasticity
    past, damped = grid.past, grid.past.shape[0] > 0
    q_x, q_y, against_x, against_y = 0.0, 0.0, 0.0, 0.0
    for z in range(zones.size):
        zone = zones[z]
        if z % 4 == 0:
            q_x, q_y, against_x, against_y = 0.0, 0.0, 0.0, 0.0
            for i in range(z, z + 4):
                q_x += zones[i].gamma * moved[zones[i].a, 0]
                q_y += zones[i].gamma * moved[zones[i].a, 1]
        h_xx, h_xy, h_yx, h_yy = _displacement_gradient(zone, moved)
        u_xx, u_yy, u_xy, c, s, inverse = _polar_decomposition(h_xx, h_xy, h_yx, h_yy)
        p_x, p_y = c * q_x + s * q_y, c * q_y - s * q_x
        e_xx = u_xx + zone.xx_x * p_x + zone.xx_y * p_y
        e_yy = u_yy + zone.yy_x * p_x + zone.yy_y * p_y
        g_xy = 2.0 * u_xy + zone.xy_x * p_x + zone.xy_y * p_y
        if zone.history < 0:
            c11, c12 = moduli[zone.block, 0], moduli[zone.block, 1]
            s_xx, s_yy, s_xy = c11 * e_xx + c12 * e_yy, c12 * e_xx + c11 * e_yy, moduli[zone.block, 2] * g_xy
        else:
            s_xx, s_yy, s_xy = _plastic_stress(
                zone,
                e_xx,
                e_yy,
                g_xy,
                moduli,
                grid.strength,
                grid.plastic,
                grid.stress,
                grid.state,
                grid.terms,
            )
        if damped:
            s_xx, s_yy, s_xy = _damped_stress(
                past, z, zone.volume, e_xx, e_yy, g_xy, s_xx, s_yy, s_xy, per_step, grid.terms
            )
        a_x = zone.xx_x * s_xx + zone.yy_x * s_yy + zone.xy_x * s_xy
        a_y = zone.xx_y * s_xx + zone.yy_y * s_yy + zone.xy_y * s_xy
        against_x += zone.volume * (c * a_x - s * a_y)
        against_y += zone.volume * (s * a_x + c * a_y)
        k = inverse * (s_xy * (u_xx - u_yy) - (s_xx - s_yy) * u_xy - (a_x * p_y - a_y * p_x))
        s_xx, s_yy = zone.volume * s_xx, zone.volume * s_yy
        q_xy, q_yx = zone.volume * (s_xy + k), zone.volume * (s_xy - k)
        p_xx, p_xy, p_yx, p_yy = c * s_xx - s * q_yx, c * q_xy - s * s_yy, s * s_xx + c * q_yx, s * q_xy + c * s_yy
        b_x, b_y = p_xx * zone.b_x + p_xy * zone.b_y, p_yx * zone.b_x + p_yy * zone.b_y
        c_x, c_y = p_xx * zone.c_x + p_xy * zone.c_y, p_yx * zone.c_x + p_yy * zone.c_y
        force[zone.a, 0] += b_x + c_x
        force[zone.a, 1] += b_y + c_y
        force[zone.b, 0] -= b_x
        force[zone.b, 1] -= b_y
        force[zone.c, 0] -= c_x
        force[zone.c, 1] -= c_y
        if z % 4 == 3:
            for i in range(z - 3, z + 1):
                force[zones[i].a, 0] -= zones[i].gamma * against_x
                force[zones[i].a, 1] -= zones[i].gamma * against_y


@rule
def update_facet_poses(grid, pose, first):
    """Update the poses of the bodies on facets from their gridpoints.

    Parameters
    ----------
    grid : NamedTuple of arrays
        See ``damagepred.solvers.dynamics.gridpoints``.
    pose : array (bodies, 4)
        x, y (m), cosine and sine of the rotation: those of the bodies on facets are filled.
    first : int
        Number of the first body on a facet.
    """
    facets, at, moved = grid.facets, grid.reference, grid.displacement
    for i in range(facets.size):
        facet = facets[i]
        x0, y0 = at[facet.start, 0] + moved[facet.start, 0], at[facet.start, 1] + moved[facet.start, 1]
        x, y = at[facet.end, 0] + moved[facet.end, 0] - x0, at[facet.end, 1] + moved[facet.end, 1] - y0
        inverse = 1.0 / math.sqrt(x * x + y * y)
        pose[first + i, 0] = x0 + facet.share * x
        pose[first + i, 1] = y0 + facet.share * y
        pose[first + i, 2] = inverse * (facet.along_x * x + facet.along_y * y)
        pose[first + i, 3] = inverse * (facet.along_x * y - facet.along_y * x)


@rule
def scatter_facet_forces(grid, force, first):
    """Scatter the forces on facets to their gridpoints, statically equivalent.

    Parameters
    ----------
    grid : NamedTuple of arrays
        See ``damagepred.solvers.dynamics.gridpoints``; ``force`` is added to.
    force : array (bodies, 3)
        Force x, y (N) and moment (N m) on each body.
    first : int
        Number of the first body on a facet.
    """
    facets, at, moved, on = grid.facets, grid.reference, grid.displacement, grid.force
    for i in range(facets.size):
        x, y, moment = force[first + i, 0], force[first + i, 1], force[first + i, 2]
        if (x == 0.0) & (y == 0.0) & (moment == 0.0):
            continue
        facet = facets[i]
        along_x = at[facet.end, 0] + moved[facet.end, 0] - (at[facet.start, 0] + moved[facet.start, 0])
        along_y = at[facet.end, 1] + moved[facet.end, 1] - (at[facet.start, 1] + moved[facet.start, 1])
        moment /= along_x * along_x + along_y * along_y
        on[facet.start, 0] += (1.0 - facet.share) * x + moment * along_y
        on[facet.start, 1] += (1.0 - facet.share) * y - moment * along_x
        on[facet.end, 0] += facet.share * x - moment * along_y
        on[facet.end, 1] += facet.share * y + moment * along_x


@rule
def advance_gridpoints(grid, loading, k, time_step, local_damping, mass_damping, body_terms):
    """Advance all gridpoints by one step, as ``advance_bodies``.

    Parameters
    ----------
    grid : NamedTuple of arrays
        See ``damagepred.solvers.dynamics.gridpoints``.
    loading, k, time_step, local_damping, mass_damping, body_terms
        See ``advance_bodies``.
    """
    base = ((loading[k + 1, 0] - loading[k, 0]) / time_step, (loading[k + 1, 1] - loading[k, 1]) / time_step)
    advance_free(grid, grid.velocity.shape[0], base, time_step, local_damping, mass_damping, body_terms)
    advance_prescribed(grid, loading, k, time_step, body_terms)
    grid.force[:] = 0.0


@rule
def add_gridpoint_boundary_work(grid, time_step, body_terms):
    """Add the second half of a step's work at prescribed gridpoints (trapezoidal rule, forces at its end).

    Parameters
    ----------
    grid : NamedTuple of arrays
        See ``damagepred.solvers.dynamics.gridpoints``.
    time_step : float
        dt (s).
    body_terms : array (BODY_TERMS,)
        Added to (J).
    """
    body_terms[BOUNDARY] -= 0.5 * time_step * prescribed_power(grid, 0.0)


@rule
def largest_gridpoint_movement(grid, base_x, base_y):
    """Return an upper bound of a boundary gridpoint's displacement relative to the base since the last search (m).

    Parameters
    ----------
    grid : NamedTuple of arrays
        See ``damagepred.solvers.dynamics.gridpoints``.
    base_x, base_y : float
        Displacement of the base since then (m).
    """
    now, searched_at, largest = grid.displacement, grid.searched_at, 0.0
    for i in range(grid.boundary.size):
        j = grid.boundary[i]
        moved = abs(now[j, 0] - searched_at[j, 0] - base_x) + abs(now[j, 1] - searched_at[j, 1] - base_y)
        largest = moved if not moved <= largest else largest
    return largest
