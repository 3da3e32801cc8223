"""Fragility curves as ordered limit states, with the checks before an export."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy import special

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.uq.capacity import category_number
from damagepred.uq.fragility.describe import Lognormal, lognormal_of
from damagepred.uq.intensity import movement_words

RARE = 1e-3
"""Crossings of two curves below this probability, or closer to 1 than this, are tolerated."""


@dataclass(frozen=True)
class LimitStates:
    """Lognormal curves of c categories, lowest first."""

    category: tuple[int, ...]  # each limit state is this category or worse
    name: tuple[str, ...]  # such as ``very_slight``
    median: FloatArray  # (c,): of the capacity, in ``units``
    dispersion: FloatArray  # (c,): standard deviation of the capacity's logarithm
    measure: str  # intensity, and its unit ("1" for none)
    words: str  # name of the measure
    units: str
    largest: float  # largest movement of the study; beyond it the curves are extrapolated
    title: str  # title of the study

    def probability(self, intensity: FloatArray) -> FloatArray:
        """Probability of having reached each category (c, n) at n intensities."""
        none = np.zeros_like(self.median)
        return Lognormal(self.median, self.dispersion, none, none > 0).probability(intensity)


def limit_states(
    curves: xr.Dataset, categories: Sequence[int | str] | None = None, extrapolated: bool = False
) -> LimitStates:
    """Lognormal curves of some categories; a category without curve raises InputError."""
    for name in ("median", "dispersion", "fit_status", "intensity", "category"):
        if name not in curves.variables:
            raise InputError(f"the dataset has no variable '{name}'; exports need curves of damagepred.fit_fragility.")
    if curves.attrs.get("model") == "empirical":
        raise InputError("model = 'empirical': has no medians and dispersions to export; fit 'separate' or 'common'.")
    available = [int(c) for c in curves["category"].values]
    wanted = available if categories is None else sorted({category_number(curves, c) for c in categories})
    if unknown := [c for c in wanted if c not in available] or (not wanted and [0]):
        raise InputError(f"categories = {unknown}: the curves are of the categories {_listed(available)}.")
    chosen = curves.sel(category=wanted)
    form = lognormal_of(chosen)
    why = [str(status) for status in chosen["fit_status"].values]
    fitted = np.isfinite(form.median) & np.isfinite(form.dispersion)
    for k in np.flatnonzero(fitted):
        if form.start[k] > 0:
            why[k] = f"{form.start[k]:.2g} of the walls are in it before any movement, which the format cannot express"
        elif form.extrapolated[k] and not extrapolated:
            why[k] = "its median lies beyond the largest movement of a wall (--extrapolated takes it all the same)"
        else:
            continue
        fitted[k] = False
    if not fitted.all():
        reasons = "; ".join(f"category {c}: {s}" for c, s, f in zip(wanted, why, fitted) if not f)
        others, advice = [c for c, f in zip(wanted, fitted) if f], "Sample more walls, or a larger movement."
        if others:
            advice = f"Export the others alone (--categories {_listed(others)})."
        raise InputError(f"these categories have no curve to export: {reasons}. {advice}")
    intensity, measure = chosen["intensity"], str(curves.attrs.get("intensity_measure", "intensity"))
    names = chosen["category_name"].values if "category_name" in chosen.variables else [f"category_{c}" for c in wanted]
    return LimitStates(
        category=tuple(wanted),
        name=tuple(str(n).replace(" ", "_") for n in names),
        median=form.median,
        dispersion=form.dispersion,
        measure=measure,
        words=movement_words(curves, measure),
        units=str(intensity.attrs.get("units", "1")),
        largest=float(intensity.values.max()),
        title=str(curves.attrs.get("title", "fragility curves")),
    )


def require_order(states: LimitStates, program: str) -> None:
    """Check that a worse category is nowhere more probable than a lesser one."""
    for lesser, worse in itertools.pairwise(range(len(states.category))):
        where, probability = _crossing(states, lesser, worse)
        if states.median[worse] < states.median[lesser] or RARE < probability < 1 - RARE:
            place = f"{1e3 * where:.3g} mm" if states.units == "m" else f"{where:.3g}"
            raise InputError(
                f"the curves of categories {states.category[lesser]} and {states.category[worse]} cross at {place}, "
                f"where both are {probability:.2g}; {program} takes limit states in order. Fit all curves with one "
                "dispersion (--model common): then they cannot cross."
            )


def _crossing(states: LimitStates, first: int, second: int) -> tuple[float, float]:
    """Intensity and probability at the crossing of two curves; probability 0 if they do not cross."""
    a, b = np.log(states.median[[first, second]])
    s, t = states.dispersion[[first, second]]
    if abs(s - t) <= 1e-9 * s:
        return np.nan, 0.0
    where = (a * t - b * s) / (t - s)
    return float(np.exp(np.clip(where, -700, 700))), float(special.ndtr((where - a) / s))


def _listed(categories: Sequence[int]) -> str:
    return ",".join(str(c) for c in categories)
