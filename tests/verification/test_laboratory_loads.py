"""Laboratory tests in a scene file, against closed forms: columns, statics, rocking, and one path by three controls."""

from dataclasses import replace

import numpy as np
import pytest

from damagepred import InputError, Joint, Loads, Movement, Scene, Solver, Wall, assembly, scene, solve
from damagepred.scene import BlockMaterial, Load, Loading, Support
from damagepred.solvers import solve_path

DRY = Joint(tensile_strength=0.0, cohesion=0.0, friction=5.0)
BEAM = Scene(
    wall=Wall(length=1.32, height=0.54, thickness=0.1, block_length=0.22, block_height=0.06),
    joint=Joint(tensile_strength=0.2e6, cohesion=0.4e6, fracture_energy=20.0, shear_fracture_energy=200.0),
    movement=Movement(shape="loads", increments=8),
    support=(Support(x=0.45, width=0.06), Support(x=0.87, width=0.06)),
    load=(Load(at=0.24, width=0.06), Load(at=1.08, width=0.06)),
    loading=Loading(control="opening", opening="40 um", gauge=((0.34, 0.5), (0.98, 0.5))),
)


def controlled(wall: Scene, **loading: object) -> Scene:
    return replace(wall, loading=Loading(**loading))


@pytest.mark.parametrize("blocks", ["rigid", "elastic"])
def test_a_column_shortens_by_its_joints_and_bricks(blocks: str) -> None:
    """Force over displacement is the stiffness of bed joints and bricks in series."""
    courses, h, area = 6, 0.1, 0.3 * 0.11
    column = Scene(
        wall=Wall(length=0.3, height=courses * h, block_length=0.3, block_height=h, bond="stack"),
        block=BlockMaterial(poisson_ratio=0.0),
        movement=Movement(shape="loads", increments=2),
        load=(Load(),),
        loading=Loading(control="displacement", displacement="20 um"),
        solver=Solver(blocks=blocks),
    )
    found = solve(column)
    law, modulus = column.joint, column.block.elastic_modulus
    # displacement is that of the top brick's middle
    flexibility = (courses / law.normal_stiffness + (courses - 0.5) * h / modulus) / area
    assert found["load_displacement"].values == pytest.approx([0.0, 10e-6, 20e-6], rel=1e-6)
    assert found["load_force"].values == pytest.approx(np.array([0.0, 10e-6, 20e-6]) / flexibility, rel=1e-6)


def test_supports_carry_the_load_and_the_weight() -> None:
    """Two strips carry what presses on the wall, unequal loads by the law of the lever."""
    beam = replace(
        controlled(BEAM, control="force", force="4 kN"),
        load=(Load(at=0.24, width=0.06, share=1.0), Load(at=0.88, width=0.06, share=3.0)),
    )
    model, last = assembly.wall_model(beam), list(solve_path(assembly.wall_model(beam), beam.solver, 4))[-1]
    faces = model.interfaces
    on_ground = faces.block_a == model.n_blocks
    force = -(last.normal_stress * faces.contact_area)[on_ground]
    x = faces.x[on_ground, None] + faces.normal_y[on_ground, None] * faces.contact_offset[on_ground]
    weight = 9.81 * float(model.mass.sum())
    assert force.sum() == pytest.approx(4000.0 + weight, rel=1e-6)
    assert (force * x).sum() == pytest.approx(1000.0 * 0.24 + 3000.0 * 0.88 + weight * 0.66, rel=1e-6)


def test_three_controls_follow_one_path() -> None:
    """A point of the path under one control is a point of it under another."""
    by_gauge = solve(BEAM)
    force, moved, gauge = (float(by_gauge[k][-1]) for k in ("load_force", "load_displacement", "gauge_opening"))
    assert gauge == pytest.approx(40e-6, rel=1e-6)
    points = {"gauge": BEAM.loading.gauge}
    for same in (
        controlled(BEAM, control="force", force=force, **points),
        controlled(BEAM, control="displacement", displacement=moved, **points),
    ):
        found = solve(same)
        assert found["load_force"].values[-1] == pytest.approx(force, rel=1e-3)
        assert found["load_displacement"].values[-1] == pytest.approx(moved, rel=1e-3)
        assert found["gauge_opening"].values[-1] == pytest.approx(gauge, rel=1e-3)


