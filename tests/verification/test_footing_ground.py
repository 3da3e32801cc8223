"""The footing on ground: settlement, the beam on an elastic foundation, and lift-off as the ground moves."""

from dataclasses import replace

import numpy as np
import pytest

from damagepred.assembly import wall_model
from damagepred.enumerations import ContactKind
from damagepred.scene import BlockMaterial, Dpc, Loads, Mound, Movement, Soil, Solver, Wall
from tests.verification import footings
from tests.verification.beam_on_ground import on_springs, timoshenko_on_bed
from tests.verification.footings import PAPER, SLENDER, STOCKY, STRIPS, Strip, level, moments, path_of, reactions
from tests.verification.manual import Verify, chapter

pytestmark = pytest.mark.quick_cases("solver")

closed_form = chapter("Footing and ground")

SETTLES = closed_form(
    title="Footing on level soil, and on soil that tilts",
    formula="u = w/(k b);   soil that moves by a + c x:   u = a + c x - w/(k b),  M = 0",
    source="Equilibrium: uniform load on uniform springs.",
    note="k: stiffness of the soil per area, b: width of the footing.",
)
HETENYI = closed_form(
    title="Footing on an elastic foundation",
    formula="λ = (k b/(4 E I))^(1/4)\\n"
    "P in the middle:  w(L/2) = Pλ/(2 k b) (cosh λL + cos λL + 2)/(sinh λL + sin λL),\\n"
    "                  w(0) = 2Pλ/(k b) cosh(λL/2) cos(λL/2)/(sinh λL + sin λL)\\n"
    "P at one end:     w(0) = 2Pλ/(k b) (sinh λL cosh λL - sin λL cos λL)/(sinh² λL - sin² λL)\\n"
    "stocky:           E I w'''' - (E I k b/(κ G A)) w'' + k b w = 0",
    source="Hetényi (1946), Beams on elastic foundation: finite beam with free ends. Of beams that shear, the equation "
    "solved by its four roots on either side of the load.",
    note="The footing's weight keeps it down everywhere, and is taken off by its closed form, w/(k b). Hetényi's beam "
    "does not shear, which makes up to 0.6 % in the middle; the order is of the error against the beam that does.",
)
LIFTS = closed_form(
    title="Heavy footing on a mound, from which it lifts off",
    formula="E I w'''' = -q + k b <ground - w>,   with shear, and springs that do not pull",
    source="Independent finite elements in the test: 600 exact Timoshenko elements (Przemieniecki 1968, 5.6), springs "
    "at their ends, the set of pressed ones found by iteration.",
    note="Levels are measured by the ground's movement, moments by the largest one.",
)
STEP = closed_form(
    title="Heavy footing over a step in rigid ground",
    formula="δ = q a⁴ r (1 + r)/(48 E I),   b = r a,   r = (1 + √3)/2\\n"
    "M(edge) = -q a²/4,   R(edge) = q a (3/4 + r/2 + 1/(4 r)),   M = 0 and w' = 0 where it touches, a before and b "
    "after the edge",
    source="Derived: Euler-Bernoulli beam, lifting off before the edge that it bends over, and coming to rest on the "
    "lower level, where deflection, slope and moment are 0.",
    note="The ground is as stiff as a rock (1e12 Pa/m). Where the footing touches is known to a segment's length.",
)
LIFTED = closed_form(
    title="Heavy footing lifted at its end from rigid ground",
    formula="ℓ = (24 E I δ/q)^(1/4),   R = q ℓ/2,   M = q ℓ²/8",
    source="Derived: Euler-Bernoulli beam, free along ℓ, with deflection, slope and moment 0 where it touches.",
    note="A ground that rises by δ at the very end only, as stiff as a rock (1e12 Pa/m).",
)


