"""The law of a zone in both planes, compared with closed forms, independent closest points and its own conditions."""

import itertools
import math

import numpy as np
import pytest
from scipy.optimize import nnls

from damagepred.kernels.jit import kernel
from damagepred.kernels.zone import law as zone_law
from damagepred.kernels.zone.law import BOTH, ELASTIC, NO_LIMIT, SHEAR, TENSION, zone_elasticity, zone_strength

E, NU = 9e9, 0.19
PLANES = {"stress": False, "strain": True}
# cohesion, friction, dilation, tensile strength
MATERIALS = {
    "brick": (2.0e6, 0.75, 0.0, 0.45e6),
    "dilating": (2.0e6, 0.75, 0.3, 0.45e6),
    "associated": (2.0e6, 0.75, 0.75, 0.45e6),
    "to the apex": (0.5e6, 0.75, 0.2, NO_LIMIT),
    "metal": (1.0e6, 0.0, 0.0, NO_LIMIT),
    "metal with cut-off": (1.0e6, 0.0, 0.0, 0.3e6),
    "sand": (0.0, 0.6, 0.1, NO_LIMIT),
    "no tension": (1.0e6, 0.5, 0.0, 0.0),
    "shear never": (NO_LIMIT, 0.75, 0.0, 0.4e6),
    "rough": (0.2e6, 3.0, 0.5, 0.02e6),
}
plane_and_material = pytest.mark.parametrize(
    ("plane", "material"), [(p, m) for p in PLANES for m in MATERIALS], ids=lambda v: v.replace(" ", "_")
)


def parameters(plane, material, nu=NU, dilation=None):
    cohesion, friction, psi, cut_off = MATERIALS[material] if isinstance(material, str) else material
    psi = psi if dilation is None else dilation
    elasticity = zone_elasticity(E, nu, PLANES[plane])
    strength = zone_strength(cohesion, friction, psi, cut_off)
    return tuple(map(float, elasticity)), tuple(map(float, strength))


@kernel
def _returns(trial, elasticity, strength, stress, strain, code, tangent, elastic):
    for i in range(len(trial)):
        xx, yy, xy, zz = trial[i, 0], trial[i, 1], trial[i, 2], trial[i, 3]
        s0, s1, s2, s3, e0, e1, e2, e3, code[i] = zone_law.zone_return((xx, yy, xy, zz), elasticity, strength)
        stress[i], strain[i] = np.array((s0, s1, s2, s3)), np.array((e0, e1, e2, e3))
        tangent[i] = np.array(zone_law.zone_tangent((xx, yy, xy, zz), elasticity, strength)).reshape((3, 3))
        elastic[i] = zone_law.within_yield_surface((xx, yy, xy, zz), strength)


class Returned:
    """Results of trial stresses (k, 4): xx, yy, xy, zz."""

    def __init__(self, trial, elasticity, strength):
        trial = np.atleast_2d(np.asarray(trial, float))
        k = len(trial)
        self.stress, self.strain, self.code = np.empty((k, 4)), np.empty((k, 4)), np.empty(k, np.int8)
        self.tangent, self.elastic = np.empty((k, 3, 3)), np.empty(k, bool)
        trial = np.ascontiguousarray(trial)
        _returns(trial, elasticity, strength, self.stress, self.strain, self.code, self.tangent, self.elastic)


def trials(plane, count, seed=0, size=3e6):
    """Stresses around the limits of all materials, many of them special: uniaxial, isotropic, pure shear."""
    rng = np.random.default_rng(seed)
    stress = rng.normal(size=(count, 4)) * size * 10 ** rng.uniform(-2, 1, (count, 1))
    stress[:, [0, 1, 3]] += rng.normal(size=(count, 1)) * size
    stress[::7, 2] = 0.0
    stress[::11, 1] = stress[::11, 0]
    stress[::13, [1, 2]] = 0.0
    stress[::17, 3] = stress[::17, 0]
    if plane == "stress":
        stress[:, 3] = 0.0
    return stress


def principal(stress):
    """Principal stresses by numpy, in plane the greater, the lesser, then zz."""
    xx, yy, xy, zz = np.moveaxis(np.asarray(stress, float), -1, 0)
    lesser, greater = np.moveaxis(np.linalg.eigvalsh(np.stack([[xx, xy], [xy, yy]]).transpose(2, 0, 1)), -1, 0)
    return np.stack([greater, lesser, zz], -1)


