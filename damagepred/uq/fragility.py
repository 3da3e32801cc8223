"""Fragility curves: the probability that a category of damage is reached at a given movement.

Each wall's path brackets its capacity for a category: undamaged at one increment, damaged at the next, or not yet
damaged at the last. The lognormal curve is fitted to those intervals by maximum likelihood; walls that were not yet
damaged count as such (censored), for leaving them out biases the curve to too small capacities.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import special

from damagepred.errors import InputError
from damagepred.uq.samplers import Stream, generator

FloatArray = NDArray[np.float64]

COMPLETE, COLLAPSED, FAILED = 0, 1, 2
"""Values of a sample's status that the fit uses; what is missing is left out."""

FEWEST = 3
"""Walls that must have reached a category before a curve is fitted to it."""

MEASURES = ("surface_movement", "central_deflection", "deflection_ratio")
"""What curves can be drawn against: y_s of a mound, deflection of the footing, and that over its length."""

_SMALLEST, _LARGEST = 1e-4, 20.0
"""Bounds of the dispersion."""


class Capacities(NamedTuple):
    """Movement at which each wall first reached a category lies in (lower, upper]; infinite upper: not yet.

    Attributes
    ----------
    lower, upper : array (walls,)
        In the unit of the movement.
    failed : array of bool (walls,)
        Walls whose path could not be followed to its end, and had not reached the category before.
    end : array (walls,)
        Movement to which each wall was to be followed.
    """

    lower: FloatArray
    upper: FloatArray
    failed: NDArray[np.bool_]
    end: FloatArray


class Fit(NamedTuple):
    """A lognormal curve.

    Attributes
    ----------
    median, dispersion : float
        Median, and standard deviation of the logarithm; NaN if not fitted.
    status : str
        ``"fitted"``, or why not.
    """

    median: float
    dispersion: float
    status: str

    def probability(self, intensity: FloatArray) -> FloatArray:
        """Return the probability of having reached the category, NaN if not fitted."""
        with np.errstate(divide="ignore"):
            return special.ndtr(np.log(np.asarray(intensity) / self.median) / self.dispersion)


def movement_measure(ds: xr.Dataset) -> str:
    """Return the name of what a study or a wall is moved by: ``surface_movement`` on a mound, else the deflection.

    Parameters
    ----------
    ds : xarray.Dataset
        Of a wall or a study.
    """
    on_ground = "surface_movement" in ds.variables and bool(np.isfinite(ds["surface_movement"].values).any())
    return "surface_movement" if on_ground else "central_deflection"


def capacities(ds: xr.Dataset, category: int, intensity: str = "central_deflection") -> Capacities:
    """Read each wall's capacity for a category from a study.

    A footing that finds its own form may rise again while the ground goes on: then its intensity is the largest
    deflection so far. Where a path ended before the full movement, because the jacks or supports carried nothing any
    more, category and deflection are not known beyond: such a wall is censored at that limit. Where a study keeps the
    end of each wall's movement alone, its capacity lies below that or above.

    Parameters
    ----------
    ds : xarray.Dataset
        With ``damage_category`` and the intensity on (sample, increment) or on (sample,), and ``status`` on (sample,).
    category : int
        Category that counts as reached from here upwards.
    intensity : str
        Name of the movement's measure.
    """
    status = ds["status"].values
    known = np.isin(status, (COMPLETE, COLLAPSED, FAILED))
    reached, given = ds["damage_category"].values[known], np.asarray(ds[intensity].values, dtype=np.float64)[known]
    if reached.ndim == 1:
        reached, given = reached[:, None], given[:, None]
    movement = np.where(np.isfinite(given), np.fmax.accumulate(given, axis=1), np.nan)
    status = status[known]
    hit = reached >= category
    ever = hit.any(axis=1)
    first = hit.argmax(axis=1)
    solved = (reached >= 0) & np.isfinite(movement)
    row = np.arange(len(first))
    # the last movement at which the wall is known to have been below the category
    before = solved & (np.arange(reached.shape[1]) < np.where(ever, first, reached.shape[1])[:, None])
    lower = np.where(before, movement, 0.0).max(axis=1, initial=0.0)
    upper = np.where(ever, movement[row, first], np.inf)
    end = np.where(np.isfinite(movement), movement, 0.0).max(axis=1)
    end = np.where(end > 0, end, end.max(initial=0.0))  # a wall of which nothing is known was to go as far as any
    return Capacities(lower, upper, (status == FAILED) & ~ever, end)


