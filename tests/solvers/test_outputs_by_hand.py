"""Outputs of the solvers, compared with hand calculation: law, balance, bonds, supports, detachment limit."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy import sparse

from damagepred.assembly import Assembly, Model
from damagepred.assembly.assembly import rectangle
from damagepred.assembly.model import Jacks
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.kernels.dynamics.contact import FREE
from damagepred.kernels.interface.checks import joint_law_violation_of
from damagepred.kernels.interface.residual import free_residual
from damagepred.kernels.jit import kernel
from damagepred.kernels.zone.superelement import largest_sum
from damagepred.scene import BlockMaterial, Joint, Solver
from damagepred.solvers import Increment, solve_path
from damagepred.solvers.driver import least_support_load
from damagepred.solvers.dynamics.body_arrays import body_arrays
from damagepred.solvers.dynamics.body_motion import motion_of
from damagepred.solvers.state.wall_state import JointHistory, contact_states, without_bond
from damagepred.solvers.system.collapse_criterion import DetachmentLimit, largest_elastic_displacement
from damagepred.solvers.system.footing_forces import section_forces, section_interfaces, section_lengths, support_loads
from tests.verification.test_energy_accounts import ONE_STEP, drawn_pair, softening_work

SOFT = Joint(
    normal_stiffness=2e9,
    shear_stiffness=0.7e9,
    tensile_strength=0.1e6,
    cohesion=0.3e6,
    friction=0.8,
    residual_tensile_strength=0.0,
    residual_cohesion=0.05e6,
    residual_friction=0.5,
    fracture_energy=9.0,
    compressive_strength=4e6,
    cap_shear=6.0,
)
BRITTLE = replace(SOFT, fracture_energy=None, residual_tensile_strength=0.02e6)
STIFF = Solver(lump_block_elasticity=False)


def pair(joint: Joint, **more: float) -> Model:
    wall = Assembly(thickness=0.11, joint=joint)
    low, _ = (wall.add_block(rectangle(0.0, y, 0.3, y + 0.1), **more) for y in (0.0, 0.1))
    wall.support(low)
    return wall.build(STIFF)


# kappa at an integrity of a half: between u_0 = 5e-5 m and w_c = 1.8e-4 m
HALF = 1.15e-4


@pytest.mark.parametrize(
    ("joint", "cracked", "kappa", "sigma", "tau", "beyond"),
    [
        (BRITTLE, False, 0.0, 0.11e6, 0.0, 0.01e6),
        (BRITTLE, True, 0.0, 0.11e6, 0.0, 0.09e6),
        (BRITTLE, False, 0.0, -1e6, 1.2e6, 1.2e6 - (0.3e6 + 0.8e6)),
        (BRITTLE, True, 0.0, -1e6, -0.6e6, 0.6e6 - (0.05e6 + 0.5e6)),
        (BRITTLE, True, 0.0, 1e6, 0.25e6, 0.98e6),
        (BRITTLE, False, 0.0, -4.3e6, 0.0, 0.3e6),
        (BRITTLE, False, 0.0, -3.9e6, 0.5e6, 0.5e6 - np.sqrt((4e6**2 - 3.9e6**2) / 6.0)),
        (SOFT, True, HALF, 0.08e6, 0.0, 0.03e6),
        (SOFT, True, 0.0, 0.13e6, 0.0, 0.03e6),
        (SOFT, True, HALF, -1e6, 0.9e6, 0.9e6 - (0.175e6 + 0.65e6)),
        (SOFT, True, np.inf, -1e6, 0.6e6, 0.05e6),
        (SOFT, False, 0.0, -1e6, 1e6, 0.0),
    ],
)
def test_excess_of_stresses_over_the_law(joint, cracked, kappa, sigma, tau, beyond) -> None:
    """At one contact of three; the others carry no stress."""
    model = pair(joint)
    history = JointHistory.fresh(model)
    history.cracked[0, 1], history.kappa[0, 1] = cracked, kappa
    normal, shear = np.zeros((1, 3)), np.zeros((1, 3))
    normal[0, 1], shear[0, 1] = sigma, tau
    violation = kernel(joint_law_violation_of)
    stresses = (True, model.joint_parameters, history.cracked, history.kappa, normal, shear)
    assert violation(*stresses) == pytest.approx(beyond, rel=1e-9, abs=1e-6)
    shear[0, 2] = np.nan
    assert np.isnan(violation(*stresses))


def test_residual_is_the_largest_of_free_degrees_of_freedom() -> None:
    force, free = np.array([3.0, -8.0, 5.0, 99.0]), np.array([0, 1, 2])
    left = np.empty(4)
    assert free_residual(force, free, np.array([1.0, 0.5, 2.0, 1.0]), left) == 10.0
    np.testing.assert_array_equal(left, [3.0, -8.0, 5.0, 0.0])
    assert free_residual(-force, free, np.array([1.0, 2.0, 0.1, 1.0]), left) == 16.0
    force[0] = np.nan
    assert free_residual(force, free, np.ones(4), left) == np.inf


def test_resultants_of_forces_on_gridpoints() -> None:
    """Two blocks of two gridpoints: the largest is in turn a horizontal force, a vertical force and a moment."""
    arm_x, arm_y = np.array([-1.0, 2.0, 0.5, -3.0]), np.array([0.5, -1.0, 2.0, 4.0])
    sums = np.zeros((6, 8))
    for gridpoint, block in enumerate((0, 0, 1, 1)):
        sums[3 * block, 2 * gridpoint] = sums[3 * block + 1, 2 * gridpoint + 1] = 1.0
        sums[3 * block + 2, 2 * gridpoint : 2 * gridpoint + 2] = -arm_y[gridpoint], arm_x[gridpoint]
    force = np.array([1.0, 2.0, 4.0, -3.0, 0.5, 0.25, -1.0, 2.0])

    def largest(matrix: np.ndarray) -> float:
        rows = sparse.csr_array(matrix)
        return float(kernel(largest_sum)(rows.indptr, rows.indices, rows.data, force))

    assert largest(sums) == 5.0
    assert largest(sums[[1, 4]]) == 2.25
    sums[[2, 5]] *= 3.0
    assert largest(sums) == pytest.approx(13.5)


@pytest.mark.parametrize(
    ("change", "bare"),
    [
        ({}, True),
        ({"tensile_strength": 1.0}, False),
        ({"residual_cohesion": 0.1e6}, False),
        ({"residual_friction": 0.4}, False),
    ],
)
def test_joints_without_a_bond_to_break(change: dict, bare: bool) -> None:
    dry = Joint(tensile_strength=0.0, cohesion=0.2e6, residual_cohesion=0.2e6, friction=0.6)
    assert set(without_bond(pair(replace(dry, **change))).tolist()) == {bare}


def test_states_of_contacts() -> None:
    """Cracked comes before slipping; a control joint, which has no bond, is always intact."""
    model = pair(SOFT)
    history = JointHistory.fresh(model)
    history.cracked[0, 0] = True
    history.slip[0, :2] = -1e-9
    assert contact_states(model, history).tolist() == [[1, 2, 0]]
    control = model.interfaces._replace(kind=np.full_like(model.interfaces.kind, ContactKind.CONTROL_JOINT))
    assert contact_states(replace(model, interfaces=control), history).tolist() == [[0, 0, 0]]


def beam() -> Model:
    """Three segments of footing on supports of 10 mm at 0.1, 0.7 and 1.15 m."""
    wall = Assembly(thickness=0.2, joint=Joint(normal_stiffness=5e9, shear_stiffness=2e9))
    edges = [0.0, 0.3, 0.7, 1.2]
    blocks = [wall.add_block(rectangle(a, 0.0, b, 0.2)) for a, b in pairwise(edges)]
    for block in (0, 1):
        wall.set_joint(block, block + 1, Joint(), ContactKind.FOOTING_SECTION)
    for block, x in ((0, 0.1), (1, 0.695), (2, 1.15)):
        wall.bear(blocks[block], x, width=0.01)
    return wall.build(STIFF)


def test_forces_of_supports_and_sections_are_those_of_their_contacts() -> None:
    model = beam()
    face = model.interfaces
    support = np.flatnonzero(face.kind == ContactKind.SUPPORT)
    sigma, tau, opening = (np.zeros(face.contact_area.shape) for _ in range(3))
    for k, carries in zip(support[np.argsort(face.x[support])], (300.0, 900.0, -120.0), strict=True):
        sigma[k] = -carries / face.contact_area[k].sum()
    at, load = support_loads(model, sigma)
    np.testing.assert_allclose(at, [0.1, 0.695, 1.15])
    np.testing.assert_allclose(load, [300.0, 900.0, -120.0])
    jacks = Jacks(
        np.zeros(model.size), np.array([0.4]), np.array([0.1, 1.15]), 1e-3, 0.0, False, "supports", np.zeros(model.size)
    )
    assert least_support_load(replace(model, jacks=jacks), 77.0, sigma) == pytest.approx(-120.0)
    other = sigma[:, ::-1] * np.where(face.x > 1.0, -4.0, 1.0)[:, None]
    assert least_support_load(replace(model, jacks=jacks), 77.0, other) == pytest.approx(300.0)
    assert least_support_load(replace(model, jacks=jacks._replace(stop="jacks")), 77.0, sigma) == 77.0
    assert least_support_load(replace(model, jacks=jacks._replace(stop="")), 77.0, sigma) == np.inf

    here = section_interfaces(model)
    np.testing.assert_allclose(face.x[here], [0.3, 0.7])
    np.testing.assert_allclose(section_lengths(model, here), [0.5 * (0.3 + 0.4), 0.5 * (0.4 + 0.5)])
    above = -face.contact_offset[here] * face.normal_x[here, None]  # the tangent points down
    opening[here] = np.array([[1e-5], [-2e-5]]) - np.array([[1e-4], [3e-4]]) * above
    sigma[here], tau[here] = np.array([[2e5], [1e5]]) - np.array([[1e6], [-4e6]]) * above, [[3e4], [-5e4]]
    found = section_forces(model, opening, sigma, tau)
    second = 0.2 * 0.2**3 / 12
    np.testing.assert_allclose(found.strain, [1e-5 / 0.35, -2e-5 / 0.45])
    np.testing.assert_allclose(found.curvature, [1e-4 / 0.35, 3e-4 / 0.45])
    np.testing.assert_allclose(found.axial_force, [2e5 * 0.04, 1e5 * 0.04])
    np.testing.assert_allclose(found.shear_force, [3e4 * 0.04, -5e4 * 0.04])
    np.testing.assert_allclose(found.moment, [1e6 * second, -4e6 * second])


def test_detachment_limit() -> None:
    """Half the largest free block, twice the settlement, twice the movement of ground, supports or jacks."""
    wall = Assembly(thickness=0.1, joint=Joint(normal_stiffness=1e8, shear_stiffness=1e8))
    for x, width in ((0.0, 0.4), (1.0, 0.1)):
        wall.add_block(rectangle(x, 0.0, x + width, 0.1))
    wall.rest_on_ground([0, 1], lambda x: -3e-3 * x)
    wall.support(wall.add_block(rectangle(3.0, 0.0, 6.0, 2.0)))
    wall.push(0, y=-500.0)
    model = wall.build(STIFF)
    bearing = 1e8 * 0.1 * (0.4 + 0.1)
    weight = 2000.0 * 9.81 * 0.1 * 0.1 * (0.4 + 0.1)
    plate = 2000.0 * 9.81 * 0.1 * 6.0
    detachment_limit = DetachmentLimit.of(model)
    assert detachment_limit.always == pytest.approx(0.5 * np.sqrt(0.04) + 2.0 * (weight + plate) / bearing)
    assert detachment_limit.with_load_factor == pytest.approx(2.0 * 3e-3 * 1.1)
    assert detachment_limit.at(0.25) == pytest.approx(
        detachment_limit.always + 0.25 * detachment_limit.with_load_factor
    )
    dead, live = 2000.0 * 9.81 * 0.1 / 1e8, 500.0 / (1e8 * 0.1 * 0.4)
    assert largest_elastic_displacement(model, 0.0) == pytest.approx(dead)
    assert largest_elastic_displacement(model, 0.5) == pytest.approx(dead + 0.5 * live)
    wall.move(2, x=-0.02)
    assert DetachmentLimit.of(wall.build(STIFF)).with_load_factor == pytest.approx(0.04)
    jacks = Jacks(
        np.zeros(model.size), np.array([0.4]), np.array([0.0, 1.0]), -0.05, 0.0, False, "", np.zeros(model.size)
    )
    assert DetachmentLimit.of(replace(model, jacks=jacks)).with_load_factor == pytest.approx(0.1)


def test_laws_of_a_run_in_time_are_those_of_the_joints() -> None:
    """Column by column, the bond and later contacts; two joints, so that they are not interchanged."""
    other = Joint(
        normal_stiffness=5e9,
        shear_stiffness=1.1e9,
        tensile_strength=0.2e6,
        cohesion=0.4e6,
        friction=0.7,
        dilation=0.2,
        residual_cohesion=0.03e6,
        residual_friction=0.35,
        brittle_shear=True,
    )
    worn = replace(SOFT, shear_fracture_energy=200.0)
    wall = Assembly(thickness=0.11, joint=worn)
    for k in range(3):
        wall.add_block(rectangle(0.0, 0.1 * k, 0.3, 0.1 * (k + 1)))
    wall.set_joint(1, 2, other)
    wall.support(0)
    model = wall.build(STIFF)
    laws = body_arrays(model, np.zeros(2)).laws.reshape(-1, 2)
    for i, joint in enumerate((worn, other)):
        k_n, k_s, psi = joint.normal_stiffness, joint.shear_stiffness, joint.dilation
        left = joint.residual_friction
        first, critical, slip = joint.tensile_strength / k_n, 0.0, 0.0
        if joint.fracture_energy is not None:
            critical = 2 * joint.fracture_energy / joint.tensile_strength
            slip = 2 * 200.0 / (joint.cohesion - joint.residual_cohesion)
        strongest = joint.compressive_strength or np.inf
        expected = (
            {"normal_stiffness": k_n, "shear_stiffness": k_s, "shear_compliance": 1 / k_s}
            | {"tensile_strength": joint.tensile_strength, "cohesion": joint.cohesion, "friction": joint.friction}
            | {"slip_compliance": 1 / (k_s + k_n * joint.friction * psi), "residual_tensile_strength": 0.0}
            | {"residual_cohesion": joint.residual_cohesion, "residual_friction": left}
            | {"residual_slip_compliance": 1 / (k_s + k_n * left * psi), "critical_opening": critical}
            | {"dilation": psi, "brittle_shear": float(joint.brittle_shear), "compressive_strength": strongest}
            | {"slip_weight": (critical - first) / slip if slip else 0.0}
        )
        if critical:
            expected["damage_rate"] = 1 / (critical - first)
        if strongest < np.inf:
            expected["cap_compliance"] = 1 / joint.cap_shear
        for name, value in expected.items():
            assert laws[i, 0][name] == pytest.approx(value), name
        bare = {name: 0.0 for name in expected if name not in ("damage_rate", "cap_compliance")}
        bare |= {name: expected[name] for name in ("normal_stiffness", "shear_stiffness", "shear_compliance")}
        bare["compressive_strength"] = strongest
        bare |= dict.fromkeys(("friction", "residual_friction"), left)
        bare |= dict.fromkeys(("slip_compliance", "residual_slip_compliance"), 1 / k_s)
        for name, value in bare.items():
            assert laws[i, 1][name] == pytest.approx(value), name


def test_bare_faces_have_the_law_of_the_block_s_longest_joint() -> None:
    """A base under a long block and a short one beside it: base and long block follow the long bed joint's friction."""
    wall = Assembly(joint=Joint(friction=0.3))
    for left, low, right, top in ((0.0, 0.0, 0.4, 0.1), (0.0, 0.1, 0.3, 0.2), (0.3, 0.1, 0.4, 0.2)):
        wall.add_block(rectangle(left, low, right, top))
    wall.set_joint(0, 1, Joint(friction=0.7))
    wall.support(0)
    made = body_arrays(wall.build(STIFF), np.zeros(2))
    bare = made.points[made.points["status"] == FREE]
    friction = made.laws[bare["law"]]["friction"]
    for body, expected in ((0, 0.7), (1, 0.7), (2, 0.3)):
        assert friction[bare["body"] == body] == pytest.approx(expected)