@pytest.mark.parametrize("strip", STRIPS, ids=lambda strip: strip.name)
@pytest.mark.parametrize("kind", ["dishing", "doming"])
def test_the_footing_settles_and_tilts(verify: Verify, solver: Solver, strip: Strip, kind: str) -> None:
    stiffness, load = 3e6, 1500.0
    tilt = Mound(shape="table", surface_movement=0.02, table=((0.0, 0.25), (1.0, 1.0)))
    pieces = 9 if strip is STOCKY else 25
    model = strip.on_soil(stiffness, pieces, kind=kind, load=load, mound=tilt, friction=0.5)
    first, last = path_of(model, solver)
    w, x = strip.line_weight + load, np.linspace(0.0, strip.length, 11)
    settled = -w / (stiffness * strip.width)
    case = f"{kind}, {load:g} N/m, k {stiffness / 1e6:g} N/mm²/m: {strip}"
    verify(SETTLES, case, solver.method, "level (m)", level(model, first, x), settled, 1e-5)
    ground = 0.02 * (0.25 + 0.75 * x / strip.length) * (1 if kind == "doming" else -1)
    verify(SETTLES, f"tilting; {case}", solver.method, "level (m)", level(model, last, x), settled + ground, 1e-4)
    _, bent = moments(model, last)
    verify(
        SETTLES, f"tilting; {case}", solver.method, "moment over w L²/8", bent, 0.0, 1e-4, scale=w * strip.length**2 / 8
    )


@pytest.mark.parametrize("stiffness", [1e6, 5e7])
def test_a_wall_settles_with_its_footing(verify: Verify, solver: Solver, stiffness: float) -> None:
    """Bricks in running bond on segments as long: its weight is even, and so is its pressure."""
    strip, wall, roof = Strip("short", 2.4, 0.4, 0.3, 10e9), Wall(length=2.4, height=0.6), 3e3
    scene = strip.scene(
        Movement(kind="doming", shape="mound"),
        10,
        soil=Soil(shrinking_stiffness=stiffness),
        mound=Mound(shape="table", surface_movement=0.01, table=((0.0, 0.2), (1.0, 1.0))),
        loads=Loads(roof=roof),
    )
    bricks = replace(scene.solver, blocks="rigid")
    scene = replace(scene, wall=wall, block=BlockMaterial(density=1800.0), dpc=Dpc(course=1), solver=bricks)
    model = wall_model(scene)
    # cycling, bricks slide on the dpc while their weight comes on, and friction keeps that: slowly, so that few do
    first, last = path_of(model, solver, ramp_cycles=10_000)
    weight = strip.line_weight * 2.4 + footings.GRAVITY * 1800 * 0.11 * 2.4 * 0.6 + roof
    settled = -weight / (stiffness * strip.width * 2.4)
    case = f"wall of 8 courses, k {stiffness / 1e6:g} N/mm²/m: {strip}"
    segments, allowed = model.footing, 2e-3 if solver.method == "explicit" else 1e-6
    verify(SETTLES, case, solver.method, "settlement (m)", first.displacement[segments, 1], settled, allowed)
    ground = 0.01 * (0.2 + 0.8 * model.blocks.x[segments] / 2.4)
    name = f"tilting; {case}"
    verify(SETTLES, name, solver.method, "level (m)", last.displacement[segments, 1], settled + ground, allowed)


def settled_by(strip: Strip, solver: Solver, stiffness: float, at: float, force: float, pieces: int) -> np.ndarray:
    """Return how far both ends and the middle go down under a force, without what weight does (m)."""
    weight = 2 * force / strip.length + 4 * force * (stiffness * strip.width / strip.bending / 4) ** 0.25
    model = footings.with_force(strip.on_soil(stiffness, pieces, load=weight), at, force)
    last = path_of(model, solver)[0]
    assert (last.normal_stress[model.interfaces.kind == ContactKind.SOIL] < 0).all()
    x = np.array([0.0, 0.5, 1.0]) * strip.length
    return -level(model, last, x) - (strip.line_weight + weight) / (stiffness * strip.width)


@pytest.mark.parametrize(("stiffness", "pieces"), [(5e5, 121), (5e6, 121), (2e7, 181)])
def test_a_slender_footing_on_an_elastic_foundation(verify: Verify, solver: Solver, stiffness: float, pieces: int):
    strip, force = SLENDER, 5e3
    length, k = strip.length, stiffness * strip.width
    rate = (k / (4 * strip.bending)) ** 0.25
    z = rate * length
    below = np.sinh(z) + np.sin(z)
    middle = force * rate / (2 * k) * (np.cosh(z) + np.cos(z) + 2) / below
    away = 2 * force * rate / k * np.cosh(z / 2) * np.cos(z / 2) / below
    end = 2 * force * rate / k * (np.sinh(z) * np.cosh(z) - np.sin(z) * np.cos(z)) / (np.sinh(z) ** 2 - np.sin(z) ** 2)
    case = f"λL = {z:.3g}: {strip}"
    found = settled_by(strip, solver, stiffness, length / 2, force, pieces)
    verify(HETENYI, f"middle, {case}", solver.method, "w(0), w(L/2), w(L) (m)", found, [away, middle, away], 1e-2)
    found = settled_by(strip, solver, stiffness, 0.0, force, pieces)
    verify(HETENYI, f"end, {case}", solver.method, "w(0) (m)", found[0], end, 1.5e-2)


