"""Record of a run of any solver: the residual over time, and the final positions of the blocks.

It needs numpy alone, because it runs in the environments of the other solvers.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

HOLD = 20
"""Consecutive checks below the smallest level after which a wall counts as converged."""


class Wall:
    """Numbers of a case as arrays: n blocks."""

    def __init__(self, case: dict[str, Any]) -> None:
        corners = np.array(case["blocks"])
        self.corners = corners
        self.centre = corners.mean(axis=1)
        self.size = np.ptp(corners, axis=1)
        self.mass = case["density"] * case["thickness"] * self.size.prod(axis=1)
        self.inertia = self.mass * (self.size**2).sum(axis=1) / 12
        self.lever = np.linalg.norm(self.size, axis=1) / 2
        self.weight = self.mass * case["gravity"]
        self.lowest = np.flatnonzero(corners[:, :, 1].min(axis=1) < 1e-9)

    def residual(self, force: np.ndarray) -> float:
        """Return the largest unbalanced force over the mean weight of a block."""
        worst = max(np.hypot(force[:, 0], force[:, 1]).max(), (np.abs(force[:, 2]) / self.lever).max())
        return float(worst / self.weight.mean())

    def from_velocity(self, change: np.ndarray, step: float) -> float:
        """Return the residual from the change of velocities (n, 3) in a time step: mass times acceleration."""
        mass = np.column_stack((self.mass, self.mass, self.inertia))
        return self.residual(mass * change / step)


class Record:
    """Checks of a run: processor time, time, residual; and its convergence."""

    def __init__(self, case: dict[str, Any], limit: float) -> None:
        self.levels = case["levels"]
        self.after = case["drop_until"]
        self.limit = limit
        self.looks: list[tuple[float, float, float]] = []
        self.seconds = 0.0
        self.below = 0
        self._began = 0.0

    def start(self) -> None:
        """Start the clock."""
        self._began = time.process_time()

    def stop(self) -> None:
        """Stop the clock: checks are not part of the solver's work."""
        self.seconds += time.process_time() - self._began

    def look(self, at: float, residual: float) -> bool:
        """Record the residual at a time (s); return whether to continue."""
        self.looks.append((self.seconds, at, residual))
        self.below = self.below + 1 if residual <= min(self.levels) and at > self.after else 0
        return self.below < HOLD and self.seconds < self.limit and np.isfinite(residual)

    def settled(self) -> list[float | None]:
        """Return the processor time from which the residual stays below each level."""
        seconds, at, residual = np.array(self.looks).reshape(-1, 3).T
        found: list[float | None] = []
        for level in self.levels:
            above = np.flatnonzero(~((residual <= level) & (at > self.after)))
            first = above[-1] + 1 if above.size else 0
            stays = first <= len(at) - min(HOLD, len(at))  # a short dip at the end does not count
            found.append(float(seconds[first]) if stays else None)
        return found


def settle(case: dict[str, Any], limit: float, build: Callable[[], Any]) -> dict[str, Any]:
    """Integrate a wall until it stays in equilibrium, or for a limit of processor time (s), or twice that by the clock.

    A system that is built has its time ``now``, and functions ``advance(record)`` (integrate to the next check with the
    clock running; return the number of steps), ``check`` (residual, forces of the ground) and ``displacement``.
    """
    began, clock = time.process_time(), time.monotonic()
    system = build()
    found: dict[str, Any] = {"build": time.process_time() - began, "steps": 0}
    record, go_on = Record(case, limit), True
    while go_on:
        found["steps"] += system.advance(record)
        found["residual"], found["base"] = system.check()
        go_on = record.look(system.now, found["residual"]) and time.monotonic() - clock < 2 * limit
    return found | {"settled": record.settled(), "seconds": record.seconds, "displacement": system.displacement()}


def run(version: str, build: Callable[..., Any]) -> None:
    """Settle the case of the command line, and write the results."""
    case, settings, limit, path = read_case()
    answer(path, **settle(case, limit, lambda: build(case, settings)), version=version)


def read_case() -> tuple[dict[str, Any], dict[str, Any], float, Path]:
    """Return case, settings, limit (s) and the file for the answer, as the command line names them."""
    case, settings = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")), json.loads(sys.argv[2])
    return case, settings, settings.pop("limit"), Path(sys.argv[3])


def answer(path: Path, **known: Any) -> None:
    """Write the results; arrays and numbers of numpy as lists and numbers."""
    path.write_text(json.dumps(known, default=lambda value: value.tolist()), encoding="utf-8")