@pytest.mark.parametrize("control", ["force", "displacement"])
def test_a_dry_pier_rocks_at_its_overturning_moment(control: str) -> None:
    """A stiff dry pier pushed along its top turns over its toe: F H = W b / 2."""
    wide, high = 0.4, 1.2
    stiff = replace(DRY, normal_stiffness=1e14, shear_stiffness=1e14)
    pier = Scene(
        wall=Wall(length=wide, height=high, thickness=0.11, block_length=wide, block_height=0.2, bond="stack"),
        joint=stiff,
        movement=Movement(shape="loads", increments=10),
        load=(Load(direction="along"),),
        loading=Loading(control="force", force="1 kN"),
        solver=Solver(lump_block_elasticity=False),
    )
    overturns = 2000.0 * 9.81 * wide * high * 0.11 * wide / (2.0 * high)
    if control == "force":
        found = solve(pier)
        assert found.attrs["status"] == "collapsed"
        assert found["load_force"].values[-1] == pytest.approx(overturns, rel=1e-3)
    else:
        found = solve(controlled(pier, control="displacement", displacement="2 mm"))
        assert found["load_force"].values[1:] == pytest.approx(overturns, rel=1e-3)
        assert found["load_displacement"].values[-1] == pytest.approx(2e-3)


@pytest.mark.parametrize(("beam", "held_at_the_top"), [("free", 3.0), ("level", 12.0)])
def test_a_shear_wall_is_as_stiff_as_timoshenkos_beam(beam: str, held_at_the_top: float) -> None:
    """Bending and shear of a wall of homogenised stiffness: H^3 / (3 or 12 E I) + H / (kappa G A)."""
    length, high, thick = 1.5, 2.5, 0.1
    stiff = Scene(
        wall=Wall(length=length, height=high, thickness=thick, block_length=0.5, block_height=0.1),
        joint=Joint(tensile_strength=1e9, cohesion=1e9),
        movement=Movement(shape="loads", increments=1),
        load=(Load(direction="along"),),
        loading=Loading(control="force", force="1 kN", beam=beam),
        loads=Loads(roof="20 kN"),
    )
    found = solve(stiff)
    law, brick = stiff.joint, stiff.block
    # beds and bricks in series; head joints have no say in upright bending, and little in shear
    upright = 1.0 / (1.0 / (law.normal_stiffness * 0.1) + 1.0 / brick.elastic_modulus)
    shear = 1.0 / (1.0 / (law.shear_stiffness * 0.1) + 1.0 / brick.shear_modulus)
    second = thick * length**3 / 12.0
    flexible = high**3 / (held_at_the_top * upright * second) + high * 1.2 / (shear * thick * length)
    assert found["load_displacement"].values[-1] == pytest.approx(1000.0 * flexible, rel=0.06)
    turned = found["block_rotation"].values[-1, -1]
    assert abs(turned) < 1e-12 if beam == "level" else turned < -1e-7


def test_the_beam_takes_the_roof() -> None:
    """Under a level beam the roof presses on all bricks alike, and the ground carries it."""
    pier = Scene(
        wall=Wall(length=0.6, height=0.6),
        movement=Movement(shape="loads", increments=1),
        load=(Load(direction="along"),),
        loading=Loading(control="force", force="1 N", beam="level"),
        loads=Loads(roof="20 kN"),
    )
    model = assembly.wall_model(pier)
    weight = 9.81 * float((model.mass).sum())
    assert solve(pier)["base_reaction"].values == pytest.approx(20e3 + weight, rel=1e-6)
    assert weight == pytest.approx(2000.0 * 9.81 * 0.6 * 0.6 * 0.11, rel=1e-9)