@pytest.mark.parametrize("place", [0.0, 0.25, 0.5])
@pytest.mark.parametrize(("strip", "stiffness"), [(PAPER, 2e7), (STOCKY, 5e8)], ids=["paper's", "stocky"])
def test_a_stocky_footing_on_an_elastic_foundation(verify, solver, strip, stiffness, place) -> None:
    force, length, k = 2e4, strip.length, stiffness * strip.width
    pieces = 21 if solver.method == "explicit" else 61
    at = (np.floor(place * pieces) + 0.5) / pieces * length if place > 0 else 0.0
    found = settled_by(strip, solver, stiffness, at, force, pieces)
    x = np.array([0.0, 0.5, 1.0]) * length
    exact = timoshenko_on_bed(x, length, strip.bending, strip.shear, k, at, force)
    z = (k / (4 * strip.bending)) ** 0.25 * length
    case = f"P at {at / length:.3g} L, λL = {z:.3g}, {pieces} segments: {strip}"
    verify(HETENYI, case, solver.method, "w(0), w(L/2), w(L) (m)", found, exact, 3e-3 * (61 / pieces) ** 2)


WALSH = Mound(shape="walsh", surface_movement=0.04, edge_distance=1.5)
MITCHELL = Mound(shape="mitchell", surface_movement=0.05, exponent=2.0)
TREE = Mound(shape="tree", surface_movement=0.03, reach=4.0)
PIPE = Mound(shape="pipe", surface_movement=0.02, reach=1.5)


@pytest.mark.parametrize(
    ("strip", "stiffness", "load", "kind", "mound"),
    [
        (PAPER, 5e6, 1e4, "doming", MITCHELL),
        (PAPER, 1e7, 2e3, "dishing", WALSH),
        (PAPER, 5e6, 5e3, "doming", WALSH),
        (PAPER, 5e7, 2e3, "dishing", TREE),
        (PAPER, 2e7, 5e3, "doming", PIPE),
        (PAPER, 1e8, 1e4, "doming", MITCHELL),
        (SLENDER, 5e7, 0.0, "dishing", MITCHELL),
        (STOCKY, 5e6, 3e4, "doming", MITCHELL),
        (STOCKY, 5e8, 0.0, "dishing", TREE),
    ],
    ids=lambda value: str(getattr(value, "name", getattr(value, "shape", value))),
)
def test_the_footing_lifts_off(verify, solver, strip, stiffness, load, kind, mound) -> None:
    pieces = 30 if strip is STOCKY and solver.method == "explicit" else 60
    model = strip.on_soil(stiffness, pieces, kind=kind, load=load, mound=mound)
    last = path_of(model, solver, 2)[-1]
    length = strip.length
    known = on_springs(
        length,
        strip.bending,
        strip.shear,
        stiffness * strip.width,
        strip.line_weight + load,
        lambda x: mound.profile(x, length, kind),
    )
    case = f"{mound.shape}, {kind}, {load / 1e3:g} kN/m, k {stiffness / 1e6:g} N/mm²/m: {strip}"
    x = np.linspace(0.0, length, 13)
    expected = np.interp(x, known.x, known.level)
    verify(LIFTS, case, solver.method, "level (m)", level(model, last, x), expected, 1e-2, scale=mound.largest(kind))
    place, bent = moments(model, last)
    exact = np.interp(place, known.x, known.moment)
    verify(LIFTS, case, solver.method, "moment (N m)", bent, exact, 2e-2)
    _, carried = reactions(model, last, ContactKind.SOIL)
    off = 1 - (known.pressure > 0).mean()
    assert off > 0.05, "the footing must lift off"
    share = model.interfaces.contact_area[model.interfaces.kind == ContactKind.SOIL].ravel() / (strip.width * length)
    computed = share[carried <= 0].sum()
    verify(LIFTS, case, solver.method, "share of the length lifted off", computed, off, 1.5 / pieces, scale=1.0)
    expected = (strip.line_weight + load) * length
    verify(LIFTS, case, solver.method, "all that the ground carries (N)", carried.sum(), expected, 1e-5)


