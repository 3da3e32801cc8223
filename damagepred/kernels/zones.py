"""Zones of deformable blocks in the explicit solver: strain, stress, forces on gridpoints; eight blocks side by side.

Strain and stress are constant in a triangle (paper, Eqs 5 and 6): with the gridpoints' displacement u relative to the
first one and the slopes of the shape functions, e = sum of u grad N. The law is written in total strain with the
plastic strain as memory, so what stays elastic remembers nothing and is not rounded. A batch is up to eight blocks
with zones of the same pattern: one value of each block side by side.
"""

import numpy as np

from damagepred.kernels.jit import kernel, law, rule
from damagepred.kernels.zone_law import yield_limit, zone_return

LANES = 8
"""Blocks in a batch."""
Y = np.uint64(LANES)


def row_type():
    """Return the record type of a row: one zone of all blocks of a batch.

    ``slopes``: of the shape functions of the second gridpoint along x and y, and of the third (1/m). ``volume``: area
    times thickness (m3), 0 in empty lanes. ``plastic``: strain e_xx, e_yy, g_xy, e_zz. ``state``: what yields now, 0
    nothing, 1 shear, 2 tension, 3 both.
    """
    lane = (LANES,)
    return np.dtype(
        [("slopes", "f8", (4, LANES)), ("volume", "f8", lane), ("plastic", "f8", (4, LANES)), ("state", "f8", lane)]
    )


def work_type():
    """Return the record type of what a row works with.

    ``moved``: displacement x, y of the second gridpoint against the first, then of the third. ``push``: force x, y with
    which they are pulled back. ``beyond``: 1 where the stress is more than the zone bears.
    """
    return np.dtype([("moved_b", "f8", (2 * LANES,)), ("moved_c", "f8", (2 * LANES,)), ("push_b", "f8", (2 * LANES,)), ("push_c", "f8", (2 * LANES,)), ("beyond", "f8", (LANES,)), ("lanes", "u8")])


def moduli_type():
    """Return the record type of the material of a batch; see ``damagepred.kernels.zone_law``."""
    return np.dtype([("elasticity", "f8", (7, LANES)), ("strength", "f8", (7, LANES))])


@law
def place_facets(facets, displacement):
    """Bring the facets to where their gridpoints are: middle of the two, and rotation of the line between them.

    Parameters
    ----------
    facets : NamedTuple of arrays
        See ``damagepred.solvers.zoned.Facets``.
    displacement : array (size,)
        Of all degrees of freedom; those of the facets are filled.
    """
    body = facets.first_dof
    for f in range(facets.start_x.size):
        x0, y0 = displacement[facets.start_x[f]], displacement[facets.start_y[f]]
        x1, y1 = displacement[facets.end_x[f]], displacement[facets.end_y[f]]
        displacement[body] = 0.5 * (x0 + x1)
        displacement[body + 1] = 0.5 * (y0 + y1)
        displacement[body + 2] = facets.turn_x[f] * (x1 - x0) + facets.turn_y[f] * (y1 - y0)
        body += 3


@law
def hand_on(facets, force):
    """Add the forces on facets to those on their gridpoints, so that both do the same work."""
    body = facets.first_dof
    for f in range(facets.start_x.size):
        x, y, turning = 0.5 * force[body], 0.5 * force[body + 1], force[body + 2]
        more_x, more_y = facets.turn_x[f] * turning, facets.turn_y[f] * turning
        force[facets.start_x[f]] += x - more_x
        force[facets.start_y[f]] += y - more_y
        force[facets.end_x[f]] += x + more_x
        force[facets.end_y[f]] += y + more_y
        body += 3


@law
def gather(displacement, a, b, c, work):
    """Bring how a row's second and third gridpoints moved against the first to where its law reads it.

    Parameters
    ----------
    displacement : array
        Of all degrees of freedom.
    a, b, c : unsigned int
        First degree of freedom of the row's gridpoints.
    work : record
        Of ``work_type``. All that the law needs being in records, the compiler knows that nothing overlaps, and works
        on all lanes at once.
    """
    for lane in range(work.lanes):
        work.moved_b[lane] = displacement[b + lane] - displacement[a + lane]
        work.moved_b[Y + lane] = displacement[b + Y + lane] - displacement[a + Y + lane]
        work.moved_c[lane] = displacement[c + lane] - displacement[a + lane]
        work.moved_c[Y + lane] = displacement[c + Y + lane] - displacement[a + Y + lane]


