"""Elastic joints between rigid blocks, in both solvers."""

from dataclasses import replace

import numpy as np
import pytest

import damagepred
from damagepred.scene import Solver
from tests.verification.blocks import BRICK, STONE, UNITS, G, Unit, on_plate, stack
from tests.verification.manual import Verify, chapter

pytestmark = pytest.mark.quick_cases("solver")

closed_form = chapter("Elastic joints")

STACK = closed_form(
    title="Stack of blocks under its own weight",
    formula="u_i = W i (2n - i + 1) / (2 k_n A),   A = b t,   block i = 1 ... n from the bottom",
    source="Derived: the joint under block j carries n - j + 1 blocks; the closings of joints 1 to i add up.",
)
SERIES = closed_form(
    title="Stack of elastic blocks: their elasticity in series with the joints",
    formula="1/k = 1/k_n + s/E,   s = h between blocks and h/2 to the ground\nu_1 = n W / (k_ground A),   u_i = "
    "u_(i-1) + (n - i + 1) W / (k A)",
    source="Derived: joint and block between the middles of two blocks carry the same stress.",
    note="Rigid blocks with `lump_block_elasticity`.",
)
TILT = closed_form(
    title="Elastic joint under an eccentric load",
    formula="θ = 12 N e / (k_n t b³),   u = N / (k_n A),   while e <= b/6",
    source="Derived: linear stress over a rectangular joint. Simpson's weights (1/6, 4/6, 1/6) integrate its moment "
    "exactly.",
)
SPRINGS = closed_form(
    title="Rotation of the elastic joint by the rule for its contacts",
    formula="θ k_n t b³ / (12 M) = 1 for Gauss-Lobatto rules of 3 or more contacts, 1/3 for 2,\n"
    "                      1/(1 - 1/q²) for q midpoints",
    source="Derived: second moment of the contacts' areas over b³/12.",
    note="Two springs at the ends make the joint three times too stiff; nine midpoints leave it 1.25 % too soft.",
)
STUCK = closed_form(
    title="Block that sticks on an incline",
    formula="u = W sin α / (k_s A),   θ = 12 (W sin α) (h/2) / (k_n t b³)",
    source="Derived: shear and moment of the weight on the elastic joint, nothing slipping and nothing opening.",
    note="u is the shear displacement at the joint.",
)


@pytest.mark.parametrize(("unit", "n"), [(UNITS[0], 3), (UNITS[1], 10), (UNITS[2], 25), (UNITS[0], 40)])
def test_a_stack_settles_under_its_own_weight(verify: Verify, solver: Solver, unit: Unit, n: int) -> None:
    ds = damagepred.solve(stack(unit, n), solver=solver, increments=1)
    i = np.arange(1, n + 1)
    case = f"n = {n}: {unit}"
    exact = unit.weight * i * (2 * n - i + 1) / (2 * unit.k_n * unit.area)
    verify(STACK, case, solver.method, "settlement (m)", -ds["block_displacement_y"].values[-1], exact, 1e-6)


@pytest.mark.parametrize(("unit", "n", "modulus"), [(UNITS[0], 10, 9e9), (UNITS[1], 5, 2e9), (UNITS[2], 8, 0.5e9)])
def test_elastic_blocks_settle_more(verify: Verify, solver: Solver, unit: Unit, n: int, modulus: float) -> None:
    material = replace(unit.material, elastic_modulus=modulus)
    ds = damagepred.solve(
        stack(unit, n, material=material), solver=replace(solver, lump_block_elasticity=True), increments=1
    )
    span = np.where(np.arange(n) == 0, unit.h / 2, unit.h)
    carried = unit.weight * np.arange(n, 0, -1)
    case = f"n = {n}, E {1e-6 * modulus:g} MPa: {unit}"
    exact = np.cumsum(carried / unit.area * (1 / unit.k_n + span / modulus))
    verify(SERIES, case, solver.method, "settlement (m)", -ds["block_displacement_y"].values[-1], exact, 1e-6)