LONG = Strip("long", 24.0, 0.4, 0.1, 40e9)
ROCK = 1e12
"""Stiffness of ground that yields nothing (Pa/m)."""


@pytest.mark.parametrize(("strip", "depth", "at"), [(SLENDER, 5e-3, 0.5), (SLENDER, 2e-3, 0.6), (LONG, 8e-3, 0.45)])
def test_the_footing_bends_over_a_step(verify: Verify, strip: Strip, depth: float, at: float) -> None:
    pieces, length, q = 240, strip.length, strip.line_weight
    mound = Mound(shape="table", surface_movement=depth, table=((0.0, 0.0), (at, 0.0), (at + 1e-7, 1.0), (1.0, 1.0)))
    model = strip.on_soil(ROCK, pieces, kind="dishing", mound=mound)
    last = path_of(model, Solver(lump_block_elasticity=False), 4)[-1]
    r = (1 + np.sqrt(3)) / 2
    a = (48 * strip.bending * depth / (q * r * (1 + r))) ** 0.25
    b, edge, h = r * a, at * length, length / pieces
    assert edge - a > 3 * h
    assert edge + b < length - 3 * h
    case = f"{1e3 * depth:g} mm, a = {a:.3g} m, h = {h:.2g} m: {strip}"
    x, bent = moments(model, last)
    verify(STEP, case, "quasi_static", "M(edge) (N m)", bent[np.abs(x - edge).argmin()], -q * a**2 / 4, 1e-2)
    place, carried = reactions(model, last, ContactKind.SOIL)
    computed = carried[np.abs(place - edge) < h].sum()
    verify(STEP, case, "quasi_static", "R(edge) (N)", computed, q * a * (3 / 4 + r / 2 + 1 / (4 * r)), 1e-2)
    near = (place > edge - 2 * a) & (place < edge + 2 * b) & (np.abs(place - edge) > 1.5 * h) & (carried > 0)
    before, after = place[near & (place < edge)].max(), place[near & (place > edge)].min()
    verify(STEP, case, "quasi_static", "a and b (m)", [edge - before, after - edge], [a, b], 2.5 * h, scale=1.0)
    known = np.linspace(0.0, a, 7)
    rise = q / strip.bending * (a * known**3 / 24 - known**4 / 24)
    computed = level(model, last, edge - a + known) / depth
    verify(STEP, case, "quasi_static", "rise before the edge over the step", computed, rise / depth, 5e-3, scale=1.0)


@pytest.mark.parametrize(("strip", "rise"), [(SLENDER, 0.01), (SLENDER, 0.05), (LONG, 0.1)])
def test_the_footing_is_lifted_at_its_end(verify: Verify, strip: Strip, rise: float) -> None:
    pieces, length, q = 240, strip.length, strip.line_weight
    mound = Mound(shape="table", surface_movement=rise, table=((0.0, 0.0), (1 - 1e-7, 0.0), (1.0, 1.0)))
    model = strip.on_soil(ROCK, pieces, kind="doming", mound=mound)
    last = path_of(model, Solver(lump_block_elasticity=False), 4)[-1]
    free, h = (24 * strip.bending * rise / q) ** 0.25, length / pieces
    assert free < 0.8 * length
    case = f"{1e3 * rise:g} mm, ℓ = {free:.3g} m, h = {h:.2g} m: {strip}"
    place, carried = reactions(model, last, ContactKind.SOIL)
    verify(LIFTED, case, "quasi_static", "R (N)", carried[place > length - h / 4].sum(), q * free / 2, 1e-2)
    _, bent = moments(model, last)
    verify(LIFTED, case, "quasi_static", "M (N m)", bent.max(), q * free**2 / 8, 1e-2)
    pressed = place[(carried > 0) & (place < length - h)]
    verify(LIFTED, case, "quasi_static", "ℓ (m)", length - pressed.max(), free, 2.5 * h, scale=1.0)
    known = np.linspace(0.0, free, 7)
    up = q / (24 * strip.bending) * (2 * free * known**3 - known**4)
    computed = level(model, last, length - free + known) / rise
    verify(LIFTED, case, "quasi_static", "level over δ", computed, up / rise, 5e-3, scale=1.0)