@law
def scatter(work, a, b, c, force):
    """Add the forces of a row on its gridpoints to all others there, one gridpoint after the other."""
    for lane in range(work.lanes):
        force[b + lane] -= work.push_b[lane]
        force[b + Y + lane] -= work.push_b[Y + lane]
    for lane in range(work.lanes):
        force[c + lane] -= work.push_c[lane]
        force[c + Y + lane] -= work.push_c[Y + lane]
    for lane in range(work.lanes):
        force[a + lane] += work.push_b[lane] + work.push_c[lane]
        force[a + Y + lane] += work.push_b[Y + lane] + work.push_c[Y + lane]


@law
def elastic_stress(work, row, moduli, lane):
    """Return s_xx, s_yy, s_xy and s_zz (Pa) of a zone that has never yielded; see ``zone_law``."""
    k = moduli.elasticity
    x_b, y_b, x_c, y_c = work.moved_b[lane], work.moved_b[Y + lane], work.moved_c[lane], work.moved_c[Y + lane]
    e_xx = row.slopes[0, lane] * x_b + row.slopes[2, lane] * x_c
    e_yy = row.slopes[1, lane] * y_b + row.slopes[3, lane] * y_c
    g_xy = row.slopes[1, lane] * x_b + row.slopes[3, lane] * x_c + row.slopes[0, lane] * y_b + row.slopes[2, lane] * y_c
    return k[0, lane] * e_xx + k[1, lane] * e_yy, k[1, lane] * e_xx + k[0, lane] * e_yy, k[2, lane] * g_xy


@law
def trial_stress(work, row, moduli, lane):
    """Return s_xx, s_yy, s_xy and s_zz (Pa) if a zone does not yield any further."""
    k, p = moduli.elasticity, row.plastic
    s_xx, s_yy, s_xy = elastic_stress(work, row, moduli, lane)
    e_xx, e_yy, e_zz = p[0, lane], p[1, lane], p[3, lane]
    return (
        s_xx - (k[0, lane] * e_xx + k[1, lane] * e_yy + k[3, lane] * e_zz),
        s_yy - (k[1, lane] * e_xx + k[0, lane] * e_yy + k[3, lane] * e_zz),
        s_xy - k[2, lane] * p[2, lane],
        k[5, lane] * (s_xx + s_yy) * (k[3, lane] > 0.0) - k[3, lane] * (e_xx + e_yy) - k[4, lane] * e_zz,
    )


@law
def push_back(work, row, s_xx, s_yy, s_xy, lane):
    """Note the forces with which a zone's stress (Pa) resists."""
    volume, slopes = row.volume[lane], row.slopes
    s_xx, s_yy, s_xy = volume * s_xx, volume * s_yy, volume * s_xy
    work.push_b[lane] = slopes[0, lane] * s_xx + slopes[1, lane] * s_xy
    work.push_b[Y + lane] = slopes[0, lane] * s_xy + slopes[1, lane] * s_yy
    work.push_c[lane] = slopes[2, lane] * s_xx + slopes[3, lane] * s_xy
    work.push_c[Y + lane] = slopes[2, lane] * s_xy + slopes[3, lane] * s_yy


@law
def elastic_row(work, row, moduli):
    """Let a row of zones that never yield push back."""
    for lane in range(work.lanes):
        s_xx, s_yy, s_xy = elastic_stress(work, row, moduli, lane)
        push_back(work, row, s_xx, s_yy, s_xy, lane)


