"""Walls with control joints: compared with separate walls, mirrored, with both solvers, and closing."""

from dataclasses import replace

import numpy as np
import pytest

import damagepred
from damagepred.assembly import Model, wall_geometry, wall_model
from damagepred.assembly.interfaces import ground_movement
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.one_wall.judged_path import follow
from damagepred.scene import ControlJoint, Damage, Dpc, Dynamics, Joint, Loads, Movement, Opening, Scene, Solver, Wall

LENGTH, HEAVY = 2.4, Loads(roof=20e3)
QUASI_STATIC = Solver(blocks="rigid")
EXPLICIT = Solver(blocks="rigid", method="explicit", tolerance=1e-3)
STRONG, UNBROKEN = Joint(), Joint(tensile_strength=5e6, cohesion=5e6)
WEAK = Joint(tensile_strength=0.02e6, cohesion=0.05e6)
WAYS = {"quasi_static": QUASI_STATIC, "explicit": EXPLICIT, "deformable": Solver(blocks="deformable", zone_size=0.12)}


def scene(*joints: float, kind: str = "doming", width: float = 0.01, **more: object) -> Scene:
    """Wall of 2.4 x 0.9 m with control joints."""
    usual: dict[str, object] = {
        "wall": Wall(length=LENGTH, height=0.9),
        "control_joint": tuple(ControlJoint(x=x, width=width) for x in joints),
        "movement": Movement(kind=kind, central_deflection=4e-3, increments=4, shape="parabola"),
        "loads": Loads(roof=2000.0),
        "solver": QUASI_STATIC,
    }
    return Scene(**usual | more)


def last_step(model: Model, solver: Solver, increments: int = 4):
    return list(follow(model, solver, Damage(), increments))[-1]


def part_of(whole: Scene, left: float, right: float) -> Model:
    """Return the model of a wall as long as a part of another, on that part's profile, with its share of the roof."""
    length = right - left
    loads = Loads(roof=whole.loads.roof * length / whole.wall.length)
    wall = replace(whole.wall, length=length)
    alone = replace(whole, wall=wall, control_joint=(), loads=loads)
    ground = ground_movement(wall_geometry(alone), lambda x, _: whole.movement.profile(x + left, whole.wall.length))
    return replace(wall_model(alone), ground=ground)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("kind", ["doming", "dishing"])
def test_a_wall_with_a_joint_at_mid_length_is_two_walls(way: str, kind: str):
    """Each half is solved as a separate wall, on its half of the profile."""
    solver = WAYS[way]
    # brittle cracks depend on the order of breaks, and so on the explicit solver's motion: none with it
    joint = UNBROKEN if way == "explicit" else WEAK
    without_mirror = replace(solver, symmetric_half=False)
    whole = scene(LENGTH / 2, kind=kind, solver=without_mirror, joint=joint, loads=HEAVY)
    model = wall_model(whole)
    together = last_step(model, whole.solver)
    bricks = model.blocks.x
    for left, right in ((0.0, LENGTH / 2), (LENGTH / 2, LENGTH)):
        alone = last_step(part_of(whole, left, right), solver)
        ours = together.increment.displacement[(bricks > left) & (bricks < right)]
        near = 4e-6 if way == "explicit" else 1e-9
        np.testing.assert_allclose(ours, alone.increment.displacement, atol=near)
        assert together.verdict.crack_width_max == pytest.approx(alone.verdict.crack_width_max, abs=near)
        if joint is WEAK and kind == "dishing":
            assert alone.verdict.crack_width_max > 0.03e-3


@pytest.mark.parametrize("kind", ["doming", "dishing"])
def test_mirrored_walls_have_mirrored_results(kind: str):
    here, there = (damagepred.solve(scene(x, kind=kind, dpc=Dpc())) for x in (0.84, LENGTH - 0.84))
    for name in ("crack_width_max", "dpc_opening_max", "control_joint_opening_max", "control_joint_closing_max"):
        np.testing.assert_allclose(here[name], there[name], rtol=1e-6, atol=1e-9)
    order = [
        np.lexsort((np.round(sign * ds.block_x.values, 6), np.round(ds.block_y.values, 6)))
        for ds, sign in ((here, 1.0), (there, -1.0))
    ]
    moved = [ds.block_displacement_y.values[-1][at] for ds, at in zip((here, there), order, strict=True)]
    np.testing.assert_allclose(*moved, atol=1e-9)


def test_condensed_and_full_systems_agree():
    described = scene(0.96, 1.68, kind="dishing", width=0.2e-3, dpc=Dpc())
    quick, slow = (damagepred.solve(described, solver=Solver(blocks="rigid", condense=yes)) for yes in (True, False))
    for name in ("dpc_opening_max", "control_joint_opening_max", "control_joint_closing_max"):
        np.testing.assert_allclose(quick[name], slow[name], rtol=1e-3, atol=1e-7)
    assert quick.control_joint_closing_max[-1] > 0.2e-3


