"""Vibration of deformable blocks with lumped masses: frequencies, their order of convergence, and waves."""

import numpy as np
import pytest
from scipy import linalg, sparse
from scipy.sparse.linalg import eigsh

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Assembly, Model
from damagepred.assembly.assembly import rectangle
from damagepred.scene import BlockMaterial, Solver
from damagepred.solvers.explicit.scheme import DampedTimeStepping
from damagepred.solvers.system.discrete_system import DiscreteSystem
from tests.solvers.walls import gridpoint_mass
from tests.verification.manual import Verify, chapter
from tests.verification.zoned_blocks import BRICKWORK, CONCRETE, NAMES, RUBBER, order

pytestmark = pytest.mark.quick_cases()

closed_form = chapter("Vibration and time stepping")

BAR = closed_form(
    title="Frequencies of a bar of zones",
    formula="ω_j = (2j - 1) π c/(2 L),   c = √(E/ρ), plane strain √(E (1 - ν)/(ρ (1 + ν)(1 - 2ν)));   j = 1 ... 3",
    source="Fixed at one end, free at the other (e.g. Timoshenko, Vibration Problems). ν = 0, or plane strain with the "
    "sides held, so that the bar moves along itself only.",
    note="Stiffness of the zones, masses lumped at gridpoints. Order: slope of log(error) over log(zone size), all "
    "three frequencies together.",
)
LAME = closed_form(
    title="Lamé's mode of a free square",
    formula="ω = π √(2 G/ρ) n/a,   u = cos(n π x/a) sin(n π y/a), v = -sin(n π x/a) cos(n π y/a)",
    source="Lamé (1852): without change of volume or traction on any edge, hence the same for plane stress, plane "
    "strain and any ν.",
    note="Of all modes the one that is most like it: its frequency, and the cosine of the two shapes, by mass. A "
    "square has another mode of this symmetry a tenth above the first; cells are so small that the two are apart.",
)
PULSE = closed_form(
    title="Elastic wave in a bar of zones",
    formula="c = √(E/ρ);   a displacement released at rest splits into two halves; stress = ρ c × velocity",
    source="d'Alembert.",
    note="Explicit cycle with the gridpoints' masses, no damping. Bar of 160 cells, ν = 0; a bell of displacement 8 "
    "cells wide (one standard deviation). Waves of wave number κ in cells of size h lag by about (κ h)²/24. Stress is "
    "constant in a triangle, velocity taken as the mean of its corners: an error of the order of h over the width.",
)


def bar(material: BlockMaterial, length: float, height: float, size: float, plane: str, held: bool) -> Model:
    assembly = Assembly(thickness=0.1, gravity=(0.0, 0.0), block=material)
    block = assembly.add_block(rectangle(0.0, 0.0, length, height), zone_size=size)
    assembly.hold_points(block, lambda x, y: x < 1e-9, x=0.0)
    if held:
        assembly.hold_points(block, lambda x, y: (y < 1e-9) | (y > height - 1e-9), y=0.0)
    else:
        assembly.hold_points(block, lambda x, y: (x < 1e-9) & (y < 1e-9), y=0.0)
    return assembly.build(Solver(plane=plane))


def masses(model: Model) -> FloatArray:
    """Return the mass of each degree of freedom (kg), 0 where there is none."""
    mass = np.zeros(model.size)
    mass[model.mesh.dof_x] = mass[model.mesh.dof_y] = gridpoint_mass(model)
    return mass


