"""Where a path on jacks ends: the jacks, or an outer support, carry nothing any more."""

from __future__ import annotations

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.solvers.system.footing_forces import outer_support_loads


def carried(model: Model, jack_load: float, sigma: FloatArray) -> float:
    """Return the load (N) at whose end the path ends: of a jack, or of the less loaded outer support.

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


class IllinoisRegulaFalsi:
    """Search for the load factor at which a load is just gone: false position, kept from creeping (Illinois).

    Parameters
    ----------
    load_factor, load : float
        Where something is carried still, and how much (N).
    gone, over : float
        Where nothing is carried any more, and how much less than nothing (N, not positive).
    enough : float
        Load that counts as none (N).
    close : float
        Progress between two points that count as one.
    """

    def __init__(
        self, load_factor: float, load: float, gone: float, over: float, *, enough: float, close: float
    ) -> None:
        self.load_factor, self.load, self.gone, self.over = load_factor, load, gone, over
        self.enough, self.close = enough, close
        self.vanished, self.last = abs(over) <= enough, 0.0
        """Load noted last: twice on the same side, the other side's is taken as half."""

    @property
    def found(self) -> bool:
        """Whether the two points are one, or the load at the farther is as good as none."""
        return self.vanished or self.gone - self.load_factor < self.close

    def between(self) -> float:
        """Return the load factor to look at next."""
        return self.load_factor + self.load / (self.load - self.over) * (self.gone - self.load_factor)

    def note(self, load_factor: float, load: float) -> bool:
        """Take down what is carried at a load factor between; tell whether it is something still."""
        if load > self.enough:
            if self.last > 0.0:
                self.over /= 2.0
            self.load_factor, self.load, self.last = load_factor, load, load
            return True
        if self.last < 0.0:
            self.load /= 2.0
        self.gone, self.over, self.last = load_factor, load, load
        self.vanished = abs(load) <= self.enough
        return False