@pytest.mark.parametrize("kind", ["doming", "dishing"])
def test_both_solvers_agree_on_a_dpc(kind: str):
    """Without cracks. How far panels slide depends on the path: the joint's opening is compared without their slip."""
    described = scene(LENGTH / 2, kind=kind, width=1e-3, dpc=Dpc(), joint=UNBROKEN)
    quasi_static, explicit = (damagepred.solve(described, solver=solver) for solver in (QUASI_STATIC, EXPLICIT))
    for ds in (quasi_static, explicit):
        ds["opening_by_rotation"] = ds["control_joint_opening_max"] - 2.0 * ds["dpc_slip_max"]
    names = ["dpc_opening_max", *(["opening_by_rotation"] if kind == "doming" else ["control_joint_closing_max"])]
    for name in names:
        np.testing.assert_allclose(quasi_static[name].values, explicit[name].values, rtol=0.01, atol=1e-5)
        assert quasi_static[name].values[-1] > 0.9e-3


def pushed(solver: Solver, width: float, by: float) -> float:
    """Return the pressure (Pa) in the control joint between two bricks, one of which is pushed towards the other."""
    described = Scene(
        wall=Wall(length=0.48, height=0.075),
        control_joint=(ControlJoint(x=0.24, width=width),),
        movement=Movement(central_deflection=0.0, increments=2),
        solver=replace(solver, lump_block_elasticity=False),
    )
    model = wall_model(described)
    dofs = np.arange(6)
    moved = np.where(dofs == 3, -by, 0.0)
    supports = model.supports._replace(
        prescribed=dofs, prescribed_displacement=moved, start=np.zeros(6), after_load=np.zeros(6, dtype=bool)
    )
    step = last_step(replace(model, supports=supports), described.solver, 2)
    return -float(step.increment.normal_stress[model.interfaces.kind == ContactKind.CONTROL_JOINT].mean())


@pytest.mark.parametrize("solver", [QUASI_STATIC, EXPLICIT], ids=["quasi_static", "explicit"])
@pytest.mark.parametrize(("width", "by"), [(1e-3, 0.9e-3), (1e-3, 1.01e-3), (0.0, 0.01e-3), (0.0, -0.1e-3)])
def test_pressure_begins_where_the_gap_is_closed(solver: Solver, width: float, by: float):
    """sigma = -k_n (closing - gap)."""
    assert pushed(solver, width, by) == pytest.approx(STRONG.normal_stiffness * max(by - width, 0.0), abs=1.0)


def test_a_control_joint_is_no_crack():
    """Two strong panels on a dpc separate by millimetres, without damage."""
    ds = damagepred.solve(scene(LENGTH / 2, dpc=Dpc()))
    assert ds.control_joint_opening_max[-1] > 2e-3
    assert ds.crack_width_max[-1] == 0.0
    assert ds.damage_category[-1] == 0
    at_joint = ds.contact_kind == ContactKind.CONTROL_JOINT
    assert at_joint.sum() > 0
    assert (ds.contact_state.values[:, at_joint] == 0).all()
    np.testing.assert_allclose(ds.contact_normal_stress.values[:, at_joint], 0.0)
    np.testing.assert_allclose(ds.contact_shear_stress.values[:, at_joint], 0.0)
    opened = ds.contact_opening.values[:, at_joint].max(axis=1)
    np.testing.assert_allclose(ds.control_joint_opening_max, np.maximum(opened, 0.0))


def test_runs_in_time_have_none():
    with pytest.raises((InputError, ValueError), match="control_joint"):
        damagepred.solve(scene(LENGTH / 2), dynamics=Dynamics(duration=1.0))


def test_beside_a_window_that_reaches_the_top():
    """A joint on the line of a jamb separates the wall below the sill, and the window's width changes with it."""
    window = Opening(x=0.96, y=0.45, width=0.48, height=0.45)
    described = scene(0.96, opening=(window,), dpc=Dpc())
    ds = damagepred.solve(described)
    at_joint = ds.contact_kind.values == ContactKind.CONTROL_JOINT
    assert ds.contact_y.values[at_joint].max() < 0.45
    assert ds.control_joint_opening_max[-1] > 1e-4


def test_a_joint_that_closes_at_one_end_only_is_found_by_the_condensed_wall():
    """The upper contacts close while the lower ones are still apart: condensed or not, the path is the same."""
    tall = Scene(
        wall=Wall(length=0.93, height=0.63, thickness=0.104, block_length=0.31, block_height=0.21),
        control_joint=(ControlJoint(x=0.402, width=0.3324e-3),),
        joint=Joint(
            normal_stiffness=302e9, shear_stiffness=117.2e9, tensile_strength=45.33e3, cohesion=30.1e3, friction=0.4585
        ),
        movement=Movement(kind="dishing", central_deflection=2.8656e-3, increments=16, shape="parabola"),
        loads=Loads(roof=5e3),
    )
    condensed, whole = (
        damagepred.solve(tall, solver=Solver(condense=c, lump_block_elasticity=False)) for c in (True, False)
    )
    closed = condensed["contact_normal_stress"].values[:, condensed["contact_kind"] == ContactKind.CONTROL_JOINT] < 0
    assert (closed.any(axis=1) & ~closed.all(axis=1)).any()
    for name in ("block_displacement_x", "block_displacement_y"):
        np.testing.assert_allclose(condensed[name], whole[name], atol=1e-7)
    np.testing.assert_allclose(condensed["external_work"], whole["external_work"], rtol=1e-3)
