"""Uncertain numbers of a scene: how they scatter, and whether from wall to wall or from joint to joint."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from damagepred.errors import InputError
from damagepred.scene.described import described
from damagepred.scene.quantity import Pure, to_si


def _no_bool(value: Any) -> Any:
    if isinstance(value, bool):
        raise ValueError("expected a number or a string with a unit")
    return value


Number = Annotated[float | str, BeforeValidator(_no_bool)]
Family = Literal["lognormal", "normal", "truncated_normal", "uniform"]


@described
class JointField:
    """One value for each joint instead of one for the wall (``field = { ... }``).

    Attributes
    ----------
    course_correlation : float
        Correlation of the value with that of the next unit's joint in the same course; courses are independent.
    """

    course_correlation: Pure = Field(default=0.0, ge=0, lt=1)


@described
class Variable:
    """Distribution of one number (``[variables."place"]``); values in the unit of that number, or with a unit.

    Attributes
    ----------
    distribution : {"lognormal", "normal", "truncated_normal", "uniform"}
        ``lognormal``: mean with cov or std, or median with dispersion (standard deviation of the logarithm).
        ``normal``: mean with cov or std. ``truncated_normal``: the same, of the normal before it is cut to lower
        and upper. ``uniform``: lower and upper.
    mean, std, median, lower, upper : float or str or None
        In the number's unit.
    cov, dispersion : float or None
        Coefficient of variation; standard deviation of the logarithm.
    field : JointField or None
        If given, the number varies from joint to joint; only for numbers of ``joint`` and ``dpc``.
    """

    distribution: Family
    mean: Number | None = None
    std: Number | None = None
    median: Number | None = None
    lower: Number | None = None
    upper: Number | None = None
    cov: Pure | None = Field(default=None, gt=0)
    dispersion: Pure | None = Field(default=None, gt=0)
    field: JointField | None = None

    def frozen(self, place: str, unit: str) -> Any:
        """Return the frozen scipy.stats distribution, in SI.

        Parameters
        ----------
        place : str
            The number's place, for messages.
        unit : str
            Its SI unit.

        Raises
        ------
        InputError
            If the parameters given are not those the distribution takes, or make no sense.
        """
        given = {
            name: self._number(name, place, unit if name not in ("cov", "dispersion") else "1")
            for name in ("mean", "std", "median", "lower", "upper", "cov", "dispersion")
            if getattr(self, name) is not None
        }
        forms = _FORMS[self.distribution]
        for names, make in forms.items():
            if set(names) == set(given):
                return make(f'[variables."{place}"]', given)
        wanted = " or ".join(" and ".join(names) for names in forms)
        raise InputError(
            f'[variables."{place}"]: a {self.distribution} distribution takes {wanted}; '
            f"given: {', '.join(given) or 'nothing'}."
        )

    def _number(self, name: str, place: str, unit: str) -> float:
        try:
            return to_si(getattr(self, name), unit)
        except ValueError as error:
            raise InputError(f'[variables."{place}"] {name} = {getattr(self, name)!r}: {error}.') from None


def _positive(where: str, given: Mapping[str, float], *names: str) -> None:
    for name in names:
        if not given[name] > 0:
            raise InputError(f"{where} {name} = {given[name]:g}: must be greater than 0.")


def _spread(where: str, given: Mapping[str, float]) -> float:
    spread = given["std"] if "std" in given else abs(given["mean"]) * given["cov"]
    if not spread > 0:
        raise InputError(f"{where}: its standard deviation is {spread:g}; a mean of 0 needs std instead of cov.")
    return spread


def _lognormal(where: str, given: Mapping[str, float]) -> Any:
    from scipy import stats

    if "median" in given:
        _positive(where, given, "median")
        return stats.lognorm(s=given["dispersion"], scale=given["median"])
    _positive(where, given, "mean")
    variance = np.log1p((_spread(where, given) / given["mean"]) ** 2)
    return stats.lognorm(s=np.sqrt(variance), scale=given["mean"] * np.exp(-variance / 2))


def _normal(where: str, given: Mapping[str, float]) -> Any:
    from scipy import stats

    return stats.norm(loc=given["mean"], scale=_spread(where, given))


def _ordered(where: str, given: Mapping[str, float]) -> None:
    if not given["lower"] < given["upper"]:
        raise InputError(f"{where} lower = {given['lower']:g}: must be below upper = {given['upper']:g}.")


def _truncated_normal(where: str, given: Mapping[str, float]) -> Any:
    from scipy import stats

    _ordered(where, given)
    mean, spread = given["mean"], _spread(where, given)
    cut = ((given["lower"] - mean) / spread, (given["upper"] - mean) / spread)
    if stats.norm.cdf(cut[1]) - stats.norm.cdf(cut[0]) < 1e-9:
        raise InputError(f"{where}: nothing of the distribution lies between lower and upper.")
    return stats.truncnorm(*cut, loc=mean, scale=spread)


def _uniform(where: str, given: Mapping[str, float]) -> Any:
    from scipy import stats

    _ordered(where, given)
    return stats.uniform(loc=given["lower"], scale=given["upper"] - given["lower"])


_FORMS: dict[str, dict[tuple[str, ...], Callable[[str, Mapping[str, float]], Any]]] = {
    "lognormal": {("mean", "cov"): _lognormal, ("mean", "std"): _lognormal, ("median", "dispersion"): _lognormal},
    "normal": {("mean", "cov"): _normal, ("mean", "std"): _normal},
    "truncated_normal": {
        ("mean", "cov", "lower", "upper"): _truncated_normal,
        ("mean", "std", "lower", "upper"): _truncated_normal,
    },
    "uniform": {("lower", "upper"): _uniform},
}
