"""Elastic blocks in physical time against closed forms: they ring, alone and in joints, and come to rest."""

from typing import Any

import numpy as np
import pytest
from scipy import sparse
from scipy.optimize import curve_fit
from scipy.sparse.linalg import eigsh

from damagepred import Assembly, BlockMaterial, Dynamics, Joint, Scene, Solver, solve
from damagepred.assembly.assembly import rectangle
from damagepred.errors import DivergenceError
from damagepred.one_wall.judged_path import dynamic_run, model_of
from damagepred.solvers.dynamics.body_motion import strain_mass
from damagepred.solvers.dynamics.energy_balance import EnergyBalance
from damagepred.solvers.dynamics.run import DynamicRun
from damagepred.solvers.system.discrete_system import DiscreteSystem
from tests.solvers.dynamic_scenes import THICKNESS, momentum, turned
from tests.solvers.walls import gridpoint_mass
from tests.verification.manual import Verify, chapter

pytestmark = pytest.mark.quick_cases()

closed_form = chapter("Dynamics")
ELASTIC = Solver(blocks="elastic")
E, B, H, DENSITY, PLATE = 9e9, 0.24, 0.075, 2000.0, 0.1
BRICK = BlockMaterial(elastic_modulus=E, poisson_ratio=0.19, density=DENSITY)
MASS = DENSITY * B * H * THICKNESS
STIFFNESS = E * B * H * THICKNESS, E * B * THICKNESS * H**3 / 12
"""Of strain (N m) and curvature (N m3)."""
INERTIA = MASS * B**2 / 12, DENSITY * THICKNESS * (H * B**5 / 720 + B**3 * H**3 / 144)
"""Of strain (kg m2) and curvature (kg m4)."""

ALONE = closed_form(
    title="Elastic block that rings alone",
    formula="stretching: ω² = E b h t / (ρ t h b³/12) = 12 E / (ρ b²)\n"
    "bending: ω² = (E b t h³/12) / (ρ t (h b⁵/720 + b³ h³/144))",
    source="Rayleigh quotient of the block's field.",
    note="Central differences shift the frequency to (2/dt) asin(ω dt/2), which is taken into account.",
)
ON_SPRING = closed_form(
    title="Elastic block on a spring",
    formula="K = | k        -k b/2             |   M = | m  0        |\n"
    "    | -k b/2   k b²/4 + E b h t   |       | 0  m b²/12  |,   k = K h t",
    source="Two masses: eigenvalues of a matrix of two rows.",
    note="A head joint of stiffness K joins the brick to a held plate, whose half is lumped into it.",
)
BENDING_ON_SPRINGS = closed_form(
    title="Elastic block that bends between two springs",
    formula="ω² = (E b t h³/12 + 2 (b/2)² K h³ t/12) / (ρ t (h b⁵/720 + b³ h³/144))",
    source="The ends turn by κ b/2 against the joints.",
    note="The bricks' shear joints to the plates are so soft that they do not count.",
)
BAR = closed_form(
    title="Free bar of elastic blocks",
    formula="stretching: ω = π sqrt(E'/ρ) / L,  1/E' = 1/E + 1/(k_n b)\n"
    "bending: ω = 4.730² sqrt(E' I/(ρ A L⁴)), less by rotatory inertia: 1 - 49.48 h²/(24 L²)",
    source="d'Alembert; Euler and Bernoulli, rotatory inertia by Rayleigh's quotient.",
    note="Twelve bricks end to end; their joints are so stiff in shear that this does not count. Frequency by least "
    "squares.",
)
WALL = closed_form(
    title="Frequencies of a bonded wall of elastic blocks",
    formula="det(K - ω² M) = 0",
    source="The same wall of bricks cut into zones a quarter of a course high.",
    note="Running bond on the ground, 1.92 x 0.75 m. The fourth mode is one along the wall.",
)
REST = closed_form(
    title="Elastic blocks that come to rest",
    formula="strain, curvature and displacement are those of the quasi-static solver",
    source="Equilibrium does not depend on the way to it.",
    note="The movement is so small that the squares of rotations do not count.",
)
AUDIT = closed_form(
    title="Elastic blocks: what is kept without damping",
    formula="kinetic energy + energy of joints and blocks = work of the loads; momentum and angular momentum",
    source="Newton's laws.",
)
DAMPED = closed_form(
    title="Elastic block whose ringing is damped",
    formula="peaks fall by exp(-2π ξ/sqrt(1 - ξ²)), ξ = α/(2ω) + βω/2",
    source="Textbook.",
)
STABLE = closed_form(
    title="Stable time step of elastic blocks", formula="dt <= 2/ω_max", source="Textbook: central differences."
)


