from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

import damagepred
from damagepred.errors import InputError
from damagepred.plotting import draw
from damagepred.plotting.geometry import Deformed, Zones
from damagepred.plotting.sheet import moved_to
from damagepred.plotting.stress import STRESSES, bending_stress, block_stress, one_of, stress_levels, zone_stress


def collection(ax, label):
    return next(c for c in ax.collections if c.get_label() == label)


def test_rims_are_the_outlines_of_the_bricks(deformable):
    zones = Zones.of(deformable)
    ends = zones.points[zones.rims()]
    each = deformable.gridpoint_block.values[zones.rims()[:, 0]]
    length = np.bincount(each, np.hypot(*(ends[:, 1] - ends[:, 0]).T))
    first = np.bincount(deformable.vertex_block.values, minlength=len(length))
    for i in range(len(length)):
        own = deformable.vertex_block.values == i
        x, y = deformable.vertex_x.values[own], deformable.vertex_y.values[own]
        assert first[i] == 4
        assert length[i] == pytest.approx(2 * (np.ptp(x) + np.ptp(y)))


@pytest.mark.parametrize("variable", STRESSES)
def test_levels_are_round_and_show_most_of_the_wall(deformable, variable):
    levels = stress_levels(deformable, variable, [1, 2])
    step = np.diff(levels)
    assert step == pytest.approx(step[0])
    assert 5 <= len(levels) <= 22
    assert float(f"{step[0]:.2g}") == pytest.approx(step[0])
    assert pytest.approx(levels[np.abs(levels).argmin()], abs=1e-12) == 0.0
    rigid = deformable.block_course.values >= 2
    field = np.concatenate((zone_stress(deformable, -1), block_stress(deformable, -1)[rigid]))
    field = 1e-6 * one_of(field, variable.removeprefix("stress_"))
    area = np.concatenate((Zones.of(deformable).area, np.full(rigid.sum(), 0.15 * 0.96 / rigid.sum())))
    assert area[(field < levels[0]) | (field > levels[-1])].sum() < 0.1 * area.sum()
    assert np.abs(field).max() > 0.3 * np.abs(levels).max()
    two_sided = levels[0] < 0 < levels[-1]
    assert not two_sided or levels[0] == pytest.approx(-levels[-1])


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
    assert wall.sheet_height(2.0) == pytest.approx(9.2 * height / width + 2.0)


def test_wrong_input_is_named(deformable, cracked, study):
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
    drawn = collection(draw(ds, "stress_xx"), "elastic blocks")
    assert len(drawn.get_paths()) > 3
    rigid = damagepred.solve(replace(scene, solver=replace(scene.solver, blocks="rigid")))
    assert "elastic blocks" not in [c.get_label() for c in draw(rigid, "stress_xx").collections]
