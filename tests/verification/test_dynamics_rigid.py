"""Runs in physical time against closed forms: blocks that rock, bounce, slide and fly."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from scipy import integrate, optimize

import damagepred
from damagepred import Assembly, BaseMotion, Dynamics
from damagepred.assembly.assembly import rectangle
from tests.solvers.dynamic_scenes import DENSITY, STIFF, THICKNESS, G, dry, momentum, on_plate, pair, run, started
from tests.verification.dry_walls import tipping_slope
from tests.verification.manual import Verify, chapter

pytestmark = pytest.mark.quick_cases()

closed_form = chapter("Dynamics")

HOUSNER = closed_form(
    title="Rocking block: quarter period",
    formula="exact: T = ∫ dφ / sqrt(2 p² (cos φ0 - cos φ)), φ from φ0 = α - θ0 to α\n"
    "slender: T = (1/p) acosh[1/(1 - θ0/α)], p² = 3 g/(4 R)",
    source="Energy of a rigid block that turns about its corner; slender: Housner (1963).",
    note="Released at rest at θ0, until it is upright. Housner's form takes angles for sines.",
)
IMPACT = closed_form(
    title="Rocking block: angular velocity kept at an impact",
    formula="r = 1 - (3/2) sin² α,   tan α = b/h",
    source="Angular momentum about the new corner (Housner 1963).",
    note="Inelastic contacts at the two corners: contacts_per_interface = 2 and dynamics.contact_damping. r² is the "
    "share of energy kept, from successive largest tilts. Points along the base would take part of the impulse.",
)
BOUNCE = closed_form(
    title="Bouncing block",
    formula="u_max = (W/K) [1 + sqrt(1 + 2 K H/W)]; rebounds to H",
    source="Energy of a mass on a spring that cannot pull.",
    note="The block starts from its joint with speed sqrt(2 g H), and falls on it again and again.",
)
SLIDE = closed_form(
    title="Sliding block under a pulse",
    formula="sticks elastically until k_s u = μ N, slides until velocities are equal",
    source="Newmark (1965); the elastic stick before: mass on a spring whose base moves.",
    note="Pulse of the base; the block cannot turn. Its final place relative to the base, within the elastic u.",
)
INCLINE = closed_form(
    title="Block on an incline",
    formula="slides if tan α > μ, with a = g (sin α - μ cos α); topples if tan α > b/h",
    source="Statics; rigid body on a plane.",
)
TIPS = closed_form(
    title="Slender block that tips on an elastic joint",
    formula="tan α = b/h - 3 (2 N/(9 k h²))^(1/3)",
    source="Equilibrium in the displaced position; the joint is pressed over c = sqrt[2 N/(k θ)].",
    note="N weight, k normal stiffness of the joint, for the whole thickness; 16 parts in the joint. The static "
    "solvers take lever arms from positions without displacement, so their limit is b/h.",
)
SPIN = closed_form(
    title="Two bonded bricks that turn as one",
    formula="σ = ρ h ω² h/2",
    source="Centrifugal force of a brick of height h whose end lies on the axis.",
    note="Mean over a vibration, which starts as the joint is unstressed at first. A theory of small rotations would "
    "stress the joint by k_n h (1 - cos θ), up to 12 GPa, at any speed.",
)
KEPT = closed_form(
    title="What a flying pair keeps", formula="momentum, angular momentum, energy", source="Newton's laws."
)
AUDIT = closed_form(
    title="Energy over 100 000 steps without damping",
    formula="error < 1e-3 of the energy exchanged",
    source="Energy audit: what does not balance, over the sum of all changes of kinetic energy.",
)


def upright_after(alpha: float, radius: float, share: float) -> tuple[float, float]:
    """Return the quarter period: exact, and by Housner's formula."""
    p = np.sqrt(3 * G / (4 * radius))
    first = alpha * (1 - share)
    # with φ = φ0 + s² the integrand is smooth
    exact, _ = integrate.quad(
        lambda s: 2 * s / np.sqrt(2 * (np.cos(first) - np.cos(first + s * s))), 1e-9, np.sqrt(alpha - first)
    )
    return exact / p, np.arccosh(1 / (1 - share)) / p