def strong(stiffness: float = 82e9, shear: float = 36e9) -> Joint:
    return Joint(normal_stiffness=stiffness, shear_stiffness=shear, tensile_strength=1e9, cohesion=1e9)


def started(assembly: Assembly, duration: float, outputs: int, **settings: Any) -> DynamicRun:
    dynamics = Dynamics(duration=duration, outputs=outputs, **{"start": "unstressed"} | settings)
    return dynamic_run(assembly.build(ELASTIC), ELASTIC, dynamics)


def excited(course: DynamicRun, mode: int, first: float = 0.0, rate: float = 0.0) -> DynamicRun:
    """Give block 0 a strain, or a curvature, and its rate."""
    strains = course.motion.strains
    inverse, stiffness, dt = strains.inverse_mass[0, mode], strains.stiffness[0, mode], course.timing.step
    strains.displacement[0, mode], strains.force[0, mode] = first, -stiffness * first
    strains.velocity[0, mode] = rate + 0.5 * dt * stiffness * first * inverse  # half a step ago
    course.energy = EnergyBalance(course.bodies, course.motion, course.damping, dt, course.energy.terms)
    return course


def brick(angle: float = 0.0, joint: Joint | None = None, plates: int = 0) -> Assembly:
    """One brick, block 0, turned, with held plates beside it."""
    wall = Assembly(gravity=(0.0, 0.0), thickness=THICKNESS, joint=joint or strong(), block=BRICK)
    wall.add_block(turned(rectangle(0.0, 0.0, B, H), angle))
    for box in (rectangle(-PLATE, 0.0, 0.0, H), rectangle(B, 0.0, B + PLATE, H))[:plates]:
        wall.support(wall.add_block(turned(box, angle)))
    return wall


def cosine(omega: float, dt: float, time: np.ndarray) -> np.ndarray:
    """What central differences make of cos(ω t), which begins at rest."""
    return np.cos(2 / dt * np.arcsin(omega * dt / 2) * time)


@pytest.mark.parametrize("mode", [0, 1], ids=["strain", "curvature"])
@pytest.mark.parametrize("angle", [0.0, 0.5])
def test_a_brick_rings_alone(verify: Verify, mode: int, angle: float) -> None:
    omega = float(np.sqrt(STIFFNESS[mode] / INERTIA[mode]))
    first = 1e-4
    course = excited(started(brick(angle), 3 * 2 * np.pi / omega, 40, time_step_safety=0.3), mode, first)
    path = list(course)
    time = np.array([i.motion.time for i in path if i.motion])
    strain = np.array([i.strain for i in path])[:, 0, mode]
    name = ("stretching", "bending")[mode]
    exact = first * cosine(omega, course.timing.step, time)
    case = f"{name}, turned by {angle}"
    verify(ALONE, case, "dynamic", "amplitude", strain, exact, 1e-8)
    highest = np.sqrt(max(k / m for k, m in zip(STIFFNESS, INERTIA)))
    verify(ALONE, name, "dynamic", "highest ω (rad/s)", course.frequency.intact, highest, 1e-9)


