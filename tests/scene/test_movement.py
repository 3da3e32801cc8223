"""Shapes of the footing against beam theory and geometry."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import damagepred
from damagepred.errors import InputError
from damagepred.results.simple_assessment import angular_distortion
from damagepred.scene import Joint, Loads, Movement, Scene, Wall
from damagepred.scene.footing_profile import arc, three_loads

XI = np.linspace(0.0, 1.0, 401)


def beam_by_virtual_work(x: float, loads: tuple[float, ...]) -> float:
    """The same once more, by integrating M(s) m(s; x): no formula for the deflection is used."""

    def moment(s: float, a: float) -> float:
        return s * (1 - a) if s <= a else a * (1 - s)

    kinks = sorted({*loads, x})
    return quad(lambda s: sum(moment(s, a) for a in loads) * moment(s, x), 0, 1, points=kinks, limit=200)[0]


@pytest.mark.parametrize("x", [0.1, 0.25, 0.37, 0.5, 0.68, 0.9])
def test_three_loads_by_virtual_work(x: float):
    loads = (0.25, 0.5, 0.75)
    expected = beam_by_virtual_work(x, loads) / beam_by_virtual_work(0.5, loads)
    assert three_loads(np.array([x]))[0] == pytest.approx(expected, rel=1e-8)


def test_three_loads_at_the_known_points():
    assert three_loads(np.array([0.25, 0.75])) == pytest.approx([27 / 38] * 2, rel=1e-14)
    assert three_loads(np.array([0.5]))[0] == pytest.approx(1.0, rel=1e-15)
    np.testing.assert_array_equal(three_loads(np.array([0.0, 1.0])), 0.0)


def test_arc_lies_on_one_circle_through_ends_and_centre():
    for ratio in (1e-5, 1e-3, 0.05, 0.3):
        y = arc(XI, ratio) * ratio  # chord 1
        # the circle through (0,0), (1,0), (1/2, ratio): centre (1/2, c)
        c = brentq(lambda c, rise=ratio: math.hypot(0.5, c) - (rise - c), -1e7, rise_limit(ratio), xtol=1e-12)
        radius = ratio - c
        np.testing.assert_allclose(np.hypot(XI - 0.5, y - c) / radius, 1.0, rtol=1e-11)
        assert arc(np.array([0.5]), ratio)[0] == 1.0
        np.testing.assert_allclose(arc(np.array([0.0, 1.0]), ratio), 0.0, atol=1e-11)


def rise_limit(ratio: float) -> float:
    return ratio / 2.0


def test_flat_arc_is_the_parabola_and_the_change_over_is_smooth():
    parabola = 4 * XI * (1 - XI)
    np.testing.assert_allclose(arc(XI, 1e-4), parabola, atol=1e-7)  # differs by about ratio^2
    np.testing.assert_array_equal(arc(XI, 0.0), parabola)
    np.testing.assert_allclose(arc(XI, 1.0001e-6), arc(XI, 0.9999e-6), atol=1e-9)
    assert np.abs(arc(XI, 0.2) - parabola).max() > 1e-2  # and is another shape where it is not flat


@pytest.mark.parametrize("shape", ["three_loads", "parabola", "arc"])
@pytest.mark.parametrize(("kind", "sign"), [("dishing", -1), ("doming", 1)])
def test_dishing_goes_down_and_doming_goes_up(shape: str, kind: str, sign: int):
    movement = Movement(shape=shape, kind=kind, central_deflection=0.012)
    length = 7.3
    rise = movement.profile(XI * length, length)
    assert rise[0] == pytest.approx(0.0, abs=1e-15)
    assert rise[-1] == pytest.approx(0.0, abs=1e-15)
    assert rise[200] == pytest.approx(sign * 0.012, rel=1e-12)
    assert (sign * rise[1:-1] > 0).all()
    np.testing.assert_allclose(rise, rise[::-1], atol=1e-15)  # symmetric
    assert (np.diff(sign * rise[:201]) > 0).all()  # rises to the centre
    assert movement.sign == sign


TABLE = ((0.0, 0.0), (0.2, 0.5), (0.5, 0.8), (0.9, 0.3), (1.0, 0.0))


def test_table_passes_through_its_points_scaled_to_the_centre():
    movement = Movement(shape="table", table=TABLE, kind="doming", central_deflection=0.01)
    place, fraction = np.array(TABLE).T
    np.testing.assert_allclose(movement.profile(place * 6.0, 6.0), 0.01 * fraction / 0.8, rtol=1e-13, atol=1e-18)


def test_table_without_a_point_in_the_middle_still_reaches_the_stated_deflection():
    movement = Movement(
        shape="table", table=((0, 0), (0.3, 0.9), (0.6, 0.7), (1, 0)), kind="dishing", central_deflection=0.01
    )
    assert movement.profile(np.array([3.0]), 6.0)[0] == pytest.approx(-0.01, rel=1e-14)


def test_table_does_not_overshoot_between_its_points():
    movement = Movement(shape="table", table=((0, 0), (0.4, 1), (0.5, 1), (0.6, 1), (1, 0)), central_deflection=1e-2)
    rise = movement.profile(XI * 6, 6.0)
    assert rise.min() >= -1e-2 - 1e-15  # a cubic spline would go beyond
    assert rise.max() <= 1e-16


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ([], "at least 3 points"),
        ([[0, 0], [1, 0]], "at least 3 points"),
        ([[0, 0], [0.5, 1], [0.5, 1], [1, 0]], "positions must rise"),
        ([[0, 0], [0.7, 1], [0.4, 1], [1, 0]], "positions must rise"),
        ([[0.1, 0], [0.5, 1], [1, 0]], "from 0 to 1"),
        ([[0, 0], [0.5, 1], [0.9, 0]], "from 0 to 1"),
        ([[0, 0], [0.5, 0], [1, 0]], "lies on the line"),
        ([[0, 0], [0.5, 3], [1, 6]], "lies on the line"),
        ([[0, 0], [0.2, 1], [0.5, 0.04], [0.8, -1], [1, 0]], "or nearly"),
        ([[0, 0], [0.5, float("nan")], [1, 0]], "finite"),
        ([[0, 0], [0.5, True], [1, 0]], "expected a number"),
        ([[0, 0], [0.5], [1, 0]], "table, item 2"),
        ("flat", "must be a list"),
    ],
)
def test_bad_tables(table: object, words: str):
    with pytest.raises(InputError, match=words) as caught:
        Scene.from_dict({"movement": {"shape": "table", "table": table}})
    assert "table" in str(caught.value)


def test_ends_that_settle_unequally_tilt_the_wall_and_crack_it_as_without_tilt():
    wall = Wall(length=1.2, height=0.6, block_length=0.3, block_height=0.15)
    position = np.linspace(0, 1, 201)
    level = 4 * position * (1 - position) + 0.5 * position**3 - 0.5 * position
    forms = level, level - 3.0 * position
    solved = [
        damagepred.solve(
            Scene(
                wall=wall,
                joint=Joint(tensile_strength=0.05e6, cohesion=0.06e6),
                loads=Loads(roof=20e3),
                movement=replace(movement(form), kind="doming", central_deflection=2e-3, increments=4),
            )
        )
        for form in forms
    ]
    assert solved[0].crack_width_max[-1] > 1e-4
    # PCHIP of the tilted points is not quite the tilted PCHIP; before the last increment no bond breaks for that
    level, tilted = (ds.crack_width_max[:-1] for ds in solved)
    np.testing.assert_allclose(tilted, level, rtol=1e-5, atol=1e-9)
    assert solved[1].base_slope_max[-1] > solved[0].base_slope_max[-1] + 0.8 * 3.0 * 2e-3 / 1.2
    distortion = [angular_distortion(Scene(wall=wall, movement=movement(form))) for form in forms]
    assert distortion[1] == pytest.approx(distortion[0], rel=1e-4)


def movement(form: np.ndarray) -> Movement:
    """Return a movement through equally spaced points."""
    position = np.linspace(0, 1, len(form))
    return Movement(shape="table", table=tuple(zip(position.tolist(), form.tolist(), strict=True)))


def test_table_with_another_shape_is_refused():
    with pytest.raises(InputError, match="only read with shape = 'table'"):
        Scene.from_dict({"movement": {"shape": "arc", "table": [list(p) for p in TABLE]}})
