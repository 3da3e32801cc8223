"""The law of one constant-strain zone: isotropic elastic, Mohr-Coulomb with a tension cut-off.

Tension positive. All three principal stresses count: s_zz is 0 in plane stress, and in plane strain it keeps the
thickness constant. With N = (1 + sin phi) / (1 - sin phi) and M the same function of psi, every pair of principal
stresses and every principal stress obeys

    N s_i - s_j <= U = 2 C sqrt(N),    s_i <= T <= C / tan(phi)

Plastic strain flows along (M, -1) of the pair in shear and along s_i in tension; where several limits meet, their
contributions add up (Koiter). T is at most the apex of the cone, and U is the uniaxial compressive strength.

The return is exact, without iterations. The limits are planes in the space of principal stresses, and principal
directions do not turn during a return to isotropic limits. So the returned stress lies on a plane, an edge or a corner,
each in closed form. The admissible candidate without negative plastic multipliers is taken (de Souza Neto, Peric and
Owen 2008, chapter 8; Clausen, Damkilde and Andersen 2007, extended by the cut-off), or the nearest to admissible if
rounding leaves no other.

``elasticity`` is (c11, c12, c33, c13, czz, nu, 1 / E), from ``zone_elasticity``:

    s_xx = c11 e_xx + c12 e_yy + c13 e_zz,    s_yy = c12 e_xx + c11 e_yy + c13 e_zz,    s_xy = c33 g_xy,
    s_zz = c13 (e_xx + e_yy) + czz e_zz

with e the elastic strain: e_zz = -(plastic e_zz) in plane strain; in plane stress c13 = czz = 0 and s_zz = 0.
``strength`` is (U, N, M, T, C cos phi, sin phi, 1 / N), from ``zone_strength``.
"""

import math

import numpy as np

from damagepred.kernels.jit import law, rule

NO_LIMIT = 1e150
"""Strength that no stress reaches (Pa); its square is finite."""
LARGEST = 1e200
"""Larger stresses (Pa) return NaN, as stresses that are NaN do."""

ELASTIC, SHEAR, TENSION, BOTH = 0, 1, 2, 3

# Where a return ends, with principal stresses a >= b >= c: ...
INSIDE = 0
ON_SHEAR = 1  # N a - c = U
ON_TENSION = 2  # a = T
ON_SHEAR_COMPRESSION = 3  # shear of two pairs, b = c
ON_SHEAR_EXTENSION = 4  # shear of two pairs, a = b
ON_SHEAR_TENSION = 5  # a = T and c = N T - U
ON_TENSION_TENSION = 6  # a = b = T
AT_CORNER_COMPRESSION = 7  # a = T, b = c = N T - U
AT_CORNER_EXTENSION = 8  # a = b = T, c = N T - U
AT_CORNER_TENSION = 9  # a = b = c = T
# ... and in plane stress, where t = min(T, U / N) limits the greater of the two:
ON_CRUSHING = 3  # c = -U
AT_TENSION_TENSION = 4  # a = c = t
AT_SHEAR_TENSION = 5  # a = t, c = N t - U
AT_SHEAR_CRUSHING = 6  # a = 0, c = -U
AT_CRUSHING_CRUSHING = 7  # a = c = -U


# -- parameters ------------------------------------------------------------------------------------------------------


def zone_elasticity(elastic_modulus, poisson_ratio, plane_strain):
    """Elasticity (c11, c12, c33, c13, czz, nu, 1 / E)."""
    e, nu = np.asarray(elastic_modulus, float)[()], np.asarray(poisson_ratio, float)[()]
    c33 = e / (2.0 * (1.0 + nu))
    if plane_strain:
        c12 = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
        c11 = c12 + 2.0 * c33
        return c11, c12, c33, c12, c11, nu, 1.0 / e
    c11 = e / (1.0 - nu * nu)
    return c11, nu * c11, c33, 0.0 * c11, 0.0 * c11, nu, 1.0 / e


