"""Tolerances of the checks: rounding, and the tolerances of the solvers."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tolerances:
    """Tolerances of the checks.

    Attributes
    ----------
    rounding : float
        Rounding error of a sum, relative to the sum of the sizes of its terms.
    unbalanced_slack : float
        Ratio of the independently summed unbalanced force to the archived one.
    explicit_slack : float
        The same of the explicit solver, and to its tolerance: archived stresses are those one cycle later.
    fallback : float
        Unbalanced force that is accepted where no equilibrium exists (mean block weights).
    strength_share : float
        Share of a strength by which a stress may exceed it: the solver breaks bonds beyond 1e-6 of theirs.
    stated_violation : float
        Share of the largest strength from which a stated violation of the law is reported.
    bond_without_strength : float
        Tension in mean block weights that an intact bond without tensile strength may carry.
    elastic : float
        Share of the elastic stress by which an intact contact may differ from it.
    energy_rounding : float
        Share of the energy exchanged by which energies may differ.
    large_energy_error : float
        Share of the work put in from which an energy error is reported.
    work_slack : float
        Error of the trapezoidal rule, as a share of the change of the ground's work in an increment.
    damage_rounding : float
        Share by which widths and lengths of the verdict may differ.
    confirmed_within : float
        Share of the movement within which the other solver's collapse confirms a collapse.
    """

    rounding: float = 1e-11
    unbalanced_slack: float = 1.05
    explicit_slack: float = 2.0
    fallback: float = 1e-3
    strength_share: float = 1e-5
    stated_violation: float = 1e-4
    bond_without_strength: float = 1e-3
    elastic: float = 1e-9
    energy_rounding: float = 1e-8
    large_energy_error: float = 0.01
    work_slack: float = 1.0
    damage_rounding: float = 1e-9
    confirmed_within: float = 0.25
