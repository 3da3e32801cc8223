"""Patch tests: constant fields are reproduced in blocks of any shape and across joints between them."""

import numpy as np
import pytest

from damagepred import Assembly, Joint
from damagepred.arrays import BoolArray, FloatArray
from damagepred.assembly.mesh import division, joined_quads
from damagepred.assembly.points import Where
from tests.verification import zoned_blocks
from tests.verification.manual import chapter
from tests.verification.zoned_blocks import BRICKWORK, CONCRETE, NAMES, RUBBER, gradient_of, solved, stress_of, zones_of

pytestmark = pytest.mark.quick_cases("solver")

closed_form = chapter("Zones")

PATCH = closed_form(
    title="Patch test of one block",
    formula="u = H x on the boundary:   u = H x inside,\n"
    "σ = D ε,   ε = (H + Hᵀ)/2,   σ_zz = 0 (plane stress) or ν (σ_xx + σ_yy) (plane strain)",
    source="Irons and Razzaque (1972): a field of constant strain must be reproduced exactly on any mesh.",
    note="All gridpoints of the outline are moved. Stresses over the largest stress, displacements over the largest "
    "displacement.",
)
JOINED = closed_form(
    title="Patch test across joints",
    formula="σ constant;   u = ε x + Σ J_i [x beyond line i],   J_i = n (n·σn)/k_n + s (s·σn)/k_s",
    source="Derived: straight lines cut the patch; the traction σn on a line opens and shears its joint evenly by J, "
    "which shifts all that lies beyond it.",
    note="A rectangle cut by straight lines into triangles, quadrilaterals and pentagons, each with zones of another "
    "size, so that gridpoints on the two sides of a joint do not meet. Tractions outside; three "
    "degrees of freedom held.",
)

SHAPES: dict[str, list[tuple[float, float]]] = {
    "trapezium": [(0.0, 0.0), (0.4, 0.0), (0.33, 0.2), (0.05, 0.2)],
    "triangle": [(0.0, 0.0), (0.3, 0.05), (0.1, 0.25)],
    "pentagon": [(0.0, 0.0), (0.2, -0.03), (0.31, 0.14), (0.12, 0.3), (-0.05, 0.15)],
    "distorted quadrilateral": [(0.0, 0.0), (0.5, 0.1), (0.35, 0.4), (-0.02, 0.1)],
    "sliver": [(2.0, 1.0), (3.0, 1.0), (3.01, 1.02)],
}
GRADIENT = np.array([[3e-4, 1e-4], [-2.5e-4, -1.2e-4]])


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize(
    ("shape", "size", "material"),
    [
        ("trapezium", 0.08, BRICKWORK),
        ("triangle", 0.05, CONCRETE),
        ("pentagon", 0.06, RUBBER),
        ("distorted quadrilateral", 0.1, BRICKWORK),
        ("sliver", 0.2, CONCRETE),
    ],
)
def test_constant_strain_in_a_block_of_any_shape(verify, solver, shape, size, material, plane) -> None:
    corners = np.array(SHAPES[shape])
    pattern, points = joined_quads(*division(corners - corners.mean(axis=0), size))
    outline = points[pattern.facets[:, 0]] + corners.mean(axis=0)
    assembly = Assembly(thickness=0.1, gravity=(0.0, 0.0), block=material)
    block = assembly.add_block(corners, zone_size=size)

    def on_outline(x: FloatArray, y: FloatArray) -> BoolArray:
        return np.array([np.hypot(*(outline - p).T).min() < 1e-9 for p in np.column_stack((x, y))])

    assembly.hold_points(
        block,
        on_outline,
        x=lambda x, y: GRADIENT[0, 0] * x + GRADIENT[0, 1] * y,
        y=lambda x, y: GRADIENT[1, 0] * x + GRADIENT[1, 1] * y,
    )
    model, path = solved(assembly, solver, plane)
    assert len(outline) < model.mesh.x.size, "nothing is free inside"
    zones = zones_of(path[-1])
    exact = stress_of(material, plane, GRADIENT)
    case = f"{shape}, {len(model.mesh.zones)} zones, plane {plane}: {NAMES[material]}"
    expected = np.broadcast_to(exact, zones.stress.shape)
    verify(PATCH, case, solver.method, "s_xx, s_yy, s_xy, s_zz (Pa)", zones.stress, expected, 1e-10)
    place = np.column_stack((model.mesh.x, model.mesh.y))
    verify(PATCH, case, solver.method, "displacement (m)", zones.displacement, place @ GRADIENT.T, 1e-10)


Line = tuple[float, float, float]
"""A point x, y on it, and the direction of its normal (rad)."""

STRAIGHT: tuple[Line, ...] = ((0.3, 0.0, 0.0), (0.0, 0.15, np.pi / 2), (0.55, 0.0, 0.0))
SKEWED: tuple[Line, ...] = ((0.35, 0.2, 0.3), (0.4, 0.2, 1.4), (0.55, 0.1, -0.8))
LENGTH, HEIGHT = 0.8, 0.4


