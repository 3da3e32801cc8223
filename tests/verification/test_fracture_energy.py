"""Work dissipated by a softening joint between blocks with prescribed movement, for all features of the law."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from scipy import integrate, optimize

import damagepred
from damagepred import Assembly, Joint, Solver
from damagepred.assembly.assembly import rectangle
from damagepred.kernels.joint.explicit_update import explicit_update
from damagepred.kernels.joint.softening import Softening
from tests.kernels.one_joint import one_joint
from tests.verification.conftest import SOLVERS
from tests.verification.manual import Verify, chapter

pytestmark = pytest.mark.quick_cases("solver")

B, H, T = 0.24, 0.075, 0.11
AREA = B * T
QUASI_STATIC = SOLVERS["quasi_static"]
JOINT = Joint(tensile_strength=0.3e6, fracture_energy=40.0)
F_T, G_F, K_N, K_S = JOINT.tensile_strength, 40.0, JOINT.normal_stiffness, JOINT.shear_stiffness
U_0, W_C = F_T / K_N, 2 * G_F / F_T

closed_form = chapter("Joints that open, break and slide")
MODE_I = closed_form(
    title="Work of pulling a softening joint open",
    formula="∫ F du = A G_f",
    source="Linear softening; the area under it is the fracture energy, whatever the law says of shear.",
    note="Every combination of what a joint may have besides. “G_II” is the shear fracture energy over the least with "
    "which a bond softens by slip; with less the first slip breaks it. “apex”: cohesion / tan φ is just the tensile "
    "strength. The quasi-static solver's own account of its work must say the same.",
)
TURNED = closed_form(
    title="Work of turning a softening joint open",
    formula="∫ (F dv + M dθ) = A G_f,   v = θ r",
    source="Each contact opens from nothing to beyond w_c.",
)
MIXED = closed_form(
    title="Softening joint that opens until slip breaks it",
    formula="u = n p,  s = m p;   breaks at k_s m p* = C(b) - σ tan φ(b),  b that of the opening n p*;\n"
    "∫ F·du/A = ∫ σ du + k_s (m p*)²/2;   fracture work over A = ∫ σ du - σ* n p*/2;   the rest is set free",
    source="The law along a straight path; p* by a root finder (scipy.optimize.brentq), the integral by quadrature.",
)
HALF = closed_form(
    title="Work that a half-softened joint has taken",
    formula="fracture work = A G_f (1 - b),   b = (w_c - u)/(w_c - u_0);   elastic energy A b f_t u/2",
    source="Linear softening that unloads to the origin.",
)
BOX = closed_form(
    title="Shear box whose bond the first slip breaks",
    formula="τ = k_s u up to C + p tan φ;   then C_r + p tan φ_r",
    source="Coulomb's law with residual cohesion and friction.",
)


def laws() -> dict[str, Joint]:
    """Return a softening joint with every combination of what goes with it."""
    found = {}
    for shear, left, more, apex in itertools.product(
        (None, "brittle", 0.999, 1.001, 50.0), (False, True), (None, "dilation", "cap"), (False, True)
    ):
        given: dict[str, float | bool] = {"friction": JOINT.cohesion / F_T} if apex else {}
        given |= {"residual_cohesion": 0.05e6, "residual_friction": 0.5} if left else {}
        given |= {"dilation": 0.2} if more == "dilation" else {"compressive_strength": 5e6} if more == "cap" else {}
        joint = replace(JOINT, **given)
        if isinstance(shear, float):
            if more == "dilation":  # refused
                continue
            # below this energy the first slip breaks the bond
            least = 1.1 * (joint.cohesion - joint.residual_cohesion) ** 2 / (2 * joint.shear_stiffness)
            joint = replace(joint, shear_fracture_energy=shear * least)
            words = [f"G_II {shear:g}"]
        else:
            joint = replace(joint, brittle_shear=shear is not None)
            words = ["brittle shear"] if shear else []
        words += ["residual strength"] * left + [more] * (more is not None) + ["apex"] * apex
        found[", ".join(words) or "nothing else"] = joint
    return found


LAWS = laws()


def on_plate(joint: Joint, dpc: bool = False) -> tuple[Assembly, int]:
    """Return a brick on a plate, and its number; with a dpc, on another brick that lies on the plate."""
    wall = Assembly(thickness=T, gravity=(0.0, 0.0), joint=joint)
    low = wall.add_block(rectangle(-0.1, -0.1, B + 0.1, 0.0))
    wall.support(low)
    bottom = 0.0
    if dpc:
        plate, bottom = low, H
        low = wall.add_block(rectangle(0.0, 0.0, B, H))
        wall.support(low)
        wall.set_joint(plate, low, Joint(tensile_strength=0.0, cohesion=0.0, friction=0.5))
    brick = wall.add_block(rectangle(0.0, bottom, B, bottom + H))
    wall.support(brick)
    return wall, brick


def forces(ds: xr.Dataset, block: int) -> tuple[np.ndarray, np.ndarray]:
    """Return forces and moment on a block's support (N, N m), and its way (m, rad): (increments, 3) each."""
    kinds = ("force_x", "force_y", "moment")
    force = np.array([ds[f"block_support_{kind}"].values[:, block] for kind in kinds]).T
    names = ("displacement_x", "displacement_y", "rotation")
    return force, np.array([ds[f"block_{name}"].values[:, block] for name in names]).T


