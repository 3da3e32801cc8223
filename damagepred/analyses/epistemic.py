"""Monte Carlo error and epistemic uncertainty of the inputs, separately."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from damagepred.campaign.campaign import Campaign
from damagepred.campaign.settings import StudySettings
from damagepred.errors import InputError, nearest
from damagepred.results.house import study_of
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene.described import build, plain
from damagepred.uq.design import density_ratio
from damagepred.uq.estimate import effective_samples
from damagepred.uq.exceedance import Exceedance, exceedance
from damagepred.uq.movement_distribution import MovementDistribution
from damagepred.uq.variable import Variable

Movement = float | MovementDistribution


class Alternative(NamedTuple):
    """Probability under one set of distributions."""

    name: str  # name in the study file; "" for the study's own distributions
    found: Exceedance  # probability with its Monte Carlo error
    # equivalent number of equally weighted walls; with few, the alternative should be run as a separate study
    effective_samples: float


@one_blas_thread()
def alternatives(
    path: str | Path,
    category: int,
    at: Movement,
    *,
    others: Mapping[str, Mapping[str, Mapping[str, Any]]] | None = None,
    confidence: float = 0.9,
    wall: str | None = None,
) -> list[Alternative]:
    """Probability of a category or worse, of one wall of a house if named, by a study's distributions and by others."""
    study, ds = Campaign.from_folder(path), study_of(path, wall)
    estimates = [_estimate("", ds, category, at, confidence)]
    for name, changes in (study.settings.study.epistemic if others is None else others).items():
        other = _changed(study.settings, name, changes)
        values = {key: np.asarray(ds[key].values) for key in study.design.wall}
        ratio = density_ratio(study.design, other.design(), values)
        weight = ratio * (ds["weight"].values if "weight" in ds else 1.0)
        estimates.append(_estimate(name, ds.assign(weight=("sample", weight)), category, at, confidence))
    return estimates


def _changed(settings: StudySettings, name: str, changes: Mapping[str, Mapping[str, Any]]) -> StudySettings:
    """Study with other distributions of the variables with one value per wall."""
    where = f'[study.epistemic."{name}"]'
    wall = [key for key, v in settings.variables.items() if v.field is None]
    variables = dict(settings.variables)
    for key, change in changes.items():
        if key not in wall:
            raise InputError(
                f'{where} "{key}": is no variable with one value per sample; alternatives to fields are separate '
                "studies." + nearest(key, wall)
            )
        variables[key] = build(Variable, plain(variables[key]) | dict(change), f'{where} "{key}"')
    return replace(settings, variables=variables, study=replace(settings.study, epistemic={}))


def _estimate(name: str, ds: xr.Dataset, category: int, at: Movement, confidence: float) -> Alternative:
    found = exceedance(ds, category, at, confidence=confidence)
    count = effective_samples(ds["weight"].values) if "weight" in ds else float(found.estimate.samples)
    return Alternative(name, found, count)
