"""What is said of a back-analysis: cautions and tables, for the screen and the report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr

from damagepred.study.analyses.back_analysis import DEFAULT, InferenceOptions


class PosteriorTable(NamedTuple):
    """A table of a back-analysis: title, heads and formatted cells."""

    title: str
    columns: list[str]
    rows: list[list[str]]


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


def cause_odds(found: xr.Dataset) -> Mapping[str, tuple[float, float]]:
    """Return for each study the prior and posterior odds of its cause against all others."""
    with np.errstate(divide="ignore"):
        odds = [found[name].values / (1.0 - found[name].values) for name in ("cause_prior", "cause_posterior")]
    return {str(n): (float(a), float(b)) for n, a, b in zip(found["study"].values, *odds)}


def posterior_tables(found: xr.Dataset) -> list[PosteriorTable]:
    """Return the tables of causes and movement, of further damage, and of the model's discrepancy.

    Parameters
    ----------
    found : xarray.Dataset
        As ``damagepred.infer`` returns it.
    """
    factor, unit = (1e3, "mm") if found["movement"].attrs["units"] == "m" else (1.0, "")
    odds = cause_odds(found)
    causes = []
    for name, (prior, after) in odds.items():
        one = found.sel(study=name)
        low, *_, middle, _, high = (f"{factor * v:.3g}" for v in one["movement_quantile"].values)
        shown = ["-", "-"] if len(odds) == 1 else [f"{prior:.3g}", f"{after:.3g}"]
        causes.append([name, *shown, f"{middle} ({low} to {high})", f"{float(one['effective_samples']):.1f}"])
    measure = f"{str(found.attrs['measure']).replace('_', ' ')}, 90 % interval" + (f" ({unit})" if unit else "")
    heads = ["study", "prior odds", "posterior odds", measure, "effective samples"]
    future = []
    for name in odds:
        one = found.sel(study=name)
        for k, further in enumerate(found["further"].values):
            bounds = (one[f"future_probability_{end}"][k].values for end in ("lower", "upper"))
            chances = [f"{a:.2f}" if b - a < 0.005 else f"{a:.2f} to {b:.2f}" for a, b in zip(*bounds)]
            future.append([name, f"{factor * float(further):.3g}", *chances, f"{float(one['future_known'][k]):.0%}"])
    columns = ["study", f"further ({unit})", *(f"P(>= {int(c)})" for c in found["category"].values), "known"]
    return [
        PosteriorTable("Cause and movement, given the observations", heads, causes),
        PosteriorTable("Damage after further movement", columns, future),
        PosteriorTable(
            "Model discrepancy (SI)", ["of", "standard deviation", "90 % interval", "confidence"], _discrepancy(found)
        ),
    ]


def _discrepancy(found: xr.Dataset) -> list[list[str]]:
    """Return each term of the model's discrepancy in words: name, standard deviation, interval, confidence.

    Parameters
    ----------
    found : xarray.Dataset
        As ``infer`` returns it.
    """
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