def limits(material, dilation=None):
    """Every limit as (normal, flow, bound) on principal stresses (1, 2, zz), from sine and cosine, unsorted."""
    cohesion, friction, psi, cut_off = MATERIALS[material] if isinstance(material, str) else material
    psi = psi if dilation is None else dilation
    phi, psi = math.atan(friction), math.atan(psi)
    rows = []
    if cohesion < NO_LIMIT:
        for i, j in itertools.permutations(range(3), 2):
            normal, flow = np.zeros(3), np.zeros(3)
            normal[i], normal[j] = 1 + math.sin(phi), -(1 - math.sin(phi))
            flow[i], flow[j] = 1 + math.sin(psi), -(1 - math.sin(psi))
            rows.append((normal, flow, 2 * cohesion * math.cos(phi)))
        if friction > 0:
            cut_off = min(cut_off, cohesion / friction)
    if cut_off < NO_LIMIT:
        rows += [(row, row, cut_off) for row in np.eye(3)]
    return rows


def excess(stress, material):
    """Largest excess of principal stresses over the limits (Pa)."""
    s = principal(stress)
    return np.max([s @ normal - bound for normal, _, bound in limits(material)], axis=0)


def compliance(plane, nu=NU):
    """Strain (xx, yy, xy, zz; the third engineering shear) of stress; in plane stress that of zz is zero."""
    c = np.array([[1, -nu, 0, -nu], [-nu, 1, 0, -nu], [0, 0, 2 * (1 + nu), 0], [-nu, -nu, 0, 1]]) / E
    if plane == "stress":
        c[3], c[:, 3] = 0.0, 0.0
    return c


@pytest.mark.parametrize("friction", [0.0, 0.3, 0.75, 2.0])
def test_parameters_of_strength(friction):
    u, n, m, tension, at_no_pressure, sine, inverse_n = zone_strength(1e6, friction, friction / 2, NO_LIMIT)
    phi, psi = math.atan(friction), math.atan(friction / 2)
    assert u == pytest.approx(2e6 * math.cos(phi) / (1 - math.sin(phi)), rel=1e-14)
    assert n == pytest.approx((1 + math.sin(phi)) / (1 - math.sin(phi)), rel=1e-14)
    assert m == pytest.approx(math.tan(math.pi / 4 + psi / 2) ** 2, rel=1e-14)
    assert tension == pytest.approx(1e6 / friction if friction else NO_LIMIT)
    assert (at_no_pressure, sine, inverse_n) == pytest.approx((1e6 * math.cos(phi), math.sin(phi), 1 / n), rel=1e-14)


def test_tension_is_limited_by_the_apex_and_elastic_zones_have_no_limit():
    assert zone_strength(1e6, 0.5, 0.0, 5e6)[3] == 2e6
    assert zone_strength(1e6, 0.5, 0.0, 1e5)[3] == 1e5
    elasticity, strength = parameters("strain", (NO_LIMIT, 0.75, 0.0, NO_LIMIT))
    far = Returned(trials("strain", 50, size=1e30), elasticity, strength)
    assert far.elastic.all()
    arrays = zone_strength(np.array([1e6, NO_LIMIT]), 0.5, 0.0, np.array([1e5, 2e5]))
    for i, one in enumerate([zone_strength(1e6, 0.5, 0.0, 1e5), zone_strength(NO_LIMIT, 0.5, 0.0, 2e5)]):
        assert tuple(np.broadcast_to(a, 2)[i] for a in arrays) == one


@pytest.mark.parametrize("plane", PLANES)
def test_elasticity_inverts_hooke_s_law(plane):
    c11, c12, c33, c13, czz, nu, inverse = zone_elasticity(E, NU, PLANES[plane])
    stiffness = np.array([[c11, c12, 0, c13], [c12, c11, 0, c13], [0, 0, c33, 0], [c13, c13, 0, czz]])
    expected = np.eye(4)
    expected[3, 3] = float(plane == "strain")
    assert stiffness @ compliance(plane) == pytest.approx(expected, abs=1e-14)
    assert (nu, inverse) == (NU, 1 / E)