def test_a_brick_on_a_spring_has_two_modes(verify: Verify) -> None:
    joint = strong(shear=1.0)
    spring = H * THICKNESS / (1 / joint.normal_stiffness + PLATE / 2 / E)
    stiffness = np.array([[spring, -spring * B / 2], [-spring * B / 2, spring * B**2 / 4 + STIFFNESS[0]]])
    root = np.sqrt([MASS, INERTIA[0]])
    values, shapes = np.linalg.eigh(stiffness / root[:, None] / root)
    start = np.array([1e-3, 0.0]) * root  # velocity
    wall = brick(joint=joint, plates=1)
    wall.set_velocity(0, x=1e-3)
    course = started(wall, 4 * 2 * np.pi / np.sqrt(values[0]), 100)
    path, dt = list(course), course.timing.step
    time = np.array([i.motion.time for i in path if i.motion])[:, None]
    shifted = 2 / dt * np.arcsin(np.sqrt(values) * dt / 2)
    modes = (start @ shapes) * dt / np.sin(shifted * dt) * np.sin(shifted * time)
    exact = modes @ shapes.T / root
    found = np.array([(i.displacement[0, 0], i.strain[0, 0]) for i in path if i.strain is not None])
    for k, (quantity, unit) in enumerate((("displacement", "m"), ("strain", ""))):
        verify(
            ON_SPRING,
            "brick on a head joint, hurled along it",
            "dynamic",
            f"{quantity} ({unit})",
            found[:, k],
            exact[:, k],
            1e-6,
        )


def test_a_brick_bends_between_two_springs(verify: Verify) -> None:
    joint = strong(shear=1.0)
    stiffness = 1 / (1 / joint.normal_stiffness + PLATE / 2 / E)
    omega = float(np.sqrt((STIFFNESS[1] + 2 * (B / 2) ** 2 * stiffness * THICKNESS * H**3 / 12) / INERTIA[1]))
    course = excited(started(brick(joint=joint, plates=2), 3 * 2 * np.pi / omega, 40), 1, rate=1e-3)
    path, dt = list(course), course.timing.step
    time = np.array([i.motion.time for i in path if i.motion])
    shifted = 2 / dt * np.arcsin(omega * dt / 2)
    exact = 1e-3 * dt * np.sin(shifted * time) / np.sin(shifted * dt)
    computed = np.array([i.strain[0, 1] for i in path if i.strain is not None])
    verify(BENDING_ON_SPRINGS, "brick between two plates", "dynamic", "curvature (1/m)", computed, exact, 1e-5)


@pytest.mark.parametrize(("mode", "tolerance"), [("stretching", 5e-3), ("bending", 1e-2)])
def test_a_free_bar_of_bricks_rings_as_a_bar(verify: Verify, mode: str, tolerance: float) -> None:
    count, joint = 12, strong(400e9, 4000e9)
    length = count * B
    modulus = 1 / (1 / E + 1 / (joint.normal_stiffness * B))
    wall = Assembly(gravity=(0.0, 0.0), thickness=THICKNESS, joint=joint, block=BRICK)
    for i in range(count):
        wall.add_block(rectangle(i * B, 0.0, (i + 1) * B, H))
    place = (np.arange(count) + 0.5) / count
    if mode == "stretching":
        omega, axis = np.pi * np.sqrt(modulus / DENSITY) / length, 0
        shape, slope = np.cos(np.pi * place), np.zeros(count)
    else:
        root, axis = 4.730040744862704, 1
        omega = root**2 * np.sqrt(modulus * H**2 / 12 / DENSITY) / length**2
        omega *= 1 - 49.48 * (H / length) ** 2 / 24
        ratio = (np.cosh(root) - np.cos(root)) / (np.sinh(root) - np.sin(root))
        x = root * place
        shape = np.cosh(x) + np.cos(x) - ratio * (np.sinh(x) + np.sin(x))
        slope = root / length * (np.sinh(x) - np.sin(x) - ratio * (np.cosh(x) + np.cos(x)))
    for i in range(count):
        wall.set_velocity(i, **{"xy"[axis]: 1e-4 * shape[i]}, rotation=1e-4 * slope[i])
    path = list(started(wall, 1.5 * 2 * np.pi / omega, 200, new_contacts=False))
    time = np.array([i.motion.time for i in path if i.motion])
    moved = np.array([i.displacement[:, axis] for i in path]) @ shape
    (_, found), _ = curve_fit(lambda t, a, w: a * np.sin(w * t), time, moved, (1e-4 / omega * (shape**2).sum(), omega))
    verify(BAR, f"12 bricks, {mode}", "dynamic", "ω (rad/s)", found, omega, tolerance)


