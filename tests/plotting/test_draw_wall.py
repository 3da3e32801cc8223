from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.errors import InputError
from damagepred.plotting import draw_wall
from damagepred.plotting.geometry import Faces, Motion, block_at, corners, ground_profile, polygons, round_exaggeration
from damagepred.scene import Movement


def collection(ax, label):
    return next(c for c in ax.collections if c.get_label() == label)


def quads(ax, label):
    return np.array([path.vertices[:4] for path in collection(ax, label).get_paths()])


def cracked_interfaces(ds: xr.Dataset, increment: int) -> set[int]:
    step = ds.isel(increment=increment)
    open_crack = (step.contact_state == 1) & (step.contact_opening > 0.05e-3) & (step.contact_kind < 2)
    return set(step.contact_interface.values[open_crack.values].tolist())


@pytest.mark.parametrize("increment", [0, 1, -1])
def test_one_crack_is_drawn_for_each_cracked_interface(cracked, increment):
    expected = cracked_interfaces(cracked, increment)
    assert len(quads(draw_wall(cracked, increment=increment), "cracks")) == len(expected)
    if increment == -1:
        assert len(expected) > 3


def test_corners_move_with_their_block(cracked):
    factor = 7.0
    ax = draw_wall(cracked, exaggeration=factor)
    drawn = np.concatenate([path.vertices[:-1] for path in collection(ax, "bricks").get_paths()])
    last = cracked.isel(increment=-1)
    for i in range(last.sizes["vertex"]):
        b = int(last.vertex_block[i])
        arm = np.array([last.vertex_x[i] - last.block_x[b], last.vertex_y[i] - last.block_y[b]])
        turn = float(last.block_rotation[b])
        motion = np.array([last.block_displacement_x[b], last.block_displacement_y[b]]) + turn * np.array(
            [-arm[1], arm[0]]
        )
        before = np.array([last.vertex_x[i], last.vertex_y[i]])
        assert drawn[i] == pytest.approx(before + factor * motion, abs=1e-12)


def test_points_turn_with_their_block_to_first_order_and_by_large_angles_in_full():
    turn = np.array([1e-4, 1.2, -2.5])
    x, y, moved = np.array([0.5, 1.0, -2.0]), np.array([0.1, 3.0, 0.7]), np.array([[0.1, 0.2], [0.3, -0.4], [1.0, 2.0]])
    points = np.array([[0.7, 0.4], [1.3, 2.5], [-2.6, 1.9]])
    for i, (dx, dy) in enumerate(points - np.column_stack((x, y))):
        (found,) = Motion(x, y, moved, turn).at(np.array([i]), points[i : i + 1])
        turned = np.array([np.cos(turn[i]) * dx - np.sin(turn[i]) * dy, np.sin(turn[i]) * dx + np.cos(turn[i]) * dy])
        full, small = turned - (dx, dy), turn[i] * np.array([-dy, dx])
        assert found == pytest.approx(moved[i] + (full if i else small), abs=1e-12)


def test_gaps_are_as_wide_as_the_stored_openings(cracked):
    points, block = corners(cracked)
    faces = Faces.of(cracked, -1)
    a, b = faces.neighbours(points, block)
    inner = (a >= 0) & (b >= 0)
    assert (inner == (faces.kind != 3)).all()
    motion = Motion.of(cracked, -1)
    widest = np.full(len(a), -np.inf)
    for end in (faces.start, faces.end):
        jump = motion.at(b, end) - motion.at(a, end)
        widest = np.maximum(widest, (jump * faces.normal).sum(axis=1))
    # the default quadrature has contacts at both ends of an interface
    assert np.maximum(widest, 0.0)[inner] == pytest.approx(faces.opening[inner], abs=1e-9)


def test_cracks_have_the_colour_of_their_category(cracked):
    from matplotlib.colors import to_rgba

    from damagepred.plotting.colours import CATEGORY_COLOURS

    ax = draw_wall(cracked)
    colours = {tuple(c) for c in collection(ax, "faces of cracks").get_colors()}
    faces = Faces.of(cracked, -1)
    width = faces.crack[faces.is_mortar & (faces.crack > 0.05e-3)]
    expected = np.searchsorted([0.1e-3, 1e-3, 5e-3, 15e-3], width, side="right")
    assert colours == {to_rgba(CATEGORY_COLOURS[c]) for c in expected}


def test_the_bar_of_widths_has_limits_and_categories(cracked):
    ax = draw_wall(cracked)
    (bar,) = ax.child_axes
    assert [t.get_text() for t in bar.get_xticklabels()] == ["0.1", "1", "5", "15"]
    assert bar.get_xticks() == pytest.approx([0.1, 1.0, 5.0, 15.0])
    label, *numbers = bar.texts
    assert label.get_text() == "crack width (mm), category in the bar"
    assert [(t.get_text(), t.get_position()[0]) for t in numbers] == [
        (str(c), pytest.approx((c + 0.5) / 5)) for c in range(5)
    ]


