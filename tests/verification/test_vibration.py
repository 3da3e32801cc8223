"""Frequencies of stacks, and the effect of the explicit time step on them.

The explicit solver scales its masses to a time step of 1. Given the masses m / dt², its cycle is that of a dynamic run;
the cases say "explicit cycle" where that is done.
"""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import linalg

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.scene import BlockMaterial, Solver
from damagepred.solvers.explicit.scheme import DampedTimeStepping
from damagepred.solvers.system.discrete_system import DiscreteSystem
from tests.verification.blocks import BLOCK, BRICK, STONE, UNITS, G, Unit, on_plate, stack
from tests.verification.manual import Verify, chapter

closed_form = chapter("Vibration and time stepping")

CHAIN = closed_form(
    title="Frequencies of a stack of blocks",
    formula="ω_j = 2 √(K/m) sin[(2j - 1) π / (2 (2n + 1))],   K = k_n A,   j = 1 ... n",
    source="Chain of n equal masses and springs, fixed at one end and free at the other (e.g. Rayleigh, The Theory of "
    "Sound, §120).",
    note="Stiffness matrix: all its vertical frequencies. Explicit cycle: the time between zeros of the top block, all "
    "beginning in the mode; the time step shortens the period by (ω dt)²/24.",
)
LIMIT = closed_form(
    title="Largest stable time step",
    formula="ω_max dt = 2 / √(1 - α²),   α: local damping",
    source="Derived: the drag turns with the motion, within the step. A block that alternates every step is slowed "
    "by (1 + α) times the force, then sped up by (1 - α) times it. Masses are scaled for the smaller 2 / √(1 + α): "
    "blocks may also be slowed through the whole step.",
    note="Found by bisection: does the highest mode grow, begun as the motion that alternates?",
)
DECREMENT = closed_form(
    title="Local damping of one block on a spring",
    formula="|u_(i+1) / u_i| = √((1 - α)/(1 + α)) per half cycle; 1/3 for α = 0.8",
    source="Derived: the block falls back under (1 - α) and moves on against (1 + α) times the spring's force.",
    note="In the limit of short time steps; here ω dt = 0.005.",
)
DROP = closed_form(
    title="Block dropped on its joint",
    formula="u_max = (W/K) [1 + √(1 + 2 K H/W)];   rebounds to H",
    source="Derived: conservation of energy; the joint carries no tension.",
    note="Without damping, ω dt = 0.01 or so. Runs in physical time (`dynamic`): a block thrown up falls back on its "
    "joint; one dropped meets a plate that it did not touch before. Then the faces of both are sampled, each point for "
    "a cell of its face; where the plate is wider than the block its cells do not fit, and K is right to 15 %. The "
    "rebound is H all the same.",
)
WAVE = closed_form(
    title="Wave in a stack",
    formula="c = √(E_eff/ρ),   1/E_eff = 1/E + 1/(k_n h),   rigid blocks: E_eff = k_n h;\n"
    "a displacement released at rest splits into two halves",
    source="d'Alembert; stiffness of joint and block in series.",
    note="A bell of displacement, 10 blocks (one standard deviation) wide, released 140 blocks above the ground. Waves "
    "of wave number κ lag by (κ h)²/24, which is the error seen.",
)

SLIDE = closed_form(
    title="Block that slides down an incline",
    formula="s = a T²/2,   a = g (sin α - tan φ cos α)",
    source="Newton and Coulomb.",
    note="Released at rest where an intact joint would hold it, without damping; no edge lifts: tan α < b/(3 h).",
)


def vertical(model: Model) -> FloatArray:
    """Return the stiffness of the vertical displacements (N/m)."""
    return DiscreteSystem.of(model).elastic_stiffness[1:-3:3][:, 1:-3:3].toarray()


def glued(unit: Unit, count: int, **material: float) -> Model:
    joint = unit.joint(tensile_strength=1e12, cohesion=1e12)
    solver = Solver(method="explicit", blocks="rigid", lump_block_elasticity=bool(material))
    made_of = BlockMaterial(density=unit.density, **material) if material else None
    return stack(unit, count, joint, made_of).build(solver)


def physical(model: Model, dt: float, damping: float = 0.0) -> DampedTimeStepping:
    """Return the explicit solver with physical masses, at rest and without load."""
    run = DampedTimeStepping(model, Solver(method="explicit", damping=damping))
    mass = np.column_stack((model.mass, model.mass, model.density * model.thickness * model.blocks.polar))
    run.motion.inverse_mass[:-3] = dt**2 / mass.ravel()
    run.motion.load[:] = 0.0
    return run


