"""Diagnostics of an increment: residuals of its solution, the work spent on it, and its energy balance.

A field of a record here, and its value from a solver, is all that a new diagnostic takes: archive, screen, report and
the guide's reference read name, unit, meaning and label from the field.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cache
from typing import Any


@dataclass(frozen=True)
class Diagnostic:
    """Description of one diagnostic."""

    units: str  # as UDUNITS reads it
    meaning: str  # for the archive
    label: str = ""  # name on the screen and in the report; empty: not shown
    shown_unit: str = ""  # unit there
    in_time: bool = False  # whether only a dynamic run has it
    term: bool = True  # whether an energy is a term of the balance; else it is part of another, or the imbalance


def _of(default: float, *description: Any, **more: Any) -> Any:
    return field(default=default, metadata={"diagnostic": Diagnostic(*description, **more)})


def _count(meaning: str, label: str) -> Any:
    return _of(0, "1", meaning, label)


def _energy(meaning: str, label: str = "", **more: Any) -> Any:
    return _of(NAN, "J", meaning, label, **more)


NAN = float("nan")


@dataclass(frozen=True, kw_only=True)
class Residuals:
    """Residuals of the solution; on the screen their largest values along the path."""

    unbalanced_force_ratio: float = _of(
        *(NAN, "1", "largest unbalanced force over the mean weight of a block"),
        *("largest unbalanced force", "mean block weights"),
    )
    joint_law_violation: float = _of(
        *(NAN, "Pa", "largest stress by which a joint exceeds its law, of the quasi-static solver"),
        *("stress by which a joint exceeds its law", "Pa"),
    )


@dataclass(frozen=True)
class Counters:
    """Work spent on the increment; on the screen its sum along the path."""

    events: int = _count(
        "times at which bonds broke in the increment, counted by the quasi-static solver", "times at which bonds broke"
    )
    newton_iterations: int = _count(
        "Newton iterations of the quasi-static solver spent on the increment", "Newton iterations"
    )
    factorisations: int = _count("factorisations of the stiffness by the quasi-static solver", "factorisations")
    corrections: int = _count(
        "solutions by Woodbury correction of a factorisation, of the quasi-static solver", "corrected solutions"
    )
    cycles: int = _count(
        "cycles of the explicit solver, or time steps of a dynamic run, spent on the increment", "cycles or time steps"
    )

    def since(self, before: Counters) -> Counters:
        """Return the work done since earlier counters."""
        return Counters(*(now - then for now, then in zip(vars(self).values(), vars(before).values(), strict=True)))


@dataclass(frozen=True)
class Energies:
    """Energy balance, summed along the path; NaN where a solver does not count a term."""

    external_work: float = _energy(
        "work of dead load and movement on the wall since its first state", "work of load and movement"
    )
    kinetic_energy: float = _energy("energy of motion of the blocks in a dynamic run", "in motion", in_time=True)
    elastic_energy: float = _energy("energy stored in joints and blocks", "stored in joints and blocks")
    friction_work: float = _energy("work dissipated so far by friction", "friction")
    fracture_work: float = _energy("work dissipated so far by softening bonds", "softening of bonds")
    crushing_work: float = _energy("work dissipated so far by joints that are crushed", "crushing")
    plastic_work: float = _energy("work dissipated so far by zones that yield", "yielding zones")
    damping_work: float = _energy("work dissipated so far by damping in a dynamic run", "damping", in_time=True)
    released_energy: float = _energy(
        "energy released so far where bonds broke or the wall snapped through", "released where bonds broke"
    )
    energy_error: float = _energy(
        "imbalance of the energy so far, between the failures of bonds", "not balanced", term=False
    )
    snap_through_energy: float = _energy(
        "part of released_energy: by snap-through to a distant equilibrium", term=False
    )
    boundary_work: float = _energy("work put in so far by moving ground and supports in a dynamic run", in_time=True)

    def twice(self) -> Energies:
        """Return the balance of a wall of which this is one half."""
        return Energies(*(2 * value for value in vars(self).values()))


@cache
def described(record: type) -> dict[str, Diagnostic]:
    """Return the diagnostics of a record by name."""
    return {f.name: f.metadata["diagnostic"] for f in fields(record) if "diagnostic" in f.metadata}
