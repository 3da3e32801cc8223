"""Shapes of the footing and of moving ground against beam theory, geometry and their formulas."""

import math

import numpy as np
import pytest

from damagepred.errors import InputError
from damagepred.scene import Mound, Movement, Scene
from damagepred.scene.mound import gaussian, mitchell, tree, walsh

XI = np.linspace(0.0, 1.0, 401)


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


def test_table_with_another_shape_is_refused():
    with pytest.raises(InputError, match="only read with shape = 'table'"):
        Scene.from_dict({"movement": {"shape": "arc", "table": [list(p) for p in TABLE]}})


LENGTH = 6.0
X = np.linspace(0.0, LENGTH, 1201)


def test_walsh_edge_distance_by_hand():
    """y_s = 60 mm: doming y_m = 42, e = 2.3/8 + 42/36 = 1.4542 m; dishing y_m = 30, 0.6 + 30/25 = 1.8 against 0.2 L."""
    mound = Mound(surface_movement=0.06, suction_depth=2.3)
    assert mound.edge(8.0, "doming") == pytest.approx(0.2875 + 1.1666666667, rel=1e-9)
    assert mound.edge(8.0, "dishing") == pytest.approx(1.6, rel=1e-12)  # 0.2 L
    assert mound.edge(20.0, "dishing") == pytest.approx(1.8, rel=1e-12)  # the cap
    assert mound.edge(2.0, "doming") == 1.0  # never more than half the wall


def test_mitchell_exponent_by_hand():
    mound = Mound(shape="mitchell", suction_depth=2.3, embedment=0.5)
    assert mound.mound_exponent(6.0) == pytest.approx(5.0, rel=1e-12)  # 9 / 1.8
    assert Mound(shape="mitchell", suction_depth=3.0, exponent_factor=2.0).mound_exponent(6.0) == pytest.approx(4.0)
    assert Mound(shape="mitchell", exponent=3.5, embedment=5.0).mound_exponent(6.0) == 3.5
    np.testing.assert_allclose(mitchell(np.array([0.0, 1.5, 3.0, 4.5]), 6.0, 5.0), [1.0, 2.0**-5, 0.0, 2.0**-5])
    np.testing.assert_allclose(mitchell(X, 6.0, 2.0), walsh(X, 6.0, 3.0), atol=1e-14)  # both the whole parabola


@pytest.mark.parametrize(
    "mound",
    [
        Mound(shape="tree", position=-1.0, reach=5.0),
        Mound(shape="pipe", reach=1.5),
        Mound(shape="tunnel", reach=2.0),
        Mound(shape="table", table=((0, 0), (0.5, 1), (1, 0))),
    ],
    ids=lambda mound: mound.shape,
)
def test_other_causes_settle_in_dishing_and_heave_in_doming(mound: Mound):
    down, up = mound.profile(X, LENGTH, "dishing"), mound.profile(X, LENGTH, "doming")
    np.testing.assert_array_equal(down, -up)
    assert (down <= 0).all()
    assert down.min() >= -mound.surface_movement
    assert down.min() < -0.5 * mound.surface_movement


def test_tree_at_the_end_and_beyond_it():
    at_end = Mound(shape="tree", surface_movement=0.05, reach=4.0)
    np.testing.assert_allclose(
        at_end.profile(np.array([0.0, 1.0, 2.0, 4.0, 6.0]), LENGTH, "dishing"),
        [-0.05, -0.05 * 9 / 16, -0.05 / 4, 0.0, 0.0],
        rtol=1e-12,
    )
    beyond = Mound(shape="tree", surface_movement=0.05, reach=4.0, position=8.0)  # 2 m to the right of the wall
    np.testing.assert_allclose(beyond.profile(np.array([6.0, 4.0, 0.0]), LENGTH, "dishing"), [-0.0125, 0.0, 0.0])
    assert Mound(shape="tree").extent(LENGTH) == LENGTH
    straight = Mound(shape="tree", surface_movement=0.05, reach=4.0, exponent=1.0)
    np.testing.assert_allclose(straight.profile(np.array([1.0, 3.0]), LENGTH, "doming"), [0.0375, 0.0125], rtol=1e-12)
    slope = (tree(np.array([4.0]), 4.0) - tree(np.array([4.0 - 1e-6]), 4.0)) / 1e-6
    assert abs(slope[0]) < 1e-6  # level where it ends
    np.testing.assert_allclose(tree(np.array([1.0, -1.0]), 4.0, 1.0), 0.75)  # a straight line, either side


def test_tunnel_trough_has_the_volume_and_slope_of_peck():
    i = 1.7
    x = np.linspace(-20.0, 20.0, 40001)
    trough = gaussian(x, i)
    assert np.sum(trough) * 1e-3 == pytest.approx(math.sqrt(2 * math.pi) * i, rel=1e-9)  # V = 2.5 i S_max
    slope = np.gradient(trough, x)
    assert abs(x[np.argmax(np.abs(slope))]) == pytest.approx(i, abs=2e-3)
    assert np.abs(slope).max() == pytest.approx(math.exp(-0.5) / i, rel=1e-6)
    assert gaussian(np.array([i]), i)[0] == pytest.approx(0.6065, abs=5e-5)


@pytest.mark.parametrize(("kind", "towards"), [("dishing", 1), ("doming", -1)])
def test_ground_over_a_tunnel_moves_along_the_line_to_its_axis(kind: str, towards: int):
    mound = Mound(shape="tunnel", tunnel_depth=8.0, position=1.0, surface_movement=0.02)
    u, v = mound.horizontal(X, LENGTH, kind), mound.profile(X, LENGTH, kind)
    np.testing.assert_allclose(u * 8.0, v * (X - 1.0), atol=1e-18)  # the vector (u, v) points to (1, -8)
    right = X > 1.0
    assert (towards * u[right] < 0).all()
    strain = np.gradient(u, X)  # settling ground is squeezed over the axis and stretched outside the inflection points
    assert towards * strain[np.argmin(np.abs(X - 1.0))] < 0
    assert towards * strain[np.argmin(np.abs(X - 5.9))] > 0


@pytest.mark.parametrize("position", [(0, 0.5, 0.5, 1), (0, 0.6, 0.4, 1), (0, 0, 1), (0.1, 1), (0, 0.9)])
def test_positions_of_a_table_rise_from_0_to_1(position):
    with pytest.raises(InputError, match="positions must rise from 0 to 1"):
        Scene.from_dict(
            {"mound": {"shape": "table", "table": [[p, 0.5] for p in position]}, "movement": {"shape": "mound"}}
        )
