"""Movement of the footing: its shape, its size and the increments in which it grows."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from damagepred.arrays import FloatArray, IntArray
from damagepred.errors import InputError, require_count
from damagepred.scene.described import described
from damagepred.scene.footing_profile import arc, three_loads, through_points
from damagepred.scene.quantity import Count, Length, Pure

LEAST_IN_MIDDLE = 0.05
"""Least departure of the middle from the line through the ends, over the largest departure of a shape."""


@described
class Stage:
    """Stage of a movement history (``[[movement.stage]]``): from where the last one ended, in equal increments.

    Attributes
    ----------
    kind : {"dishing", "doming"}
        Side to which the centre lies off the line through the ends when the stage ends.
    central_deflection : float
        Deflection of the centre when the stage ends (m), not negative; 0 is level ground.
    increments : int
        Number of equal increments.

    Examples
    --------
    >>> from damagepred import scene
    >>> dry_summer = scene.Stage(kind="doming", central_deflection="8 mm", increments=4)
    >>> scene.Movement(stage=(dry_summer,)).stage[0].central_deflection
    0.008
    """

    kind: Literal["dishing", "doming"] = "dishing"
    central_deflection: Length = Field(ge=0)
    increments: Count = Field(default=10, ge=1)


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
        For ``shape = "table"``: position along the wall from 0 to 1, and deflection there in any unit. They are scaled
        so that the middle lies 1 off the line through the ends. Ends that settle unequally tilt the wall, too. Between
        the points a monotone cubic is drawn (PCHIP). In a scene file it may be the name of a CSV file with two columns,
        position (any unit, from the left end) and deflection.
    stage : sequence of Stage
        A movement history, from level ground through the deflections of the stages, there and back. Then
        ``increments`` is not read, and ``central_deflection`` is the largest deflection of all stages. Only for
        ``three_loads``, ``parabola`` and ``table``.

    Examples
    --------
    >>> from damagepred import Movement
    >>> Movement(kind="doming", central_deflection="12 mm", increments=24).central_deflection
    0.012
    """

    kind: Literal["dishing", "doming"] = "dishing"
    central_deflection: Length = Field(default=8e-3, ge=0)
    increments: Count = Field(default=20, ge=1)
    shape: Literal["three_loads", "parabola", "arc", "table", "jacks", "mound"] = "three_loads"
    table: tuple[tuple[Pure, Pure], ...] = ()
    stage: tuple[Stage, ...] = ()

    @model_validator(mode="after")
    def _stages_fit(self) -> Movement:
        if not self.stage:
            return self
        if not (self.prescribed and self.proportional):
            raise ValueError(
                f"stage: only read with shape = 'three_loads', 'parabola' or 'table'; here shape = '{self.shape}'"
            )
        largest = max(stage.central_deflection for stage in self.stage)
        if largest == 0 or self.central_deflection != largest:
            raise ValueError(
                f"stage: central_deflection must be the largest deflection of the stages and not 0; it is "
                f"{self.central_deflection:g} m, and the largest of the stages is {largest:g} m"
            )
        return self

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
        position, value = np.array(self.table).T
        departure = np.abs(value - np.interp(position, [0.0, 1.0], value[[0, -1]])).max()
        if abs(self._off_chord) <= LEAST_IN_MIDDLE * departure:
            raise ValueError(
                "table: the middle (position 0.5) lies on the line through the ends, or nearly; its distance from it "
                "is the central deflection, to which the others scale"
            )
        return self

    @classmethod
    def from_function(cls, profile: Callable[[FloatArray], ArrayLike], points: int = 41, **settings: Any) -> Movement:
        """Return a movement whose shape is that of a function.

        Parameters
        ----------
        profile : callable
            Positions from 0 to 1, an array -> deflections there, in any unit.
        points : int
            Number of equally spaced positions at which it is taken.
        **settings
            Other values of the movement, such as ``central_deflection``.

        Examples
        --------
        >>> import numpy as np
        >>> from damagepred.scene import Movement
        >>> trough = Movement.from_function(lambda x: np.exp(-8 * x**2), central_deflection=0.004)
        >>> trough.shape, len(trough.table)
        ('table', 41)
        """
        require_count("points", points)
        position = np.linspace(0.0, 1.0, max(points, 3))
        values = np.asarray(profile(position), dtype=np.float64)
        if values.shape != position.shape or not np.isfinite(values).all():
            raise InputError("profile: must return a finite number for each of the positions it is given.")
        return cls(shape="table", table=tuple(zip(position.tolist(), values.tolist())), **settings)

    @property
    def _off_chord(self) -> float:
        """Deflection of the middle less that of the line through the ends, as the table has it."""
        ends = 0.5 * (self.table[0][1] + self.table[-1][1])
        return float(through_points(self.table, np.array([0.5]))[0]) - ends

    @property
    def prescribed(self) -> bool:
        """Whether the underside of the wall or footing follows a given form, as it does not on jacks or a mound."""
        return self.shape not in ("jacks", "mound")

    @property
    def sign(self) -> float:
        """+1 for doming (up), -1 for dishing (down)."""
        return 1.0 if self.kind == "doming" else -1.0

    @property
    def load_factors(self) -> FloatArray | None:
        """Load factors of the increments of a history, from 0 (level ground); None without stages."""
        if not self.stage:
            return None
        full = self.sign * self.central_deflection
        ends = [(1.0 if s.kind == "doming" else -1.0) * s.central_deflection / full for s in self.stage]
        parts = [
            np.linspace(start, end, stage.increments + 1)[1:]
            for start, end, stage in zip([0.0, *ends], ends, self.stage)
        ]
        return np.concatenate([[0.0], *parts])

    @property
    def stage_of_increment(self) -> IntArray:
        """Number of the stage of each increment, from 1; 0 for the dead load, and without stages nothing else."""
        return np.repeat(np.arange(len(self.stage) + 1), [1, *(stage.increments for stage in self.stage)])

    @property
    def increment_count(self) -> int:
        """Number of increments of the movement, of all stages."""
        return sum(stage.increments for stage in self.stage) or self.increments

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
            Same shape. The middle lies +/- ``load_factor`` times ``central_deflection`` off the line through the ends;
            these stay where they are unless a table has them settle.

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
        return through_points(self.table, xi) / self._off_chord
