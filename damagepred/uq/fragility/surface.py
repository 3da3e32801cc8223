"""Fragility surfaces: probability of a category against the movement and a second variable.

The median of the capacity is exp(a + b x), x the second variable or its logarithm, and the dispersion the same
everywhere: a regression of censored capacities. With the logarithm, b is an exponent: twice the strength, 2^b times the
capacity. Any variable of the study with one number per wall can be the second one. Walls that reach the category before
any movement are a share p0, the same for every value of the second variable; the regression is of the others.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import xarray as xr
from scipy import special

from damagepred.arrays import FloatArray
from damagepred.errors import InputError, nearest
from damagepred.inputs.arguments import checked
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq import capacity
from damagepred.uq.capacity import sampled
from damagepred.uq.fragility import fit
from damagepred.uq.fragility.bands import confidence_band, draw_parameters, effective_reached, unknown_band
from damagepred.uq.fragility.estimators import CompositeLikelihood, Estimator
from damagepred.uq.fragility.likelihood import linear_bounds, maximise_likelihood
from damagepred.uq.intensity import attributes, chosen_intensity
from damagepred.uq.random_streams import RandomStream, generator

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
) -> xr.Dataset:
    """Fit the probability of a category against the movement and a second variable.

    Parameters
    ----------
    ds : xarray.Dataset
        The same argument as of ``fit_fragility``.
    category : int or str
        Number or name of the category.
    second : str
        Variable of the dataset on (sample,), such as ``wall.length`` or ``joint.friction``.
    intensity : str, optional
        The same argument as of ``fit_fragility``.
    scale : {"log", "linear"}, optional
        Whether the logarithm of the median is linear in the variable's logarithm or in the variable; by default in the
        logarithm where all values are positive.
    confidence : float
        Of the bands: of the posterior where fewer than 100 walls determine them, otherwise of resampled walls (BCa).
    bootstrap, seed : int
        Resamples of walls, and their seed.
    points : tuple of int
        Points of the movement and of the second variable.

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
        If the dataset has no such variable with one number per wall, or it does not vary.

    Examples
    --------
    >>> import damagepred
    >>> surface = damagepred.fit_surface(damagepred.open_study("house.dp"), 2, "joint.friction", bootstrap=20)
    >>> surface["probability"].dims, surface.attrs["second_variable"]
    (('second', 'intensity'), 'joint.friction')
    """
    name = chosen_intensity(ds, intensity)
    category = capacity.category_number(ds, category)
    capacity.require_categories(ds, [category])
    walls = capacity.read_capacities(ds, [category], name)
    z = _second(ds, second)[walls.sample]
    finite = np.isfinite(z)
    if not finite.any() or np.ptp(z[finite]) == 0:
        raise InputError(f"second = '{second}': does not vary in this study; a curve is all there is (fit_fragility).")
    logarithmic = bool((z[finite] > 0).all()) if scale is None else scale == "log"
    if logarithmic and (z[finite] <= 0).any():
        raise InputError(f"second = '{second}': has values that are not positive; take scale = 'linear'.")
    before = walls.capacities.upper[0] <= 0
    capacities = capacity.without_damaged_at_start(walls.capacities)
    lower, upper = (np.vstack((ends[:, finite], z[finite])) for ends in capacities[:2])
    cells = fit.group_intervals(lower, upper, walls.weight[finite])
    grid_z = (np.geomspace if logarithmic else np.linspace)(z[finite].min(), z[finite].max(), points[1])
    grid = np.linspace(0.0, walls.largest, points[0])
    model = _Regression(cells, logarithmic)
    columns, attrs = _fitted(
        model, grid, grid_z, confidence, bootstrap, generator(seed, RandomStream.BOOTSTRAP, category)
    )
    _bound_by_walls(columns, fit.StartShare.of(before[finite], walls.weight[finite], confidence), walls.largest)
    reached = np.isfinite(walls.capacities.upper)
    columns |= {
        "reached": ((), int(reached.sum())),
        "not_reached": ((), int((~reached & ~capacities.failed).sum())),
        "failed": ((), int(capacities.failed.sum())),
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
            "samples": int(finite.sum()),
            "samples_failed": int(capacities.failed.sum()),
            **attrs,
            **sampled(ds),
        },
    )


def _bound_by_walls(columns: dict[str, Any], start: fit.StartShare, largest: float) -> None:
    """Add the share of walls damaged at the start, and end the medians at the largest movement of the walls."""
    for name in ("probability", "probability_lower", "probability_upper"):
        dims, value, attrs = columns[name]
        columns[name] = (dims, start.mixed(name, value), attrs)
    for end, value in zip(("", "_lower", "_upper"), start):
        words = {"units": "1", "long_name": "share of walls in the category or worse before any movement"}
        columns[f"share_at_start{end}"] = ((), value, words)
    median, lower, upper = (columns[f"median{end}"][1] for end in ("", "_lower", "_upper"))
    bounded = fit.BoundedMedian.of(median, lower, upper, largest)
    for column, value in bounded._asdict().items():
        name = "median" if column == "median" else f"median_{column}"
        columns[name] = ("second", value, dict(columns.get(name, columns["median"])[2]))
    if columns["fit_status"][1] == fit.FITTED and np.isfinite(bounded.extrapolated).all():
        columns["fit_status"] = ((), fit.EXTRAPOLATED)


def _second(ds: xr.Dataset, name: str) -> FloatArray:
    numeric = [str(n) for n in ds.data_vars if ds[n].dims == ("sample",) and np.issubdtype(ds[n].dtype, np.number)]
    if name not in ds.variables or ds[name].dims != ("sample",) or not np.issubdtype(ds[name].dtype, np.number):
        inputs = [n for n in numeric if ds[n].attrs.get("role") == "input"]
        what = f"; sampled inputs are {', '.join(inputs)}" if inputs else ""
        raise InputError(
            f"second = '{name}': the study has no such variable with one number per sample{what}."
            + nearest(name, numeric)
        )
    return np.asarray(ds[name].values, dtype=np.float64)


class _Regression(Estimator):
    """Estimator of 1/dispersion and (a, b) over the dispersion, x counted from its mean."""

    def __init__(self, cells: fit.GroupedIntervals, logarithmic: bool) -> None:
        capacities = fit.GroupedIntervals(cells.lower[:1], cells.upper[:1], cells.weight, cells.number)
        super().__init__([0], capacities)
        self.logarithmic = logarithmic
        x = self._scaled(cells.lower[1])
        self._middle = float(np.average(x, weights=cells.total))
        self.rows = linear_bounds(cells.lower[0], cells.upper[0], self.regressors(cells.lower[1]))

    def _scaled(self, z: FloatArray) -> FloatArray:
        return np.log(z) if self.logarithmic else z

    def regressors(self, z: FloatArray) -> FloatArray:
        """Regressors of the mean of the capacity's logarithm, array (n, 2)."""
        return np.column_stack((np.ones(len(z)), self._scaled(z) - self._middle))

    def maximise(self, weight: FloatArray, start: FloatArray | None = None) -> FloatArray:
        if start is None:
            start = np.append(CompositeLikelihood([0], self.cells).estimate, 0.0)
        return maximise_likelihood(self.rows, weight, start)


