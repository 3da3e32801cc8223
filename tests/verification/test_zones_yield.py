"""Blocks that yield: whole blocks on the yield surface, unloading, and the limit load of a punch."""

from dataclasses import replace

import numpy as np
import pytest

from damagepred.arrays import FloatArray
from damagepred.assembly import Assembly, Model
from damagepred.assembly.assembly import rectangle
from damagepred.assembly.points import Where
from damagepred.enumerations import ZoneState
from damagepred.scene import BlockMaterial, Joint, Solver
from damagepred.solvers import Increment
from tests.verification.manual import Verify, chapter
from tests.verification.zoned_blocks import moduli, point_forces, solved, zones_of

pytestmark = pytest.mark.quick_cases("solver")

closed_form = chapter("Zones")
LENGTH, HEIGHT, THICKNESS = 0.3, 0.5, 0.1
ALLOWED = {"explicit": 3e-3, "quasi_static": 1e-5}
"""The explicit solver swings beyond its rest a little, and comes back elastically: to just below the limit."""

SURFACE = closed_form(
    title="Blocks on the yield surface",
    formula="σ_1 - σ_3/K = f_c/K or σ_1 = f_t, principal stresses σ_1 ≥ σ_2 ≥ σ_3 of all three directions;\n"
    "f_c = 2 C (√(1 + tan²φ) + tan φ),   K = (√(1 + tan²φ) + tan φ)²;   until then σ_yy = E' ε_yy + ...",
    source="Mohr-Coulomb with tension cut-off; perfect plasticity.",
    note="A block between frictionless plates is pressed or pulled to three times the strain at which it yields, in "
    "steps; its sides bear a constant traction p. Plane stress: σ_zz = 0 takes part, so a lateral pressure adds no "
    "strength, a lateral tension takes some. Elastic: mean σ_yy in the steps before. Limit: σ_yy of all zones in the "
    "steps after, the same in each. The flow is associated, or the limit would not be unique: see below.",
)
BANDS = closed_form(
    title="Blocks that flow without dilation",
    formula="f_c* ≤ |σ_yy| ≤ f_c;   f_c* as f_c with C* = C cos φ, tan φ* = sin φ",
    source="Davis (1968): strength along a band that slips without dilation, ψ = 0. f_c holds while the block deforms "
    "evenly, f_c* once such bands have formed.",
    note="The limit of a material whose flow is not associated is not unique: which of the states in between is found "
    "depends on the mesh and on the way. Mean stress at the end, over f_c: the exact value given is the middle "
    "between the bounds, the allowed error half their distance.",
)
SET = closed_form(
    title="Plastic set after unloading",
    formula="F_weak = f_c A;   after unloading: set = (P/2 - f_c A)/k,   force in the columns ±(P/2 - f_c A)",
    source="Derived: two columns of stiffness k under a stiff beam, P shared; the weak one yields at f_c A, and both "
    "give back P/(2 k).",
    note="A beam kept level on a column that yields and one that does not, on frictionless joints; the dead load P is "
    "taken away by a live load. 1/k = H/(E' A) + 2/(k_n A).",
)
PUNCH = closed_form(
    title="Smooth strip punch",
    formula="q = (2 + π) C",
    source="Prandtl (1920): limit load on a half plane, φ = 0, plane strain.",
    note="Half of it, by symmetry, 5 x 2.5 half widths, moved until the load rises no more. Gridpoints under the punch "
    "go down alike. Elements that are square overestimate: about half a cell beside the punch is pressed as well, "
    "so the error falls with the first power of the size; what is extrapolated to size 0 is given as well.",
)


def weak(cohesion: float, friction: float, tension: float | None = None, dilation: float = 0.0) -> BlockMaterial:
    return BlockMaterial(
        elastic_modulus=2e9,
        poisson_ratio=0.2,
        cohesion=cohesion,
        friction=friction,
        dilation=dilation,
        tensile_strength=tension,
    )


CLAY = weak(50e3, 0.0)
SOFT_BRICK = weak(1.0e6, 0.7, 0.4e6, dilation=0.7)
SAND = weak(0.2e6, 0.5, dilation=0.5)


def slope(material: BlockMaterial) -> float:
    return float(np.hypot(1.0, material.friction) + material.friction)


def strength(material: BlockMaterial, plane: str, lateral: float, pull: bool) -> float:
    """Return the limit of s_yy (Pa) under a lateral stress (Pa)."""
    crushing, ratio = 2 * material.cohesion * slope(material), slope(material) ** 2
    if pull:
        return material.tensile_strength
    # out of plane in plane strain the stress stays in between
    largest = lateral if plane == "strain" else max(lateral, 0.0)
    return ratio * largest - crushing


def on_line(axis: int, place: float) -> Where:
    """Return a function that selects the points on a line of x or of y."""
    return lambda x, y: np.abs((x, y)[axis] - place) < 1e-9


