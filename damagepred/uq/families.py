"""Families of distributions and the parameters that each takes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import scipy
from scipy import special

from damagepred.errors import InputError, nearest
from damagepred.uq.marginals import Table

MOST_VALUES = 100_000  # values of a discrete distribution
Given = Mapping[str, float]


def make(family: str, where: str, given: Given) -> Any:
    """Distribution by its family's name and parameters, in SI."""
    forms = FORMS[family]
    for names, build in forms.items():
        if set(names) == set(given):
            try:
                return build(where, given)
            except (OverflowError, ZeroDivisionError):
                numbers = ", ".join(f"{name} = {value:g}" for name, value in given.items())
                raise InputError(f"{where}: {numbers} make no {family} distribution.") from None
    wanted = " or ".join(" and ".join(names) for names in forms)
    raise InputError(f"{where}: a {family} distribution takes {wanted}; given: {', '.join(given) or 'nothing'}.")


def _positive(where: str, given: Given, *names: str) -> None:
    for name in names:
        if not given[name] > 0:
            raise InputError(f"{where} {name} = {given[name]:g}: must be greater than 0.")


def _standard_deviation(where: str, given: Given) -> float:
    """Return the standard deviation from ``std``, or from ``cov`` and ``mean``."""
    std = given["std"] if "std" in given else abs(given["mean"]) * given["cov"]
    if not std > 0:
        raise InputError(f"{where}: its standard deviation is {std:g}; a mean of 0 needs std instead of cov.")
    return std


def _ordered(where: str, given: Given) -> None:
    if not given["lower"] < given["upper"]:
        raise InputError(f"{where} lower = {given['lower']:g}: must be below upper = {given['upper']:g}.")


def _above(where: str, given: Given) -> tuple[float, float, float]:
    """Lower, mean above lower, and coefficient of variation above lower."""
    lower = given.get("lower", 0.0)
    if not given["mean"] > lower:
        raise InputError(f"{where} mean = {given['mean']:g}: must be greater than {lower:g}.")
    mean = given["mean"] - lower
    return lower, mean, _standard_deviation(where, given) / mean


def _lognormal(where: str, given: Given) -> Any:
    if "median" in given:
        _positive(where, given, "median")
        return scipy.stats.lognorm(s=given["dispersion"], scale=given["median"])
    _positive(where, given, "mean")
    variance = np.log1p((_standard_deviation(where, given) / given["mean"]) ** 2)
    return scipy.stats.lognorm(s=np.sqrt(variance), scale=given["mean"] * np.exp(-variance / 2))


def _normal(where: str, given: Given) -> Any:
    return scipy.stats.norm(loc=given["mean"], scale=_standard_deviation(where, given))


def _truncated_normal(where: str, given: Given) -> Any:
    _ordered(where, given)
    mean, std = given["mean"], _standard_deviation(where, given)
    cut = ((given["lower"] - mean) / std, (given["upper"] - mean) / std)
    if scipy.stats.norm.cdf(cut[1]) - scipy.stats.norm.cdf(cut[0]) < 1e-9:
        raise InputError(f"{where}: no part of the distribution lies between lower and upper.")
    return scipy.stats.truncnorm(*cut, loc=mean, scale=std)


def _uniform(where: str, given: Given) -> Any:
    if "mean" in given:
        half = np.sqrt(3.0) * _standard_deviation(where, given)
        return scipy.stats.uniform(loc=given["mean"] - half, scale=2.0 * half)
    _ordered(where, given)
    return scipy.stats.uniform(loc=given["lower"], scale=given["upper"] - given["lower"])


def _weibull(where: str, given: Given) -> Any:
    if "shape" in given:
        _positive(where, given, "scale")
        return scipy.stats.weibull_min(given["shape"], loc=given.get("lower", 0.0), scale=given["scale"])
    lower, mean, cov = _above(where, given)
    if not 0.005 <= cov <= 10.0:
        raise InputError(
            f"{where}: the scatter above its lower end is {cov:g} of the mean there; a Weibull takes 0.005 to 10."
        )

    def excess(log_shape: float) -> float:
        inverse = np.exp(-log_shape)
        return float(special.gammaln(1 + 2 * inverse) - 2 * special.gammaln(1 + inverse) - np.log1p(cov**2))

    shape = float(np.exp(scipy.optimize.brentq(excess, np.log(0.1), np.log(500.0), xtol=1e-14)))
    return scipy.stats.weibull_min(shape, loc=lower, scale=mean / special.gamma(1 + 1 / shape))


def _gamma(where: str, given: Given) -> Any:
    if "shape" in given:
        _positive(where, given, "scale")
        return scipy.stats.gamma(given["shape"], loc=given.get("lower", 0.0), scale=given["scale"])
    lower, mean, cov = _above(where, given)
    return scipy.stats.gamma(cov**-2, loc=lower, scale=mean * cov**2)


