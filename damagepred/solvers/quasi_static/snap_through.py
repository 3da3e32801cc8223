"""Snap-through to a distant equilibrium: dynamic relaxation, and Newton's method from the states that it reaches."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.assembly import Model
from damagepred.solvers.quasi_static.dynamic_relaxation import collapse_motion, relax_dynamically
from damagepred.solvers.quasi_static.equilibrium import Equilibrium
from damagepred.solvers.state.joint_history import JointHistory
from damagepred.solvers.state.wall_state import State
from damagepred.solvers.system.collapse_criterion import detached_blocks

FALLBACK_DEFLECTION_TOLERANCE = 1e-7
"""Missing deflection of jacks up to which a state without equilibrium is accepted (m)."""


class Rest(NamedTuple):
    """End of a snap-through."""

    state: State
    ratio: float  # unbalanced force ratio; infinite if the wall collapses, 0 for an accepted state
    accepted_residual: float = 0.0  # unbalanced force ratio of an accepted state that is no equilibrium


def is_detached(model: Model, state: State) -> bool:
    """Whether a part of the wall is detached."""
    return bool(detached_blocks(model, state.displacement, state.load_factor).any())


def snap_through(wall: Equilibrium, state: State, start_load_factor: float, cycles_share: float = 1.0) -> Rest:
    """Find a distant equilibrium at the load of a state, while the movement is ramped from another load factor.

    Coulomb friction has no potential: under some loads two joints push each other in turn (cyclic stick-slip), and no
    choice of sliding joints is an equilibrium. The state with the smallest residual is then accepted if that is below
    ``fallback_residual_tolerance``. A creeping wall may have as small a residual, but moves on in the
    collapse-mechanism test: it collapses.
    """
    options, ratio = wall.options.continuation, np.inf
    best, least, reference, stagnating = state, np.inf, np.inf, 0
    volume = wall.volume_per_deflection()
    for resting in relax_dynamically(wall.model, state, start_load_factor, cycles_share, volume, wall.options):
        if wall.jacks is not None:
            resting.jack = wall.jacks.load_at(resting.load_factor, resting.jack)
        if is_detached(wall.model, resting):
            return Rest(resting, np.inf)
        _activate_inelastic(wall, resting, state.history)
        ratio, found = wall.find_nearby(resting)
        if ratio < wall.tolerance:
            resting.displacement[:] = found
            return Rest(resting, ratio)
        if abs(wall.missing_deflection(resting, found)) > FALLBACK_DEFLECTION_TOLERANCE:
            # stick-slip does not excuse a missing deflection
            ratio = max(ratio, options.fallback_residual_tolerance)
        if ratio < least:
            best, least = resting, ratio
            best.displacement[:] = found
        stagnating, reference = (0, least) if least < 0.5 * reference else (stagnating + 1, reference)
        if least < options.fallback_residual_tolerance and stagnating >= options.stagnation_limit:
            break
    accepted = least < options.fallback_residual_tolerance
    collapsing = collapse_motion(wall.model, resting, accepted, wall.options)
    if collapsing is not None:
        return Rest(collapsing, np.inf)
    return Rest(best, 0.0, wall.accept_unconverged(best)) if accepted else Rest(resting, ratio)


def _activate_inelastic(wall: Equilibrium, moved: State, before: JointHistory) -> None:
    """Make fronts active whose joints slipped, cracked or dilated while the wall moved, and blocks that yielded."""
    if wall.superelements is not None:
        wall.superelements.activate_plastic(moved.plastic)
    if wall.condensed:
        now = moved.history
        changed = (now.slip != before.slip) | (now.cracked != before.cracked)
        changed |= now.dilatant_opening != before.dilatant_opening
        wall.uncondense_interfaces(changed.any(axis=1))
