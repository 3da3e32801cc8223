"""What is said of a back-analysis: cautions and tables, for the screen and the report."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from damagepred.study.analyses.back_analysis import DEFAULT, InferenceOptions
from damagepred.uq.intensity import ShownMeasure, shown_measure


class PosteriorTable(NamedTuple):
    """A table of a back-analysis: title, heads and formatted cells."""

    title: str
    columns: list[str]
    rows: list[list[str]]


def measures(found: xr.Dataset) -> list[ShownMeasure]:
    """Return how the movement of each study of a back-analysis is shown."""
    both = zip(found["movement_measure"].values, found["movement_units"].values)
    return [shown_measure(str(name), str(units)) for name, units in both]


def sentences(found: xr.Dataset, options: InferenceOptions = DEFAULT) -> list[str]:
    """Return what must be said of a back-analysis, the cautions first.

    Parameters
    ----------
    found : xarray.Dataset
        As ``infer`` returns it.
    options : InferenceOptions
        Limits of the cautions.
    """
    said = []
    if not found["resembles"].values.any():
        said.append(
            f"NO STORED WALL RESEMBLES THE OBSERVATIONS: the best misfit is {float(found['least_misfit'].min()):.3g} "
            f"for {found.attrs['observations']} observations. Do not use this posterior; widen the study, or check the "
            "survey."
        )
    for name, row in zip(found["study"].values, found["effective_samples"].values):
        at = found.sel(study=name)
        if not at["resembles"] and found["resembles"].values.any():
            said.append(f"{name}: no stored wall resembles the observations.")
        if row < options.fewest_effective:
            said.append(
                f"{name}: only {row:.1f} effective samples, fewer than {options.fewest_effective:g}; more samples or "
                "replays make the posterior surer."
            )
    return said


def posterior_tables(found: xr.Dataset) -> list[PosteriorTable]:
    """Return the tables of causes and movement, of further damage, and of the model's discrepancy.

    Parameters
    ----------
    found : xarray.Dataset
        As ``damagepred.infer`` returns it.
    """
    names, shown = [str(name) for name in found["study"].values], measures(found)
    first, alike = shown[0], len(set(shown)) == 1
    shares = np.array([found["cause_prior"], found["cause_posterior"]])
    with np.errstate(divide="ignore"):
        odds = shares / (1.0 - shares)
    causes = []
    for name, both, measure in zip(names, odds.T, shown):
        one = found.sel(study=name)
        low, *_, middle, _, high = (f"{measure.factor * v:.3g}" for v in one["movement_quantile"].values)
        moved = f"{middle} ({low} to {high})" + ("" if alike else f" {measure.unit} {measure.words}")
        odd = ["-" if len(names) == 1 else f"{value:.3g}" for value in both]
        causes.append([name, *odd, moved, f"{float(one['effective_samples']):.1f}"])
    interval = f"{first.words}, 90 % interval ({first.unit})" if alike else "movement, 90 % interval"
    heads = ["study", "prior odds", "posterior odds", interval, "effective samples"]
    future = []
    for name, measure in zip(names, shown):
        one = found.sel(study=name)
        for k, further in enumerate(found["further"].values * float(one["movement_largest"])):
            bounds = (one[f"future_probability_{end}"][k].values for end in ("lower", "upper"))
            chances = [f"{a:.2f}" if b - a < 0.005 else f"{a:.2f} to {b:.2f}" for a, b in zip(*bounds)]
            moved = f"{measure.factor * further:.3g}" + ("" if alike else f" {measure.unit}")
            future.append([name, moved, *chances, f"{float(one['future_known'][k]):.0%}"])
    further = f"further ({first.unit})" if alike else "further"
    columns = ["study", further, *(f"P(>= {int(c)})" for c in found["category"].values), "known"]
    points = int(found.attrs["discrepancy_points"])
    integrated = "; the likelihood is integrated over terms with an interval" if points > 1 else ""
    return [
        PosteriorTable("Cause and movement, given the observations", heads, causes),
        PosteriorTable("Damage after further movement", columns, future),
        PosteriorTable(
            f"Model discrepancy (SI){integrated}",
            ["of", "standard deviation", "90 % interval", "confidence"],
            _discrepancy(found),
        ),
    ]


def _discrepancy(found: xr.Dataset) -> list[list[str]]:
    """Return each term of the model's discrepancy in words: name, standard deviation, interval, confidence."""
    start = "discrepancy_interval_"
    names = [name.removeprefix(start) for name in map(str, found.attrs) if name.startswith(start)]
    return [
        [
            name.replace("_", " "),
            f"{found.attrs[f'discrepancy_{name}']:.2g}",
            found.attrs[start + name],
            found.attrs[f"discrepancy_confidence_{name}"],
        ]
        for name in names
    ]
