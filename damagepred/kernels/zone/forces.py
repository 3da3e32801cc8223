"""Zones of deformable blocks in the explicit solver: strain, stress, forces on gridpoints; eight blocks side by side.

Strain and stress are constant in a triangle (paper, Eqs 5 and 6): with the gridpoints' displacement u relative to the
first one and the slopes of the shape functions, e = sum of u grad N + B q. The second term, with the hourglass
displacement q = sum of gamma u of the cell's corners, gives the cell the stiffness of a beam in bending (see
``damagepred.solvers.system.deformable_blocks.Bending``); forces are the exact gradient of the energy of these strains.
The law is written in total strain with the plastic strain as memory, so what stays elastic remembers nothing and is
not rounded. A batch is up to eight blocks with zones of the same pattern: one value of each block side by side. Zones
come in cells of four, which share a gridpoint.
"""

from typing import NamedTuple

import numpy as np
from numba import types

from damagepred.arrays import FloatArray, IntArray
from damagepred.kernels.jit import kernel, law, rule
from damagepred.kernels.structures import FLOATS, INTEGERS
from damagepred.kernels.zone.law import four, seven, within_yield_surface, zone_return

LANES = 8
"""Blocks in a batch."""
Y = np.uint64(LANES)


SHAPE = np.dtype(
    [
        ("slopes", "f8", (4, 4, LANES)),
        ("volume", "f8", (4, LANES)),
        ("gamma", "f8", (4, LANES)),
        ("bending", "f8", (4, 6, LANES)),
    ]
)
"""Shape of a cell, four zones round their common gridpoint, in the blocks of a batch.

``slopes``: of the shape functions of a zone's second gridpoint along x and y, and of the common one (1/m). ``volume``:
area times thickness (m3). ``gamma``: share of each corner's displacement in the hourglass displacement q (1).
``bending``: e_xx, e_yy and g_xy of a zone, each for q in x and in y (1/m).
"""
MEMORY = np.dtype([("plastic", "f8", (4, 4, LANES)), ("state", "f8", (4, LANES))])
"""History variables of a cell whose zones can yield: plastic strain e_xx, e_yy, g_xy, e_zz; what yields now, 0 nothing,
1 shear, 2 tension, 3 both."""
WORK = np.dtype(
    [
        ("displacement_at", "f8", (5, 2, LANES)),
        ("force_at", "f8", (5, 2, LANES)),
        ("hourglass", "f8", (2, LANES)),
        ("yields", "f8", (4, LANES)),
        ("lanes", "u8"),
    ]
)
"""Work arrays of a cell: displacement of, and force on, the four corners and the common gridpoint, x and y; hourglass
displacement; 1 where a stress exceeds the yield limit. ``lanes``: 8, at run time: the compiler vectorises loops over
records, and would unroll them if it knew their length."""
MODULI = np.dtype([("elasticity", "f8", (7, LANES)), ("strength", "f8", (7, LANES))])
"""Material of a batch; see ``damagepred.kernels.zone.law``."""


class Facets(NamedTuple):
    """Pieces of facets, f of them, for ``place_facets`` and ``scatter_facet_forces``."""

    start_x: IntArray  # (f,) Degrees of freedom of the gridpoints at both ends of the facet
    start_y: IntArray
    end_x: IntArray
    end_y: IntArray
    start_share: FloatArray  # (f,) Shares of the two in the motion of the piece's middle
    end_share: FloatArray
    turn_x: FloatArray  # (f,) Rotation for a unit displacement of the end against the start (1/m)
    turn_y: FloatArray
    first_dof: int  # first degree of freedom of the first piece


FACETS = types.BaseTuple.from_types([INTEGERS] * 4 + [FLOATS] * 4 + [types.int64], Facets)
"""Type of ``Facets`` in structures."""


@kernel
def place_facets(facets, displacement):
    """Compute displacement and rotation of the facets from their gridpoints."""
    body = facets.first_dof
    for f in range(facets.start_x.size):
        x0, y0 = displacement[facets.start_x[f]], displacement[facets.start_y[f]]
        x1, y1 = displacement[facets.end_x[f]], displacement[facets.end_y[f]]
        displacement[body] = facets.start_share[f] * x0 + facets.end_share[f] * x1
        displacement[body + 1] = facets.start_share[f] * y0 + facets.end_share[f] * y1
        displacement[body + 2] = facets.turn_x[f] * (x1 - x0) + facets.turn_y[f] * (y1 - y0)
        body += 3


