"""Loads on top, at a height and on a lintel, against equilibrium, statics and the roof's load."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from damagepred import InputError, Joint, Loads, Movement, Scene, Solver, Study, Wall, assembly, open_study
from damagepred.scene import Load, Opening
from damagepred.solvers import solve_path

DRY = Joint(tensile_strength=0.0, cohesion=0.0, friction=5.0)
STILL = Movement(shape="parabola", central_deflection=0.0, increments=1)
WALL = Scene(
    wall=Wall(length=2.4, height=1.2, thickness=0.11, block_length=0.24, block_height=0.075),
    opening=(Opening(kind="door", x=0.96, width=0.48, height=0.6),),
    movement=STILL,
    load=(
        Load(name="floor", line_load="8 kN/m", y=0.9),
        Load(name="people", kind="live", pressure="2 kPa", breadth=1.8, combination=0.4, y=0.9),
        Load(name="beam", force="5 kN", at=0.5),
        Load(force="1 kN", start=1.2, end=1.8),
    ),
)


def bed_forces(model: assembly.Model, step: object, block: int | None = None) -> tuple[np.ndarray, ...]:
    """Pressing force (N), place (m) and area of each contact of a block, of the ground by default."""
    faces, block = model.interfaces, model.n_blocks if block is None else block
    on = (faces.block_a == block) | (faces.block_b == block)
    force = -(step.normal_stress * faces.contact_area)[on]
    return force, faces.x[on, None] + faces.normal_y[on, None] * faces.contact_offset[on], faces.contact_area[on]


def loaded(scene: Scene) -> tuple[assembly.Model, object]:
    model = assembly.wall_model(scene)
    return model, list(solve_path(model, scene.solver, 1))[-1]


@pytest.mark.parametrize("blocks", ["rigid", "elastic", "deformable"])
def test_the_ground_carries_weight_and_loads(blocks: str) -> None:
    """Reactions are the weight and the loads, and have their moment about the left end."""
    model, step = loaded(Scene.from_dict({**WALL.to_dict(), "solver": {"blocks": blocks}}))
    force, x, _ = bed_forces(model, step)
    bricks = 9.81 * 2000.0 * 0.11
    pressures = 2.4 * (8000.0 + 0.4 * 2000.0 * 1.8)
    total = bricks * (2.4 * 1.2 - 0.48 * 0.6) + pressures + 5000.0 + 1000.0
    moment = bricks * (2.4 * 1.2 - 0.48 * 0.6) * 1.2 + pressures * 1.2 + 5000.0 * 0.5 + 1000.0 * 1.5
    near = 1e-7 if blocks == "deformable" else 1e-9
    assert step.base_reaction == pytest.approx(total, rel=near)
    assert force.sum() == pytest.approx(total, rel=near)
    assert (force * x).sum() == pytest.approx(moment, rel=1e-7)


@pytest.mark.parametrize(
    "load",
    [
        Load(force="12 kN"),
        Load(line_load="5 kN/m"),
        Load(kind="live", pressure="5 kPa", breadth=2.0, combination=0.5, start=0.0, end=2.4),
        Load(name="top", force="12 kN", y=1.2),
    ],
)
def test_a_load_along_the_top_is_the_roof_s(load: Load) -> None:
    roof = assembly.wall_model(replace(WALL, load=(), loads=Loads(roof="12 kN")))
    found = assembly.wall_model(replace(WALL, load=(load,)))
    np.testing.assert_allclose(found.supports.load, roof.supports.load, rtol=1e-14, atol=0.0)
    assert roof.supports.load.reshape(-1, 3)[:, 1].sum() == pytest.approx(
        -12000.0 - 9.81 * 2000.0 * 0.11 * (2.4 * 1.2 - 0.48 * 0.6), rel=1e-12
    )


@pytest.mark.parametrize("at", [0.08, 0.13, 0.1])
def test_a_point_load_on_a_pier_presses_its_base_linearly(at: float) -> None:
    """Pressure P / A (1 +- 6 e / b) at the edges: no tension in the middle third."""
    wide, force = 0.24, 4000.0
    wall = Wall(length=wide, height=0.75, thickness=0.11, block_length=wide, block_height=0.075, bond="stack")
    joint = replace(DRY, normal_stiffness=1e12, shear_stiffness=1e12)
    solver = Solver(blocks="rigid")
    pier = Scene(wall=wall, joint=joint, movement=STILL, load=(Load(force=force, at=at),), solver=solver)
    pressed, x, area = bed_forces(*loaded(pier))
    pressure = pressed / area
    weight = 9.81 * 2000.0 * wide * 0.75 * 0.11
    expected = ((force + weight) + force * (at - wide / 2) * 12 / wide**2 * (x - wide / 2)) / (wide * 0.11)
    np.testing.assert_allclose(pressure, expected, rtol=1e-6)


def test_a_load_on_a_lintel_goes_to_its_bearings_by_statics() -> None:
    """A lintel on two piers: both carry load and moment, and each the share of a simply supported beam."""
    portal = Scene(
        wall=Wall(length=0.96, height=0.675, thickness=0.11, block_length=0.24, block_height=0.075),
        opening=(Opening(kind="door", x=0.12, width=0.72, height=0.6, lintel_bearing=0.12),),
        joint=replace(DRY, normal_stiffness=1e13, shear_stiffness=1e13),
        movement=STILL,
        solver=Solver(blocks="rigid", lump_block_elasticity=False),
        load=(Load(force="6 kN", at=0.3, y=0.675),),
    )
    model, step = loaded(portal)
    beam = int(np.argmax(model.blocks.y))
    assert model.blocks.area[beam] == pytest.approx(0.96 * 0.075)
    force, x, _ = bed_forces(model, step, beam)
    weight = 9.81 * 2000.0 * 0.11 * 0.96 * 0.075
    assert force.sum() == pytest.approx(6000.0 + weight, rel=1e-7)
    assert (force * x).sum() == pytest.approx(6000.0 * 0.3 + weight * 0.48, rel=1e-7)
    # the span is 0.84 m between the middles of the bearings
    assert force[x < 0.48].sum() == pytest.approx(6000.0 * (0.9 - 0.3) / 0.84 + weight / 2, rel=0.02)


def test_loads_on_the_middle_of_a_door_go_to_both_piers_alike() -> None:
    found = {}
    for name, load in {"point": Load(force="6 kN", at=1.2), "mirrored": Load(force="6 kN", at=0.5)}.items():
        force, x, _ = bed_forces(*loaded(replace(WALL, load=(load,))))
        found[name] = force[x < 1.2].sum() / force.sum()
    assert found["point"] == pytest.approx(0.5, abs=1e-9)
    assert found["mirrored"] > 0.6


def test_a_study_varies_a_load_by_its_name(tmp_path: Path) -> None:
    """A floor of a second storey bears at its level, and ground moves under it; the load widens nothing at once."""
    text = """
    [study]
    samples = 4
    sampler = "lhs"
    [scene]
    wall = { length = 1.2, height = 0.6 }
    load = [{ name = "floor", line_load = "4 kN/m", y = 0.3 }, { force = "1 kN", at = 0.3 }]
    movement = { central_deflection = 1e-3, increments = 2 }
    [variables]
    "load.floor.line_load" = { distribution = "uniform", lower = "2 kN/m", upper = "6 kN/m" }
    "load.2.at" = { distribution = "uniform", lower = "0.2 m", upper = "0.4 m" }
    """
    file = tmp_path / "study.toml"
    file.write_text(text, encoding="utf-8")
    Study.from_toml(file).run(tmp_path / "out.dp", workers=1)
    study_scene = Scene.from_dict(tomllib.loads(text)["scene"])
    study = open_study(tmp_path / "out.dp")
    load, at = study["load.floor.line_load"].values, study["load.2.at"].values
    assert np.all((load > 2000.0) & (load < 6000.0))
    assert len(set(at)) == 4
    weight = 9.81 * 2000.0 * 1.2 * 0.6 * 0.11
    for row in range(4):
        one = study_scene.with_values({"load.floor.line_load": load[row], "load.2.at": at[row]})
        model = assembly.wall_model(one)
        assert model.supports.load.reshape(-1, 3)[:, 1].sum() == pytest.approx(-weight - 1.2 * load[row] - 1000.0)


@pytest.mark.parametrize(
    ("load", "words"),
    [
        ({"force": -1.0}, "greater than or equal to 0|at least 0"),
        (
            {"line_load": 1e3, "start": 1.0, "end": 3.0},
            "load 1: reaches from 1 to 3 m, beyond the wall's length of 2.4 m",
        ),
        ({"force": 1e3, "at": 2.5}, "beyond the wall's length"),
        ({"force": 1e3, "y": 1.3}, "y = 1.3 m is above the wall, whose height is 1.2 m"),
        ({"force": 1e3, "at": 1.2, "y": 0.3}, r"over opening 1, .* take y = 0\.675 m, above its lintel"),
        ({"line_load": 1e3, "y": 0.6}, "over opening 1"),
        ({"line_load": 1e3, "at": 1.2}, "at a point give force"),
        ({"force": 1e3, "line_load": 1e3}, "both give the size"),
        ({"pressure": 1e3}, "breadth: is missing"),
        ({"force": 1e3, "combination": 0.4}, "kind = 'live'"),
        ({"force": 1e3, "at": 1.0, "start": 0.2}, "contradict"),
        ({"force": 1e3, "start": 1.0, "end": 0.2}, "must be beyond start"),
        ({"force": 1e3, "side": "left", "y": 0.6}, "give at, the height on the side"),
        ({"at": 1.0}, "load 1: has no size; give force, line_load, or pressure and breadth"),
        ({"at": 1.0, "width": 0.2}, "load 1: has no size; give force, line_load, or pressure and breadth"),
        ({"force": 1e3, "name": "at"}, "no key of the load, such as 'floor'"),
    ],
)
def test_loads_that_no_wall_carries_are_refused(load: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        Scene.from_dict({**WALL.to_dict(), "load": [load]})


def test_two_loads_of_one_name_and_loads_over_open_tops_are_refused() -> None:
    with pytest.raises(InputError, match="load: two loads have the name 'floor'; give each its own"):
        replace(WALL, load=(WALL.load[0], WALL.load[0]))
    window = Opening(x=0.96, y=0.6, width=0.48, height=0.6)
    with pytest.raises(InputError, match=r"load 1: is at a height of 1\.2 m over opening 1"):
        replace(WALL, opening=(window,), load=(Load(line_load=1e3),))
    beside = replace(WALL, opening=(window,), load=(Load(line_load=1e3, end=0.96), Load(line_load=1e3, start=1.44)))
    assert assembly.wall_model(beside).n_blocks > 0


def test_a_floor_stays_while_the_ground_moves() -> None:
    """The load acts from increment 0 on, and the reaction is the same at every increment."""
    moving = replace(WALL, movement=Movement(shape="parabola", central_deflection=1e-3, increments=3))
    model = assembly.wall_model(moving)
    reactions = [step.base_reaction for step in solve_path(model, moving.solver, 3)]
    assert reactions == pytest.approx([reactions[0]] * len(reactions), rel=1e-7)
