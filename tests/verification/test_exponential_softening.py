"""Exponential softening in all solvers: stress along an opening, work of opening and of sliding, a block shot off."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import damagepred
from damagepred import Assembly, Dynamics, Solver
from damagepred.assembly.assembly import rectangle
from damagepred.one_wall.judged_path import dynamic_run
from tests.verification.conftest import SOLVERS
from tests.verification.manual import Verify, chapter
from tests.verification.test_fracture_energy import AREA, F_T, G_F, JOINT, K_S, U_0, B, H, T, forces, on_plate

pytestmark = pytest.mark.quick_cases("solver")

A = 5.0
MEAN = (1 - np.exp(-A)) / A - np.exp(-A) / 2
W_C = U_0 + (G_F / F_T - U_0 / 2) / MEAN
EXPONENTIAL = replace(JOINT, softening="exponential")
CURVE = chapter("Joints that open, break and slide")(
    title="Exponential softening",
    formula="σ = f_t (exp(-5 ξ) - ξ exp(-5)),   ξ = (u - u_0)/(w_c - u_0);   ∫ σ du = G_f",
    source="Closed by a line at w_c, as Hordijk's curve (1991).",
)


def test_opening_follows_the_curve(verify: Verify, solver: Solver) -> None:
    wall, brick = on_plate(EXPONENTIAL)
    wall.move(brick, y=1.1 * W_C)
    ds = damagepred.solve(wall, solver=solver, increments=400)
    force, way = (values[:, 1] for values in forces(ds, brick))
    xi = np.clip((way - U_0) / (W_C - U_0), 0.0, 1.0)
    exact = np.where(way < U_0, way / U_0, np.exp(-A * xi) - xi * np.exp(-A)) * F_T
    verify(CURVE, "opened", solver.method, "stress (Pa)", force / AREA, exact, 1e-6)
    work = 0.5 * F_T * U_0 + np.trapezoid(np.append(F_T, force[way > U_0] / AREA), np.append(U_0, way[way > U_0]))
    verify(CURVE, "opened", solver.method, "work over area (N/m)", work, G_F, 1e-3)
    if solver.method == "quasi_static":
        assert float(ds["fracture_work"][-1]) == pytest.approx(G_F * AREA, rel=1e-6)


@pytest.mark.parametrize("times", [4.0, 40.0])
def test_sliding_follows_the_curve(verify: Verify, solver: Solver, times: float) -> None:
    """With little energy the joint snaps back in shear before it softens further."""
    energy = times * JOINT.cohesion**2 / (2 * K_S)
    wall, brick = on_plate(replace(EXPONENTIAL, shear_fracture_energy=energy, friction=0.0))
    exhausting = energy / MEAN / JOINT.cohesion
    wall.move(brick, x=1.2 * exhausting)
    ds = damagepred.solve(wall, solver=solver, increments=200)
    force, way = (values[:, 0] for values in forces(ds, brick))

    def strength(slip: float) -> float:
        xi = min(slip / exhausting, 1.0)
        return JOINT.cohesion * float(np.exp(-A * xi) - xi * np.exp(-A))

    slips = way > JOINT.cohesion / K_S
    exact = K_S * way
    exact[slips] = [strength(brentq(lambda t, u=u: K_S * (u - t) - strength(t), 0, u, xtol=1e-15)) for u in way[slips]]
    case = f"slid, G_II {times:g} times the elastic energy"
    verify(CURVE, case, solver.method, "shear stress (Pa)", force / AREA, exact, 1e-5, scale=JOINT.cohesion)


@pytest.mark.parametrize("softening", ["linear", "exponential"])
def test_a_block_that_is_shot_off_loses_the_fracture_energy(verify: Verify, softening: str) -> None:
    wall = Assembly(thickness=T, gravity=(0.0, 0.0), joint=replace(JOINT, softening=softening))
    plate, brick = wall.add_block(rectangle(-0.1, -0.1, B + 0.1, 0.0)), wall.add_block(rectangle(0.0, 0.0, B, H))
    wall.support(plate)
    wall.set_velocity(brick, y=2.0)
    dynamics = Dynamics(duration=3e-3, outputs=20, start="unstressed", time_step_safety=0.005)
    solver = SOLVERS["explicit"]
    first, *_, last = (step.energy for step in dynamic_run(wall.build(solver), solver, dynamics))
    case = f"shot off, {softening}"
    computed = [(first.kinetic_energy - last.kinetic_energy) / AREA, last.fracture_work / AREA]
    verify(CURVE, case, "dynamic", "lost kinetic energy and fracture work over area (N/m)", computed, [G_F, G_F], 1e-3)
