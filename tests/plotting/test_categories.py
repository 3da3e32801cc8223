"""Categories on the axis of widths: where they begin and end, where they are named, how far the axis goes."""

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from damagepred.damage import load_table
from damagepred.plotting.categories import shade_bands, width_scale
from damagepred.plotting.colours import CATEGORY_COLOURS, width_colours
from damagepred.plotting.sheet import new_figure


@pytest.mark.parametrize(
    ("widest", "top"), [(0.05, 1.0), (0.95, 1.5), (1.0, 5.0), (4.0, 5.0), (14.9, 22.5), (15.0, 30.0), (100.0, 151.875)]
)
def test_the_axis_goes_to_the_next_limit_and_beyond_what_is_drawn(widest: float, top: float):
    ax = new_figure().add_subplot()
    width_scale(ax, [0.01, widest, np.nan, np.inf, 0.02], load_table("as2870"), "gap")
    assert ax.get_ylabel() == "gap (mm), logarithmic above 0.1"
    assert ax.get_ylim() == pytest.approx((0.0, 1.15 * top))
    marks = [0.0, 0.1, 0.3, 1.0, 3.0, 5.0, 10.0, 15.0, 30.0, 100.0, 300.0]
    assert ax.get_yticks().tolist() == [mark for mark in marks if mark <= 1.15 * top]
    assert ax.get_yscale() == "symlog"
    assert ax.yaxis.get_transform().linthresh == 0.1


def test_bands_lie_between_their_limits_and_are_named_in_their_middle():
    ax = new_figure().add_subplot()
    ax.set_ylim(0.0, 8.0)
    shade_bands(ax, load_table("as2870"))
    bands = list(pairwise([0.0, 0.1, 1.0, 5.0, 8.0]))
    assert [(p.get_y(), p.get_y() + p.get_height()) for p in ax.patches] == [pytest.approx(ends) for ends in bands]
    assert [p.get_facecolor()[:3] for p in ax.patches] == [to_rgb(colour) for colour in CATEGORY_COLOURS[:4]]
    assert [line.get_ydata()[0] for line in ax.lines] == [0.1, 1.0, 5.0]
    names = ["0 negligible", "1 very slight", "2 slight", "3 moderate"]
    assert [t.get_text() for t in ax.texts] == names
    assert [t.xy[1] for t in ax.texts] == pytest.approx([np.mean(ends) for ends in bands])


def test_colours_of_widths_change_at_the_limits():
    colours, norm = width_colours(load_table("bre251"))
    limits = [0.1, 1.0, 5.0, 15.0, 25.0]
    assert norm.boundaries[:-1].tolist() == pytest.approx([0.0, *limits])
    assert [norm(w) for w in (0.05, 0.1, 0.99, 1.0, 14.0, 24.9, 25.0, 90.0)] == [0, 1, 1, 2, 3, 4, 5, 5]
    assert [c.lower() for c in colours.colors] == list(CATEGORY_COLOURS)