def zone_strength(cohesion, friction, dilation, tensile_strength):
    """Strength (U, N, M, T, C cos phi, sin phi, 1 / N)."""
    cohesion, friction, dilation, cut_off = np.broadcast_arrays(cohesion, friction, dilation, tensile_strength)
    sheared = cohesion < NO_LIMIT
    friction, dilation = np.where(sheared, friction, 0.0), np.where(sheared, dilation, 0.0)
    # N = (sqrt(1 + tan^2) + tan)^2
    cosine = 1.0 / np.hypot(1.0, friction)
    root = np.hypot(1.0, friction) + friction
    n, m = root**2, (np.hypot(1.0, dilation) + dilation) ** 2
    compressive = np.where(sheared, 2.0 * cohesion * root, NO_LIMIT)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        apex = np.where(friction > 0.0, cohesion / friction, NO_LIMIT)
    tension = np.minimum(np.minimum(cut_off, apex), NO_LIMIT)
    at_no_pressure = np.where(sheared, cohesion * cosine, NO_LIMIT)
    return tuple(v[()] for v in (compressive, n, m, tension, at_no_pressure, friction * cosine, 1.0 / n))


@law
def four(stress):
    """Stress of a zone, an array (4,), as a tuple."""
    return stress[0], stress[1], stress[2], stress[3]


@law
def seven(values):
    """Elasticity or strength of a zone, an array (7,), as a tuple."""
    return values[0], values[1], values[2], values[3], values[4], values[5], values[6]


# -- quick test ------------------------------------------------------------------------------------------------------


@law
def yield_limit(mean, szz, strength):
    """Largest admissible radius of Mohr's circle of the in-plane stresses (Pa), negative if no radius is admissible.

    A zone is elastic if limit >= 0 and ((s_xx - s_yy) / 2)^2 + s_xy^2 <= limit^2, without root or branch.
    """
    compressive, n, _m, tension, at_no_pressure, sine, inverse_n = strength
    in_plane = at_no_pressure - mean * sine
    greater = (compressive + szz) * inverse_n  # greater in-plane principal stress, by s_zz or cut off
    greater = (greater if greater < tension else tension) - mean
    lesser = mean + (compressive - n * szz)  # lesser in-plane principal stress, by s_zz
    limit = in_plane if in_plane < greater else greater
    limit = limit if limit < lesser else lesser
    return limit if szz <= tension else -1.0


@law
def within_yield_surface(stress, strength):
    """Whether a stress (xx, yy, xy, zz) is within Mohr-Coulomb's surface and the tension cut-off; False for NaN."""
    sxx, syy, sxy, szz = stress
    mean, half = 0.5 * (sxx + syy), 0.5 * (sxx - syy)
    limit = yield_limit(mean, szz, strength)
    return (limit >= 0.0) & (half * half + sxy * sxy <= limit * limit)


# -- return in principal stresses ------------------------------------------------------------------------------------


@law
def lesser(x, y):
    """Lesser of two numbers; the second if one is NaN."""
    return x if x < y else y


@law
def _nearer(best, other):
    """Candidate with the larger margin, the first of its values: the nearer to admissible."""
    return other if other[0] > best[0] else best


