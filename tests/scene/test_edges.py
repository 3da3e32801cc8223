"""Limits of valid scenes, and error messages word for word."""

import math
from pathlib import Path
from typing import Any

import pytest

from damagepred.errors import InputError
from damagepred.scene import Mound, Movement, ReinforcedConcrete, Rig, Scene, Soil
from damagepred.scene.assumed import _ground_values, assumed_ground, ground_line

WINDOW = {"x": 2.0, "y": 0.9, "width": 1.0, "height": 1.0}
DOOR = {"kind": "door", "x": 4.5, "width": 0.9, "height": 2.0}


def window(**keys: float) -> dict[str, Any]:
    return {"opening": [WINDOW | keys]}


def joints(*places: float) -> dict[str, Any]:
    return {"control_joint": [{"x": x} for x in places]}


def on_dpc(**keys: float) -> dict[str, Any]:
    return {"dpc": {}, "opening": [DOOR, WINDOW | keys]}


def courses(height: float, *course: int) -> dict[str, Any]:
    return {"wall": {"height": height}, "dpc": {"course": course[0]} if course else {}}


def side_by_side(gap: float) -> dict[str, Any]:
    return {"opening": [WINDOW, WINDOW | {"x": 3 + gap}]}


def rig(supports: list[float], *jacks: float) -> dict[str, Any]:
    return {"movement": JACKS, "rig": {"supports": supports} | ({"jacks": list(jacks)} if jacks else {})}


def mound(kind: str, size: float) -> dict[str, Any]:
    return {"movement": MOUND | {"kind": kind}, "mound": {"surface_movement": size}}


