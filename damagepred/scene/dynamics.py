"""Dynamic runs: physical mass and time, base motion, damping."""

from __future__ import annotations

import itertools
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.scene.described import described
from damagepred.scene.quantity import Acceleration, Count, Duration, Frequency, Pure, Speed


@described
class BaseMotion:
    """Motion of the ground and of all supports, in one direction (``[[dynamics.base]]``); several add up.

    Examples
    --------
    >>> from damagepred import BaseMotion
    >>> shock = BaseMotion(kind="half_sine", acceleration="2 m/s2", duration="0.4 s")
    >>> shock.acceleration, shock.duration
    (2.0, 0.4)
    """

    kind: Literal["half_sine", "full_sine", "rectangular", "record"] = "record"
    """A pulse of acceleration, or a record."""
    direction: Literal["x", "y"] = "x"
    """Along the wall, or upwards."""
    acceleration: Acceleration = 0.0
    """Peak of the pulse (m/s2); negative is the opposite direction."""
    duration: Duration = Field(default=0.0, ge=0)
    """Duration of the pulse (s)."""
    start: Duration = Field(default=0.0, ge=0)
    """Start of the motion (s)."""
    file: str | None = None
    """CSV or xlsx file of a record: increasing times (s) and values (SI), or in the unit of the column's name, such as
    ``a (g)``. Or a PEER file (AT2, VT2, DT2), in its own unit. It lies beside the scene file; in Python, in the working
    folder."""
    time: tuple[Duration, ...] = ()
    """Times of the record, instead of a file (s)."""
    values: tuple[Pure, ...] = ()
    """Values of the record at these times (SI)."""
    quantity: Literal["acceleration", "velocity", "displacement"] = "acceleration"
    """Quantity of the record. Acceleration and velocity are linear between points and integrated exactly from rest;
    displacements are interpolated by a cubic spline."""
    scale: Pure = 1.0
    """Factor on the record's values."""
    baseline: Literal["none", "velocity"] = "none"
    """``none``: integrated as given, with any velocity at the end. ``velocity``: a constant acceleration is subtracted
    so that the base ends at rest."""

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

    def record(self) -> tuple[FloatArray, FloatArray]:
        """Record as times (s) and values (SI), from its file if it has one."""
        if self.file is None:
            return np.array(self.time), np.array(self.values)
        from damagepred.scene.input_tables import read_record

        return read_record(Path(self.file), self.quantity, self.scale)

    def shaking(self) -> tuple[float, float, float] | None:
        """Start and end of the base motion, and end of the record (s); None without motion."""
        if self.kind != "record":
            end = self.start + self.duration
            return (self.start, end, end) if self.acceleration else None
        time, values = self.record()
        if self.quantity == "displacement":
            values = values - values[0]
        elif self.quantity == "acceleration" and self.baseline == "velocity":
            values = values - np.trapezoid(values, time) / (time[-1] - time[0])
        moved = np.flatnonzero(np.abs(values) > 1e-12 * np.abs(values).max())
        if not moved.size or self.scale == 0.0:
            return None
        first, last = time[max(moved[0] - 1, 0)], time[min(moved[-1] + 1, len(time) - 1)]
        return self.start + float(first), self.start + float(last), self.start + float(time[-1])


