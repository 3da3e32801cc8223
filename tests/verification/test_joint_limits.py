"""Joints that open, break and slide: limits and residual behaviour, in both solvers."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import optimize

import damagepred
from damagepred import Assembly, Solver
from damagepred.assembly.assembly import rectangle
from tests.verification.blocks import BLOCK, BRICK, STONE, UNITS, G, Unit, on_plate
from tests.verification.manual import Verify, chapter

pytestmark = pytest.mark.quick_cases("solver")

closed_form = chapter("Joints that open, break and slide")

OPENED = closed_form(
    title="Joint without tension under an eccentric load",
    formula="e <= b/6:  θ = 12 N e / (k_n t b³)\ne >  b/6:  θ = 2 N / (k_n t a²),   a = 3 (b/2 - e)",
    source="Derived: the pressed part of length a carries a triangle of stress whose resultant is the load.",
    note="The contacts of a joint that is partly open sample the triangle: the error is that of the quadrature, see "
    "the chapter on convergence. The interface is cut into parts of three contacts (Simpson): 4 at the defaults, "
    "8 x 4 where it lies on a plate of 8 pieces.",
)
OPENED_SPRINGS = closed_form(
    title="Plate on springs that carry no tension",
    formula="Σ k_i max(u + θ x_i, 0) = N,   Σ k_i max(u + θ x_i, 0) x_i = N e",
    source="Equilibrium of the same contacts, solved by a general root finder (scipy.optimize.root).",
    note="The same joint as before with the contacts as they are, so that nothing is left to quadrature.",
)
RELEASE = closed_form(
    title="Tension that breaks a bond",
    formula="F (1/A + 6 e / (b² t)) = f_t",
    source="Derived: edge stress of the elastic joint under the tension F at the eccentricity e.",
    note="The edge contact of three breaks first. Far off the middle (e > b/6) the other two may still hold the block.",
)
INCLINE = closed_form(
    title="Block that slides on an incline", formula="slides when tan α > tan φ   (and b/h > tan φ)", source="Coulomb."
)
TOPPLE = closed_form(
    title="Block that topples on an incline",
    formula="topples when tan α > b/h   (and tan φ > b/h)",
    source="The weight leaves the base.",
    note="Time steps to collapse may be many: local damping also acts on the chatter of the corner the block turns on, "
    "and that brakes the turning, which is slow so near to the limit.",
)
SHEAR_BOX = closed_form(
    title="Shear box under constant pressure",
    formula="τ = min(k_s u, C + p tan φ);   slip = max(u - u_p, 0),   u_p = (C + p tan φ)/k_s;\nrise = slip tan ψ",
    source="Coulomb's law with cohesion, integrated along a straight path; rigid box, so all contacts do the same.",
)


@pytest.mark.parametrize("share", [0.2, 0.3, 0.4])
@pytest.mark.parametrize("unit", UNITS, ids=str)
def test_a_joint_without_tension_opens(verify: Verify, solver: Solver, unit: Unit, share: float) -> None:
    pieces = 8  # of the plate
    force = 1e5 * unit.area
    assembly, block = on_plate(unit, unit.joint(), (0.0, 0.0), pieces)
    assembly.load(block, y=-force, at=(share * unit.b, unit.h))
    ds = damagepred.solve(assembly, solver=solver, increments=1).isel(increment=-1, block=block)
    pressed = 3 * (unit.b / 2 - share * unit.b)
    case = f"e = {share:g} b, N/A 0.1 MPa, {pieces} x {solver.no_tension_parts} x 3 contacts: {unit}"
    computed = -float(ds["block_rotation"])
    verify(OPENED, case, solver.method, "rotation (rad)", computed, 2 * force / (unit.k_n * unit.t * pressed**2), 0.002)


@pytest.mark.parametrize("share", [0.05, 0.25, 0.35])
@pytest.mark.parametrize(("unit", "contacts"), [(BRICK, 9), (BLOCK, 5), (STONE, 7)])
def test_a_plate_on_springs_lifts(verify: Verify, solver: Solver, unit: Unit, contacts: int, share: float) -> None:
    force = 1e5 * unit.area
    assembly, block = on_plate(unit, unit.joint(), (0.0, 0.0))
    assembly.load(block, y=-force, at=(share * unit.b, unit.h))
    settings = replace(solver, quadrature="midpoint", contacts_per_interface=contacts)
    ds = damagepred.solve(assembly, solver=settings, increments=1).isel(increment=-1, block=block)
    case = f"e = {share:g} b, N/A 0.1 MPa, {contacts} midpoints: {unit}"
    computed = [-float(ds["block_displacement_y"]), -float(ds["block_rotation"]) * unit.b / 2]
    exact = springs_without_tension(unit, contacts, share)
    verify(OPENED_SPRINGS, case, solver.method, "settlement and b/2 times rotation (m)", computed, exact, 1e-5)


def springs_without_tension(unit: Unit, count: int, share: float) -> list[float]:
    """Return settlement and b/2 times rotation (m) of a plate on springs under 0.1 MPa."""
    x = ((np.arange(count) + 0.5) / count - 0.5) * 2  # over b/2
    unit_settlement = 1e5 / unit.k_n

    def imbalance(moved: np.ndarray) -> list[float]:
        push = np.maximum(moved[0] + moved[1] * x, 0.0) / count
        return [push.sum() - 1.0, (push * x).sum() - 2 * share]

    found = optimize.root(imbalance, [1.0, 6 * share])
    assert np.abs(imbalance(found.x)).max() < 1e-9
    return list(found.x * unit_settlement)


@pytest.mark.parametrize("over", [0.995, 1.005])
@pytest.mark.parametrize(
    ("unit", "strength", "share"), [(BRICK, 0.453e6, 0.0), (BRICK, 0.2e6, 0.2), (BLOCK, 0.1e6, 0.1), (STONE, 1e6, 0.4)]
)
def test_a_bond_breaks_at_its_strength(verify, solver, unit, strength, share, over) -> None:
    force = over * strength * unit.area / (1 + 6 * share)
    joint = unit.joint(tensile_strength=strength, cohesion=2 * strength)
    assembly, block = on_plate(unit, joint, (0.0, 0.0))
    assembly.load(block, y=force, at=(share * unit.b, unit.h))
    ds = damagepred.solve(assembly, solver=replace(solver, ramp_cycles=20_000), increments=1)
    case = f"{over:g} F, e = {share:g} b, f_t {1e-6 * strength:g} MPa: {unit}"
    computed = "breaks" if (ds["contact_state"].values[-1] == 1).any() else "holds"
    verify(RELEASE, case, solver.method, "verdict", computed, "breaks" if over > 1 else "holds")
    if over < 1:
        computed = ds["contact_normal_stress"].values[-1].max()
        verify(RELEASE, case, solver.method, "edge stress (Pa)", computed, over * strength, 1e-6)


@pytest.mark.quick_cases("solver", "offset")
@pytest.mark.parametrize("offset", [-0.01, 0.01])
@pytest.mark.parametrize(("unit", "friction"), [(BLOCK, 0.3), (STONE, 0.75), (STONE, 1.2), (BRICK, 0.5), (BRICK, 1.0)])
def test_a_block_slides_beyond_the_friction_angle(verify, solver, unit, friction, offset) -> None:
    slope = friction * (1 + offset)
    angle = np.arctan(slope)
    assembly, block = on_plate(unit, unit.joint(friction=friction), (G * np.sin(angle), -G * np.cos(angle)))
    ds = damagepred.solve(assembly, solver=solver, increments=1)
    case = f"tan α = {slope:.4g}, tan φ = {friction:g}: {unit}"
    computed = "slides" if ds.attrs["status"] == "collapsed" else "sticks"
    verify(INCLINE, case, solver.method, "verdict", computed, "slides" if offset > 0 else "sticks")
    if offset < 0:
        shear = ds["contact_shear_stress"].values[-1] * ds["contact_length"].values * unit.t
        case = f"tan α = {slope:.4g}, tan φ = {friction:g}: {unit}"
        computed = abs(shear.sum())
        verify(INCLINE, case, solver.method, "shear in the joint (N)", computed, unit.weight * np.sin(angle), 1e-5)
    else:
        moved = ds["block_displacement_x"].values[-1, block]
        assert moved > 10 * abs(ds["block_rotation"].values[-1, block]) * unit.h  # it does not topple


@pytest.mark.quick_cases("solver", "offset")
@pytest.mark.parametrize("offset", [-0.01, 0.01])
@pytest.mark.parametrize(("b", "h"), [(0.11, 0.44), (0.24, 0.75), (1.0, 1.5), (0.6, 4.8)])
def test_a_slender_block_topples(verify: Verify, solver: Solver, b: float, h: float, offset: float) -> None:
    unit = replace(BRICK, name="", b=b, h=h)
    angle = np.arctan(b / h * (1 + offset))
    assembly, _ = on_plate(unit, unit.joint(friction=1.0), (G * np.sin(angle), -G * np.cos(angle)))
    ds = damagepred.solve(assembly, solver=replace(solver, maximum_cycles=2_000_000), increments=1)
    case = f"b = {b:g} m, h = {h:g} m, tan α = {np.tan(angle):.4g}, b/h = {b / h:.4g}"
    computed = "topples" if ds.attrs["status"] == "collapsed" else "stands"
    verify(TOPPLE, case, solver.method, "verdict", computed, "topples" if offset > 0 else "stands")


@pytest.mark.parametrize(
    ("unit", "pressure", "cohesion", "friction", "dilation"),
    [
        (BRICK, 0.0, 0.375e6, 0.75, 0.0),
        (BRICK, 0.5e6, 0.375e6, 0.75, 0.2),
        (BLOCK, 0.1e6, 0.0, 0.5, 0.0),
        (BLOCK, 0.2e6, 0.1e6, 0.6, 0.3),
        (STONE, 1e6, 0.0, 0.9, 0.1),
        (STONE, 2e6, 1e6, 0.65, 0.0),
    ],
)
def test_a_shear_box_yields_where_coulomb_says(verify, solver, unit, pressure, cohesion, friction, dilation) -> None:
    steps = 12
    joint = unit.joint(cohesion=cohesion, friction=friction, dilation=dilation)
    assembly = Assembly(thickness=unit.t, gravity=(0.0, 0.0), joint=joint)
    plate = assembly.add_block(rectangle(0.0, -unit.h, unit.b, 0.0))
    box = assembly.add_block(unit.at(0.0, 0.0))
    assembly.support(plate)
    assembly.support(box, y=False)
    assembly.load(box, y=-pressure * unit.area)
    strength = cohesion + friction * pressure
    limit = strength / unit.k_s
    assembly.move(box, x=3 * limit)
    ds = damagepred.solve(assembly, solver=replace(solver, tolerance=1e-6), increments=steps)
    moved = np.arange(steps + 1) / steps * 3 * limit
    slip = np.maximum(moved - limit, 0.0)
    words = f"p {1e-6 * pressure:g}, C {1e-6 * cohesion:g} MPa, tan φ {friction:g}, tan ψ {dilation:g}: {unit}"
    tau, slid = (np.abs(ds[f"contact_{name}"].values) for name in ("shear_stress", "slip"))
    stress = np.minimum(unit.k_s * moved, strength)[:, None]
    verify(SHEAR_BOX, words, solver.method, "shear stress (Pa)", tau, stress, 1e-5)
    verify(SHEAR_BOX, words, solver.method, "slip (m)", slid, slip[:, None], 1e-5)
    if dilation:
        height = ds["block_displacement_y"].values[:, box]
        verify(SHEAR_BOX, words, solver.method, "rise (m)", height - height[0], dilation * slip, 1e-5)
