"""Slopes of walls and distortion of openings, of movements whose slopes and distortions are known."""

import numpy as np
import pytest

from damagepred.assembly import wall_model
from damagepred.damage import Frames, SightLines, sticking_limits
from damagepred.one_wall.judged_path import gauges
from damagepred.scene import Dpc, Opening, Scene, Wall

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
