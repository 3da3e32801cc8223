"""Parts of the solvers by hand calculation: step control, jacks, facets, points on faces, start and bounds of runs."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from damagepred.assembly import Assembly
from damagepred.assembly.assembly import rectangle
from damagepred.assembly.section import SectionMemory
from damagepred.enumerations import ZoneState
from damagepred.kernels.concrete_section.forces import section_forces
from damagepred.kernels.explicit.cycle import VOLUME
from damagepred.kernels.interface.checks import softened_bond_load
from damagepred.kernels.interface.internal_force import contact_stresses, update_tresca_bounds
from damagepred.kernels.jit import kernel
from damagepred.kernels.joint.limits import NO_LIMIT
from damagepred.kernels.joint.parameters import JointParameters
from damagepred.one_wall.judged_path import dynamic_run
from damagepred.scene import BlockMaterial, Dynamics, Joint, Solver
from damagepred.solvers import solve_path
from damagepred.solvers.dynamics.body_arrays import _spread
from damagepred.solvers.explicit.jack_servo import GAIN_RATIO, LINE_STIFFNESS_RATIO, Pump
from damagepred.solvers.explicit.scheme import DampedTimeStepping
from damagepred.solvers.quasi_static.bond_failures import BondFailures
from damagepred.solvers.quasi_static.dynamic_relaxation import VolumeCorrection
from damagepred.solvers.quasi_static.energy_balance import EnergyBalance
from damagepred.solvers.quasi_static.external_load import JackControl
from damagepred.solvers.quasi_static.step_control import next_length
from damagepred.solvers.state.wall_state import JointHistory
from damagepred.solvers.state.zone_history import zone_results
from damagepred.solvers.system.collapse_criterion import largest_elastic_displacement
from damagepred.solvers.system.discrete_system import DiscreteSystem
from damagepred.solvers.system.footing_forces import section_energy, section_response_of
from tests.kernels.one_joint import Bounds
from tests.solvers.dynamic_scenes import STIFF
from tests.solvers.test_outputs_by_hand import SOFT
from tests.verification.test_energy_accounts import DRY, ELASTIC, ONE_STEP, concrete_on_jacks, on_jacks

BRITTLE = replace(SOFT, compressive_strength=None, brittle_shear=True)
GRAVITY = 9.81


@pytest.mark.parametrize(
    ("error", "section", "largest", "residual", "damage", "length"),
    [
        (0.0, 0.0, 100.0, 0.0, 0.0, 0.3 * 4.0),
        (0.2 / 16.0, 0.0, 100.0, 0.0, 0.0, 0.3 * 0.8 * 4.0),
        (0.19, 0.0, 100.0, 0.0, 0.0, 0.3),
        (0.8, 0.0, 100.0, 0.0, 0.0, 0.3 * 0.8 * 0.5),
        (0.8, 0.7, 100.0, 0.0, 0.0, 0.3 * 0.8 * np.sqrt(2.0)),
        (0.8, 0.0, 100.0, 1e3, 0.0, 0.3 * 4.0),
        (0.8, 0.0, 0.0, 0.2, 0.0, 0.3 * 0.8 * 0.5),
        (1e6, 0.0, 100.0, 0.0, 0.0, 0.3 * 0.1),
        (0.0, 0.0, 100.0, 0.0, 0.5, 0.3 * 0.8 * 2.0),
        (0.0, 0.0, 100.0, 0.0, 4.0, 0.3 * 0.8 * 0.25),
        (0.8, 0.0, 100.0, 0.0, 4.0, 0.3 * 0.8 * 0.25),
    ],
)
def test_length_of_the_next_step(error, section, largest, residual, damage, length) -> None:
    """The error is of second order, so the length is proportional to its root; 0.2 J is a fifth of 1 % of 100 J."""
    before = SimpleNamespace(energy_error=0.5, section_error=0.25)
    after = SimpleNamespace(
        energy_error=0.5 + error, section_error=0.25 + section, largest_work=largest, residual_work=residual
    )
    found = next_length(0.01, before, after, damage, 0.3)
    assert found == pytest.approx(length)


def test_a_prescribed_load_of_jacks_grows_in_proportion() -> None:
    control = JackControl(np.zeros(1), np.zeros(1), 1e-3)
    assert control.load_at(0.25, 77.0) == 77.0
    control.level_load, control.load = 2000.0, 5000.0
    assert control.load_at(0.25, 77.0) == 2750.0


def test_pump_and_line_by_static_solutions() -> None:
    model = on_jacks("deflection").model
    pump = Pump(model)
    push, weights = model.jacks.push, model.deflection
    solved = DiscreteSystem.of(model).elastic_solutions(
        DiscreteSystem.of(model).dead_load + pump.level_load * push, push, weights
    )
    level, by_push, by_weight = solved
    np.testing.assert_allclose(pump.level, level, rtol=1e-6, atol=1e-9 * np.abs(level).max())
    assert abs(weights @ level) < 1e-9 * np.abs(level).max()
    gives = push @ by_push
    line = LINE_STIFFNESS_RATIO / gives
    assert pump.level_volume == pytest.approx(push @ level + pump.level_load / line)

    # two vibrations with the line as a spring, by Rayleigh's quotient
    mass = np.linspace(3.0, 5.0, model.size)
    bent = by_weight - by_push * (line * (push @ by_weight) / (1.0 + line * gives))
    squares = [(gives + line * gives**2) / (mass @ by_push**2), (weights @ bent) / (mass @ bent**2)]
    pump.set_gain(mass, 0.7)
    assert pump.time_constant == pytest.approx(1.0 / (GAIN_RATIO * 0.7 * np.sqrt(min(squares))), rel=1e-6)
    slowness = pump.time_constant
    pump.halve_gain()
    assert pump.time_constant == pytest.approx(2.0 * slowness)

    for share in (0.25, 0.5):
        pump.deliver(share * pump.level_volume)
    assert pump.line.state[VOLUME] == pytest.approx(0.75 * pump.level_volume)
    pump.begin_level()
    for progress, more, over in ((0.25, 3e-4, 0.25), (0.75, -5e-4, 0.5)):
        pump.deliver(more)
        pump.extrapolate_volume(progress)
        assert pump.line.volume_step == pytest.approx(more / over)


@pytest.mark.parametrize(("share", "e"), [(0.5, 0.9e-4), (1.0, 0.3e-4), (0.3, -2e-4)])
def test_load_of_a_softened_bond_by_hand(share: float, e: float) -> None:
    """Beyond the limit, the excess stress over the cohesion; kappa at this integrity."""
    wall = Assembly(thickness=0.11, joint=BRITTLE)
    for k in range(2):
        wall.add_block(rectangle(0.0, 0.1 * k, 0.3, 0.1 * k + 0.1))
    wall.support(0)
    parameters = JointParameters(*wall.build(STIFF).joint_parameters[0])
    first, critical = 0.5e-4, 1.8e-4
    kappa = critical - share * (critical - first)
    sigma = 2e9 * e if e < 0 else share * 0.1e6 * e / kappa
    limit = 0.05e6 + share * 0.25e6 - sigma * (0.5 + share * 0.3)
    assert limit > 0.0
    for tau in (0.5 * limit, -1.7 * limit):
        found = softened_bond_load(True, parameters, kappa, e, tau, 1.0)
        assert found == pytest.approx(1.0 + (abs(tau) - limit) / 0.3e6)


@pytest.mark.parametrize(("kept", "closes"), [(0.02e6, True), (0.0, False)])
def test_a_broken_bond_that_keeps_strength_closes_again_within_it(kept: float, closes: bool) -> None:
    wall = Assembly(joint=replace(SOFT, fracture_energy=None, residual_tensile_strength=kept))
    wall.add_block(rectangle(0.0, 0.0, 0.3, 0.1))
    wall.rest_on_ground([0])
    model = wall.build(STIFF)
    history = JointHistory.fresh(model)
    history.kappa[:] = np.inf
    stress = np.array([[-1.0, 0.9, 1.1]]) * kept
    bonds = BondFailures(model, history)
    assert bonds.reclose(history, stress / 2e9, np.array([[True, False, False]])) == bonds.can_reclose == closes
    assert (history.kappa == 0.0).tolist() == [[False, closes, False]]


def test_slip_breaks_the_bonds_of_the_sliding_joint_alone() -> None:
    strong = replace(BRITTLE, tensile_strength=1e6, cohesion=3e6, fracture_energy=2e3)
    wall = Assembly(thickness=0.11, joint=BRITTLE)
    for k in range(3):
        wall.add_block(rectangle(0.0, 0.1 * k, 0.3, 0.1 * k + 0.1))
    wall.set_joint(1, 2, strong)
    wall.support(0)
    wall.move(2, x=1.2e-3, y=0.05e-3, rotation=0.0)
    settings = Solver(lump_block_elasticity=False)
    last = list(solve_path(wall.build(settings), settings, 20))[-1]
    assert last.state.tolist() == [[1, 1, 1], [0, 0, 0]]


def test_largest_elastic_displacement_may_exceed_the_size_of_the_wall() -> None:
    wall = Assembly(thickness=0.1, joint=Joint(normal_stiffness=1e8, shear_stiffness=1e8))
    wall.add_block(rectangle(0.0, 0.0, 0.4, 0.1))
    wall.rest_on_ground([0])
    wall.push(0, y=-1e8 * 0.04)
    assert largest_elastic_displacement(wall.build(STIFF), 0.5) == 0.0


def test_pieces_of_facets_move_with_the_wall() -> None:
    """The same positions on the facets, for any position of the wall."""
    meshes = []
    for x, y in ((0.0, 0.0), (5.0, -3.0)):
        wall = Assembly(thickness=0.11, joint=DRY, block=ELASTIC)
        for k in range(3):
            left = x + (0.07 if k == 1 else 0.0)
            wall.add_block(rectangle(left, y + 0.1 * k, left + 0.3, y + 0.1 * k + 0.1), zone_size=0.1)
        wall.rest_on_ground([0])
        meshes.append(wall.build(STIFF).mesh)
    here, there = meshes
    assert ((here.piece_place > 0.0) & (here.piece_place < 1.0)).all()
    np.testing.assert_allclose(there.piece_place, here.piece_place, atol=1e-9)
    np.testing.assert_allclose(there.piece_middle - [5.0, -3.0], here.piece_middle, atol=1e-9)


def test_a_zone_has_yielded_if_any_plastic_strain_is_not_zero() -> None:
    wall = Assembly(thickness=0.11, block=ELASTIC)
    wall.add_block(rectangle(0.0, 0.0, 0.1, 0.1), zone_size=0.1)
    model = wall.build(STIFF)
    zones = len(model.mesh.zones)
    plastic = np.zeros((zones, 4))
    plastic[np.arange(4), np.arange(4)] = 1e-5
    now = np.zeros(zones, dtype=np.int8)
    now[1] = ZoneState.TENSION
    expected = np.where(plastic.any(axis=1), np.int8(ZoneState.YIELDED), 0)
    expected[1] = now[1]
    found = zone_results(np.zeros((model.mesh.x.size, 2)), np.zeros((zones, 4)), plastic, now)
    assert found.state.tolist() == expected.tolist()


def test_points_on_a_stretch_of_a_face() -> None:
    """Two cells of 0.3 m: Gauss within, Radau where the face ends; Lobatto for a single cell."""
    g = 0.5 / np.sqrt(3)
    gauss = [(0.5 - g, 1 / 2), (0.5 + g, 1 / 2)]
    begins, ends = [(0.0, 1 / 4), (2 / 3, 3 / 4)], [(1 / 3, 3 / 4), (1.0, 1 / 4)]
    for first, last in ((False, False), (True, False), (False, True), (True, True)):
        rules = (begins if first else gauss, ends if last else gauss)
        expected = [(0.2 + 0.3 * (k + at), 0.3 * share) for k in range(2) for at, share in rules[k]]
        np.testing.assert_allclose(_spread(0.2, 0.8, 0.3, first, last), expected)
    np.testing.assert_allclose(_spread(0.2, 0.5, 0.3, True, True), [(0.2, 0.05), (0.35, 0.2), (0.5, 0.05)])


EXPLICIT = Solver(method="explicit", lump_block_elasticity=False, symmetric_half=False)


def test_bound_of_the_work_of_loads_by_hand() -> None:
    wall = Assembly(thickness=0.11, joint=DRY)
    wall.add_block(rectangle(0.0, 0.0, 0.3, 0.1))
    wall.rest_on_ground([0])
    wall.load(0, x=-7.0, moment=3.0)
    wall.push(0, x=5.0, y=-11.0)
    run = DampedTimeStepping(wall.build(EXPLICIT), EXPLICIT)
    run.motion.displacement[:3], run.load_factor = [-2e-3, 1e-3, -4e-3], 0.5
    weight = 2000.0 * GRAVITY * 0.3 * 0.1 * 0.11
    assert run.work_of_loads() == pytest.approx(2e-3 * (7.0 + 2.5) + 1e-3 * (weight + 5.5) + 4e-3 * 3.0)


def test_one_block_of_several_is_fixed_after_the_load() -> None:
    wall = Assembly(thickness=0.11, joint=DRY)
    for x in (0.0, 0.5):
        for k in range(2):
            wall.add_block(rectangle(x, 0.1 * k, x + 0.3, 0.1 * k + 0.1))
    for block in (0, 2):
        wall.support(block)
    wall.move(0, y=1e-5)
    wall.hold_after_load(1)
    path = list(solve_path(wall.build(EXPLICIT), EXPLICIT, 2))
    assert path[0].displacement[1, 1] < 0.0
    np.testing.assert_allclose(path[-1].displacement[1], path[0].displacement[1], rtol=1e-9, atol=1e-15)
    assert path[-1].displacement[0, 1] == pytest.approx(1e-5)


def test_slip_of_a_block_above_moving_ground() -> None:
    wall = Assembly(thickness=0.11, joint=DRY)
    wall.add_block(rectangle(0.0, 0.0, 0.3, 0.1))
    wall.rest_on_ground([0], lambda x: 2e-3 + 0.0 * x)
    wall.set_velocity(0, x=0.1, y=1.0)
    model = wall.build(STIFF)
    model = replace(model, ground=model.ground.map(lambda state: state._replace(shear=0.5 * state.normal)))
    last = list(dynamic_run(model, STIFF, Dynamics(duration=0.05, outputs=2, movement_time=0.05, damping="none")))[-1]
    (x, y, turn), away = last.displacement[0], model.interfaces.contact_offset[0]
    assert y > 0.02
    np.testing.assert_allclose(last.slip[0], x - 1e-3, atol=1e-6)
    np.testing.assert_allclose(last.opening[0], y - 2e-3 + away * turn, atol=1e-6)


@pytest.mark.parametrize("strongest", [None, 1e9], ids=["plain", "cap out of reach"])
def test_tresca_bounds_are_the_limits_of_the_law_at_a_displacement(strongest: float | None) -> None:
    """Intact, cracked and open contacts; from no bound at once, from another bound with under-relaxation."""
    joint = Joint(
        normal_stiffness=2e9,
        shear_stiffness=0.7e9,
        tensile_strength=0.1e6,
        cohesion=0.3e6,
        friction=0.8,
        residual_cohesion=0.05e6,
        residual_friction=0.5,
        compressive_strength=strongest,
        cap_shear=0.01,
    )
    wall = Assembly(thickness=0.11, joint=joint)
    for k in range(3):
        wall.add_block(rectangle(0.0, 0.1 * k, 0.3, 0.1 * k + 0.1))
    model = wall.build(STIFF)
    history, listed, still = JointHistory.fresh(model), np.arange(2), model.ground.at(0.0)
    history.cracked[0] = True
    displacement = np.zeros(model.size)
    displacement[3:9] = [2e-5, -3e-5, 3e-4, 1e-5, -9e-5, 4e-4]
    opening, sigma, tau = (np.zeros((2, 3)) for _ in range(3))
    joints = model.interface_records
    kernel(contact_stresses)(joints, True, still, history, displacement, opening, sigma, tau)
    assert (opening[0] > 0.0).tolist().count(True) == 1
    limit = np.vstack((0.05e6 - 0.5 * 2e9 * opening[0], 0.3e6 - 0.8 * 2e9 * opening[1]))
    limit[0, opening[0] > 0.0] = 0.0
    assert (limit[1] > 0.0).all()
    for old, share, expected in ((NO_LIMIT, 0.3, limit), (1e5, 0.3, 1e5 + 0.3 * (limit - 1e5)), (1e5, 1.0, limit)):
        bounds = Bounds(np.full((2, 3), old), np.zeros((2, 3)), np.zeros((2, 3)))
        kernel(update_tresca_bounds)(listed, joints, True, still, history, displacement, bounds, share)
        np.testing.assert_allclose(bounds.bound, expected, rtol=1e-9, atol=1e-3)


def test_slopes_of_footing_sections_are_those_of_their_forces() -> None:
    model = concrete_on_jacks().model
    memory, count = SectionMemory.fresh(len(model.sections.interface)), len(model.sections.interface)
    rng = np.random.default_rng(3)
    start = 1e-5 * rng.standard_normal(model.size)
    step = 1e-10 * rng.standard_normal(model.size)
    stiffness, force = np.zeros((len(model.interfaces.kind), 9)), np.zeros(model.size)
    records, values = model.interface_records, np.zeros((count, 6))
    section_forces(model.sections, memory, records, start, force, stiffness, values)
    before, after = (section_response_of(model, memory, u) for u in (start - step, start + step))
    slopes = stiffness[model.sections.interface].reshape(count, 3, 3)
    expected = (slopes @ (after - before)[:, :3, None])[..., 0]
    np.testing.assert_allclose((after - before)[:, 3:], expected, rtol=1e-4, atol=1e-5 * np.abs(expected).max())
    assert (np.abs(slopes[:, 0, 2]) > 1e-6 * np.abs(slopes[:, 0, 0])).any()


def test_correction_of_the_jack_volume_uses_the_effect_of_the_last_one() -> None:
    correction = VolumeCorrection(2.0)
    assert not correction.settles(1e-4, 1e-4)
    assert not correction.settles(1.2e-4, 1e-4)
    assert correction.settles(1.25e-4, 1e-4)
    assert not correction.settles(1.25e-4, 1e-10)
    assert correction.next(0.0, 1e-4) == pytest.approx(2e-4)
    # a unit of volume gave 0.25, then 0.1 of deflection, then none
    assert correction.next(0.5e-4, 0.5e-4) == pytest.approx(0.5e-4 / 0.25)
    assert correction.next(0.7e-4, 0.3e-4) == pytest.approx(0.3e-4 / 0.1)
    assert correction.next(0.7e-4, 0.3e-4) == pytest.approx(0.3e-4 * 40.0)


def test_a_yielding_block_beside_an_elastic_one_yields_as_alone() -> None:
    weak = BlockMaterial(elastic_modulus=2e9, cohesion=0.12e6, friction=0.5, tensile_strength=0.1e6)
    plastic = {}
    for beside in (False, True):
        wall = Assembly(thickness=0.11, gravity=(0.0, 0.0))
        wall.add_block(rectangle(0.0, 0.0, 0.2, 0.1), weak, zone_size=0.1)
        if beside:
            wall.add_block(rectangle(1.0, 0.0, 1.2, 0.1), ELASTIC, zone_size=0.1)
        for block in range(wall.n_blocks):
            left = float(block)
            wall.hold_points(block, lambda x, y, left=left: x < left + 1e-9, x=0.0, y=0.0)
            wall.hold_points(block, lambda x, y, left=left: x > left + 0.2 - 1e-9, x=-6e-5)
        settings = replace(ONE_STEP, blocks="deformable", zone_size=0.1)
        plastic[beside] = list(solve_path(wall.build(settings), settings, 4))[-1].energy.plastic_work
    assert plastic[False] > 0.0
    assert plastic[True] == pytest.approx(plastic[False], rel=1e-6)


MODEL = SimpleNamespace(
    sections=SimpleNamespace(interface=np.array([0])),
    interfaces=SimpleNamespace(contact_area=np.full((1, 2), 0.045), contact_offset=np.array([[-0.15, 0.15]])),
    properties=SimpleNamespace(normal_stiffness=np.array([1e10]), shear_stiffness=np.array([4e9])),
)


def bent(turn: float, secant: float) -> np.ndarray:
    """Opening, shear, rotation, axial force, shear force and moment of a section in pure bending."""
    return np.array([[0.0, 0.0, turn, 0.0, 0.0, secant * turn]])


def dissipated(before: np.ndarray, now: np.ndarray) -> float:
    return float(section_energy(MODEL, now, before)[1][0])


def test_cracking_dissipates_the_triangle_between_two_secants() -> None:
    assert dissipated(bent(1e-3, 5e6), bent(2e-3, 4e6)) == pytest.approx(0.5 * 1e-3 * 2e-3 * (5e6 - 4e6))


def test_an_uncracked_section_stores_the_energy_of_its_contacts() -> None:
    """k_n 1e10, k_s 4e9 Pa/m on 0.09 m2: tension, shear and bending, each force times displacement over two."""
    way = np.array([1e-5, 2e-5, 1e-4])
    force = way * 0.09 * np.array([1e10, 4e9, 1e10 * 0.15**2])
    beyond, taken = section_energy(MODEL, np.append(way, force)[None], None)
    assert beyond == pytest.approx(0.0, abs=1e-9 * 0.5 * float(way @ force))
    assert taken[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("secant", "other_face"), [(5e6, 5e6), (3e6, 5e6), (5e6, 3e6)])
def test_bending_the_other_way_dissipates_nothing(secant: float, other_face: float) -> None:
    """Unloaded to the origin and loaded from there, whichever face is cracked more."""
    assert dissipated(bent(1e-3, secant), bent(-2e-3, other_face)) == pytest.approx(0.0, abs=1e-12)


def test_cracks_do_not_heal_and_recovered_energy_is_an_error() -> None:
    """Under axial force the cracks of a face close as the moment changes sign: the secant stiffness grows."""
    taken = [dissipated(bent(1e-3, 5e6), bent(2e-3, 4e6)), dissipated(bent(2e-3, 4e6), bent(3e-3, 4.5e6))]
    assert taken[1] < 0.0
    balance = EnergyBalance(np.zeros(0))
    balance._section_work = balance._largest_section_work = np.zeros(1)
    for step in taken:
        balance.add_section_work(np.array([step]))
    assert balance._largest_section_work.sum() == pytest.approx(taken[0])
    assert balance.section_error == pytest.approx(-taken[1])