@pytest.mark.parametrize(
    ("slenderness", "share"), [(0.1, 0.2), (0.1, 0.8), (0.2, 0.5), (0.3, 0.2), (0.3, 0.8), (0.5, 0.5)]
)
def test_a_rocking_block_is_upright_when_housner_says(verify: Verify, slenderness: float, share: float) -> None:
    alpha, radius = np.arctan(slenderness), 0.5
    b, h = 2 * radius * np.sin(alpha), 2 * radius * np.cos(alpha)
    tilt = share * alpha
    exact, slender = upright_after(alpha, radius, share)
    errors = []
    for stiffness in (1e9, 1e10, 1e11):
        block = on_plate(b, h, dry(stiffness, friction=5.0), tilt=tilt)
        ds = run(block, 1.1 * exact, 200, start="unstressed", time_step_safety=0.3)
        angle = tilt - ds["block_rotation"].values[:, 1]
        after = int(np.flatnonzero(angle < 0)[0])
        found = np.interp(0.0, -angle[after - 1 : after + 1], ds["time"].values[after - 1 : after + 1])
        errors.append(abs(found / exact - 1))
    case = f"b/h = {slenderness}, θ0 = {share} α, k_n = 1e11 Pa/m"
    verify(HOUSNER, case, "dynamic", "quarter period, exact form (s)", found, exact, 3e-4)
    case = f"b/h = {slenderness}, θ0 = {share} α, k_n = 1e11 Pa/m"
    verify(HOUSNER, case, "dynamic", "quarter period, slender block (s)", found, slender, 0.15 * alpha**2)
    assert errors[2] < 0.5 * errors[0] or errors[0] < 1e-5, "it converges as the contact gets stiffer"


def rocking(slenderness: float, radius: float, stiffness: float, contacts: int, **settings: object) -> xr.Dataset:
    """Let a block rock to 0.4 of its angle from upright, from the middle of its base."""
    alpha, first = np.arctan(slenderness), 0.4
    b, h = radius * np.sin(alpha), radius * np.cos(alpha)
    assembly = Assembly(thickness=THICKNESS, joint=dry(stiffness, friction=5.0))
    assembly.add_block(rectangle(-8 * b, -0.4 * radius, 8 * b, 0.0))
    assembly.add_block(rectangle(-b, 0.0, b, 2 * h))
    assembly.support(0)
    spin = np.sqrt(1.5 * G / radius * (np.cos(alpha * (1 - first)) - np.cos(alpha)))
    assembly.set_velocity(1, x=-spin * h, y=spin * b, rotation=spin)
    duration = 6.0 * np.arccosh(1 / (1 - first)) / np.sqrt(3 * G / (4 * radius))
    solver = replace(STIFF, contacts_per_interface=contacts)
    return run(assembly, duration, 400, solver, **settings)


def kept(ds: xr.Dataset, slenderness: float) -> np.ndarray:
    """Return the share of angular velocity kept at each impact, from successive largest tilts."""
    alpha, tilt = np.arctan(slenderness), ds["block_rotation"].values[:, 1]
    halves = np.split(np.abs(tilt), np.flatnonzero(np.diff(np.sign(tilt)) != 0) + 1)
    largest = np.array([half.max() for half in halves if len(half) > 5])[:3]
    energy = np.cos(alpha - largest) - np.cos(alpha)
    return np.sqrt(energy[1:] / energy[:-1])


@pytest.mark.parametrize(
    ("slenderness", "radius", "stiffness", "settings"),
    [
        (0.15, 0.5, 1e10, {}),
        (0.3, 0.5, 1e10, {}),
        (0.3, 3.0, 1e10, {}),
        (0.3, 0.5, 1e11, {}),
        (0.45, 1.0, 1e10, {}),
        (0.3, 0.5, 1e10, {"time_step_safety": 0.2}),
        (0.3, 0.5, 1e10, {"contact_damping": 2.0}),
    ],
)
def test_a_rocking_block_loses_at_impacts_what_housner_says(verify, slenderness, radius, stiffness, settings) -> None:
    ds = rocking(slenderness, radius, stiffness, 2, **{"contact_damping": 1.0, **settings})
    exact = 1.0 - 1.5 * np.sin(np.arctan(slenderness)) ** 2
    told = "".join(f", {name} = {value:g}" for name, value in settings.items())
    found = kept(ds, slenderness)
    assert found.size == 2
    for number, share in enumerate(found):
        case = f"b/h = {slenderness}, R = {radius:g} m, k_n = {stiffness:g} Pa/m{told}, impact {number + 1}"
        verify(IMPACT, case, "dynamic", "r", float(share), exact, 0.015)
    # what is lost is booked as damping, but for what bounces still and what rubs
    lost = float(
        ds["kinetic_energy"][0] - ds["kinetic_energy"][-1] + ds["external_work"][-1] - ds["elastic_energy"][-1]
    )
    assert float(ds["damping_work"][-1]) > 0.5 * lost > 0.0
    assert abs(float(ds["energy_error"][-1])) < 1e-3 * float(ds["damping_work"][-1])
    assert ds.attrs["impacts"].startswith("damped")


