"""Dynamic runs: physical mass and time, what shakes the base, what damps."""

from __future__ import annotations

import itertools
from typing import Literal

from pydantic import Field, model_validator

from damagepred.scene.described import described
from damagepred.scene.quantity import Acceleration, Count, Duration, Frequency, Pure, Speed


@described
class BaseMotion:
    """Motion of the ground and of all that is held, in one direction (``[[dynamics.base]]``); several add up.

    Attributes
    ----------
    kind : {"half_sine", "full_sine", "rectangular", "record"}
        A pulse of acceleration, or a record.
    direction : {"x", "y"}
        Along the wall, or upwards.
    acceleration : float
        Peak of the pulse (m/s2); negative pushes the other way.
    duration : float
        Of the pulse (s).
    start : float
        When it begins (s).
    file : str or None
        CSV file of a record: time (s) in the first column, values (SI) in the second; lines that are no numbers are
        skipped. A relative name is looked for in the working folder.
    time, values : sequence of float
        The record itself, in place of a file (s, SI).
    quantity : {"acceleration", "velocity", "displacement"}
        What the record tells. Between its points acceleration and velocity go straight, and are integrated exactly
        from rest; through displacements a cubic spline is drawn.
    scale : float
        Factor on the record's values.
    baseline : {"none", "velocity"}
        ``none``: integrated as given, so what is left of the velocity at the end stays. ``velocity``: the constant
        acceleration is taken off that lets the base end at rest.

    Examples
    --------
    >>> from damagepred import BaseMotion
    >>> shock = BaseMotion(kind="half_sine", acceleration="2 m/s2", duration="0.4 s")
    >>> shock.acceleration, shock.duration
    (2.0, 0.4)
    """

    kind: Literal["half_sine", "full_sine", "rectangular", "record"] = "record"
    direction: Literal["x", "y"] = "x"
    acceleration: Acceleration = 0.0
    duration: Duration = Field(default=0.0, ge=0)
    start: Duration = Field(default=0.0, ge=0)
    file: str | None = None
    time: tuple[Duration, ...] = ()
    values: tuple[Pure, ...] = ()
    quantity: Literal["acceleration", "velocity", "displacement"] = "acceleration"
    scale: Pure = 1.0
    baseline: Literal["none", "velocity"] = "none"

    @model_validator(mode="after")
    def _complete(self) -> BaseMotion:
        if self.kind != "record":
            if self.duration == 0:
                raise ValueError(f"duration: a pulse (kind = '{self.kind}') needs one greater than 0 s")
            if self.file is not None or self.time or self.values:
                raise ValueError(f"file, time, values: only read with kind = 'record'; here kind = '{self.kind}'")
            return self
        if self.file is not None:
            if self.time or self.values:
                raise ValueError("time, values: the record is read from the file; leave out one of the two")
            return self
        if len(self.time) != len(self.values) or len(self.time) < 2:
            raise ValueError(
                f"time, values: a record needs two points or more and as many values as times, or a file; "
                f"here {len(self.time)} times and {len(self.values)} values"
            )
        if any(b <= a for a, b in itertools.pairwise(self.time)):
            raise ValueError("time: must rise from point to point")
        return self


