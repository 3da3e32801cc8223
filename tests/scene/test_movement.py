"""Shapes of the footing against beam theory and geometry."""

import numpy as np
import pytest

from damagepred.errors import InputError
from damagepred.scene import Movement, Scene

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
