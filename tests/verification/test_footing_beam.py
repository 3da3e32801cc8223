"""The footing as a beam: on jacks and supports, under its own weight, and together with brickwork bonded to it."""

from dataclasses import replace

import numpy as np
import pytest

from damagepred.assembly import footing_alone, wall_model
from damagepred.enumerations import ContactKind
from damagepred.scene import BlockMaterial, Joint, Movement, Rig, Solver, Wall
from tests.verification import footings
from tests.verification.footings import GRAVITY, PAPER, SLENDER, STOCKY, STRIPS, Strip, level, moments, path_of
from tests.verification.manual import Verify, chapter

pytestmark = pytest.mark.quick_cases("solver")

closed_form = chapter("Footing and ground")

JACKS = closed_form(
    title="Footing alone on two supports and three equal jacks",
    formula="δ = 19 P L³/(384 E I) + P L/(2 κ G A)\nw(L/4) = (27/38) 19 P L³/(384 E I) + 3 P L/(8 κ G A),   κ = 5/6",
    source="Euler-Bernoulli beam under three equal loads at the quarter points, and its shear by virtual work.",
    note="The jacks' load P is what the solver finds for a given deflection. What own weight adds is the same in both "
    "increments compared and falls out. `thin` compares with the beam that does not shear. A segment is rigid: that of "
    "the half segments over supports and of those that jacks stand between, shear is missing, an error of the order of "
    "h/L of the shear's share; so values for the stocky footing are taken to size 0 from two sizes.",
)
SAG = closed_form(
    title="Footing that sags between two supports",
    formula="P = 0:   δ = 5 w L⁴/(384 E I) + w L²/(8 κ G A)",
    source="Timoshenko beam on two supports under uniform load: where the path of dishing on jacks ends.",
    note="Order: of the error over the length of segments, 2 of a slender beam, 1 of one whose error is that of shear.",
)
CHAIN = closed_form(
    title="Chain of rigid segments",
    formula="δ = Σ [M m h/(E I) + V v (h/(κ G A) + h³/(12 E I))],   over the sections between segments",
    source="Virtual work: M, V by the load, m, v by a unit load at mid-length, where they are known by statics.",
    note="What the chain must give for any number of segments; its limit is the Timoshenko beam. Supports guide the "
    "underside along the wall with a millionth of their stiffness, and are 0.1 mm wide: that holds the ends of a "
    "slender footing back by some 0.02 %.",
)
ENDS = closed_form(
    title="Footing that cantilevers from its jacks",
    formula="supports at 0:   P = W/3,   δ = W L³/(288 E I) + W L/(24 κ G A)",
    source="Statics, and the formulas of the two checks before, with opposite signs.",
    note="Where the path of doming on jacks ends.",
)
ZONED = closed_form(
    title="Footing of zones on jacks",
    formula="δ = 19 P L³/(384 E I) + P L/(2 κ G A),   error ~ (cells over the depth)^-2",
    source="As for the beam of segments.",
    note="One block of constant-strain zones, which are too stiff in bending: see the cantilever of zones. To size 0, "
    "what is left is that the plane is no beam.",
)
TRANSFORMED = closed_form(
    title="Footing and brickwork bonded to it",
    formula="E I = Σ [E I_i + E A_i (y_i - y_0)²],  y_0 = Σ E A_i y_i / Σ E A_i;   κ G A = Σ κ_i G A_i\n"
    "δ = 5 w L⁴/(384 E I) + w L²/(8 κ G A)",
    source="Transformed section; the parts shear alike.",
    note="Rigid bricks in stack bond; their perpends have k_n h = E and k_s h = G, their beds let nothing slip. "
    "Bricks have κ = 1, as joints transfer shear evenly. Taken to size 0 from two sizes.",
)
NEWMARK = closed_form(
    title="Brickwork on a footing with a bed that slips",
    formula="δ = 5 w L⁴/(384 E I) + (E I/E I₀ - 1) w/(α⁴ E I) [1/cosh(αL/2) + α²L²/8 - 1] + w L²/(8 κ G A)\n"
    "α² = k_s t (1/E A₁ + 1/E A₂ + r²/E I₀),   E I₀ = E I₁ + E I₂,   E I = E I₀ + r² E A₁ E A₂/(E A₁ + E A₂)",
    source="Newmark, Siess and Viest (1951): two beams with a linear connection; r is the distance of their axes.",
    note="One course of rigid bricks on the footing; the bed between is stiff across and slips along.",
)


