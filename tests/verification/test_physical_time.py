"""Stacks and single blocks in runs of physical mass and time, with displacements of any size."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from scipy import special

import damagepred
from damagepred import Assembly, BlockMaterial, Dynamics, Solver
from damagepred.one_wall.judged_path import dynamic_run
from tests.verification.blocks import BLOCK, BRICK, STONE, UNITS, G, Unit, stack
from tests.verification.manual import Verify
from tests.verification.test_vibration import DROP, chain, closed_form

pytestmark = pytest.mark.quick_cases

RIGID = Solver(lump_block_elasticity=False)
STEP = closed_form(
    title="Time step of runs in physical time",
    formula="dt = s · (2/ω) (√(1 + ξ²) - ξ) / √(1 + α),   ξ = β ω/2;   one block on its joint:\n"
    "ω² = max{ K/m,  eigenvalues of [k_s A/m, k_s A h/(2m); k_s A h/(2J), (k_n t b³/12 + k_s A h²/4)/J] }",
    source="Central differences; damping β proportional to stiffness taken from the last half step; local damping α; "
    "motion of one block: upwards, and shear with rocking, J = m (b² + h²)/12.",
    note="s: the share of the limit that the user asks for.",
)
STRUCK = closed_form(
    title="Stack struck in the middle",
    formula="u(x, t) = (1/2c) ∫ v_0(x') dx' from x - c t to x + c t;   c = √(E_eff/ρ),   1/E_eff = 1/E + 1/(k_n h)",
    source="d'Alembert; stiffness of joint and block in series.",
    note="A bell of velocity, 10 blocks (one standard deviation) wide, 140 blocks above the ground.",
)


def weightless(unit: Unit, count: int, material: BlockMaterial | None = None) -> Assembly:
    """Return a stack whose joints do not open, without gravity."""
    joint = unit.joint(tensile_strength=1e12, cohesion=1e12)
    assembly = Assembly(thickness=unit.t, gravity=(0.0, 0.0), block=material or unit.material, joint=joint)
    for i in range(count):
        assembly.add_block(unit.at(0.0, i * unit.h), course=i)
    assembly.rest_on_ground([0])
    return assembly


@pytest.fixture(autouse=True, scope="module")
def compiled_runs() -> None:
    solve(weightless(BRICK, 1), Dynamics(duration=1e-4, outputs=1))


def solve(assembly: Assembly, dynamics: Dynamics) -> xr.Dataset:
    return damagepred.solve(assembly, solver=RIGID, dynamics=dynamics)


@pytest.mark.parametrize(
    "settings",
    [
        Dynamics(time_step_safety=1.0),
        Dynamics(damping="local", local_damping=0.8),
        Dynamics(damping="rayleigh", damping_ratio=0.05, frequency=100.0, second_frequency=2000.0),
    ],
    ids=["undamped", "local", "rayleigh"],
)
@pytest.mark.parametrize("unit", UNITS, ids=str)
def test_the_time_step(verify: Verify, unit: Unit, settings: Dynamics) -> None:
    settings = replace(settings, new_contacts=False, duration=1000.0, outputs=1)
    k_n, k_s, inertia = unit.k_n * unit.area, unit.k_s * unit.area, unit.mass * (unit.b**2 + unit.h**2) / 12
    tilt = unit.k_n * unit.t * unit.b**3 / 12 + k_s * unit.h**2 / 4
    coupled = np.array([[k_s / unit.mass, k_s * unit.h / 2 / unit.mass], [k_s * unit.h / 2 / inertia, tilt / inertia]])
    omega = np.sqrt(max(k_n / unit.mass, *np.linalg.eigvals(coupled).real))
    xi = 0.0
    if settings.damping == "rayleigh":
        first, second = 2 * np.pi * settings.frequency, 2 * np.pi * settings.second_frequency
        xi = settings.damping_ratio / (first + second) * omega
    alpha = settings.local_damping if settings.damping == "local" else 0.0
    limit = 2 / omega * (np.sqrt(1 + xi**2) - xi) / np.sqrt(1 + alpha)
    case = f"damping {settings.damping}, s = {settings.step_share(dry=False):g}: {unit}"
    computed = dynamic_run(stack(unit, 1).build(RIGID), RIGID, settings).timing.step
    verify(STEP, case, "dynamic", "dt (s)", computed, settings.step_share(dry=False) * limit, 1e-5)


THROWN = [(BRICK, 1e-4), (BLOCK, 1e-3), (STONE, 0.05)]


@pytest.mark.parametrize(("unit", "height"), THROWN)
def test_a_block_thrown_up_lands_on_its_joint(verify: Verify, unit: Unit, height: float) -> None:
    assembly = Assembly(thickness=unit.t, joint=unit.joint(), block=unit.material)
    plate, block = assembly.add_block(unit.at(0.0, -unit.h)), assembly.add_block(unit.at(0.0, 0.0))
    assembly.support(plate)
    stiffness = unit.k_n * unit.area
    sag = unit.weight / stiffness
    # it rests on its joint at first: what it needs to reach H above the unstressed joint
    energy = unit.weight * height + unit.weight**2 / (2 * stiffness)
    assembly.set_velocity(block, y=float(np.sqrt(2 * energy / unit.mass)))
    duration = 3.2 * np.sqrt(2 * height / G) + 2 * np.pi / float(chain(unit, 1, 1))
    ds = solve(assembly, Dynamics(duration=duration, outputs=2000, time_step_safety=0.02))
    y = ds["block_displacement_y"].values[:, block]
    deepest = int(y.argmin())
    exact = np.array([height, sag * (1 + np.sqrt(1 + 2 * height / sag)), height])
    case = f"H = {1e3 * height:g} mm, K H/W = {height / sag:.3g}, thrown up: {unit}"
    computed = [y[:deepest].max(), -y[deepest], y[deepest:].max()]
    verify(DROP, case, "dynamic", "H, u_max and H of the rebound (m)", computed, exact, 5e-3, scale=exact)


@pytest.mark.parametrize(("unit", "modulus"), [(BRICK, None), (BLOCK, 2e9)])
def test_a_wave_in_a_stack(verify: Verify, unit: Unit, modulus: float | None) -> None:
    n, width, start, travelled = 240, 10.0, 140, 70
    solver, material = RIGID, unit.material
    if modulus is not None:
        solver, material = Solver(), replace(unit.material, elastic_modulus=modulus)
    assembly = weightless(unit, n, material)
    place = np.arange(n)
    for i, speed in enumerate(1e-3 * np.exp(-0.5 * ((place - start) / width) ** 2)):
        assembly.set_velocity(i, y=float(speed))
    exact = np.sqrt(1 / (1 / (unit.k_n * unit.h) + (0.0 if modulus is None else 1 / modulus)) / unit.density)
    duration = travelled * unit.h / exact
    settings = Dynamics(duration=duration, outputs=1, new_contacts=False)
    u = damagepred.solve(assembly, solver=solver, dynamics=settings)["block_displacement_y"].values[-1]
    plateau = 1e-3 * width * unit.h * np.sqrt(2 * np.pi) / (2 * exact)
    front = np.interp(0.5, u[:start] / plateau, place[:start])
    case = f"n = {n}, " + ("rigid" if modulus is None else f"E {1e-6 * modulus:g} MPa") + f": {unit}"
    verify(STRUCK, case, "dynamic", "speed of the lower front (m/s)", (start - front) * unit.h / duration, exact, 2e-3)
    behind = np.abs(place - start) < 30
    shape = special.ndtr((place - (start - travelled)) / width) - special.ndtr((place - (start + travelled)) / width)
    verify(STRUCK, case, "dynamic", "displacement between the fronts (m)", u[behind], plateau * shape[behind], 1e-2)
