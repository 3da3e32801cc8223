"""What is said of a back-analysis: cautions and tables, for the screen and the report."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from damagepred.analyses.back_analysis import LARGEST_ODDS, UNCERTAIN
from damagepred.formatting import chance, number
from damagepred.uq.intensity import ShownMeasure, shown_measure
from damagepred.uq.observations import ANOTHER

_DISCREPANCY_UNITS = {"width": (1e3, "mm"), "level": (1e3, "mm"), "slope": (1e3, "mm/m")}
"""Factor from SI and unit of a term; the others are shares."""


class PosteriorTable(NamedTuple):
    """A table of a back-analysis: title, heads and formatted cells."""

    title: str
    columns: list[str]
    rows: list[list[str]]


def measures(found: xr.Dataset) -> list[ShownMeasure]:
    """Return how the movement of each study of a back-analysis is shown."""
    both = zip(found["movement_measure"].values, found["movement_units"].values)
    return [shown_measure(str(name), str(units)) for name, units in both]


def sentences(found: xr.Dataset) -> list[str]:
    """Cautions of a back-analysis: resemblance, effective samples, other causes, ends of paths."""
    said, least = [], found.attrs["least_resemblance"]
    measure = f"probability of a larger misfit, at least {least:g} is needed"
    if not found["resembles"].values.any():
        said.append(
            f"NO STORED WALL RESEMBLES THE OBSERVATIONS: the best misfit is {float(found['least_misfit'].min()):.3g} "
            f"for {found.attrs['observations']} observations, resemblance {chance(float(found['resemblance'].max()))} "
            f"({measure}). No odds are given. Do not use this posterior; widen the study, or check the survey."
        )
    for name in found["study"].values:
        at = found.sel(study=name)
        if not at["resembles"]:
            if found["resembles"].values.any():
                said.append(
                    f"{name}: no stored wall resembles the observations, resemblance "
                    f"{chance(float(at['resemblance']))} ({measure}); it has no odds."
                )
            continue
        if (effective := float(at["effective_samples"])) < (fewest := found.attrs["fewest_effective"]):
            said.append(
                f"{name}: only {effective:.1f} effective samples, fewer than {fewest:g}, so it has no odds; a larger "
                "study, --new-walls 100 or more replays make the posterior surer."
            )
        if advice := str(at["advice"].values):
            cut = float(at["movement_cut"])
            where = f"{cut:.0%} of the posterior lies at the end of the paths, which cut the movement's interval there"
            if not cut > UNCERTAIN:
                where = "paths end before the further movements"
            said.append(f"{name}: {where}; damage beyond is unknown. To know it, {advice}.")
    if float(found["another_cause_odds"]) > 1:
        said.append("Another cause than those of the studies is more probable than all of them together.")
    return said


def odds_in_words(value: float) -> str:
    """Odds with three digits; beyond 100 to 1 a bound, "–" if unknown."""
    if not np.isfinite(value):
        return "–"
    if value >= LARGEST_ODDS:
        return f"more than {LARGEST_ODDS:g} to 1"
    return f"less than 1 to {LARGEST_ODDS:g}" if value <= 1 / LARGEST_ODDS else f"{value:.3g}"


def reported(found: xr.Dataset) -> xr.Dataset:
    """Back-analysis with the probabilities of causes that have odds, within their limits, for JSON."""
    known = {
        f"{name}_posterior": odds / (1.0 + odds)
        for name, odds in (("cause", found["posterior_odds"]), ("another_cause", found["another_cause_odds"]))
    }
    return found.assign(known).drop_vars("log_evidence")


def posterior_tables(found: xr.Dataset) -> list[PosteriorTable]:
    """Tables of causes and movement, of further damage, and of the model's discrepancy."""
    names, shown = [str(name) for name in found["study"].values], measures(found)
    first, alike = shown[0], len(set(shown)) == 1
    causes = []
    for name, measure in zip(names, shown):
        one = found.sel(study=name)
        low, *_, middle, _, high = (f"{measure.factor * v:.3g}" for v in one["movement_quantile"].values)
        moved = f"{middle} ({low} to {high})" + ("" if alike else f" {measure.unit} {measure.words}")
        if float(one["movement_cut"]) > UNCERTAIN:
            moved += f", cut at {measure.factor * float(one['movement_largest']):.3g}"
        prior = float(one["cause_prior"])
        odds = (odds_in_words(float(one["posterior_odds"])), f"{prior / (1.0 - prior):.3g}")
        shares = (f"{float(one['effective_samples']):.1f}", chance(float(one["resemblance"])))
        causes.append([name, moved, *odds, *shares])
    prior = float(found["another_cause_prior"])
    odds = (odds_in_words(float(found["another_cause_odds"])), f"{prior / (1.0 - prior):.3g}")
    causes.append([ANOTHER, "–", *odds, "–", "–"])
    interval = f"{first.words}, 90 % interval ({first.unit})" if alike else "movement, 90 % interval"
    heads = ["study", interval, "posterior odds", "prior odds", "effective samples", "resemblance"]
    future = []
    for name, measure in zip(names, shown):
        one = found.sel(study=name)
        for k, further in enumerate(found["further"].values * float(one["movement_largest"])):
            bounds = (one[f"future_probability_{end}"][k].values for end in ("lower", "upper"))
            chances = [
                "unknown" if not b - a < 0.995 else f"{a:.2f}" if b - a < 0.005 else f"{a:.2f} to {b:.2f}"
                for a, b in zip(*bounds)
            ]
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
            f"Model discrepancy{integrated}",
            ["of", "standard deviation", "90 % interval", "confidence"],
            _discrepancy(found),
        ),
    ]


def _discrepancy(found: xr.Dataset) -> list[list[str]]:
    """Terms of the model's discrepancy in words: name, standard deviation, interval, confidence."""
    start, rows = "discrepancy_interval_", []
    for name in (str(key).removeprefix(start) for key in found.attrs if str(key).startswith(start)):
        factor, unit = _DISCREPANCY_UNITS.get(name, (100.0, "%"))
        interval = str(found.attrs[start + name]).split(" to ")
        ends = " to ".join(number(factor * float(end), 2) for end in interval) + f" {unit}" if interval[1:] else "-"
        value = f"{number(factor * found.attrs[f'discrepancy_{name}'], 2)} {unit}"
        rows.append([name.replace("_", " "), value, ends, found.attrs[f"discrepancy_confidence_{name}"]])
    return rows
