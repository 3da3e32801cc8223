"""Joints that soften, pulled open by a moving support between rigid blocks, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from scipy import optimize

import damagepred
from damagepred import Assembly, Joint, Solver
from damagepred.assembly import wall_model
from damagepred.assembly.assembly import rectangle
from damagepred.scene import BlockMaterial, Loads, Movement, Scene, Wall
from tests.verification.manual import Verify, chapter

pytestmark = pytest.mark.quick_cases("solver")

B, H, T = 0.6, 0.4, 0.11
STRENGTH, ENERGY, K_N = 0.2e6, 10.0, 82e9
JOINT = Joint(tensile_strength=STRENGTH, fracture_energy=ENERGY)
U_0, W_C = STRENGTH / K_N, 2 * ENERGY / STRENGTH
CRACKED = 1

closed_form = chapter("Joints that open, break and slide")
PULL = closed_form(
    title="Softening joint pulled open",
    formula="F = A k_n u for u <= u_0,  A f_t (w_c - u)/(w_c - u_0) beyond;   u_0 = f_t/k_n,  w_c = 2 G_f/f_t;\n"
    "∫ F du = A G_f",
    source="Linear softening; the area under it is the fracture energy.",
)
PAIR = closed_form(
    title="Two softening joints in a row",
    formula="u_1 + u_2 = u,   f_t (w_c - u_1)/(w_c - u_0) = k_n u_2",
    source="Both joints carry the same: the weaker one softens, the stronger one unloads elastically.",
)
TILT = closed_form(
    title="Softening joint tilted open",
    formula="Σ A_i σ(v + θ x_i) = 0,   M = Σ A_i σ(v + θ x_i) x_i",
    source="Equilibrium of the contacts on their softening law, the rise v by a root finder (scipy.optimize.brentq).",
)


def envelope(opening: np.ndarray, strength: float = STRENGTH) -> np.ndarray:
    """Return the stress of a joint that only ever opens, or is pressed."""
    start, end = strength / K_N, 2 * ENERGY / strength
    falling = np.clip((end - opening) / (end - start), 0.0, 1.0) * strength
    return np.where(opening <= start, K_N * opening, falling)


def normal_force(ds: xr.Dataset, interface: int) -> np.ndarray:
    """Return the tension across an interface in each increment (N)."""
    here = ds["contact_interface"].values == interface
    return (ds["contact_normal_stress"].values[:, here] * ds["contact_length"].values[here]).sum(axis=1) * T


def moment(ds: xr.Dataset, interface: int, middle: float) -> np.ndarray:
    """Return the moment of an interface's tension about a point on the joint (N m)."""
    here = ds["contact_interface"].values == interface
    force = ds["contact_normal_stress"].values[:, here] * ds["contact_length"].values[here] * T
    return (force * (ds["contact_x"].values[here] - middle)).sum(axis=1)


@pytest.mark.parametrize("support", ["ground", "block"])
@pytest.mark.parametrize("increments", [10, 40])
def test_a_block_is_pulled_off(verify: Verify, solver: Solver, support: str, increments: int) -> None:
    """F = A f_t (w_c - u) / (w_c - u_0); the work is A G_f."""
    assembly = Assembly(thickness=T, joint=JOINT)
    block = assembly.add_block(rectangle(0.0, 0.0, B, H))
    if support == "ground":
        assembly.rest_on_ground([block])
    else:
        assembly.support(assembly.add_block(rectangle(-0.5, -0.1, 1.1, 0.0)))
    assembly.support(block)
    assembly.move(block, y=1.25 * W_C)
    ds = damagepred.solve(assembly, solver=solver, increments=increments)
    pulled = np.arange(increments + 1) / increments * 1.25 * W_C
    force = normal_force(ds, 0)
    case = f"{B:g} m x {T:g} m on a {support}, f_t {1e-6 * STRENGTH:g} MPa, G_f {ENERGY:g} N/m, {increments} increments"
    exact = B * T * envelope(pulled)
    verify(PULL, case, solver.method, "force (N)", force, exact, 1e-9, scale=B * T * STRENGTH)
    np.testing.assert_allclose(ds["contact_opening"].values, np.tile(pulled[:, None], 3), rtol=1e-12)
    assert (ds["contact_state"].values[1:] == CRACKED).all()
    # from the first increment on, a path of straight pieces whose only corner is at the end
    first = 0.5 * B * T * STRENGTH * U_0 + 0.5 * (B * T * STRENGTH + force[1]) * (pulled[1] - U_0)
    verify(PULL, case, solver.method, "work (J)", first + np.trapezoid(force[1:], pulled[1:]), B * T * ENERGY, 1e-9)