def test_a_clamped_beam_keeps_its_height() -> None:
    """Pushed along, a dry wall rocks and lifts a level beam; a clamped one stays, and more is carried."""
    dry = Scene(
        wall=Wall(length=0.6, height=0.9),
        joint=Joint(tensile_strength=0.0, cohesion=0.0, friction=0.75),
        movement=Movement(shape="loads", increments=4),
        load=(Load(direction="along"),),
        loads=Loads(roof="10 kN"),
        loading=Loading(control="displacement", displacement="2 mm", beam="level"),
    )
    level, clamped = (solve(replace(dry, loading=replace(dry.loading, beam=beam))) for beam in ("level", "clamped"))
    rise = [(y := ds["block_displacement_y"].values[:, -1]) - y[0] for ds in (level, clamped)]
    assert rise[0][-1] > 1e-5
    assert np.abs(rise[1]).max() < 1e-12
    assert clamped["load_force"].values[-1] > 1.1 * level["load_force"].values[-1]


def test_a_load_beside_the_wall_is_measured_in_its_direction() -> None:
    """A load that presses from the left moves the wall to the right, and its displacement is positive."""
    pier = Scene(
        wall=Wall(length=0.48, height=0.6),
        movement=Movement(shape="loads", increments=1),
        load=(Load(side="left", at="0.5 m", width="0.1 m"),),
        loading=Loading(control="force", force="100 N"),
    )
    found = solve(pier)
    assert found["load_displacement"].values[-1] > 0.0
    assert (found["block_displacement_x"].values[-1] >= 0.0).all()


def test_the_path_ends_where_the_load_has_fallen_to_nothing() -> None:
    """A bed without friction carries its cohesion, and nothing once it has broken."""
    length, cohesion = 1.2, 0.05e6
    sheared = Scene(
        wall=Wall(length=length, height=0.24, block_length=0.4, block_height=0.24),
        joint=Joint(cohesion=cohesion, friction=0.0, brittle_shear=True),
        movement=Movement(shape="loads", increments=10),
        load=(Load(direction="along"),),
        loading=Loading(control="displacement", displacement="20 um"),
    )
    found = solve(sheared)
    load = found["load_force"].values
    assert found.attrs["limit"] == "loads"
    assert 0.5 * cohesion < load.max() / (length * 0.11) < cohesion
    assert abs(load[-1]) < 1e-6 * load.max()


@pytest.mark.thorough
def test_a_softening_beam_is_followed_beyond_its_peak() -> None:
    """Under a given displacement the load falls gradually where bonds soften, and the energy balances."""
    sagging = replace(
        BEAM,
        movement=Movement(shape="loads", increments=40),
        support=(Support(x=0.1, width=0.06), Support(x=1.22, width=0.06)),
        load=(Load(at=0.44, width=0.06), Load(at=0.88, width=0.06)),
        loading=Loading(control="displacement", displacement="1.6 mm"),
    )
    found = solve(sagging)
    load = found["load_force"].values
    peak = int(load.argmax())
    assert found.attrs["status"] == "complete"
    assert 5 < peak < 30
    assert load[-1] < 0.6 * load[peak]
    assert (np.abs(np.diff(load)) < 0.2 * load[peak]).all()
    assert abs(found["energy_error"].values[-1]) < 0.01 * found["external_work"].values[-1]


