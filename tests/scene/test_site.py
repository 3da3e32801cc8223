"""Site classes and standard footings, typed here from the literature."""

import math

import pytest

from damagepred.errors import InputError
from damagepred.scene import Footing, ReinforcedConcrete, site_class, standard_footing, standard_footings, suction_depth


@pytest.mark.parametrize(
    ("millimetres", "name"),
    [
        (0, "A"),
        (0.1, "S"),
        (20, "S"),
        (20.1, "M"),
        (40, "M"),
        (41, "H1"),
        (60, "H1"),
        (60.5, "H2"),
        (75, "H2"),
        (75.1, "E"),
        (400, "E"),
    ],
)
def test_class_of_a_site(millimetres: float, name: str):
    assert site_class(millimetres * 1e-3).name == name


@pytest.mark.parametrize("wrong", [-0.001, math.nan, math.inf])
def test_impossible_movements_are_refused(wrong: float):
    with pytest.raises(InputError, match="surface_movement"):
        site_class(wrong)


def test_suction_depth_by_zone():
    assert [suction_depth(zone) for zone in range(1, 7)] == [1.5, 1.8, 2.3, 3.0, 4.0, 4.0]
    with pytest.raises(InputError, match="zone = 7"):
        suction_depth(7)


def test_standard_footings_are_footings():
    """Class M: clad 400 x 300 3-L11TM, veneer 500 x 300 3-L12TM, full masonry 900 x 400 4-L12TM (depth x width)."""
    masonry = standard_footing("M", "full_masonry")
    assert (masonry.depth, masonry.width, masonry.mesh) == (0.9, 0.4, "4-L12TM")
    clad, veneer = standard_footing("M", "clad_frame"), standard_footing("M", "masonry_veneer")
    assert (clad.depth, clad.width, clad.mesh) == (0.4, 0.3, "3-L11TM")
    assert (veneer.depth, veneer.width, veneer.mesh) == (0.5, 0.3, "3-L12TM")
    for standard in standard_footings():
        wires = int(standard.mesh[0])
        assert 0.1 * (wires - 1) < standard.width  # wires 100 mm apart fit
        Footing(depth=standard.depth, width=standard.width, concrete=ReinforcedConcrete(bottom=standard.mesh))


def test_what_the_table_does_not_have_is_told():
    with pytest.raises(InputError, match=r"'M full_masonary'.*Did you mean 'M full_masonry'"):
        standard_footing("M", "full_masonary")