def jacked(strip: Strip, solver: Solver, kind: str, support: str, pieces: int) -> tuple[float, float, float]:
    """Return deflections by a unit load of the jacks (m/N): of middle and quarter points, and the one measured."""
    length = strip.length
    size = 2e-3 * strip.line_weight * length**4 / strip.bending  # small enough for the supports to be pressed
    model = strip.on_jacks(kind, size, pieces, support=support, stop_at_zero=False)
    first, last = path_of(model, solver)
    rise = level(model, last, np.array([0.0, 0.25, 0.5, 1.0]) * length)
    rise -= level(model, first, np.array([0.0, 0.25, 0.5, 1.0]) * length)
    more = last.footing.jack_load - first.footing.jack_load
    ends = (rise[0] + rise[3]) / 2
    return (rise[2] - ends) / more, (rise[1] - ends) / more, (last.footing.deflection - first.footing.deflection) / more


@pytest.mark.parametrize("support", ["held", "lift_off"])
@pytest.mark.parametrize("kind", ["dishing", "doming"])
@pytest.mark.parametrize("strip", STRIPS, ids=lambda strip: strip.name)
def test_equal_jacks_bend_the_footing(verify: Verify, solver: Solver, strip: Strip, kind: str, support: str) -> None:
    fine, coarse = (np.array(jacked(strip, solver, kind, support, pieces)) for pieces in (160, 80))
    found = 2 * fine - coarse if strip is STOCKY else fine
    thin, sheared = 19 * strip.length**3 / (384 * strip.bending), strip.length / strip.shear
    case = f"{kind}, {support}: {strip}"
    exact = [thin + sheared / 2] * 2 + [27 / 38 * thin + 3 / 8 * sheared]
    verify(JACKS, case, solver.method, "δ/P, twice, and w(L/4)/P (m/N)", found[[0, 2, 1]], exact, 1e-3)
    if strip is SLENDER:
        computed = [found[0] / thin, found[1] / found[0]]
        verify(JACKS, f"thin; {case}", solver.method, "384 E I δ/(19 P L³) and w(L/4)/δ", computed, [1, 27 / 38], 1e-3)


def test_the_jacks_carry_the_footing_when_the_path_begins(verify: Verify, solver: Solver) -> None:
    """Level: the deflection by the weight is that which the jacks take back."""
    for strip in (SLENDER, PAPER):
        load = 2000.0
        model = strip.on_jacks("dishing", 1e-3, 96, load=load)
        first = path_of(model, solver)[0]
        w, length, thin, shear = strip.line_weight + load, strip.length, strip.bending, strip.shear
        sag = 5 * w * length**4 / (384 * thin) + w * length**2 / (8 * shear)
        by_one = 19 * length**3 / (384 * thin) + length / (2 * shear)
        verify(
            JACKS, f"level, {load:g} N/m: {strip}", solver.method, "P (N)", first.footing.jack_load, sag / by_one, 1e-3
        )
        assert abs(first.footing.deflection) < 1e-5 * sag


def sag(strip: Strip, load: float) -> float:
    """Return the sag of a beam between supports at its ends (m)."""
    w, length = strip.line_weight + load, strip.length
    return 5 * w * length**4 / (384 * strip.bending) + w * length**2 / (8 * strip.shear)


def sag_of_chain(strip: Strip, load: float, pieces: int) -> float:
    """Return the sag of a chain of rigid segments, an even number (m)."""
    w, length, h = strip.line_weight + load, strip.length, strip.length / pieces
    x = h * np.arange(1, pieces)
    near = np.minimum(x, length - x)
    moment, unit_moment = w * near * (length - near) / 2, near / 2
    # in the middle, where the unit load acts on both segments alike, it shears nothing
    shear, unit_shear = w * (length / 2 - x), np.sign(np.round(length / 2 - x, 9)) / 2
    bent = (moment * unit_moment).sum() * h / strip.bending
    return float(bent + (shear * unit_shear).sum() * (h / strip.shear + h**3 / (12 * strip.bending)))


def sagged(strip: Strip, solver: Solver, load: float, pieces: int) -> float:
    """Return the sag where the jacks of dishing carry nothing any more (m)."""
    model = strip.on_jacks("dishing", 1.5 * sag(strip, load), pieces, load=load)
    last = path_of(model, solver, 3)[-1]
    assert last.end.unloaded == "jacks"
    assert abs(last.footing.jack_load) < 5e-5 * (strip.line_weight + load) * strip.length
    return -last.footing.deflection


@pytest.mark.parametrize(
    ("strip", "load", "pieces", "tolerance"),
    [
        (SLENDER, 0.0, 100, 1e-3),
        (PAPER, 2250 - PAPER.line_weight, 100, 1e-3),
        (PAPER, 0.0, 25, 2e-3),
        (STOCKY, 5e4, 100, 5e-3),
    ],
)
def test_the_footing_sags_between_supports(verify, solver, strip, load, pieces, tolerance) -> None:
    case = f"{load:.0f} N/m, {pieces} segments: {strip}"
    verify(SAG, case, solver.method, "δ (m)", sagged(strip, solver, load, pieces), sag(strip, load), tolerance)


