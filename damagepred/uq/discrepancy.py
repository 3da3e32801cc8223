"""Discrepancy of the model against real walls, and its distribution."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
from pydantic import Field
from scipy import special

from damagepred.arrays import FloatArray
from damagepred.inputs.data_files import data_tables
from damagepred.scene.described import described
from damagepred.scene.quantity import Length, Pure

_shipped_terms = partial(data_tables, "statistics", "discrepancy.toml")  # with interval, source and confidence


def _shipped(name: str) -> Callable[[], float]:
    return partial(lambda key: float(_shipped_terms()[key]["value"]), name)


@described
class Discrepancy:
    """Standard deviations of the model against real walls (``[discrepancy]``), shown with every result.

    Those of crack widths are fitted on the cases of the validation; the others are assumed
    (``data/statistics/discrepancy.toml``). The fitted ones are lognormal about the values here; a value that the user
    gives instead is certain.
    """

    width: Length = Field(default_factory=_shipped("width"), gt=0)
    """Of a crack width (m), added in squares to its share."""
    width_share: Pure = Field(default_factory=_shipped("width_share"), ge=0)
    """Of a crack width, as a share of it."""
    level: Length = Field(default_factory=_shipped("level"), gt=0)
    """Standard deviation of a difference of levels (m)."""
    slope: Pure = Field(default_factory=_shipped("slope"), gt=0)
    """Standard deviation of a slope or tilt."""
    distortion_share: Pure = Field(default_factory=_shipped("distortion_share"), gt=0)
    """Of the distortion of an opening, as a share of it."""
    direction: Pure = Field(default_factory=_shipped("direction"), gt=0, lt=1)
    """Probability that a crack runs in another direction in the model."""

    def origins(self) -> dict[str, tuple[str, str]]:
        """Interval (90 %) and level of confidence of each term; values that the user gave have neither."""
        terms = {}
        for name, term in _shipped_terms().items():
            interval = f"{term['low']:g} to {term['high']:g}" if "low" in term else "-"
            shipped = getattr(self, name) == term["value"]
            terms[name] = (interval, str(term["confidence"])) if shipped else ("-", "given")
        return terms

    @property
    def uncertain(self) -> list[str]:
        """Names of the terms that are fitted and have an interval."""
        return [name for name, (interval, _) in self.origins().items() if interval != "-"]

    def at(self, normal: FloatArray) -> Discrepancy:
        """Discrepancy at independent standard normals, one per uncertain term: correlated lognormal terms."""
        names, terms = self.uncertain, _shipped_terms()
        fitted = [terms[name] for name in names]
        deviation = [np.log(term["high"] / term["low"]) / (2.0 * special.ndtri(0.95)) for term in fitted]
        below = np.array([[term.get("correlation", {}).get(name, 0.0) for name in names] for term in fitted])
        root = np.linalg.cholesky(np.eye(len(names)) + below + below.T)
        factors = np.exp(deviation * (root @ normal))
        return replace(self, **{name: getattr(self, name) * float(f) for name, f in zip(names, factors)})

    def nodes(self, points: int) -> list[tuple[float, Discrepancy]]:
        """Weights and discrepancies of a product Gauss-Hermite quadrature with this many points per uncertain term."""
        if not self.uncertain:
            return [(1.0, self)]
        places, weights = np.polynomial.hermite_e.hermegauss(points)
        product = itertools.product(range(points), repeat=len(self.uncertain))
        chosen = [list(chosen_nodes) for chosen_nodes in product]
        total = float(weights.sum() ** len(self.uncertain))
        return [(float(np.prod(weights[nodes])) / total, self.at(places[nodes])) for nodes in chosen]


def stacked(models: Sequence[Discrepancy]) -> Any:
    """Discrepancies as one, whose terms are arrays (discrepancies,)."""
    names = [field.name for field in fields(Discrepancy)]
    return SimpleNamespace(**{name: np.array([getattr(model, name) for model in models]) for name in names})