@described
class Dynamics:
    """Run in physical time (``[dynamics]``): blocks may move far and touch other blocks.

    Examples
    --------
    >>> from damagepred import BaseMotion, Dynamics
    >>> shock = BaseMotion(kind="half_sine", acceleration="2 m/s2", duration="0.4 s")
    >>> run = Dynamics(duration="2 s", outputs=50, base=(shock,))
    >>> run.outputs
    50
    """

    duration: Duration | None = Field(default=None, gt=0)
    """Physical time (s). None: 2 s, or until all base motion and the movement of the ground have ended."""
    outputs: Count = Field(default=100, ge=1)
    """Number of equal intervals between stored states."""
    base: tuple[BaseMotion, ...] = ()
    """Motion of the ground and of all supports."""
    movement_time: Duration | None = Field(default=None, gt=0)
    """Time over which the movement of the ground and of moved blocks is applied, smoothly (s). None: no movement."""
    ground_pieces: Count = Field(default=100, ge=1)
    """Number of equal parts of the load factor where the form of the ground changes as its movement grows. In each,
    every point of the ground moves in a straight line between its exact states."""
    damping: Literal["none", "viscous", "rayleigh", "local"] = "none"
    """``viscous``: proportional to mass, against the motion relative to the base. ``rayleigh``: proportional to mass
    and, in joints, to stiffness; it never pulls a joint without tension. ``local``: Cundall's, for static states."""
    damping_ratio: Pure = Field(default=0.05, ge=0, lt=1)
    """Share of critical damping, at ``frequency`` (viscous), or at both frequencies (rayleigh)."""
    frequency: Frequency = Field(default=10.0, gt=0)
    """Frequency of the damping ratio (Hz)."""
    second_frequency: Frequency = Field(default=100.0, gt=0)
    """Second frequency of the damping ratio (Hz), for rayleigh."""
    local_damping: Pure = Field(default=0.8, ge=0, lt=1)
    """Share of the unbalanced force that opposes the motion."""
    contact_damping: Pure = Field(default=0.0, ge=0, le=10)
    """Dashpots of contacts without tensile strength, in compression only. The value is a share of the critical damping
    of a block that bounces on a joint, for the joint that needs the strongest dashpot. With 0, impacts are elastic, and
    a rocking block bounces for ever. With 1, impacts are inelastic. A rigid block that rocks on its corners
    (``solver.contacts_per_interface = 2``) then keeps Housner's share 1 - 1.5 sin(alpha)^2 of its angular velocity at
    each impact. It keeps more if points along its base take part of the impulse."""
    time_step_safety: Pure | None = Field(default=None, gt=0, le=1)
    """Fraction of the largest stable time step, which follows from the highest frequency and the damping. None: 0.5;
    0.25 without damping of joints without strength, where bouncing blocks gain energy with longer steps."""
    start: Literal["equilibrium", "unstressed"] = "equilibrium"
    """Whether the run begins in the static equilibrium under dead load, if there is one, or with unstressed joints."""
    new_contacts: bool = True
    """Whether blocks may touch new neighbours. False skips the search, for small movements."""
    stop_at_rest: bool = False
    """Whether the run ends once all blocks have been slower than ``rest_speed`` at three consecutive outputs."""
    rest_speed: Speed = Field(default=1e-3, gt=0)
    """Root mean square speed, by mass and relative to the base (m/s)."""

    @model_validator(mode="after")
    def _frequencies_rise(self) -> Dynamics:
        if self.damping == "rayleigh" and self.second_frequency <= self.frequency:
            raise ValueError(
                f"second_frequency = {self.second_frequency:g} Hz: must be above frequency = {self.frequency:g} Hz"
            )
        return self

    @cached_property
    def run_duration(self) -> float:
        """Physical time of the run (s)."""
        ends = [shaking[2] for motion in self.base if (shaking := motion.shaking())]
        return max(2.0, self.movement_time or 0.0, *ends) if self.duration is None else self.duration

    @cached_property
    def loading_end(self) -> float:
        """End of all motion of base and ground (s)."""
        return max([self.movement_time or 0.0, *(s[1] for motion in self.base if (s := motion.shaking()))])

    def check_base(self) -> None:
        """Refuse base motion without effect during the run."""
        for number, motion in enumerate(self.base, 1):
            shaking = motion.shaking()
            if motion.time and motion.time[0] < 0.0:
                raise InputError(f"dynamics.base {number}: time begins at {motion.time[0]:g} s; must be 0 or later.")
            if shaking is None:
                raise InputError(f"dynamics.base {number}: never moves the wall; all its values are 0, or alike.")
            if shaking[0] >= self.run_duration:
                raise InputError(
                    f"dynamics.base {number}: shakes from {shaking[0]:g} to {shaking[1]:g} s, and the run ends at "
                    f"{self.run_duration:g} s. Give a longer [dynamics] duration, or leave it out to cover all motion."
                )

    def step_share(self, dry: bool) -> float:
        """Fraction of the largest stable time step to use; ``dry``: some joints have no strength."""
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