def test_a_wall_in_motion_has_no_load() -> None:
    """A wall that falls apart leaves the load of its last increment out."""
    brittle = replace(BEAM, joint=Joint(tensile_strength=0.1e6, cohesion=0.05e6, friction=0.5, brittle_shear=True))
    found = solve(replace(brittle, loading=replace(BEAM.loading, opening="30 mm"), solver=Solver(blocks="rigid")))
    assert found.attrs["status"] == "collapsed"
    assert np.isnan(found["load_force"].values[-1])
    assert found["load_force"].values[-2] > 0.0
    assert np.isfinite(found["load_force"].values[:-1]).all()


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"loading": None}, "loading: is missing"),
        ({"load": ()}, "load: is missing"),
        ({"support": (Support(x=0.66, width=0.06),)}, "one narrow strip"),
        ({"support": (Support(x=0.01, width=0.06), Support(x=0.8, width=0.06))}, "support 1: reaches from -0.02"),
        ({"load": (Load(at=1.31, width=0.06),)}, "load 1: reaches"),
        ({"movement": Movement(shape="parabola")}, "has no size; give force, line_load, or pressure"),
        ({"solver": Solver(method="explicit")}, "explicit solver takes 'force'"),
    ],
)
def test_wrong_tests_are_refused(wrong: dict[str, object], said: str) -> None:
    """What cannot be tested is said in one sentence."""
    with pytest.raises(InputError, match=said):
        replace(BEAM, **wrong)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"control": "force"}, "force: is missing"),
        ({"control": "force", "force": 1e3, "opening": 1e-3}, "opening: is only read"),
        ({"control": "opening", "opening": 1e-3}, "gauge: is missing"),
        ({"control": "force", "force": 1e3, "gauge": ((0.1, 0.1),)}, "has 1 points"),
        ({"control": "force", "force": 1e3, "gauge": ((0.1, 0.1), (0.1, 0.1))}, "are the same"),
    ],
)
def test_wrong_controls_are_refused(wrong: dict[str, object], said: str) -> None:
    """What is controlled is given, and nothing else."""
    with pytest.raises(InputError, match=said):
        Loading(**wrong)


def test_a_gauge_opens_by_no_motion_of_the_rigid_wall() -> None:
    """Zero as the wall shifts or turns about the origin; a unit shift of one end counts by the slope of the gauge."""
    ends = ((0.35, 0.2), (0.96, 0.51))
    model = assembly.wall_model(controlled(BEAM, control="opening", opening=1e-5, gauge=ends))
    x, y, one = model.blocks.x, model.blocks.y, np.ones(model.n_blocks)
    motions = np.array([(one, 0 * x, 0 * x), (0 * x, one, 0 * x), (-y, x, one)]).swapaxes(1, 2).reshape(3, -1)
    assert motions @ model.test.gauge == pytest.approx(np.zeros(3), abs=1e-12)
    along = np.clip(model.test.gauge[::3], 0.0, None).sum()
    assert along == pytest.approx(0.61 / np.hypot(0.61, 0.31))


def test_a_gauge_beside_the_wall_is_refused() -> None:
    """A gauge is on bricks."""
    far = controlled(BEAM, control="opening", opening=1e-5, gauge=((0.2, 0.5), (2.0, 0.5)))
    with pytest.raises(InputError, match="no brick at x = 2 m"):
        assembly.wall_model(far)


def test_zones_take_loads_but_no_control_of_displacement() -> None:
    """A wall of zones is loaded by force."""
    zones = replace(BEAM, solver=Solver(blocks="deformable"))
    with pytest.raises(InputError, match="zones take control = 'force'"):
        assembly.wall_model(zones)
    rigid = solve(controlled(BEAM, control="force", force="2 kN"), increments=1)
    elastic = solve(controlled(zones, control="force", force="2 kN"), increments=1)
    assert elastic["load_displacement"].values[-1] == pytest.approx(rigid["load_displacement"].values[-1], rel=0.3)


def test_a_material_that_varies_gives_a_distribution_of_strengths() -> None:
    """A scene of a test survives its TOML, as a study writes it."""
    again = Scene.from_dict(BEAM.to_dict())
    assert again == BEAM
    assert scene.Load(at="1 m", width="50 mm").width == 0.05
