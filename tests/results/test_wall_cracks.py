"""Cracks of solved walls as objects: in step with the verdict, with the blocks' own movement, and as tables."""

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.damage.tracing import WALL
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
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
