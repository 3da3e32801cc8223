"""Limits of valid scenes, and error messages word for word."""

import math

import numpy as np
import pytest

from damagepred.scene import Mound, Movement, Rig, Scene, Soil
from damagepred.scene.assumed import _ground_values, assumed_ground, ground_line
from damagepred.scene.concrete import ReinforcedConcrete


def test_ground_in_words() -> None:
    """Each number in its unit; H_s where the edge of the mound follows from it; what differs is not assumed."""
    soil = {"swelling_stiffness": 2.5e6, "shrinking_stiffness": 7.25e6}
    mound = {"surface_movement": 0.045, "suction_depth": 2.3}
    expected = {
        ("walsh", "doming"): ["y_s = 45 mm", "H_s = 2.3 m", "shrinking soil of 7250 kPa/m"],
        ("walsh", "dishing"): ["y_s = 45 mm", "swelling soil of 2500 kPa/m"],
        ("mitchell", "dishing"): ["y_s = 45 mm", "H_s = 2.3 m", "swelling soil of 2500 kPa/m"],
        ("tree", "doming"): ["ground movement at the tree = 45 mm", "shrinking soil of 7250 kPa/m"],
    }
    for (shape, kind), words in expected.items():
        scene = Scene(movement=Movement(shape="mound", kind=kind), soil=Soil(**soil), mound=Mound(shape=shape, **mound))
        assert list(_ground_values(scene).values()) == words
        assert (assumed_ground(scene), ground_line(scene)) == ([], None)
    by_hand = Mound(shape="mitchell", exponent=2.0, suction_depth=2.3)
    scene = Scene(movement=Movement(shape="mound", kind="doming"), mound=by_hand, soil=Soil(swelling_stiffness=3e6))
    assert ground_line(scene, ("mound.surface_movement",)) == (
        "ground: mitchell mound, doming; by default shrinking soil of 5000 kPa/m. Give your site's in [mound] and "
        "[soil]: soil softer than the real one underestimates damage."
    )
    edge = Mound(edge_distance=1.0, suction_depth=2.3)
    scene = Scene(movement=Movement(shape="mound", kind="doming"), mound=edge)
    assert list(_ground_values(scene)) == ["mound.surface_movement", "soil.shrinking_stiffness"]


def test_which_movements_keep_their_form() -> None:
    shapes = ("three_loads", "parabola", "jacks", "mound", "arc")
    assert [Movement(shape=s).proportional for s in shapes] == [True] * 4 + [False]
    mound = Mound(surface_movement=0.06, suction_depth=2.3)
    part = mound.at(0.25)
    assert (part.surface_movement, part.suction_depth) == (0.015, 2.3)
    # half of 0.5 m is less than H_s / 8, and 0.2 x 2.5 m than 0.6 m: there the edge distance is the same throughout
    found = [
        mound.proportional(length, kind)
        for length, kind in ((0.5, "doming"), (8.0, "doming"), (2.5, "dishing"), (20.0, "dishing"))
    ]
    assert found == [True, False, True, False]
    assert all(Mound(shape=shape).proportional(8.0, "doming") for shape in ("mitchell", "tree", "pipe"))
    assert (Mound(shape="pipe").extent(5.0), Mound(shape="tree").extent(5.0)) == (2.5, 5.0)
    assert Mound(shape="tree").axis(5.0) == 0.0


def test_an_arc_is_part_of_a_circle_by_hand() -> None:
    """A rise of 1.5 m over 6 m: radius 3.75 m; at a quarter of the chord sqrt(3.75^2 - 1.5^2) - 2.25."""
    movement = Movement(shape="arc", kind="doming", central_deflection=3.0)
    at_quarter = math.sqrt(3.75**2 - 1.5**2) - 2.25
    rise = movement.profile(np.array([0.0, 1.5, 3.0]), 6.0, load_factor=0.5)
    np.testing.assert_allclose(rise, [0.0, at_quarter, 1.5], atol=1e-12)


def test_rig_and_concrete_by_hand() -> None:
    assert Rig().jack_places(8.0) == (2.0, 4.0, 6.0)
    concrete = ReinforcedConcrete(grade="N40", bottom="3-L11TM", top="5 L8TM")
    assert concrete.flexural_strength == pytest.approx(0.6 * math.sqrt(40) * 1e6, rel=1e-12)  # 3.79 MPa
    assert [concrete.bottom_wires[0], concrete.top_wires[0]] == pytest.approx([3 * 89.9e-6, 5 * 45.4e-6], rel=2e-3)
