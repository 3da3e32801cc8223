"""End of a path on jacks: the load factor at which the load of the jacks or of an outer support vanishes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.solvers.system.footing_forces import outer_support_loads


def least_support_load(model: Model, jack_load: float, sigma: FloatArray) -> float:
    """Load (N) whose loss ends the path: of a jack, or of the less loaded outer support."""
    jacks = model.jacks
    if jacks is None or not jacks.stop:
        return np.inf
    if jacks.stop == "jacks":
        return jack_load
    return float(outer_support_loads(model, jacks.ends, sigma).min())


@dataclass
class IllinoisRegulaFalsi:
    """Root of a falling function: regula falsi, Illinois variant (Dowell and Jarratt 1971)."""

    # argument and value of both ends, positive on the left; a second trial in a row on one side halves the other value
    left: tuple[float, float]
    right: tuple[float, float]
    tolerance: float  # value that counts as zero
    bracket: float  # final length of the bracket
    _zero: bool = field(init=False)
    _side: int = 0

    def __post_init__(self) -> None:
        self._zero = abs(self.right[1]) <= self.tolerance

    @property
    def converged(self) -> bool:
        """Whether the root is found."""
        return self._zero or self.right[0] - self.left[0] < self.bracket

    def next_trial(self) -> float:
        """Root of the secant."""
        (a, value_a), (b, value_b) = self.left, self.right
        return a + value_a / (value_a - value_b) * (b - a)

    def update(self, trial: float, value: float) -> bool:
        """Narrow the bracket; True if the trial is left of the root."""
        if value > self.tolerance:
            if self._side > 0:
                self.right = self.right[0], 0.5 * self.right[1]
            self.left, self._side = (trial, value), 1
            return True
        if self._side < 0:
            self.left = self.left[0], 0.5 * self.left[1]
        self.right, self._side, self._zero = (trial, value), -1, abs(value) <= self.tolerance
        return False