def test_impacts_are_elastic_by_default_and_that_is_said() -> None:
    ds = rocking(0.3, 0.5, 1e10, 2)
    assert float(ds["damping_work"][-1]) == 0.0
    assert ds.attrs["impacts"].startswith("elastic: no energy is lost where blocks strike")


def test_damping_of_contacts_leaves_a_bonded_joint_alone() -> None:
    """A bonded pair that vibrates is not damped by dashpots of contacts without strength."""
    assembly = Assembly(gravity=(0.0, 0.0), thickness=THICKNESS)
    for k in range(2):
        assembly.add_block(rectangle(0.0, 0.1 * k, 0.24, 0.1 * (k + 1)))
        assembly.set_velocity(k, y=1e-3 * (2 * k - 1))
    ds = run(assembly, 5e-3, 20, contact_damping=1.0)
    assert float(ds["damping_work"][-1]) == 0.0


@pytest.mark.parametrize(("height", "stiffness"), [(1e-3, 1e9), (1e-2, 1e9), (1e-2, 1e10)])
def test_a_block_bounces_to_where_it_came_from(verify: Verify, height: float, stiffness: float) -> None:
    block = on_plate(joint=dry(stiffness))
    block.support(1, y=False)
    block.set_velocity(1, y=np.sqrt(2 * G * height))
    once = 2 * np.sqrt(2 * height / G)
    course = started(block.build(STIFF), 3.3 * once, 4000, start="unstressed", time_step_safety=0.1)
    y = np.zeros(4001)
    for k in range(1, 4001):
        course.advance()
        y[k] = course.motion.displacement[1, 1]
    weight, k_all = DENSITY * 0.24 * THICKNESS * G, stiffness * 0.6 * THICKNESS
    case = f"H = {1e3 * height:g} mm, k_n = {stiffness:g} Pa/m"
    deepest = weight / k_all * (1 + np.sqrt(1 + 2 * k_all * height / weight))
    verify(BOUNCE, case, "dynamic", "u_max (m)", -y.min(), deepest, 0.01)
    verify(BOUNCE, case + ", third bounce", "dynamic", "H (m)", y[int(4000 * 2.2 / 3.3) :].max(), height, 1e-3)


def rectangular_slip(peak: float, length: float, mu: float, omega: float) -> float:
    """Return where a block ends behind its base after a pulse that it takes elastically at first."""
    start = np.arccos(1 - mu * G / peak) / omega
    speed = peak / omega * np.sin(omega * start)
    over = length - start
    fastest = speed + (peak - mu * G) * over
    slid = speed * over + 0.5 * (peak - mu * G) * over**2 + fastest**2 / (2 * mu * G)
    return float(slid + mu * G / omega**2)


def half_sine_slip(peak: float, length: float, mu: float) -> float:
    """Return the slip of a rigid block, by its two velocities."""
    omega = np.pi / length
    start = np.arcsin(mu * G / peak) / omega

    def base(t: float) -> tuple[float, float]:
        inside = min(t, length)
        way = peak / omega * (inside - np.sin(omega * inside) / omega) + 2 * peak / omega * (t - inside)
        return way, peak / omega * (1 - np.cos(omega * inside))

    way, speed = base(start)
    end = optimize.brentq(lambda t: base(t)[1] - speed - mu * G * (t - start), 0.6 * length, 10.0)
    return float(base(end)[0] - way - speed * (end - start) - 0.5 * mu * G * (end - start) ** 2)


