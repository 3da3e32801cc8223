"""Deformable blocks in the quasi-static solver: condensation, yielding, and agreement with the explicit solver."""

import dataclasses

import numpy as np
import pytest

from damagepred import Assembly, BlockMaterial, Joint, Scene, Solver, solve
from damagepred.assembly.assembly import rectangle
from damagepred.enumerations import ZoneState
from damagepred.kernels.equilibrium.joints import add_internal_forces
from damagepred.solvers import solve_path
from damagepred.solvers.driver import Outcome
from damagepred.solvers.quasi_static import continuation
from damagepred.solvers.quasi_static.equilibrium import Equilibrium
from damagepred.solvers.quasi_static.step_control import StepControl
from damagepred.solvers.quasi_static.stepper import QuasiStaticStepper
from damagepred.solvers.quasi_static.superelements import Superelements
from damagepred.solvers.state.wall_state import State
from damagepred.solvers.state.zone_history import exceeds_yield_limit
from damagepred.solvers.system.discrete_system import DiscreteSystem

QUASI = Solver(blocks="deformable", zone_size=0.06)
EXPLICIT = dataclasses.replace(QUASI, method="explicit", tolerance=1e-5)
WEAK = BlockMaterial(elastic_modulus=3e9, cohesion=0.25e6, friction=0.7, dilation=0.2, tensile_strength=0.15e6)


def panel(material: BlockMaterial, courses: int = 4) -> Assembly:
    """A small wall under a loaded beam that is displaced along the wall."""
    joint = Joint(tensile_strength=0.2e6, cohesion=0.3e6)
    assembly = Assembly(thickness=0.11, block=material, joint=joint)
    for j in range(courses):
        for i in range(3):
            left = 0.24 * i + 0.12 * (j % 2)
            assembly.add_block(rectangle(left, 0.08 * j, left + 0.24, 0.08 * (j + 1)), course=j)
    height = 0.08 * courses
    beam = assembly.add_block(rectangle(0, height, 0.84, height + 0.1), zone_size=0.0)
    assembly.load(beam, y=-25e3)
    assembly.move(beam, x=0.3e-3)
    assembly.rest_on_ground([0, 1, 2])
    return assembly


@pytest.mark.parametrize("kind", ["dishing", "doming"])
def test_one_course_of_zones_carries_its_own_weight(kind: str) -> None:
    """By hand: length x height x thickness x density x g."""
    scene = {
        "wall": {"length": 1.2, "height": 0.075, "thickness": 0.11},
        "block": {"density": 2000.0},
        "solver": {"blocks": "deformable"},
        "movement": {"kind": kind, "central_deflection": 1e-3, "increments": 2},
    }
    ds = solve(Scene.from_dict(scene))
    assert (ds["unbalanced_force_ratio"] < 1e-6).all()
    np.testing.assert_allclose(ds["base_reaction"].values, 1.2 * 0.075 * 0.11 * 2000.0 * 9.81, rtol=1e-5)


def test_bricks_of_one_shape_share_one_condensation() -> None:
    model = panel(BlockMaterial(), courses=8).build(QUASI)
    superelements = Superelements(DiscreteSystem.of(model))
    assert len(superelements.law.blocks.shapes.size) == 1
    assert len(superelements.boundary) == 24
    assert all(stiffness is superelements.elastic[0] for stiffness in superelements.elastic)


def test_stiffness_of_levels_is_that_of_all_gridpoints_condensed() -> None:
    model = panel(BlockMaterial()).build(QUASI)
    equilibrium = Equilibrium(model, 1e-6)
    rng = np.random.default_rng(7)
    whole = DiscreteSystem.of(model).elastic_stiffness
    free = DiscreteSystem.of(model).free_dofs
    force = np.zeros(model.size)
    kept = equilibrium.equations.active.dofs
    force[kept] = rng.normal(size=len(kept))
    moved = equilibrium.equations.solve(force)
    exact = np.zeros(model.size)
    from scipy.sparse.linalg import spsolve

    exact[free] = spsolve(whole[free][:, free].tocsc(), force[free])
    np.testing.assert_allclose(
        moved[kept], exact[kept], atol=1e-4 * np.abs(exact).max()
    )  # the regularisation is 1e-7 of each stiffness


@pytest.mark.quick_cases
@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("material", [BlockMaterial(elastic_modulus=3e9), WEAK], ids=["elastic", "weak"])
def test_both_solvers_agree(material: BlockMaterial, plane: str) -> None:
    quasi, explicit = (dataclasses.replace(s, plane=plane) for s in (QUASI, EXPLICIT))
    # plastic strain comes in one step in each increment: its error falls with their number
    found = list(solve_path(panel(material).build(quasi), quasi, 24))[::2]
    expected = list(solve_path(panel(material).build(explicit), explicit, 12))
    push = [[float(i.support_force[-1, 0]) for i in path] for path in (found, expected)]
    yields = material.yields
    away = np.abs(np.array(push[0]) / push[1] - 1.0)
    # a bond that breaks near an increment may do so before it in one solver and after it in the other
    assert np.median(away) < (2e-3 if yields else 2e-4)
    assert away.max() < (0.05 if yields else 2e-3)
    zones = found[-1].zones
    assert (zones.state != ZoneState.ELASTIC).any() == yields
    largest = np.abs(zones.stress).max()
    away = np.abs(zones.stress - expected[-1].zones.stress).max() / largest
    assert away < (0.2 if yields else 1e-3)
    if yields:
        assert found[-1].energy.plastic_work > 0.1
    assert found[-1].energy.energy_error < 0.02 * found[-1].energy.external_work