def cut(polygon: list[tuple[float, float]], line: Line) -> list[list[tuple[float, float]]]:
    """Return the parts of a convex polygon behind and beyond a line; points on it belong to both."""
    x, y, angle = line
    parts: list[list[tuple[float, float]]] = []
    for sign in (-1.0, 1.0):
        part: list[tuple[float, float]] = []
        height = [sign * ((px - x) * np.cos(angle) + (py - y) * np.sin(angle)) for px, py in polygon]
        for (p, a), (q, b) in zip(zip(polygon, height), zip(polygon[1:] + polygon[:1], height[1:] + height[:1])):
            if a >= 0:
                part.append(p)
            if a * b < 0:
                part.append((p[0] + (q[0] - p[0]) * a / (a - b), p[1] + (q[1] - p[1]) * a / (a - b)))
        if len(part) > 2:
            parts.append(part)
    return parts


def along(axis: int, at: float) -> Where:
    """Return a function that selects the points on a line of x or of y."""
    return lambda x, y: np.abs((x, y)[axis] - at) < 1e-9


def at_point(point: FloatArray) -> Where:
    return lambda x, y: np.hypot(x - point[0], y - point[1]) < 1e-9


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize(
    ("lines", "material", "stress"),
    [
        (STRAIGHT, BRICKWORK, (0.0, -1e6, 0.0)),
        (STRAIGHT, CONCRETE, (2e5, -1e6, 3e5)),
        (SKEWED, BRICKWORK, (-5e5, -1e6, 4e5)),
        pytest.param(SKEWED, RUBBER, (3e3, 2e3, -1e3), marks=pytest.mark.slow),
    ],
)
def test_constant_stress_across_joints(verify, solver, lines, material, stress, plane) -> None:
    joint = Joint(
        normal_stiffness=82e9 * material.elastic_modulus / 9e9,
        shear_stiffness=36e9 * material.elastic_modulus / 9e9,
        tensile_strength=1e12,
        cohesion=1e12,
    )
    polygons = [[(0.0, 0.0), (LENGTH, 0.0), (LENGTH, HEIGHT), (0.0, HEIGHT)]]
    for line in lines:
        polygons = [part for polygon in polygons for part in cut(polygon, line)]
    s_x, s_y, s_xy = stress
    tensor = np.array([[s_x, s_xy], [s_xy, s_y]])
    strain = gradient_of(material, plane, stress)

    def displacement(x: FloatArray, y: FloatArray, inside: FloatArray) -> FloatArray:
        moved = np.column_stack((x, y)) @ strain.T
        for px, py, angle in lines:
            n, s = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
            traction = tensor @ n
            jump = n * (n @ traction) / joint.normal_stiffness + s * (s @ traction) / joint.shear_stiffness
            moved = moved + ((inside - (px, py)) @ n > 0)[:, None] * jump
        return moved

    assembly = Assembly(thickness=0.1, gravity=(0.0, 0.0), block=material, joint=joint)
    for i, polygon in enumerate(polygons):
        assembly.add_block(polygon, zone_size=(0.07, 0.11, 0.16)[i % 3])
    sides = ((0, 0.0, (-1.0, 0.0)), (0, LENGTH, (1.0, 0.0)), (1, 0.0, (0.0, -1.0)), (1, HEIGHT, (0.0, 1.0)))
    for block, polygon in enumerate(polygons):
        for axis, at, outward in sides:
            if (np.abs(np.array(polygon)[:, axis] - at) < 1e-12).sum() == 2:
                t_x, t_y = tensor @ np.array(outward)
                assembly.traction(block, along(axis, at), x=t_x, y=t_y)
    # two corners of the first block hold the patch in place, without force: they move as they should
    corners = np.array(polygons[0])
    first, second = corners[0], corners[len(corners) // 2]
    held = displacement(*np.stack((first, second), axis=1), np.tile(corners.mean(axis=0), (2, 1)))
    across = int(np.abs(second - first).argmin())
    assembly.hold_points(0, at_point(first), x=held[0, 0], y=held[0, 1])
    assembly.hold_points(0, at_point(second), **{"xy"[across]: held[1, across]})
    force = np.abs(stress).max() * HEIGHT * assembly.thickness
    model, path = solved(assembly, solver, plane, maximum_cycles=1_000_000, tolerance=1e-11 * force)
    mesh = model.mesh
    zones = zones_of(path[-1])
    exact = np.array([s_x, s_y, s_xy, zoned_blocks.out_of_plane(material, plane, s_x + s_y)])
    name = "straight" if lines is STRAIGHT else "skewed"
    case = f"{len(polygons)} blocks, {name} joints, plane {plane}: {NAMES[material]}"
    expected = np.broadcast_to(exact, zones.stress.shape)
    verify(JOINED, case, solver.method, "s_xx, s_yy, s_xy, s_zz (Pa)", zones.stress, expected, 1e-7)
    middle = np.array([np.mean(p, axis=0) for p in polygons])[mesh.gridpoint_block]
    verify(
        JOINED, case, solver.method, "displacement (m)", zones.displacement, displacement(mesh.x, mesh.y, middle), 1e-7
    )
