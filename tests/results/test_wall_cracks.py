"""Cracks of solved walls as objects, in step with the verdict; published scales side by side, by hand."""

import numpy as np
import pytest
import xarray as xr
from scipy.stats import kendalltau

import damagepred
from damagepred.damage.tracing import WALL
from damagepred.enumerations import ContactKind, SampleStatus
from damagepred.errors import InputError
from damagepred.scene import Dpc, Joint, Movement, Opening, Scene, Wall
from tests.results.test_rejudge import study

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


SCENE = """
wall = { length = 6.0, height = 2.4 }
movement = { kind = "doming", shape = "parabola", central_deflection = 0.02 }
"""
PSI, TABLE = "Psi, Korswagen 2024", "AS 2870-2011 Table C1"
SKEMPTON = "angular distortion, Skempton and MacDonald 1956"


def by_hand() -> xr.Dataset:
    """Four walls at a movement of 0 and at four others: 1/4000, 1/1200, 1/600 and 1/300 of the length."""
    ds = study([[0, 0.05], [0, 0.5], [0, 2.0], [0, 20.0]])
    both = ("sample", "increment")
    ds["psi"] = (both, [[0, 0.5], [0, 0.9], [0, 2.6], [0, np.nan]])
    ds["tilt_max"] = (both, [[0, 0.001], [0, 0.004], [0, 0.002], [0, 0.02]])
    ds["deflection_ratio"] = (both, [[0, 1 / 4000], [0, 1 / 1200], [0, 1 / 600], [0, 1 / 300]])
    ds["status"].values[3] = 1  # collapsed: the highest level of a measure that is no longer known
    ds.attrs["scene"] = SCENE
    return ds


def test_levels_agreement_and_rank_by_hand() -> None:
    found = damagepred.compare_scales(by_hand(), increment=1)
    levels = {str(name): found["level"].sel(scale=name).values[:, 1].tolist() for name in found["scale"].values}
    assert levels[TABLE] == [0, 1, 2, 4]
    assert levels[PSI] == [0, 0, 3, 4]
    assert levels["tilt, BRE Digest 475"] == [0, 1, 0, 2]
    # the slope at the ends of a parabola is 4 times the deflection ratio: 1/1000, 1/300, 1/150, 1/75
    assert levels[SKEMPTON] == [0, 0, 1, 2]
    assert levels["angular distortion, Meyerhof 1956"] == [0, 1, 1, 1]
    # hogging, L/H = 2.5: between 1/5000 at 1 and 1/2500 at 5, 0.000275
    assert levels["deflection ratio, Burland and Wroth 1974"] == [0, 1, 1, 1]
    # over 6 m the ratio governs: 1/2000 full masonry, 1/800 articulated, 1/600 and 1/400 veneer, 1/300 clad frame
    assert levels["deflection ratio, AS 2870-2011 Table 4.1"] == [0, 1, 2, 4]
    assert len(levels) >= 10
    agreement = found["agreement"].sel(scale=TABLE)
    assert float(agreement.sel(other=PSI)) == 0.75
    assert float(found["share_reached"].sel(scale=PSI)) == 0.5
    expected = kendalltau(levels[TABLE], levels[PSI]).statistic
    assert float(found["rank_correlation"].sel(scale=PSI, other=TABLE)) == pytest.approx(expected, abs=1e-12)
    np.testing.assert_array_equal(found["agreement"], found["agreement"].T)
    assert (np.diag(found["agreement"]) == 1).all()


def test_unknown_states_do_not_count_and_all_increments_do() -> None:
    ds = by_hand()
    ds["psi"].values[2, 1] = np.nan
    found = damagepred.compare_scales(ds)
    assert int(found["states"].sel(scale=PSI, other=TABLE)) == 7
    assert float(found["agreement"].sel(scale=PSI, other=TABLE)) == pytest.approx(6 / 7)


def test_what_an_archive_does_not_hold_is_left_out_and_named() -> None:
    ds = by_hand().drop_vars(["psi", "tilt_max", "deflection_ratio"])
    found = damagepred.compare_scales(ds)
    assert found["scale"].values.tolist() == [TABLE, "BRE Digest 251"]
    assert "psi is not held" in found.attrs["left_out"]
    assert "strain" in found.attrs["left_out"]
    ds["tilt_max"] = (("sample", "increment"), np.full((4, 2), np.nan))  # of a low wall
    ds["status"].values[:] = SampleStatus.COMPLETE
    found = damagepred.compare_scales(ds)
    assert found["scale"].values.tolist() == [TABLE, "BRE Digest 251"]
    assert "tilt, BRE Digest 475 is unknown in all states" in found.attrs["left_out"]
    with pytest.raises(InputError, match="increment = 2: the archive's last increment is 1"):
        damagepred.compare_scales(ds, increment=2)