@pytest.mark.parametrize("leave", ["refused step", "checkpoint"])
def test_zone_states_return_with_the_state_of_the_wall(leave: str, monkeypatch: pytest.MonkeyPatch) -> None:
    stepper = QuasiStaticStepper(panel(WEAK).build(QUASI), QUASI)
    path = stepper.path

    def zone_state() -> list[int]:
        zones = stepper.report(Outcome(0.0, True, False)).zones
        return zones.state.tolist()

    path.advance(1.0, 0.5)
    before, checkpoint = zone_state(), stepper.checkpoint()
    if leave == "checkpoint":
        path.advance(1.0, 1.0)
        assert zone_state() != before
        stepper.restore(checkpoint)
    else:
        trial = path.state.at(1.0, 0.6)
        assert path.equilibrium.find(trial) < path.tolerance
        control = StepControl.start(path.state, (1.0, 1.0), False)
        monkeypatch.setattr(continuation, "next_length", lambda *_: 0.0)
        assert not path._commit_within_energy_error(trial, 1.0, False, control)
    assert zone_state() == before


def test_forces_are_the_slope_of_what_the_blocks_push_back_also_where_they_yield() -> None:
    model = panel(WEAK).build(QUASI)
    equilibrium = Equilibrium(model, 1e-6)
    superelements, state = equilibrium.superelements, State.rest(model)
    rng = np.random.default_rng(11)
    u = np.zeros(model.size)
    d = 4
    boundary = superelements.boundary[d]
    # bent, and a little uneven: tension cuts off on one side
    block = int(model.mesh.block[d])
    x, y = model.mesh.x - model.blocks.x[block], model.mesh.y - model.blocks.y[block]
    u[model.mesh.dof_x], u[model.mesh.dof_y] = -8e-3 * x * y, 4e-3 * x**2
    u[boundary] += 2e-7 * rng.normal(size=len(boundary))
    zones = np.arange(len(state.plastic))[:, None]
    superelements.activate_plastic(np.where(zones == model.mesh.first_zone[d], 1e-30, 0.0))
    inside, none = equilibrium._in_state(state), np.empty(0, dtype=np.int64)
    stiffness = np.zeros((len(model.interfaces.kind), 9))

    def force(moved: np.ndarray) -> np.ndarray:
        out = np.zeros(model.size)
        add_internal_forces(equilibrium.components, inside, none, True, moved, out, stiffness)
        return out[boundary]

    before = force(u.copy())
    superelements.update_tangents(equilibrium.equations.solver)
    assert np.flatnonzero(superelements.law.blocks.yielding).tolist() == [d]
    first = superelements.first_entry[d]
    tangent = superelements.tangents[first : first + superelements.elastic[d].size].reshape(len(boundary), -1).copy()
    assert np.abs(tangent - superelements.elastic[d]).max() > 0.01 * np.abs(tangent).max()
    for column in range(0, len(boundary), 5):
        nudged, step = u.copy(), 1e-10
        nudged[boundary[column]] += step
        slope = (force(nudged) - before) / step
        np.testing.assert_allclose(-slope, tangent[:, column], atol=2e-3 * np.abs(tangent).max())


def test_zones_are_beyond_what_they_bear_from_uniaxial_and_shear_strength_on() -> None:
    """2 C sqrt(N) in compression along each axis, the tensile strength in tension; sheared under an equal pressure p
    the Mohr circle of radius (2 C sqrt(N) + (N - 1) p) / (N + 1) touches the line."""
    assembly = Assembly(block=WEAK)
    assembly.rest_on_ground([assembly.add_block(rectangle(0, 0, 0.24, 0.24))])
    model = assembly.build(QUASI)
    slope = (WEAK.friction + np.hypot(1.0, WEAK.friction)) ** 2  # N = tan(45 degrees + phi / 2)^2
    crushing, pressure = 2.0 * WEAK.cohesion * np.sqrt(slope), 0.2e6
    radius = (crushing + (slope - 1.0) * pressure) / (slope + 1.0)
    for share, beyond in ((0.999, False), (1.001, True)):
        stress = np.zeros((len(model.mesh.zones), 4))
        for zone, axis in enumerate((0, 1, 3)):
            stress[zone, axis], stress[zone + 3, axis] = -share * crushing, share * WEAK.tensile_strength
        stress[6:8] = [(-pressure, -pressure, sign * share * radius, 0.0) for sign in (-1.0, 1.0)]
        found = exceeds_yield_limit(model, stress)
        assert (found[:8] == beyond).all()
        assert not found[8:].any()
