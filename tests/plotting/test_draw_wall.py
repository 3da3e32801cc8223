from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.errors import InputError
from damagepred.plotting import draw_cracks, draw_wall
from damagepred.plotting.geometry import Faces, Motion, ground_profile, round_exaggeration
from damagepred.scene import Movement


def test_gaps_are_as_wide_as_the_stored_openings(cracked):
    faces = Faces.of(cracked, -1)
    joints = faces.joints
    a, b = joints.blocks.T
    inner = (a >= 0) & (b >= 0)
    assert (inner == (joints.kind != 3)).all()
    along = (joints.end - joints.start) / joints.length[:, None]
    normal = np.column_stack((-along[:, 1], along[:, 0]))
    motion = Motion.of(cracked, -1)
    widest = np.full(len(a), -np.inf)
    for end in (joints.start, joints.end):
        jump = motion.at(b, end) - motion.at(a, end)
        widest = np.maximum(widest, (jump * normal).sum(axis=1))
    # the default quadrature has contacts at both ends of an interface
    assert np.maximum(widest, 0.0)[inner] == pytest.approx(faces.opening[inner], abs=1e-9)


def test_ground_is_the_prescribed_profile(cracked):
    x, height, rise = ground_profile(cracked, -1)
    profile = Movement(kind="doming", central_deflection=6e-3).profile(x, 1.2)
    assert height == pytest.approx(np.zeros_like(x), abs=1e-12)
    assert rise == pytest.approx(profile, abs=1e-9)


def test_automatic_exaggeration_is_round_and_near_the_target():
    for largest in (1e-5, 3e-3, 8e-3, 0.04, 0.25):
        factor = round_exaggeration(np.array([[0.0, -largest]]), 6.0)
        assert factor == float(f"{factor:.2g}")
        assert 0.038 < factor * largest / 6.0 < 0.053 or factor in (1.0, 1000.0)
    assert round_exaggeration(np.zeros((3, 2)), 6.0) == 1.0


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


def test_the_legend_names_the_categories_that_are_drawn(cracked: xr.Dataset):
    ax = draw_cracks(cracked)
    opening = damagepred.crack_profile(cracked)["piece_opening"].values
    names = ["below 0.1 mm", "from 0.1 mm", "from 1 mm", "from 5 mm", "from 15 mm"]
    found = np.unique(np.searchsorted(np.array([0.1, 1.0, 5.0, 15.0]) * 1e-3, opening, side="right"))
    assert len(found) > 1
    told = [text.get_text() for text in ax.get_legend().get_texts()]
    assert [words for words in told if "category" in words] == [f"{names[c]} (category {c})" for c in found]
    assert "open or slid by more than 0.05 mm" in ax.get_title(loc="left").replace("\n", " ")
    timed = cracked.assign_coords(time=("increment", 0.25 * np.arange(cracked.sizes["increment"])))
    assert "cracks at 0.75 s" in draw_cracks(timed).get_title(loc="left")
