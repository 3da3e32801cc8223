"""Tolerances, budgets and factors of the explicit solver: time stepping, jacks, test of a mechanism, load path."""

from __future__ import annotations

from pydantic import Field

from damagepred.scene.described import described
from damagepred.scene.quantity import Count, Length, Pure


@described
class TimeSteppingOptions:
    """Damped time stepping.

    Attributes
    ----------
    section_commit_interval : int
        Cycles between two commits of cracking sections; without commits a section would unload along its loading curve,
        without dissipation. Eight cycles are a short part of any oscillation that bends a footing.
    divergence_energy_ratio : float
        Kinetic energy over the work of the loads from which a run has diverged (1).
    """

    section_commit_interval: Count = Field(default=8, ge=1)
    divergence_energy_ratio: Pure = Field(default=10.0, gt=1)


@described
class JackServoOptions:
    """Jacks fed by one pump, with integral control of the deflection.

    Attributes
    ----------
    line_stiffness_ratio : float
        Stiffness of the line between pump and jacks over the stiffness of the intact wall under the jacks (1). A
        stiffer line permits a faster control; a much stiffer one makes the jacked segments heavy.
    gain_ratio : float
        Rate of the control over the decay rate (local damping times circular frequency) of the slower oscillation of
        the intact wall on its jacks (1). Ten times the default may excite it; two to five times for jacks near the
        supports.
    deflection_tolerance : float
        Error of the deflection at rest (m).
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
        Factor on the speed after a round in which the wall moves farther (1).
    max_rounds : int
        Rounds in all; a wall may creep on after a stop.
    max_rounds_near_rest : int
        Rounds for a wall nearly at rest.
    """

    cycles: Count = Field(default=250, ge=1)
    speed_factor: Pure = Field(default=2.0, gt=1)
    max_rounds: Count = Field(default=200, ge=1)
    max_rounds_near_rest: Count = Field(default=40, ge=1)


@described
class ExplicitOptions:
    """Convergence, collapse and divergence on the explicit load path.

    Attributes
    ----------
    check_interval : int
        Cycles between two checks of the unbalanced force.
    passed_checks : int
        Checks in a row below the tolerance; an oscillation passes through balance without rest.
    gain_halving_cycles : int
        Cycles after which the gain of the jacks' control is halved if the wall still oscillates.
    gain_halving_time : float
        The same in time constants of the control, if longer (1).
    damping_halving_cycles : int
        Cycles after which local damping is halved where zones ring between yielding joints: damping of the ringing
        forces would oppose a slow motion like friction.
    minimum_damping : float
        Least local damping (1).
    trusted_time_step : float
        Share of the largest stable time step up to which messages do not suggest a smaller one (1).
    collapse_bracket : float
        Load factor between the last stable state and collapse under live load (1).
    zero_load_ratio : float
        Support load over all dead load that counts as zero at the end of a path (1).
    zero_load_bracket : float
        Final bracket of the load factor of zero support load (1).
    divergence_displacement : float
        Displacement over the size of the wall from which a run has diverged (1).
    """

    check_interval: Count = Field(default=50, ge=1)
    passed_checks: Count = Field(default=3, ge=1)
    gain_halving_cycles: Count = Field(default=20_000, ge=1)
    gain_halving_time: Pure = Field(default=30.0, gt=0)
    damping_halving_cycles: Count = Field(default=10_000, ge=1)
    minimum_damping: Pure = Field(default=0.1, ge=0, lt=1)
    trusted_time_step: Pure = Field(default=0.9, gt=0, le=1)
    collapse_bracket: Pure = Field(default=1e-3, gt=0)
    zero_load_ratio: Pure = Field(default=1e-4, gt=0)
    zero_load_bracket: Pure = Field(default=1e-4, gt=0)
    divergence_displacement: Pure = Field(default=1e3, gt=1)
