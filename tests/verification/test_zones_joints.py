"""Joints between deformable blocks: as between rigid ones with lumped elasticity, and as the bed of an elastic beam."""

from dataclasses import replace

import numpy as np
import pytest

from damagepred import Assembly, Joint, Solver
from damagepred.assembly.assembly import rectangle
from tests.verification.manual import Verify, chapter
from tests.verification.zoned_blocks import BRICKWORK, CONCRETE, NAMES, solved, zones_of

closed_form = chapter("Zones")

SERIES = closed_form(
    title="Stack that is pressed or pulled",
    formula="u_i = σ [i/k_n + (2i - 1) h/(2E)] at the middle of block i;   opening of each joint σ/k_n;\n"
    "rigid: 1/k = 1/k_n + h_a/E_a + h_b/E_b, the same u_i, the joint's opening with the blocks' share",
    source="Springs in series.",
    note="A weightless stack bears σ on top, on joints without friction, so that it may widen; n blocks, the lowest on "
    "the ground. The bricks' elasticity in zones, or lumped into the joints of rigid bricks.",
)
ROTATION = closed_form(
    title="Joint that opens under a deformable block",
    formula="θ = 2 N/(k_n t a²),   a = 3 (b/2 - e);   gap at the free edge θ (b - a)",
    source="As for rigid blocks on a joint without tension: k_n h << E.",
    note="N acts as a pressure that varies linearly over the top, with its resultant at e. The block bends a little: "
    "exact for k_n h/E → 0, here 1e-2.",
)
WINKLER = closed_form(
    title="Brick on a joint under a line load",
    formula="E I φ'' + κ G A (w' - φ) = 0,   κ G A (w'' - φ') - k w = 0,   κ G A (w' - φ) = ∓P/2 at x = 0±;\n"
    "k = k_n t,   κ = 10 (1 + ν)/(12 + 11 ν);   w = Σ A_j exp(-r_j x), r⁴ - r² k/(κ G A) + k/(E I) = 0",
    source="Timoshenko's beam on Winkler's foundation (Hetényi 1946 for thin beams, κ G A → ∞); κ: Cowper (1966).",
    note="Pressure of the joint along the bed; P is spread over a strip of the top as long as the beam is high. What "
    "beams neglect (the beam is squeezed under P, and k_n h/E) remains. λ L > 8, so the ends do not matter.",
)


@pytest.mark.parametrize(
    ("count", "material", "joint", "stress", "size"),
    [(2, BRICKWORK, Joint(normal_stiffness=82e9), -1e6, 0.03), (4, CONCRETE, Joint(normal_stiffness=5e9), 2e5, 0.05)],
)
@pytest.mark.parametrize("blocks", ["rigid", "deformable"])
def test_a_stack_is_springs_in_series(verify, solver, blocks, count, material, joint, stress, size) -> None:
    length, height, thickness = 0.24, 0.075, 0.11
    # its shear stiffness only keeps the bricks from drifting sideways
    law = replace(joint, tensile_strength=1e9, cohesion=0.0, friction=0.0, shear_stiffness=1e6)
    assembly = Assembly(thickness=thickness, gravity=(0.0, 0.0), joint=law, block=material)
    for i in range(count):
        corners = rectangle(0.0, i * height, length, (i + 1) * height)
        assembly.add_block(corners, course=i, zone_size=size if blocks == "deformable" else 0.0)
    assembly.rest_on_ground([0])
    top = count - 1
    force = stress * length * thickness
    if blocks == "deformable":
        assembly.traction(top, lambda x, y: y > count * height - 1e-9, y=stress)
    else:
        assembly.load(top, y=force)
    model, path = solved(assembly, solver, lump_block_elasticity=blocks == "rigid", tolerance=1e-9 * abs(force))
    last = path[-1]
    i = np.arange(1, count + 1)
    case = f"{count} bricks, k_n h/E = {joint.normal_stiffness * height / material.elastic_modulus:.2g}, {blocks}"
    case += f", {1e-6 * stress:g} MPa: {NAMES[material]}"
    exact = stress * (i / joint.normal_stiffness + (2 * i - 1) * height / (2 * material.elastic_modulus))
    verify(SERIES, case, solver.method, "displacement of the blocks (m)", last.displacement[:, 1], exact, 1e-6)
    bed = model.interfaces.block_a < model.n_blocks
    soft = 1 / joint.normal_stiffness + (height / material.elastic_modulus if blocks == "rigid" else 0.0)
    expected = np.full_like(last.opening[bed], stress * soft)
    verify(SERIES, case, solver.method, "opening of the joints between blocks (m)", last.opening[bed], expected, 1e-6)