@pytest.mark.parametrize(
    ("strip", "pieces", "order"), [(SLENDER, (8, 16, 32), 2.0), (STOCKY, (40, 80, 160), 1.0)], ids=["slender", "stocky"]
)
def test_shorter_segments_sag_more_like_the_beam(verify, solver, strip, pieces, order) -> None:
    load = strip.line_weight
    found = np.array([sagged(strip, solver, load, n) for n in pieces])
    for n, value in zip(pieces, found, strict=True):
        verify(CHAIN, f"{n} segments: {strip}", solver.method, "δ (m)", value, sag_of_chain(strip, load, n), 4e-4)
    errors = np.abs(found - sag(strip, load))
    case = f"{pieces[0]} to {pieces[2]} segments: {strip}"
    verify(SAG, case, solver.method, "order", np.log(errors[0] / errors[2]) / np.log(4), order, 0.1)


@pytest.mark.parametrize("support", ["held", "lift_off"])
@pytest.mark.parametrize(("strip", "load"), [(SLENDER, 0.0), (PAPER, 1500.0)], ids=["slender", "paper's"])
def test_the_ends_cantilever(verify: Verify, solver: Solver, strip: Strip, load: float, support: str) -> None:
    weight, length = (strip.line_weight + load) * strip.length, strip.length
    exact = weight * length**3 / (288 * strip.bending) + weight * length / (24 * strip.shear)
    model = strip.on_jacks("doming", 1.3 * exact, 120, load=load, support=support)
    last = path_of(model, solver, 3)[-1]
    assert last.end.unloaded == "supports"
    case = f"{support}, {load:g} N/m: {strip}"
    verify(ENDS, case, solver.method, "P (N)", last.footing.jack_load, weight / 3, 1e-5)
    verify(ENDS, case, solver.method, "δ (m)", last.footing.deflection, exact, 2e-3)
    _, carried = footings.reactions(model, last, ContactKind.SUPPORT)
    verify(ENDS, case, solver.method, "all of the supports' load (N)", carried.sum(), 0.0, 1e-5, scale=weight)
    x, bent = moments(model, last)
    computed = np.interp(0.24 * length, x, bent)
    expected = -weight / length * (0.24 * length) ** 2 / 2
    verify(ENDS, case, solver.method, "moment at x = L/4 (without P's peak) (N m)", computed, expected, 1e-2)


def zoned(strip: Strip, solver: Solver, cells: int) -> float:
    """Return the deflection for a unit load of the jacks (m/N) of a footing with a number of cells over its depth."""
    settings = replace(solver, footing="deformable", zone_size_footing=strip.depth / cells, tolerance=1e-5)
    size = 2e-3 * strip.line_weight * strip.length**4 / strip.bending
    movement = Movement(kind="dishing", shape="jacks", central_deflection=size)
    model = footing_alone(strip.scene(movement, 20, rig=Rig(stop_at_zero=False), solver=settings))
    first, last = path_of(model, settings)
    return (last.footing.deflection - first.footing.deflection) / (last.footing.jack_load - first.footing.jack_load)


def test_equal_jacks_bend_a_footing_of_zones(verify: Verify) -> None:
    strip, solver, cells = PAPER, Solver(lump_block_elasticity=False), (2, 4)
    exact = 19 * strip.length**3 / (384 * strip.bending) + strip.length / (2 * strip.shear)
    found = [zoned(strip, solver, n) for n in cells]
    for n, value in zip(cells, found, strict=True):
        verify(ZONED, f"{n} cells over the depth: {strip}", solver.method, "δ/P (m/N)", value, exact, 0.9 / n**2)
    few, many = (n**2 for n in cells)
    case = f"{cells[0]} and {cells[1]} cells, to size 0: {strip}"
    verify(ZONED, case, solver.method, "δ/P (m/N)", (many * found[1] - few * found[0]) / (many - few), exact, 2e-2)


BOUND = 1e13
"""Strength that nothing reaches (Pa)."""


