"""Widths of crack bands, of openings by hand, and properties for any openings."""

import pytest
from hypothesis import strategies as st

from damagepred.scene import Damage
from tests.damage.pattern import Pattern

MM = 1e-3


def band(wall: Pattern, **rules) -> float:
    """Width (mm) of the widest band of a wall drawn by hand."""
    return wall.judge(Damage(**rules)).crack_band_width_max / MM


# -- by hand ---------------------------------------------------------------------------------------------------------


def test_other_courses_are_other_bands():
    wall = Pattern()
    wall.open("head", 4, 4, 1 * MM)
    wall.open("head", 5, 5, 2 * MM)
    assert band(wall) == pytest.approx(2)


def test_of_a_stepped_crack_the_larger_component_counts():
    wall = Pattern()
    for step in range(4):
        wall.open("head", 4 + step, 3 + step + (1 if (7 + 2 * step) % 2 else 0), 1 * MM)
        wall.open("bed", 4 + step, 4 + step, 2 * MM)
    assert band(wall) == pytest.approx(2)


# -- walls of templates ----------------------------------------------------------------------------------------------


# -- for any openings ------------------------------------------------------------------------------------------------


WIDTHS = st.floats(0.0, 20.0)