def modes(model: Model, near: float | None = None) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return frequencies (rad/s), shapes and their degrees of freedom: all, or the twelve nearest to one."""
    mass = masses(model)
    free = np.setdiff1d(np.flatnonzero(mass), DiscreteSystem.of(model).constrained_dofs)
    root = sparse.diags_array(1.0 / np.sqrt(mass[free]))
    stiffness = root @ DiscreteSystem.of(model).elastic_stiffness[free][:, free] @ root
    stiffness = 0.5 * (stiffness + stiffness.T)
    if near is None:
        square, shape = linalg.eigh(stiffness.toarray())
    else:  # shifted a little: a stiffness that is singular has no inverse
        start = np.random.default_rng(1).standard_normal(len(free))
        square, shape = eigsh(stiffness.tocsc(), k=12, sigma=1.0001 * near**2, v0=start)
    return np.sqrt(np.maximum(square, 0.0)), shape, free


@pytest.mark.parametrize(("material", "plane"), [(BRICKWORK, "stress"), (RUBBER, "strain"), (CONCRETE, "strain")])
def test_frequencies_of_a_bar(verify: Verify, material: BlockMaterial, plane: str) -> None:
    held = plane == "strain"
    if not held:
        material = BlockMaterial(elastic_modulus=material.elastic_modulus, poisson_ratio=0.0, density=material.density)
    nu = material.poisson_ratio
    stiff = material.elastic_modulus * ((1 - nu) / ((1 + nu) * (1 - 2 * nu)) if held else 1.0)
    length, speed = 2.0, np.sqrt(stiff / material.density)
    exact = (2 * np.arange(1, 4) - 1) * np.pi * speed / (2 * length)
    sizes, off = (0.125, 0.0625, 0.03125), []
    name = f"2 x 0.125 m, plane {plane}: " + ("brickwork, ν = 0" if not held else f"{NAMES[material]}, sides held")
    for size in sizes:
        model = bar(material, length, 0.125, size, plane, held)
        frequency, shape, free = modes(model)
        along = np.square(shape[np.isin(free, model.mesh.dof_x)]).sum(axis=0) > 0.99
        # without change across the bar
        found = frequency[along][:3]
        off.append(float(np.abs(found / exact - 1).max()))
        case = f"{name}, {round(length / size)} cells"
        verify(BAR, case, "stiffness matrix", "ω_1 ... ω_3 (rad/s)", found, exact, 2 * (size / length) ** 2)
    verify(BAR, f"{name}, 16 to 64 cells", "stiffness matrix", "order", order(sizes, off), 2.0, 0.1)


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize(("material", "side", "n"), [(BRICKWORK, 1.0, 1), (RUBBER, 0.2, 2)])
def test_lames_mode_of_a_square(verify: Verify, material: BlockMaterial, side: float, n: int, plane: str) -> None:
    exact = n * np.pi * np.sqrt(2 * material.shear_modulus / material.density) / side
    off, cells = [], (16, 24, 32)
    name = f"n = {n}, a = {side:g} m, plane {plane}: {NAMES[material]}"
    for count in cells:
        assembly = Assembly(thickness=0.1, block=material)
        assembly.add_block(rectangle(0.0, 0.0, side, side), zone_size=side / count)
        model = assembly.build(Solver(plane=plane))
        mesh = model.mesh
        frequency, shape, free = modes(model, exact)
        wave = np.zeros(model.size)
        kx, ky = n * np.pi * mesh.x / side, n * np.pi * mesh.y / side
        wave[mesh.dof_x], wave[mesh.dof_y] = np.cos(kx) * np.sin(ky), -np.sin(kx) * np.cos(ky)
        wanted = (wave * np.sqrt(masses(model)))[free]
        likeness = np.abs(wanted @ shape) / np.linalg.norm(wanted)
        best = int(likeness.argmax())
        off.append(abs(frequency[best] / exact - 1))
        case = f"{name}, {count} x {count} cells"
        verify(LAME, case, "stiffness matrix", "ω (rad/s)", frequency[best], exact, 2 * (n / count) ** 2)
        verify(LAME, case, "stiffness matrix", "cosine to Lamé's shape", likeness[best], 1.0, 2 * (n / count) ** 2)
    computed = order([1 / c for c in cells], off)
    verify(LAME, f"{name}, {cells[0]} to {cells[-1]} cells", "stiffness matrix", "order", computed, 2.0, 0.15)


@pytest.mark.parametrize("material", [BRICKWORK, RUBBER], ids=["brickwork", "rubber"])
def test_a_wave_in_a_bar(verify: Verify, material: BlockMaterial) -> None:
    made_of = BlockMaterial(elastic_modulus=material.elastic_modulus, poisson_ratio=0.0, density=material.density)
    length, cells, width, start = 16.0, 160, 0.8, 8.0
    size = length / cells
    model = bar(made_of, length, 0.2, size, "stress", False)
    mesh = model.mesh
    speed = float(np.sqrt(material.elastic_modulus / material.density))
    mass, free = masses(model), np.setdiff1d(np.flatnonzero(masses(model)), DiscreteSystem.of(model).constrained_dofs)
    stiffness = DiscreteSystem.of(model).elastic_stiffness
    highest = float((abs(stiffness)[free].sum(axis=1).ravel() / mass[free]).max()) ** 0.5
    travelled = 4.0
    steps = int(np.ceil(travelled / speed / (1.0 / highest)))
    dt = travelled / speed / steps
    run = DampedTimeStepping(model, Solver(method="explicit", damping=0.0))
    run.motion.inverse_mass[free] = dt**2 / mass[free]
    u = run.motion.displacement
    u[mesh.dof_x] = 1e-4 * np.exp(-0.5 * ((mesh.x - start) / width) ** 2)
    run.motion.velocity[free] = 0.5 * (stiffness @ u)[free] * run.motion.inverse_mass[free]
    run._cycle(steps, 0.0, 0.0, 0.0)
    axis = np.flatnonzero(mesh.y < 1e-9)
    axis = axis[np.argsort(mesh.x[axis])]
    x, moved = mesh.x[axis], u[mesh.dof_x[axis]]
    crests = []
    for part in (x < start, x >= start):
        at = np.flatnonzero(part)[moved[part].argmax()]
        before, here, after = moved[at - 1 : at + 2]
        shift = 0.5 * (before - after) / (before - 2 * here + after)
        crests.append((x[at] + shift * (x[1] - x[0]), here - 0.25 * (before - after) * shift))
    case = f"16 x 0.2 m, {len(mesh.zones)} zones: {NAMES[material]}, ν = 0"
    computed = [(start - crests[0][0]) / (steps * dt), (crests[1][0] - start) / (steps * dt)]
    verify(PULSE, case, "explicit cycle", "speed of both crests (m/s)", computed, speed, 2e-3)
    verify(PULSE, case, "explicit cycle", "height of both crests (m)", [crests[0][1], crests[1][1]], 0.5e-4, 5e-3)
    # the crest that runs to the right: s_xx = -rho c v
    stress = run.zones.stresses(u)[:, 0]
    middle = mesh.x[mesh.zones].mean(axis=1)
    velocity = run.motion.velocity[mesh.dof_x][mesh.zones].mean(axis=1) / dt
    right = middle > start + 2 * width
    exact = -material.density * speed * velocity[right]
    verify(PULSE, case, "explicit cycle", "stress of the wave to the right (Pa)", stress[right], exact, 6e-2)