def follow(run: DampedTimeStepping, cycles: int, share: float, look: Callable[[FloatArray], float]) -> FloatArray:
    """Return a sampled displacement after every cycle, at a share of the dead load."""
    seen = np.empty(cycles)
    for i in range(cycles):
        run._cycle(1, share, 0.0, 0.0)
        seen[i] = look(run.motion.displacement)
    return seen


@pytest.mark.parametrize(("unit", "n"), [(BRICK, 1), (BLOCK, 5), (STONE, 20), (BRICK, 100)])
def test_frequencies_of_a_stack(verify: Verify, unit: Unit, n: int) -> None:
    stiffness = vertical(glued(unit, n))
    case = f"n = {n}: {unit}"
    computed = np.sqrt(linalg.eigh(stiffness, unit.mass * np.eye(n), eigvals_only=True))
    verify(CHAIN, case, "stiffness matrix", "ω_1 ... ω_n (rad/s)", computed, chain(unit, n, np.arange(1, n + 1)), 1e-9)


def chain(unit: Unit, n: int, j: int | IntArray) -> FloatArray:
    """Return the frequencies of a stack (rad/s)."""
    return 2 * np.sqrt(unit.k_n * unit.area / unit.mass) * np.sin((2 * j - 1) * np.pi / (2 * (2 * n + 1)))


@pytest.mark.parametrize(("unit", "n", "j"), [(BRICK, 1, 1), (BLOCK, 5, 1), (BLOCK, 5, 5), (STONE, 20, 3)])
def test_a_stack_swings_at_its_frequency(verify: Verify, unit: Unit, n: int, j: int) -> None:
    dt = 0.1 / chain(unit, n, n)
    run = physical(glued(unit, n), dt)
    exact = float(chain(unit, n, j))
    mode = np.sin((2 * j - 1) * np.pi / (2 * n + 1) * np.arange(1, n + 1))
    run.motion.displacement[1:-3:3] = 1e-6 * mode
    top = follow(run, int(10 * 2 * np.pi / (exact * dt)), 0.0, lambda u: u[-5])
    before = np.flatnonzero(top[:-1] * top[1:] < 0)
    zeros = (before + top[before] / (top[before] - top[before + 1])) * dt
    case = f"n = {n}, j = {j}, 10 periods, ω_n dt = 0.1: {unit}"
    verify(CHAIN, case, "explicit cycle", "ω (rad/s)", np.pi * (len(zeros) - 1) / (zeros[-1] - zeros[0]), exact, 1e-3)


@pytest.mark.parametrize("damping", [0.0, 0.4, 0.8])
@pytest.mark.parametrize(("unit", "n"), [(BRICK, 1), (STONE, 5), (BLOCK, 40)])
def test_the_largest_stable_time_step(verify: Verify, unit: Unit, n: int, damping: float) -> None:
    model = glued(unit, n)
    mode = np.sin((2 * n - 1) * np.pi / (2 * n + 1) * np.arange(1, n + 1))

    def grows(omega_dt: float) -> bool:
        run = physical(model, omega_dt / float(chain(unit, n, n)), damping)
        run.motion.displacement[1:-3:3] = 1e-6 * mode
        run.motion.velocity[1:-3:3] = 2e-6 * mode
        for _ in range(50):
            run._cycle(100, 0.0, 0.0, 0.0)
            # without damping beats come first; a joint breaks much later
            if not np.abs(run.motion.displacement).max() < (5e-6 if damping else 1.0):
                return True
        return False

    stable, unstable = 1.0, 4.0
    assert not grows(stable)
    while unstable - stable > 1e-5:
        middle = (stable + unstable) / 2
        stable, unstable = (stable, middle) if grows(middle) else (middle, unstable)
    case = f"n = {n}, α = {damping:g}: {unit}"
    verify(LIMIT, case, "explicit cycle", "ω_max dt", stable, 2 / np.sqrt(1 - damping**2), 1e-4)


@pytest.mark.parametrize("damping", [0.1, 0.5, 0.8])
@pytest.mark.parametrize("unit", UNITS, ids=str)
def test_local_damping_of_one_block(verify: Verify, unit: Unit, damping: float) -> None:
    dt = 0.005 / float(chain(unit, 1, 1))
    run = physical(glued(unit, 1), dt, damping)
    run.motion.displacement[1] = 1e-3
    u = follow(run, int(8 * np.pi / 0.005), 0.0, lambda u: u[1])
    turns = u[1:-1][(np.abs(u[1:-1]) > np.abs(u[:-2])) & (np.abs(u[1:-1]) >= np.abs(u[2:]))]
    peaks = np.abs(np.concatenate(([1e-3], turns[:3])))
    case = f"α = {damping:g}, three half cycles: {unit}"
    exact = np.sqrt((1 - damping) / (1 + damping))
    verify(DECREMENT, case, "explicit cycle", "ratio of amplitudes", peaks[1:] / peaks[:-1], exact, 1e-3)


