"""Mean wall: the share of sampled walls with more damage, or the statement that it is unknown."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import xarray as xr

from damagepred.analyses.mean_wall import beyond_mean_wall
from damagepred.archive.folder import open_study
from damagepred.campaign.settings import StudySettings
from tests.conftest import SMALL_STUDY
from tests.synthetic_studies import synthetic_study


def mean_wall(category: int, at: float) -> xr.Dataset:
    """Path of a wall that ends in a category at a movement (m)."""
    path = {"damage_category": [0, category], "central_deflection": [0.0, at]}
    ds = xr.Dataset({name: ("increment", np.array(values)) for name, values in path.items()})
    ds["central_deflection"].attrs["units"] = "m"
    return ds


def test_walls_with_movements_of_their_own_count_at_their_ends(tmp_path: Path) -> None:
    ds = open_study(synthetic_study(tmp_path / "house.dp", 80))
    settings = StudySettings.from_dict(tomllib.loads(SMALL_STUDY))
    said = beyond_mean_wall(mean_wall(1, 6e-3), settings, tmp_path / "house.toml")
    share = (ds["damage_category"].values.max(axis=1) >= 2).mean()
    assert said.startswith(
        "the mean wall is no worse than category 1 very slight; of 80 sampled walls in house.dp, a share"
    )
    assert f"a share of {share:.2f} (90 % interval" in said.replace("90%", "90 %")
    assert said.endswith("reaches category 2 slight or worse by the end of its own movement")
    # another study, or none, tells nothing
    other = StudySettings.from_dict(tomllib.loads(SMALL_STUDY.replace("seed = 7", "seed = 8")))
    unknown = "one wall without scatter; sampled walls may be worse: run `damagepred study house.toml`"
    assert beyond_mean_wall(mean_wall(1, 6e-3), other, tmp_path / "house.toml") == unknown
