"""Slopes of walls and distortion of openings, of movements whose slopes and distortions are known."""

import numpy as np
import pytest

import damagepred
from damagepred.assembly import wall_model
from damagepred.damage import Frames, SightLines, deviation_limits, sticking_limits
from damagepred.one_wall.judged_path import gauges
from damagepred.scene import Dpc, Movement, Opening, Scene, Wall

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


# -- level and plumb -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("turn", [1 / 150, -1 / 150])
def test_a_wall_that_turns_as_one_is_as_much_out_of_plumb_as_out_of_level(turn: float):
    found = gauges(wall_model(HOUSE)).lines.deviation(moved(blocks(), xy=-turn, yx=turn))
    np.testing.assert_allclose(found, 1 / 150, rtol=1e-12)


def test_a_wall_that_leans_is_level_and_one_that_slopes_is_plumb():
    lines = gauges(wall_model(HOUSE)).lines
    np.testing.assert_allclose(lines.deviation(moved(blocks(), xy=0.01)), (0.01, 0.0, 0.0), atol=1e-15)
    np.testing.assert_allclose(lines.deviation(moved(blocks(), yx=-0.01)), (0.0, 0.01, 0.01), atol=1e-15)
    # what stretches is neither, but for bricks of the openings' bond that do not stand right over each other
    np.testing.assert_allclose(lines.deviation(moved(blocks(), xx=0.01, yy=0.01)), 0.0, atol=0.06 * 0.01 / 0.5)
    plain = Scene()
    solid = gauges(wall_model(plain)).lines
    np.testing.assert_allclose(solid.deviation(moved(blocks(plain), xx=0.01, yy=0.01)), 0.0, atol=1e-14)


def test_the_base_follows_the_footing_while_the_wall_spans():
    place = blocks()
    state = np.zeros((len(place), 3))
    below = wall_model(HOUSE).blocks.course < 2
    state[below, 1] = 0.02 * place[below, 0]
    np.testing.assert_allclose(gauges(wall_model(HOUSE)).lines.deviation(state), (0.0, 0.0, 0.02), atol=1e-15)


COLUMNS, COURSES, HIGH = 3, 30, 0.1


def bulge(*moved_out: tuple[int, int, float]) -> float:
    """Tilt of a stack of 30 courses of 3 bricks, 100 mm high, of which some (column, course) move along (mm)."""
    course, column = np.divmod(np.arange(COLUMNS * COURSES), COLUMNS)
    lines = SightLines.of_blocks(0.24 * column, (course + 0.5) * HIGH, course, gauge=1.0)
    state = np.zeros((COLUMNS * COURSES, 3))
    for i, row, out in moved_out:
        state[row * COLUMNS + i, 0] = out * 1e-3
    found = lines.deviation(state)
    assert found.slope_max == 0.0
    return float(found.tilt_max)


@pytest.mark.parametrize(
    ("moved_out", "tilt"),
    [
        ([(1, 12, 5)], 5 / 1000),  # seen from ten courses below and above
        ([(1, 12, -5)], 5 / 1000),
        ([(1, 12, 5), (1, 22, -3)], 8 / 1000),  # ten courses apart: out here, in there
        ([(1, 12, 5), (1, 22, 5)], 5 / 700),  # alike, so neither is seen from the other; the upper from the top
        ([(1, 12, 5), (2, 22, -3)], 5 / 1000),  # not one over the other
        ([(1, 12, 5), (1, 17, -5)], 5 / 1000),  # closer than the gauge
        ([(0, 29, 5)], 5 / 500),  # at the top from five courses below: the shortest that is measured on
        ([(0, 0, 5)], 5 / 1000),
        ([(2, row, 4) for row in range(8, 20)], 4 / 1000),  # a bulge 1.2 m high
    ],
)
def test_a_local_bulge_is_its_depth_over_the_gauge(moved_out: list, tilt: float):
    assert bulge(*moved_out) == pytest.approx(tilt, rel=1e-12)


def test_pairs_are_a_gauge_apart_and_what_lies_within_it_is_evened_out():
    """A step of 5 mm between two bricks is 1/200 over a metre, not 1/48 over the brick."""
    x = np.arange(25) * 0.24
    state = np.zeros((25, 3))
    state[12:, 1] = 5e-3
    lines = SightLines.of_blocks(x, np.zeros(25), np.zeros(25, dtype=np.int64), gauge=1.0)
    assert lines.length.max() == pytest.approx(0.96)
    assert lines.length.min() >= 0.5
    assert lines.deviation(state).slope_max == pytest.approx(5e-3 / 0.96)
    assert np.isnan(lines.deviation(state).tilt_max)  # a single course


