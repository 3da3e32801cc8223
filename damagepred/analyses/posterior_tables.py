"""Cautions and tables of a back-analysis, for terminal and report."""

from __future__ import annotations

import numpy as np
import xarray as xr

from damagepred.formatting import chance, number
from damagepred.results.tables import Table
from damagepred.uq.intensity import ShownMeasure, shown_measure
from damagepred.uq.observations import ANOTHER

LARGEST_ODDS = 100.0  # limit of odds: the uncertainty of the model is larger
UNCERTAIN = 0.05
"""Share of the posterior at the end of the paths, and width of bounds, above which the result has advice."""

_DISCREPANCY_UNITS = {"width": (1e3, "mm"), "level": (1e3, "mm"), "slope": (1e3, "mm/m")}
"""Factor from SI and unit of a term; other terms are shares."""


def measures(ds: xr.Dataset) -> list[ShownMeasure]:
    """Shown measure of the movement of each study."""
    words = ds["movement_words" if "movement_words" in ds else "movement_measure"].values  # older files: none
    return [shown_measure(str(w).replace("_", " "), str(u)) for w, u in zip(words, ds["movement_units"].values)]


def odds_in_words(value: float) -> str:
    """Odds with three digits; beyond 100 to 1 a bound, "–" if unknown."""
    if not np.isfinite(value):
        return "–"
    if value >= LARGEST_ODDS:
        return f"more than {LARGEST_ODDS:g} to 1"
    return f"less than 1 to {LARGEST_ODDS:g}" if value <= 1 / LARGEST_ODDS else f"{value:.3g}"


def reported(ds: xr.Dataset) -> xr.Dataset:
    """Back-analysis with the probabilities of causes that have odds, within their limits, for JSON."""
    of_causes = {"cause_posterior": ds["posterior_odds"], "another_cause_posterior": ds["another_cause_odds"]}
    return ds.assign({name: odds / (1.0 + odds) for name, odds in of_causes.items()}).drop_vars("log_evidence")


def posterior_tables(ds: xr.Dataset) -> list[Table]:
    """Tables of causes, movement, further damage and discrepancy; without resemblance of causes alone."""
    names, shown = [str(name) for name in ds["study"].values], measures(ds)
    first, alike = shown[0], len(set(shown)) == 1
    causes, future, rates, ahead = [], [], [], []
    for name, measure in zip(names, shown):
        cause = ds.sel(study=name)
        unit = "" if alike else f" {measure.unit}"
        moved = _interval(cause["movement_quantile"], measure) + ("" if alike else f"{unit} {measure.words}")
        if not bool(cause["resembles"]):
            moved = "–"
        elif float(cause["movement_cut"]) > UNCERTAIN:
            moved += f", cut at {measure.factor * float(cause['movement_largest']):.3g}"
        prior = float(cause["cause_prior"])
        odds = (odds_in_words(float(cause["posterior_odds"])), f"{prior / (1.0 - prior):.3g}")
        effective = f"{float(cause['effective_samples']):.1f}" if cause["resembles"] else "–"
        causes.append([name, moved, *odds, effective, chance(float(cause["resemblance"]))])
        if not cause["resembles"]:
            continue
        for k, further in enumerate(ds["further"].values * float(cause["movement_largest"])):
            future.append([name, f"{measure.factor * further:.3g}{unit}", *_chances(cause, "future", k)])
        if "until" not in ds:
            continue
        of_kinds = zip(ds["kind"].values, cause["history_posterior"].values)
        kinds = ", ".join(f"{kind} {chance(float(p))}" for kind, p in of_kinds)
        rates.append([name, _interval(cause["rate_quantile"], measure) + unit, kinds])
        for k, day in enumerate(ds["until"].values):
            moved = _interval(cause["forecast_quantile"][k], measure) + unit
            ahead.append([name, str(day)[:10], moved, *_chances(cause, "forecast", k)])
    prior = float(ds["another_cause_prior"])
    odds = (odds_in_words(float(ds["another_cause_odds"])), f"{prior / (1.0 - prior):.3g}")
    causes.append([ANOTHER, "–", *odds, "–", "–"])
    interval = f"{first.words}, 90 % interval ({first.unit})" if alike else "movement, 90 % interval"
    heads = ["study", interval, "posterior odds", "prior odds", "effective samples", "resemblance"]
    further = f"further ({first.unit})" if alike else "further"
    chances = [*(f"P(>= {int(c)})" for c in ds["category"].values), "known"]
    moved = f"movement then, 90 % interval ({first.unit})" if alike else "movement then, 90 % interval"
    over_time = [
        Table(
            "Rate of the movement", ["study", f"a year, 90 % interval{f' ({first.unit})' * alike}", "history"], rates
        ),
        Table("Forecast: damage before a date", ["study", "before", moved, *chances], ahead),
    ]
    table_of_causes = Table("Cause and movement, given the observations", heads, causes)
    if not ds["resembles"].values.any():
        return [table_of_causes]
    points = int(ds.attrs["discrepancy_points"])
    integrated = "; the likelihood is integrated over terms with an interval" if points > 1 else ""
    return [
        table_of_causes,
        *(over_time if rates else []),
        Table("Damage after further movement", ["study", further, *chances], future),
        Table(
            f"Model discrepancy{integrated}",
            ["of", "standard deviation", "90 % interval", "confidence"],
            _discrepancy(ds),
        ),
    ]


def _interval(quantiles: xr.DataArray, measure: ShownMeasure) -> str:
    """Median with the outermost quantiles."""
    low, *_, middle, _, high = (f"{measure.factor * v:.3g}" for v in quantiles.values)
    return f"{middle} ({low} to {high})"


def _chances(cause: xr.Dataset, name: str, row: int) -> list[str]:
    """Bounds of the probabilities of the categories, and the share of the posterior with a known result."""
    bounds = (cause[f"{name}_probability_{end}"][row].values for end in ("lower", "upper"))
    chances = [
        "unknown" if not b - a < 0.995 else f"{a:.2f}" if b - a < 0.005 else f"{a:.2f} to {b:.2f}"
        for a, b in zip(*bounds)
    ]
    return [*chances, f"{float(cause[f'{name}_known'][row]):.0%}"]


def _discrepancy(ds: xr.Dataset) -> list[list[str]]:
    """Terms of the model's discrepancy in words: name, standard deviation, interval, confidence."""
    start, rows = "discrepancy_interval_", []
    for name in (str(key).removeprefix(start) for key in ds.attrs if str(key).startswith(start)):
        factor, unit = _DISCREPANCY_UNITS.get(name, (100.0, "%"))
        interval = str(ds.attrs[start + name]).split(" to ")
        ends = " to ".join(number(factor * float(end), 2) for end in interval) + f" {unit}" if interval[1:] else "-"
        value = f"{number(factor * ds.attrs[f'discrepancy_{name}'], 2)} {unit}"
        rows.append([name.replace("_", " "), value, ends, ds.attrs[f"discrepancy_confidence_{name}"]])
    return rows