@pytest.mark.parametrize("share", [0.2, 0.3])
def test_a_joint_opens_under_a_deformable_block(verify: Verify, solver: Solver, share: float) -> None:
    b, height, thickness, stress = 0.24, 0.12, 0.11, 1e5
    pieces = 8
    material = BRICKWORK
    k_n = 1e-2 * material.elastic_modulus / height
    joint = Joint(normal_stiffness=k_n, shear_stiffness=k_n, tensile_strength=0.0, cohesion=0.0)
    assembly = Assembly(thickness=thickness, gravity=(0.0, 0.0), joint=joint, block=material)
    block = assembly.add_block(rectangle(0.0, 0.0, b, height), zone_size=b / pieces)
    assembly.rest_on_ground([block])
    assembly.traction(block, lambda x, y: y > height - 1e-9, y=lambda x, y: -stress * (1 + 12 * share * (x / b - 0.5)))
    _, path = solved(assembly, solver, tolerance=1e-4 * stress * b * thickness)
    force, pressed = stress * b * thickness, 3 * b * (0.5 - share)
    theta = 2 * force / (k_n * thickness * pressed**2)
    case = f"e = {share:g} b, {4 * pieces * pieces // 2} zones"
    verify(ROTATION, case, solver.method, "θ (rad)", -path[-1].displacement[block, 2], theta, 3e-2)
    verify(
        ROTATION, case, solver.method, "gap at the free edge (m)", path[-1].opening.max(), theta * (b - pressed), 3e-2
    )


def beam_on_bed(x, material, height, thickness, k, strip, load):
    """Return the settlement (m) of an endless Timoshenko beam under a load (N) spread over a strip."""
    nu = material.poisson_ratio
    bending = material.elastic_modulus * thickness * height**3 / 12
    shear = 10 * (1 + nu) / (12 + 11 * nu) * material.shear_modulus * height * thickness
    roots = np.sqrt(np.roots([1.0, -k / shear, k / bending]).astype(complex))  # with positive real part
    # point load: phi = sum of B exp(-r x); E I r^2 B = kGA (B + r A); phi(0) = 0 and kGA (w' - phi) = -P/2
    follows = -shear * roots / (shear - bending * roots**2)
    matrix = np.array([follows, -shear * (roots + follows)])
    amplitude = np.linalg.solve(matrix, np.array([0.0, -load / 2]))
    # the strip: the mean of point loads over it, integrated by Gauss
    places, weights = np.polynomial.legendre.leggauss(24)
    off = np.abs(x[:, None] - 0.5 * strip * places)
    return np.asarray((np.exp(-off[:, :, None] * roots) @ amplitude).real @ weights / 2)


@pytest.mark.parametrize(
    ("material", "height", "softness", "size"),
    [(BRICKWORK, 0.1, 2e-2, 0.025), pytest.param(BRICKWORK, 0.1, 2e-3, 0.025, marks=pytest.mark.slow)],
)
def test_a_brick_on_a_joint_is_a_beam_on_a_bed(verify, solver, material, height, softness, size) -> None:
    thickness, load = 0.1, 1e4
    k_n = softness * material.elastic_modulus / height
    bending = material.elastic_modulus * thickness * height**3 / 12
    characteristic = (k_n * thickness / (4 * bending)) ** 0.25
    half = round(4.5 / characteristic / size) * size
    joint = Joint(normal_stiffness=k_n, shear_stiffness=1e-3 * k_n, tensile_strength=1e9, cohesion=0.0, friction=0.0)
    assembly = Assembly(thickness=thickness, gravity=(0.0, 0.0), joint=joint, block=material)
    block = assembly.add_block(rectangle(-half, 0.0, half, height), zone_size=size)
    assembly.rest_on_ground([block])
    strip = height
    assembly.traction(block, lambda x, y: (y > height - 1e-9) & (np.abs(x) < strip / 2), y=-load / (strip * thickness))
    model, path = solved(assembly, solver, maximum_cycles=2_000_000, tolerance=1e-7 * load)
    face = model.interfaces
    place = (face.x[:, None] + face.normal_y[:, None] * face.contact_offset).ravel()
    exact = -k_n * beam_on_bed(place, material, height, thickness, k_n * thickness, strip, load)
    case = f"h = {height:g} m, λ h = {characteristic * height:.2g}, {round(height / size)} cells over h"
    name = f"{case}: {NAMES[material]}"
    verify(WINKLER, name, solver.method, "stress of the joint (Pa)", path[-1].normal_stress.ravel(), exact, 0.06)
    total = (path[-1].normal_stress * face.contact_area).sum()
    verify(WINKLER, f"{case}: {NAMES[material]}", solver.method, "force of the joint (N)", total, -load, 1e-4)
    assert np.isfinite(zones_of(path[-1]).stress).all()