@kernel
def scatter_facet_forces(facets, force):
    """Scatter the forces on facets to their gridpoints, statically equivalent."""
    body = facets.first_dof
    for f in range(facets.start_x.size):
        x, y, turning = force[body], force[body + 1], force[body + 2]
        start, end = facets.start_share[f], facets.end_share[f]
        more_x, more_y = facets.turn_x[f] * turning, facets.turn_y[f] * turning
        force[facets.start_x[f]] += start * x - more_x
        force[facets.start_y[f]] += start * y - more_y
        force[facets.end_x[f]] += end * x + more_x
        force[facets.end_y[f]] += end * y + more_y
        body += 3


@law
def gather(displacement, start, corners, cell, work):
    """Gather the displacements of a cell's gridpoints in ``work``, and compute its hourglass displacement.

    ``start`` is the first degree of freedom of the batch, ``corners`` the places of the five gridpoints after it.
    """
    for p in range(5):
        at = start + corners[p]
        for lane in range(work.lanes):
            work.displacement_at[p, 0, lane] = displacement[at + lane]
            work.displacement_at[p, 1, lane] = displacement[at + Y + lane]
    gamma, u = cell.gamma, work.displacement_at
    for axis in range(2):
        for lane in range(work.lanes):
            work.hourglass[axis, lane] = (
                gamma[0, lane] * u[0, axis, lane]
                + gamma[1, lane] * u[1, axis, lane]
                + gamma[2, lane] * u[2, axis, lane]
                + gamma[3, lane] * u[3, axis, lane]
            )


@law
def scatter(work, start, corners, force):
    """Add the forces in ``work`` to the gridpoints of a cell; arguments as in ``gather``."""
    for p in range(5):
        at = start + corners[p]
        for lane in range(work.lanes):
            force[at + lane] += work.force_at[p, 0, lane]
            force[at + Y + lane] += work.force_at[p, 1, lane]


@law
def _elastic_stress(work, cell, k, moduli, lane):
    """Return the elastic stress s_xx, s_yy, s_xy (Pa) of zone k for its total strain (constant-strain triangle)."""
    c, slopes, at, bent = moduli.elasticity, cell.slopes, work.displacement_at, cell.bending
    q_x, q_y = work.hourglass[0, lane], work.hourglass[1, lane]
    b = (k + 1) % 4
    x_b, y_b = at[b, 0, lane] - at[k, 0, lane], at[b, 1, lane] - at[k, 1, lane]
    x_c, y_c = at[4, 0, lane] - at[k, 0, lane], at[4, 1, lane] - at[k, 1, lane]
    e_xx = slopes[k, 0, lane] * x_b + slopes[k, 2, lane] * x_c + bent[k, 0, lane] * q_x + bent[k, 1, lane] * q_y
    e_yy = slopes[k, 1, lane] * y_b + slopes[k, 3, lane] * y_c + bent[k, 2, lane] * q_x + bent[k, 3, lane] * q_y
    g_xy = slopes[k, 1, lane] * x_b + slopes[k, 3, lane] * x_c + slopes[k, 0, lane] * y_b + slopes[k, 2, lane] * y_c
    g_xy += bent[k, 4, lane] * q_x + bent[k, 5, lane] * q_y
    return c[0, lane] * e_xx + c[1, lane] * e_yy, c[1, lane] * e_xx + c[0, lane] * e_yy, c[2, lane] * g_xy


@law
def _trial_stress(work, cell, memory, k, moduli, lane):
    """Return the elastic trial stress s_xx, s_yy, s_xy, s_zz (Pa) of zone k: plastic strain as at the last step."""
    c, p = moduli.elasticity, memory.plastic
    s_xx, s_yy, s_xy = _elastic_stress(work, cell, k, moduli, lane)
    e_xx, e_yy, g_xy, e_zz = p[k, 0, lane], p[k, 1, lane], p[k, 2, lane], p[k, 3, lane]
    held = c[5, lane] if c[3, lane] > 0.0 else 0.0  # plane strain: nu
    return (
        s_xx - (c[0, lane] * e_xx + c[1, lane] * e_yy + c[3, lane] * e_zz),
        s_yy - (c[1, lane] * e_xx + c[0, lane] * e_yy + c[3, lane] * e_zz),
        s_xy - c[2, lane] * g_xy,
        held * (s_xx + s_yy) - c[3, lane] * (e_xx + e_yy) - c[4, lane] * e_zz,
    )


