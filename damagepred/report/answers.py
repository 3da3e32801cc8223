"""Answers of analyses in one sentence each, for the terminal and the page."""

from __future__ import annotations

import numpy as np
import xarray as xr

from damagepred.analyses.posterior_tables import UNCERTAIN, measures, odds_in_words
from damagepred.formatting import chance, number
from damagepred.uq.comparison import most_helpful
from damagepred.uq.estimate import Estimate
from damagepred.uq.intensity import ShownMeasure

UNKNOWN = 0.995  # distance of the bounds of a probability from which it counts as unknown


def estimate_answer(estimate: Estimate, category: str, of_what: str) -> str:
    """Probability of a category with its interval, and as a number of walls or houses in 100."""
    if np.isnan(estimate.value):
        reach = f"between {chance(estimate.lower)} and {chance(estimate.upper)}"
        why = f"no {of_what} without it was followed as far; run the study with a larger movement"
        return f"Category {category}: unknown, {reach}: {why}."
    interval = f"{estimate.confidence:.0%} interval {chance(estimate.lower)} to {chance(estimate.upper)}"
    share = 100 * estimate.value
    of = f"about {share:.0f} {of_what}{'s' if round(share) != 1 else ''} in 100"
    if share in (0, 100):
        of = f"{'all' if share else 'none'} of the {of_what}s"
    elif share < 1:
        of = f"fewer than 1 {of_what} in 100"
    return f"Category {category}: probability {chance(estimate.value)} ({interval}), {of}."


def comparison_answer(comparison: xr.Dataset, category: int, movement: float) -> str:
    """Answer of a comparison: the measures that lower the probability, and the most helpful if intervals part."""
    chosen = comparison.sel(category=category).sel(movement=movement, method="nearest")
    before = chance(float(chosen["probability"][0]))
    upper = chosen["difference_upper"]
    order = most_helpful(comparison, category, movement)
    sure = [name for name in order if float(upper.sel(study=name)) < 0]
    worse = [name for name in order if float(chosen["difference_lower"].sel(study=name)) > 0]
    lowered = "; ".join(f"{name} to {chance(float(chosen['probability'].sel(study=name)))}" for name in sure)
    said = [f"Lower than {before}, the probability of category {category} or worse: {lowered}"]
    if not sure:
        said = [f"No measure is sure to lower the probability of category {category} or worse from {before}"]
    if not sure and float(chosen["probability"].max()) == 0.0:
        most = chance(float(chosen["probability_upper"].max()))
        said = [f"No sample of the studies reached category {category}; its probability is at most {most} in each"]
    if len(sure) > 1:
        parts = float(upper.sel(study=sure[0])) < float(chosen["difference_lower"].sel(study=order[1:]).min())
        unknown = "Their intervals overlap: which of them helps most is not known"
        said.append(f"{sure[0]} helps most" if parts else unknown)
    elif sure and len(order) > 1:
        said.append("The other measures may change it by chance alone" if not worse else "The other measures do not")
    said += [f"{name} raises it" for name in worse]
    return ". ".join(said) + "."


def posterior_answer(posterior: xr.Dataset) -> str:
    """Answer of a back-analysis: the most probable cause, its movement, and the damage after further movement."""
    odds = posterior["posterior_odds"].values
    if not posterior["resembles"].values.any():
        return "No cause can be named: no stored sample resembles the observations."
    if not np.isfinite(odds).any():
        return "No cause can be named yet: the studies have too few effective samples."
    if float(posterior["another_cause_odds"]) > max(1.0, float(np.nanmax(odds))):
        return "Most probably another cause than the studies have."
    best = int(np.nanargmax(odds))
    cause, shown = posterior.isel(study=best), measures(posterior)[best]
    low, *_, middle, _, high = (number(shown.factor * v, 3) for v in cause["movement_quantile"].values)
    cut = " or more" if float(cause["movement_cut"]) > UNCERTAIN else ""
    text = f"Most probably {cause['study'].item()} (odds {odds_in_words(float(odds[best]))}): "
    text += f"{shown.words} of {middle} {shown.unit} ({low} to {high}{cut})."
    if "until" in cause:
        return f"{text} {_forecast(cause, shown)}"
    ends = [cause[f"future_probability_{end}"].values for end in ("lower", "upper")]
    known = np.flatnonzero(ends[1][:, -1] - ends[0][:, -1] < UNKNOWN)
    if not known.size:
        return f"{text} Damage after further movement is unknown."
    further = int(known[-1])
    moved = number(shown.factor * float(cause["further"][further] * cause["movement_largest"]), 3)
    lower, upper = (end[further] for end in ends)
    k = max(int((lower >= 0.5).sum()) - 1, 0)  # the worst category that is as likely as not
    share = _between(lower[k], upper[k])
    when = f"After {moved} {shown.unit} more" if further else "Already now"
    return f"{text} {when}, category {int(cause['category'][k])} or worse has a probability of {share}."


def _between(lower: float, upper: float) -> str:
    """Probability between bounds."""
    return chance(lower) if upper - lower < 0.005 else f"{chance(lower)} to {chance(upper)}"


def _forecast(cause: xr.Dataset, shown: ShownMeasure) -> str:
    """Rate of the movement, and probability that the next category is reached before the last date with known walls."""
    low, *_, middle, _, high = (number(shown.factor * v, 2) for v in cause["rate_quantile"].values)
    text = f"Rate: {middle} {shown.unit} a year, {low} to {high}"
    text += " (from the prior alone: one visit shows no rate);" if cause.sizes["visit"] < 2 else ";"
    lower, upper = (cause[f"forecast_probability_{end}"].values for end in ("lower", "upper"))
    known = np.flatnonzero(upper[:, -1] - lower[:, -1] < UNKNOWN)
    if not known.size:
        return f"{text} damage at the dates of the forecast is unknown."
    k = min(int((cause["future_probability_lower"].values[0] >= 0.5).sum()), lower.shape[1] - 1)
    row = int(known[-1])
    before = str(cause["until"].values[row])[:10].removesuffix("-01-01")
    share = _between(lower[row, k], upper[row, k])
    return f"{text} category {int(cause['category'][k])} or worse before {before} with a probability of {share}."