def test_a_long_wall_fills_its_picture_and_nothing_lies_on_the_title(cracked):
    long = cracked.copy(deep=True)
    for name in ("vertex_x", "block_x", "contact_x", "opening_left"):
        if name in long.variables:
            long[name] = 6.0 * long[name]  # 7.2 m by 0.3 m
    ax = draw_wall(long)
    ax.figure.canvas.draw()
    sheet, wall = ax.figure.bbox, ax.get_window_extent()
    assert wall.width > 0.85 * sheet.width
    (bar,) = ax.child_axes
    lowest_of_title = ax.title.get_window_extent().y0 if ax.get_title() else ax._left_title.get_window_extent().y0
    for text in (*bar.texts, *bar.get_xticklabels(), ax.xaxis.label):
        assert text.get_window_extent().y1 < wall.y0 + 1.0
    assert lowest_of_title > wall.y1


def test_ground_is_the_prescribed_profile(cracked):
    x, height, rise = ground_profile(cracked, -1)
    profile = Movement(kind="doming", central_deflection=6e-3).profile(x, 1.2)
    assert height == pytest.approx(np.zeros_like(x), abs=1e-12)
    assert rise == pytest.approx(profile, abs=1e-9)


def test_dpc_opening_is_drawn_apart_from_cracks(on_dpc):
    ax = draw_wall(on_dpc)
    last = on_dpc.isel(increment=-1)
    is_open = (last.contact_kind == 2) & (last.contact_opening > 0.05e-3)
    assert len(quads(ax, "dpc opening")) == len(np.unique(last.contact_interface.values[is_open.values]))
    assert len(collection(ax, "dpc").get_segments()) == len(np.unique(last.contact_interface[last.contact_kind == 2]))
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert f"dpc, opening at most {float(last.dpc_opening_max) * 1e3:.2f} mm" in texts


def test_title_and_axes_say_what_is_drawn(on_dpc):
    ax = draw_wall(on_dpc, exaggeration=10)
    title = ax.get_title(loc="left")
    assert "little wall on a dpc" in title
    assert "central deflection of 6 mm" in title
    assert "damage category 0 (negligible)" in title
    assert "10 times" in title
    assert ax.get_xlabel().endswith("(m)")
    assert ax.get_ylabel().endswith("(m)")
    assert ax.get_aspect() == 1.0
    assert "to scale" in draw_wall(on_dpc, exaggeration=1).get_title(loc="left")


def test_automatic_exaggeration_is_round_and_near_the_target():
    for largest in (1e-5, 3e-3, 8e-3, 0.04, 0.25):
        factor = round_exaggeration(np.array([[0.0, -largest]]), 6.0)
        assert factor == float(f"{factor:.2g}")
        assert 0.038 < factor * largest / 6.0 < 0.053 or factor in (1.0, 1000.0)
    assert round_exaggeration(np.zeros((3, 2)), 6.0) == 1.0


def test_blocks_are_found_by_place(cracked):
    points, block = corners(cracked)
    centre = np.column_stack((cracked.block_x, cracked.block_y))
    assert block_at(centre, points, block).tolist() == list(range(len(centre)))
    assert block_at(np.array([[-1.0, 0.1], [0.6, 9.0]]), points, block).tolist() == [-1, -1]
    assert len(polygons(points, block)) == len(centre)


def test_assembly_without_ground_or_cracks_is_drawn():
    assembly = damagepred.Assembly(thickness=0.1)
    for x in (0.0, 0.3):
        assembly.add_block([(x, 0.0), (x + 0.3, 0.0), (x + 0.3, 0.2), (x, 0.2)])
    assembly.support(0)
    ds = damagepred.solve(assembly, increments=1)
    ax = draw_wall(ds)
    assert len(quads(ax, "cracks")) == 0
    assert not any(c.get_label() == "footing" for c in ax.collections)


def test_status_is_told_at_the_end_of_a_path(cracked):
    ended = cracked.assign_attrs(status="collapsed", status_message="part of the wall collapsed in increment 3")
    assert "part of the wall collapsed" in draw_wall(ended).get_title(loc="left")
    assert "part of the wall collapsed" not in draw_wall(ended, increment=1).get_title(loc="left")


def test_wrong_input_is_named(cracked, study):
    with pytest.raises(InputError, match="vertex_x"):
        draw_wall(study)
    with pytest.raises(InputError, match="increment = 9"):
        draw_wall(cracked, increment=9)
    with pytest.raises(InputError, match="exaggeration"):
        draw_wall(cracked, exaggeration=float("nan"))


def test_given_axes_are_used(cracked):
    from damagepred.plotting.sheet import new_figure

    ax = new_figure().add_subplot()
    assert draw_wall(cracked, ax) is ax
