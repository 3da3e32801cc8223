"""Test rig under a footing: supports and jacks."""

from __future__ import annotations

import itertools
from typing import Literal

from pydantic import Field, model_validator

from damagepred.scene.described import described
from damagepred.scene.quantity import Force, Length, SpringStiffness


@described
class Rig:
    """Supports and jacks under the footing (``[rig]``), read with ``[movement] shape = "jacks"``.

    All jacks carry the same load, as in the test of Bryant (1993). In dishing they pull the footing's centre down, in
    doming they push it up; the movement starts from the level state under self weight.

    Examples
    --------
    >>> from damagepred import Movement, Rig, Scene
    >>> scene = Scene(
    ...     movement=Movement(shape="jacks"), rig=Rig(supports=("0 m", "6 m"), jacks=("2 m", "4 m"))
    ... )
    >>> scene.rig.jacks
    (2.0, 4.0)
    """

    supports: tuple[Length, ...] = ()
    """Positions of the reaction points along the wall, from its left end (m). Empty: both ends."""
    jacks: tuple[Length, ...] = ()
    """Positions of the jacks along the wall, from its left end (m). Empty: the quarter points."""
    support: Literal["held", "lift_off"] = "held"
    """``held``: the supports pull and push. ``lift_off``: they only push."""
    support_stiffness: SpringStiffness = Field(default=1e10, gt=0)
    """Stiffness of each support (N/m)."""
    control: Literal["deflection", "load"] = "deflection"
    """``deflection``: the movement is the central deflection, and the jacks' load an unknown. ``load``: the movement is
    the jacks' load, and the deflection an unknown."""
    jack_load: Force | None = Field(default=None, ge=0)
    """Load of each jack at full movement (N), only with ``control = "load"``."""
    stop_at_zero: bool = True
    """Whether the path ends where the load of the jacks (dishing) or of a support (doming) reaches 0."""

    @model_validator(mode="after")
    def _consistent(self) -> Rig:
        if self.control == "load" and self.jack_load is None:
            raise ValueError(
                "jack_load: is missing; control = 'load' needs the load of each jack at full movement (N), "
                "or take control = 'deflection'"
            )
        if self.control != "load" and self.jack_load is not None:
            raise ValueError(
                f"jack_load = {self.jack_load:g}: only read with control = 'load'; here control = '{self.control}', "
                "and the load comes out. Leave one of the two out"
            )
        for name in ("supports", "jacks"):
            places = sorted(getattr(self, name))
            for first, second in itertools.pairwise(places):
                if first == second:
                    raise ValueError(f"{name}: {first:g} m is there twice; give each place once")
        if len(self.supports) == 1:
            raise ValueError(
                f"supports = [{self.supports[0]:g}]: one support does not hold a footing level; give two or more, "
                "or none for both ends of the wall"
            )
        return self

    def support_places(self, length: float) -> tuple[float, ...]:
        """Positions of the supports (m from the left end), increasing, for a wall of ``length`` (m)."""
        return tuple(sorted(self.supports)) or (0.0, length)

    def jack_places(self, length: float) -> tuple[float, ...]:
        """Positions of the jacks (m from the left end), increasing, for a wall of ``length`` (m)."""
        return tuple(sorted(self.jacks)) or (length / 4.0, length / 2.0, 3.0 * length / 4.0)

    def check_places(self, length: float) -> None:
        """Refuse supports and jacks outside a wall of ``length`` (m), and jacks on supports."""
        tolerance = 1e-9 * length
        for name in ("supports", "jacks"):
            for x in getattr(self, name):
                if not -tolerance <= x <= length + tolerance:
                    raise ValueError(
                        f"rig.{name}: {x:g} m is outside the wall; places go from 0 at its left end to its "
                        f"length, {length:g} m"
                    )
        for jack, support in itertools.product(self.jack_places(length), self.support_places(length)):
            if abs(jack - support) <= tolerance:
                raise ValueError(
                    f"rig.jacks: {jack:g} m is the position of a support, which would take the whole load; move the "
                    "jack or the support"
                )
