"""Deformable blocks in physical time against closed forms: they fly, spin, ring, strike, rock and yield."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import optimize, sparse
from scipy.sparse.linalg import eigsh

from damagepred import Assembly
from damagepred.assembly import Model
from damagepred.assembly.assembly import rectangle
from damagepred.scene import BaseMotion, BlockMaterial
from damagepred.solvers.dynamics.run import DynamicRun
from damagepred.solvers.state.increment import Increment
from damagepred.solvers.system.deformable_blocks import gridpoint_mass
from damagepred.solvers.system.discrete_system import DiscreteSystem
from tests.solvers.dynamic_scenes import STIFF, THICKNESS, G, dry, grid_momentum, started, turned
from tests.verification.manual import ClosedForm, Verify
from tests.verification.test_dynamics_rigid import upright_after

CHAPTER = "Dynamics"
DENSITY, LENGTH = 2000.0, 2.0
BAR = BlockMaterial(elastic_modulus=9e9, poisson_ratio=0.0, density=DENSITY)
SPEED = np.sqrt(9e9 / DENSITY)
HURLED = 1.0
"""Speed at which bars meet something (m/s)."""

SPIN = ClosedForm(
    chapter=CHAPTER,
    title="Bar of zones that flies and spins",
    formula="σ = ρ ω² (L/2)² / 2 in the middle",
    source="Centrifugal force of one half of the bar.",
    note="Mean over many vibrations, which start as the bar is unstressed at first. A theory of small rotations would "
    "stress it by E (1 - cos θ).",
)
KEPT = ClosedForm(
    chapter=CHAPTER,
    title="What a flying deformable block keeps",
    formula="momentum, angular momentum, energy",
    source="Newton's laws.",
)
WAVE = ClosedForm(
    chapter=CHAPTER,
    title="Bar of zones whose end is stopped",
    formula="front: c = sqrt(E/ρ); behind it σ = ρ c v; off a free end σ = 0, off a fixed end the same sign again",
    source="d'Alembert; impulse and momentum of what the front has passed.",
    note="Plane stress, ν = 0. Means over tenths of the bar away from the front; behind it zones ring a little, as "
    "short waves lag: so does the middle of the front, by cells to the power 2/3.",
)
STRIKE = ClosedForm(
    chapter=CHAPTER,
    title="Bar of zones that strikes a wall",
    formula="contact lasts 2 L/c and presses with ρ c v; the bar leaves with the speed v",
    source="Saint-Venant: the wave comes back from the free end and takes the pressure off.",
    note="The joint's own compliance rounds the fronts.",
)
CANTILEVER = ClosedForm(
    chapter=CHAPTER,
    title="Cantilever of zones that swings",
    formula="ω1 of K - ω² M of its zones; beam: ω1 = 1.8751² sqrt(E I/(ρ A L⁴)), less by shear",
    source="Rayleigh; Timoshenko.",
    note="Released from rest under its weight; frequency of its tip by least squares.",
)
RINGING = ClosedForm(
    chapter=CHAPTER,
    title="Damped bar of zones",
    formula="amplitude exp(-ξ ω t), ξ = (a/ω + b ω)/2",
    source="Rayleigh damping a M + b K.",
    note="First mode of a bar with one end held.",
)
ROCK = ClosedForm(
    chapter=CHAPTER,
    title="Rocking deformable block: quarter period",
    formula="T = ∫ dφ / sqrt(2 p² (cos φ0 - cos φ)), p² = m g R/I, as of the rigid block",
    source="Energy of a rigid block that turns about its corner.",
    note="E = 50 GPa. The masses of zones stand at their gridpoints, so I is a little more than that of the block: "
    "quarter periods are given with both.",
)
AUDIT = ClosedForm(
    chapter=CHAPTER,
    title="Energy of deformable blocks that strike, ring and yield",
    formula="error < 1e-3 of the energy exchanged",
    source="Energy audit: what does not balance, over the sum of all changes of kinetic energy and the work of yield.",
)


def bar(size: float, height: float = 0.02, material: BlockMaterial = BAR, length: float = LENGTH) -> Assembly:
    assembly = Assembly(gravity=(0.0, 0.0), thickness=THICKNESS)
    assembly.add_block(rectangle(0.0, 0.0, length, height), material, zone_size=size)
    return assembly


def sections(model: Model, increment: Increment, count: int = 10) -> np.ndarray:
    """Return mean s_xx of parts of a bar (Pa)."""
    assert model.mesh is not None
    assert increment.zones is not None
    x = model.mesh.x[model.mesh.zones].mean(axis=1)
    part = np.minimum((x / LENGTH * count).astype(int), count - 1)
    return np.bincount(part, increment.zones.stress[:, 0]) / np.bincount(part)


def exchanged(increments: list[Increment]) -> float:
    kinetic = np.array([i.energy.kinetic_energy for i in increments])
    return float(np.abs(np.diff(kinetic)).sum()) + increments[-1].energy.plastic_work


def test_a_block_that_flies_and_spins_keeps_what_it_has(verify: Verify) -> None:
    spin = 60.0
    block = bar(0.08, 0.075, BlockMaterial(elastic_modulus=9e9, poisson_ratio=0.19, density=DENSITY), 0.24)
    block.set_velocity(0, x=1.0, y=0.5, rotation=spin)
    course = started(block.build(STIFF), 1.0, 20, start="unstressed")
    first = grid_momentum(course)
    path = list(course)
    case = f"brick, {spin / (2 * np.pi):.1f} turns, {course.steps} steps"
    assert course.steps > 1e5
    verify(
        KEPT,
        case=case,
        solver="dynamic",
        quantity="momentum",
        unit="kg m/s, kg m²/s",
        computed=grid_momentum(course),
        exact=first,
        tolerance=1e-11,
    )
    # what is exchanged between motion and vibration is small beside the energy of motion
    held = max(i.energy.elastic_energy for i in path)
    error = max(abs(i.energy.energy_error) for i in path)
    assert error < 0.02 * held
    verify(
        KEPT,
        case=case,
        solver="dynamic",
        quantity="energy",
        unit="J",
        computed=path[-1].energy.kinetic_energy + path[-1].energy.elastic_energy,
        exact=path[0].energy.kinetic_energy,
        tolerance=1e-6,
    )
    verify(
        KEPT,
        case=case,
        solver="dynamic",
        quantity="mean motion",
        unit="m, rad",
        computed=path[-1].displacement[0],
        exact=np.array([1.0, 0.5, spin]),
        tolerance=2e-5,
    )


@pytest.mark.parametrize("spin", [20.0, -100.0])
def test_a_spinning_bar_is_stretched_by_its_own_mass_alone(verify: Verify, spin: float) -> None:
    block = bar(0.04, 0.04, length=0.48)
    block.set_velocity(0, rotation=spin)
    model = block.build(STIFF)
    path = list(started(model, 0.4, 400, start="unstressed"))
    assert model.mesh is not None
    middle = np.abs(model.mesh.x[model.mesh.zones].mean(axis=1) - 0.24) < 0.04
    stress = np.mean([i.zones.stress[middle, :2].sum(axis=1).mean() for i in path if i.zones is not None])
    verify(
        SPIN,
        case=f"0.48 m, ω = {spin:g} rad/s, {abs(spin) * 0.4 / (2 * np.pi):.1f} turns",
        solver="dynamic",
        quantity="σ",
        unit="Pa",
        computed=stress,
        exact=DENSITY * spin**2 * 0.24**2 / 2,
        tolerance=0.05,
    )


def both_ends(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return (x < 1e-9) | (x > LENGTH - 1e-9)


def left_end(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return x < 1e-9


def hurled(
    where: Callable[[np.ndarray, np.ndarray], np.ndarray], share: float, outputs: int = 40, size: float = 0.02
) -> DynamicRun:
    """Return a bar that flies to the left with ends that are stopped, for a share of L/c."""
    block = bar(size, size)
    block.hold_points(0, where, x=0.0)
    block.set_velocity(0, x=-HURLED)
    return started(block.build(STIFF), share * LENGTH / SPEED, outputs, start="unstressed", new_contacts=False)


def test_a_wave_runs_through_a_bar(verify: Verify) -> None:
    level = 0.5 * DENSITY * SPEED * HURLED
    errors = []
    for size, tolerance in ((0.05, 0.02), (0.02, 8e-3), (0.01, 5e-3)):
        course = hurled(left_end, 0.9, 360, size)
        history = np.array([sections(course.model, i, 20) for i in course])
        time = np.linspace(0.0, 0.9 * LENGTH / SPEED, 361)
        arrival = [np.interp(level, -np.minimum.accumulate(history[:, k]), time) for k in (2, 16)]
        found = 14 * LENGTH / 20 / (arrival[1] - arrival[0])
        errors.append(abs(found / SPEED - 1))
        verify(
            WAVE,
            case=f"2 m in cells of {1e3 * size:g} mm",
            solver="dynamic",
            quantity="c",
            unit="m/s",
            computed=found,
            exact=SPEED,
            tolerance=tolerance,
        )
    assert errors[1] < 0.7 * errors[0]
    assert errors[2] < 0.7 * errors[1]
    verify(
        WAVE,
        case="2 m in cells of 10 mm, t = 0.9 L/c",
        solver="dynamic",
        quantity="σ behind the front",
        unit="Pa",
        computed=history[-1, :16],
        exact=np.full(16, -2 * level),
        tolerance=8e-3,
    )


def test_waves_come_back_from_a_free_and_from_a_fixed_end(verify: Verify) -> None:
    stress = DENSITY * SPEED * HURLED
    course = hurled(left_end, 1.5, 3)
    free = sections(course.model, list(course)[-1])
    verify(
        WAVE,
        case="off the free end, t = 1.5 L/c, right and left of the front",
        solver="dynamic",
        quantity="σ",
        unit="Pa",
        computed=free[[8, 7, 6, 3, 2, 1]],
        exact=stress * np.array([0, 0, 0, -1, -1, -1]),
        tolerance=0.02,
    )
    course = hurled(both_ends, 1.25, 5)
    path = list(course)
    verify(
        WAVE,
        case="both ends stopped, t = L/4 c",
        solver="dynamic",
        quantity="σ at the ends",
        unit="Pa",
        computed=sections(course.model, path[1])[[0, 1, 8, 9]],
        exact=stress * np.array([-1, -1, 1, 1]),
        tolerance=0.01,
    )
    verify(
        WAVE,
        case="both ends stopped, t = 5 L/4 c",
        solver="dynamic",
        quantity="σ at the ends",
        unit="Pa",
        computed=sections(course.model, path[-1])[[0, 1, 8, 9]],
        exact=stress * np.array([1, 1, -1, -1]),
        tolerance=0.03,
    )


def test_an_end_that_is_moved_sends_a_wave_and_does_the_work(verify: Verify) -> None:
    block = bar(0.02)
    block.hold_points(0, left_end, x=0.0)
    push = BaseMotion(quantity="velocity", time=(0.0, 1.0), values=(HURLED, HURLED))
    ending = 0.8 * LENGTH / SPEED
    course = started(
        block.build(STIFF), ending, 4, start="unstressed", new_contacts=False, base=(push,), time_step_safety=0.3
    )
    last = list(course)[-1]
    stress = DENSITY * SPEED * HURLED
    verify(
        WAVE,
        case="velocity step of the end, t = 0.8 L/c",
        solver="dynamic",
        quantity="σ behind the front",
        unit="Pa",
        computed=sections(course.model, last)[:7],
        exact=np.full(7, -stress),
        tolerance=0.015,
    )
    verify(
        WAVE,
        case="velocity step of the end, t = 0.8 L/c",
        solver="dynamic",
        quantity="work at the end, σ A v t",
        unit="J",
        computed=last.energy.boundary_work,
        exact=stress * 0.02 * THICKNESS * HURLED * ending,
        tolerance=0.02,
    )
    assert abs(last.energy.energy_error) < 1e-6 * last.energy.boundary_work


def test_a_bar_that_strikes_a_wall_leaves_when_the_wave_is_back(verify: Verify) -> None:
    height = 0.01
    block = Assembly(gravity=(0.0, 0.0), thickness=THICKNESS, joint=dry(1e13, 0.0))
    block.add_block(rectangle(-0.1, -0.1, 0.0, 0.12))
    block.support(0)
    block.add_block(rectangle(0.001, 0.0, LENGTH + 0.001, height), BAR, zone_size=height)
    block.set_velocity(1, x=-HURLED)
    # the facet rings against the wall: fewer outputs would be a sample of its force, not its mean
    course = started(block.build(STIFF), 0.001 + 2.2 * LENGTH / SPEED, 2700, start="unstressed")
    path = list(course)
    time = np.array([i.time for i in path])
    force = np.array([0.0 if i.support_force is None else -i.support_force[0, 0] for i in path])
    push = float(np.abs(force).sum() * (time[1] - time[0]))
    pressed = DENSITY * SPEED * HURLED * height * THICKNESS
    early = (time > 0.001 + 0.3 * LENGTH / SPEED) & (time < 0.001 + 1.7 * LENGTH / SPEED)
    case = "2 m, v = 1 m/s, k_n = 1e13 Pa/m"
    verify(
        STRIKE,
        case=case,
        solver="dynamic",
        quantity="force on the wall",
        unit="N",
        computed=np.abs(force[early]).mean(),
        exact=pressed,
        tolerance=0.01,
    )
    verify(
        STRIKE,
        case=case,
        solver="dynamic",
        quantity="impulse",
        unit="N s",
        computed=push,
        exact=2 * DENSITY * LENGTH * height * THICKNESS * HURLED,
        tolerance=0.01,
    )
    verify(
        STRIKE,
        case=case,
        solver="dynamic",
        quantity="duration, impulse over force",
        unit="s",
        computed=push / np.abs(force[early]).mean(),
        exact=2 * LENGTH / SPEED,
        tolerance=0.01,
    )
    speed = (path[-1].displacement[1, 0] - path[-46].displacement[1, 0]) / (time[-1] - time[-46])
    verify(
        STRIKE,
        case=case,
        solver="dynamic",
        quantity="speed it leaves with",
        unit="m/s",
        computed=speed,
        exact=HURLED,
        tolerance=0.01,
    )
    assert abs(path[-1].energy.energy_error) < 1e-3 * exchanged(path)


def test_a_cantilever_swings_at_its_frequency(verify: Verify) -> None:
    modulus, height = 1e9, 0.2
    found = []
    for size in (0.2, 0.1, 0.05):
        beam = Assembly(gravity=(0.0, -G), thickness=THICKNESS)
        material = BlockMaterial(elastic_modulus=modulus, poisson_ratio=0.0, density=DENSITY)
        beam.add_block(rectangle(0.0, 0.0, LENGTH, height), material, zone_size=size)
        beam.hold_points(0, left_end, x=0.0, y=0.0)
        model = beam.build(STIFF)
        mesh = model.mesh
        assert mesh is not None
        tip = int(np.argmin((mesh.x - LENGTH) ** 2 + mesh.y**2))
        path = list(started(model, 0.35, 140, start="unstressed", new_contacts=False))
        time = np.array([i.time for i in path])
        sag = np.array([i.zones.displacement[tip, 1] for i in path if i.zones is not None])
        free = DiscreteSystem.of(model).free_dofs
        mass = np.zeros(model.size)
        mass[mesh.dof_x] = mass[mesh.dof_y] = gridpoint_mass(model)
        root = sparse.diags_array(mass[free] ** -0.5)
        matrix = (root @ DiscreteSystem.of(model).elastic_stiffness[free][:, free] @ root).tocsc()
        exact = float(np.sqrt(eigsh(matrix, k=1, sigma=0, return_eigenvectors=False)[0]))
        fit, _ = optimize.curve_fit(
            lambda t, a, omega: a * (np.cos(omega * t) - 1.0), time, sag, p0=(np.ptp(sag) / 2, exact)
        )
        found.append(fit[1])
        verify(
            CANTILEVER,
            case=f"2 m x 0.2 m, cells of {size} m",
            solver="dynamic",
            quantity="ω1 of its zones",
            unit="1/s",
            computed=fit[1],
            exact=exact,
            tolerance=5e-4,
        )
        assert max(abs(i.energy.energy_error) for i in path) < 1e-5 * path[-1].energy.kinetic_energy + 1e-5
    # two refinements: what is left goes down by 4 each time
    limit = found[2] - (found[1] - found[2]) / 3
    slender = 1.875104**2 * np.sqrt(modulus * height**2 / 12 / (DENSITY * LENGTH**4))
    verify(
        CANTILEVER,
        case="2 m x 0.2 m, extrapolated to small cells",
        solver="dynamic",
        quantity="ω1 of a beam",
        unit="1/s",
        computed=limit,
        exact=slender,
        tolerance=0.02,
    )


@pytest.mark.parametrize(("damping", "ratio"), [("viscous", 0.03), ("rayleigh", 0.03)])
def test_a_damped_bar_rings_down(verify: Verify, damping: str, ratio: float) -> None:
    omega = np.pi * SPEED / (2 * LENGTH)
    hertz = omega / (2 * np.pi)
    block = bar(0.1, 0.1)
    block.hold_points(0, left_end, x=0.0)
    block.set_velocity(0, x=0.1)  # what there is at first, for the audit; its shape follows
    course = started(
        block.build(STIFF),
        4 / hertz,
        400,
        start="unstressed",
        new_contacts=False,
        damping=damping,
        damping_ratio=ratio,
        frequency=hertz,
        second_frequency=4 * hertz,
    )
    grid = course.grid
    assert grid is not None
    shape = np.sin(np.pi * (grid.reference[:, 0] + course.origin[0]) / (2 * LENGTH))
    grid.velocity[:, 0] = 0.1 * shape
    path = list(course)
    time = np.array([i.time for i in path])
    end = np.array([np.ptp(i.zones.displacement[:, 0]) for i in path if i.zones is not None])
    early, late = time < 1.0 / hertz, time > 3.0 / hertz
    rate = np.log(end[early].max() / end[late].max()) / (
        time[late][end[late].argmax()] - time[early][end[early].argmax()]
    )
    verify(
        RINGING,
        case=f"{damping}, ξ = {ratio}",
        solver="dynamic",
        quantity="ξ",
        unit="1",
        computed=rate / omega,
        exact=ratio,
        tolerance=0.02,
    )
    first = 0.5 * DENSITY * LENGTH * 0.1 * THICKNESS * 0.5 * 0.1**2
    assert path[-1].energy.damping_work == pytest.approx(first, rel=0.3)


@pytest.mark.parametrize(("slenderness", "share"), [(0.3, 0.5), (0.2, 0.2)])
def test_a_rocking_deformable_block_is_upright_when_the_rigid_one_is(
    verify: Verify, slenderness: float, share: float
) -> None:
    alpha = np.arctan(slenderness)
    b, h, tilt = np.sin(alpha), np.cos(alpha), share * alpha
    exact, _ = upright_after(alpha, 0.5, share)
    assembly = Assembly(thickness=THICKNESS, joint=dry(1e11, 5.0))
    assembly.add_block(rectangle(-2.0, -0.2, 2.0, 0.0))
    assembly.support(0)
    stiff = BlockMaterial(elastic_modulus=50e9, poisson_ratio=0.2, density=DENSITY)
    assembly.add_block(turned(rectangle(-b, 0.0, 0.0, h), -tilt), stiff, zone_size=0.1)
    model = assembly.build(STIFF)
    mesh = model.mesh
    assert mesh is not None
    mass = gridpoint_mass(model)
    lumped = (mass * (mesh.x**2 + mesh.y**2)).sum() / (mass.sum() * (b**2 + h**2) / 3)
    path = list(started(model, 1.1 * exact, 150, start="unstressed"))
    angle = tilt - np.array([i.displacement[1, 2] for i in path])
    time = np.array([i.time for i in path])
    after = int(np.flatnonzero(angle < 0)[0])
    found = np.interp(0.0, -angle[after - 1 : after + 1], time[after - 1 : after + 1])
    case = f"b/h = {slenderness}, θ0 = {share} α"
    verify(
        ROCK,
        case=case + ", I of its gridpoints",
        solver="dynamic",
        quantity="quarter period",
        unit="s",
        computed=found,
        exact=exact * np.sqrt(lumped),
        tolerance=1e-3,
    )
    verify(
        ROCK,
        case=case + ", I of the block",
        solver="dynamic",
        quantity="quarter period",
        unit="s",
        computed=found,
        exact=exact,
        tolerance=4e-3,
    )


def dropped(material: BlockMaterial, height: float, tilt: float, duration: float, size: float = 0.08) -> DynamicRun:
    assembly = Assembly(thickness=THICKNESS, joint=dry(1e10, 0.3))
    assembly.add_block(rectangle(-2.0, -0.2, 2.0, 0.0))
    assembly.support(0)
    brick = turned(rectangle(-0.12, 0.0, 0.12, 0.16), tilt)
    assembly.add_block(brick - [0.0, brick[:, 1].min() - height], material, zone_size=size)
    return started(assembly.build(STIFF), duration, 400, start="unstressed")


@pytest.mark.parametrize("tilt", [0.0, 0.4])
def test_a_bouncing_block_exchanges_energy_with_its_vibration(verify: Verify, tilt: float) -> None:
    soft = BlockMaterial(elastic_modulus=1e9, poisson_ratio=0.2, density=DENSITY)
    course = dropped(soft, 0.05, tilt, 1.5)
    path = list(course)
    fallen = DENSITY * 0.24 * 0.16 * THICKNESS * G * 0.05
    assert course.steps > 1e5 / 2
    assert max(i.energy.elastic_energy for i in path[-50:]) > 0.01 * fallen, "it rings"
    verify(
        AUDIT,
        case=f"brick of E = 1 GPa that bounces, tilted by {tilt:g} rad, {course.steps} steps",
        solver="dynamic",
        quantity="energy out of balance over what was exchanged",
        unit="1",
        computed=max(abs(i.energy.energy_error) for i in path) / exchanged(path),
        exact=0.0,
        scale=1.0,
        tolerance=1e-3,
    )


def test_a_weak_block_that_is_dropped_yields(verify: Verify) -> None:
    weak = BlockMaterial(
        elastic_modulus=1e9, poisson_ratio=0.2, density=DENSITY, cohesion=0.3e6, friction=0.6, tensile_strength=0.1e6
    )
    course = dropped(weak, 0.3, 0.2, 0.5)
    path = list(course)
    fallen = DENSITY * 0.24 * 0.16 * THICKNESS * G * 0.3
    work = np.array([i.energy.plastic_work for i in path])
    assert (np.diff(work) >= 0).all()
    assert work[-1] > 0.3 * fallen
    assert path[-1].zones is not None
    assert (path[-1].zones.state == 4).sum() > 10
    verify(
        AUDIT,
        case=f"weak brick that falls 0.3 m on its corner, {course.steps} steps",
        solver="dynamic",
        quantity="energy out of balance over what was exchanged",
        unit="1",
        computed=max(abs(i.energy.energy_error) for i in path) / exchanged(path),
        exact=0.0,
        scale=1.0,
        tolerance=2e-3,
    )
