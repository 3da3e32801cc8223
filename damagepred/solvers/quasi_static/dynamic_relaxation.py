"""Dynamic relaxation (Otter 1966; Day 1965): snap-through to an equilibrium that is not near.

Where joints slide unstably, no path of equilibria exists. The explicit scheme moves the blocks with local damping until
they are nearly at rest; equilibrium is found from there. Bonds do not fail meanwhile: the continuation lets them fail
in order. They may begin to soften.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.kernels.equilibrium.residual import DEFLECTION_TOLERANCE
from damagepred.scene import Solver
from damagepred.solvers.explicit.scheme import DampedTimeStepping, is_mechanism, with_lasting_bonds
from damagepred.solvers.quasi_static.equilibrium import Equilibrium
from damagepred.solvers.state.wall_state import JointHistory, State, fields_of
from damagepred.solvers.system.collapse_criterion import DetachmentLimit, detached_blocks
from damagepred.solvers.system.loading_stages import unilateral_supports

RAMP_CYCLES = 3000
"""Cycles in which the movement is applied."""
FIRST_CHECK = 500
"""Cycles before the first convergence check."""
CHECK_GROWTH = 1.2
"""Growth of the cycles from one check to the next (1)."""
CONVERGENCE_WINDOW = 4
"""Checks over which the speed is compared; their cycles double in them."""
SLOWING_RATIO = 0.8
"""Speed at the end of that window over that at its start, below which the wall is slowing down (1)."""
DAMPING_CYCLES = 4000
"""Cycles after which damping is reduced."""
DAMPING_DECAY = 0.8
"""Factor on the damping at each check from there on (1). Stick-slip shakes the moving blocks. Local damping, a share of
these forces, then brakes them like a friction that does not exist: a wall beyond its limit load would creep. So damping
is reduced once the impact of the load has died away."""
MINIMUM_DAMPING = 0.1
"""Least local damping (1)."""
UPLIFT_CHECKS = 2
"""Checks in a row at which a footing on jacks floats above all supports, after which it has lifted off."""
VOLUME_RATE_GROWTH = 4.0
"""Largest factor from one volume correction rate of the jacks' pump to the next (1)."""
VOLUME_ANSWER = 0.1
"""Change of the deflection between checks, over the missing deflection, below which the wall has answered (1)."""


@dataclass
class VolumeCorrection:
    """Corrections of the pump's volume while a wall relaxes, by the secant method; the deflection is given.

    Under a given volume a footing that yields, or whose load falls as it bends, does not run away. A correction waits
    until the wall has answered to the last one.
    """

    rate: float  # volume per deflection (1): of the tangent, then the secant of the last correction
    _last: float = 0.0
    _corrected_at: float = 0.0
    _deflection: float = np.inf

    def settles(self, deflection: float, missing: float) -> bool:
        """Whether the wall has responded to the last correction and deflection is still missing."""
        change, self._deflection = abs(deflection - self._deflection), deflection
        return abs(missing) > DEFLECTION_TOLERANCE and change <= VOLUME_ANSWER * abs(missing)

    def next(self, deflection: float, missing: float) -> float:
        """Return the next correction of the volume by the secant method (m)."""
        if self._last != 0.0:
            answer, most = (deflection - self._corrected_at) / self._last, VOLUME_RATE_GROWTH * self.rate
            self.rate = 1.0 / answer if answer * most > 1.0 else most
        self._last, self._corrected_at = missing * self.rate, deflection
        return self._last


def relax_dynamically(
    model: Model,
    start: State,
    start_load_factor: float,
    max_cycles: int,
    cycles_share: float,
    volume_per_deflection: float | None,
) -> Iterator[State]:
    """Relax a wall from its last equilibrium ``start``: ramp of the movement, then local damping; yield its states.

    The movement is ramped from ``start_load_factor`` to the load factor of ``start``: ground that moved at once would
    compress joints until blocks fly off and stay where they wedge. Each check of convergence yields one state, the last
    one detached or out of cycles. ``volume_per_deflection``: of the tangent; None under a given load of the jacks.
    """
    # no bond breaks meanwhile, nor do sections crack for good
    run = _at(model, replace(start, load_factor=start_load_factor), volume_per_deflection)
    if start.load_factor != start_load_factor:
        run.advance(RAMP_CYCLES, start.load_factor, run.load_share)
        run.stop()
    correction = None if volume_per_deflection is None else VolumeCorrection(volume_per_deflection)
    window = CONVERGENCE_WINDOW
    cycles, begun, speeds = FIRST_CHECK, run.cycles, [np.inf] * (window + 1)
    supports, floating_checks = unilateral_supports(model), 0
    while run.cycles < max_cycles * (1 if speeds[-1] < SLOWING_RATIO * speeds[-1 - window] else cycles_share):
        if run.cycles > begun + DAMPING_CYCLES:
            run.damping = max(DAMPING_DECAY * run.damping, MINIMUM_DAMPING)
        before = run.motion.displacement.copy()
        if run.pump is not None and correction is not None:
            deflection, missing = float(run.pump.weights @ before), run.pump.missing(start.load_factor, before)
            if correction.settles(deflection, missing):
                if floating_checks >= UPLIFT_CHECKS:  # the jacks carry all of the weight, and lift it freely
                    before[1 : 3 * model.n_blocks : 3] += 2.0 * DetachmentLimit.of(model).at(1.0)
                    yield replace(start, displacement=before, history=run.joint_history(), jack=run.pump.load)
                    return
                if not floating_checks:
                    run.pump.deliver(correction.next(deflection, missing))
        run.cycle(cycles)
        speeds.append(float(np.abs((run.motion.displacement - before) * run.arm).max()) / cycles)
        cycles = int(CHECK_GROWTH * cycles)
        history = run.joint_history()
        opening = fields_of(run.model, history, run.motion.displacement, start.load_factor).opening
        floating_checks = floating_checks + 1 if supports.size and (opening[supports] > 0.0).all() else 0
        _mark_parted(model, history, opening)
        plastic = start.plastic if run.zones is None else run.zones.plastic()
        jack = start.jack if run.pump is None else run.pump.load
        yield replace(start, displacement=run.motion.displacement.copy(), history=history, plastic=plastic, jack=jack)
        if detached_blocks(model, run.motion.displacement, start.load_factor).any():
            return


