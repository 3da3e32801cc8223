"""Bricks that stretch and bend (``[solver] blocks = "elastic"``)."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from damagepred import Assembly, BlockMaterial, Dynamics, InputError, Joint, Scene, Solver, solve
from damagepred.assembly.assembly import rectangle
from damagepred.enumerations import ContactKind
from damagepred.one_wall.judged_path import dynamic_run
from damagepred.solvers import solve_path

E, B, H, T = 9e9, 0.24, 0.075, 0.11
PLATE = 0.1  # length of a plate, half of which is lumped into the joint on either side


def scene(**tables: dict[str, Any]) -> Scene:
    base: dict[str, dict[str, Any]] = {
        "wall": {"length": 1.92, "height": 0.75},
        "dpc": {"course": 1},
        "joint": {"tensile_strength": 0.2e6, "cohesion": 0.3e6},
        "movement": {"kind": "dishing", "central_deflection": 2e-3, "increments": 4},
        "solver": {"blocks": "elastic"},
    }
    return Scene.from_dict({name: base.get(name, {}) | tables.get(name, {}) for name in base | tables})


def strip(angle: float = 0.0, **joint: float) -> tuple[Assembly, list[int]]:
    """One elastic brick between two held plates, turned by an angle."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    wall = Assembly(
        thickness=T,
        gravity=(0.0, 0.0),
        joint=Joint(tensile_strength=1e9, cohesion=1e9, friction=0.5, **joint),
        block=BlockMaterial(elastic_modulus=E),
    )
    corners = [rectangle(-PLATE, 0.0, 0.0, H), rectangle(0.0, 0.0, B, H), rectangle(B, 0.0, B + PLATE, H)]
    plates = [wall.add_block(np.array(box) @ turn.T) for box in corners]
    for plate in (0, 2):
        wall.support(plates[plate])
    return wall, plates


@pytest.mark.parametrize("angle", [0.0, 0.4])
def test_a_brick_stretches_as_a_bar_in_series_with_its_joints(angle: float) -> None:
    wall, (_, brick, right) = strip(angle)
    pull = 1e-5
    wall.move(right, x=pull * np.cos(angle), y=pull * np.sin(angle))
    model = wall.build(Solver(blocks="elastic"))
    *_, end = solve_path(model, Solver(blocks="elastic"), 1)
    stress = pull / (2 / 82e9 + (B + PLATE) / E)
    assert end.strain[brick, 0] == pytest.approx(stress / E, rel=1e-9)
    np.testing.assert_allclose(end.normal_stress, stress, rtol=1e-9)


def test_a_brick_bends_as_a_beam_in_series_with_its_joints() -> None:
    wall, (left, brick, right) = strip()
    turn = 1e-4
    wall.move(left, rotation=-turn)
    wall.move(right, rotation=turn)
    model = wall.build(Solver(blocks="elastic"))
    *_, end = solve_path(model, Solver(blocks="elastic"), 1)
    second_moment = T * H**3 / 12
    moment = 2 * turn / (2 / (82e9 * second_moment) + (B + PLATE) / (E * second_moment))
    assert end.strain[brick, 1] == pytest.approx(moment / (E * second_moment), rel=1e-9)
    # the plates turn about their middles, and the ends of the brick go up against its mean
    down = turn * PLATE / 2 + end.strain[brick, 1] * B**2 / 12
    assert end.displacement[brick, 1] == pytest.approx(-down, rel=1e-9)


def test_only_rectangles_that_are_not_held_are_elastic() -> None:
    wall, (_, brick, _) = strip()
    other = wall.add_block([(0.0, H), (B, H), (B / 2, 2 * H)])
    model = wall.build(Solver(blocks="elastic"))
    assert model.elastic.block.tolist() == [brick]
    assert model.size == 3 * (other + 2) + 2


def test_explicit_solver_gives_the_same() -> None:
    settings = ({"method": "quasi_static"}, {"method": "explicit", "tolerance": 1e-4})
    strong = {"tensile_strength": 1e6, "cohesion": 1e6}
    quasi, explicit = (solve(scene(solver={"blocks": "elastic"} | more, joint=strong)) for more in settings)
    for name in ("dpc_opening_max", "block_strain", "block_curvature"):
        np.testing.assert_allclose(explicit[name], quasi[name], atol=1e-3 * float(np.abs(quasi[name]).max()))


