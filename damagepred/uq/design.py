"""The design of a study: the inputs of every sample."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy import special

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.errors import InputError
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.correlation import cholesky, independent_normals, varying
from damagepred.uq.fields import CourseFields, JointPlaces, WallFields
from damagepred.uq.importance import Drawn, Proposal, draw
from damagepred.uq.marginals import JointQuantile, from_normal
from damagepred.uq.random_streams import RandomStream, generator
from damagepred.uq.samplers import WEIGHT, unit_points
from damagepred.uq.variable import Variable


@dataclass(frozen=True)
class Sampler:
    """How the values that hold for a whole wall are drawn."""

    kind: str = "sobol"  # see ``damagepred.uq.samplers.unit_points``; "table": the user brings them
    replicates: int = 1  # independent scrambles of Sobol points that take turns
    # where variables are drawn instead, by place (importance sampling)
    proposals: Mapping[str, Proposal] = field(default_factory=dict)
    nominal_share: float = 0.0  # share of walls drawn as stated all the same
    columns: tuple[str, ...] = ()  # places in the user's table
    read_table: Callable[[], Mapping[str, FloatArray]] | None = None  # returns the table: place -> array (samples,)
    crossed: bool = False  # samples come in fours: two walls, and two fields, in every combination (archives of 0.1)

    def wall_of(self, sample: IntArray) -> IntArray:
        """Number of the drawn wall of each sample."""
        return 2 * (sample // 4) + sample % 4 // 2 if self.crossed else sample

    def field_of(self, sample: int) -> int:
        """Number of the drawn field of a sample."""
        return 2 * (sample // 4) + sample % 2 if self.crossed else sample

    def unit_points(self, dimensions: int, samples: int, seed: int) -> FloatArray:
        """Points of the unit cube that the samples' walls are drawn from, array (samples, dimensions)."""
        if not self.crossed:
            return unit_points(self.kind, dimensions, samples, seed, self.replicates)
        # both walls of a table come from one point of twice the dimensions: points that follow each other in Sobol's
        # sequence are not independent
        both = unit_points(self.kind, 2 * dimensions, -(-samples // 4), seed, self.replicates)
        return both.reshape(-1, dimensions)[self.wall_of(np.arange(samples))] if dimensions else np.empty((samples, 0))


@dataclass(frozen=True)
class Design:
    """Distributions made ready to draw from."""

    seed: int  # of all streams
    sampler: Sampler  # how values are drawn that hold for a whole wall
    marginals: Mapping[str, Any]  # by place
    # places with one value per wall, and with one per joint
    wall: tuple[str, ...]
    joint: tuple[str, ...]
    wall_factor: FloatArray  # Cholesky factor of the correlation of the former
    fields: CourseFields | WallFields  # of places with one value per joint
    joint_quantiles: Mapping[str, JointQuantile]

    @classmethod
    @one_blas_thread()
    def make(
        cls,
        variables: Mapping[str, Variable],
        units: Mapping[str, str],
        correlation: Mapping[frozenset[str], float],
        sampler: Sampler | str,
        seed: int,
    ) -> Design:
        """Check the variables and prepare to draw."""
        if isinstance(sampler, str):
            sampler = Sampler(sampler)
        marginals = {place: v.frozen(f'[variables."{place}"]', units[place]) for place, v in variables.items()}
        wall = tuple(place for place, v in variables.items() if v.field is None)
        if sampler.kind == "table":
            wall = _table_places(sampler.columns, wall)
        joint = tuple(place for place, v in variables.items() if v.field is not None)
        for pair, value in correlation.items():
            if value and len(pair & set(wall)) == 1:
                a, b = sorted(pair, key=lambda p: p in joint)
                raise InputError(
                    f'[correlation] "{a}" with "{b}": one has a value per sample, the other a value per joint; give '
                    "both a field or neither."
                )
        fields = {place: f for place in joint if (f := variables[place].field) is not None}
        joint_factor = cholesky(joint, marginals, {p: c for p, c in correlation.items() if p <= set(joint)})
        wall_factor = cholesky(wall, marginals, {p: c for p, c in correlation.items() if p <= set(wall)})
        kind = CourseFields if all(f.by_course for f in fields.values()) else WallFields
        drawn = kind(fields, marginals, joint_factor)
        quantiles = {place: JointQuantile(marginals[place]) for place in joint}
        return cls(seed, sampler, marginals, wall, joint, wall_factor, drawn, quantiles)

    @one_blas_thread()
    def wall_values(self, samples: int) -> dict[str, FloatArray]:
        """Values that hold for a whole wall: place -> array (samples,)."""
        if self.sampler.kind == "table":
            rows = _rows(self.sampler, samples)
            return {place: rows[place] for place in self.wall}
        return self._from_normal(self.draw(samples).normal)

    @one_blas_thread()
    def wall_values_from(self, independent: FloatArray) -> dict[str, FloatArray]:
        """Values that hold for a whole wall, from independent standard normals (samples, variables)."""
        return self._from_normal(independent @ self.wall_factor.T)

    def _from_normal(self, normal: FloatArray) -> dict[str, FloatArray]:
        return {place: from_normal(self.marginals[place], normal[:, k]) for k, place in enumerate(self.wall)}

    @one_blas_thread()
    def weights(self, samples: int) -> FloatArray | None:
        """Weight of each sample, array (samples,); None without importance sampling."""
        if WEIGHT in self.sampler.columns:
            return _rows(self.sampler, samples)[WEIGHT]
        return self.draw(samples).weight if self.sampler.proposals else None

    @one_blas_thread()
    def draw(self, samples: int) -> Drawn:
        """Return the standard normals under the values of the walls, and the walls' weights."""
        from scipy.special import ndtri

        how, size = self.sampler, len(self.wall)
        mixed = bool(how.proposals) and how.nominal_share > 0
        unit = how.unit_points(size + mixed, samples, self.seed)
        independent, turn = ndtri(unit[:, :size]), unit[:, size] if mixed else None
        return draw(independent, self.wall_factor, self.wall, how.proposals, how.nominal_share, turn)

    @one_blas_thread()
    def joint_values(self, sample: int, places: JointPlaces) -> dict[str, FloatArray]:
        """Values that vary from joint to joint in one sample: place -> array (joints,)."""
        if not self.joint:
            return {}
        random = generator(self.seed, RandomStream.FIELD, self.sampler.field_of(sample))
        return self.joint_values_from(random.standard_normal((len(self.joint), len(places.sequence))), places)

    @one_blas_thread()
    def joint_values_from(self, independent: FloatArray, places: JointPlaces) -> dict[str, FloatArray]:
        """Values that vary from joint to joint, from independent standard normals."""
        normal = self.fields.draw(independent, places)
        return {place: self.joint_quantiles[place](normal[k]) for k, place in enumerate(self.joint)}


def _table_places(columns: tuple[str, ...], wall: tuple[str, ...]) -> tuple[str, ...]:
    for place in wall:
        raise InputError(
            f'[variables."{place}"]: '
            + (
                "is a column of the table, too; leave one of them out."
                if place in columns
                else "the table has no such column; add it, or give the variable a field, for one value per joint."
            )
        )
    return tuple(place for place in columns if place != WEIGHT)


def _rows(sampler: Sampler, samples: int) -> dict[str, FloatArray]:
    table = sampler.read_table() if sampler.read_table is not None else {}
    held = len(next(iter(table.values()), ()))
    if samples > held:
        raise InputError(f"samples = {samples}: the table has {held}; add rows to it, or ask for fewer with -n.")
    return {place: np.asarray(table[place][:samples]) for place in sampler.columns}


@one_blas_thread()
def density_ratio(stated: Design, other: Design, values: Mapping[str, FloatArray]) -> FloatArray:
    """Density of other distributions over the stated ones at each wall, array (samples,)."""
    return np.exp(_log_density(other, values) - _log_density(stated, values))


def _log_density(design: Design, values: Mapping[str, FloatArray]) -> FloatArray:
    total = np.zeros(len(next(iter(values.values()))))
    normal = np.empty((len(total), len(design.wall)))
    for k, place in enumerate(design.wall):
        marginal, x = design.marginals[place], values[place]
        if not hasattr(marginal, "logpdf"):
            raise InputError(
                f'[variables."{place}"]: a distribution without a density cannot be reweighted; run the alternative '
                "as a study of its own."
            )
        low, high = np.asarray(marginal.cdf(x)), np.asarray(marginal.sf(x))
        normal[:, k] = np.where(low < high, special.ndtri(low), -special.ndtri(high))
        if varying(design.wall_factor)[k]:
            with np.errstate(divide="ignore"):
                total = total + marginal.logpdf(x)
    # the Gaussian copula: density of correlated standard normals over independent ones
    inside: BoolArray = np.asarray(np.isfinite(normal).all(axis=1))
    normal = np.where(inside[:, None], normal, 0.0)
    varies = varying(design.wall_factor)
    try:
        independent = independent_normals(normal, design.wall_factor)
    except ValueError:
        raise InputError(
            "[correlation]: a variable that follows from others (correlation 1 or -1) has other values under the "
            "alternative, which no sample of this study has; change all of them alike, or run the alternative as a "
            "study."
        ) from None
    copula = 0.5 * (np.compress(varies, normal, axis=1) ** 2 - independent**2).sum(axis=1)
    copula = copula - np.log(np.diag(design.wall_factor)[varies]).sum()
    return np.where(inside, total + copula, -np.inf)