@rule
def plane_strain_return(a, b, c, nu, strength):
    """Principal stresses (a, b, c) by return mapping in plane strain (Clausen et al. 2007), and where."""
    # plastic multipliers are scaled by 2 G, so that they compare with stresses
    compressive, n, m, tension, _, _, _ = strength
    beta, gamma = nu / (1.0 - 2.0 * nu), nu / (1.0 + nu)
    corner = lesser(n * tension - compressive, tension)
    best = (-math.inf, math.nan, math.nan, math.nan, INSIDE)

    # planes
    q = beta * (m - 1.0)
    x = (n * a - c - compressive) / (n * m + 1.0 + q * (n - 1.0))
    ra, rb, rc = a - x * (m + q), b - x * q, c - x * (q - 1.0)
    margin = lesser(lesser(x, tension - ra), lesser(ra - rb, rb - rc))
    if margin >= 0.0:
        return ra, rb, rc, ON_SHEAR
    best = _nearer(best, (margin, ra, rb, rc, ON_SHEAR))

    x = a - tension
    shift = nu / (1.0 - nu) * x  # beta / (1 + beta)
    rb, rc = b - shift, c - shift
    margin = lesser(lesser(x, tension - rb), rc - corner)
    if margin >= 0.0:
        return tension, rb, rc, ON_TENSION
    best = _nearer(best, (margin, tension, rb, rc, ON_TENSION))

    # where tension and shear meet
    rb = b - nu * ((a - tension) + (c - corner))
    da, dc = _strain(a - tension, b - rb, c - corner, gamma)
    margin = lesser(lesser(-dc, da + m * dc), lesser(tension - rb, rb - corner))
    if margin >= 0.0:
        return tension, rb, corner, ON_SHEAR_TENSION
    best = _nearer(best, (margin, tension, rb, corner, ON_SHEAR_TENSION))

    rc = c - nu * ((a - tension) + (b - tension))
    da, db = _strain(a - tension, c - rc, b - tension, gamma)
    margin = lesser(lesser(da, db), lesser(rc - corner, tension - rc))
    if margin >= 0.0:
        return tension, tension, rc, ON_TENSION_TENSION
    best = _nearer(best, (margin, tension, tension, rc, ON_TENSION_TENSION))

    # edges of the cone: no plastic strain orthogonal to the flow of both pairs
    h, k = 1.0 - gamma * (1.0 + 2.0 * m), m - gamma * (1.0 + 2.0 * m)
    ra = (h * a + k * (b + c) + 2.0 * k * compressive) / (h + 2.0 * k * n)
    rc = n * ra - compressive
    db, dc = _strain(b - rc, a - ra, c - rc, gamma)
    margin = lesser(lesser(-db, -dc), lesser(tension - ra, ra - rc))
    if margin >= 0.0:
        return ra, rc, rc, ON_SHEAR_COMPRESSION
    best = _nearer(best, (margin, ra, rc, rc, ON_SHEAR_COMPRESSION))

    h, k = 1.0 - gamma * (2.0 + m), m - gamma * (2.0 + m)
    ra = (h * (a + b) + k * c + k * compressive) / (2.0 * h + k * n)
    rc = n * ra - compressive
    da, db = _strain(a - ra, c - rc, b - ra, gamma)
    margin = lesser(lesser(da, db), lesser(tension - ra, ra - rc))
    if margin >= 0.0:
        return ra, ra, rc, ON_SHEAR_EXTENSION
    best = _nearer(best, (margin, ra, ra, rc, ON_SHEAR_EXTENSION))

    # corners
    da, db = _strain(a - tension, c - corner, b - corner, gamma)
    dc = _strain(c - corner, a - tension, b - corner, gamma)[0]
    margin = lesser(lesser(-db, -dc), da + m * (db + dc))
    best = _nearer(best, (margin, tension, corner, corner, AT_CORNER_COMPRESSION))

    da, db = _strain(a - tension, c - corner, b - tension, gamma)
    dc = _strain(c - corner, a - tension, b - tension, gamma)[0]
    margin = lesser(lesser(-dc, lesser(da, db)), da + db + m * dc)
    best = _nearer(best, (margin, tension, tension, corner, AT_CORNER_EXTENSION))

    dc = _strain(c - tension, a - tension, b - tension, gamma)[0]
    _, a, b, c, where = _nearer(best, (dc, tension, tension, tension, AT_CORNER_TENSION))
    return a, b, c, where


@law
def _strain(x, y, z, gamma):
    """Plastic strain times 2 G, along the first and the last of three stress reductions."""
    mean = gamma * (x + y + z)
    return x - mean, z - mean