@described
class Dynamics:
    """A run in physical time (``[dynamics]``): blocks move as far as they like, and meet others.

    Attributes
    ----------
    duration : float
        Physical time (s).
    outputs : int
        Number of equal intervals after each of which the state is kept.
    base : sequence of BaseMotion
        What shakes the ground and all that is held.
    movement_time : float or None
        Time over which the movement of the ground and of moved blocks is applied, gently (s). None: it is not.
    ground_pieces : int
        Number of equal parts of the load factor where the form of the ground changes as its movement grows. In each,
        every point of the ground moves in a straight line between its exact states.
    damping : {"none", "viscous", "rayleigh", "local"}
        ``viscous``: proportional to mass, against the motion relative to the base. ``rayleigh``: proportional to mass
        and, in joints, to stiffness; it never pulls a joint without tension. ``local``: Cundall's, for coming to rest.
    damping_ratio : float
        Share of critical damping, at ``frequency`` (viscous), or there and at ``second_frequency`` (rayleigh).
    frequency, second_frequency : float
        Where the ratio is meant (Hz).
    local_damping : float
        Share of the unbalanced force that opposes the motion.
    contact_damping : float
        Dashpots of contacts without tensile strength, while they are pressed. The number is a share of the critical
        damping of a block that bounces on a joint, for the joint that needs the strongest dashpot. They never pull. 0:
        impacts are elastic, and a rocking block bounces for ever. 1: impacts are inelastic. A rigid block that rocks on
        its corners (``solver.contacts_per_interface = 2``) then keeps Housner's share 1 - 1.5 sin(alpha)^2 of its
        angular velocity at each impact. It keeps more if points along its base take part of the impulse.
    time_step_safety : float or None
        Fraction of the largest stable time step, which follows from the highest frequency and the damping. None: 0.5;
        0.25 where nothing damps joints without strength, as blocks that bounce on them gain energy with longer steps.
    start : {"equilibrium", "unstressed"}
        Whether the run begins in the static equilibrium under dead load, if there is one, or with unstressed joints.
    new_contacts : bool
        Whether blocks may meet what they did not touch at first. False skips the search, for small movements.
    stop_at_rest : bool
        Whether the run ends once all blocks have been slower than ``rest_speed`` at three outputs in a row.
    rest_speed : float
        Root mean square speed, by mass and relative to the base (m/s).

    Examples
    --------
    >>> from damagepred import BaseMotion, Dynamics
    >>> shock = BaseMotion(kind="half_sine", acceleration="2 m/s2", duration="0.4 s")
    >>> run = Dynamics(duration="2 s", outputs=50, base=(shock,))
    >>> run.outputs
    50
    """

    duration: Duration = Field(default=2.0, gt=0)
    outputs: Count = Field(default=100, ge=1)
    base: tuple[BaseMotion, ...] = ()
    movement_time: Duration | None = Field(default=None, gt=0)
    ground_pieces: Count = Field(default=100, ge=1)
    damping: Literal["none", "viscous", "rayleigh", "local"] = "none"
    damping_ratio: Pure = Field(default=0.05, ge=0, lt=1)
    frequency: Frequency = Field(default=10.0, gt=0)
    second_frequency: Frequency = Field(default=100.0, gt=0)
    local_damping: Pure = Field(default=0.8, ge=0, lt=1)
    contact_damping: Pure = Field(default=0.0, ge=0, le=10)
    time_step_safety: Pure | None = Field(default=None, gt=0, le=1)
    start: Literal["equilibrium", "unstressed"] = "equilibrium"
    new_contacts: bool = True
    stop_at_rest: bool = False
    rest_speed: Speed = Field(default=1e-3, gt=0)

    @model_validator(mode="after")
    def _frequencies_rise(self) -> Dynamics:
        if self.damping == "rayleigh" and self.second_frequency <= self.frequency:
            raise ValueError(
                f"second_frequency = {self.second_frequency:g} Hz: must be above frequency = {self.frequency:g} Hz"
            )
        return self

    def step_share(self, dry: bool) -> float:
        """Return the fraction of the largest stable time step to use; ``dry``: some joints have no strength."""
        if self.time_step_safety is not None:
            return self.time_step_safety
        return 0.25 if dry and self.damping == "none" and self.contact_damping == 0.0 else 0.5

    @property
    def mass_damping(self) -> float:
        """Damping force over momentum (1/s): the part proportional to mass."""
        first, second = self._angular
        if self.damping == "viscous":
            return 2.0 * self.damping_ratio * first
        if self.damping == "rayleigh":
            return 2.0 * self.damping_ratio * first * second / (first + second)
        return 0.0

    @property
    def stiffness_damping(self) -> float:
        """Damping stress over the rate of elastic stress (s): the part proportional to stiffness."""
        return 2.0 * self.damping_ratio / sum(self._angular) if self.damping == "rayleigh" else 0.0

    @property
    def _angular(self) -> tuple[float, float]:
        turn = 2.0 * 3.141592653589793
        return turn * self.frequency, turn * self.second_frequency
