"""Time steps beyond the limit, with the solvers' checks bypassed; and a wall that cracks with other steps.

A user may set shares of the limit up to 1. Limits are bounds: where a share above 1 is stable, the bound is not sharp
(zones: Gershgorin's circles; runs in time that may meet new blocks: the stiffness of faces in full contact).
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from typing import Any, NamedTuple
from unittest import mock

import numpy as np

from damagepred.assembly import Model
from damagepred.enumerations import ContactState
from damagepred.errors import DamagepredError
from damagepred.pipeline import dynamic_run
from damagepred.scene import Dynamics, Solver
from damagepred.solvers import solve_path
from damagepred.solvers.dynamics import run as in_time
from damagepred.solvers.explicit.stepper import explicit_path
from damagepred.solvers.time_stepping import scheme as explicit
from studies.benchmarks.stress.case import PERIODS, slowest
from studies.benchmarks.stress.proportion import cracking_wall, reference, stack

RIGHT = 1e-2
"""Largest error, over the largest displacement, of a right answer."""


class Outcome(NamedTuple):
    """Result of a case: error over the largest displacement, and the message if it was refused."""

    error: float
    message: str = ""

    @property
    def verdict(self) -> str:
        """Right, refused, or wrong without a message."""
        return "refused" if self.message else "right" if self.error <= RIGHT else "WRONG"

    def row(self) -> dict[str, Any]:
        """Return it as columns."""
        return {"verdict": self.verdict, "off": self.error, "message": self.message}


def outcome(found: Callable[[], np.ndarray], exact: np.ndarray) -> Outcome:
    """Return the result of a solution."""
    try:
        displacement = found()
    except DamagepredError as error:
        return Outcome(np.nan, f"{type(error).__name__}: {error}")
    return Outcome(float(np.abs(displacement - exact)[:, :2].max() / np.abs(exact[:, :2]).max()))


def longer_steps(share: float) -> dict[str, Outcome]:
    """Solve with time steps of a share of the limit; beyond it, with the check bypassed."""
    forced = max(share, 1.0)
    found: dict[str, Outcome] = {}
    scaled, stepped = explicit.scaled_mass, in_time.time_step
    for way, deformable in (("explicit, rigid", False), ("explicit, deformable", True)):
        own = Solver(method="explicit", lump_block_elasticity=False, time_step_safety=min(share, 1.0))
        model = stack(deformable).build(own)
        with mock.patch.object(explicit, "scaled_mass", lambda *a: scaled(*a) / forced**2), np.errstate(all="ignore"):
            found[way] = outcome(
                lambda m=model, o=own: next(iter(explicit_path(m, o, 1, elastic_start=False))).displacement,  # type: ignore[misc]
                reference(model),
            )
    own = Solver(lump_block_elasticity=False)
    for way, deformable, new_contacts in (
        ("in time, no new contacts", False, False),
        ("in time, rigid", False, True),
        ("in time, deformable", True, True),
    ):
        model = stack(deformable).build(own)
        dynamics = Dynamics(
            duration=PERIODS * slowest(model),
            outputs=60,
            damping="local",
            start="unstressed",
            time_step_safety=min(share, 1.0),
            new_contacts=new_contacts,
        )
        with mock.patch.object(in_time, "time_step", lambda *a: forced * stepped(*a)), np.errstate(all="ignore"):
            found[way] = outcome(
                lambda m=model, o=own, d=dynamics: list(dynamic_run(m, o, d))[-1].displacement, reference(model)
            )  # type: ignore[misc]
    return found


SHARES = (0.1, 0.5, 0.9, 1.0, 1.05, 1.2, 1.5, 2.0)


def cracked(model: Model, own: Solver) -> tuple[int, float, float]:
    """Return cracked contacts, largest opening (m) and seconds of the wall in dishing."""
    begun = time.process_time()
    last = list(solve_path(model, own, 4))[-1]
    count = int((last.state == ContactState.CRACKED).sum())
    return count, float(last.opening.max()), time.process_time() - begun


def cracking() -> list[dict[str, Any]]:
    """Return rows on a wall that cracks, far from the origin and at other time steps."""
    rows: list[dict[str, Any]] = []
    for name, deformable in (("rigid", False), ("deformable", True)):
        for method in ("quasi_static", "explicit"):
            usual = Solver(method=method, tolerance=None if method == "quasi_static" else 1e-4, symmetric_half=False)  # type: ignore[arg-type]
            exact = cracked(cracking_wall(deformable, 0.0).build(usual), usual)
            tried: list[tuple[str, float, Solver]] = [(f"{far / 1e3:g} km", far, usual) for far in (1e3, 1e4, 1e6)]
            if method == "explicit":
                shares = (0.1, 0.5, 1.0)
                tried += [(f"{s:g} of the limit", 0.0, dataclasses.replace(usual, time_step_safety=s)) for s in shares]
            for stress, far, own in tried:
                row: dict[str, Any] = {"solver": f"{method.replace('_', '-')}, {name}", "stress": stress}
                try:
                    count, gap, seconds = cracked(cracking_wall(deformable, far).build(own), own)
                except DamagepredError as error:
                    rows.append(row | {"verdict": "refused", "message": str(error)})
                    continue
                off = abs(gap / exact[1] - 1)
                rows.append(
                    row
                    | {
                        "verdict": "right" if off <= RIGHT else "WRONG",
                        "contacts cracked, unstressed": exact[0],
                        "stressed": count,
                        "largest opening differs by": off,
                        "s": seconds,
                    }
                )
    return rows
