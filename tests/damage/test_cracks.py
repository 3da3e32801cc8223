"""Which joints make one crack, how wide it is, and where."""

import numpy as np
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


def test_psi_weighs_cracks_by_displacement_and_length_and_counts_those_that_slid():
    wall = Pattern()
    wall.vertical(4, 2 * MM)  # six head joints and the five beds between, of half a brick
    wall.slide("bed", 10, 3, 3 * MM)
    long, short = found = cracks(wall).length
    assert found.tolist() == [max(found), min(found)]
    assert cracks(wall).joints.tolist() == [11]
    mean = (2.0**2 * long + 3.0**2 * short) / (2.0 * long + 3.0 * short)
    assert wall.judge().psi == pytest.approx(2 * 2**0.15 * mean**0.3)
    wall.slide("head", 4, 2, 1.5 * MM)
    assert cracks(wall).displacement[0] == pytest.approx(np.hypot(2, 1.5) * MM)


def test_a_closed_crack_is_none():
    wall = Pattern()
    wall.open("head", 4, 2, -1 * MM)
    assert len(cracks(wall).width) == 0


def test_partly_cracked_joint_counts_where_it_is_cracked():
    wall = Pattern()
    wall.open("bed", 4, 3, (2 * MM, 1 * MM, 0.5 * MM))
    wall.cracked[wall.place("bed", 4, 3), 0] = False
    assert cracks(wall).width.tolist() == [1 * MM]
