from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

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
