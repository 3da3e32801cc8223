"""Jacks under the footing: under deflection control their load is one more unknown.

The path begins at the level state: while the dead load is applied, the jacks keep the footing's deflection at zero.
Then either the deflection grows with the movement and the load is found with the displacements, or the load grows in
proportion to its final value.
"""

from __future__ import annotations

from dataclasses import dataclass

from damagepred.arrays import FloatArray
from damagepred.assembly import Model


@dataclass
class JackControl:
    """Control of the jacks by deflection or by load.

    Attributes
    ----------
    push : array (size,)
        Force of unit loads.
    weights : array (size,)
        Of the degrees of freedom in the deflection.
    goal : float
        Deflection at full movement (m, upwards).
    level_load, load : float or None
        Load of each jack (N) in the level state, None until the load is controlled, and at full movement.
    """

    push: FloatArray
    weights: FloatArray
    goal: float
    level_load: float | None = None
    load: float = 0.0

    @classmethod
    def of(cls, model: Model) -> JackControl | None:
        """Return the control of a model's jacks in the level state; None if there are none."""
        if model.jacks is None or model.deflection is None:
            return None
        return cls(model.jacks.push, model.deflection, 0.0 if model.jacks.by_load else model.jacks.deflection)

    @property
    def by_load(self) -> bool:
        """Whether the load is given."""
        return self.level_load is not None

    def load_at(self, load_factor: float, found: float) -> float:
        """Return the load of each jack (N): the given one at a load factor, or the one found.

        Parameters
        ----------
        load_factor : float
            Share of the movement (1).
        found : float
            Load that was found where the deflection is given (N).
        """
        if self.level_load is None:
            return found
        return self.level_load + load_factor * (self.load - self.level_load)

    def gap(self, load_factor: float, displacement: FloatArray) -> float:
        """Return the missing deflection (m); 0 where the load is given.

        Parameters
        ----------
        load_factor : float
            Share of the movement (1).
        displacement : array (size,)
            Of all degrees of freedom.
        """
        return 0.0 if self.by_load else load_factor * self.goal - float(self.weights @ displacement)

    def step(self, alone: FloatArray, by_push: FloatArray, gap: float) -> tuple[FloatArray, float]:
        """Return the step of displacements and load that balances forces and reaches the deflection.

        Parameters
        ----------
        alone, by_push : array (size,)
            Displacements by the unbalanced forces, and by unit loads of the jacks.
        gap : float
            Deflection that is missing (m).
        """
        per_load = float(self.weights @ by_push)
        if not per_load > 0.0:  # the jacks lift nothing: leave the load as it is
            return alone, 0.0
        more = (gap - float(self.weights @ alone)) / per_load
        return alone + more * by_push, more
