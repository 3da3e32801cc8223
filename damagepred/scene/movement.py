"""Movement of the footing: its shape, its size and the increments in which it grows."""

from __future__ import annotations

import itertools
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.scene.described import described
from damagepred.scene.footing_profile import arc, three_loads, through_points
from damagepred.scene.quantity import Count, Length, Pure


@described
class Movement:
    """Movement of the footing (``[movement]``), reached in equal increments.

    Attributes
    ----------
    kind : {"dishing", "doming"}
        Dishing: the centre goes down relative to the ends; doming: it goes up.
    central_deflection : float
        Final deflection of the centre relative to the ends (m), not negative; 0 leaves self weight alone. Not read
        on a mound, nor on jacks whose load is controlled.
    increments : int
        Number of equal increments.
    shape : {"three_loads", "parabola", "arc", "table", "jacks", "mound"}
        Form of the footing. ``three_loads``: elastic beam under equal loads at the quarter points.
        ``parabola``: uniform small curvature. ``arc``: circle through ends and centre, flatter on the way; under a
        deformable footing the final circle scaled, a difference of (deflection / length)^2. ``table``: as given.
        With the others the footing is a beam that finds its own form. ``jacks``: on the supports and jacks of
        ``[rig]``. ``mound``: on the ``[soil]``, whose surface moves as ``[mound]`` says.
    table : sequence of (position, fraction)
        For ``shape = "table"``: position along the wall from 0 to 1, and deflection there as a fraction of the
        central one. It is 0 at both ends, and not 0 in the middle, where it is scaled to 1. Between the points a
        monotone cubic is drawn (PCHIP).
    """

    kind: Literal["dishing", "doming"] = "dishing"
    central_deflection: Length = Field(default=8e-3, ge=0)
    increments: Count = Field(default=20, ge=1)
    shape: Literal["three_loads", "parabola", "arc", "table", "jacks", "mound"] = "three_loads"
    table: tuple[tuple[Pure, Pure], ...] = ()

    @model_validator(mode="after")
    def _table_fits(self) -> Movement:
        if self.shape != "table":
            if self.table:
                raise ValueError(f"table: only read with shape = 'table'; here shape = '{self.shape}'")
            return self
        if len(self.table) < 3:
            raise ValueError("table: needs at least 3 points [position, fraction], from position 0 to 1")
        position = [p for p, _ in self.table]
        if position[0] != 0 or position[-1] != 1 or any(b <= a for a, b in itertools.pairwise(position)):
            raise ValueError("table: positions must rise from 0 to 1 (fractions of the wall's length)")
        if self.table[0][1] != 0 or self.table[-1][1] != 0:
            raise ValueError("table: the deflection must be 0 at both ends; subtract the straight line between them")
        if abs(float(through_points(self.table, np.array([0.5]))[0])) < 1e-6:
            raise ValueError("table: the deflection in the middle (position 0.5) must not be 0: the others scale to it")
        return self

    @property
    def prescribed(self) -> bool:
        """Whether the underside of the wall or footing follows a given form, as it does not on jacks or a mound."""
        return self.shape not in ("jacks", "mound")

    @property
    def sign(self) -> float:
        """+1 for doming (up), -1 for dishing (down)."""
        return 1.0 if self.kind == "doming" else -1.0

    @property
    def proportional(self) -> bool:
        """Whether smaller movements have the same form; flatter arcs have not quite, by (deflection / length)^2."""
        return self.shape != "arc"

    def profile(self, position: FloatArray, length: float, load_factor: float = 1.0) -> FloatArray:
        """Vertical displacement (m, upwards) of the footing.

        Parameters
        ----------
        position : array of float
            Distance x from the left end of the wall (m), any shape.
        length : float
            Length of the wall (m).
        load_factor : float
            Deflection reached over ``central_deflection``.

        Returns
        -------
        array of float
            Same shape; 0 at both ends, +/- ``load_factor`` times ``central_deflection`` in the middle.

        Raises
        ------
        InputError
            If the footing finds its own form.
        """
        if not self.prescribed:
            raise InputError(
                f"movement.shape = '{self.shape}': the footing finds its own form, so there is no profile to follow; "
                "take 'three_loads', 'parabola', 'arc' or 'table' for a prescribed one."
            )
        xi = np.asarray(position, dtype=np.float64) / length
        deflection = load_factor * self.central_deflection
        return self.sign * deflection * self._form(xi, deflection / length)

    def _form(self, xi: FloatArray, ratio: float) -> FloatArray:
        if self.shape == "three_loads":
            return three_loads(xi)
        if self.shape == "parabola":
            return 4.0 * xi * (1.0 - xi)
        if self.shape == "arc":
            return arc(xi, ratio)
        return through_points(self.table, xi) / through_points(self.table, np.array([0.5]))
