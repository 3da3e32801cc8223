"""Runs in physical time against closed forms: vibration, damping, stability."""

import numpy as np
import pytest

from damagepred import Assembly, Joint
from damagepred.assembly.assembly import rectangle
from damagepred.errors import DivergenceError
from tests.solvers.dynamic_scenes import DENSITY, STIFF, THICKNESS, G, dry, on_plate, run, stack, started
from tests.verification.manual import Verify, chapter

closed_form = chapter("Dynamics")

MODES = closed_form(
    title="Free vibration of a stack",
    formula="u_i(t) = (v/ω) sin(ω t) sin[i (2j - 1) π/(2n + 1)]\nω_j = 2 sqrt(K/m) sin[(2j - 1) π/(2 (2n + 1))]",
    source="Derived: chain of n equal masses on equal springs, fixed at one end.",
    note="Central differences shift the frequency to (2/dt) asin(ω dt/2), which is taken into account.",
)
HIGHEST = closed_form(
    title="Highest frequency, from which the time step follows",
    formula="ω_n = 2 sqrt(K/m) sin[(2n - 1) π/(2 (2n + 1))]",
    source="Derived: chain of n equal masses on equal springs, fixed at one end.",
)
DECAY = closed_form(
    title="Damped vibration",
    formula="viscous and Rayleigh: peaks fall by exp(-2π ξ/sqrt(1 - ξ²)), ξ = α/(2ω) + βω/2\n"
    "local: amplitude about the state of rest falls by (1 - a)/(1 + a) a cycle",
    source="Textbook; local damping: Cundall (1987), derived from constant decelerating force ratio.",
)
STATIC = closed_form(
    title="Coming to rest under dead load",
    formula="u_i = -W i (2n - i + 1)/(2 k_n A)",
    source="Derived: the joint below block i carries n - i + 1 blocks.",
    note="Started with unstressed joints, and damped until all is at rest: the contacts of large movement are as stiff "
    "as those of small.",
)
STABLE = closed_form(
    title="Stable time step in physical time", formula="dt <= 2/ω_max", source="Textbook: central differences."
)


def bonded(stiffness: float) -> Joint:
    """So soft in shear that the highest mode is one up and down."""
    return Joint(normal_stiffness=stiffness, shear_stiffness=0.1 * stiffness, tensile_strength=1e9, cohesion=1e9)


@pytest.mark.parametrize(("n", "mode", "stiffness"), [(1, 1, 82e9), (5, 1, 82e9), (5, 3, 5e9), (12, 2, 1e10)])
def test_a_stack_vibrates_in_its_modes(verify: Verify, n: int, mode: int, stiffness: float) -> None:
    assembly = Assembly(gravity=(0.0, 0.0), thickness=THICKNESS, joint=bonded(stiffness))
    shape = np.sin(np.arange(1, n + 1) * (2 * mode - 1) * np.pi / (2 * n + 1))
    for i in range(n):
        assembly.add_block(rectangle(0.0, i * 0.1, 0.24, (i + 1) * 0.1))
        assembly.set_velocity(i, y=1e-3 * shape[i])
    assembly.rest_on_ground([0])
    root = np.sqrt(stiffness / (DENSITY * 0.1))
    omega = 2 * root * np.sin((2 * mode - 1) * np.pi / (2 * (2 * n + 1)))
    ds = run(assembly, 3 * 2 * np.pi / omega, 60)
    dt = ds.attrs["time_step"]
    shifted = 2 / dt * np.arcsin(omega * dt / 2)
    time = ds["time"].values[:, None]
    exact = 1e-3 * dt / np.sin(shifted * dt) * np.sin(shifted * time) * shape
    case = f"{n} bricks, mode {mode}, k_n = {stiffness:g} Pa/m"
    verify(MODES, case, "dynamic", "displacement (m)", ds["block_displacement_y"].values, exact, 1e-8)
    error = np.abs(ds["energy_error"].values).max() / ds["kinetic_energy"].values[0]
    assert error < 1e-9
    highest = 2 * root * np.sin((2 * n - 1) * np.pi / (2 * (2 * n + 1)))
    case = f"{n} bricks, k_n = {stiffness:g} Pa/m"
    verify(HIGHEST, case, "dynamic", "ω (rad/s)", ds.attrs["highest_frequency"], highest, 1e-9)
    assert ds.attrs["highest_frequency_bound"] >= highest