def test_a_partly_fixed_block_without_mass_is_refused() -> None:
    wall = Assembly()
    wall.support(wall.add_block(rectangle(0.0, 0.0, 1.0, 0.1)))
    light = wall.add_block(rectangle(0.0, 0.1, 1.0, 0.2), BlockMaterial(density=0.0))
    wall.support(light, x=True, y=False, rotation=False)
    with pytest.raises(InputError, match=r"block 1 .*no mass"):
        motion_of(wall.build(STIFF), np.zeros(2))


def test_slip_that_breaks_a_softened_bond_releases_the_rest() -> None:
    """Opened to between u_0 and w_c while sheared; the remaining energy of the bond is released."""
    joint = replace(
        SOFT, brittle_shear=True, compressive_strength=None, residual_cohesion=0.0, residual_friction=None, cohesion=2e5
    )
    model = drawn_pair(joint, x=0.3e-3, y=0.16e-3, rotation=0.0)
    path: list[Increment] = list(solve_path(model, ONE_STEP, 300))
    sheared = [np.abs(step.shear_stress).max() > 0 for step in path[1:]]
    breaks = sheared.index(False)  # the last increment before it breaks
    taken = [softening_work(model, path[: k + 1]) for k in (breaks, breaks + 1)]
    area = 0.3 * 0.11
    assert 0.1 * 9.0 * area < taken[0] < 0.8 * 9.0 * area
    assert path[breaks].energy.fracture_work == pytest.approx(taken[0], rel=1e-9)
    for step in path[breaks + 1 :]:
        assert taken[0] <= step.energy.fracture_work <= taken[1]
        assert step.energy.released_energy == path[-1].energy.released_energy
    held = path[breaks].energy.elastic_energy
    assert path[-1].energy.released_energy == pytest.approx(held, rel=0.05)