@plane_and_material
def test_quick_yield_check_finds_the_limit_along_any_ray(plane, material):
    """From a stress inside, up to 1e-8 before the limit and from 1e-8 beyond it."""
    if (plane, material) == ("stress", "sand"):
        return  # nothing is inside: with one stress 0, sand carries none
    elasticity, strength = parameters(plane, material)
    inside = np.array([-1e3, -1e3, 0.0, -1e3 if plane == "strain" else 0.0])
    direction = trials(plane, 2000) - inside
    # the limit, by bisection on numpy's principal stresses
    low, high = np.zeros(len(direction)), np.full(len(direction), 1e6)
    for _ in range(100):
        middle = (low + high) / 2
        passed = excess(inside + middle[:, None] * direction, material) > 0
        low, high = np.where(passed, low, middle), np.where(passed, middle, high)
    hit = (high < 1e5) & (low > 0)
    assert hit.sum() > 300
    nearly = Returned(inside + (low * (1 - 1e-8))[hit, None] * direction[hit], elasticity, strength)
    beyond = Returned(inside + (high * (1 + 1e-8))[hit, None] * direction[hit], elasticity, strength)
    assert nearly.elastic.all()
    assert not beyond.elastic.any()


@plane_and_material
@pytest.mark.parametrize("nu", [0.0, NU, 0.45])
def test_return_is_admissible_and_flows_as_it_should(plane, material, nu):
    """Koiter: plastic strain is a nonnegative sum of the flows of the limits active at the returned stress."""
    elasticity, strength = parameters(plane, material, nu)
    trial = trials(plane, 500, seed=1)
    result = Returned(trial, elasticity, strength)
    size = np.abs(trial).max(axis=1)
    assert (excess(result.stress, material) <= 1e-12 * size).all()
    if plane == "stress":
        assert not result.stress[:, 3].any()
    # the correction is the elastic stress of the plastic strain
    taken = (trial - result.stress) @ compliance(plane, nu)
    known = slice(None) if plane == "strain" else slice(3)
    assert np.abs(taken - result.strain)[:, known].max() <= 1e-13 * size.max() / E
    yielding = np.flatnonzero(~result.elastic)
    assert len(yielding) > 50
    s = principal(result.stress)
    # along the principal directions of the stress that came in, which those of the returned stress must be
    angle = 0.5 * np.arctan2(trial[:, 2], (trial[:, 0] - trial[:, 1]) / 2)
    e1 = _along(result.strain, angle)
    e2 = _along(result.strain, angle + np.pi / 2)
    s1, s2 = _along(result.stress * [1, 1, 2, 1], angle), _along(result.stress * [1, 1, 2, 1], angle + np.pi / 2)
    assert np.abs(np.stack([s1, s2], 1) - s[:, :2]).max() <= 1e-12 * size.max()
    strain = np.stack([e1, e2, result.strain[:, 3]], 1)
    pairs, cut_offs = ([row for row in limits(material) if np.count_nonzero(row[0]) == n] for n in (2, 1))
    for i in yielding:
        near = 1e-9 * size[i]
        shear = [flow for normal, flow, bound in pairs if s[i] @ normal > bound - near]
        tension = [flow for normal, flow, bound in cut_offs if s[i] @ normal > bound - near]
        assert shear or tension
        _, rest = nnls(np.array(shear + tension).T, strain[i] * E)
        assert rest <= 1e-9 * size[i]
        # and the reported limits suffice for it
        said = {SHEAR: shear, TENSION: tension, BOTH: shear + tension}[result.code[i]]
        _, rest = nnls(np.array(said).T, strain[i] * E)
        assert rest <= 1e-9 * size[i]
    # plastic work is not negative
    work = (result.stress * result.strain).sum(axis=1)
    if MATERIALS[material][3] > 0 and MATERIALS[material][0] > 0:
        assert (work >= -1e-12 * size**2 / E).all()


@kernel
def _where(stress, nu, strength, where):
    for i in range(len(stress)):
        where[i] = zone_law.plane_strain_return(stress[i, 0], stress[i, 1], stress[i, 2], nu, strength)[3]


@pytest.mark.parametrize(("material", "fewest"), [("dilating", 9), ("shear never", 3), ("metal", 3)])
def test_trials_end_on_every_plane_edge_and_corner(material, fewest):
    """All cases of the return mapping occur in these tests."""
    elasticity, strength = parameters("strain", material)
    trial = trials("strain", 2000, seed=1)
    yielding = ~Returned(trial, elasticity, strength).elastic
    where = np.empty(yielding.sum(), np.int8)
    _where(-np.sort(-principal(trial[yielding]), axis=1), NU, strength, where)
    assert len(np.unique(where)) == fewest
    assert np.bincount(where)[np.unique(where)].min() >= 5


