"""Drawings of one wall and of its scene: deformed, its footing, its path and its stresses."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import damagepred
from damagepred.damage import load_table
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.plotting import draw, draw_cracks, draw_scene, draw_wall, geometry
from damagepred.plotting.colours import MM, shade_bands
from damagepred.plotting.geometry import Deformed, footing_rise, ground_profile, open_stretches, round_exaggeration
from damagepred.plotting.pictures import save_scene_picture
from damagepred.plotting.sheet import height_to_scale, moved_to
from damagepred.plotting.stress import bending_stress, block_stress, stress_levels
from damagepred.scene import Mound, Movement, Scene


def test_gaps_are_as_wide_as_the_stored_openings(cracked):
    faces = geometry.Faces.of(cracked, -1)
    joints = faces.joints
    a, b = joints.blocks.T
    inner = (a >= 0) & (b >= 0)
    assert (inner == (joints.kind != 3)).all()
    along = (joints.end - joints.start) / joints.length[:, None]
    normal = np.column_stack((-along[:, 1], along[:, 0]))
    motion = geometry.Motion.of(cracked, -1)
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


def test_the_ground_of_a_mound_is_its_formula_below_the_footing(on_mound):
    x, height, rise = ground_profile(on_mound, -1, ContactKind.SOIL)
    assert height == pytest.approx(np.full(len(x), -0.05))
    own = Mound().profile(x, 1.2, "doming")
    assert np.ptp(own) > 1e-3
    np.testing.assert_allclose(rise, own, atol=1e-6)
    shape = Deformed.of(on_mound, 0, 1000.0).shape  # under dead load the footing lies on the datum
    assert shape[:, 1].min() == pytest.approx(-0.05, abs=1e-4)


def test_the_footing_goes_where_the_archive_says(on_jacks):
    x, rise = footing_rise(on_jacks, -1, geometry.footing_blocks(on_jacks))
    assert (np.diff(x) > 0).all()
    middle, ends = np.interp(0.6, x, rise), (rise[0] + rise[-1]) / 2
    assert ends - middle == pytest.approx(float(on_jacks.central_deflection[-1]), rel=1e-9)
    ax = draw(on_jacks, "footing_rise")
    assert ax.lines[-1].get_ydata() == pytest.approx(1e3 * rise)
    assert draw_wall(on_jacks, increment=0).dataLim.intervalx == pytest.approx([-0.03 * 1.2, 1.03 * 1.2])


def test_a_band_of_widths_that_begins_at_the_top_is_left_out():
    ax, table = Figure().subplots(), load_table("as2870")
    ax.set_ylim(0.0, table.limits[1] * MM)
    shade_bands(ax, table)
    assert [text.get_text()[0] for text in ax.texts] == ["0", "1"]


def test_open_stretches_are_interpolated():
    x = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    assert open_stretches(x, np.array([0.0, 2.0, 2.0, 2.0, 0.0]), 1.0) == [(0.5, 3.5)]
    assert open_stretches(x, np.array([2.0, 0.0, 0.0, 0.0, 4.0]), 1.0) == [(0.0, 0.5), (3.25, 4.0)]
    assert open_stretches(x, np.full(5, 0.5), 1.0) == []
    jump = np.array([0.0, 1.0, 1.0 + 1e-9, 2.0])
    assert open_stretches(jump, np.array([2.0, 0.99, 1.02, 2.0]), 1.0) == [(0.0, 2.0)]
    assert open_stretches(x, np.full(5, 2.0), 1.0) == [(0.0, 4.0)]


@pytest.mark.parametrize("variable", ["dpc_opening", "footing_rise", "jack_load", "opening_width_change"])
def test_variables_of_parts_that_a_wall_lacks_are_refused(cracked, variable):
    with pytest.raises(InputError, match=f"variable = '{variable}'"):
        draw(cracked, variable)


def test_width_of_an_opening_with_one_jamb_is_unknown(on_dpc):
    lame = on_dpc.copy(deep=True)
    lame["opening_width_change"][:] = np.nan
    (line,) = (line for line in draw(lame, "opening_width_change").lines if line.get_label().startswith("window"))
    assert line.get_label().endswith(": unknown")


def test_openings_are_named_by_kind_size_and_place(on_dpc):
    ds = on_dpc.copy()
    values = {"left": [0.25, 1.5], "sill": [0.9, 0.0], "width": [1.25, 0.8], "height": [0.6, 2.0]}
    ds = ds.drop_dims("opening").assign({f"opening_{name}": ("opening", v) for name, v in values.items()})
    change = np.array([[0.0, 0.0], [1.0, -2.0], [3.0, -4.0], [5.0, -7.0]]) * 1e-3
    ds["opening_width_change"] = ("increment", "opening"), change
    drawn = {k.get_label(): k.get_ydata() for k in draw(ds, "opening_width_change").lines if len(k.get_xdata()) == 4}
    assert list(drawn) == ["window 1: 1.25 x 0.60 m, at 0.25 m", "door 2: 0.80 x 2.00 m, at 1.50 m"]
    np.testing.assert_allclose(list(drawn.values()), 1e3 * change.T)
    ds["opening_sill"] = "opening", [np.nan, 0.0]
    assert draw(ds, "opening_width_change").lines[1].get_label() == "opening 1"


def test_the_movement_of_a_picture_in_words(deformable):
    def said(ds, increment=-1):
        return moved_to(ds, increment)

    assert [said(deformable, i) for i in (2, 1, 0)] == [f"a central deflection of {mm} mm" for mm in ("1", "0.5", "0")]
    grown = deformable.assign(progress=("increment", [0.0, 0.4, 1.0]))
    grown["central_deflection"] = 0.0 * grown["central_deflection"]
    assert (said(grown, 1), said(grown, 0)) == ("40 % of the movement", "a central deflection of 0 mm")
    assert said(deformable.assign_coords(time=("increment", [0.0, 0.25, 0.75])), 1) == "0.25 s"
    wall = Deformed.of(deformable, -1, 2.5)
    assert wall.scale == "displacements exaggerated 2.5 times"
    width, height = np.ptp(wall.shape, axis=0)
    assert height_to_scale(wall.shape, 2.0) == pytest.approx(9.2 * height / width + 2.0)


def test_a_variable_that_cannot_be_drawn_is_named(deformable, cracked, study):
    with pytest.raises(InputError, match=r"variable = 'stress_zz': the dataset has no such variable.*stress_smallest"):
        draw(deformable, "stress_zz")
    with pytest.raises(InputError, match="increment = 7"):
        draw(deformable, "stress_xx", increment=7)
    with pytest.raises(InputError, match="zone_state"):
        draw(cracked, "zone_state")
    with pytest.raises(InputError, match="contact_normal_stress"):
        draw(study, "stress_xx")
    with pytest.raises(InputError, match="neither a field"):
        draw(cracked, "opening_left" if "opening_left" in cracked else "group_count")
    with pytest.raises(InputError, match="static runs"):
        draw(cracked.assign_coords(time=("increment", np.arange(cracked.sizes["increment"]))), "stress_xx")


@pytest.mark.thorough
def test_every_variable_of_a_wall_has_a_picture(deformable, on_jacks):
    """Numbers of blocks, contacts, zones, gridpoints, sections, or of increments; all others are refused by name."""
    for ds in (deformable, on_jacks):
        drawn = []
        for name in ds.variables:
            ax = Figure().add_subplot()
            if "increment" in ds[name].dims or ds[name].dims in [("block",), ("contact",), ("zone",), ("gridpoint",)]:
                assert draw(ds, str(name), ax) is ax
                drawn.append(name)
            else:
                with pytest.raises(InputError, match=f"variable = '{name}'"):
                    draw(ds, str(name), ax)
        assert len(drawn) > 30


def test_colours_of_stresses_leave_out_a_small_share_of_the_area(deformable):
    peak = deformable.copy(deep=True)
    peak["zone_stress_xx"][-1, :2] = 1e9
    assert stress_levels(peak, "stress_xx", [-1]).tolist() == stress_levels(deformable, "stress_xx", [-1]).tolist()


def test_elastic_blocks_show_their_bending_about_the_mean_stress_of_their_joints() -> None:
    scene = damagepred.Scene.from_dict(
        {
            "wall": {"length": 1.44, "height": 0.3},
            "joint": {"tensile_strength": 1e8, "cohesion": 1e8},
            "movement": {"kind": "doming", "central_deflection": "0.5 mm", "increments": 1},
            "solver": {"blocks": "elastic"},
        }
    )
    ds = damagepred.solve(scene)
    bending = bending_stress(ds, -1).reshape(-1, 4)  # rectangles, bottom left first
    height = scene.wall.block_height
    expected = 0.5 * height * scene.block.elastic_modulus * ds["block_curvature"].values[-1]
    assert np.abs(expected).max() > 1e4
    for corner, sign in enumerate((1.0, 1.0, -1.0, -1.0)):
        assert bending[:, corner] == pytest.approx(sign * expected, abs=1e-6 * np.abs(expected).max())
    # mean stress is strain and contraction: s_xx = E eps + nu s_yy
    stress, block = block_stress(ds, -1), scene.block
    along = block.elastic_modulus * ds["block_strain"].values[-1] + block.poisson_ratio * stress[:, 1]
    assert stress[:, 0] == pytest.approx(along, abs=1e-3 * np.abs(stress).max())
    (drawn,) = (c for c in draw(ds, "stress_xx").collections if c.get_label() == "elastic blocks")
    assert len(drawn.get_paths()) > 3
    rigid = damagepred.solve(replace(scene, solver=replace(scene.solver, blocks="rigid")))
    assert "elastic blocks" not in [c.get_label() for c in draw(rigid, "stress_xx").collections]


WALL = {"length": "4 m", "height": "1.2 m", "block_length": "0.5 m", "block_height": "0.2 m"}
WINDOW = {"kind": "window", "x": 1.5, "y": 0.4, "width": 1.0, "height": 0.4}
TREE = {
    "movement": {"shape": "mound", "kind": "settle"},
    "mound": {"shape": "tree", "surface_movement": 0.02, "reach": 2},
}


def test_still_ground_has_one_line(tmp_path: Any) -> None:
    described = Scene.from_dict({"wall": WALL, "movement": {"central_deflection": 0.0}})
    ax = draw_scene(described)
    assert [one.get_label() for one in ax.lines] == ["ground before"]
    assert save_scene_picture(described, tmp_path / "new").name == "scene.png"
    assert save_scene_picture(described, tmp_path / "house.svg").read_text(encoding="utf-8").startswith("<?xml")
