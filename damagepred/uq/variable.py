"""Uncertain numbers of a scene: their distributions, and whether they vary from wall to wall or from joint to joint."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from damagepred.errors import InputError, nearest
from damagepred.scene.described import described
from damagepred.scene.number_table import read_number_table
from damagepred.scene.quantity import Length, Pure, to_si
from damagepred.uq import families
from damagepred.uq.marginals import Mixture, Table


def _no_bool(value: Any) -> Any:
    if isinstance(value, bool):
        raise ValueError("expected a number or a string with a unit")
    return value


Number = Annotated[float | str, BeforeValidator(_no_bool)]
Family = Literal[
    "lognormal",
    "normal",
    "truncated_normal",
    "uniform",
    "weibull",
    "beta",
    "gamma",
    "discrete",
    "empirical",
    "scipy",
    "mixture",
]

_OF_THE_UNIT = ("mean", "std", "median", "lower", "upper", "scale")
_PURE = ("cov", "dispersion", "shape", "alpha", "beta")
_OF_TABLES = ("values", "weights", "file", "column", "unit")
_OF_SCIPY = ("name", "parameters")

T = TypeVar("T", bound="Distribution")


@described
class JointField:
    """One value for each joint instead of one for the wall (``field = { ... }``).

    Beds, perpends and the dpc are independent of each other. The correlations are of the variable itself.
    """

    course_correlation: Pure = Field(default=0.0, ge=0, lt=1)
    """Correlation of the values of two neighbouring units' joints in a course; courses are independent. With ``over =
    "wall"`` the same correlation at the distance of a unit's length in any direction. Along a course it is solved for
    neighbours (Nataf). k joints apart the underlying normals have the k-th power of their correlation. Skewed values
    have a slightly different power: lognormal ones (exp(rho^k s^2) - 1) / (exp(s^2) - 1), with s the standard deviation
    of the logarithm. A correlation_length is solved at every distance."""
    correlation_length: Length | None = Field(default=None, gt=0)
    """Instead: the correlation falls with the distance d of two joints as exp(-d / correlation_length) (m)."""
    vertical_length: Length | None = Field(default=None, gt=0)
    """Correlation length upwards, if another than along the wall (m): d / correlation_length becomes the root of (dx /
    correlation_length)^2 + (dy / vertical_length)^2."""
    over: Literal["course", "wall"] | None = None
    """Whether only joints of one course are correlated, between the same openings, or all of the wall. None: the wall
    with a correlation_length, the course with a course_correlation."""
    nugget: Pure = Field(default=0.0, ge=0, lt=1)
    """With a correlation_length: share of the variance that is each joint's own. The correlation is then (1 - nugget)
    exp(-d / correlation_length) however near two joints are."""

    @model_validator(mode="after")
    def _one_way(self) -> JointField:
        if self.correlation_length is not None and self.course_correlation:
            raise ValueError("correlation_length and course_correlation say the same in two ways; give one")
        if self.vertical_length is not None and (self.correlation_length is None or self.over == "course"):
            raise ValueError("vertical_length: goes with a correlation_length over the wall")
        if self.nugget and self.correlation_length is None:
            raise ValueError("nugget: goes with a correlation_length; course_correlation already says all")
        return self

    @property
    def by_course(self) -> bool:
        """Whether each joint depends only on the one before it in its course."""
        return self.correlation_length is None and self.over != "wall"


@described
class Distribution:
    """How a number scatters; values in the unit of that number, or with a unit."""

    distribution: Family
    """``lognormal``: mean with cov or std, or median with dispersion (standard deviation of the logarithm). ``normal``:
    mean with cov or std. ``truncated_normal``: the same, of the normal before it is cut to lower and upper.
    ``uniform``: lower and upper, or mean with cov or std. ``weibull``, ``gamma``: mean with cov or std, or shape and
    scale, and lower if they begin elsewhere than at 0. ``beta``: lower and upper with mean and cov or std, or with
    alpha and beta. ``discrete``: values, and weights unless all are equally likely. ``empirical``: values that were
    measured, or file and column, all equally likely. ``scipy``: name of a distribution of scipy.stats and its
    parameters, or its shapes with mean and cov or std. ``mixture``: components, one of which each value comes from."""
    mean: Number | None = None
    """Mean, in the number's unit, as the five that follow."""
    std: Number | None = None
    """Standard deviation."""
    median: Number | None = None
    """Median of a lognormal distribution."""
    lower: Number | None = None
    """Lower bound."""
    upper: Number | None = None
    """Upper bound."""
    scale: Number | None = None
    """Scale of a Weibull or gamma distribution."""
    cov: Pure | None = Field(default=None, gt=0, le=10)
    """Coefficient of variation."""
    dispersion: Pure | None = Field(default=None, gt=0)
    """Standard deviation of the logarithm."""
    shape: Pure | None = Field(default=None, gt=0)
    """Shape of a Weibull or gamma distribution."""
    alpha: Pure | None = Field(default=None, gt=0)
    """First parameter of a beta distribution."""
    beta: Pure | None = Field(default=None, gt=0)
    """Second parameter of a beta distribution."""
    values: tuple[Number, ...] = ()
    """Of discrete and empirical, in the number's unit."""
    weights: tuple[Annotated[Pure, Field(gt=0)], ...] = ()
    """Weights of discrete values, positive, of any sum."""
    file: str | None = None
    """CSV file beside the study file."""
    column: str | None = None
    """Column of that file."""
    unit: str | None = None
    """Unit of that column (SI if left out)."""
    name: str | None = None
    """Name and parameters of a distribution of scipy.stats."""
    parameters: dict[str, Number] | None = None
    """As scipy.stats calls them; loc and scale in the number's unit."""
    source: str | None = None
    """Where the figures come from, for the archive."""

    def with_values(self: T, where: str, unit: str, folder: Path) -> T:
        """Distribution with measured values instead of the name of their file; ``where``: its table, for messages."""
        if self.file is None:
            return self
        if self.distribution != "empirical" or self.column is None or self.values:
            raise InputError(f"{where} file: goes with distribution = 'empirical' and the name of a column, no values.")
        try:
            table = read_number_table(folder / self.file)
            if (column := table.find(self.column)) is None:
                names = ", ".join(table.names)
                hint = nearest(self.column, table.names)
                raise InputError(f"{table.path}: column = '{self.column}': it has {names}.{hint}")
            values = tuple(table.numbers(column, unit, self.unit, gaps=True).tolist())
        except InputError as error:
            raise InputError(f"{where} file = {error}") from None
        gaps = len(table.cells) - len(values)
        empty = f", {gaps} empty cells left out" if gaps > 0 else ""
        source = self.source or f"{table.path.name}, column {self.column}{empty}"
        return dataclasses.replace(self, values=values, file=None, column=None, unit=None, source=source)

    def frozen(self, where: str, unit: str) -> Any:
        """Distribution in SI, as scipy.stats freezes them; ``where``: its table, for messages."""
        given = self._numbers(where, unit)
        extra = {"discrete": ("values", "weights"), "empirical": ("values",), "scipy": _OF_SCIPY}
        for name in (*_OF_TABLES, *_OF_SCIPY):
            if getattr(self, name) and name not in extra.get(self.distribution, ()):
                more = " after the study file is read" if name == "file" and self.distribution == "empirical" else ""
                raise InputError(f"{where} {name}: is not read with distribution = '{self.distribution}'{more}.")
        if self.distribution == "scipy":
            return self._of_scipy(where, unit, given)
        if self.distribution in ("discrete", "empirical"):
            return self._table(where, unit, given)
        return families.make(self.distribution, where, given)

    def _numbers(self, where: str, unit: str) -> dict[str, float]:
        names = ("mean", "std", "median", "lower", "upper", "scale", *_PURE)
        given = {name: value for name in names if (value := getattr(self, name)) is not None}
        return {key: _number(where, key, value, unit if key in _OF_THE_UNIT else "1") for key, value in given.items()}

    def _table(self, where: str, unit: str, given: dict[str, float]) -> Table:
        if given:
            raise InputError(
                f"{where}: a {self.distribution} distribution takes values"
                + (" and weights" if self.distribution == "discrete" else " or file and column")
                + f"; given: {', '.join(given)}."
            )
        if not self.values:
            raise InputError(f"{where} values: has none; give at least one.")
        if self.weights and len(self.weights) != len(self.values):
            raise InputError(
                f"{where} weights: {len(self.weights)} of them for {len(self.values)} values; give one for each."
            )
        numbers = [_number(where, f"values, item {i}", v, unit) for i, v in enumerate(self.values, 1)]
        return Table(numbers, self.weights or None)

    def _of_scipy(self, where: str, unit: str, given: dict[str, float]) -> Any:
        if self.name is None:
            raise InputError(f"{where} name: is missing; give the name of a distribution of scipy.stats.")
        units = {"loc": unit, "scale": unit}
        stated = (self.parameters or {}).items()
        parameters = {key: _number(where, f"parameters.{key}", value, units.get(key, "1")) for key, value in stated}
        return families.scipy_distribution(where, self.name, parameters, given)


