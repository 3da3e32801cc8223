"""A wall of weight 2 counts as two walls, in every table, sentence and picture that counts walls."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

from damagepred import compare_scales, exceedance, fit_fragility, fit_surface
from damagepred.archive.folder import StudyFolder, open_study
from damagepred.campaign.settings import read_frozen
from damagepred.cli import tables
from damagepred.plotting import draw_category_shares
from damagepred.report.caveats import study_caveats
from damagepred.results.rejudge import shares
from tests.synthetic_studies import synthetic_study

WALLS = 24
TIMES = 1 + np.arange(WALLS) % 3


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return synthetic_study(tmp_path_factory.mktemp("weights") / "house.dp", WALLS, (3e-3, 7.5e-3))


@pytest.fixture(scope="module")
def studies(folder: Path) -> tuple[xr.Dataset, xr.Dataset]:
    """A study with weights, of mean 1, and the same walls as often as their weights say."""
    ds = open_study(folder)
    ds["apex_limited"] = "sample", np.arange(WALLS) ** 2 % 7 - 1.0
    repeated = ds.isel(sample=np.repeat(np.arange(WALLS), TIMES)).assign_coords(sample=np.arange(TIMES.sum()))
    return ds.assign(weight=("sample", TIMES / TIMES.mean())), repeated


def _caveats(ds: xr.Dataset, folder: Path) -> Any:
    settings = read_frozen(StudyFolder(folder).study_text())
    (text,) = study_caveats(ds, fit_fragility(ds, bootstrap=0), settings, 6e-3).parts
    (said,) = [line for line in text.items if line.startswith("In a sample, ")]
    return float(said.split()[3])


def _levels(ds: xr.Dataset, _: Path) -> Any:
    level = np.minimum(ds["damage_category"].values, 2).astype(np.int8)
    flags = {"flag_meanings": "free sticks_slightly sticks"}
    (said,) = tables._levels(ds.assign(opening_sticking=(ds["damage_category"].dims, level, flags)))
    return [float(share) for share in re.findall(r"([\d.]+)%", said)]


def _heights(ds: xr.Dataset, _: Path) -> Any:
    bands = draw_category_shares(ds).collections
    found = [band.get_paths()[0].vertices for band in bands]
    plt.close("all")
    return np.concatenate(found).ravel()


def _at_start(ds: xr.Dataset, _: Path) -> Any:
    """Share of walls in the category before any movement, of curves and of a surface."""
    before = (ds["joint.friction"] > 0.75) & (ds["damage_category"] == 0)
    damaged = ds["damage_category"].where(~before, 1).astype(np.int8).assign_attrs(ds["damage_category"].attrs)
    ds = ds.assign(damage_category=damaged)
    curve = fit_fragility(ds, bootstrap=0)["share_at_start"].values[0]
    return [curve, float(fit_surface(ds, 1, "joint.friction", bootstrap=0, points=(5, 3))["share_at_start"])]


COUNTING: dict[str, Callable[[xr.Dataset, Path], Any]] = {
    "caveats": _caveats,
    "levels": _levels,
    "damaged at the start": _at_start,
    "shares": lambda ds, _: [one.share for one in shares(ds).values()],
    "scales": lambda ds, _: compare_scales(ds)["share_reached"].values,
    "bands of categories": _heights,
    "estimate": lambda ds, _: [exceedance(ds, c, 4e-3).estimate.value for c in (1, 2)],
    "medians": lambda ds, _: fit_fragility(ds, bootstrap=0)["median"].values[:2],
}


@pytest.mark.parametrize("what", COUNTING)
def test_a_weight_is_a_repetition(what: str, studies: tuple[xr.Dataset, xr.Dataset], folder: Path) -> None:
    weighted, repeated = (np.asarray(COUNTING[what](ds, folder)) for ds in studies)
    unweighted = np.asarray(COUNTING[what](studies[0].drop_vars("weight"), folder))
    np.testing.assert_allclose(weighted, repeated, rtol=1e-9, atol=1e-12)
    assert not np.allclose(weighted, unweighted, rtol=1e-3, equal_nan=True)