DRY = {"tensile_strength": 0.0, "cohesion": 0.0}


@pytest.mark.thorough
def test_a_run_in_time_begins_and_stays_in_equilibrium() -> None:
    bonded = {name: table for name, table in scene().to_dict().items() if name != "dpc"}
    time = {"duration": 0.02, "outputs": 4}
    static, moved = (solve(Scene.from_dict(bonded | more)) for more in ({}, {"dynamics": time}))
    for name in ("block_strain", "block_curvature"):
        exact = static[name].values[0]
        np.testing.assert_allclose(moved[name].values, [exact] * 5, atol=1e-4 * np.abs(exact).max())
    assert moved.attrs["begins_in_equilibrium"]


RAYLEIGH = {"damping": "rayleigh", "frequency": 1000, "second_frequency": 4000}


@pytest.mark.quick_cases
@pytest.mark.parametrize(
    ("joint", "damping"),
    [(DRY, RAYLEIGH), ({"fracture_energy": 10.0}, {}), ({"dilation": 0.2, "brittle_shear": True}, {})],
    ids=["dry", "softening", "dilatant"],
)
def test_a_wall_that_cracks_in_time_balances_its_energy(joint: dict[str, Any], damping: dict[str, Any]) -> None:
    time: dict[str, Any] = {"duration": 0.05, "outputs": 5, "movement_time": 0.05} | damping
    time["base"] = [{"kind": "half_sine", "acceleration": 5.0, "duration": 0.02, "direction": "x"}]
    ds = solve(scene(joint=joint, dynamics=time, wall={"length": 1.44, "height": 0.45}))
    assert (ds["contact_state"] == 1).any()
    assert float(np.abs(ds["block_strain"]).max()) > 1e-7
    exchanged = ds["external_work"].values - ds["external_work"].values[0]
    scale = np.abs(exchanged).max() + float(ds["elastic_energy"].values.max())
    assert np.abs(ds["energy_error"]).max() < 0.02 * scale


def test_what_a_run_in_time_cannot_do_is_still_answered() -> None:
    with pytest.raises(InputError, match="midpoint"):
        solve(scene(dynamics={"duration": 0.1}, solver={"quadrature": "midpoint"}))
    wall, (_, brick, _) = strip()
    settings = Solver(blocks="elastic")
    weightless = replace(wall.build(settings), density=np.zeros(3))
    with pytest.raises(InputError, match=rf"block {brick} .* has no mass"):
        dynamic_run(weightless, settings, Dynamics(start="unstressed"))


@pytest.mark.thorough
@pytest.mark.parametrize(("width", "elastic", "rigid"), [(1.2, 2.16, 0.19), (1.92, 1.54, 0.15)])
def test_head_joints_beside_a_lintel_pull_more_than_with_zones(width: float, elastic: float, rigid: float) -> None:
    """The theory page states these ratios: a lintel is one block with one curvature."""

    def pull(blocks: str) -> float:
        tables: dict[str, Any] = {
            "wall": {"length": 3.6 + width, "height": 1.8},
            "opening": [{"x": 1.8, "y": 0.6, "width": width, "height": 0.6, "lintel_bearing": 0.24}],
            "joint": {"tensile_strength": 1e8, "cohesion": 1e8},
            "loads": {"roof": 20e3},
            "movement": {"central_deflection": 0.0, "increments": 1},
            "solver": {"blocks": blocks},
        }
        ds = solve(Scene.from_dict(tables))
        beside = (ds["contact_kind"] == ContactKind.HEAD_JOINT) & (ds["contact_y"] > 1.2) & (ds["contact_y"] < 1.5)
        return float(ds["contact_normal_stress"][-1].where(beside).max())

    zones = pull("deformable")
    assert [pull("elastic") / zones, pull("rigid") / zones] == pytest.approx([elastic, rigid], rel=0.05)
