"""Monte Carlo error and epistemic uncertainty of the inputs, apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from damagepred.archive.folder import open_study
from damagepred.campaign.campaign import Campaign
from damagepred.campaign.settings import StudySettings
from damagepred.errors import InputError, nearest
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene.reading import build, plain
from damagepred.uq.estimate import effective_samples
from damagepred.uq.exceedance import Exceedance, exceedance
from damagepred.uq.movement_distribution import MovementDistribution, as_distribution
from damagepred.uq.reweight import density_ratio
from damagepred.uq.variable import Variable


class Alternative(NamedTuple):
    """A probability under one set of distributions.

    Attributes
    ----------
    name : str
        As the study file has it; "" for the study's own distributions.
    found : Exceedance
        The probability with its Monte Carlo error.
    effective_samples : float
        Equally weighted walls that would know as much; few of them say that the alternative is too far away to be
        read from these walls, and should be run as a study of its own.
    """

    name: str
    found: Exceedance
    effective_samples: float


@one_blas_thread()
def alternatives(
    path: str | Path,
    category: int,
    at: float | MovementDistribution,
    *,
    others: Mapping[str, Mapping[str, Mapping[str, Any]]] | None = None,
    confidence: float = 0.9,
) -> list[Alternative]:
    """Estimate a probability under a study's own distributions and under alternatives to them.

    Parameters
    ----------
    path : str or Path
        Study folder.
    category : int
        Category, or worse.
    at : float or MovementDistribution
        Movement (m), or its distribution.
    others : mapping, optional
        Name -> place -> what differs in that variable, such as ``{"less sure": {"dpc.friction": {"cov": 0.3}}}``; by
        default the study's ``[study.epistemic]``.
    confidence : float
        Of the intervals.

    Raises
    ------
    InputError
        If an alternative is for no variable with a value a wall, or has no density.
    """
    study, ds = Campaign.from_folder(path), open_study(path)
    found = [_estimate("", ds, category, at, confidence)]
    for name, changes in (study.settings.study.epistemic if others is None else others).items():
        other = _changed(study.settings, name, changes)
        values = {place: np.asarray(ds[place].values) for place in study.design.wall}
        ratio = density_ratio(study.design, other.design(), values)
        weight = ratio * (ds["weight"].values if "weight" in ds else 1.0)
        found.append(_estimate(name, ds.assign(weight=("sample", weight)), category, at, confidence))
    return found


def _changed(settings: StudySettings, name: str, changes: Mapping[str, Mapping[str, Any]]) -> StudySettings:
    """Return a study with other distributions of the variables with a value a wall; it can be run, too."""
    where = f'[study.epistemic."{name}"]'
    wall = [place for place, v in settings.variables.items() if v.field is None]
    variables = dict(settings.variables)
    for place, change in changes.items():
        if place not in wall:
            raise InputError(
                f'{where} "{place}": is no variable with one value a wall; alternatives to fields are run as studies '
                "of their own." + nearest(place, wall)
            )
        variables[place] = build(Variable, plain(variables[place]) | dict(change), f'{where} "{place}"')
    return replace(settings, variables=variables, study=replace(settings.study, epistemic={}))


def _estimate(
    name: str, ds: xr.Dataset, category: int, at: float | MovementDistribution, confidence: float
) -> Alternative:
    found = exceedance(ds, category, at, confidence=confidence)
    count = effective_samples(ds["weight"].values) if "weight" in ds else float(found.estimate.samples)
    return Alternative(name, found, count)


def lines(found: list[Alternative], category: int, at: float | MovementDistribution) -> list[str]:
    """Say what was found.

    Parameters
    ----------
    found : list of Alternative
        The study's own distributions first.
    category : int
        Category, or worse.
    at : float or MovementDistribution
        Movement (m), or its distribution.
    """
    own, said = found[0].found, []
    e = own.estimate
    movement = as_distribution(at)
    asked = f"P(category >= {category} at {f'{1e3 * at:g} mm' if isinstance(at, float) else movement.words})"
    if np.isnan(e.value):
        return [
            f"{asked} is unknown, between {e.lower:.4g} and {e.upper:.4g} ({e.confidence:.0%}): no wall that had not "
            f"reached it before was followed as far; walls, all: {e.samples + own.failed}, failed: {own.failed}, not "
            f"followed as far: {own.not_followed}"
        ]
    said.append(
        f"{asked} = {e.value:.4g}, Monte Carlo error {e.error:.2g}: {e.lower:.4g} to {e.upper:.4g} "
        f"({e.confidence:.0%}), {e.samples} walls"
    )
    if movement.assumption:
        said.append(movement.assumption)
    if own.failed:
        said.append(
            f"{own.failed} failed walls: {own.failed_undamaged:.4g} if none had reached it, {own.failed_damaged:.4g} "
            "if all had"
        )
    if own.not_followed:
        said.append(
            f"{own.not_followed} walls were not followed that far; they count as those followed further, which is "
            "right if their movement does not end there because they are weak or strong"
        )
    for other in found[1:]:
        o = other.found.estimate
        few = ", too few: run it as a study" if other.effective_samples < 0.2 * o.samples else ""
        said.append(
            f"  {other.name}: {o.value:.4g}, {o.lower:.4g} to {o.upper:.4g} "
            f"({other.effective_samples:.0f} effective walls{few})"
        )
    if len(found) > 1:
        values = [a.found.estimate.value for a in found]
        said.append(
            f"what the inputs leave open: {min(values):.4g} to {max(values):.4g}, besides the Monte Carlo error"
        )
    return said
