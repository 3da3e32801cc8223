"""Drawings of a house: plan, walls unfolded in rows, axonometric drawing with joined corners, moving picture."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from matplotlib.colors import to_hex
from PIL import Image

import damagepred
from damagepred.plotting import save_animation, save_wall_pictures
from damagepred.plotting.colours import CATEGORY_COLOURS
from damagepred.plotting.geometry import Deformed
from damagepred.plotting.house import _lean, draw_axonometric, draw_plan, draw_unfolded
from damagepred.results.house import house_of, unfolded, unfolded_places
from damagepred.scene import Scene

PLAN = {"front": ([0, 0], [2.4, 0]), "right": ([2.4, 0], [2.4, 1.2]), "slanted": ([2.4, 1.2], [0, 0])}


def house(ends=PLAN, **more):
    walls = [{"name": n, "start": a, "end": b, "height": 0.45, **more.get(n, {})} for n, (a, b) in ends.items()]
    mound = {"shape": "tree", "point": [0, 0], "reach": 1.5, "surface_movement": "30 mm"}
    joint = {"tensile_strength": 1e4, "cohesion": 2e4}
    tables = {"wall": walls, "mound": mound, "joint": joint, "movement": {"kind": "settle", "increments": 2}}
    return Scene.from_dict({"title": "a $ house", **tables})


@pytest.fixture(scope="module")
def solved():
    return damagepred.solve(house(front={"opening": [{"x": 1.2, "y": 0.15, "width": 0.48, "height": 0.15}]}))


def texts(ax):
    return [text.get_text().replace("\n", " ") for text in ax.texts]


def test_the_plan_has_walls_in_the_colour_of_their_category(solved):
    ax, category = draw_plan(house_of(solved), solved), solved["wall_damage_category"].values[-1].tolist()
    walls = [line for line in ax.lines if line.get_linewidth() == 6.0]
    assert [to_hex(line.get_color()) for line in walls] == [CATEGORY_COLOURS[c] for c in category]
    assert texts(ax)[1:] == [f"{name}: {c}" for name, c in zip(PLAN, category)]


def test_the_name_of_a_wall_stands_at_its_longest_part_between_corners():
    ends = {"front": ([0, 0], [6, 0]), "cross": ([3.6, 0], [3.6, 2.4])}
    ax = draw_plan(house(ends))
    assert ax.texts[1].xy == pytest.approx((1.8, 0))


def test_the_unfolded_drawing_names_the_widest_crack_of_each_wall(solved):
    ax, widths = draw_unfolded(solved), 1e3 * solved["wall_crack_width_max"].values[-1]
    shown = texts(ax)
    assert widths.max() > 0.1
    for name, width, category in zip(PLAN, widths, solved["wall_damage_category"].values[-1]):
        assert f"{name}: {width:.2f} mm, category {category}" in shown
        assert (f"{width:.2f}" in shown) == (width > 0.02)
    outlines, wall_of = np.array(Deformed.of(unfolded(solved), -1, None).outlines), solved["block_wall"].values
    titles = {text.get_text().partition(":")[0]: text.xy[1] for text in ax.texts if ":" in text.get_text()}
    for number, name in enumerate(PLAN):  # each close above its own wall, however far it rose
        top = outlines[wall_of == number, :, 1].max()
        assert titles[name] == pytest.approx(top)
    below = [text for text in shown if text in PLAN]
    assert sorted(below) == sorted(2 * list(PLAN))  # at each end the wall it meets


def test_words_of_the_unfolded_drawing_lie_apart():
    """Also of short walls in several rows."""
    a, b, c, d = ([0, 0], [2.4, 0], [2.4, 1.2], [1.2, 1.2])
    ends = {"front": (a, b), "right": (b, c), "back": (c, d), "stub": ([0, 1.2], a), "low": ([1.2, 0], d)}
    ds = damagepred.solve(house(ends), increments=1)
    ax = draw_unfolded(ds)
    ax.figure.draw_without_rendering()
    boxes = [(text.get_text(), text.get_window_extent()) for text in ax.texts if not text.get_bbox_patch()]
    for (words, box), (others, other) in combinations(boxes, 2):
        assert not box.overlaps(other), (words, others)


@pytest.mark.parametrize(("lengths", "rows"), [([6.0], 1), ([6.0, 4.8, 6.0, 4.8], 2), ([7.2] * 9, 3), ([30.0, 2.4], 2)])
def test_walls_stand_in_rows_without_overlap(lengths, rows):
    ends, x = {}, 0.0
    for number, length in enumerate(lengths):
        ends[f"w{number}"] = ([x, 0], [x + length, 0])
        x += length
    made = Scene.from_dict(
        {"wall": [{"name": n, "start": a, "end": b, "height": 2.4} for n, (a, b) in ends.items()]}
        | {"mound": {"shape": "tilt", "surface_movement": 0.01}, "movement": {"kind": "settle"}}
    )
    places = unfolded_places(made)
    levels = sorted({y for _, y in places}, reverse=True)
    assert len(levels) == rows
    assert all(a - b > 2.4 for a, b in pairwise(levels))
    for level in levels:
        spans = [(x, x + length) for (x, y), length in zip(places, lengths) if y == level]
        assert all(end < start for (_, end), (start, _) in pairwise(spans))


def test_a_house_that_moves_as_one_keeps_its_shape_in_the_axonometric_drawing(solved):
    plan, moved = house_of(solved), np.array([3e-3, -5e-3])
    shifted, wall_of = solved.copy(deep=True), solved["block_wall"].values
    along = np.array([wall.direction @ moved for wall in plan.wall])
    for name in ("displacement_y", "rotation"):
        shifted[f"block_{name}"].values[:] = 0.0
    shifted["block_displacement_x"].values[:] = along[wall_of]
    drawn = Deformed.of(unfolded(shifted), -1, 1.0)
    places = np.array(unfolded_places(plan))[wall_of[drawn.block]]
    lean = _lean(plan, drawn.points - places, drawn.shape - drawn.points, wall_of[drawn.block])
    for number, wall in enumerate(plan.wall):
        across = wall.direction[::-1] * [-1.0, 1.0] @ moved
        assert lean(number, np.array([[0.1, 0.2], [0.9, 0.4]])) == pytest.approx([across, across])


def test_pictures_of_a_house(solved, tmp_path):
    assert [file.name for file in save_wall_pictures(solved, tmp_path)] == ["plan.png", "unfolded.png", "house.png"]
    with Image.open(save_animation(solved, tmp_path / "house.gif")) as moving:
        assert moving.n_frames == 3
    ax = draw_axonometric(solved, increment=0)
    assert "2 walls damaged" not in ax.get_title(loc="left")
    assert [text for text in texts(ax) if text.startswith("front")] == ["front: 0"]