@pytest.mark.parametrize(("unit", "height"), [(BRICK, 0.0), (BLOCK, 1.0), (STONE, 30.0), (BRICK, 1000.0)])
def test_a_block_dropped_on_its_joint(verify: Verify, unit: Unit, height: float) -> None:
    sag = unit.weight / (unit.k_n * unit.area)
    model = stack(unit, 1).build(Solver(method="explicit", lump_block_elasticity=False))
    run = physical(model, 0.01 / float(chain(unit, 1, 1)))
    run.motion.load[1] = -unit.weight
    run.motion.displacement[1] = height * sag
    fall = np.sqrt(2 * height)  # times 1/ω
    u = follow(run, int((2 * fall + 2 * np.pi) / 0.01), 1.0, lambda u: u[1])
    deepest = int(u.argmin())
    exact = sag * (1 + np.sqrt(1 + 2 * height) + np.array([0.0, height]))
    case = f"K H/W = {height:g}: {unit}"
    computed = [-u[deepest], u[deepest:].max() - u[deepest]]
    verify(DROP, case, "explicit cycle", "u_max and u_max + rebound (m)", computed, exact, 1e-3, scale=exact)


@pytest.mark.parametrize(
    ("unit", "modulus"), [(BRICK, None), (BRICK, 9e9), (BLOCK, None), (BLOCK, 2e9), (STONE, 0.5e9)]
)
def test_a_wave_in_a_stack(verify: Verify, unit: Unit, modulus: float | None) -> None:
    n, width, start, travelled = 240, 10.0, 140, 70
    model = glued(unit, n, **({} if modulus is None else {"elastic_modulus": modulus}))
    modulus_of_all = 1 / (1 / (unit.k_n * unit.h) + (0.0 if modulus is None else 1 / modulus))
    exact = np.sqrt(modulus_of_all / unit.density)
    steps = 1000
    dt = travelled * unit.h / exact / steps
    run = physical(model, dt)
    place = np.arange(n)
    run.motion.displacement[1:-3:3] = 1e-3 * np.exp(-0.5 * ((place - start) / width) ** 2)
    # the velocities stand half a step before the displacements
    force = -vertical(model) @ run.motion.displacement[1:-3:3]
    run.motion.velocity[1:-3:3] = -0.5 * force * run.motion.inverse_mass[1:-3:3]
    run._cycle(steps, 0.0, 0.0, 0.0)
    u = run.motion.displacement[1:-3:3]
    lower = int(u[:start].argmax())
    left, middle, right = u[lower - 1 : lower + 2]
    crest = lower + 0.5 * (left - right) / (left - 2 * middle + right)
    case = f"n = {n}, " + ("rigid" if modulus is None else f"E {1e-6 * modulus:g} MPa") + f": {unit}"
    computed = (start - crest) * unit.h / (steps * dt)
    verify(WAVE, case, "explicit cycle", "speed of the lower crest (m/s)", computed, exact, 2e-3)
    verify(WAVE, case, "explicit cycle", "height of either crest (m)", [middle, u[start:].max()], 0.5e-3, 1e-2)


@pytest.mark.parametrize(("unit", "friction", "slope"), [(BRICK, 0.5, 0.6), (BLOCK, 0.3, 0.5), (STONE, 0.4, 0.6)])
def test_a_block_slides_down_an_incline(verify: Verify, unit: Unit, friction: float, slope: float) -> None:
    angle = np.arctan(slope)
    assembly, _ = on_plate(unit, unit.joint(friction=friction), (G * np.sin(angle), -G * np.cos(angle)))
    model = assembly.build(Solver(method="explicit", lump_block_elasticity=False))
    period = 2 * np.pi / float(chain(unit, 1, 1))
    dt, steps = period / 40, 40_000
    run = physical(model, dt)
    run.motion.load[:3] = model.supports.load[:3]
    rest = DiscreteSystem.of(model).elastic_displacement()
    run.motion.displacement[:] = rest
    run._cycle(steps, 1.0, 0.0, 0.0)
    case = f"tan α = {slope:g}, tan φ = {friction:g}, T = {steps * dt:.3g} s: {unit}"
    exact = G * (np.sin(angle) - friction * np.cos(angle)) * (steps * dt) ** 2 / 2
    verify(SLIDE, case, "explicit cycle", "distance (m)", run.motion.displacement[0] - rest[0], exact, 5e-3)
