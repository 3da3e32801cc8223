"""Categories on the axis of widths: where they begin and end, where they are named, how far the axis goes."""

import pytest

from damagepred.damage import load_table
from damagepred.plotting.colours import CATEGORY_COLOURS, width_colours


def test_colours_of_widths_change_at_the_limits():
    colours, norm = width_colours(load_table("bre251"))
    limits = [0.1, 1.0, 5.0, 15.0, 25.0]
    assert norm.boundaries[:-1].tolist() == pytest.approx([0.0, *limits])
    assert [norm(w) for w in (0.05, 0.1, 0.99, 1.0, 14.0, 24.9, 25.0, 90.0)] == [0, 1, 1, 2, 3, 4, 5, 5]
    assert [c.lower() for c in colours.colors] == list(CATEGORY_COLOURS)
