"""End of a path on jacks: the load factor at which the load of the jacks or of an outer support vanishes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.solvers.system.footing_forces import outer_support_loads


def least_support_load(model: Model, jack_load: float, sigma: FloatArray) -> float:
    """Return the load (N) whose loss ends the path: of a jack, or of the less loaded outer support.

    Parameters
    ----------
    model : Model
        m interfaces with q contacts.
    jack_load : float
        Of each jack (N).
    sigma : array (m, q)
        Normal stress (Pa), tension positive.

    Returns
    -------
    float
        Infinite if nothing ends the path.
    """
    jacks = model.jacks
    if jacks is None or not jacks.stop:
        return np.inf
    if jacks.stop == "jacks":
        return jack_load
    return float(outer_support_loads(model, jacks.ends, sigma).min())


@dataclass
class IllinoisRegulaFalsi:
    """Root of a falling function: regula falsi, Illinois variant (Dowell and Jarratt 1971).

    Attributes
    ----------
    left, right : (float, float)
        Ends of the bracket: argument and value, positive on the left. Of two trials in a row on the same side, the
        second halves the value on the other.
    tolerance : float
        Value that counts as zero.
    bracket : float
        Length of the bracket that ends the search.
    """

    left: tuple[float, float]
    right: tuple[float, float]
    tolerance: float
    bracket: float
    _zero: bool = field(init=False)
    _side: int = 0

    def __post_init__(self) -> None:
        self._zero = abs(self.right[1]) <= self.tolerance

    @property
    def converged(self) -> bool:
        """Whether the root is found."""
        return self._zero or self.right[0] - self.left[0] < self.bracket

    def next_trial(self) -> float:
        """Return the root of the secant."""
        (a, value_a), (b, value_b) = self.left, self.right
        return a + value_a / (value_a - value_b) * (b - a)

    def update(self, trial: float, value: float) -> bool:
        """Narrow the bracket; return whether the trial is on the left of the root.

        Parameters
        ----------
        trial, value : float
            Argument and value.
        """
        if value > self.tolerance:
            if self._side > 0:
                self.right = self.right[0], 0.5 * self.right[1]
            self.left, self._side = (trial, value), 1
            return True
        if self._side < 0:
            self.left = self.left[0], 0.5 * self.left[1]
        self.right, self._side, self._zero = (trial, value), -1, abs(value) <= self.tolerance
        return False
