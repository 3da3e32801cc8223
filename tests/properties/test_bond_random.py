"""Any wall with any openings: bricks cover the solid area exactly once, and share edges everywhere."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from damagepred.assembly import wall_geometry
from damagepred.assembly.bond import lay_bricks
from damagepred.assembly.geometry import refuse_overlaps
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.scene import Scene
from damagepred.scene.described import build
from tests.properties.strategies import openings

LENGTHS = st.integers(100, 800).map(lambda v: v / 100)
HEIGHTS = st.integers(30, 300).map(lambda v: v / 100)


@st.composite
def walls(draw: st.DrawFn) -> Scene:
    length, height = draw(LENGTHS), draw(HEIGHTS)
    tables = {
        "wall": {
            "length": length,
            "height": height,
            "block_length": draw(st.sampled_from([0.24, 0.29, 0.4, 0.5])),
            "block_height": draw(st.sampled_from([0.075, 0.086, 0.1, 0.2])),
            "bond": draw(st.sampled_from(["running", "running", "stack"])),
        },
        "opening": draw(openings(length, height)),
    }
    if tables["opening"] and draw(st.booleans()):  # another one anywhere, above or below the others
        x, y = draw(st.integers(0, round(100 * length) - 5)), draw(st.integers(1, round(100 * height) - 2))
        w, h = draw(st.integers(5, 100)), draw(st.integers(1, 100))
        tables["opening"].append({"x": x / 100, "y": y / 100, "width": w / 100, "height": h / 100})
    if draw(st.booleans()):
        tables["dpc"] = {"course": 1}
    try:
        scene = build(Scene, tables, "scene")  # thin piers and strips, too
        wall_geometry(scene)
    except InputError as error:  # lintels that meet, openings that overlap or hold the dpc: refused in plain words
        assume(
            not any(
                word in str(error)
                for word in ("lintel", "overlap or touch", "outside", "beside", "courses", "the dpc", "would vanish")
            )
        )
        raise
    # edges closer than a twentieth of a joint's spacing count as one; that is tested elsewhere
    for values, spacing in (
        ([0, length] + [e for o in scene.opening for e in (o.x, o.right)], scene.wall.block_length / 2),
        ([0, height] + [e for o in scene.opening for e in (o.y, o.top)], scene.wall.block_height),
    ):
        gaps = np.diff(np.unique(np.round(values, 9)))
        assume(gaps.min() > 0.05 * spacing + 1e-6)
    return scene


def solid(scene: Scene, y: float) -> list[tuple[float, float]]:
    """Intervals of x in which the wall is solid at a height, from the openings alone."""
    cuts = [(o.x, o.right) for o in scene.opening if o.y - 1e-9 < y < o.top + 1e-9]
    spans, left = [], 0.0
    for a, b in sorted(cuts):
        if a > left + 1e-9:
            spans.append((left, a))
        left = b
    return spans + ([(left, scene.wall.length)] if left < scene.wall.length - 1e-9 else [])


def common(first: list[tuple[float, float]], second: list[tuple[float, float]]) -> float:
    return sum(max(0.0, min(b, d) - max(a, c)) for a, b in first for c, d in second)


@pytest.mark.thorough
@settings(max_examples=100, deadline=None, derandomize=True)
@given(walls())
def test_walls(scene: Scene):
    wall = scene.wall
    bricks = np.array(lay_bricks(scene))
    geometry = wall_geometry(scene)
    blocks, face = geometry.blocks, geometry.interfaces
    n = len(bricks)

    # blocks: convex rectangles of positive size that cover what is solid exactly once
    assert (blocks.area > 0).all()
    assert blocks.area.sum() == pytest.approx(
        wall.length * wall.height - sum(o.width * o.height for o in scene.opening), rel=1e-9
    )
    refuse_overlaps(blocks.vertices, blocks.first_vertex, 1e-7)
    left, bottom, right, top, course = bricks.T
    assert left.min() >= 0.0
    assert right.max() <= wall.length * (1 + 1e-15)
    for o in scene.opening:
        inside = (left < o.right - 1e-6) & (right > o.x + 1e-6) & (bottom < o.top - 1e-6) & (top > o.y + 1e-6)
        assert not inside.any()

    # interfaces: all of positive length, and on every bed line as much as is solid on both sides
    assert (face.length > 1e-6).all()
    inner = face.block_a < n
    level = face.normal_y > 0.5
    levels = np.unique(np.round(np.concatenate((bottom, top)), 9))
    beds = inner & level
    heights = np.round(face.y, 9)
    for y in levels[1:-1]:
        expected = common(solid(scene, y - 1e-5), solid(scene, y + 1e-5))
        assert face.length[beds & (np.abs(heights - y) < 1e-6)].sum() == pytest.approx(expected, abs=1e-6)
    ground = face.kind == ContactKind.FOOTING_INTERFACE
    assert face.length[ground].sum() == pytest.approx(sum(b - a for a, b in solid(scene, 1e-5)), abs=1e-6)
    assert (ground == ~inner).all()

    # on top of each brick, no point is touched twice
    for below in np.unique(face.block_a[beds]):
        mine = beds & (face.block_a == below)
        start = np.sort(face.x[mine] - face.length[mine] / 2)
        end = np.sort(face.x[mine] + face.length[mine] / 2)
        assert (start[1:] > end[:-1] - 1e-9).all()
        assert start[0] > left[below] - 1e-9
        assert end[-1] < right[below] + 1e-9

    # perpends: one fewer than bricks in every run of a course
    for c in np.unique(course).astype(int):
        y = (bottom[course == c][0] + top[course == c][0]) / 2
        runs = len(solid(scene, y))
        heads = inner & ~level & (np.abs(face.y - y) < 1e-6)
        assert heads.sum() == (course == c).sum() - runs
        np.testing.assert_allclose(face.length[heads], top[course == c][0] - bottom[course == c][0], rtol=1e-9)

    # every edge of every brick is either shared or looks outside: the rim of the wall and of its openings
    perimeter = 2 * (right - left + top - bottom).sum()
    assert perimeter - 2 * face.length[inner].sum() == pytest.approx(rim(scene), rel=1e-9)


def rim(scene: Scene) -> float:
    """Length of the outline of the solid part, from the openings alone."""
    wall = scene.wall
    total = 2 * (wall.length + wall.height)
    for o in scene.opening:
        for length, at_edge in (
            (o.width, o.y < 1e-9),
            (o.width, o.top > wall.height - 1e-9),
            (o.height, o.x < 1e-9),
            (o.height, o.right > wall.length - 1e-9),
        ):
            total += -length if at_edge else length
    return total
