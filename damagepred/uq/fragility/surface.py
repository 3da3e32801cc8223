"""Fragility surfaces: probability of a category against the movement and a second variable.

The median of the capacity is exp(a + b x), x the second variable or its logarithm, and the dispersion the same
everywhere: a regression of censored capacities. With the logarithm, b is an exponent: twice the strength, 2^b times the
capacity. Any variable of the study with one number a wall can be the second one. Walls that reach the category before
any movement are a share p0, the same for every value of the second variable; the regression is of the others.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import xarray as xr
from scipy import special

from damagepred.arrays import FloatArray
from damagepred.errors import InputError, nearest
from damagepred.formatting import options_text
from damagepred.inputs.arguments import checked
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.capacity import (
    category_number,
    read_capacities,
    require_categories,
    without_damaged_at_start,
)
from damagepred.uq.fragility.bands import expanded_percentiles
from damagepred.uq.fragility.estimators import CompositeLikelihood, Estimator
from damagepred.uq.fragility.fit import EXTRAPOLATED, FITTED, BoundedMedian, StartShare, reasons_not_fitted
from damagepred.uq.fragility.grouped_data import GroupedIntervals, group_intervals
from damagepred.uq.fragility.likelihood import linear_bounds, maximise_likelihood
from damagepred.uq.fragility.options import DEFAULT, FragilityOptions
from damagepred.uq.fragility.posterior import effective_reached, sample_posterior
from damagepred.uq.fragility.resampling import resample
from damagepred.uq.intensity import attributes, chosen_intensity
from damagepred.uq.random_streams import Stream, generator

Scale = Literal["log", "linear"]


@checked
@one_blas_thread()
def fit_surface(
    ds: xr.Dataset,
    category: int | str,
    second: str,
    *,
    intensity: str | None = None,
    scale: Scale | None = None,
    confidence: float = 0.9,
    bootstrap: int = 500,
    seed: int = 0,
    points: tuple[int, int] = (81, 41),
    options: FragilityOptions = DEFAULT,
) -> xr.Dataset:
    """Fit the probability of a category against the movement and a second variable.

    Parameters
    ----------
    ds : xarray.Dataset
        See ``fit_fragility``.
    category : int or str
        Number or name of the category.
    second : str
        Variable of the dataset on (sample,), such as ``wall.length`` or ``joint.friction``.
    intensity : str, optional
        See ``fit_fragility``.
    scale : {"log", "linear"}, optional
        Whether the logarithm of the median is linear in the variable's logarithm or in the variable; by default in the
        logarithm where all values are positive.
    confidence : float
        Of the bands: quantiles of resampled fits, or of the posterior where fewer than 100 walls determine them.
    bootstrap, seed : int
        Resamples of walls, and their seed.
    points : tuple of int
        Points of the movement and of the second variable.
    options : FragilityOptions
        See ``fit_fragility``.

    Returns
    -------
    xarray.Dataset
        ``probability`` with ``_lower`` and ``_upper`` on (second, intensity); ``median`` with both on (second,);
        ``slope`` (b), ``dispersion``, each with both, ``dispersion_alone`` (without the second variable), ``reached``,
        ``not_reached``, ``failed``, ``fit_status``, ``share_at_start`` with both; as attributes Akaike's criterion with
        the second variable and without, ``aic_with`` and ``aic_without``. Where the median lies beyond the largest
        movement to which a wall was followed, ``median`` is that movement, a lower bound, and ``median_extrapolated``
        the number fitted; the status is "extrapolated" where it does so for every value of the second variable.

    Raises
    ------
    InputError
        If the dataset has no such variable with one number a wall, or it does not vary.

    Examples
    --------
    >>> import damagepred
    >>> surface = damagepred.fit_surface(damagepred.open_study("house.dp"), 2, "joint.friction", bootstrap=20)
    >>> surface["probability"].dims, surface.attrs["second_variable"]
    (('second', 'intensity'), 'joint.friction')
    """
    name = chosen_intensity(ds, intensity)
    category = category_number(ds, category)
    require_categories(ds, [category])
    walls = read_capacities(ds, [category], name)
    z = _second(ds, second)[walls.sample]
    known = np.isfinite(z)
    if not known.any() or np.ptp(z[known]) == 0:
        raise InputError(f"second = '{second}': does not vary in this study; a curve is all there is (fit_fragility).")
    logarithmic = bool((z[known] > 0).all()) if scale is None else scale == "log"
    if logarithmic and (z[known] <= 0).any():
        raise InputError(f"second = '{second}': has values that are not positive; take scale = 'linear'.")
    before = walls.capacities.upper[0] <= 0
    found = without_damaged_at_start(walls.capacities)
    cells = group_intervals(
        np.vstack((found.lower[:, known], z[known])), np.vstack((found.upper[:, known], z[known])), walls.weight[known]
    )
    grid_z = (
        np.geomspace(z[known].min(), z[known].max(), points[1])
        if logarithmic
        else (np.linspace(z[known].min(), z[known].max(), points[1]))
    )
    grid = np.linspace(0.0, walls.largest, points[0])
    model = _Regression(cells, logarithmic, options)
    columns, attrs = _fitted(model, grid, grid_z, confidence, bootstrap, generator(seed, Stream.BOOTSTRAP, category))
    _bound_by_walls(columns, StartShare.of(before[known], walls.weight[known], confidence), walls.largest)
    reached = np.isfinite(walls.capacities.upper)
    columns |= {
        "reached": ((), int(reached.sum())),
        "not_reached": ((), int((~reached & ~found.failed).sum())),
        "failed": ((), int(found.failed.sum())),
    }
    measured = attributes(ds, name)
    for end in ("", "_lower", "_upper", "_lower_bound", "_extrapolated"):
        columns[f"median{end}"][2]["units"] = measured["units"]
    names = str(ds["damage_category"].attrs.get("flag_meanings", "")).split()
    stated = {key: str(ds[second].attrs.get(key, other)) for key, other in (("long_name", second), ("units", "1"))}
    return xr.Dataset(
        columns,
        coords={"second": ("second", grid_z, stated), "intensity": ("intensity", grid, measured)},
        attrs={
            "Conventions": "CF-1.11",
            "title": f"fragility of {ds.attrs.get('title', 'a wall')}",
            "intensity_measure": name,
            "second_variable": second,
            "scale": "log" if logarithmic else "linear",
            "category": category,
            "category_name": names[category] if category < len(names) else str(category),
            "confidence": confidence,
            "bootstrap_samples": bootstrap,
            "bootstrap_seed": seed,
            "fragility_options": options_text(options),
            "samples": int(known.sum()),
            "samples_failed": int(found.failed.sum()),
            **attrs,
        },
    )


def _bound_by_walls(columns: dict[str, Any], start: StartShare, largest: float) -> None:
    """Add the share of walls damaged at the start, and end the medians at the largest movement of the walls."""
    for name in ("probability", "probability_lower", "probability_upper"):
        dims, value, attrs = columns[name]
        columns[name] = (dims, start.mixed(name, value), attrs)
    for end, value in zip(("", "_lower", "_upper"), start):
        words = {"units": "1", "long_name": "share of walls in the category or worse before any movement"}
        columns[f"share_at_start{end}"] = ((), value, words)
    found = BoundedMedian.of(columns["median"][1], columns["median_lower"][1], columns["median_upper"][1], largest)
    for part, value in found._asdict().items():
        name = "median" if part == "median" else f"median_{part}"
        columns[name] = ("second", value, dict(columns.get(name, columns["median"])[2]))
    if columns["fit_status"][1] == FITTED and np.isfinite(found.extrapolated).all():
        columns["fit_status"] = ((), EXTRAPOLATED)


def _second(ds: xr.Dataset, name: str) -> FloatArray:
    known = [str(n) for n in ds.data_vars if ds[n].dims == ("sample",) and np.issubdtype(ds[n].dtype, np.number)]
    if name not in ds.variables or ds[name].dims != ("sample",) or not np.issubdtype(ds[name].dtype, np.number):
        inputs = [n for n in known if ds[n].attrs.get("role") == "input"]
        what = f"; sampled inputs are {', '.join(inputs)}" if inputs else ""
        raise InputError(
            f"second = '{name}': the study has no such variable with one number a wall{what}." + nearest(name, known)
        )
    return np.asarray(ds[name].values, dtype=np.float64)


class _Regression(Estimator):
    """Estimator of 1/dispersion and (a, b) over the dispersion, x counted from its mean."""

    def __init__(self, cells: GroupedIntervals, logarithmic: bool, options: FragilityOptions) -> None:
        capacities = GroupedIntervals(cells.lower[:1], cells.upper[:1], cells.weight, cells.number)
        super().__init__([0], capacities, options)
        self.logarithmic = logarithmic
        x = self._scaled(cells.lower[1])
        self._middle = float(np.average(x, weights=cells.total))
        self.rows = linear_bounds(cells.lower[0], cells.upper[0], self.regressors(cells.lower[1]))

    def _scaled(self, z: FloatArray) -> FloatArray:
        return np.log(z) if self.logarithmic else z

    def regressors(self, z: FloatArray) -> FloatArray:
        """Return the regressors of the mean of the capacity's logarithm, array (n, 2)."""
        return np.column_stack((np.ones(len(z)), self._scaled(z) - self._middle))

    def _maximise(self, weight: FloatArray, start: FloatArray | None) -> FloatArray:
        if start is None:
            start = np.append(CompositeLikelihood([0], self.cells, self.options).estimate, 0.0)
        return maximise_likelihood(self.rows, weight, start, self.options)