@law
def _nodal_forces(cell, k, s_xx, s_yy, s_xy, lane):
    """Forces B^T sigma V of zone k (N): x, y at its second and third gridpoint, and conjugate to the hourglass."""
    volume, slopes, bent = cell.volume[k, lane], cell.slopes, cell.bending
    s_xx, s_yy, s_xy = volume * s_xx, volume * s_yy, volume * s_xy
    return (
        slopes[k, 0, lane] * s_xx + slopes[k, 1, lane] * s_xy,
        slopes[k, 0, lane] * s_xy + slopes[k, 1, lane] * s_yy,
        slopes[k, 2, lane] * s_xx + slopes[k, 3, lane] * s_xy,
        slopes[k, 2, lane] * s_xy + slopes[k, 3, lane] * s_yy,
        bent[k, 0, lane] * s_xx + bent[k, 2, lane] * s_yy + bent[k, 4, lane] * s_xy,
        bent[k, 1, lane] * s_xx + bent[k, 3, lane] * s_yy + bent[k, 5, lane] * s_xy,
    )


@law
def _assemble_cell(work, cell, p, q, r, s, lane):
    """Assemble the forces on a cell's gridpoints from the balanced internal forces of its four zones."""
    force_at, gamma = work.force_at, cell.gamma
    x, y = (p[4] + q[4]) + (r[4] + s[4]), (p[5] + q[5]) + (r[5] + s[5])
    force_at[0, 0, lane] = p[0] + p[2] - s[0] - gamma[0, lane] * x
    force_at[0, 1, lane] = p[1] + p[3] - s[1] - gamma[0, lane] * y
    force_at[1, 0, lane] = q[0] + q[2] - p[0] - gamma[1, lane] * x
    force_at[1, 1, lane] = q[1] + q[3] - p[1] - gamma[1, lane] * y
    force_at[2, 0, lane] = r[0] + r[2] - q[0] - gamma[2, lane] * x
    force_at[2, 1, lane] = r[1] + r[3] - q[1] - gamma[2, lane] * y
    force_at[3, 0, lane] = s[0] + s[2] - r[0] - gamma[3, lane] * x
    force_at[3, 1, lane] = s[1] + s[3] - r[1] - gamma[3, lane] * y
    force_at[4, 0, lane] = -((p[2] + q[2]) + (r[2] + s[2]))
    force_at[4, 1, lane] = -((p[3] + q[3]) + (r[3] + s[3]))


@law
def _elastic_nodal_forces(work, cell, k, moduli, lane):
    """Return the internal forces (N) of the elastic zone k, as ``_nodal_forces``."""
    s_xx, s_yy, s_xy = _elastic_stress(work, cell, k, moduli, lane)
    return _nodal_forces(cell, k, s_xx, s_yy, s_xy, lane)


@law
def _elastic_cell(work, cell, moduli):
    """Compute the forces of a cell of elastic zones on its gridpoints."""
    for lane in range(work.lanes):
        p = _elastic_nodal_forces(work, cell, 0, moduli, lane)
        q = _elastic_nodal_forces(work, cell, 1, moduli, lane)
        r = _elastic_nodal_forces(work, cell, 2, moduli, lane)
        s = _elastic_nodal_forces(work, cell, 3, moduli, lane)
        _assemble_cell(work, cell, p, q, r, s, lane)


@law
def _of_lane(v, lane):
    """Elasticity or strength in a lane, as a tuple."""
    return v[0, lane], v[1, lane], v[2, lane], v[3, lane], v[4, lane], v[5, lane], v[6, lane]


@law
def _trial_nodal_forces(work, cell, memory, k, moduli, lane):
    """Return the internal forces (N) of zone k under its trial stress; mark whether it yields, and reset its state."""
    stress = _trial_stress(work, cell, memory, k, moduli, lane)
    work.yields[k, lane] = 0.0 if within_yield_surface(stress, _of_lane(moduli.strength, lane)) else 1.0
    memory.state[k, lane] = 0.0
    return _nodal_forces(cell, k, stress[0], stress[1], stress[2], lane)


@law
def trial_cell(work, cell, memory, moduli):
    """Compute the forces of a cell under trial stresses (elastic predictor); return the number of yielding zones."""
    for lane in range(work.lanes):
        p = _trial_nodal_forces(work, cell, memory, 0, moduli, lane)
        q = _trial_nodal_forces(work, cell, memory, 1, moduli, lane)
        r = _trial_nodal_forces(work, cell, memory, 2, moduli, lane)
        s = _trial_nodal_forces(work, cell, memory, 3, moduli, lane)
        _assemble_cell(work, cell, p, q, r, s, lane)
    yields = 0.0
    for k in range(4):
        for lane in range(work.lanes):
            yields += work.yields[k, lane]
    return yields


