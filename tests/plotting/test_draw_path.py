from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_rgba

import damagepred
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.plotting import draw, draw_dpc_opening, draw_history
from damagepred.plotting.colours import CATEGORY_COLOURS
from damagepred.plotting.footing import open_stretches, opening_along
from damagepred.plotting.sheet import spread_evenly
from damagepred.scene import Dpc, Movement, Opening, Scene, Wall


def texts(ax):
    return " ".join(t.get_text() for t in ax.texts)


def lines(ax, label):
    return [line for line in ax.lines if line.get_label() == label]


def test_dpc_lines_carry_the_openings_in_mm(on_dpc):
    ax = draw_dpc_opening(on_dpc)
    x, opening, _ = opening_along(on_dpc)
    assert (np.diff(x) >= -1e-12).all()
    of_dpc = on_dpc.contact_kind.values == ContactKind.DPC
    assert np.sort(opening[-1]).tolist() == np.sort(on_dpc.contact_opening.values[-1, of_dpc]).tolist()
    last = [line for line in ax.lines if len(line.get_xdata()) == len(x)][-1]
    assert last.get_xdata() == pytest.approx(x)
    assert last.get_ydata() == pytest.approx(1e3 * opening[-1])
    (threshold,) = lines(ax, "threshold 0.2 mm")
    assert threshold.get_ydata() == pytest.approx([0.2, 0.2])
    assert ax.get_xlabel() == "along the wall (m)"
    assert ax.get_ylabel() == "opening of the dpc (mm)"


def test_open_stretches_are_interpolated():
    x = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    assert open_stretches(x, np.array([0.0, 2.0, 2.0, 2.0, 0.0]), 1.0) == [(0.5, 3.5)]
    assert open_stretches(x, np.array([2.0, 0.0, 0.0, 0.0, 4.0]), 1.0) == [(0.0, 0.5), (3.25, 4.0)]
    assert open_stretches(x, np.full(5, 0.5), 1.0) == []
    assert open_stretches(x, np.full(5, 2.0), 1.0) == [(0.0, 4.0)]


@pytest.mark.parametrize(("count", "expected"), [(1, [0]), (4, [0, 1, 2, 3]), (21, [2, 5, 8, 11, 14, 17, 20])])
def test_increments_are_picked_evenly_with_the_last(count, expected):
    assert spread_evenly(count, 10).tolist() == expected


def test_dpc_is_interrupted_by_a_door():
    scene = Scene(
        wall=Wall(length=1.44, height=0.45),
        dpc=Dpc(course=1),
        opening=(Opening(kind="door", x=0.48, width=0.48, height=0.3),),
        movement=Movement(central_deflection=1e-4, increments=1),
    )
    ax = draw_dpc_opening(damagepred.solve(scene))
    for line in ax.lines:
        if line.get_label().startswith("_child") and len(line.get_xdata()) > 2:
            x = np.asarray(line.get_xdata())
            assert x.max() < 0.49 or x.min() > 0.95


def test_no_dpc_is_said_and_no_openings_are_refused(cracked):
    assert "no dpc" in texts(draw_dpc_opening(cracked))
    with pytest.raises(InputError, match="variable = 'opening_width_change'"):
        draw(cracked, "opening_width_change")


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


@pytest.mark.parametrize("draw", [draw_dpc_opening, draw_history])
def test_other_datasets_are_refused(draw, study):
    with pytest.raises(InputError, match="this drawing needs"):
        draw(study.drop_vars("crack_width_max"))
