from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_rgba

from damagepred.errors import InputError
from damagepred.plotting import draw, draw_history
from damagepred.plotting.colours import CATEGORY_COLOURS
from damagepred.plotting.geometry import open_stretches


def lines(ax, label):
    return [line for line in ax.lines if line.get_label() == label]


def test_open_stretches_are_interpolated():
    x = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    assert open_stretches(x, np.array([0.0, 2.0, 2.0, 2.0, 0.0]), 1.0) == [(0.5, 3.5)]
    assert open_stretches(x, np.array([2.0, 0.0, 0.0, 0.0, 4.0]), 1.0) == [(0.0, 0.5), (3.25, 4.0)]
    assert open_stretches(x, np.full(5, 0.5), 1.0) == []
    assert open_stretches(x, np.full(5, 2.0), 1.0) == [(0.0, 4.0)]


@pytest.mark.parametrize("variable", ["dpc_opening", "footing_rise", "opening_width_change"])
def test_variables_of_parts_that_a_wall_lacks_are_refused(cracked, variable):
    with pytest.raises(InputError, match=f"variable = '{variable}'"):
        draw(cracked, variable)


def test_width_of_an_opening_with_one_jamb_is_unknown(on_dpc):
    lame = on_dpc.copy(deep=True)
    lame["opening_width_change"][:] = np.nan
    (line,) = (line for line in draw(lame, "opening_width_change").lines if line.get_label().startswith("window"))
    assert line.get_label().endswith(": unknown")


def test_openings_are_named_by_kind_size_and_place(on_dpc):
    ds = on_dpc.copy()
    values = {"left": [0.25, 1.5], "sill": [0.9, 0.0], "width": [1.25, 0.8], "height": [0.6, 2.0]}
    ds = ds.drop_dims("opening").assign({f"opening_{name}": ("opening", v) for name, v in values.items()})
    change = np.array([[0.0, 0.0], [1.0, -2.0], [3.0, -4.0], [5.0, -7.0]]) * 1e-3
    ds["opening_width_change"] = ("increment", "opening"), change
    drawn = {
        line.get_label(): line.get_ydata()
        for line in draw(ds, "opening_width_change").lines
        if len(line.get_xdata()) == 4
    }
    assert list(drawn) == ["window 1: 1.25 x 0.60 m, at 0.25 m", "door 2: 0.80 x 2.00 m, at 1.50 m"]
    np.testing.assert_allclose(list(drawn.values()), 1e3 * change.T)
    ds["opening_sill"] = "opening", [np.nan, 0.0]
    assert draw(ds, "opening_width_change").lines[1].get_label() == "opening 1"


WIDTHS = {
    "widest crack above the dpc": "crack_width_max",
    "widest dpc opening": "dpc_opening_max",
    "widest crack band": "crack_band_width_max",
    "widest gap on the footing": "footing_opening_max",
    "widest crack below the dpc": "base_crack_width_max",
}


@pytest.mark.parametrize(
    ("measure", "head", "scale"),
    [
        ("central_deflection", "central deflection (mm)", 1e3),
        ("surface_movement", "surface movement $y_s$ (mm)", 1e3),
        ("time", "time (s)", 1.0),
    ],
)
def test_every_line_of_a_history_is_its_variable(on_dpc, measure, head, scale):
    ds = on_dpc.copy()
    for factor, name in enumerate(WIDTHS.values(), start=3):  # no two alike, and none largest at the end
        ds[name] = "increment", factor * 1e-3 * np.array([0.0, 1.0, 2.0, 1.7])
    ds["footing_separation_length"] = ds["footing_separation_length"].copy(data=[0.0, 0.1, 0.2, 0.3])
    if measure not in ds:
        ds[measure] = "increment", np.array([0.0, 0.013, 0.029, 0.031])
    ds["damage_category"] = ds["damage_category"].copy(data=np.array([0, 3, 1, 2], dtype=np.int8))
    ax = draw_history(ds)
    x = scale * ds[measure].values
    for label, name in WIDTHS.items():
        (line,) = lines(ax, label)
        assert line.get_xdata() == pytest.approx(x)
        assert line.get_ydata() == pytest.approx(1e3 * ds[name].values), label
    (marks,) = (c for c in ax.collections if len(c.get_offsets()) == 4)
    np.testing.assert_allclose(marks.get_offsets(), np.column_stack((x, 1e3 * ds.crack_width_max.values)))
    assert [tuple(c) for c in marks.get_facecolors()] == [to_rgba(CATEGORY_COLOURS[c]) for c in (0, 3, 1, 2)]
    assert ax.get_xlabel() == head
    assert ax.get_xlim() == pytest.approx((0.0, 1.02 * x.max()))
    assert ax.get_ylim()[1] > 14.0