@pytest.mark.parametrize(
    ("kind", "peak", "mu", "stiffness"),
    [
        ("rectangular", 6.0, 0.3, 1e9),
        ("rectangular", 6.0, 0.3, 1e10),
        ("rectangular", -9.0, 0.6, 1e10),
        ("half_sine", 8.0, 0.3, 1e10),
        ("half_sine", -6.0, 0.5, 1e10),
    ],
)
def test_a_pulse_moves_a_block_by_newmarks_slip(verify: Verify, kind: str, peak: float, mu: float, stiffness: float):
    block = on_plate(joint=dry(stiffness, mu))
    block.support(1, x=False, y=False)
    pulse = BaseMotion(kind=kind, acceleration=peak, duration=0.1)
    ds = run(block, 0.5, 50, base=(pulse,))
    x = ds["block_displacement_x"].values
    omega = np.sqrt(stiffness * 0.6 * THICKNESS / (DENSITY * 0.24 * THICKNESS))
    if kind == "rectangular":
        exact = rectangular_slip(abs(peak), 0.1, mu, omega)
    else:
        exact = half_sine_slip(abs(peak), 0.1, mu)
    case = f"{kind}, {peak:g} m/s², μ = {mu}, k_s = {stiffness:g} Pa/m"
    computed = -np.sign(peak) * (x[-1, 1] - x[-1, 0])
    verify(
        SLIDE, case, "dynamic", "way relative to the base (m)", computed, exact, 2e-4 if kind == "rectangular" else 2e-3
    )
    assert np.abs(ds["energy_error"]).max() < 1e-4 * ds["friction_work"].max()


@pytest.mark.parametrize("angle", [0.0, 1.0, -2.5])
@pytest.mark.parametrize(("degrees", "slides"), [(20.0, False), (30.0, True)])
def test_a_block_on_an_incline(verify: Verify, degrees: float, slides: bool, angle: float) -> None:
    """Also with the whole scene turned by an angle."""
    slope = np.radians(degrees)
    block = on_plate(0.6, 0.1, dry(1e11, 0.5), slope=slope, angle=angle)
    ds = run(block, 0.3, 10, start="unstressed" if slides else "equilibrium")
    moved = np.array([ds[f"block_displacement_{axis}"].values[-1, 1] for axis in "xy"])
    way = moved @ [np.cos(angle), np.sin(angle)]
    case = f"{degrees:g}°, μ = 0.5, scene turned by {angle:g} rad"
    if slides:
        exact = 0.5 * G * (np.sin(slope) - 0.5 * np.cos(slope)) * 0.3**2
        verify(INCLINE, case, "dynamic", "way (m)", way, exact, 5e-3)
    else:
        verify(INCLINE, case, "dynamic", "stays", bool(abs(way) < 1e-6), True)
    assert abs(moved @ [-np.sin(angle), np.cos(angle)]) < 1e-5


@pytest.mark.parametrize(("offset", "topples"), [(-1.0, False), (1.0, True)])
def test_a_slender_block_on_an_incline_topples(verify: Verify, offset: float, topples: bool) -> None:
    slope = np.arctan(0.25) + np.radians(offset)
    ds = run(on_plate(0.1, 0.4, dry(1e10, 1.0), slope=slope), 1.5, 15, damping="viscous", frequency=1.0)
    fallen = bool(ds["block_rotation"].values[-1, 1] < -1.0)
    verify(INCLINE, f"b/h = 0.25, {offset:+g}° from atan(b/h)", "dynamic", "topples", fallen, topples)


@pytest.mark.parametrize(("share", "topples"), [(0.97, False), (1.03, True)])
@pytest.mark.parametrize(("slender", "stiffness"), [(0.05, 1e11), (0.05, 1e10), (0.1, 1e10), (0.2, 1e9)])
def test_a_slender_block_tips_by_its_own_rotation(verify, slender, stiffness, share, topples) -> None:
    """The block stands and falls at shares of its limit; all limits are below the b/h of a rigid joint."""
    width = 0.1
    height = width / slender
    limit = tipping_slope(width, height, DENSITY * G * width * height, stiffness)
    assert share * limit < slender
    slope = np.arctan(share * limit)
    block = on_plate(width, height, dry(stiffness, 1.0), slope=slope)
    fine = replace(STIFF, no_tension_subdivisions=16)
    ds = run(block, 4.0, 8, fine, damping="rayleigh", damping_ratio=0.05, frequency=0.5, second_frequency=1000.0)
    case = f"b/h = {slender:g}, k_n = {stiffness:g} Pa/m, {share:g} of the limit"
    verify(TIPS, case, "dynamic", "topples", bool(ds["block_rotation"].values[-1, 1] < -0.2), topples)