@rule
def plastic_correction(work, cell, memory, moduli):
    """Correct the forces of a cell's yielding zones by return mapping (plastic corrector, Simo and Hughes 1998)."""
    c, l, p, force_at = moduli.elasticity, moduli.strength, memory.plastic, work.force_at
    for k in range(4):
        for lane in range(work.lanes):
            if work.yields[k, lane] == 0.0:
                continue
            t = _trial_stress(work, cell, memory, k, moduli, lane)
            s_xx, s_yy, s_xy, _, p_xx, p_yy, p_xy, p_zz, how = zone_return(t, _of_lane(c, lane), _of_lane(l, lane))
            p[k, 0, lane] += p_xx
            p[k, 1, lane] += p_yy
            p[k, 2, lane] += p_xy
            p[k, 3, lane] += p_zz
            memory.state[k, lane] = how
            x_b, y_b, x_c, y_c, x_q, y_q = _nodal_forces(cell, k, s_xx - t[0], s_yy - t[1], s_xy - t[2], lane)
            for corner in range(4):
                force_at[corner, 0, lane] -= cell.gamma[corner, lane] * x_q
                force_at[corner, 1, lane] -= cell.gamma[corner, lane] * y_q
            b = (k + 1) % 4
            force_at[k, 0, lane] += x_b + x_c
            force_at[k, 1, lane] += y_b + y_c
            force_at[b, 0, lane] -= x_b
            force_at[b, 1, lane] -= y_b
            force_at[4, 0, lane] -= x_c
            force_at[4, 1, lane] -= y_c


@kernel
def zone_forces(zones, displacement, force):
    """Add the forces of all zones on their gridpoints: elastic predictor, plastic corrector."""
    work = zones.work[0]
    for batch in range(zones.first_dof.size - 1):
        start, first = zones.first_dof[batch], zones.first_corner[zones.pattern[batch]]
        shape, memory = zones.first_shape[batch], zones.first_memory[batch]
        moduli = zones.moduli[batch]
        for i in range(zones.first_corner[zones.pattern[batch] + 1] - first):
            corners, cell = zones.corners[first + i], zones.shapes[shape + i]
            gather(displacement, start, corners, cell, work)
            if memory < 0:
                _elastic_cell(work, cell, moduli)
            elif trial_cell(work, cell, zones.memory[memory + i], moduli) > 0.0:
                plastic_correction(work, cell, zones.memory[memory + i], moduli)
            scatter(work, start, corners, force)


@kernel
def zone_stresses(zones, displacement, stress):
    """Fill s_xx, s_yy, s_xy and s_zz (Pa) of all zones, array (cells, 4, 4, 8), if none yields any further."""
    work, at = zones.work[0], 0
    for batch in range(zones.first_dof.size - 1):
        start, first = zones.first_dof[batch], zones.first_corner[zones.pattern[batch]]
        shape, memory = zones.first_shape[batch], zones.first_memory[batch]
        moduli = zones.moduli[batch]
        for i in range(zones.first_corner[zones.pattern[batch] + 1] - first):
            cell = zones.shapes[shape + i]
            gather(displacement, start, zones.corners[first + i], cell, work)
            for k in range(4):
                for lane in range(work.lanes):
                    if memory < 0:
                        s_xx, s_yy, s_xy = _elastic_stress(work, cell, k, moduli, lane)
                        held = moduli.elasticity[5, lane] if moduli.elasticity[3, lane] > 0.0 else 0.0
                        s_zz = held * (s_xx + s_yy)
                    else:
                        s_xx, s_yy, s_xy, s_zz = _trial_stress(work, cell, zones.memory[memory + i], k, moduli, lane)
                    stress[at, k, 0, lane], stress[at, k, 1, lane] = s_xx, s_yy
                    stress[at, k, 2, lane], stress[at, k, 3, lane] = s_xy, s_zz
            at += 1


@kernel
def find_yielding_zones(stress, strength, block, yields):
    """Find the zones whose stress lies outside the yield surface."""
    for z in range(block.size):
        yields[z] = not within_yield_surface(four(stress[z]), seven(strength[block[z]]))


@kernel
def return_stresses(stress, elasticity, strength, block):
    """Return stresses to the yield surface in place (Mohr-Coulomb return mapping); no history variable changes."""
    for z in range(block.size):
        moduli, limits = seven(elasticity[block[z]]), seven(strength[block[z]])
        s_xx, s_yy, s_xy, s_zz, _, _, _, _, _ = zone_return(four(stress[z]), moduli, limits)
        stress[z, 0], stress[z, 1], stress[z, 2], stress[z, 3] = s_xx, s_yy, s_xy, s_zz
