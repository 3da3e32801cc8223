"""Whole judgements of drawn walls and all damage tables against lists; slopes of walls, distortion of openings."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from damagepred.assembly import wall_model
from damagepred.damage.crack_bands import BandGauges
from damagepred.damage.cracks import find_cracks, psi
from damagepred.damage.deep_beam import beam_strain, deflection_over_strain
from damagepred.damage.deviation import Frames, SightLines
from damagepred.damage.limits import (
    construction_limits,
    deviation_limits,
    load_movement_limits,
    load_scale,
    load_strain_table,
    sticking_limits,
)
from damagepred.damage.table import load_table
from damagepred.damage.tracing import Growth
from damagepred.one_wall.judged_path import gauges
from damagepred.scene import Damage, Dpc, Opening, Scene, Wall
from tests.damage.pattern import Pattern
from tests.recorded import check_parts, parts_of

LISTS = Path(__file__).parent / "judgements"


def broken_wall(dpc: int | None, growth: float) -> Pattern:
    """Wall with cracks of many forms: wider, longer and slid the more it has grown."""
    wall = Pattern(rows=8, columns=12, dpc=dpc)
    number = np.arange(wall.opening.size).reshape(wall.opening.shape)
    wall.opening[:] = 4e-3 * growth * np.sin(0.9 * number) ** 2 * np.cos(0.1 * number)
    wall.slip[:] = 2e-3 * growth * np.sin(1.7 * number)
    wall.cracked[:] = (np.sin(0.37 * number[:, :1]) > 0.75 - 0.5 * growth) & (wall.opening > 1e-4)
    return wall


@pytest.mark.parametrize("dpc", [None, 2])
def test_a_judgement_is_its_list(dpc: int | None) -> None:
    parts: dict[str, str] = {}
    growth = Growth(broken_wall(dpc, 0.0).map)
    for number, grown in enumerate((0.0, 0.5, 1.0)):
        wall = broken_wall(dpc, grown)
        found = find_cracks(wall.map, wall.opening, wall.slip, wall.cracked)
        parts |= parts_of([found, psi(found)], f"cracks {grown}")
        parts |= parts_of(growth.step(number, wall.opening, wall.slip, wall.cracked), f"traced {grown}")
        for settings in (Damage(), Damage(measure="band", plasterboard=True, count_rule=False, dpc_threshold=5e-4)):
            parts |= parts_of(wall.judge(settings), f"verdict {settings.measure} {grown}")
        for gauge, least in ((0.3, 0.0), (0.6, 1e-3)):
            width = BandGauges.of_joints(wall.map, gauge).width(wall.opening, wall.cracked, least)
            parts |= parts_of(width, f"band {gauge} {grown}")
        parts |= parts_of(wall.map.widest(wall.opening), f"widest {grown}")
    for name in (
        "is_dpc",
        "is_wall",
        "is_base",
        "is_footing",
        "length",
        "dpc_level",
        "wall_neighbours",
        "corner_numbers",
    ):
        parts |= parts_of(getattr(wall.map, name), f"map.{name}")
    check_parts(LISTS / f"dpc_{dpc}.txt", parts)


def test_tables_and_limits_are_their_list() -> None:
    tables: dict[str, Any] = {name: load_table(name) for name in ("as2870", "bre251")}
    tables |= {"plasterboard": load_table("as2870", plasterboard=True), "strain": load_strain_table()}
    tables |= {"movement": load_movement_limits(), "construction": construction_limits()}
    tables |= {"deviation": deviation_limits(), "sticking": sticking_limits()}
    parts = dict(parts_of(tables, "table"))
    parts |= parts_of([limit.value(6.0, 2.4) for limit in load_movement_limits()], "values")
    parts |= parts_of([load_scale(name) for name in ("psi", "tilt")], "scale")
    length, ground = np.array([2.0, 6.0, 18.0]), np.array([-2e-4, 0.0, 3e-4])
    for kind in ("sagging", "hogging"):
        parts |= parts_of(beam_strain(4e-4, length, 2.4, kind, ground_strain=ground), kind)
        parts |= parts_of(deflection_over_strain(length, 2.4, kind, 2.4), f"{kind} ratio")
    check_parts(LISTS / "tables.txt", parts)


def test_slopes_and_distortions_are_their_list() -> None:
    opening = [
        {"kind": "window", "x": 0.5, "y": 0.45, "width": 0.48, "height": 0.3},
        {"kind": "door", "x": 1.6, "width": 0.36, "height": 0.6},
    ]
    wall = {"length": 2.4, "height": 1.05}
    model = wall_model(
        Scene.from_dict({"wall": wall, "opening": opening, "dpc": {"course": 1}, "solver": {"blocks": "rigid"}})
    )
    gauge, blocks = gauges(model), model.n_blocks
    number = np.arange(blocks)
    state = 1e-2 * np.column_stack((np.sin(number), np.cos(2 * number), 0.1 * np.sin(3 * number)))
    parts = dict(parts_of([gauge.lines.deviation(state), gauge.frames.distortion(state), gauge], "gauge"))
    change = np.linspace(-0.03, 0.03, 9)
    parts |= parts_of(sticking_limits().level(np.abs(change) / 3, change, change / 2), "sticking")
    parts |= parts_of(deviation_limits().level(np.abs(change) / 2, np.abs(change) / 4), "deviation")
    check_parts(LISTS / "shape.txt", parts)


HOUSE = Scene(
    wall=Wall(length=6.0, height=2.4),
    dpc=Dpc(course=2),
    opening=(Opening(x=2.52, y=0.9, width=0.96, height=1.05), Opening(kind="door", x=4.44, width=0.84, height=2.1)),
)
CORNERS = np.array([[(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)]])


def blocks(scene: Scene = HOUSE) -> np.ndarray:
    model = wall_model(scene)
    return np.column_stack((model.blocks.x, model.blocks.y))


def moved(place: np.ndarray, xx: float = 0.0, xy: float = 0.0, yx: float = 0.0, yy: float = 0.0) -> np.ndarray:
    """Displacement of a uniform field: u = xx x + xy y, v = yx x + yy y; blocks turn with it."""
    x, y = place.T
    return np.column_stack((xx * x + xy * y, yx * x + yy * y, np.full(len(x), (yx - xy) / 2)))


def test_a_wall_that_leans_is_level_and_one_that_slopes_is_plumb():
    lines = gauges(wall_model(HOUSE)).lines
    np.testing.assert_allclose(lines.deviation(moved(blocks(), xy=0.01)), (0.01, 0.0, 0.0), atol=1e-15)
    np.testing.assert_allclose(lines.deviation(moved(blocks(), yx=-0.01)), (0.0, 0.01, 0.01), atol=1e-15)
    # what stretches is neither, but for bricks of the openings' bond that do not stand right over each other
    np.testing.assert_allclose(lines.deviation(moved(blocks(), xx=0.01, yy=0.01)), 0.0, atol=0.06 * 0.01 / 0.5)
    plain = Scene()
    solid = gauges(wall_model(plain)).lines
    np.testing.assert_allclose(solid.deviation(moved(blocks(plain), xx=0.01, yy=0.01)), 0.0, atol=1e-14)


def test_a_wall_shorter_than_the_gauge_is_measured_over_its_length():
    scene = Scene(wall=Wall(length=0.72, height=0.3))
    found = gauges(wall_model(scene)).lines.deviation(moved(blocks(scene), xy=-0.01, yx=0.01))
    np.testing.assert_allclose(found, 0.01)


@pytest.mark.parametrize("bond", ["running", "english", "flemish"])
def test_a_mirrored_wall_deviates_as_much(bond: str):
    """One end of the wall settles: the sharpest slope lies beside that end, whichever it is."""
    scene = Scene(wall=Wall(length=2.4, height=1.2, block_length=0.24, block_height=0.15, bond=bond))
    place, lines = blocks(scene), gauges(wall_model(scene)).lines
    mirrored = place * (-1, 1) + (scene.wall.length, 0)

    def settled(x: np.ndarray, y: np.ndarray, side: int) -> np.ndarray:
        return np.column_stack((side * 1e-3 * x**3 * y**2, -1e-3 * np.exp(3 * x), np.zeros(len(x))))

    right, left = lines.deviation(settled(*place.T, 1)), lines.deviation(settled(*mirrored.T, -1))
    np.testing.assert_allclose(right, left, rtol=1e-9)


def test_blocks_without_courses_are_not_measured():
    lines = SightLines.of_blocks(np.arange(4.0), np.zeros(4), np.full(4, -1))
    assert np.isnan(lines.deviation(np.zeros((4, 3)))).all()


def frame(state: np.ndarray) -> tuple[float, float, float]:
    """Width change, distortion and change of a diagonal of an opening 2 x 1 m, of its corners' displacements (4, 2)."""
    own = Frames(np.arange(4)[None], np.zeros((1, 4, 2)), CORNERS)
    found = own.distortion(np.column_stack((state, np.zeros(4))))
    return tuple(float(v[0]) for v in found)


@pytest.mark.parametrize("shear", [0.003, -0.003])
def test_an_opening_that_is_racked(shear: float):
    """Jambs stay upright, head and sill slope: a diagonal 2.236 m long loses shear x 2 x 1 / 2.236."""
    width, angle, diagonal = frame(np.array([(0, 0), (0, 2 * shear), (0, 2 * shear), (0, 0)]))
    assert width == 0.0
    assert angle == pytest.approx(0.003)
    assert diagonal == pytest.approx(-0.003 * 2 / 5**0.5, rel=5e-3)


def test_an_opening_squeezed_upright():
    width, angle, diagonal = frame(np.array([(0, 0), (0, 0), (0, -1e-3), (0, -1e-3)]))
    assert (width, angle) == (0.0, 0.0)
    assert diagonal == pytest.approx(-1e-3 / 5**0.5, rel=5e-3)


def test_one_measure_that_is_not_known_leaves_the_level_open():
    assert sticking_limits().level(np.array([np.nan]), np.zeros(1), np.zeros(1)).tolist() == [-1]
