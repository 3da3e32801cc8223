"""Fragility curves as a dataset: names, units and where they come from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import special

from damagepred.arrays import BoolArray, FloatArray
from damagepred.uq.capacity import sampled
from damagepred.uq.fragility.fit import EXTRAPOLATED
from damagepred.uq.intensity import attributes

_WORDS = {
    "empirical": "share of walls in the category or worse (nonparametric maximum likelihood)",
    "distance": "largest distance of the curve from the empirical one (Kolmogorov)",
    "p_value": "probability of such a misfit to the empirical curve if the form were right (parametric bootstrap)",
    "fit_note": "what to know of the curve",
    "resamples_fitted": "share of the resamples of walls that could be fitted",
}


def curves_dataset(
    ds: xr.Dataset,
    columns: Mapping[str, NDArray[Any]],
    categories: Sequence[int],
    names: Sequence[str],
    grid: FloatArray,
    intensity: str,
    attrs: Mapping[str, Any],
) -> xr.Dataset:
    """Curves as a dataset: columns on (category,) or (category, intensity), with names, units and origin."""
    measured = attributes(ds, intensity)
    dims = ("category", "intensity")
    result = xr.Dataset(
        {key: (dims[: value.ndim], value) for key, value in columns.items()},
        coords={
            "category": ("category", np.array(categories, dtype=np.int32), {"long_name": "damage category or worse"}),
            "category_name": ("category", np.array([names[c] if c < len(names) else str(c) for c in categories])),
            "intensity": ("intensity", grid, measured),
        },
        attrs={"Conventions": "CF-1.11", "title": f"fragility of {ds.attrs.get('title', 'a wall')}", **attrs}
        | sampled(ds)
        | {k: ds.attrs[k] for k in _COPIED if k in ds.attrs},
    )
    for variable in result.data_vars.values():
        _describe(variable, measured["units"])
    return result


class Lognormal(NamedTuple):
    """What curves are made of, arrays (categories,): probability p0 + (1 - p0) Phi(ln(x / median) / dispersion)."""

    # of the walls that the movement damages, as fitted; NaN where there is no curve
    median: FloatArray
    dispersion: FloatArray
    start: FloatArray  # share p0 of the walls that are damaged before any movement
    extrapolated: BoolArray  # whether the median lies beyond the largest movement to which a wall was followed

    def probability(self, intensity: FloatArray) -> FloatArray:
        """Probability of each category or worse, array (categories, n), at n intensities."""
        with np.errstate(divide="ignore"):
            distance = np.log(np.asarray(intensity, dtype=np.float64)) - np.log(self.median)[:, None]
        start = self.start[:, None]
        return np.asarray(start + (1.0 - start) * special.ndtr(distance / self.dispersion[:, None]))


def lognormal_of(curves: xr.Dataset) -> Lognormal:
    """Median, dispersion and share at the start of the curves, also of curves of older versions."""
    median, dispersion = (np.asarray(curves[name].values, dtype=np.float64) for name in ("median", "dispersion"))
    if "median_extrapolated" in curves:
        beyond = curves["median_extrapolated"].values
        median = np.where(np.isfinite(beyond), beyond, median)
    start = curves["share_at_start"].values if "share_at_start" in curves else np.zeros(len(median))
    return Lognormal(median, dispersion, start, median > float(curves["intensity"].values.max()) * (1 + 1e-9))


def median_lower_bound(curve: xr.Dataset) -> float:
    """Movement that the median of a curve lies beyond, NaN if it does not; older curves have it as the median."""
    if "median_lower_bound" in curve:
        return float(curve["median_lower_bound"])
    return float(curve["median"]) if str(curve["fit_status"].item()) == EXTRAPOLATED else np.nan


def probability_at(curves: xr.Dataset, category: int, movement: float) -> tuple[float, float, float]:
    """Probability of a category or worse at a movement from its lognormal curve, and its band (NaN if it has none)."""
    curve = curves.sel(category=category)
    value = float(lognormal_of(curves.sel(category=[category])).probability(np.array([movement]))[0, 0])
    grid, ends = curve["intensity"].values, (curve[f"probability_{end}"].values for end in ("lower", "upper"))
    lower, upper = (float(np.interp(movement, grid, end, right=np.nan)) for end in ends)
    return value, lower, upper


_COPIED = (
    *("source", "damagepred_version", "damagepred_commit", "seed", "crossed"),
    *("span", "damage_table", "damage_measure", "count_footing_gap"),
)
"""Attributes of a study that its curves have, too."""


def _describe(variable: xr.DataArray, units: str) -> None:
    name = str(variable.name)
    if name == "fit_status":
        return
    words = _WORDS.get(name, f"walls: {name.replace('_', ' ')}")
    if name.startswith("median"):
        words = "median capacity, " + (name[7:].replace("_", " ") or "best estimate")
    elif name.startswith("dispersion"):
        words = "standard deviation of the capacity's logarithm"
    elif name.startswith("probability"):
        words = "probability of the category or worse" + name[11:].replace("_", ", ")
    elif name.startswith("share_at_start"):
        words = "share of walls in the category or worse before any movement"
    variable.attrs.update(units=units if name.startswith("median") else "1", long_name=words)