def _fitted(
    model: _Regression,
    grid: FloatArray,
    grid_z: FloatArray,
    confidence: float,
    bootstrap: int,
    random: np.random.Generator,
) -> tuple[dict[str, Any], dict[str, float]]:
    """Return the variables of the dataset, and Akaike's criterion with and without the second variable."""
    options = model.options
    status = reasons_not_fitted(model.cells, options=options)[0] or FITTED
    at, alone = np.full(3, np.nan), np.full(2, np.nan)
    again = np.empty((0, 3))
    level = np.array([0.5 * (1 - confidence), 0.5 * (1 + confidence)])
    tails = level
    attrs: dict[str, float] = {}
    if status == FITTED:
        plain = CompositeLikelihood([0], model.cells, options)
        at, alone = model.estimate, plain.estimate
        if why := model.no_dispersion():
            status, at = why, np.full(3, np.nan)
        else:
            attrs = {"aic_with": 6.0 - 2.0 * model.value(at), "aic_without": 4.0 - 2.0 * plain.value(alone)}
            if bootstrap and effective_reached(model) < options.posterior_below:
                again, tails = sample_posterior(model, random), level
            elif bootstrap:
                again, tails = (
                    resample(model, bootstrap, random).replicates,
                    special.ndtr(expanded_percentiles(level, effective_reached(model))),
                )
    regressors = model.regressors(grid_z)
    with np.errstate(divide="ignore"):
        log_grid = np.log(grid)

    def numbers(p: FloatArray) -> dict[str, FloatArray]:
        along = p[1:] @ regressors.T
        with np.errstate(invalid="ignore"):
            probability = special.ndtr(p[0] * log_grid[None, :] - along[:, None])
        median, slope, dispersion = np.exp(along / p[0]), p[2] / p[0], 1.0 / p[0]
        return {"probability": probability, "median": median, "slope": slope, "dispersion": dispersion}

    best = numbers(at)
    resamples = [numbers(p) for p in again]
    words = {
        "probability": (("second", "intensity"), "probability of the category or worse"),
        "median": (("second",), "median capacity"),
        "slope": ((), "change of the logarithm of the median with the second variable or its logarithm"),
        "dispersion": ((), "standard deviation of the capacity's logarithm"),
    }
    columns: dict[str, Any] = {}
    for key, (dims, text) in words.items():
        columns[key] = (dims, best[key], {"units": "1", "long_name": text})
        each = np.array([r[key] for r in resamples])
        ends = np.quantile(each, tails, axis=0) if len(each) > 1 else np.full((2, *np.shape(best[key])), np.nan)
        for word, end in zip(("lower", "upper"), ends):
            columns[f"{key}_{word}"] = (dims, end, {"units": "1", "long_name": f"{text}, {word}"})
    text = "standard deviation of the capacity's logarithm without the second variable"
    columns["dispersion_alone"] = ((), 1.0 / alone[0], {"units": "1", "long_name": text})
    columns["fit_status"] = ((), status)
    return columns, attrs
