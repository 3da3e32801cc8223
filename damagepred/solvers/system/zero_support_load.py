"""End of a path on jacks: the load factor at which the jacks or an outer support carry nothing any more."""

from __future__ import annotations

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.solvers.system.footing_forces import outer_support_loads


def carried(model: Model, jack_load: float, sigma: FloatArray) -> float:
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


class IllinoisRegulaFalsi:
    """Root of the support load along the path: regula falsi, Illinois variant (Dowell and Jarratt 1971).

    Parameters
    ----------
    load_factor, load : float
        End of the bracket where load is carried (1, N).
    gone, over : float
        End of the bracket where none is carried, and the load there (1, N, not positive).
    enough : float
        Load that counts as none (N).
    close : float
        Length of the bracket that ends the search (1).
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
        """Whether the search has converged."""
        return self.vanished or self.gone - self.load_factor < self.close

    def between(self) -> float:
        """Return the next trial load factor."""
        return self.load_factor + self.load / (self.load - self.over) * (self.gone - self.load_factor)

    def note(self, load_factor: float, load: float) -> bool:
        """Narrow the bracket with a trial; return whether load is carried there.

        Parameters
        ----------
        load_factor : float
            Of the trial (1).
        load : float
            Carried there (N). Twice on the same side: the other end's load is halved (Illinois).
        """
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