@pytest.mark.parametrize("share", [0.0, 0.1, 1 / 6])
@pytest.mark.parametrize("unit", UNITS, ids=str)
def test_a_joint_turns_under_an_eccentric_load(verify: Verify, solver: Solver, unit: Unit, share: float) -> None:
    force = 1e5 * unit.area
    assembly, block = on_plate(unit, unit.joint(), (0.0, 0.0))
    assembly.load(block, y=-force, at=(share * unit.b, unit.h))
    ds = damagepred.solve(assembly, solver=solver, increments=1).isel(increment=-1, block=block)
    case = f"e = {share:.3g} b, N/A 0.1 MPa: {unit}"
    # the edge that is just about to open is the place of the largest settlement, whatever the eccentricity
    computed = [-float(ds["block_displacement_y"]), -float(ds["block_rotation"]) * unit.b / 2]
    exact = [force / (unit.k_n * unit.area), 6 * force * share / (unit.k_n * unit.t * unit.b)]
    verify(TILT, case, solver.method, "settlement and b/2 times rotation (m)", computed, exact, 1e-6)


@pytest.mark.parametrize(
    ("rule", "contacts", "share"),
    [("lobatto", 2, 1 / 3), ("lobatto", 3, 1.0), ("lobatto", 5, 1.0), ("lobatto", 9, 1.0)]
    + [("midpoint", q, 1 / (1 - 1 / q**2)) for q in (2, 3, 9)],
)
def test_the_rule_for_the_contacts(verify: Verify, solver: Solver, rule: str, contacts: int, share: float) -> None:
    unit = BRICK
    moment = 1e3 * unit.area * unit.b
    assembly, block = on_plate(unit, unit.joint(tensile_strength=1e9, cohesion=1e9), (0.0, 0.0))
    assembly.load(block, moment=moment)
    settings = replace(solver, quadrature=rule, contacts_per_interface=contacts)
    ds = damagepred.solve(assembly, solver=settings, increments=1).isel(increment=-1, block=block)
    case = f"{contacts} contacts, {rule}: {unit}"
    computed = float(ds["block_rotation"]) * unit.k_n * unit.t * unit.b**3 / (12 * moment)
    verify(SPRINGS, case, solver.method, "rotation over that of the continuous joint", computed, share, 1e-6)


@pytest.mark.parametrize(
    ("unit", "degrees", "cohesion"), [(BRICK, 0.5, 0.0), (BRICK, 20.0, 1e4), (UNITS[1], 15.0, 1e4), (STONE, 10.0, 1e5)]
)
def test_a_block_sticks_on_an_incline(verify: Verify, solver: Solver, unit: Unit, degrees: float, cohesion: float):
    """Without a bond the explicit solver's block slips by a thousandth of its way while its weight comes on."""
    angle = np.radians(degrees)
    assembly, block = on_plate(
        unit,
        unit.joint(friction=0.9, cohesion=cohesion, tensile_strength=cohesion),
        (G * np.sin(angle), -G * np.cos(angle)),
    )
    ds = damagepred.solve(assembly, solver=solver, increments=1).isel(increment=-1)
    assert (ds["contact_slip"].values == 0).all()
    turned = ds["block_rotation"].values[block]
    shear, along = unit.weight * np.sin(angle), unit.k_n * unit.t * unit.b**3 / 12
    case = f"α = {degrees:g}°, tan φ 0.9, C and f_t {1e-3 * cohesion:g} kPa: {unit}"
    computed = [ds["block_displacement_x"].values[block] + turned * unit.h / 2, -turned * unit.h / 2]
    exact = [shear / (unit.k_s * unit.area), shear * (unit.h / 2) ** 2 / along]
    verify(STUCK, case, solver.method, "shear displacement and h/2 times rotation (m)", computed, exact, 1e-6)