def _fitted(
    model: _Regression,
    grid: FloatArray,
    grid_z: FloatArray,
    confidence: float,
    bootstrap: int,
    random: np.random.Generator,
) -> tuple[dict[str, Any], dict[str, float]]:
    """Variables of the dataset, and Akaike's criterion with and without the second variable."""
    rows = model.regressors(grid_z)
    status = fit.reasons_not_fitted(model.cells)[0] or fit.FITTED
    parameters, dispersion_alone = np.full(3, np.nan), np.nan
    bands = [unknown_band(len(grid))] * (len(rows) + 1)
    attrs: dict[str, float] = {}
    if status == fit.FITTED:
        plain = CompositeLikelihood([0], model.cells)
        dispersion_alone, status = 1.0 / plain.estimate[0], model.no_dispersion() or fit.FITTED
    if status == fit.FITTED:
        parameters = model.estimate
        with_second, without = model.value(parameters), plain.value(plain.estimate)
        attrs = {"aic_with": 6.0 - 2.0 * with_second, "aic_without": 4.0 - 2.0 * without}
        if bootstrap:
            draws, walls = draw_parameters(model, bootstrap, random), effective_reached(model)
            # the last row: the slope is the ln(median) of b alone
            bands = [confidence_band(draws, r, grid, confidence, walls) for r in (*rows, np.array([0.0, 1.0]))]
    *bands, slope = bands
    along = parameters[1:] @ rows.T
    with np.errstate(divide="ignore", invalid="ignore"):
        probability = special.ndtr(parameters[0] * np.log(grid)[None, :] - along[:, None])
        slope_ends = np.log(slope.median)
    limits = np.array([band.probability for band in bands]).swapaxes(0, 1)
    medians = np.array([band.median for band in bands]).T
    slopes, dispersion = (parameters[2] / parameters[0], *slope_ends), (1.0 / parameters[0], *slope.dispersion)
    columns: dict[str, Any] = {}
    for key, dims, values, words in (
        ("probability", ("second", "intensity"), (probability, *limits), "probability of the category or worse"),
        ("median", ("second",), (np.exp(along / parameters[0]), *medians), "median capacity"),
        ("slope", (), slopes, "change of the logarithm of the median with the second variable or its logarithm"),
        ("dispersion", (), dispersion, "standard deviation of the capacity's logarithm"),
    ):
        for end, value in zip(("", "_lower", "_upper"), values, strict=True):
            columns[key + end] = (dims, value, {"units": "1", "long_name": words + end.replace("_", ", ")})
    text = "standard deviation of the capacity's logarithm without the second variable"
    columns["dispersion_alone"] = ((), dispersion_alone, {"units": "1", "long_name": text})
    columns["fit_status"] = ((), status)
    return columns, attrs
