"""Tolerances, budgets and factors of damped time stepping; each class belongs to one file beside it."""

from __future__ import annotations

from pydantic import Field

from damagepred.scene.described import described
from damagepred.scene.quantity import Count, Length, Pure


@described
class TimeSteppingOptions:
    """Damped time stepping.

    Cracking sections of a footing commit their internal variables every few cycles, as joints do in each. Otherwise a
    section that unloads would follow its loading curve back. That path dissipates nothing and could sustain an
    oscillation. A commit costs as much as the sections' forces. Eight cycles are a short part of any oscillation that
    bends a footing.

    Attributes
    ----------
    section_commit_interval : int
        Cycles from one commit of the sections to the next.
    divergence_energy_ratio : float
        Kinetic energy over the work of the loads that no falling block can have (1).
    """

    section_commit_interval: Count = Field(default=8, ge=1)
    divergence_energy_ratio: Pure = Field(default=10.0, gt=1)


@described
class JackServoOptions:
    """Jacks fed by one pump, with integral control of the deflection.

    Attributes
    ----------
    line_stiffness_ratio : float
        Stiffness of the line between pump and jacks over that of the intact wall under the jacks (1). A stiffer line
        permits a faster control; much stiffer, it makes the jacked segments heavy.
    gain_ratio : float
        Rate of the control over the decay rate, local damping times circular frequency, of the slower oscillation of
        the intact wall on its jacks (1). Ten times the default may excite that oscillation; two to five times, where
        jacks stand by the supports, far from where the deflection is measured.
    deflection_tolerance : float
        Deflection that may be missing at rest (m).
    """

    line_stiffness_ratio: Pure = Field(default=100.0, gt=0)
    gain_ratio: Pure = Field(default=0.12, gt=0)
    deflection_tolerance: Length = Field(default=1e-7, gt=0)


@described
class MechanismOptions:
    """Test whether a wall that does not come to rest is a collapse mechanism.

    Attributes
    ----------
    cycles : int
        Cycles of each half of a round; a mechanism moves farther in the second half.
    speed_factor : float
        Factor on the speed after a round in which it does (1).
    max_rounds : int
        Rounds in all. A wall that stops now and then may creep on.
    max_rounds_near_rest : int
        The same where the wall is nearly at rest.
    """

    cycles: Count = Field(default=250, ge=1)
    speed_factor: Pure = Field(default=2.0, gt=1)
    max_rounds: Count = Field(default=200, ge=1)
    max_rounds_near_rest: Count = Field(default=40, ge=1)
