"""Mean wall: share of sampled walls with more damage; epistemic uncertainty from the stored walls."""

import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred.analyses.epistemic import _changed, alternatives
from damagepred.analyses.mean_wall import beyond_mean_wall
from damagepred.archive.folder import open_study
from damagepred.campaign.settings import StudySettings
from damagepred.cli.sentences import estimate_lines
from damagepred.errors import InputError
from damagepred.study import Study
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


TINY = SMALL_STUDY.replace("length = 1.44", "length = 0.96").replace("increments = 6", "increments = 3")


def test_alternatives_are_estimated_beside_the_study(tmp_path: Path) -> None:
    tables = tomllib.loads(TINY)
    tables["study"] |= {"samples": 16, "epistemic": {"rougher": {"joint.friction": {"mean": 0.8}}, "same": {}}}
    with ThreadPoolExecutor(2) as executor:
        Study(StudySettings.from_dict(tables)).run(tmp_path / "s.dp", executor=executor)
    own, rougher, same = alternatives(tmp_path / "s.dp", 1, 6e-3)
    assert (own.name, rougher.name, same.name) == ("", "rougher", "same")
    assert same.found.estimate.value == pytest.approx(own.found.estimate.value)
    assert same.effective_samples == pytest.approx(16)
    assert 4 < rougher.effective_samples < 16
    said = "\n".join(estimate_lines([own, rougher, same], 1, 6e-3))
    assert "Monte Carlo error" in said
    assert "epistemic range of the inputs" in said


def test_what_is_no_alternative() -> None:
    settings = StudySettings.from_dict(tomllib.loads(TINY))
    with pytest.raises(InputError, match="are separate studies"):
        _changed(settings, "a", {"joint.cohesion": {"cov": 0.1}})
    with pytest.raises(InputError, match="covv"):
        _changed(settings, "a", {"joint.friction": {"covv": 0.1}})