MOUND, JACKS = {"shape": "mound"}, {"shape": "jacks"}
# what just fits, what just does not, what is said of it; lengths of 6 m are compared to 6e-9 m
EDGES = {
    "right edge": (window(width=4 + 5e-9), window(width=4 + 7e-9), "opening 1 (window): x + width = 6 m reaches"),
    "head": (window(height=1.5 + 5e-9), window(height=1.5 + 7e-9), "opening 1 (window): y + height = 2.4 m reaches"),
    "all its width": (
        window(x=0.12, width=5.76),
        window(x=0.0, width=6 - 5e-9),
        "6 m leaves no wall beside it; make it narrower",
    ),
    "width": (window(width=0.00601), window(width=0.00599), "the width is 0.00599 m and would vanish"),
    "height": (window(height=0.00376), window(height=0.00374), "the height is 0.00374 m and would vanish as bricks"),
    "left": (
        window(x=0.1081),
        window(x=0.1079),
        "the pier to its left is 0.1079 m, thinner than half a brick (0.12 m)",
    ),
    "right": (
        window(x=4.8919),
        window(x=4.8921),
        "right is 0.1079 m, thinner than half a brick (0.12 m); the nearest x",
    ),
    "below": (
        window(y=0.0676),
        window(y=0.0674),
        "thinner than a course (0.075 m); the nearest y that works is 0.075 m",
    ),
    "above": (
        window(y=1.3324),
        window(y=1.3326),
        "the strip above it is 0.0674 m, thinner than a course (0.075 m); the ",
    ),
    "at the left": (window(x=5e-9), window(x=7e-9), "left is 7e-09 m and would vanish as bricks are laid; take more t"),
    "at the bottom": (window(y=5e-9), window(y=7e-9), "the strip of wall below it is 7e-09 m and would vanish"),
    "beside each other": (side_by_side(2e-9), side_by_side(5e-10), "overlap or touch: x 2-3 m and 3-4 m"),
    "window on the dpc": (
        on_dpc(y=0.113),
        on_dpc(y=0.112),
        "dpc.course = 2: the dpc would lie 0.15 m up, in opening 2 (window), which reaches from 0.112 to 1.112 m",
    ),
    "window below the dpc": (on_dpc(y=0.075, height=0.0749), on_dpc(y=0.075, height=0.076), "in opening 2 (window), "),
    "three": (courses(0.26), courses(0.26, 3), "the wall has 3 courses, so the dpc can lie on top of 1 to 2 of them"),
    "dpc of half a course": (courses(0.2625, 3), courses(0.2624, 3), "the wall has 3 courses"),
    "dpc of one course": (courses(0.113, 1), courses(0.08, 1), "the wall has 1 courses"),
    "first control joint": (
        joints(3.0, 0.12),
        joints(3.0, 0.1199),
        "control joint 2: x = 0.1199 m must lie half a brick (0.12 m) or more from the ends of the wall (0 and 6 m)",
    ),
    "last control joint": (joints(3.0, 5.88), joints(3.0, 5.8801), "control joint 2: x = 5.8801 m must lie half"),
    "control joint outside": (joints(5.0), joints(6.0), "control joint 1: x = 6 m must lie half a brick"),
    "two control joints": (joints(3.12, 3.0), joints(3.1199, 3.0), "control joint 1: x = 3.1199 m must lie half"),
    "one twice": (joints(3.0), joints(3.0, 3.0), "control joint 1: x = 3 m must lie"),
    "control joint in time": (joints(3.0), joints(3.0) | {"dynamics": {}}, "a run in time has no control joints"),
    "jacks in time": ({"movement": MOUND, "dynamics": {}}, {"movement": JACKS, "dynamics": {}}, "in time has no jacks"),
    "deflection": (
        {"movement": {"central_deflection": 0.6}},
        {"movement": {"central_deflection": 0.6001}},
        "movement.central_deflection = 0.6001 m: more than a tenth of the wall's length (6 m)",
    ),
    "doming mound": (mound("doming", 0.857), mound("doming", 0.858), "= 0.858 m: it"),
    "dishing mound": (
        mound("dishing", 1.199),
        mound("dishing", 1.201),
        "= 1.201 m: it moves the ground by more than a tenth of the wall's length (6 m), outside the small rotations",
    ),
    "right support": (rig([0.0, 6 + 5e-9]), rig([0.0, 6 + 7e-9]), "rig.supports: 6 m is outside the wall"),
    "left jack": (rig([1.0, 5.0], -5e-9), rig([1.0, 5.0], -7e-9), "rig.jacks: -7e-09 m is outside the wall"),
    "jack beside a support": (
        rig([0.0, 3 - 7e-9]),
        rig([0.0, 3 - 5e-9]),
        "rig.jacks: 3 m is the position of a support, which would take the whole load; move the jack or the support",
    ),
    "bottom wires": (
        {"footing": {"concrete": {"bottom": "2x l12tm", "top": " None"}}},
        {"footing": {"concrete": {"bottom": "4-L10TM", "top": "none"}}},
        "bottom = '4-L10TM': must be a number of wires and a mesh, "
        "such as '3-L11TM'; the meshes are L8TM, L11TM, L12TM. Did you mean '4-L1",
    ),
    "deflection that is read": (
        {"movement": MOUND | {"central_deflection": 0.7}},
        {"movement": {"shape": "arc", "central_deflection": 0.7}},
        "= 0.7 m: more",
    ),
}


@pytest.mark.parametrize("name", EDGES)
def test_edges(name: str) -> None:
    fits, fails, words = EDGES[name]
    Scene.from_dict(fits)
    with pytest.raises(InputError) as caught:
        Scene.from_dict(fails)
    assert words in str(caught.value)


SOIL = "shrinking soil of 5000 kPa/m"


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


def test_a_value_in_the_file_is_no_assumption_even_if_it_is_the_default(tmp_path: Path) -> None:
    file = tmp_path / "tree.toml"
    movement = '[movement]\nshape = "mound"\nkind = "settle"\n'
    file.write_text(f'{movement}[mound]\nshape = "tree"\n')
    assert assumed_ground(Scene.from_toml(file)) == ["ground movement at the tree = 40 mm", SOIL]
    file.write_text(f'{movement}[mound]\nshape = "tree"\nsurface_movement = "40 mm"\n')
    assert assumed_ground(Scene.from_toml(file)) == [SOIL]


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


def test_rig_and_concrete_by_hand() -> None:
    assert Rig().jack_places(8.0) == (2.0, 4.0, 6.0)
    concrete = ReinforcedConcrete(grade="N40", bottom="3-L11TM", top="5 L8TM")
    assert concrete.flexural_strength == pytest.approx(0.6 * math.sqrt(40) * 1e6, rel=1e-12)  # 3.79 MPa
    assert [concrete.bottom_wires[0], concrete.top_wires[0]] == pytest.approx([3 * 89.9e-6, 5 * 45.4e-6], rel=2e-3)