def _beta(where: str, given: Given) -> Any:
    _ordered(where, given)
    lower, width = given["lower"], given["upper"] - given["lower"]
    if "alpha" in given:
        return scipy.stats.beta(given["alpha"], given["beta"], loc=lower, scale=width)
    mean, std = (given["mean"] - lower) / width, _standard_deviation(where, given) / width
    if not 0 < mean < 1:
        raise InputError(f"{where} mean = {given['mean']:g}: must lie between lower and upper.")
    total = mean * (1 - mean) / std**2 - 1
    if not total > 0:
        most = np.sqrt(mean * (1 - mean)) * width
        raise InputError(
            f"{where}: with this mean a beta distribution has a standard deviation below {most:g}; given: "
            f"{std * width:g}."
        )
    return scipy.stats.beta(mean * total, (1 - mean) * total, loc=lower, scale=width)


Form = Callable[[str, Given], Any]

_SCATTER: tuple[tuple[str, ...], ...] = (("mean", "cov"), ("mean", "std"))


def _forms(build: Form, native: tuple[str, ...], *, lower: bool = False) -> dict[tuple[str, ...], Form]:
    """Family's parameters: mean with cov or std, or its own; with a lower end where it may be shifted."""
    ways = (*_SCATTER, native)
    return {names: build for way in ways for names in ((way, (*way, "lower")) if lower else (way,))}


FORMS: dict[str, dict[tuple[str, ...], Form]] = {
    "lognormal": _forms(_lognormal, ("median", "dispersion")),
    "normal": dict.fromkeys(_SCATTER, _normal),
    "truncated_normal": {(*names, "lower", "upper"): _truncated_normal for names in _SCATTER},
    "uniform": {("lower", "upper"): _uniform} | dict.fromkeys(_SCATTER, _uniform),
    "weibull": _forms(_weibull, ("shape", "scale"), lower=True),
    "gamma": _forms(_gamma, ("shape", "scale"), lower=True),
    "beta": {(*names, "lower", "upper"): _beta for names in (*_SCATTER, ("alpha", "beta"))},
}
"""Parameters of each family, and the function that makes its distribution of them."""


def scipy_distribution(where: str, name: str, parameters: Given, given: Given) -> Any:
    """Distribution of scipy.stats by its name."""
    stats = scipy.stats
    names = [n for n in dir(stats) if isinstance(getattr(stats, n), stats.rv_continuous | stats.rv_discrete)]
    if name not in names:
        raise InputError(f"{where} name = {name!r}: scipy.stats has no such distribution." + nearest(name, names))
    family = getattr(stats, name)
    discrete = isinstance(family, stats.rv_discrete)
    shapes = [s.strip() for s in family.shapes.split(",")] if family.shapes else []
    allowed = [*shapes, "loc"] if discrete or given else [*shapes, "loc", "scale"]
    if given:
        allowed = shapes
    for key in parameters:
        if key not in allowed:
            why = "; loc and scale follow from mean and scatter" if given and key in ("loc", "scale") else ""
            raise InputError(
                f"{where} parameters.{key}: scipy.stats.{name} takes here {', '.join(allowed) or 'none'}{why}."
                + nearest(key, allowed)
            )
    if missing := [s for s in shapes if s not in parameters]:
        raise InputError(f"{where} parameters: scipy.stats.{name} also needs {', '.join(missing)}.")
    if given and discrete:
        raise InputError(f"{where}: scipy.stats.{name} is discrete and takes its own parameters, no mean and scatter.")
    if given and set(given) not in ({"mean", "std"}, {"mean", "cov"}):
        raise InputError(f"{where}: scipy.stats.{name} takes parameters, or mean and cov, or mean and std.")
    frozen = family(**parameters)
    middle = float(frozen.ppf(0.5))
    if not np.isfinite(middle):
        given_text = ", ".join(f"{k} = {v:g}" for k, v in parameters.items())
        raise InputError(f"{where} parameters: scipy.stats.{name} has no distribution with {given_text or 'none'}.")
    if discrete:
        return _tabulated(where, name, frozen)
    if given:
        mean, std = float(frozen.mean()), float(frozen.std())
        if not (np.isfinite(mean) and np.isfinite(std) and std > 0):
            raise InputError(f"{where}: scipy.stats.{name} has no mean and scatter here; give loc and scale.")
        scale = _standard_deviation(where, given) / std
        frozen = family(**parameters, loc=given["mean"] - scale * mean, scale=scale)
    return frozen


def _tabulated(where: str, name: str, frozen: Any) -> Table:
    low, high = float(frozen.ppf(1e-16)), float(frozen.isf(1e-16))
    if not high - low < MOST_VALUES:
        raise InputError(f"{where}: scipy.stats.{name} takes more than {MOST_VALUES} values here.")
    values = np.arange(low, high + 1.0)
    weights = frozen.pmf(values)
    return Table(values[weights > 0], weights[weights > 0])