def delivered(ds: xr.Dataset, block: int) -> float:
    """Return the work of a block's support by the trapezoidal rule (J)."""
    force, way = forces(ds, block)
    return float((0.5 * (force[1:] + force[:-1]) * np.diff(way, axis=0)).sum())


def balanced(ds: xr.Dataset, put_in: float, within: float) -> None:
    """Assert that the quasi-static solver's account of its work balances, and never took more than was put in."""
    assert float(ds["energy_error"][-1]) <= within * put_in
    taken = ds["fracture_work"].values + ds["friction_work"].values
    assert (taken <= ds["external_work"].values + within * put_in).all()
    assert (ds["released_energy"].values >= 0.0).all()


@pytest.mark.parametrize("law", LAWS)
def test_pulling_off_takes_the_fracture_energy(verify: Verify, solver: Solver, law: str) -> None:
    check_pull(verify, solver, law, LAWS[law], dpc=False)


def check_pull(verify: Verify, solver: Solver, case: str, joint: Joint, dpc: bool) -> None:
    wall, brick = on_plate(joint, dpc)
    wall.move(brick, y=1.25 * W_C)
    ds = damagepred.solve(wall, solver=solver, increments=20)
    force, way = (values[:, 1] for values in forces(ds, brick))
    # the law is straight between its corners; that at u_0 lies in the first increment
    work = 0.5 * AREA * F_T * U_0 + 0.5 * (AREA * F_T + force[1]) * (way[1] - U_0)
    work += np.trapezoid(force[1:], way[1:])
    verify(MODE_I, case, solver.method, "work over area (N/m)", work / AREA, G_F, 1e-6)
    if solver.method == "quasi_static":
        balanced(ds, G_F * AREA, 0.01)  # the trapezoidal rule passes the peak of the law within a step
        for name, within in (("fracture_work", 1e-6), ("external_work", 0.01)):
            assert float(ds[name][-1]) == pytest.approx(G_F * AREA, rel=within), name


@pytest.mark.parametrize("law", [law for law in LAWS if not ("apex" in law or "dilation" in law or "cap" in law)])
def test_turning_off_takes_the_fracture_energy(verify: Verify, solver: Solver, law: str) -> None:
    """About a point on the plane of the joint, a width beyond its edge, so that nothing is sheared."""
    wall, brick = on_plate(LAWS[law])
    turn = 1.25 * W_C / B
    wall.move(brick, rotation=turn, y=1.5 * B * turn, x=-turn * H / 2)
    ds = damagepred.solve(wall, solver=replace(solver, ramp_cycles=200), increments=200)
    verify(TURNED, law, solver.method, "work over area (N/m)", delivered(ds, brick) / AREA, G_F, 0.01)
    if solver.method == "quasi_static":
        balanced(ds, G_F * AREA, 0.01)
        assert float(ds["fracture_work"][-1]) == pytest.approx(G_F * AREA, rel=1e-6)