@pytest.mark.parametrize("weak", [0, 1])
def test_of_two_joints_in_a_row_the_weaker_softens_while_the_other_lets_go(verify: Verify, solver: Solver, weak: int):
    """u_1 + u_2 is given and both carry the same: f_t (w_c - u_1) / (w_c - u_0) = k_n u_2."""
    strong = replace(JOINT, tensile_strength=2 * STRENGTH, cohesion=1e6)
    assembly = Assembly(thickness=T, gravity=(0.0, 0.0), joint=strong)
    blocks = [assembly.add_block(rectangle(0.0, i * H, B, (i + 1) * H)) for i in range(3)]
    assembly.set_joint(blocks[weak], blocks[weak + 1], JOINT)
    assembly.support(blocks[0])
    assembly.support(blocks[2])
    top = 1.2 * W_C
    assembly.move(blocks[2], y=top)
    ds = damagepred.solve(assembly, solver=solver, increments=48)
    pulled = np.arange(49) / 48 * top
    softening = STRENGTH / (W_C - U_0)
    weaker = (K_N * pulled - softening * W_C) / (K_N - softening)
    weaker = np.where(pulled > W_C, pulled, np.where(pulled < 2 * U_0, pulled / 2, weaker))
    force = B * T * envelope(weaker)
    for interface in (0, 1):
        verify(
            PAIR,
            f"joint {weak + 1} of 2 the weaker, f_t {1e-6 * STRENGTH:g} MPa, G_f {ENERGY:g} N/m",
            solver.method,
            f"force in joint {interface + 1} (N)",
            normal_force(ds, interface),
            force,
            1e-5,
            scale=B * T * STRENGTH,
        )
    opening = ds["contact_opening"].values.reshape(49, 2, 3)
    np.testing.assert_allclose(opening[:, weak].T, np.tile(weaker, (3, 1)), atol=1e-4 * U_0)
    cracked = ds["contact_state"].values.reshape(49, 2, 3) == CRACKED
    assert cracked[-1, weak].all()
    assert not cracked[:, 1 - weak].any()


@pytest.mark.parametrize("contacts", [3, 9])
def test_a_block_is_tilted_off(verify: Verify, solver: Solver, contacts: int) -> None:
    """Turned by a support and free to rise: no force, and the moment of the contacts where they then are."""
    assembly = Assembly(thickness=T, gravity=(0.0, 0.0), joint=JOINT)
    plate = assembly.add_block(rectangle(-0.5, -0.1, 1.1, 0.0))
    block = assembly.add_block(rectangle(0.0, 0.0, B, H))
    assembly.support(plate)
    assembly.support(block, y=False)
    turn = 1.5 * W_C / B
    assembly.move(block, rotation=turn, x=-turn * H / 2)  # about the middle of the joint, so nothing is sheared
    settings = replace(solver, quadrature="midpoint", contacts_per_interface=contacts)
    ds = damagepred.solve(assembly, solver=settings, increments=30)
    x = ((np.arange(contacts) + 0.5) / contacts - 0.5) * B
    area = B * T / contacts
    expected = np.array([tilted(turn * i / 30, x, area) for i in range(31)])
    case = f"{contacts} midpoints, f_t {1e-6 * STRENGTH:g} MPa, G_f {ENERGY:g} N/m"
    verify(
        TILT, case, solver.method, "rise (m)", ds["block_displacement_y"].values[:, 1], expected[:, 0], 1e-4, scale=U_0
    )
    verify(TILT, case, solver.method, "moment (N m)", moment(ds, 0, B / 2), expected[:, 1], 1e-5)
    assert (ds["contact_state"].values[-1] == CRACKED).any()


@pytest.mark.parametrize("kind", ["doming", "dishing"])
def test_a_wall_dissipates_the_fracture_energy_of_its_joints(kind: str) -> None:
    """Sum of A G_f (1 - b), b = (w_c - u)/(w_c - u_0) at the largest opening u of each contact along the path."""
    energy, strength = 20.0, 0.1e6
    scene = Scene(
        wall=Wall(length=1.68, height=0.6, thickness=T),
        joint=Joint(tensile_strength=strength, cohesion=1e6, fracture_energy=energy),
        block=BlockMaterial(density=2000.0),
        movement=Movement(kind=kind, shape="parabola", central_deflection=2e-3, increments=20),
        loads=Loads(roof=20e3),
        solver=Solver(blocks="elastic"),
    )
    ds = damagepred.solve(scene)
    model = wall_model(scene)
    start = np.repeat(strength / model.properties.normal_stiffness, model.interfaces.contact_area.shape[1])
    end, opening = 2 * energy / strength, ds["contact_opening"].values.max(axis=0)
    worn = np.clip((opening - start) / (end - start), 0.0, 1.0)
    expected = float((energy * model.interfaces.contact_area.ravel() * worn).sum())
    assert (worn == 1.0).sum() > 10
    assert ((worn > 0.0) & (worn < 1.0)).sum() > 3
    assert float(ds["fracture_work"][-1]) == pytest.approx(expected, rel=0.01)


def tilted(turn: float, x: np.ndarray, area: float) -> tuple[float, float]:
    """Return rise and moment of a plate on such joints, rotated step by step, by an independent root finder."""
    reach = abs(turn * x).max() + 1e-12
    rise = optimize.brentq(lambda up: envelope(up + turn * x).sum(), -reach, reach, xtol=1e-18, rtol=1e-14)
    return rise, float((envelope(rise + turn * x) * area * x).sum())


@pytest.mark.parametrize("share", [0.2, 0.999])
def test_too_little_fracture_energy_is_none(solver: Solver, share: float) -> None:
    """What the elastic joint holds when it cracks is f_t^2 / (2 k_n): a bond with less breaks at once."""
    paths = []
    for energy in (None, share * STRENGTH**2 / (2 * K_N)):
        assembly = Assembly(thickness=T, joint=replace(JOINT, fracture_energy=energy))
        blocks = [assembly.add_block(rectangle(0.0, i * H, B, (i + 1) * H)) for i in range(3)]
        assembly.support(blocks[0])
        assembly.move(blocks[2], y=5 * U_0)
        paths.append(damagepred.solve(assembly, solver=replace(solver, tolerance=1e-3), increments=5))
    assert (paths[0]["contact_state"].values == CRACKED).any()
    for name in ("contact_normal_stress", "contact_opening", "contact_slip", "contact_state", "block_displacement_x"):
        np.testing.assert_array_equal(paths[0][name].values, paths[1][name].values)
