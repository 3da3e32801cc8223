"""Beams of zones in bending: displacements and stresses against plane elasticity, and their convergence."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

from damagepred import Assembly, BlockMaterial, Solver
from damagepred.arrays import FloatArray
from damagepred.assembly.assembly import rectangle
from damagepred.assembly.mesh import default_zone_size
from damagepred.assembly.points import Where
from tests.verification.manual import Verify, chapter
from tests.verification.zoned_blocks import BRICKWORK, CONCRETE, NAMES, RUBBER, centres, moduli, order, solved, zones_of

pytestmark = pytest.mark.quick_cases("solver")

closed_form = chapter("Zones")
THICKNESS = 0.1

CANTILEVER = closed_form(
    title="Cantilever",
    formula="σ_xx = -P (L - x) y / I,   σ_yy = 0,   τ_xy = P (c² - y²)/(2 I),   I = 2 c³/3\n"
    "u = -P y/(6 E I) [(6 L - 3 x) x + (2 + ν)(y² - c²)]\n"
    "v = P/(6 E I) [3 ν y² (L - x) + (4 + 5 ν) c² x + (3 L - x) x²]",
    source="Timoshenko and Goodier, Theory of Elasticity, art. 21, with the displacements of the clamped end as "
    "boundary values (Augarde and Deeks 2008); plane strain with E/(1 - ν²), ν/(1 - ν).",
    note="The clamped end is moved as the solution has it, the tip bears the parabolic shear. Errors: displacement "
    "root mean square over the gridpoints, stress root mean square over the area (three components together), each "
    "over the largest exact value. Order: slope of log(error) over log(zone size) from 2 to 8 cells over the height; "
    "triangles of constant strain have 2 and 1.",
)
DEEP = closed_form(
    title="Deep beam under uniform load",
    formula="σ_xx = -q/(2 I) [(l² - x²) y + 2 y³/3 - 2 c² y/5],   σ_yy = q/(2 I) (y³/3 - c² y - 2 c³/3)\n"
    "τ_xy = q/(2 I) (c² - y²) x,   I = 2 c³/3;   on the axis\n"
    "v(0) - v(l) = -5 q l⁴/(24 E I) [1 + 12 c²/(5 l²) (4/5 + ν/2)]",
    source="Timoshenko and Goodier, Theory of Elasticity, art. 22, turned upside down (y up, load q on top).",
    note="Span 2 l = twice the height 2 c. The ends bear the tractions of the solution, the axis is supported there. "
    "Order as for the cantilever.",
)


BRICK = closed_form(
    title="Brick of default zones in pure bending",
    formula="W = E I κ² L / 2;   plane strain: E/(1 - ν²)",
    source="Theory of elasticity: plane sections stay plane.",
    note="Both ends are turned by κ L/2. Zones of the default size. Energy is as much too large as the "
    "brick is too stiff.",
)


class Beam(NamedTuple):
    """A solution of plane elasticity: functions of x and y, for a load of 1 Pa times ``load``."""

    displacement: Callable[[FloatArray, FloatArray], FloatArray]
    stress: Callable[[FloatArray, FloatArray], FloatArray]


def cantilever(material: BlockMaterial, plane: str, length: float, c: float, load: float) -> Beam:
    """Return the solution; ``load`` is the force over the thickness (N/m), upwards."""
    modulus, ratio = moduli(material, plane)
    second = 2 * c**3 / 3

    def displacement(x: FloatArray, y: FloatArray) -> FloatArray:
        f = load / (6 * modulus * second)
        u = -f * y * ((6 * length - 3 * x) * x + (2 + ratio) * (y**2 - c**2))
        v = f * (3 * ratio * y**2 * (length - x) + (4 + 5 * ratio) * c**2 * x + (3 * length - x) * x**2)
        return np.stack((u, v), axis=-1)

    def stress(x: FloatArray, y: FloatArray) -> FloatArray:
        s_x, s_xy = -load * (length - x) * y / second, load * (c**2 - y**2) / (2 * second)
        return np.stack((s_x, 0 * x, s_xy), axis=-1)

    return Beam(displacement, stress)


def deep_beam(material: BlockMaterial, plane: str, half: float, c: float, load: float) -> Beam:
    """Return the solution; ``load`` is the pressure on top (Pa)."""
    modulus, ratio = moduli(material, plane)
    second = 2 * c**3 / 3
    f = load / (2 * second)
    sag = 5 * load * half**4 / (24 * modulus * second) * (1 + 2.4 * c**2 / half**2 * (0.8 + ratio / 2))

    def displacement(x: FloatArray, y: FloatArray) -> FloatArray:
        y = -y  # theirs points down
        u = (half**2 * x - x**3 / 3) * y + x * (2 * y**3 / 3 - 0.4 * c**2 * y)
        u = f / modulus * (u + ratio * x * (y**3 / 3 - c**2 * y + 2 * c**3 / 3))
        v = y**4 / 12 - c**2 * y**2 / 2 + 2 * c**3 * y / 3
        v = v + ratio * ((half**2 - x**2) * y**2 / 2 + y**4 / 6 - 0.2 * c**2 * y**2)
        v = v + half**2 * x**2 / 2 - x**4 / 12 - 0.2 * c**2 * x**2 + (1 + ratio / 2) * c**2 * x**2
        return np.stack((u, f / modulus * v - sag), axis=-1)

    def stress(x: FloatArray, y: FloatArray) -> FloatArray:
        s_x = -f * ((half**2 - x**2) * y + 2 * y**3 / 3 - 0.4 * c**2 * y)
        return np.stack((s_x, f * (y**3 / 3 - c**2 * y - 2 * c**3 / 3), f * (c**2 - y**2) * x), axis=-1)

    return Beam(displacement, stress)


def at(axis: int, place: float) -> Where:
    """Return a function that selects the points on a line of x or of y."""
    return lambda x, y: np.abs((x, y)[axis] - place) < 1e-9


def errors(beam: Beam, assembly: Assembly, solver: Solver, plane: str) -> tuple[FloatArray, float, float]:
    """Return computed and exact displacements (2, g, 2), and the relative errors of displacement and stress."""
    model, path = solved(assembly, solver, plane, maximum_cycles=2_000_000)
    mesh, zones = model.mesh, zones_of(path[-1])
    exact = beam.displacement(mesh.x, mesh.y)
    off = np.sqrt(np.mean(np.square(zones.displacement - exact).sum(axis=1))) / np.abs(exact).max()
    stress = beam.stress(*centres(model))
    wrong = np.square(zones.stress[:, :3] - stress).sum(axis=1) @ mesh.zone_area / mesh.zone_area.sum()
    return np.stack((zones.displacement, exact)), float(off), float(np.sqrt(wrong) / np.abs(stress).max())


def converge(verify, form, name, solver, plane, beam, build, height, tip) -> None:
    """Compare on three meshes, and the orders."""
    sizes, moved, stressed = [height / n for n in (2, 4, 8)], [], []
    for size in sizes:
        assembly = build(size)
        pair, off, wrong = errors(beam, assembly, solver, plane)
        moved.append(off)
        stressed.append(wrong)
        cells = round(height / size)
        case = f"{name}, {cells} cells over the height"
        tolerance = 1.0 / cells**2
        exact = beam.displacement(*np.array(tip))[1]
        nearest = int(np.abs(pair[1][:, 1] - exact).argmin())
        verify(form, case, solver.method, "largest deflection (m)", pair[0][nearest, 1], exact, tolerance)
        verify(form, case, solver.method, "error of the stress", wrong, 0.0, 0.5 / cells, scale=1.0)
    for quantity, found, expected, allowed in (
        ("order, displacement", moved, 2.0, 0.1),
        ("order, stress", stressed, 1.0, 0.15),
    ):
        verify(form, f"{name}, 2 to 8 cells", solver.method, quantity, order(sizes, found), expected, allowed)


@pytest.mark.parametrize(
    ("length", "height", "material", "plane"),
    [(2.0, 1.0, CONCRETE, "strain"), pytest.param(0.6, 0.2, RUBBER, "stress", marks=pytest.mark.slow)],
)
def test_a_cantilever_bends(verify, solver, length, height, material, plane) -> None:
    c, load = height / 2, 1e-5 * material.elastic_modulus * height
    beam = cantilever(material, plane, length, c, load)

    def build(size: float) -> Assembly:
        assembly = Assembly(thickness=THICKNESS, gravity=(0.0, 0.0), block=material)
        block = assembly.add_block(rectangle(0.0, -c, length, c), zone_size=size)
        assembly.hold_points(
            block,
            at(0, 0.0),
            x=lambda x, y: beam.displacement(x, y)[:, 0],
            y=lambda x, y: beam.displacement(x, y)[:, 1],
        )
        assembly.traction(block, at(0, length), y=lambda x, y: beam.stress(x, y)[:, 2])
        return assembly

    name = f"{length:g} x {height:g} m, plane {plane}: {NAMES[material]}"
    converge(verify, CANTILEVER, name, solver, plane, beam, build, height, (length, 0.0))


@pytest.mark.parametrize(
    ("height", "material", "plane"),
    [(1.0, BRICKWORK, "stress"), pytest.param(2.4, CONCRETE, "strain", marks=pytest.mark.slow)],
)
def test_a_deep_beam_bends(verify: Verify, solver: Solver, height: float, material: BlockMaterial, plane: str) -> None:
    c, half, load = height / 2, height, 1e-5 * material.elastic_modulus
    beam = deep_beam(material, plane, half, c, load)

    def build(size: float) -> Assembly:
        assembly = Assembly(thickness=THICKNESS, gravity=(0.0, 0.0), block=material)
        block = assembly.add_block(rectangle(-half, -c, half, c), zone_size=size)
        for end in (-1.0, 1.0):
            assembly.traction(
                block,
                at(0, end * half),
                x=lambda x, y: np.sign(x) * beam.stress(x, y)[:, 0],
                y=lambda x, y: np.sign(x) * beam.stress(x, y)[:, 2],
            )
            assembly.hold_points(block, lambda x, y, e=end: np.hypot(x - e * half, y) < 1e-9, y=0.0)
        assembly.hold_points(block, lambda x, y: np.hypot(x, y) < 1e-9, x=0.0)
        assembly.traction(block, at(1, c), y=-load)
        return assembly

    name = f"{2 * half:g} x {height:g} m, plane {plane}: {NAMES[material]}"
    converge(verify, DEEP, name, solver, plane, beam, build, height, (0.0, 0.0))


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize(
    ("length", "height", "material", "angle"),
    [
        (0.24, 0.075, BRICKWORK, 0.0),
        (0.23, 0.076, RUBBER, 0.0),
        (0.29, 0.09, CONCRETE, 0.4),
        (0.11, 0.075, BRICKWORK, 0.0),
        (0.2, 0.2, CONCRETE, 0.0),
        (1.2, 0.1, BRICKWORK, -1.0),
    ],
)
def test_a_brick_of_default_zones_bends(verify, solver, length, height, material, angle, plane) -> None:
    """In pure bending, whichever way the brick lies, at the default size of zones of each solver."""
    bend, half = 1e-6 / height, length / 2
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    corners = np.array(rectangle(-half, -height / 2, half, height / 2)) @ turn.T
    size = default_zone_size(corners, solver.method)

    def own(x: FloatArray, y: FloatArray) -> FloatArray:
        return np.stack((x, y), axis=-1) @ turn

    def exact(x: FloatArray, y: FloatArray) -> FloatArray:
        _, ratio = moduli(material, plane)
        s, t = own(x, y).T
        return np.stack((-bend * s * t, 0.5 * bend * (s**2 + ratio * t**2)), axis=-1) @ turn.T

    assembly = Assembly(thickness=THICKNESS, gravity=(0.0, 0.0), block=material)
    block = assembly.add_block(corners, zone_size=size)
    assembly.hold_points(
        block,
        lambda x, y: np.abs(np.abs(own(x, y)[:, 0]) - half) < 1e-9,
        x=lambda x, y: exact(x, y)[:, 0],
        y=lambda x, y: exact(x, y)[:, 1],
    )
    model, path = solved(assembly, solver, plane, maximum_cycles=2_000_000)
    s_xx, s_yy, s_xy, s_zz = zones_of(path[-1]).stress.T
    nu = material.poisson_ratio
    squares = s_xx**2 + s_yy**2 + s_zz**2 - 2 * nu * (s_xx * s_yy + s_yy * s_zz + s_zz * s_xx) + 2 * (1 + nu) * s_xy**2
    work = 0.5 * float(squares @ model.mesh.zone_area) * THICKNESS / material.elastic_modulus
    second = THICKNESS * height**3 / 12
    case = f"{length:g} x {height:g} m, turned by {angle:g}, plane {plane}: {NAMES[material]}"
    expected = 0.5 * moduli(material, plane)[0] * second * bend**2 * length
    verify(BRICK, case, solver.method, "W (J)", work, expected, 1e-3)