def brickwork(
    strip: Strip,
    pieces: int,
    courses: int,
    course: float,
    modulus: float,
    slip: float,
    load: float,
    solver: Solver | None = None,
) -> float:
    """Return the sag (m) of a footing with courses of rigid bricks on it, where the jacks of dishing carry nothing."""
    h, thickness = strip.length / pieces, 0.11
    bound = {"tensile_strength": BOUND, "cohesion": BOUND, "friction": 1.0}
    perpends = Joint(normal_stiffness=modulus / h, shear_stiffness=modulus / 2.4 / h, **bound)
    bed = Joint(normal_stiffness=1e14, shear_stiffness=slip, **bound)
    most = sag(strip, load + GRAVITY * 2000 * thickness * course * courses)
    scene = strip.scene(
        Movement(kind="dishing", shape="jacks", central_deflection=1.2 * most),
        pieces,
        joint=perpends,
        block=BlockMaterial(density=2000.0),
        loads={"roof": load * strip.length},
        rig=Rig(),
        solver=Solver(lump_block_elasticity=False),
    )
    height = course * courses
    wall = Wall(
        length=strip.length, height=height, thickness=thickness, block_length=h, block_height=course, bond="stack"
    )
    scene = replace(scene, wall=wall, footing=replace(scene.footing, joint=bed))
    model = wall_model(scene)
    if courses > 1:
        face, law = model.interfaces, model.properties
        stiff = face.kind == ContactKind.BED_JOINT
        properties = law._replace(
            normal_stiffness=np.where(stiff, 1e14, law.normal_stiffness),
            shear_stiffness=np.where(stiff, 1e14, law.shear_stiffness),
        )
        model = replace(model, properties=properties)
    last = path_of(model, solver or scene.solver, 2)[-1]
    assert last.end.unloaded == "jacks"
    return -last.footing.deflection


@pytest.mark.parametrize("courses", [1, 2, 3])
@pytest.mark.parametrize("modulus", [9e9, 2e9])
def test_bonded_brickwork_stiffens_the_footing(verify: Verify, courses: int, modulus: float) -> None:
    strip, course, thickness, load, pieces = PAPER, 0.075, 0.11, 1e3, (20, 40, 80)
    heights, areas = [-strip.depth / 2], [strip.width * strip.depth * strip.modulus]
    own, shear = strip.bending, strip.shear
    for number in range(courses):
        heights.append((number + 0.5) * course)
        areas.append(thickness * course * modulus)
        own += modulus * thickness * course**3 / 12
        shear += modulus / 2.4 * thickness * course
    y, stiffness = np.array(heights), np.array(areas)
    axis = (y * stiffness).sum() / stiffness.sum()
    bending = own + (stiffness * (y - axis) ** 2).sum()
    w = strip.line_weight + load + GRAVITY * 2000 * thickness * course * courses
    exact = 5 * w * strip.length**4 / (384 * bending) + w * strip.length**2 / (8 * shear)
    found = np.array([brickwork(strip, n, courses, course, modulus, 1e14, load) for n in pieces])
    case = f"{courses} courses of {1e3 * course:g} mm, E {modulus / 1e6:g} MPa: {strip}"
    limit = (4 * found[2] - found[1]) / 3
    verify(TRANSFORMED, case, "quasi_static", "δ, to size 0 (m)", limit, exact, 5e-4)
    assert exact < 0.9 * sag(strip, w - strip.line_weight), "the bricks must matter"
    errors = np.abs(found - limit)
    verify(TRANSFORMED, case, "quasi_static", "order", np.log2(errors[0] / errors[1]), 2.0, 0.2)


def sag_with_slip(strip: Strip, course: float, modulus: float, slip: float, load: float) -> float:
    """Return Newmark's sag (m) of a footing with one course on it, and of their shear."""
    length, thickness = strip.length, 0.11
    first, second = strip.width * strip.depth * strip.modulus, thickness * course * modulus
    apart, shear = (strip.depth + course) / 2, strip.shear + modulus / 2.4 * thickness * course
    loose = strip.bending + modulus * thickness * course**3 / 12
    tight = loose + apart**2 * first * second / (first + second)
    alpha = np.sqrt(slip * thickness * (1 / first + 1 / second + apart**2 / loose))
    w = strip.line_weight + load + GRAVITY * 2000 * thickness * course
    z = alpha * length
    bound = 5 * w * length**4 / (384 * tight) + w * length**2 / (8 * shear)
    return float(bound + (tight / loose - 1) * w / (alpha**4 * tight) * (1 / np.cosh(z / 2) + z**2 / 8 - 1))


@pytest.mark.parametrize("slip", [1e8, 1e9, 1e10, 1e12])
def test_a_bed_that_slips_stiffens_it_less(verify: Verify, slip: float) -> None:
    strip, course, load, modulus = PAPER, 0.15, 1e3, 9e9
    coarse, fine = (brickwork(strip, n, 1, course, modulus, slip, load) for n in (40, 80))
    case = f"k_s {slip / 1e9:g} N/mm³, {1e3 * course:g} mm of E {modulus / 1e6:g} MPa: {strip}"
    exact = sag_with_slip(strip, course, modulus, slip, load)
    verify(NEWMARK, case, "quasi_static", "δ, to size 0 (m)", (4 * fine - coarse) / 3, exact, 5e-4)
