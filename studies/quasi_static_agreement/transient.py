"""Transient loads on the bonds beside a broken bond, before equilibrium."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from walls import Case

from damagepred.arrays import BoolArray, FloatArray
from damagepred.assembly import Model
from damagepred.enumerations import ContactState
from damagepred.scene import Solver
from damagepred.solvers import Increment, solve_path
from damagepred.solvers.explicit.scheme import DampedTimeStepping
from damagepred.solvers.state.joint_history import JointHistory, fields_of
from damagepred.solvers.state.wall_state import State

INCREMENTS, CYCLES = 400, 1000
"""Steps of the movement, small enough to separate breaks; cycles to equilibrium."""
DAMPINGS = (0.8, 0.95, 0.98, 0.99)
BEYOND = 0.1
"""Smallest transient overload of a bond that counts, as a share of its strength."""


def transient_table(case: Case) -> str:
    """Break bonds in equilibrium, and return the transient loads of others, for some dampings."""
    model = case.model()
    steps = list(solve_path(model, Solver(method="quasi_static", symmetric_half=False), INCREMENTS))
    breaks = [(a, b) for a, b in pairwise(steps) if broken(model, b).sum() > broken(model, a).sum()]
    lines = [
        "| damping | times that bonds broke | of which others were loaded beyond rest "
        "| most loaded of these, shares of its strength: before, meanwhile, after | in cycle |",
        "|---|---|---|---|---|",
    ]
    for damping in DAMPINGS:
        found = [meanwhile(model, a, broken(model, b), damping) for a, b in breaks]
        beyond = [f for f in found if f[1] - max(f[0], f[2]) > BEYOND]
        most = max(beyond or found, key=lambda f: f[1])
        lines.append(
            f"| {damping:g} | {len(breaks)} | {len(beyond)} | {most[0]:.2f}, {most[1]:.2f}, {most[2]:.2f} | {most[3]} |"
        )
    return "\n".join(lines)


def broken(model: Model, step: Increment) -> BoolArray:
    """Return which bonds of the mortar are broken, (m, q)."""
    return (step.state == ContactState.CRACKED) & (model.properties.tensile_strength > 0)[:, None]


def meanwhile(model: Model, start: Increment, to_break: BoolArray, damping: float) -> tuple[float, ...]:
    """Break bonds at constant movement; return the load of the most affected bond before, meanwhile, after; when."""
    strength = model.properties.tensile_strength[:, None]
    # no other bond breaks meanwhile
    law = model.properties
    holds = np.where(law.tensile_strength > 0, 1e12, 0.0)
    lasting = replace(model, properties=law._replace(tensile_strength=holds, cohesion=np.maximum(law.cohesion, holds)))
    history = JointHistory.fresh(model)
    history.slip[:] = start.slip
    history.cracked[:] = (start.state == ContactState.CRACKED) | to_break
    run = DampedTimeStepping(lasting, Solver(method="explicit", damping=damping))
    run.restore(State(1.0, start.load_factor, np.append(start.displacement.ravel(), np.zeros(3)), history))
    watched = (strength > 0) & ~history.cracked
    before = np.where(watched, start.normal_stress / np.where(strength > 0, strength, 1.0), 0.0)
    peak, at = before.copy(), np.zeros(before.shape, dtype=np.int64)
    load: FloatArray = before
    for cycle in range(1, CYCLES + 1):
        run.cycle(1)
        stress = fields_of(lasting, run.joint_history(), run.motion.displacement, start.load_factor).normal_stress
        load = np.where(watched, stress / np.where(strength > 0, strength, 1.0), 0.0)
        at[load > peak] = cycle
        peak = np.maximum(peak, load)
    excess = peak - np.maximum(before, load)
    # of the bonds that count, the one nearest to its strength
    chosen = np.where(excess > BEYOND, 100.0 + peak, excess)
    where = np.unravel_index(int(chosen.argmax()), peak.shape)
    return float(before[where]), float(peak[where]), float(load[where]), int(at[where])