def _mark_parted(model: Model, history: JointHistory, opening: FloatArray) -> None:
    """Set kappa of brittle cracked contacts as the quasi-static solver does: infinite where open, otherwise 0."""
    law = model.properties
    stress = law.normal_stiffness[:, None] * (opening - history.dilatant_opening)
    parted = np.where(stress > law.residual_tensile_strength[:, None], np.inf, 0.0)
    brittle = history.cracked & (law.critical_opening == 0)[:, None]
    history.kappa[brittle] = parted[brittle]


def collapse_motion(model: Model, state: State, nearly_at_rest: bool) -> State | None:
    """State of a collapsing wall by the collapse-mechanism test, or None; it is not made on jacks."""
    if model.jacks is not None:
        return None
    run = _at(model, state)
    if not is_mechanism(run, nearly_at_rest):
        return None
    plastic = state.plastic if run.zones is None else run.zones.plastic()
    return replace(state, displacement=run.motion.displacement, history=run.joint_history(), plastic=plastic)


def residual_in_motion(model: Model, state: State) -> float:
    """Largest residual force of a collapsing wall over the mean block weight, after one cycle of its motion."""
    run = _at(model, state)
    run.cycle(1)
    return float(run.unbalanced_force_ratio().max())


def _at(model: Model, state: State, volume_per_deflection: float | None = None) -> DampedTimeStepping:
    """Return the explicit scheme at rest in a state, with lasting bonds; jacks without a pump keep their load."""
    lasting, jacks = with_lasting_bonds(model), model.jacks
    pumped = lasting if volume_per_deflection is not None else replace(lasting, jacks=None)
    run, load = DampedTimeStepping(pumped, Solver(), commit_sections=False), state.load
    if jacks is not None and run.pump is None:
        # a prescribed load grows with the movement from the load of the level state
        growth = (
            (jacks.load - state.jack) / (1.0 - state.load_factor) if jacks.by_load and state.load_factor < 1.0 else 0.0
        )
        run.motion.load[:] = load * run.motion.load + (state.jack - state.load_factor * growth) * jacks.push
        run.motion.live_load[:] += growth * jacks.push
        load = 1.0
    run.restore(replace(state, load=load))
    if run.pump is not None and volume_per_deflection is not None:
        run.pump.begin_at(state.displacement, state.jack, volume_per_deflection)
    return run


FALLBACK_RESIDUAL_TOLERANCE = 1e-3
"""Residual that is accepted where Coulomb friction admits no equilibrium (mean block weights)."""
STAGNATION_LIMIT = 8
"""States in a row that do not halve the least residual, after which such a state is taken."""
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
    ``FALLBACK_RESIDUAL_TOLERANCE``. A creeping wall may have as small a residual, but moves on in the
    collapse-mechanism test: it collapses.
    """
    best, least, reference, stagnating, ratio = state, np.inf, np.inf, 0, np.inf
    volume, most = wall.volume_per_deflection(), wall.options.dynamic_relaxation.max_cycles
    for resting in relax_dynamically(wall.model, state, start_load_factor, most, cycles_share, volume):
        if wall.jacks is not None:
            resting.jack = wall.jacks.load_at(resting.load_factor, resting.jack)
        if is_detached(wall.model, resting):
            return Rest(resting, np.inf)
        _activate_inelastic(wall, resting, state.history)
        found, ratio = wall.newton(resting, resting.displacement)
        if ratio < wall.tolerance:
            resting.displacement[:] = found
            return Rest(resting, ratio)
        missing = 0.0 if wall.jacks is None else wall.jacks.missing_deflection(resting.load_factor, found)
        if abs(missing) > FALLBACK_DEFLECTION_TOLERANCE:
            # stick-slip does not excuse a missing deflection
            ratio = max(ratio, FALLBACK_RESIDUAL_TOLERANCE)
        if ratio < least:
            best, least = resting, ratio
            best.displacement[:] = found
        stagnating, reference = (0, least) if least < 0.5 * reference else (stagnating + 1, reference)
        if least < FALLBACK_RESIDUAL_TOLERANCE and stagnating >= STAGNATION_LIMIT:
            break
    accepted = least < FALLBACK_RESIDUAL_TOLERANCE
    collapsing = collapse_motion(wall.model, resting, accepted)
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