def fit_lognormal(lower: FloatArray, upper: FloatArray, count: FloatArray | None = None) -> Fit:
    """Fit a lognormal capacity to intervals by maximum likelihood.

    Parameters
    ----------
    lower, upper : array (n,)
        The capacity lies in (lower, upper]; upper infinite: censored; equal: known exactly.
    count : array (n,), optional
        How many walls each interval stands for.

    Raises
    ------
    InputError
        If a bound is NaN or an interval is empty.
    """
    lower, upper = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    weight = np.ones_like(lower) if count is None else np.asarray(count, dtype=np.float64)
    if np.isnan(lower).any() or np.isnan(upper).any() or (lower > upper).any():
        raise InputError("capacities must be intervals lower <= upper without NaN.")
    keep = (weight > 0) & ((lower > 0) | np.isfinite(upper))  # one that may be anything tells nothing
    lower, upper, weight = lower[keep], upper[keep], weight[keep]
    reached = np.isfinite(upper)
    if not reached.any():
        return Fit(np.nan, np.nan, "never reached")
    if (upper[reached] <= 0).any():
        return Fit(np.nan, np.nan, "reached by some walls before any movement")
    if weight[reached].sum() < FEWEST:
        return Fit(np.nan, np.nan, f"reached by fewer than {FEWEST} walls")
    if lower.max() <= upper.min() and (lower[reached] == 0).all() and not reached.all():
        return Fit(np.nan, np.nan, "damaged and undamaged walls are parted by the movement alone: sample more walls")
    if lower.max() <= upper.min():
        # every capacity could be one and the same number: the scatter is below what the increments resolve
        return Fit(np.nan, np.nan, "all walls within one increment: refine the increments")
    with np.errstate(divide="ignore"):
        mean, dispersion = _most_likely(np.log(lower), np.log(upper), weight)
    if not _SMALLEST < dispersion < _LARGEST:
        return Fit(np.nan, np.nan, f"no finite dispersion explains the walls (it runs to {dispersion:.2g})")
    return Fit(float(np.exp(mean)), dispersion, "fitted")


def _most_likely(low: FloatArray, high: FloatArray, weight: FloatArray) -> tuple[float, float]:
    """Return mean and standard deviation of the normal that most likely has values in the intervals.

    Newton's method in g = 1/sd and h = mean/sd. In these the logarithm of the likelihood is concave (Burridge 1981,
    J. R. Stat. Soc. B 43), so there is one maximum and any start leads to it.
    """
    middle = np.where(np.isinf(high), low, np.where(np.isinf(low), high - 0.7, (low + high) / 2))
    start = np.average(middle, weights=weight)
    spread = np.clip(np.sqrt(np.average((middle - start) ** 2, weights=weight)), 0.05, 3.0)
    at = np.array([1.0, start]) / spread
    value, gradient, curvature = _log_likelihood(at, low, high, weight)
    for _ in range(200):
        step = np.linalg.lstsq(-curvature, gradient)[0]
        if at[0] + step[0] <= 0:  # the standard deviation is positive; it may well grow tenfold
            step *= 0.9 * at[0] / -step[0]
        promised = float(gradient @ step)
        for _ in range(60):
            new = _log_likelihood(at + step, low, high, weight)
            if new[0] >= value:
                break
            step, promised = step / 2, promised / 2
        else:
            break  # no better place within rounding
        at, (value, gradient, curvature) = at + step, new
        if promised <= 1e-14 * weight.sum() or not _SMALLEST < 1.0 / at[0] < _LARGEST:
            break
    return float(at[1] / at[0]), float(1.0 / at[0])