def between_plates(material: BlockMaterial, lateral: float, movement: float, size: float) -> Assembly:
    """Return a block whose top moves, with a constant traction on its sides."""
    assembly = Assembly(thickness=THICKNESS, gravity=(0.0, 0.0), block=material)
    block = assembly.add_block(rectangle(0.0, 0.0, LENGTH, HEIGHT), zone_size=size)
    assembly.hold_points(block, on_line(1, 0.0), y=0.0)
    assembly.hold_points(block, on_line(1, HEIGHT), y=movement)
    assembly.hold_points(block, lambda x, y: (np.abs(x - LENGTH / 2) < 1e-9) & (y < 1e-9), x=0.0)
    if lateral != 0.0:
        for at, outward in ((0.0, -1.0), (LENGTH, 1.0)):
            assembly.traction(block, on_line(0, at), x=outward * lateral)
    return assembly


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize(
    ("name", "material", "lateral", "pull"),
    [
        ("clay pressed", CLAY, 0.0, False),
        pytest.param("soft brick pressed", SOFT_BRICK, 0.0, False, marks=pytest.mark.slow),
        ("soft brick pressed, p = -0.3 MPa", SOFT_BRICK, -0.3e6, False),
        pytest.param("soft brick pressed, p = +0.2 MPa", SOFT_BRICK, 0.2e6, False, marks=pytest.mark.slow),
        pytest.param("cemented sand pressed, p = -0.2 MPa", SAND, -0.2e6, False, marks=pytest.mark.slow),
        ("soft brick pulled", SOFT_BRICK, 0.0, True),
        pytest.param("soft brick pulled, p = -0.3 MPa", SOFT_BRICK, -0.3e6, True, marks=pytest.mark.slow),
    ],
)
def test_a_block_reaches_the_yield_surface_and_stays(verify, solver, name, material, lateral, pull, plane) -> None:
    limit = strength(material, plane, lateral, pull)
    modulus, ratio = moduli(material, plane)
    at_yield = (limit - ratio * lateral) / modulus * HEIGHT
    steps = 6
    movement = 3 * at_yield
    assembly = between_plates(material, lateral, movement, 0.1)
    force = abs(limit) * LENGTH * THICKNESS
    # stresses scatter by a hundred tolerances where all zones yield
    least = (1e-7 if solver.method == "explicit" else 1e-8) * force
    model, path = solved(assembly, solver, plane, steps, tolerance=least, ramp_cycles=5_000)
    mesh = model.mesh
    progress = np.arange(steps + 1) / steps
    stress = np.array([zones_of(i).stress[:, 1] for i in path])
    case = f"{name}, {len(mesh.zones)} zones, plane {plane}"
    # up to the step before it yields; plane strain without dilation still is elastic there
    elastic = progress * movement / at_yield < 0.99
    exact = modulus * progress[elastic] * movement / HEIGHT + ratio * lateral
    mean = stress[elastic] @ mesh.zone_area / mesh.zone_area.sum()
    verify(SURFACE, case, solver.method, "σ_yy, elastic (Pa)", mean, exact, 1e-5, scale=abs(limit))
    expected = np.full_like(stress[-3:], limit)
    verify(SURFACE, case, solver.method, "σ_yy, limit (Pa)", stress[-3:], expected, ALLOWED[solver.method])
    kinds = [ZoneState.TENSION if pull else ZoneState.SHEAR, ZoneState.SHEAR_AND_TENSION]
    if solver.method == "explicit":
        kinds.append(ZoneState.YIELDED)
    yielding = [np.isin(zones_of(i).state, kinds).any() for i in path[-3:]]
    verify(SURFACE, case, solver.method, "yields in shear (pressed) or tension (pulled)", bool(np.all(yielding)), True)


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize(("share", "size"), [(1.1, 0.1), (1.2, 0.15)])
def test_unloading_leaves_a_set(verify: Verify, solver: Solver, share: float, size: float, plane: str) -> None:
    """``share``: half the load over the strength of the weak column."""
    material = weak(1.0e6, 0.5, 1.0e6, dilation=0.5)
    strong = replace(material, cohesion=None, tensile_strength=None)
    joint = Joint(normal_stiffness=50e9, shear_stiffness=1e9, tensile_strength=1e9, cohesion=0.0, friction=0.0)
    assembly = Assembly(thickness=THICKNESS, gravity=(0.0, 0.0), joint=joint)
    columns = []
    for made_of, left in ((material, 0.0), (strong, 0.6)):
        columns.append(assembly.add_block(rectangle(left, 0.0, left + LENGTH, HEIGHT), made_of, zone_size=size))
        assembly.hold_points(
            columns[-1], lambda x, y, at=left + LENGTH / 2: (np.abs(x - at) < 1e-9) & (y < 1e-9), x=0.0
        )
    beam = assembly.add_block(rectangle(0.0, HEIGHT, 0.6 + LENGTH, HEIGHT + 0.1), zone_size=0.0)
    floor = assembly.add_block(rectangle(0.0, -0.1, 0.6 + LENGTH, 0.0), zone_size=0.0)
    assembly.support(beam, x=True, y=False, rotation=True)
    assembly.support(floor)
    area = LENGTH * THICKNESS
    most = 2 * material.cohesion * slope(material) * area
    load = 2 * share * most
    assembly.load(beam, y=-load)
    assembly.push(beam, y=load)
    model, path = solved(assembly, solver, plane, 2)
    modulus, _ = moduli(material, plane)
    stiffness = 1 / (HEIGHT / (modulus * area) + 2 / (joint.normal_stiffness * area))
    mesh = model.mesh
    first, last = path[0], path[-1]
    sunk = np.array([first.displacement[beam, 1], last.displacement[beam, 1]])
    left = (share - 1) * most
    case = f"P/2 = {share:g} f_c A, {len(mesh.zones)} zones, plane {plane}"
    if plane == "strain":  # what flows out of plane is not elastic: only the forces are known in closed form
        sunk, exact = np.diff(sunk), np.array([load / (2 * stiffness)])
        quantity = "recovery"
    else:
        exact = -np.array([(load - most) / stiffness, left / stiffness])
        quantity = "settlement under P, and set"
    verify(SET, case, solver.method, f"{quantity} (m)", sunk, exact, ALLOWED[solver.method])
    force = []
    for increment in (first, last):
        stress = zones_of(increment).stress[:, 1]
        force += [(stress * mesh.zone_area)[mesh.zone_block == c].sum() * THICKNESS / HEIGHT for c in columns]
    expected = [-most, most - load, left, -left]
    verify(
        SET, case, solver.method, "forces of the columns under P and after (N)", force, expected, ALLOWED[solver.method]
    )


