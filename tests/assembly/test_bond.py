"""How the bricks lie, counted and measured without the code that lays them."""

import math
from pathlib import Path

import numpy as np
import pytest

from damagepred.assembly.bond import _closed, gauge, lay_bricks
from damagepred.errors import InputError
from damagepred.scene import ControlJoint, Opening, Scene, Wall


@pytest.fixture(scope="module")
def solid(data_folder: Path) -> Scene:
    return Scene.from_toml(data_folder / "bryant_dishing.toml")


@pytest.fixture(scope="module")
def window(data_folder: Path) -> Scene:
    return Scene.from_toml(data_folder / "bryant_window_dishing.toml")


def box(scene: Scene) -> np.ndarray:
    """Left, bottom, right, top, course of every brick."""
    return np.array(lay_bricks(scene))


def test_bryant_wall_has_816_bricks_in_32_courses_of_25_and_26(solid: Scene):
    bricks = box(solid)
    assert len(bricks) == 816
    counts = np.bincount(bricks[:, 4].astype(int))
    assert counts.tolist() == [25, 26] * 16


def test_window_jambs_have_half_bricks_in_every_other_course(window: Scene):
    bricks = box(window)
    beside = bricks[(bricks[:, 1] > 0.9 - 1e-9) & np.isclose(bricks[:, 2], 2.55)]
    assert len(beside) == 20
    width = (beside[:, 2] - beside[:, 0])[np.argsort(beside[:, 4])]
    half = 2.55 / 21  # gauged: 21 half bricks to the jamb
    expected = [half if course % 2 == 0 else 2 * half for course in range(12, 32)]
    np.testing.assert_allclose(width, expected, rtol=1e-12)


def test_a_perpend_a_quarter_from_an_end_moves_to_a_half_unless_the_other_course_has_one_there():
    perpends, ends = frozenset({0, 1, 4, 7, 8}), {0, 8}
    assert _closed(perpends, frozenset({0, 3, 5, 8}), ends) == {0, 2, 4, 6, 8}  # queen closers
    assert _closed(perpends, frozenset({0, 2, 6, 8}), ends) == {0, 4, 8}  # three-quarter bats


def lintels(scene: Scene) -> list[tuple[float, float, float, float]]:
    """Blocks that lie across an opening's head."""
    return [
        tuple(b[:4])
        for b in lay_bricks(scene)
        for hole in scene.opening
        if math.isclose(b.bottom, hole.top) and b.left < hole.x + 1e-9 and b.right > hole.right - 1e-9
    ]


@pytest.mark.parametrize("bond", ["running", "english", "flemish", "header"])
def test_a_lintel_at_an_end_of_the_wall_bears_on_one_side(bond: str):
    wall = Wall(length=3.6, height=2.4, bond=bond)
    door = {"kind": "door", "width": 0.96, "height": 1.2, "lintel_bearing": 0.36}
    for x, ends in ((0.0, (0.0, 1.32)), (2.64, (2.28, 3.6))):
        ((left, bottom, right, top),) = lintels(Scene(wall=wall, opening=(Opening(x=x, **door),)))
        assert (left, right) == pytest.approx(ends)
        assert (bottom, top) == pytest.approx((1.2, 1.275))
    gap = box(Scene(wall=wall, opening=(Opening(kind="door", x=2.64, width=0.96, height=2.4),)))
    assert gap[:, 2].max() == pytest.approx(2.64)


def test_lintels_that_meet_are_refused():
    side_by_side = (Opening(x=2.0, y=0.9, width=0.9, height=0.9), Opening(x=3.01, y=0.9, width=0.9, height=0.9))
    with pytest.raises(InputError, match="lintels overlap"):
        lay_bricks(Scene(opening=side_by_side))
    long = Opening(x=2.0, y=0.9, width=0.9, height=0.9, lintel_bearing=0.24)
    taller = (long, Opening(x=3.01, y=0.9, width=0.9, height=1.2))
    with pytest.raises(InputError, match=r"reaches into the opening at x = 3.01 m; move one of them or shorten"):
        lay_bricks(Scene(opening=taller))


def mirrored(scene: Scene) -> Scene:
    tables = scene.to_dict()
    for hole in tables.get("opening", []):
        hole["x"] = scene.wall.length - hole["x"] - hole["width"]
    return Scene.from_dict(tables)


@pytest.mark.parametrize("name", ["bryant_dishing", "bryant_window_doming", "left of centre", "door and window"])
def test_a_mirrored_wall_has_mirrored_bricks(name: str, data_folder: Path):
    if name.startswith("bryant"):
        scene = Scene.from_toml(data_folder / f"{name}.toml")
    elif name == "left of centre":
        scene = Scene(opening=(Opening(x=1.2, y=0.9, width=0.96, height=0.9, lintel_bearing=0.18),))
    else:
        scene = Scene(
            opening=(
                Opening(kind="door", x=0.96, width=0.96, height=2.1),
                Opening(x=3.6, y=0.9, width=1.2, height=1.2, lintel_bearing=0.3),
            )
        )
    halves = len(gauge(scene).x) - 1
    assert halves % 2 == 0  # else the bond itself is not symmetric
    bricks, image = box(scene), box(mirrored(scene))
    length = scene.wall.length
    image = np.column_stack((length - image[:, 2], image[:, 1], length - image[:, 0], image[:, 3], image[:, 4]))
    order = np.lexsort((np.round(image[:, 0], 6), image[:, 4]))
    np.testing.assert_allclose(bricks, image[order], atol=1e-9)


def crossed(scene: Scene, x: float) -> set[int]:
    """Courses of which a brick lies across an upright line."""
    bricks = box(scene)
    return set(bricks[(bricks[:, 0] < x - 1e-9) & (bricks[:, 2] > x + 1e-9), 4].astype(int).tolist())


def test_no_control_joint_parts_a_lintel():
    window = Opening(x=2.55, y=0.9, width=0.9, height=1.2)
    for x in (2.55, 3.0, 3.5):
        with pytest.raises(InputError, match=r"lintel of the opening at x = 2\.55 m, which lies from 2\.4"):
            lay_bricks(Scene(opening=(window,), control_joint=(ControlJoint(x=x),)))
    beside = Scene(opening=(window,), control_joint=(ControlJoint(x=2.43),))
    assert not crossed(beside, 2.43)
    to_the_top = Opening(x=2.55, y=0.9, width=0.9, height=1.5)
    for x in (2.55, 3.0):
        assert not crossed(Scene(opening=(to_the_top,), control_joint=(ControlJoint(x=x),)), x)


@pytest.mark.parametrize("offset", [0.0, 0.07, 0.2])
def test_a_cut_wall_with_a_window_is_filled(offset: float):
    hole = Opening(x=1.0, y=0.6, width=0.9, height=0.75)
    wall = Wall(length=3.1, height=1.8, fit="cut", bond_offset=offset)
    bricks = lay_bricks(Scene(wall=wall, opening=(hole,)))
    area = sum((b.right - b.left) * (b.top - b.bottom) for b in bricks)
    assert area == pytest.approx(3.1 * 1.8 - 0.9 * 0.75)
    assert min(b.right - b.left for b in bricks) > 0.059