@law
def beyond_limits(s_xx, s_yy, s_xy, s_zz, strength, lane):
    """Tell whether a stress (Pa) is more than a zone bears; so are numbers that are none."""
    limits = (
        strength[0, lane], strength[1, lane], strength[2, lane], strength[3, lane], strength[4, lane],
        strength[5, lane], strength[6, lane],
    )  # fmt: skip
    half = 0.5 * (s_xx - s_yy)
    limit = yield_limit(0.5 * (s_xx + s_yy), s_zz, limits)
    return not ((limit >= 0.0) & (half * half + s_xy * s_xy <= limit * limit))


@law
def yielding_row(work, row, moduli):
    """Let a row of zones push back as if nothing yielded; return how many are beyond what they bear."""
    for lane in range(work.lanes):
        s_xx, s_yy, s_xy, s_zz = trial_stress(work, row, moduli, lane)
        work.beyond[lane] = 1.0 if beyond_limits(s_xx, s_yy, s_xy, s_zz, moduli.strength, lane) else 0.0
        row.state[lane] = 0.0
        push_back(work, row, s_xx, s_yy, s_xy, lane)
    beyond = 0.0
    for i in range(LANES):
        beyond += work.beyond[np.uint64(i)]
    return beyond


@rule
def give_way(work, row, moduli):
    """Bring the zones of a row back that are beyond what they bear."""
    k, l, p = moduli.elasticity, moduli.strength, row.plastic
    for lane in range(work.lanes):
        if work.beyond[lane] == 0.0:
            continue
        s_xx, s_yy, s_xy, s_zz = trial_stress(work, row, moduli, lane)
        s_xx, s_yy, s_xy, _, p_xx, p_yy, p_xy, p_zz, how = zone_return(
            s_xx, s_yy, s_xy, s_zz,
            (k[0, lane], k[1, lane], k[2, lane], k[3, lane], k[4, lane], k[5, lane], k[6, lane]),
            (l[0, lane], l[1, lane], l[2, lane], l[3, lane], l[4, lane], l[5, lane], l[6, lane]),
        )  # fmt: skip
        p[0, lane] += p_xx
        p[1, lane] += p_yy
        p[2, lane] += p_xy
        p[3, lane] += p_zz
        row.state[lane] = how
        push_back(work, row, s_xx, s_yy, s_xy, lane)


@law
def zone_forces(zones, displacement, force):
    """Add to the forces on gridpoints what the zones' stresses make of it.

    Parameters
    ----------
    zones : NamedTuple of arrays
        See ``damagepred.solvers.zoned.PackedZones``; plastic strain and state of yielding zones are brought up to date.
    displacement, force : array (size,)
        Of all degrees of freedom.
    """
    work = zones.work[0]
    for batch in range(zones.first_dof.size - 1):
        start, row = zones.first_dof[batch], zones.first_row[batch]
        first = zones.first_zone[zones.pattern[batch]]
        moduli = zones.moduli[batch]
        yields = zones.yields[batch]
        for z in range(zones.first_row[batch + 1] - row):
            a, b, c = (start + zones.zone[first + z, 0], start + zones.zone[first + z, 1], start + zones.zone[first + z, 2])
            here = zones.rows[row + z]
            gather(displacement, a, b, c, work)
            if yields:
                if yielding_row(work, here, moduli) > 0.0:
                    give_way(work, here, moduli)
            else:
                elastic_row(work, here, moduli)
            scatter(work, a, b, c, force)


@kernel
def zone_stresses(zones, displacement, stress):
    """Fill s_xx, s_yy, s_xy and s_zz (Pa) of all zones, array (rows, 4, LANES), at a displacement; no memory moves."""
    work = zones.work[0]
    for batch in range(zones.first_dof.size - 1):
        start, row = zones.first_dof[batch], zones.first_row[batch]
        first = zones.first_zone[zones.pattern[batch]]
        for z in range(zones.first_row[batch + 1] - row):
            a, b, c = (start + zones.zone[first + z, 0], start + zones.zone[first + z, 1], start + zones.zone[first + z, 2])
            gather(displacement, a, b, c, work)
            for i in range(LANES):
                s = trial_stress(work, zones.rows[row + z], zones.moduli[batch], np.uint64(i))
                for j in range(4):
                    stress[row + z, j, i] = s[j]