def test_a_wall_shorter_than_the_gauge_is_measured_over_its_length():
    scene = Scene(wall=Wall(length=0.72, height=0.3))
    found = gauges(wall_model(scene)).lines.deviation(moved(blocks(scene), xy=-0.01, yx=0.01))
    np.testing.assert_allclose(found, 0.01)


def test_blocks_without_courses_are_not_measured():
    lines = SightLines.of_blocks(np.arange(4.0), np.zeros(4), np.full(4, -1))
    assert np.isnan(lines.deviation(np.zeros((4, 3)))).all()


@pytest.mark.parametrize(("limit", "level"), [(1 / 150, 1), (1 / 100, 2)])
def test_limits_of_slope_at_their_edges(limit: float, level: int):
    limits = deviation_limits()
    values = np.array([limit * (1 - 1e-6), limit, limit * (1 + 1e-6)])
    assert limits.level(values).tolist() == [level - 1, level, level]
    assert limits.level(np.zeros(3), values).tolist() == [level - 1, level, level]
    assert limits.level(np.array([np.nan, 1.0]), np.array([1.0, np.nan])).tolist() == [-1, -1]
    assert limits.confidence == "assumed"
    assert limits.level_names == ("not noticeable", "undesirable", "clearly visible")


# -- openings --------------------------------------------------------------------------------------------------------


def frame(state: np.ndarray) -> tuple[float, float, float]:
    """Width change, distortion and change of a diagonal of an opening 2 x 1 m, of its corners' displacements (4, 2)."""
    own = Frames(np.arange(4)[None], np.zeros((1, 4, 2)), CORNERS)
    found = own.distortion(np.column_stack((state, np.zeros(4))))
    return tuple(float(v[0]) for v in found)  # type: ignore[return-value]


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


def test_blocks_that_turn_take_the_corners_along():
    known = gauges(wall_model(HOUSE)).frames
    found = known.distortion(moved(blocks(), xy=-0.001, yx=0.001))
    np.testing.assert_allclose(found.opening_distortion, 0.0, atol=1e-12)
    racked = np.column_stack((blocks()[:, 1] * 0.002, np.zeros(len(blocks())), np.zeros(len(blocks()))))
    hole = HOUSE.opening[0]
    # u = 0.002 y of the blocks' centroids, which are half a course from sill and head
    expected = 0.002 * (hole.height - 0.075) / hole.height
    assert known.distortion(racked).opening_distortion[0] == pytest.approx(expected)


def test_an_opening_with_one_jamb_is_not_known():
    scene = Scene(opening=(Opening(x=0.0, y=0.9, width=0.96, height=1.5),))
    found = gauges(wall_model(scene)).frames.distortion(moved(blocks(scene), xy=0.01))
    assert np.isnan(found).all()


@pytest.mark.parametrize("measure", range(3))
@pytest.mark.parametrize("level", [1, 2])
def test_limits_of_sticking_at_their_edges(measure: int, level: int):
    limits = sticking_limits()
    limit = (limits.angle, limits.narrowing, limits.diagonal)[measure][level - 1]
    sign = (1, -1, -1)[measure]
    for factor, expected in ((1 - 1e-6, level - 1), (1.0, level), (1 + 1e-6, level)):
        values = [np.zeros(1) for _ in range(3)]
        values[measure] += sign * factor * limit
        assert limits.level(*values).tolist() == [expected]
    assert limits.confidence == "assumed"


def test_one_measure_that_is_not_known_leaves_the_level_open():
    assert sticking_limits().level(np.array([np.nan]), np.zeros(1), np.zeros(1)).tolist() == [-1]


def test_a_solved_wall_has_them():
    scene = Scene(
        wall=Wall(length=1.2, height=0.6),
        opening=(Opening(x=0.48, y=0.15, width=0.24, height=0.3),),
        movement=Movement(shape="arc", central_deflection=1e-3, increments=2),
    )
    ds = damagepred.solve(scene)
    assert ds["crack_group_width"].dims == ("increment", "group_count")
    assert ds["group_count"].values.tolist() == [2, 3, 4, 5]
    assert ds["crack_group_width"].attrs["group_distance"] == 1.0
    assert ds["opening_distortion"].shape == ds["opening_diagonal_change"].shape == (3, 1)
    for name in ("tilt_max", "slope_max", "base_slope_max"):
        assert 0 < float(ds[name][-1]) < 0.02