def frequencies(**solver: Any) -> np.ndarray:
    """Four lowest frequencies (Hz) of a small bonded wall."""
    tables: dict[str, Any] = {"wall": {"length": 1.92, "height": 0.75}, "solver": solver}
    model = model_of(Scene.from_dict(tables))
    system, mass = DiscreteSystem.of(model), np.zeros(model.size)
    if model.mesh is not None:
        mass[model.mesh.dof_x] = mass[model.mesh.dof_y] = gridpoint_mass(model)
    else:
        turning = model.density * model.blocks.polar * model.block_law.thickness
        mass[: 3 * model.n_blocks] = np.column_stack((model.mass, model.mass, turning)).ravel()
    if model.elastic is not None:
        mass[system.strain_dofs] = strain_mass(model).ravel()
    free = system.free_dofs
    stiffness = system.elastic_stiffness.tocsr()[free][:, free].tocsc()
    inertia = sparse.diags_array(mass[free]).tocsc()
    return np.sqrt(np.sort(eigsh(stiffness, k=4, M=inertia, sigma=0.0, return_eigenvectors=False))) / (2 * np.pi)


def test_a_bonded_wall_has_the_frequencies_of_one_of_zones(verify: Verify) -> None:
    exact = frequencies(blocks="deformable", zone_size=H / 4, contacts_per_interface=5)
    elastic, rigid = frequencies(blocks="elastic"), frequencies(blocks="rigid")
    for k in range(4):
        case = f"mode {k + 1}; rigid bricks {100 * (rigid[k] / exact[k] - 1):+.2f} %"
        verify(WALL, case, "eigenvalues", "frequency (Hz)", elastic[k], exact[k], 1.1e-2)
    assert np.abs(elastic / exact - 1)[1:].max() < 3e-3
    assert np.abs(rigid / exact - 1)[:3].max() < 5e-3
    assert rigid[3] > 1.06 * exact[3]


@pytest.mark.parametrize("movement", ["dishing", "doming"])
def test_a_bonded_wall_comes_to_rest_where_the_static_one_is(verify: Verify, movement: str) -> None:
    tables: dict[str, Any] = {
        "wall": {"length": 1.2, "height": 0.45},
        "joint": {"tensile_strength": 1e8, "cohesion": 1e8},
        "movement": {"kind": movement, "central_deflection": 1e-5, "increments": 1},
        "solver": {"blocks": "elastic"},
    }
    static = solve(Scene.from_dict(tables))
    time = {"duration": 0.1, "outputs": 2, "movement_time": 0.02, "damping": "local"}
    moved = solve(Scene.from_dict(tables | {"dynamics": time}))
    for name in ("block_strain", "block_curvature", "block_displacement_y", "contact_normal_stress"):
        exact = static[name].values[-1]
        case = f"bonded wall, {movement}"
        verify(REST, case, "dynamic", name, moved[name].values[-1], exact, 1e-4, scale=float(np.abs(exact).max()))


