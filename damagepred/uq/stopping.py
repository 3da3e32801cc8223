"""Sequential stopping rule: interim analyses whenever walls have doubled, with simultaneous confidence intervals.

For random samples the errors of analyses at n and m walls have the correlation sqrt(n/m), and the widening follows by
recursive integration (Armitage, McPherson and Rowe 1969). For replicated Sobol points Sidak's inequality holds.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
import scipy
import xarray as xr
from pydantic import Field, model_validator
from scipy import special

from damagepred.arrays import FloatArray
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene.described import completed_by, described
from damagepred.scene.quantity import Count, Length, Pure
from damagepred.uq.estimate import Estimate
from damagepred.uq.exceedance import exceedance

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(80)


def _without_quantity(table: Mapping[str, Any]) -> dict[str, Any]:
    """Table without the key of older versions, which chose between a probability and a median."""
    if table.get("quantity") == "median":
        raise ValueError(
            "quantity = 'median': has been removed; give at, a movement near the median, and the half_width of the "
            "probability there"
        )
    return {key: value for key, value in table.items() if key != "quantity"}


@described
class StopWhen:
    """When a study has walls enough (``[study.stop_when]``)."""

    category: Annotated[Count, Field(ge=1)]
    """Category, or worse."""
    at: Length = Field(gt=0)
    """Movement (m) at which the probability of the category is estimated."""
    half_width: Pure | None = Field(default=None, gt=0)
    """Half the width of the confidence interval (1)."""
    relative_half_width: Pure | None = Field(default=None, gt=0)
    """Half the width over the estimate (1)."""
    confidence: Pure = Field(default=0.9, gt=0, lt=1)
    """Confidence level of all intervals together."""
    first: Count = Field(default=64, ge=8)
    """Walls at the first interim analysis; each further one is at twice as many."""

    _without_quantity = completed_by(_without_quantity)

    @model_validator(mode="after")
    def _has_one_width(self) -> StopWhen:
        if (self.half_width is None) == (self.relative_half_width is None):
            raise ValueError("takes half_width or relative_half_width, one of them")
        return self

    def estimate(self, ds: xr.Dataset, confidence: float) -> Estimate:
        """Probability from a study."""
        return exceedance(ds, self.category, self.at, confidence=confidence).estimate

    def met(self, estimate: Estimate) -> bool:
        """Whether the interval is narrow enough."""
        if not np.isfinite(estimate.half_width):
            return False
        if self.half_width is not None:
            return estimate.half_width <= self.half_width
        return estimate.half_width <= float(self.relative_half_width or 0.0) * estimate.value

    def name(self) -> str:
        """Probability in words."""
        return f"P(category >= {self.category} at {1e3 * self.at:g} mm)"


def interim_sizes(first: int, most: int) -> list[int]:
    """Numbers of walls of the interim analyses: doubled from the first up to the most that are allowed."""
    sizes = [min(first, most)]
    while sizes[-1] < most:
        sizes.append(min(2 * sizes[-1], most))
    return sizes


@one_blas_thread()
def interim_confidence(at: list[int], confidence: float, replicated: bool) -> float:
    """Confidence of each interval, so that all hold at once with the confidence wanted."""
    if len(at) == 1:
        return confidence
    if replicated:
        return float(confidence ** (1 / len(at)))
    sizes = np.array(at, dtype=np.float64)
    factor = float(scipy.optimize.brentq(lambda c: _simultaneous_coverage(c, sizes) - confidence, 0.5, 8.0, xtol=1e-6))
    return float(2 * special.ndtr(factor) - 1)


def _simultaneous_coverage(factor: float, sizes: FloatArray) -> float:
    """Probability that the means of a growing sample all lie within ``factor`` standard errors."""
    z, dz = factor * _NODES, factor * _WEIGHTS
    density = np.exp(-0.5 * z**2) / np.sqrt(2 * np.pi)
    for before, now in itertools.pairwise(sizes):
        carried = np.sqrt(before / now)
        fresh = np.sqrt(1 - before / now)
        kernel = np.exp(-0.5 * ((z[:, None] - carried * z[None, :]) / fresh) ** 2) / (fresh * np.sqrt(2 * np.pi))
        density = kernel @ (density * dz)
    return float(density @ dz)