@pytest.mark.parametrize("spin", [2 * np.pi, 20.0])
def test_a_turn_stresses_a_joint_by_centrifugal_force_alone(verify: Verify, spin: float) -> None:
    course = started(pair(0.0, 0.0, spin), 2 * np.pi / spin, 40, start="unstressed")
    worst = [np.abs(increment.normal_stress).max() for increment in course]
    moved = course.motion.displacement
    np.testing.assert_allclose(moved[:2, 2], 2 * np.pi, rtol=1e-6)
    assert np.abs(moved[:2, :2]).max() < 1e-7
    exact = DENSITY * 0.075 * spin**2 * 0.0375
    case = f"ω = {spin:.3g} rad/s, one turn"
    verify(SPIN, case, "dynamic", "σ below twice its mean", bool(max(worst) < 2.001 * exact), True)
    # at many moments that have nothing to do with the vibration's period
    long = started(pair(0.0, 0.0, spin), 0.0271, 600, start="unstressed")
    mean = np.mean([float(increment.normal_stress[0, 1]) for increment in long])
    verify(SPIN, f"ω = {spin:.3g} rad/s", "dynamic", "σ (Pa)", mean, exact, 0.03)


@pytest.mark.parametrize("shift", [0.0, 1e4])
def test_a_flying_pair_keeps_what_it_has(verify: Verify, shift: float) -> None:
    """Also 10 km from the origin."""
    course = started(pair(1.0, 0.5, 20.0, shift), 0.5, 5, start="unstressed")
    before = momentum(course)
    first, *_, last = (course.energy.balance() for _ in course)
    case = f"0.5 s, {course.steps} steps, {shift / 1e3:g} km from the origin"
    verify(KEPT, case, "dynamic", "momentum and angular momentum (kg m/s, kg m²/s)", momentum(course), before, 1e-9)
    computed = last.kinetic_energy + last.elastic_energy
    verify(KEPT, case, "dynamic", "kinetic and elastic energy (J)", computed, first.kinetic_energy, 1e-6)


def exchanged(ds: object) -> float:
    return float(np.abs(np.diff(ds["kinetic_energy"].values)).sum())


@pytest.mark.parametrize("kind", ["bouncing", "rocking", "swinging"])
def test_energy_is_kept_over_many_steps(verify: Verify, kind: str) -> None:
    solver = STIFF
    if kind == "bouncing":
        block = on_plate(joint=dry(1e9))
        block.set_velocity(1, y=0.4)
    elif kind == "rocking":
        block = on_plate(0.2, 0.8, dry(1e9, 5.0), tilt=0.1)
    else:
        block = swinging()
    trial = run(block, 1e-3, 1, start="unstressed", time_step_safety=0.2)
    dynamics = Dynamics(duration=12e4 * trial.attrs["time_step"], outputs=100, start="unstressed", time_step_safety=0.2)
    ds = damagepred.solve(block, solver=solver, dynamics=dynamics)
    assert ds["cycles"].sum() > 1e5
    case = f"{kind}, {int(ds['cycles'].sum())} steps"
    computed = float(np.abs(ds["energy_error"]).max()) / exchanged(ds)
    verify(AUDIT, case, "dynamic", "largest error, share", computed, 0.0, 1e-3, scale=1.0)


def swinging() -> Assembly:
    from damagepred.assembly.assembly import rectangle
    from damagepred.scene import Joint

    assembly = Assembly(thickness=THICKNESS, joint=Joint(tensile_strength=1e9, cohesion=1e9))
    for i in range(5):
        assembly.add_block(rectangle(0.0, 0.1 * i, 0.24, 0.1 * (i + 1)))
        assembly.set_velocity(i, x=0.1 * (i + 0.5) * 0.2)
    assembly.rest_on_ground([0])
    return assembly