def punch(solver: Solver, cells: int, increments: int = 4) -> tuple[Model, Increment, FloatArray]:
    """Return model, last increment, and mean pressures (Pa) under a punch of half width 1 m, for a number of cells."""
    wide, deep, size = 5.0, 2.5, 1.0 / cells
    material = BlockMaterial(elastic_modulus=1e7, poisson_ratio=0.3, cohesion=1e4, friction=0.0)
    assembly = Assembly(thickness=1.0, gravity=(0.0, 0.0), block=material)
    block = assembly.add_block(rectangle(0.0, 0.0, wide, deep), zone_size=size)
    assembly.hold_points(block, lambda x, y: y < 1e-9, x=0.0, y=0.0)
    assembly.hold_points(block, lambda x, y: (x < 1e-9) | (x > wide - 1e-9), x=0.0)
    assembly.hold_points(block, lambda x, y: (y > deep - 1e-9) & (x < 1.0 + 1e-9), y=-0.05)
    model, path = solved(assembly, solver, "strain", increments, tolerance=1.0)
    mesh = model.mesh
    under = (mesh.y > deep - 1e-9) & (mesh.x < 1.0 + 1e-9)
    return model, path[-1], np.array([-point_forces(model, zones_of(i).stress)[under, 1].sum() for i in path])


@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_without_dilation_bands_form(verify: Verify, solver: Solver, plane: str) -> None:
    material = replace(SOFT_BRICK, dilation=0.0)
    whole = strength(material, plane, 0.0, False)
    angle = np.arctan(material.friction)
    banded = replace(material, cohesion=material.cohesion * np.cos(angle), friction=np.sin(angle))
    share = strength(banded, plane, 0.0, False) / whole
    modulus, _ = moduli(material, plane)
    assembly = between_plates(material, 0.0, 3 * whole / modulus * HEIGHT, 0.1)
    force = abs(whole) * LENGTH * THICKNESS
    model, path = solved(assembly, solver, plane, 6, tolerance=1e-6 * force)
    mesh = model.mesh
    mean = zones_of(path[-1]).stress[:, 1] @ mesh.zone_area / mesh.zone_area.sum()
    case = f"soft brick, {len(mesh.zones)} zones, plane {plane}"
    exact = (1 + share) / 2
    verify(BANDS, case, solver.method, "mean σ_yy over f_c", mean / whole, exact, (1 - share) / 2 + 1e-3, scale=1.0)


@pytest.mark.quick_cases("solver", fine=[False])
@pytest.mark.parametrize(
    ("solver", "fine"), [("explicit", False), ("quasi_static", False), ("explicit", True)], indirect=["solver"]
)
def test_a_punch_sinks_at_its_limit_load(verify: Verify, solver: Solver, fine: bool) -> None:
    """The finer mesh, one block of zones that all yield, is for the explicit solver."""
    cells = (2, 4) if fine else (2,)
    found = []
    for count in cells:
        _, last, force = punch(solver, count)
        found.append(force[-1] / 1e4)
        assert not last.collapsed
        verify(PUNCH, f"{count} cells under half the punch", solver.method, "q/C", found[-1], 2 + np.pi, 0.4 / count)
        verify(
            PUNCH,
            f"{count} cells under half the punch",
            solver.method,
            "rise of q/C in the last quarter of the movement",
            found[-1] - force[-2] / 1e4,
            0.0,
            2e-3,
            scale=2 + np.pi,
        )
    if not fine:
        return
    case = f"{cells[0]} and {cells[1]} cells, to size 0"
    verify(PUNCH, case, solver.method, "q/C", 2 * found[1] - found[0], 2 + np.pi, 0.02)