@rule
def _plane_stress_return(a, c, nu, strength):
    """Principal stresses (a, c) by return mapping in plane stress, and where."""
    # plastic multipliers are scaled by E, so that they compare with stresses
    compressive, n, m, tension, _, _, inverse_n = strength
    greatest = lesser(tension, compressive * inverse_n)
    corner = lesser(n * greatest - compressive, 0.0)
    best = (-math.inf, math.nan, math.nan, INSIDE)

    # lines
    x = (n * a - c - compressive) / (n * m + 1.0 - nu * (n + m))
    ra, rc = a - x * (m - nu), c - x * (nu * m - 1.0)
    margin = lesser(x, lesser(greatest - ra, rc + compressive))
    if margin >= 0.0:
        return ra, rc, ON_SHEAR
    best = _nearer(best, (margin, ra, rc, ON_SHEAR))

    rc = c - nu * (a - greatest)
    margin = lesser(a - greatest, lesser(greatest - rc, rc - corner))
    if margin >= 0.0:
        return greatest, rc, ON_TENSION
    best = _nearer(best, (margin, greatest, rc, ON_TENSION))

    ra = a - nu * (c + compressive)
    margin = lesser(-(c + compressive), lesser(-ra, ra + compressive))
    if margin >= 0.0:
        return ra, -compressive, ON_CRUSHING
    best = _nearer(best, (margin, ra, -compressive, ON_CRUSHING))

    # corners
    x, y = a - greatest, c - greatest
    margin = lesser(x - nu * y, y - nu * x)
    best = _nearer(best, (margin, greatest, greatest, AT_TENSION_TENSION))

    x, y = a - greatest, c - corner
    da, dc = x - nu * y, y - nu * x
    margin = lesser(-dc, da + m * dc)
    best = _nearer(best, (margin, greatest, corner, AT_SHEAR_TENSION))

    y = c + compressive
    da, dc = a - nu * y, y - nu * a
    margin = lesser(da, -(da + m * dc))
    best = _nearer(best, (margin, 0.0, -compressive, AT_SHEAR_CRUSHING))

    x, y = a + compressive, c + compressive
    margin = lesser(-(x - nu * y), -(y - nu * x))
    best = _nearer(best, (margin, -compressive, -compressive, AT_CRUSHING_CRUSHING))
    _, a, c, where = best
    return a, c, where


@law
def _strain_code(where):
    tension = (where == ON_TENSION) | (where == ON_TENSION_TENSION) | (where == AT_CORNER_TENSION)
    shear = (where == ON_SHEAR) | (where == ON_SHEAR_COMPRESSION) | (where == ON_SHEAR_EXTENSION)
    return TENSION if tension else (SHEAR if shear else BOTH)


# -- return and tangent of a zone ------------------------------------------------------------------------------------


@law
def _circle(sxx, syy, sxy):
    """Mean and radius of Mohr's circle, cosine and sine of twice the angle of the greater principal stress."""
    mean, half = 0.5 * (sxx + syy), 0.5 * (sxx - syy)
    radius = math.hypot(half, sxy)
    turned = radius > 0.0
    return mean, radius, (half / radius if turned else 1.0), (sxy / radius if turned else 0.0)


@rule
def _plane_strain_by_rank(s1, s2, szz, nu, strength):
    """Stresses (1, 2, zz) by return mapping in plane strain, where, and rank of s_zz (0 greatest, 2 least)."""
    if szz > s1:
        r3, r1, r2, where = plane_strain_return(szz, s1, s2, nu, strength)
        return r1, r2, r3, where, 0
    if szz >= s2:
        r1, r3, r2, where = plane_strain_return(s1, szz, s2, nu, strength)
        return r1, r2, r3, where, 1
    r1, r2, r3, where = plane_strain_return(s1, s2, szz, nu, strength)
    return r1, r2, r3, where, 2


