"""Which joints make one crack, how wide it is, and where."""

import pytest

from damagepred.damage import Cracks, find_cracks
from tests.damage.pattern import Pattern

MM = 1e-3


def cracks(wall: Pattern) -> Cracks:
    return find_cracks(wall.map, wall.opening, wall.slip, wall.cracked)


def test_psi_of_one_crack_of_a_tenth_of_a_millimetre_is_one():
    wall = Pattern()
    assert wall.judge().psi == 0.0
    wall.open("head", 4, 2, 0.1 * MM)
    assert wall.judge().psi == pytest.approx(2 * 0.1**0.3)
    assert wall.judge().psi == pytest.approx(1.0, abs=0.003)


def test_a_closed_crack_is_none():
    wall = Pattern()
    wall.open("head", 4, 2, -1 * MM)
    assert len(cracks(wall).width) == 0


def test_partly_cracked_joint_counts_where_it_is_cracked():
    wall = Pattern()
    wall.open("bed", 4, 3, (2 * MM, 1 * MM, 0.5 * MM))
    wall.cracked[wall.place("bed", 4, 3), 0] = False
    assert cracks(wall).width.tolist() == [1 * MM]


# -- real walls: every corner must be found, wherever rounding puts it -----------------------------------------------
