"""Fragility curves as ordered limit states, with the checks before an export."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import xarray as xr
from scipy import special

from damagepred.errors import InputError
from damagepred.uq.capacity import category_number
from damagepred.uq.fragility.describe import lognormal_of

RARE = 1e-3
"""Crossings of two curves below this probability, or closer to 1 than this, are tolerated."""


def limit_states(
    curves: xr.Dataset, program: str, categories: Sequence[int | str] | None = None, extrapolated: bool = False
) -> xr.Dataset:
    """Curves of some categories, lowest first, none without a curve and no two that cross; ``state``: their names."""
    for name in ("median", "dispersion", "fit_status", "intensity", "category"):
        if name not in curves.variables:
            raise InputError(f"the dataset has no variable '{name}'; exports need curves of damagepred.fit_fragility.")
    if curves.attrs.get("model") == "empirical":
        raise InputError("model = 'empirical': has no medians and dispersions to export; fit 'separate' or 'common'.")
    available = [int(c) for c in curves["category"].values]
    wanted = available if categories is None else sorted({category_number(curves, c) for c in categories})
    if unknown := [c for c in wanted if c not in available] or (not wanted and [0]):
        raise InputError(f"categories = {unknown}: the curves are of the categories {_listed(available)}.")
    states = curves.sel(category=wanted)
    form = lognormal_of(states)
    why = [str(status) for status in states["fit_status"].values]
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
    names = states["category_name"].values if "category_name" in states.variables else [f"category_{c}" for c in wanted]
    words = [str(name).replace(" ", "_") for name in names]
    columns = {"state": words, "median": form.median, "dispersion": form.dispersion}
    states = states.assign({name: ("category", values) for name, values in columns.items()})
    for lesser, worse in itertools.pairwise(range(len(wanted))):
        _require_order(states.isel(category=[lesser, worse]), program)
    return states


def _require_order(states: xr.Dataset, program: str) -> None:
    """Check that the worse of two categories is nowhere more probable than the lesser one."""
    (a, b), (s, t) = np.log(states["median"].values), states["dispersion"].values
    where, probability = np.nan, 0.0
    if abs(s - t) > 1e-9 * s:  # where the curves cross
        crossing = (a * t - b * s) / (t - s)
        where, probability = float(np.exp(np.clip(crossing, -700, 700))), float(special.ndtr((crossing - a) / s))
    if b < a or RARE < probability < 1 - RARE:
        place = f"{1e3 * where:.3g} mm" if in_metres(states) else f"{where:.3g}"
        lesser, worse = states["category"].values
        raise InputError(
            f"the curves of categories {lesser} and {worse} cross at {place}, where both are {probability:.2g}; "
            f"{program} takes limit states in order. Fit all curves with one dispersion (--model common): then they "
            "cannot cross."
        )


def in_metres(states: xr.Dataset) -> bool:
    """Whether the movement is a length."""
    return str(states["intensity"].attrs.get("units", "1")) == "m"


def _listed(categories: Sequence[int]) -> str:
    return ",".join(str(c) for c in categories)