@rule
def zone_return(stress, elasticity, strength):
    """Stress, increment of plastic strain (xx, yy, engineering xy, zz), and code, by Mohr-Coulomb return mapping."""
    sxx, syy, sxy, szz = stress
    if within_yield_surface(stress, strength):
        return sxx, syy, sxy, szz, 0.0, 0.0, 0.0, 0.0, ELASTIC
    mean, radius, cosine, sine = _circle(sxx, syy, sxy)
    if not (abs(mean) + radius + abs(szz) < LARGEST):
        nan = math.nan
        return nan, nan, nan, nan, nan, nan, nan, nan, ELASTIC

    czz, nu, compliance = elasticity[4], elasticity[5], elasticity[6]
    s1, s2 = mean + radius, mean - radius
    if czz > 0.0:
        r1, r2, r3, where, _ = _plane_strain_by_rank(s1, s2, szz, nu, strength)
        x, y, z = s1 - r1, s2 - r2, szz - r3
        contraction = nu * (x + y + z)
        factor = 1.0 + nu
        e1, e2, ezz = factor * x - contraction, factor * y - contraction, factor * z - contraction
        code = _strain_code(where)
    else:
        r1, r2, where = _plane_stress_return(s1, s2, nu, strength)
        r3 = 0.0
        x, y = s1 - r1, s2 - r2
        e1, e2 = x - nu * y, y - nu * x
        ezz, code = _thickness(where, e1, e2, strength)

    e1, e2, ezz = e1 * compliance, e2 * compliance, ezz * compliance
    mean, radius = 0.5 * (r1 + r2), 0.5 * (r1 - r2)
    stretch, distortion = 0.5 * (e1 + e2), 0.5 * (e1 - e2)
    return (
        mean + radius * cosine,
        mean - radius * cosine,
        radius * sine,
        r3,
        stretch + distortion * cosine,
        stretch - distortion * cosine,
        2.0 * distortion * sine,
        ezz,
        code,
    )


@law
def _thickness(where, e1, e2, strength):
    """Plastic strain across the plane for plastic strains e1, e2 in plane stress, and the code.

    The greater stress is limited by the cut-off, which does not change the thickness, or first by the cone with
    s_zz = 0; crushing is shear between the lesser stress and s_zz.
    """
    compressive, _, m, tension, _, _, inverse_n = strength
    cut_off = tension <= compressive * inverse_n
    if where == ON_SHEAR:
        return 0.0, SHEAR
    if (where == ON_TENSION) | (where == AT_TENSION_TENSION):
        # at the corner both flow; on the line e2 is rounding
        return (0.0, TENSION) if cut_off else (-(e1 + e2) / m, SHEAR)
    if where == AT_SHEAR_TENSION:
        return (0.0, BOTH) if cut_off else (-(e1 + m * e2) / m, SHEAR)
    if where == AT_SHEAR_CRUSHING:
        return -(e1 + m * e2), SHEAR
    return -m * (e1 + e2), SHEAR


@rule
def zone_tangent(stress, elasticity, strength):
    """Consistent tangent of ``zone_return``, d(s_xx, s_yy, s_xy) / d(e_xx, e_yy, g_xy) (Pa), by rows."""
    # not symmetric unless dilation equals friction; on a kink the tangent of one side
    (sxx, syy, sxy, szz), (c11, c12, c33, c13, czz, nu, _) = stress, elasticity
    if within_yield_surface(stress, strength):
        return c11, c12, 0.0, c12, c11, 0.0, 0.0, 0.0, c33
    mean, radius, cosine, sine = _circle(sxx, syy, sxy)
    if not (abs(mean) + radius + abs(szz) < LARGEST):
        nan = math.nan
        return nan, nan, nan, nan, nan, nan, nan, nan, nan

    # derivatives of the returned in-plane principal stresses by the trial ones 1, 2 and zz
    s1, s2 = mean + radius, mean - radius
    if czz > 0.0:
        r1, r2, _, where, rank = _plane_strain_by_rank(s1, s2, szz, nu, strength)
        greatest, middle, least = _strain_slopes(where, nu, strength)
        if rank == 0:
            (k1z, k11, k12), (k2z, k21, k22) = middle, least
        elif rank == 1:
            (k11, k1z, k12), (k21, k2z, k22) = greatest, least
        else:
            (k11, k12, k1z), (k21, k22, k2z) = greatest, middle
    else:
        r1, r2, where = _plane_stress_return(s1, s2, nu, strength)
        (k11, k12), (k21, k22) = _stress_slopes(where, nu, strength)
        k1z, k2z = 0.0, 0.0

    # derivatives by strains along the principal directions, which turn with the trial stress
    d11, d12 = k11 * c11 + k12 * c12 + k1z * c13, k11 * c12 + k12 * c11 + k1z * c13
    d21, d22 = k21 * c11 + k22 * c12 + k2z * c13, k21 * c12 + k22 * c11 + k2z * c13
    turning = 0.5 * (r1 - r2) / radius if radius > 0.0 else 0.5 * (k11 - k12 - k21 + k22)
    d33 = c33 * turning

    # derivatives of mean and half difference of stresses by mean and half difference of strains, turned to the axes
    dmm, dmr = 0.5 * (d11 + d12 + d21 + d22), 0.5 * (d11 - d12 + d21 - d22)
    drm, drr = 0.5 * (d11 + d12 - d21 - d22), 0.5 * (d11 - d12 - d21 + d22)
    half = (cosine * drm, cosine * cosine * drr + sine * sine * 2.0 * d33, cosine * sine * (drr - 2.0 * d33))
    shear = (sine * drm, cosine * sine * (drr - 2.0 * d33), sine * sine * drr + cosine * cosine * 2.0 * d33)
    middle = (dmm, dmr * cosine, dmr * sine)
    xx = (middle[0] + half[0], middle[1] + half[1], middle[2] + half[2])
    yy = (middle[0] - half[0], middle[1] - half[1], middle[2] - half[2])
    return (
        0.5 * (xx[0] + xx[1]),
        0.5 * (xx[0] - xx[1]),
        0.5 * xx[2],
        0.5 * (yy[0] + yy[1]),
        0.5 * (yy[0] - yy[1]),
        0.5 * yy[2],
        0.5 * (shear[0] + shear[1]),
        0.5 * (shear[0] - shear[1]),
        0.5 * shear[2],
    )


