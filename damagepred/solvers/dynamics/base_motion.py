"""Displacement of the base over time: pulses and records, integrated exactly."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.scene.dynamics import BaseMotion

LARGEST_VALUE, SHORTEST_STEP = 1e6, 1e-6
"""Bounds of a record: acceleration, velocity or displacement (SI), and time step (s)."""

Displacement = Callable[[FloatArray], FloatArray]


def base_displacement(motions: Sequence[BaseMotion]) -> Displacement:
    """Function from time (k,) (s) to displacement (k, 2) of the base (m), 0 at time 0; motions add up."""
    parts = [(0 if motion.direction == "x" else 1, motion.start, _displacement_of(motion)) for motion in motions]

    def displacement(time: FloatArray) -> FloatArray:
        moved = np.zeros((len(time), 2))
        for axis, start, share in parts:
            moved[:, axis] += share(np.maximum(time - start, 0.0))
        return moved

    return displacement


def _displacement_of(motion: BaseMotion) -> Displacement:
    if motion.kind == "record":
        time, values = motion.record()
        with np.errstate(over="ignore"):
            scaled = motion.scale * values
        largest, shortest = np.abs(scaled).max(), np.diff(time).min()
        if largest > LARGEST_VALUE or shortest < SHORTEST_STEP:
            raise InputError(
                f"dynamics.base: the record reaches {largest:.3g} (SI) in steps of {shortest:.3g} s; "
                f"at most {LARGEST_VALUE:g} in steps of at least {SHORTEST_STEP:g} s are allowed."
            )
        return from_record(time, scaled, motion.quantity, motion.baseline)
    peak, length = motion.acceleration, motion.duration
    if motion.kind == "rectangular":
        return _rectangular(peak, length)
    return _sine(peak, length, 1 if motion.kind == "half_sine" else 2)


def _rectangular(peak: float, length: float) -> Displacement:
    """Displacement under a pulse of constant acceleration; after it the velocity is constant."""

    def displacement(t: FloatArray) -> FloatArray:
        inside = np.minimum(t, length)
        return np.asarray(0.5 * peak * inside**2 + peak * length * (t - inside))

    return displacement


def _sine(peak: float, length: float, half_waves: int) -> Displacement:
    """Displacement under one or two half waves of acceleration; after them the velocity is constant."""
    omega = half_waves * np.pi / length
    end_velocity = 2.0 * peak / omega if half_waves == 1 else 0.0

    def displacement(t: FloatArray) -> FloatArray:
        inside = np.minimum(t, length)
        return np.asarray(peak / omega * (inside - np.sin(omega * inside) / omega) + end_velocity * (t - inside))

    return displacement


def from_record(time: FloatArray, values: FloatArray, quantity: str, baseline: str) -> Displacement:
    """Displacement (m) of a recorded base, at rest before the record, at constant velocity or rest after it."""
    step = np.diff(time)
    if quantity == "displacement":
        curve = scipy.interpolate.CubicSpline(time, values - values[0])
        return lambda t: np.asarray(curve(np.clip(t, time[0], time[-1])))
    if quantity == "velocity":
        velocity, acceleration = values, np.append(np.diff(values) / step, 0.0)
        jerk = np.zeros(len(time))
    else:
        acceleration = values
        velocity = np.concatenate(([0.0], np.cumsum(0.5 * step * (values[1:] + values[:-1]))))
        if baseline == "velocity":
            drift = velocity[-1] / (time[-1] - time[0])
            acceleration, velocity = acceleration - drift, velocity - drift * (time - time[0])
        jerk = np.append(np.diff(acceleration) / step, 0.0)
        acceleration = np.append(acceleration[:-1], 0.0)
    way = velocity[:-1] * step + acceleration[:-1] * step**2 / 2 + jerk[:-1] * step**3 / 6
    position = np.concatenate(([0.0], np.cumsum(way)))

    def displacement(t: FloatArray) -> FloatArray:
        i = np.clip(np.searchsorted(time, t, side="right") - 1, 0, len(time) - 1)
        s = np.maximum(t - time[i], 0.0)
        return np.asarray(position[i] + velocity[i] * s + acceleration[i] * s**2 / 2 + jerk[i] * s**3 / 6)

    return displacement
