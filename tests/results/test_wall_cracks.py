"""Cracks of solved walls as objects: in step with the verdict, with the blocks' own movement, and as tables."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.archive.files import read_dataset, write_dataset
from damagepred.damage.tracing import PARTS, WALL
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.results.wall_cracks import CRACK_VARIABLES, WallCracks, crack_frame
from damagepred.scene import Dpc, Joint, Movement, Opening, Scene, Wall

MM = 1e-3
WEAK = Scene(
    title="weak wall",
    wall=Wall(length=2.4, height=0.75),
    dpc=Dpc(course=2, friction=0.3),
    opening=(Opening(x=0.96, y=0.3, width=0.48, height=0.3),),
    joint=Joint(tensile_strength=2e3, cohesion=3e3),
    movement=Movement(kind="doming", shape="parabola", central_deflection=10 * MM, increments=6),
)


@pytest.fixture(scope="module")
def wall() -> xr.Dataset:
    return damagepred.solve(WEAK)


@pytest.fixture(scope="module")
def found(wall: xr.Dataset) -> xr.Dataset:
    return damagepred.cracks(wall)


def test_the_widest_crack_is_the_one_of_the_verdict(wall: xr.Dataset, found: xr.Dataset):
    in_wall = found["crack_part"].values == WALL
    widest = np.nanmax(np.nan_to_num(found["crack_width"].values[:, in_wall]), axis=1, initial=0.0)
    seen = wall["crack_width_max"].values
    np.testing.assert_array_equal(widest[seen > 0.05 * MM], seen[seen > 0.05 * MM])
    assert seen.max() > 1 * MM
    below = found["crack_part"].values == PARTS.index("below_dpc")
    widest = np.nan_to_num(found["crack_width"].values[:, below]).max(axis=1, initial=0.0)
    base = wall["base_crack_width_max"].values
    np.testing.assert_array_equal(widest[base > 0.05 * MM], base[base > 0.05 * MM])
    dpc = np.isin(found["crack_part"].values, (2, 3))
    assert np.nan_to_num(found["crack_displacement"].values[-1, dpc]).max() > 0.05 * MM


def test_faces_move_apart_as_the_blocks_on_either_side_do(wall: xr.Dataset):
    """Opening, slip and their signs, against the rigid motion of the two bricks at a joint."""
    from damagepred.plotting.geometry import Motion, block_at, corners

    profile = damagepred.crack_profile(wall)
    joint = (profile["piece_kind"].values <= 1) & (profile["piece_on_path"].values >= 0)
    start = np.column_stack([profile[f"piece_{a}_start"].values[joint] for a in "xy"])
    end = np.column_stack([profile[f"piece_{a}_end"].values[joint] for a in "xy"])
    along = (end - start) / np.hypot(*(end - start).T)[:, None]
    left = np.column_stack((-along[:, 1], along[:, 0]))
    at, step = np.column_stack([profile[f"piece_{a}"].values[joint] for a in "xy"]), 0.01
    inside = at + 0.01 * ((start + end) / 2 - at)  # contacts at the ends of a joint lie at other bricks' corners, too
    points, block = corners(wall)
    motion = Motion.of(wall, -1)
    moved = [motion.at(block_at(inside + s * step * left, points, block), at) for s in (1, -1)]
    apart = moved[0] - moved[1]
    tolerance = 0.01 * MM  # joints are elastic besides
    np.testing.assert_allclose(profile["piece_displacement"].values[joint], np.hypot(*apart.T), atol=tolerance)
    cracks = WallCracks(wall)
    slope = {one.number: np.radians(one.crack.inclination) for one in cracks.states[-1]}
    angle = np.array([slope[int(n)] for n in profile["piece_crack"].values[joint]])
    expected = -apart[:, 0] * np.sin(angle) + apart[:, 1] * np.cos(angle)
    np.testing.assert_allclose(profile["piece_width"].values[joint], expected, atol=tolerance)
    assert profile["piece_width"].values[joint].max() > 1 * MM


def test_numbers_are_kept_and_beginnings_are_told(found: xr.Dataset):
    number = found["crack"].values
    assert number.tolist() == list(range(1, len(number) + 1))
    there = np.isfinite(found["crack_length"].values)
    appeared = there.argmax(axis=0)
    assert (np.diff(appeared) >= 0).all()  # older first
    assert (found["first_increment"].values <= appeared).all()
    for crack, into in zip(number, found["merged_into"].values):
        if into:
            assert into < crack
            assert not there[-1, crack - 1]


def test_a_sound_wall_has_none():
    ds = damagepred.solve(
        Scene(wall=Wall(length=1.2, height=0.3), movement=Movement(increments=1, central_deflection=1e-6))
    )
    found = damagepred.cracks(ds)
    assert found.sizes["crack"] == 0
    assert len(crack_frame(found)) == 0
    assert damagepred.crack_profile(ds).sizes["piece"] == 0


def test_tables_and_files(wall: xr.Dataset, found: xr.Dataset, tmp_path: Path):
    assert (found.attrs["title"], found.attrs["scene"]) == ("weak wall", wall.attrs["scene"])
    write_dataset(found, tmp_path / "cracks.nc")
    back = read_dataset(tmp_path / "cracks.nc")
    assert set(CRACK_VARIABLES) >= {n for n in back.variables if n not in ("increment", "central_deflection")}
    np.testing.assert_array_equal(back["crack_width"].values, found["crack_width"].values)
    last, every = crack_frame(found), crack_frame(found, None)
    assert set(every["increment"]) > {int(found["increment"][-1])}
    assert len(last) == np.isfinite(found["crack_length"].values[-1]).sum()
    wide = last[last["crack_part"] == "wall"]["crack_width"].to_numpy()
    assert (np.diff(wide) <= 0).all()
    assert every["crack_orientation"].isin(["horizontal", "vertical", "stepped", "diagonal"]).all()


def test_bricks_that_have_failed_join_cracks(wall: xr.Dataset, found: xr.Dataset):
    """Every brick of the wall cut into two zones, all of which have yielded."""
    first = np.flatnonzero(np.diff(wall["vertex_block"].values, prepend=-1))
    zones = np.concatenate([[(i, i + 1, i + 2), (i, i + 2, i + 3)] for i in first])
    failed = wall.assign(
        gridpoint_x=("gridpoint", wall["vertex_x"].values),
        gridpoint_y=("gridpoint", wall["vertex_y"].values),
        zone_gridpoint=(("zone", "zone_corner"), zones),
        zone_state=(("increment", "zone"), np.full((wall.sizes["increment"], len(zones)), 4, dtype=np.int8)),
    )
    joined = damagepred.cracks(failed)
    apart, one = (c.isel(increment=-1, crack=c["crack_part"].values == WALL) for c in (found, joined))
    assert 1 <= np.isfinite(one["crack_length"].values).sum() < np.isfinite(apart["crack_length"].values).sum()
    assert np.nanmax(one["crack_length_through_blocks"].values) > 0.1
    total = [np.nansum(c["crack_length"].values) for c in (apart, one)]
    assert total[0] == pytest.approx(total[1])
    profile = damagepred.crack_profile(failed)
    in_brick = np.isnan(profile["piece_opening"].values)
    assert in_brick.any()
    assert (profile["piece_kind"].values[in_brick] == len(ContactKind)).all()


def test_what_cannot_be_is_said(wall: xr.Dataset):
    with pytest.raises(InputError, match="no contact_opening"):
        damagepred.cracks(wall.drop_dims("contact"))
    with pytest.raises(InputError, match="increment = 9: the wall has 7 increments"):
        damagepred.crack_profile(wall, 9)
    with pytest.raises(InputError, match="hairline = 0"):
        damagepred.cracks(wall, hairline=0.0)