@rule
def _strain_slopes(where, nu, strength):
    """Derivatives of the returned (a, b, c) by the trial (a, b, c), by rows, in plane strain."""
    n, m = strength[1], strength[2]
    gamma = nu / (1.0 + nu)
    none = (0.0, 0.0, 0.0)
    if where == ON_SHEAR:
        q = nu / (1.0 - 2.0 * nu) * (m - 1.0)
        x = 1.0 / (n * m + 1.0 + q * (n - 1.0))
        a, b, c = x * (m + q), x * q, x * (q - 1.0)
        return (1.0 - a * n, 0.0, a), (-b * n, 1.0, b), (-c * n, 0.0, 1.0 + c)
    if where == ON_TENSION:
        shift = nu / (1.0 - nu)
        return none, (-shift, 1.0, 0.0), (-shift, 0.0, 1.0)
    if where == ON_SHEAR_TENSION:
        return none, (-nu, 1.0, -nu), none
    if where == ON_TENSION_TENSION:
        return none, none, (-nu, -nu, 1.0)
    if where == ON_SHEAR_COMPRESSION:
        h, k = 1.0 - gamma * (1.0 + 2.0 * m), m - gamma * (1.0 + 2.0 * m)
        x = 1.0 / (h + 2.0 * k * n)
        least = (n * h * x, n * k * x, n * k * x)
        return (h * x, k * x, k * x), least, least
    if where == ON_SHEAR_EXTENSION:
        h, k = 1.0 - gamma * (2.0 + m), m - gamma * (2.0 + m)
        x = 1.0 / (2.0 * h + k * n)
        greatest = (h * x, h * x, k * x)
        return greatest, greatest, (n * h * x, n * h * x, n * k * x)
    return none, none, none


@rule
def _stress_slopes(where, nu, strength):
    """Derivatives of the returned (a, c) by the trial (a, c), by rows, in plane stress."""
    n, m = strength[1], strength[2]
    none = (0.0, 0.0)
    if where == ON_SHEAR:
        x = 1.0 / (n * m + 1.0 - nu * (n + m))
        a, c = x * (m - nu), x * (nu * m - 1.0)
        return (1.0 - a * n, a), (-c * n, 1.0 + c)
    if where == ON_TENSION:
        return none, (-nu, 1.0)
    if where == ON_CRUSHING:
        return (1.0, -nu), none
    return none, none