def _along(strain, angle):
    c, s = np.cos(angle), np.sin(angle)
    return strain[:, 0] * c * c + strain[:, 1] * s * s + strain[:, 2] * c * s


@plane_and_material
@pytest.mark.parametrize("nu", [0.0, NU, 0.45])
def test_associated_return_is_the_closest_point(plane, material, nu):
    """Energy norm; all faces, edges and corners of the admissible set tried in turn, in numpy, unsorted."""
    cohesion, friction, _, cut_off = MATERIALS[material]
    associated = (cohesion, friction, friction, cut_off)
    elasticity, strength = parameters(plane, associated, nu)
    trial = trials(plane, 400, seed=2)
    result = Returned(trial, elasticity, strength)
    s = principal(trial)
    free = 3 if plane == "strain" else 2
    stiffness = np.linalg.inv(compliance(plane, nu)[np.ix_(*2 * [[0, 1, 3][:free]])])
    normals = np.array([normal[:free] for normal, _, _ in limits(associated)])
    bounds = np.array([bound for _, _, bound in limits(associated)])
    normals, bounds = normals[np.abs(normals).any(axis=1)], bounds[np.abs(normals).any(axis=1)]
    size = np.abs(trial).max(axis=1)
    best, closest = np.full(len(s), np.inf), np.full((len(s), free), np.nan)
    for count in range(free + 1):
        for subset in itertools.combinations(range(len(normals)), count):
            n, k = normals[list(subset)], bounds[list(subset)]
            product = n @ stiffness @ n.T
            if count and np.linalg.cond(product) > 1e10:
                continue
            off = (s[:, :free] @ n.T - k) @ np.linalg.inv(product) @ n @ stiffness if count else np.zeros((1, free))
            point = s[:, :free] - off
            distance = np.einsum("ij,jk,ik->i", s[:, :free] - point, np.linalg.inv(stiffness), s[:, :free] - point)
            better = (np.max(point @ normals.T - bounds, axis=1) <= 1e-10 * size) & (distance < best)
            best, closest = np.where(better, distance, best), np.where(better[:, None], point, closest)
    assert np.abs(closest - principal(result.stress)[:, :free]).max(axis=1) == pytest.approx(0.0, abs=1e-9 * size.max())
    assert (np.abs(closest - principal(result.stress)[:, :free]).max(axis=1) <= 1e-8 * size).all()


NAN = float("nan")


@plane_and_material
@pytest.mark.parametrize("dilation", [None, 0.0])
def test_tangent_is_the_slope_of_the_return(plane, material, dilation):
    elasticity, strength = parameters(plane, material, dilation=dilation)
    c11, c12, c33, c13, *_ = elasticity
    stiffness = np.array([[c11, c12, 0, c13], [c12, c11, 0, c13], [0, 0, c33, 0]])
    trial = trials(plane, 1500, seed=7)
    result = Returned(trial, elasticity, strength)
    step = 1e-6 * np.abs(trial).max(axis=1)[:, None]
    compared = np.ones(len(trial), bool)
    worst = np.zeros(len(trial))
    for k in range(3):
        change = step * stiffness[k] / stiffness[k].max()
        ahead, behind = (Returned(trial + s * change, elasticity, strength).stress for s in (1, -1))
        forward, backward = (ahead - result.stress)[:, :3], (result.stress - behind)[:, :3]
        expected = (forward + backward) / (2 * step) * stiffness[k].max()
        compared &= np.abs(forward - backward).max(axis=1) < 1e-4 * step[:, 0]  # otherwise there is a kink in between
        worst = np.maximum(worst, np.abs(result.tangent[:, :, k] - expected).max(axis=1) / c11)
    assert compared.mean() > 0.75
    assert np.bincount(result.code[compared & ~result.elastic], minlength=4).sum() > 100
    assert worst[compared].max() < 2e-4


@pytest.mark.parametrize("plane", PLANES)
def test_no_numbers_in_no_numbers_out(plane):
    elasticity, strength = parameters(plane, "brick")
    for bad in (NAN, math.inf, -math.inf, 1e250):
        for place in range(3 if plane == "stress" else 4):
            trial = np.zeros((1, 4))
            trial[0, place] = bad
            result = Returned(trial, elasticity, strength)
            assert np.isnan(result.stress).all()
            assert np.isnan(result.strain).all()
            assert np.isnan(result.tangent).all()
            assert (result.code, result.elastic) == (ELASTIC, False)