def _number(where: str, name: str, value: Any, unit: str) -> float:
    try:
        return to_si(value, unit)
    except ValueError as error:
        raise InputError(f"{where} {name} = {value!r}: {error}.") from None


@described
class Component(Distribution):
    """One part of a mixture (``[[variables."place".components]]``)."""

    weight: Pure = Field(gt=0)
    """How often it occurs, against the weights of the others."""

    @model_validator(mode="after")
    def _plain(self) -> Component:
        if self.distribution == "mixture":
            raise ValueError("distribution = 'mixture': a component cannot be a mixture itself; list all components")
        return self


@described
class Variable(Distribution):
    """Distribution of one number (``[variables."place"]``)."""

    components: tuple[Component, ...] = ()
    """Components of a mixture."""
    field: JointField | None = None
    """If given, the number varies from joint to joint; only for numbers of ``joint`` and ``dpc``."""

    def with_values(self, where: str, unit: str, folder: Path) -> Variable:
        """Variable and its components with measured values."""
        itself = super().with_values(where, unit, folder)
        parts = tuple(part.with_values(w, unit, folder) for w, part in self._named(where))
        return itself if parts == self.components else dataclasses.replace(itself, components=parts)

    def frozen(self, where: str, unit: str) -> Any:
        """Distribution or mixture in SI."""
        if self.distribution != "mixture":
            if self.components:
                raise InputError(f"{where} components: are read with distribution = 'mixture' only.")
            return super().frozen(where, unit)
        if given := [n for n in (*_OF_THE_UNIT, *_PURE, *_OF_TABLES, *_OF_SCIPY) if getattr(self, n) not in (None, ())]:
            raise InputError(f"{where}: a mixture takes components; given: {', '.join(given)}.")
        if len(self.components) < 2:
            raise InputError(f"{where} components: has {len(self.components)}; a mixture takes two or more.")
        parts = [part.frozen(w, unit) for w, part in self._named(where)]
        try:
            return Mixture(parts, np.array([part.weight for part in self.components]))
        except ValueError:
            raise InputError(f"{where} components: one has values that are not finite; look at its spread.") from None

    def _named(self, where: str) -> Sequence[tuple[str, Component]]:
        return [(f"{where} component {i}", part) for i, part in enumerate(self.components, 1)]