def along(joint: Joint, opening: float) -> tuple[float, float]:
    """Return tension, and the largest shear stress, of a joint that has only ever opened (Pa)."""
    bond = float(np.clip((W_C - opening) / (W_C - U_0), 0.0, 1.0))
    sigma = K_N * opening if opening < U_0 else bond * F_T
    bond = 1.0 if opening < U_0 else bond
    rest = joint.friction if joint.residual_friction is None else joint.residual_friction
    cohesion = joint.residual_cohesion + bond * (joint.cohesion - joint.residual_cohesion)
    return sigma, cohesion - sigma * (rest + bond * (joint.friction - rest))


FEW = ("brittle shear", "brittle shear, residual strength, dilation")


@pytest.mark.parametrize("share", [0.5, 0.02, 0.1, 2.0])
@pytest.mark.parametrize("law", FEW)
def test_slip_breaks_what_opening_has_left(verify: Verify, solver: Solver, law: str, share: float) -> None:
    """Opened and sheared along a straight path: fracture takes what opening has taken, and no more."""
    joint = LAWS[law]
    wall, brick = on_plate(joint)
    opened = 1.25 * W_C
    sheared = share * joint.cohesion / K_S
    wall.move(brick, y=opened, x=sheared)
    ds = damagepred.solve(wall, solver=replace(solver, ramp_cycles=200), increments=400)
    gone = W_C / opened  # a joint that is open carries no shear

    def beyond(p: float) -> float:
        return K_S * sheared * p - along(joint, opened * p)[1]

    breaks = optimize.brentq(beyond, 0.0, gone, xtol=1e-15) if beyond(gone) > 0.0 else gone
    at, tau = opened * breaks, K_S * sheared * breaks
    sigma, _ = along(joint, at)
    pulled = integrate.quad(lambda u: along(joint, u)[0], 0.0, at, points=[U_0] if at > U_0 else None)[0]
    put_in = pulled + tau**2 / (2 * K_S)
    fracture = max(pulled - 0.5 * sigma * at, 0.0)
    case = f"{law}, slid by {share:g} C/k_s"
    computed = delivered(ds, brick) / AREA
    verify(MIXED, case, solver.method, "work over area (N/m)", computed, put_in, 0.01, scale=max(put_in, 0.05 * G_F))
    if solver.method == "quasi_static":
        verify(
            MIXED,
            case,
            solver.method,
            "fracture work over area (N/m)",
            float(ds["fracture_work"][-1]) / AREA,
            fracture,
            0.01,
            scale=max(put_in, 0.05 * G_F),
        )
        balanced(ds, max(put_in, 0.05 * G_F) * AREA, 0.01)


@pytest.mark.parametrize("softens", [False, True])
@pytest.mark.parametrize("pressure", [0.0, 0.2e6])
def test_the_first_slip_leaves_the_residual_strength(verify: Verify, solver: Solver, pressure: float, softens: bool):
    """Brittle shear with a residual friction and cohesion below the intact ones."""
    joint = Joint(
        brittle_shear=True, residual_friction=0.3, residual_cohesion=0.05e6, fracture_energy=20.0 if softens else None
    )
    wall = Assembly(thickness=T, gravity=(0.0, 0.0), joint=joint)
    plate = wall.add_block(rectangle(-0.1, -0.1, B + 0.1, 0.0))
    box = wall.add_block(rectangle(0.0, 0.0, B, H))
    wall.support(plate)
    wall.support(box, y=False)
    wall.load(box, y=-pressure * AREA)
    peak = joint.cohesion + pressure * joint.friction
    left = joint.residual_cohesion + pressure * 0.3
    steps = 37  # none of them just at the peak
    moved = 1.6 * peak / K_S
    wall.move(box, x=moved)
    ds = damagepred.solve(wall, solver=solver, increments=steps)
    u = np.arange(steps + 1) / steps * moved
    exact = np.where(K_S * u <= peak, K_S * u, left)
    force, _ = forces(ds, box)
    case = f"p {1e-6 * pressure:g} MPa" + (", bond softens" if softens else "")
    verify(BOX, case, solver.method, "shear stress (Pa)", force[:, 0] / AREA, exact, 1e-5, scale=peak)
    if solver.method == "quasi_static":
        assert float(ds["fracture_work"][-1]) == 0.0  # slip sets free what the joint holds
        free = (peak**2 - left**2) / (2 * K_S) - left * (peak - left) / K_S
        assert float(ds["released_energy"][-1]) / AREA == pytest.approx(free, rel=0.02)