def _log_likelihood(
    at: FloatArray, low: FloatArray, high: FloatArray, weight: FloatArray
) -> tuple[float, FloatArray, FloatArray]:
    """Return the log-likelihood of g = 1/sd and h = mean/sd, its gradient (2,) and its curvature (2, 2)."""
    g, h = at
    exact = low == high
    x, y = np.where(np.isinf(low), 0.0, low), np.where(np.isinf(high), 0.0, high)
    a, b = g * low - h, g * high - h
    between = np.where(exact, 0.0, _log_between(a, b))
    # density at either end over the probability between, 0 at an end that is nowhere
    p, q = (np.exp(np.minimum(-0.5 * z**2 - 0.5 * np.log(2 * np.pi) - between, 700.0)) for z in (a, b))
    p, q = np.where(exact, 0.0, p), np.where(exact, 0.0, q)
    a, b = np.where(np.isinf(a), 0.0, a), np.where(np.isinf(b), 0.0, b)
    aa, ab, bb = a * p - p**2, p * q, -b * q - q**2
    z = np.where(exact, b, 0.0)
    terms = np.where(exact, np.log(g) - 0.5 * z**2, between)
    by_g = np.where(exact, 1.0 / g - z * y, q * y - p * x)
    by_h = np.where(exact, z, p - q)
    gg = np.where(exact, -1.0 / g**2 - y**2, aa * x**2 + 2 * ab * x * y + bb * y**2)
    gh = np.where(exact, y, -(aa * x + ab * (x + y) + bb * y))
    hh = np.where(exact, -1.0, aa + 2 * ab + bb)
    return (
        float(weight @ terms),
        np.array([weight @ by_g, weight @ by_h]),
        np.array([[weight @ gg, weight @ gh], [weight @ gh, weight @ hh]]),
    )


