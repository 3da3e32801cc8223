"""Fragility curves as ordered limit states, and the checks that they can be exported so."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy import special

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.uq.fragility.describe import lognormal_of

RARE = 1e-3
"""Where two curves cross beyond this probability, or nearer to 1 than this, nobody minds."""


@dataclass(frozen=True)
class LimitStates:
    """Lognormal curves of c categories, the least first.

    Attributes
    ----------
    category : tuple of int
        Each limit state is that category or worse.
    name : tuple of str
        In one word, such as ``very_slight``.
    median : array (c,)
        Of the capacity, in ``units``.
    dispersion : array (c,)
        Standard deviation of the capacity's logarithm.
    measure, units : str
        What the curves are drawn against, and its unit, ``"1"`` if it has none.
    largest : float
        Largest movement of the study; beyond it the curves are extrapolated.
    title : str
        What they are the curves of.
    """

    category: tuple[int, ...]
    name: tuple[str, ...]
    median: FloatArray
    dispersion: FloatArray
    measure: str
    units: str
    largest: float
    title: str

    def probability(self, intensity: FloatArray) -> FloatArray:
        """Return the probability of having reached each category (c, n) at n intensities."""
        with np.errstate(divide="ignore"):
            distance = np.log(np.asarray(intensity, dtype=np.float64)) - np.log(self.median)[:, None]
        return special.ndtr(distance / self.dispersion[:, None])


def limit_states(
    curves: xr.Dataset, categories: Sequence[int] | None = None, extrapolated: bool = False
) -> LimitStates:
    """Read the lognormal curves of some categories.

    Parameters
    ----------
    curves : xarray.Dataset
        As ``damagepred.fit_fragility`` returns it.
    categories : sequence of int, optional
        By default all that were asked for in the fit.
    extrapolated : bool
        Whether curves are taken whose median lies beyond the largest movement to which a wall was followed.

    Raises
    ------
    InputError
        If the dataset holds no curves, a category has none, or one without median and dispersion.
    """
    for name in ("median", "dispersion", "fit_status", "intensity", "category"):
        if name not in curves.variables:
            raise InputError(f"the dataset has no variable '{name}'; exports need curves of damagepred.fit_fragility.")
    if curves.attrs.get("model") == "empirical":
        raise InputError("model = 'empirical': has no medians and dispersions to export; fit 'separate' or 'common'.")
    known = [int(c) for c in curves["category"].values]
    wanted = known if categories is None else sorted({int(c) for c in categories})
    if unknown := [c for c in wanted if c not in known] or (not wanted and [0]):
        raise InputError(f"categories = {unknown}: the curves are of the categories {_listed(known)}.")
    chosen = curves.sel(category=wanted)
    form = lognormal_of(chosen)
    why = [str(status) for status in chosen["fit_status"].values]
    fitted = np.isfinite(form.median) & np.isfinite(form.dispersion)
    for k in np.flatnonzero(fitted):
        if form.start[k] > 0:
            why[k] = f"{form.start[k]:.2g} of the walls are in it before any movement, which the format cannot tell"
        elif form.extrapolated[k] and not extrapolated:
            why[k] = "its median lies beyond the largest movement of a wall (--extrapolated takes it all the same)"
        else:
            continue
        fitted[k] = False
    if not fitted.all():
        reasons = "; ".join(f"category {c}: {s}" for c, s, f in zip(wanted, why, fitted) if not f)
        left = [c for c, f in zip(wanted, fitted) if f]
        raise InputError(
            f"these categories have no curve to export: {reasons}. "
            + (
                f"Export the others alone (--categories {_listed(left)})."
                if left
                else "Sample more walls, or go further."
            )
        )
    intensity = chosen["intensity"]
    names = chosen["category_name"].values if "category_name" in chosen.variables else [f"category_{c}" for c in wanted]
    return LimitStates(
        category=tuple(wanted),
        name=tuple(str(n).replace(" ", "_") for n in names),
        median=form.median,
        dispersion=form.dispersion,
        measure=str(curves.attrs.get("intensity_measure", "intensity")),
        units=str(intensity.attrs.get("units", "1")),
        largest=float(intensity.values.max()),
        title=str(curves.attrs.get("title", "fragility curves")),
    )


def require_order(states: LimitStates, program: str) -> None:
    """Check that a worse category is nowhere more probable than a lesser one, where it matters.

    Lognormal curves of different dispersions always cross somewhere; a crossing where both are all but 0 or 1 is let
    pass (``RARE``).

    Parameters
    ----------
    states : LimitStates
        The curves.
    program : str
        What they are meant for, for the message.

    Raises
    ------
    InputError
        If two curves cross.
    """
    for lesser, worse in itertools.pairwise(range(len(states.category))):
        where, probability = _crossing(states, lesser, worse)
        if states.median[worse] < states.median[lesser] or RARE < probability < 1 - RARE:
            at = f"{1e3 * where:.3g} mm" if states.units == "m" else f"{where:.3g}"
            raise InputError(
                f"the curves of categories {states.category[lesser]} and {states.category[worse]} cross at {at}, where "
                f"both are {probability:.2g}; {program} takes limit states in order. Fit all curves with one "
                "dispersion (--model common): then they cannot cross."
            )


def _crossing(states: LimitStates, one: int, other: int) -> tuple[float, float]:
    """Return where two curves cross, and their probability there; 0 if nowhere."""
    a, b = np.log(states.median[[one, other]])
    s, t = states.dispersion[[one, other]]
    if abs(s - t) <= 1e-9 * s:
        return np.nan, 0.0
    where = (a * t - b * s) / (t - s)
    return float(np.exp(np.clip(where, -700, 700))), float(special.ndtr((where - a) / s))


def _listed(categories: Sequence[int]) -> str:
    return ",".join(str(c) for c in categories)