@pytest.mark.parametrize("share", [0.05, 0.4, 0.9])
@pytest.mark.parametrize("law", ["nothing else", "brittle shear", "G_II 0.999", "G_II 50"])
def test_a_half_softened_joint_has_taken_its_share(verify: Verify, law: str, share: float) -> None:
    wall, brick = on_plate(LAWS[law])
    wall.move(brick, y=share * W_C)
    ds = damagepred.solve(wall, solver=QUASI_STATIC, increments=7)
    bond = (W_C - share * W_C) / (W_C - U_0)
    exact = [G_F * (1 - bond), 0.5 * bond * F_T * share * W_C]
    names = ("fracture_work", "elastic_energy")
    case = f"{law}, opened to {share:g} w_c"
    computed = [float(ds[n][-1]) / AREA for n in names]
    verify(HALF, case, QUASI_STATIC.method, "fracture work and elastic energy over area (N/m)", computed, exact, 1e-6)
    assert float(ds["external_work"][-1]) == pytest.approx(AREA * sum(exact), rel=0.01)
    balanced(ds, AREA * sum(exact), 0.01)


def worn_under_tension(joint: Joint, opened: float, sheared: float, steps: int) -> dict[str, float]:
    """Return where the work goes (N/m) along a straight path, by the explicit solver's law in many small steps."""
    rest = joint.friction if joint.residual_friction is None else joint.residual_friction
    intact, residual_strength = (F_T, joint.cohesion, joint.friction), (0.0, joint.residual_cohesion, rest)
    slip_weight = (W_C - U_0) * (joint.cohesion - joint.residual_cohesion) / (2 * joint.shear_fracture_energy)
    parameters = one_joint(K_N, K_S, intact, residual_strength, w_c=W_C, slip_weight=slip_weight)
    history: tuple[float, ...] = (0.0, 0.0, False, 0.0)
    external = friction = sigma = tau = 0.0
    for i in range(1, steps + 1):
        before, slid = (sigma, tau), history[0]
        for _ in range(3):  # what is left to slide follows in the next cycle
            sigma, tau, *rested = explicit_update(
                opened * i / steps, sheared * i / steps, history, parameters, True, Softening(True)
            )
            history = tuple(rested)
        external += 0.5 * ((before[0] + sigma) * opened + (before[1] + tau) * sheared) / steps
        friction += 0.5 * (before[1] + tau) * (history[0] - slid)
    elastic = 0.5 * sigma * opened + 0.5 * tau**2 / K_S
    return {
        "external_work": external,
        "friction_work": friction,
        "elastic_energy": elastic,
        "fracture_work": external - friction - elastic,
    }


@pytest.mark.parametrize("left", [False, True])
@pytest.mark.parametrize(("open_to", "slide"), [(0.3, 1.0), (0.6, 4.0), (0.6, 10.0)])
def test_wear_under_tension_takes_what_the_other_law_says(open_to: float, slide: float, left: bool) -> None:
    """Opened and slid at a time, so that both use up the bond; the explicit law is the independent account."""
    joint = LAWS["G_II 50, residual strength" if left else "G_II 50"]
    wall, brick = on_plate(joint)
    opened, sheared = open_to * W_C, slide * joint.cohesion / K_S
    wall.move(brick, y=opened, x=sheared)
    ds = damagepred.solve(wall, solver=QUASI_STATIC, increments=400)
    exact = worn_under_tension(joint, opened, sheared, 20_000)
    assert exact["friction_work"] > 0.02 * exact["external_work"]
    for name, value in exact.items():
        computed = float(ds[name][-1]) / AREA
        assert computed == pytest.approx(value, abs=0.01 * exact["external_work"]), name
    balanced(ds, exact["external_work"] * AREA, 0.01)