def _log_between(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return log(Phi(b) - Phi(a)) without cancellation in either tail."""
    flip = a > 0
    low, high = np.where(flip, -b, a), np.where(flip, -a, b)
    log_high, log_low = special.log_ndtr(high), special.log_ndtr(low)
    with np.errstate(divide="ignore", invalid="ignore"):
        difference = log_high + np.log1p(-np.exp(np.minimum(log_low - log_high, 0.0)))
    return np.maximum(np.where(np.isnan(difference), -1e6, difference), -1e6)


def fit_fragility(
    ds: xr.Dataset,
    *,
    intensity: str | None = None,
    categories: Sequence[int] | None = None,
    confidence: float = 0.9,
    bootstrap: int = 200,
    seed: int = 0,
    points: int = 501,
) -> xr.Dataset:
    """Fit a fragility curve for each damage category of a study.

    Parameters
    ----------
    ds : xarray.Dataset
        As ``open_study`` returns it: ``damage_category`` and the intensity on (sample, increment), or on (sample,)
        where each wall is known at its own movement alone; ``status`` on (sample,).
    intensity : {"surface_movement", "central_deflection", "deflection_ratio"}, optional
        Measure of the movement; by default the movement of the ground's surface where the study has mounds, otherwise
        the central deflection.
    categories : sequence of int, optional
        By default all that the damage table has, from 1.
    confidence : float
        Of the band, 0.9 for 5 to 95 %.
    bootstrap : int
        Number of resamples of walls for the band; 0 for none.
    seed : int
        Of the bootstrap.
    points : int
        Number of points of the curves.

    Returns
    -------
    xarray.Dataset
        ``probability``, ``probability_lower``, ``probability_upper``, ``empirical`` on (category, intensity);
        ``median``, ``dispersion`` with ``_lower`` and ``_upper``, ``reached``, ``not_reached``, ``failed``,
        ``fit_status`` and the bounds ``median_failed_undamaged`` and ``median_failed_damaged`` on (category,).

    Raises
    ------
    InputError
        If the dataset has no finished sample or not the variables needed.
    """
    if "status" in ds and not np.isin(ds["status"].values, (COMPLETE, COLLAPSED)).any():
        raise InputError("the study has no finished sample yet; run `damagepred study` first.")
    for name in ("damage_category", "status"):
        if name not in ds:
            raise InputError(f"the dataset has no variable '{name}'; fragility needs a study as open_study returns it.")
    intensity = _intensity(ds, intensity)
    if not 0 < confidence < 1:
        raise InputError(f"confidence = {confidence!r}: must lie between 0 and 1.")
    names = str(ds["damage_category"].attrs.get("flag_meanings", "")).split()
    highest = int(ds.attrs.get("highest_category", len(names) - 1 if names else 4))
    wanted = list(range(1, highest + 1)) if categories is None else [int(c) for c in categories]
    movement = np.asarray(ds[intensity].values)
    grid = np.linspace(0.0, float(np.nanmax(movement)), points)
    curves = [_curve(ds, c, intensity, grid, confidence, bootstrap, seed) for c in wanted]
    columns = {key: np.array([curve[key] for curve in curves]) for key in curves[0]}
    units = ds[intensity].attrs.get("units", "1")
    result = xr.Dataset(
        {
            key: (("category", "intensity") if value.ndim == 2 else ("category",), value)
            for key, value in columns.items()
        },
        coords={
            "category": ("category", np.array(wanted, dtype=np.int32), {"long_name": "damage category or worse"}),
            "category_name": ("category", np.array([names[c] if c < len(names) else str(c) for c in wanted])),
            "intensity": (
                "intensity",
                grid,
                {"long_name": ds[intensity].attrs.get("long_name", intensity), "units": units},
            ),
        },
        attrs={
            "Conventions": "CF-1.11",
            "title": f"fragility of {ds.attrs.get('title', 'a wall')}",
            "intensity_measure": intensity,
            "confidence": confidence,
            "bootstrap_samples": bootstrap,
            "bootstrap_seed": seed,
            "samples": int(np.isin(ds["status"].values, (COMPLETE, COLLAPSED, FAILED)).sum()),
            "samples_failed": int((ds["status"].values == FAILED).sum()),
            "curves_cross": int(_cross(curves)),
        }
        | {k: ds.attrs[k] for k in ("source", "damagepred_version", "damagepred_commit", "seed") if k in ds.attrs},
    )
    for variable in result.data_vars.values():
        _describe(variable, units)
    return result


def _intensity(ds: xr.Dataset, asked: str | None) -> str:
    """Return the measure of the movement that a fit reads, the study's own if none is asked for."""
    name = asked or movement_measure(ds)
    if name in ds and np.isfinite(np.asarray(ds[name].values, dtype=np.float64)).any():
        return name
    known = [m for m in MEASURES if m in ds and np.isfinite(ds[m].values).any()]
    raise InputError(
        f"intensity: the dataset has no variable '{name}' with values; "
        + (f"it has {', '.join(known)}." if known else "fragility needs a study as open_study returns it.")
    )


def _describe(variable: xr.DataArray, units: str) -> None:
    name = str(variable.name)
    if name.startswith("median"):
        variable.attrs.update(
            units=units, long_name="median capacity, " + (name[7:].replace("_", " ") or "best estimate")
        )
    elif name.startswith("dispersion"):
        variable.attrs.update(units="1", long_name="standard deviation of the capacity's logarithm")
    elif name.startswith("probability"):
        variable.attrs.update(
            units="1", long_name="probability of the category or worse" + name[11:].replace("_", ", ")
        )
    elif name == "empirical":
        variable.attrs.update(units="1", long_name="share of walls in the category or worse (Kaplan-Meier)")
    elif name != "fit_status":
        variable.attrs.update(units="1", long_name=f"walls: {name.replace('_', ' ')}")


def _curve(
    ds: xr.Dataset, category: int, intensity: str, grid: FloatArray, confidence: float, bootstrap: int, seed: int
) -> dict[str, Any]:
    lower, upper, failed, end = capacities(ds, category, intensity)
    good, single = ~failed, ds["damage_category"].ndim == 1
    weight = _weights(ds, upper, good)
    fit = fit_lognormal(lower[good], upper[good], weight[good])
    medians, dispersions, bands = _bootstrap(
        lower[good], upper[good], weight[good], grid, bootstrap, seed, category, fit
    )
    tails = [50 * (1 - confidence), 50 * (1 + confidence)]
    undamaged = fit_lognormal(np.where(failed, end, lower), upper, weight)
    step = np.asarray(ds[intensity].values, dtype=np.float64)
    # a failed wall counted as damaged: at the increment that could not be solved
    following = end if single else _next_increment(lower, step)
    damaged = fit_lognormal(lower, np.where(failed, following, upper), weight)
    return {
        "probability": fit.probability(grid) if fit.status == "fitted" else np.full(len(grid), np.nan),
        "probability_lower": _quantile(bands, tails[0], len(grid)),
        "probability_upper": _quantile(bands, tails[1], len(grid)),
        "empirical": (_isotonic if single else _kaplan_meier)(lower[good], upper[good], weight[good], grid),
        "median": fit.median,
        "median_lower": _quantile(medians, tails[0]),
        "median_upper": _quantile(medians, tails[1]),
        "dispersion": fit.dispersion,
        "dispersion_lower": _quantile(dispersions, tails[0]),
        "dispersion_upper": _quantile(dispersions, tails[1]),
        "reached": int(np.isfinite(upper[good]).sum()),
        "not_reached": int(np.isinf(upper[good]).sum()),
        "failed": int(failed.sum()),
        "median_failed_undamaged": undamaged.median,
        "median_failed_damaged": damaged.median,
        "fit_status": fit.status,
    }


def _weights(ds: xr.Dataset, upper: FloatArray, good: NDArray[np.bool_]) -> FloatArray:
    """Return what each wall of ``capacities`` counts for: 1, or its weight from importance sampling."""
    if "weight" not in ds:
        return np.ones(len(upper))
    known = np.isin(ds["status"].values, (COMPLETE, COLLAPSED, FAILED))
    return fair_weights(np.asarray(ds["weight"].values, dtype=np.float64)[known], upper, good)


def fair_weights(weight: FloatArray, upper: FloatArray, good: NDArray[np.bool_] | None = None) -> FloatArray:
    """Scale weights so that walls which reached a category count as many as they are: fits need a few of them.

    Parameters
    ----------
    weight, upper : array (walls,)
        Weights, and capacities' upper bounds, infinite where the category was not reached.
    good : array of bool (walls,), optional
        Walls that did not fail.
    """
    reached = np.isfinite(upper) & (weight > 0)
    if good is not None:
        reached &= good
    total = float(weight[reached].sum())
    return weight * (reached.sum() / total) if total > 0 else weight


def _next_increment(lower: FloatArray, steps: FloatArray) -> FloatArray:
    marks = np.unique(steps[np.isfinite(steps)])
    return marks[np.minimum(np.searchsorted(marks, lower, side="right"), len(marks) - 1)]


def _quantile(values: FloatArray, percent: float, size: int | None = None) -> Any:
    if len(values) == 0:
        return np.full(size, np.nan) if size else np.nan
    return np.percentile(values, percent, axis=0)


def _bootstrap(
    lower: FloatArray,
    upper: FloatArray,
    weight: FloatArray,
    grid: FloatArray,
    resamples: int,
    seed: int,
    category: int,
    fit: Fit,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Fit resampled walls; return medians, dispersions and probabilities of those resamples that can be fitted."""
    if fit.status != "fitted" or resamples == 0:
        return np.empty(0), np.empty(0), np.empty((0, len(grid)))
    random = generator(seed, Stream.BOOTSTRAP, category)
    # many walls share an interval: only the counts matter
    intervals, which = np.unique(np.column_stack((lower, upper)), axis=0, return_inverse=True)
    fits = []
    for _ in range(resamples):
        drawn = random.integers(len(lower), size=len(lower))
        count = np.bincount(which.ravel()[drawn], weight[drawn], len(intervals)).astype(np.float64)
        again = fit_lognormal(intervals[:, 0], intervals[:, 1], count)
        if again.status == "fitted":
            fits.append(again)
    return (
        np.array([f.median for f in fits]),
        np.array([f.dispersion for f in fits]),
        np.array([f.probability(grid) for f in fits]).reshape(len(fits), len(grid)),
    )


def _kaplan_meier(lower: FloatArray, upper: FloatArray, weight: FloatArray, grid: FloatArray) -> FloatArray:
    """Share of walls that have reached the category, with a wall that has not as censored at its last movement."""
    reached = np.isfinite(upper)
    if not reached.any():
        return np.zeros(len(grid))
    last = np.where(reached, upper, lower)
    movement = np.unique(upper[reached])
    falling = np.array([weight[reached & (upper == m)].sum() for m in movement])
    standing = np.array([weight[last >= m].sum() for m in movement])
    steps = 1.0 - np.cumprod(1.0 - falling / standing)
    return np.append(0.0, steps)[np.searchsorted(movement, grid * (1 + 1e-9), side="right")]


def _isotonic(lower: FloatArray, upper: FloatArray, weight: FloatArray, grid: FloatArray) -> FloatArray:
    """Share of walls that have reached the category, rising with the movement, where each is known at one alone.

    Adjacent violators are pooled (Ayer and others 1955), which is the maximum likelihood estimate from such data.
    """
    from scipy.optimize import isotonic_regression

    reached = np.isfinite(upper)
    movement, place = np.unique(np.where(reached, upper, lower), return_inverse=True)
    if not len(movement):
        return np.zeros(len(grid))
    count = np.bincount(place.ravel(), weights=weight)
    share = np.bincount(place.ravel(), weights=weight * reached) / count
    steps = isotonic_regression(share, weights=count).x
    return np.append(0.0, steps)[np.searchsorted(movement, grid * (1 + 1e-9), side="right")]


def _cross(curves: Sequence[dict[str, Any]]) -> bool:
    """Whether a worse category is anywhere more probable than a lesser one."""
    fitted = [c["probability"] for c in curves if c["fit_status"] == "fitted"]
    return any(bool((worse > lesser + 1e-9).any()) for lesser, worse in itertools.pairwise(fitted))