@pytest.mark.parametrize(
    "damping",
    [
        {"damping": "viscous", "damping_ratio": 0.05},
        {"damping": "rayleigh", "damping_ratio": 0.05},
        {"damping": "rayleigh", "damping_ratio": 0.05, "stiff": True},
        {"damping": "local", "local_damping": 0.2},
    ],
)
def test_damping_takes_what_it_should(verify: Verify, damping: dict) -> None:
    """One block on its joint, released above its rest: peaks of the free vibration."""
    omega = np.sqrt(1e9 / (DENSITY * 0.1))
    settings = dict(damping)
    hertz = omega / (2 * np.pi)
    if damping["damping"] == "viscous":
        settings["frequency"], alpha, beta = hertz, 0.1 * omega, 0.0
    elif damping["damping"] == "rayleigh":
        low, high = (0.001, 1.0) if settings.pop("stiff", False) else (0.5, 2.0)
        settings |= {"frequency": low * hertz, "second_frequency": high * hertz}
        alpha, beta = 0.1 * omega * low * high / (low + high), 0.1 / (omega * (low + high))
    model = stack(1, 1e9).build(STIFF)
    course = started(
        model, 4 * 2 * np.pi / omega, 1000, start="unstressed", time_step_safety=0.05, new_contacts=False, **settings
    )
    sag, about = DENSITY * 0.1 * G / 1e9, np.ones(1001)
    for k in range(1, 1001):
        course.advance()
        about[k] = course.motion.displacement[0, 1] / sag + 1
    peak = about[1:-1][(about[1:-1] > about[:-2]) & (about[1:-1] > about[2:])]
    if damping["damping"] == "local":
        ratio, tolerance = 0.8 / 1.2, 2e-3
    else:
        xi = alpha / (2 * omega) + beta * omega / 2
        ratio, tolerance = np.exp(-2 * np.pi * xi / np.sqrt(1 - xi**2)), 2e-3
    case = ", ".join(f"{v}" for v in damping.values())
    verify(DECAY, case, "dynamic", "peak over the one before", peak[1:3] / peak[:2], [ratio] * 2, tolerance)
    balance = course.energy.balance()
    assert abs(balance.energy_error) < 1e-3 * balance.damping_work


@pytest.mark.parametrize(("n", "stiffness", "width"), [(3, 82e9, 0.24), (10, 5e9, 0.5)])
def test_a_stack_comes_to_rest(verify: Verify, n: int, stiffness: float, width: float) -> None:
    ds = run(stack(n, stiffness, width), 0.15, 5, start="unstressed", damping="local")
    w, i = DENSITY * width * 0.1 * THICKNESS * G, np.arange(1, n + 1)
    case = f"{n} blocks, {width} m wide, k_n = {stiffness:g} Pa/m"
    exact = -w * i * (2 * n - i + 1) / (2 * stiffness * width * THICKNESS)
    verify(STATIC, case, "dynamic", "settlement (m)", ds["block_displacement_y"].values[-1], exact, 1e-6)


@pytest.mark.parametrize(("share", "stable"), [(0.999, True), (1.001, False)])
def test_the_limit_of_the_time_step(verify: Verify, share: float, stable: bool) -> None:
    """The step that is computed is the limit itself: a little above it the highest mode grows without bound."""
    assembly = Assembly(gravity=(0.0, 0.0), thickness=THICKNESS, joint=bonded(1e9))
    for i in range(4):
        assembly.add_block(rectangle(0.0, i * 0.1, 0.24, (i + 1) * 0.1))
        assembly.set_velocity(i, y=1e-6 * (-1) ** i)
    assembly.rest_on_ground([0])
    course = started(assembly.build(STIFF), 3.0, new_contacts=False, time_step_safety=1.0)
    limit = 2.0 / course.frequency.intact
    course.timing = course.timing._replace(steps=3000, step=share * limit)
    start = course.energy.balance().kinetic_energy
    course.energy._step = course.timing.step
    try:
        course.advance()
        grown = np.abs(course.motion.velocity[:, 1]).max() > 1e-3
    except DivergenceError:
        grown = True
    assert start > 0
    verify(STABLE, f"dt = {share} x 2/ω_max, 3000 steps", "dynamic", "bounded", not grown, stable)


def test_a_run_that_diverges_says_so() -> None:
    course = started(on_plate(joint=dry(1e9)).build(STIFF), 1.0)
    course.timing = course.timing._replace(step=12.0 * course.timing.step)
    course.motion.velocity[1, 1] = -1.0
    with pytest.raises(DivergenceError, match=r"diverged at .* s .*block 1 .*time_step_safety"):
        course.advance()