@pytest.mark.parametrize("dry", [False, True], ids=["bonded", "struck"])
def test_bricks_in_flight_keep_energy_and_momentum(verify: Verify, dry: bool) -> None:
    """Two bricks fly and spin, bonded, or strike each other on a corner: strain and curvature move no centre."""
    joint = Joint(tensile_strength=0.0, cohesion=0.0, friction=0.0) if dry else strong()
    wall = Assembly(gravity=(0.0, 0.0), thickness=THICKNESS, joint=joint, block=BRICK)
    for k in range(2):
        wall.add_block(
            turned(rectangle(0.1 * k, 0.0, B + 0.1 * k, H), 0.1 * k, (0.0, (H + 1e-3) * k))
            if dry
            else rectangle(0.1 * k, H * k, B + 0.1 * k, H * (k + 1))
        )
    if dry:
        wall.set_velocity(1, y=-1.0, x=0.2)
    else:
        for k in range(2):
            wall.set_velocity(k, x=1.0 - 20.0 * (k - 0.5) * H, y=0.5 + 20.0 * (k - 0.5) * 0.1, rotation=20.0)
    course = started(wall, 0.02, 100, time_step_safety=0.1)
    before = momentum(course)
    path = list(course)
    energy = [i.energy for i in path]
    assert max(float(np.abs(i.strain).max()) for i in path if i.strain is not None) > 1e-6
    case = "two bricks strike" if dry else "two bonded bricks spin"
    computed = momentum(course)
    verify(AUDIT, case, "dynamic", "momentum, angular momentum", computed, before, 1e-9, scale=np.abs(before).max())
    computed = max(abs(e.energy_error) for e in energy)
    verify(AUDIT, case, "dynamic", "energy error over the energy", computed, 0.0, 1e-3, scale=energy[0].kinetic_energy)


@pytest.mark.parametrize("damping", ["viscous", "rayleigh"])
@pytest.mark.parametrize("mode", [0, 1], ids=["strain", "curvature"])
def test_ringing_is_damped(verify: Verify, damping: str, mode: int) -> None:
    omega = float(np.sqrt(STIFFNESS[mode] / INERTIA[mode]))
    hertz = omega / (2 * np.pi)
    second = {"second_frequency": 2.0 * hertz} if damping == "rayleigh" else {}
    first, ratio = (hertz, 0.05) if damping == "viscous" else (0.5 * hertz, 0.05 * (0.5 * 2.0 + 1.0) / 2.5)
    course = started(
        brick(), 4 / hertz, 800, damping=damping, damping_ratio=0.05, frequency=first, time_step_safety=0.02, **second
    )
    path = list(excited(course, mode, rate=1e-2))
    strain = np.array([i.strain for i in path])[:, 0, mode]
    peak = strain[1:-1][(strain[1:-1] > strain[:-2]) & (strain[1:-1] > strain[2:])]
    case = f"{damping}, {('stretching', 'bending')[mode]}"
    exact = [np.exp(-2 * np.pi * ratio / np.sqrt(1 - ratio**2))] * 2
    verify(DAMPED, case, "dynamic", "peak over the one before", peak[1:3] / peak[:2], exact, 3e-3)
    end = path[-1].energy
    assert abs(end.energy_error) < 1e-3 * end.damping_work


@pytest.mark.parametrize(("share", "stable"), [(0.999, True), (1.001, False)])
def test_the_limit_of_the_time_step(verify: Verify, share: float, stable: bool) -> None:
    """Two bricks on the ground: a little above the limit the highest mode, which is one of strains, grows."""
    wall = Assembly(gravity=(0.0, 0.0), thickness=THICKNESS, joint=strong(1e9, 1e9), block=BRICK)
    for k in range(2):
        wall.add_block(rectangle(0.0, H * k, B, H * (k + 1)))
    wall.rest_on_ground([0])
    course = started(wall, 3.0, 1, new_contacts=False, time_step_safety=1.0)
    for mode in (0, 1):
        excited(course, mode, rate=1e-6)
    course.timing = course.timing._replace(steps=5000, step=share * 2.0 / course.frequency.intact)
    course.energy._step = course.timing.step
    try:
        course.advance()
        grown = np.abs(course.motion.strains.velocity).max() > 1e-2
    except DivergenceError:
        grown = True
    verify(STABLE, f"dt = {share} x 2/ω_max, 5000 steps", "dynamic", "bounded", not grown, stable)
