"""What happens where no equilibrium is near: the wall gives way at standing movement, and comes to rest elsewhere.

Where joints slide unstably there is no path of equilibria to follow; the wall jumps. The explicit scheme lets the
blocks move from where they are, damped, until they are nearly at rest; from there the equilibrium is found as ever.
Bonds do not break at once on the way: that is left to the path, which breaks them in order. They may begin to soften.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from damagepred.assembly import Model
from damagepred.scene import Solver
from damagepred.solvers.explicit import Run
from damagepred.solvers.falling import FEW, ROUNDS, goes_on, lasting_bonds
from damagepred.solvers.loose import come_loose
from damagepred.solvers.packed import memory_of
from damagepred.solvers.quasi_static.equilibrium import State
from damagepred.solvers.quasi_static.jacks import JackControl
from damagepred.solvers.state import fields_of

CYCLES, LONGER, AT_MOST = 500, 1.2, 400_000
"""After how many cycles the wall is looked at first, by how much longer it is left to itself each time, and in all."""
ALONG = 3000
"""Cycles in which the movement goes on from the last equilibrium."""
LOOKS, SLOWED = 4, 0.8
"""Looks, in which its cycles double, and share of its speed before them below which a wall is slowing down."""
SHAKEN, EASED, LEAST = 4000, 0.8, 0.1
"""Cycles after which damping is eased, the share of it that is left each time the wall is looked at, and its least.

Joints that stick and slide by turns shake what moves, and local damping, a share of the forces that shake, brakes it as
by a friction that is not there: a wall well beyond what it carries would creep down at a steady pace. By then the jolt
of the load has died away, which is what strong damping is for.
"""


@dataclass
class LoadCorrection:
    """Corrections of the jacks' load while a wall relaxes, by the secant method; the deflection is given.

    A correction waits until the wall has answered to the last one: earlier ones would add up. The first is a share of
    the tangent's, as a wall that opens while its footing bends is softer by far. None is larger than the present load,
    as a footing that yields goes a long way under little more.

    Attributes
    ----------
    lift : float
        Deflection per load (m/N): of the tangent, then the secant of the last correction.
    smallest_reach : float
        Correction that is always allowed (N).
    settled : float
        Change of the deflection from look to look over what is missing of it, up to which the wall has answered (1).
    first_share : float
        Share of the tangent's correction that is made first (1).
    """

    lift: float
    smallest_reach: float
    settled: float = 0.1
    first_share: float = 0.1
    _last: float = 0.0
    _corrected_at: float = 0.0
    _deflection: float = np.inf

    def next(self, deflection: float, missing: float, load: float) -> float:
        """Return what is to be added to a load (N), at a deflection of which some is missing (m)."""
        change, self._deflection = abs(deflection - self._deflection), deflection
        if not change <= self.settled * abs(missing):
            return 0.0
        secant = (deflection - self._corrected_at) / self._last if self._last != 0.0 else 0.0
        share = 1.0 if secant > 0.0 else self.first_share
        self.lift = secant if secant > 0.0 else self.lift
        reach = max(abs(load), self.smallest_reach)
        self._last, self._corrected_at = min(max(share * missing / self.lift, -reach), reach), deflection
        return self._last


def come_to_rest(
    model: Model, start: State, left: float, patience: float = 1.0, jacks: JackControl | None = None, lift: float = 0.0
) -> Iterator[State]:
    """Let the blocks move from the last equilibrium, first with the movement, then at a standing one.

    The movement goes on slowly: ground that was in its new place at once would press
    joints together so much that blocks fly off, and stay where they climb or wedge on their way.

    Parameters
    ----------
    model : Model
        The wall.
    start : State
        Load and movement to go to; where the blocks are, and the memory of the last equilibrium.
    left : float
        Share of the movement of that.
    patience : float
        Share of the cycles that it is given, unless it is slowing down.
    jacks : JackControl, optional
        Jacks whose deflection is given: their load is corrected by what is missing.
    lift : float
        Deflection per load of the jacks by the last tangent (m/N).

    Yields
    ------
    State
        Nearer and nearer to rest; the last one, if a part of the wall has come loose, with that part on its way.
    """
    law = model.properties
    softens = law.critical_opening > 0
    # no bond breaks meanwhile, nor do sections crack for good
    run = Run(replace(lasting_bonds(model), jacks=None), Solver(), settle_every=0)
    if model.jacks is not None:
        run.motion.load[:] = start.load * run.motion.load + start.jack * model.jacks.push
    load = start.load if model.jacks is None else 1.0
    run.resume(start.displacement, start.memory, load, left, start.plastic, sections=start.sections)
    if start.progress != left:
        run.advance(ALONG, start.progress, load)
        run.halt()
    load_of_jacks, correction = start.jack, None
    if jacks is not None and model.jacks is not None and lift > 0.0:
        correction = LoadCorrection(lift, float(np.abs(model.supports.load).sum()) / len(model.jacks.at))
    cycles, begun, speeds = CYCLES, run.cycles, [np.inf] * (LOOKS + 1)
    while run.cycles < (AT_MOST if speeds[-1] < SLOWED * speeds[-1 - LOOKS] else patience * AT_MOST):
        if run.cycles > begun + SHAKEN:
            run.damping = max(EASED * run.damping, LEAST)
        before = run.motion.displacement.copy()
        if jacks is not None and correction is not None:
            missing = jacks.gap(start.progress, before)
            more = correction.next(float(jacks.weights @ before), missing, load_of_jacks)
            load_of_jacks += more
            run.motion.load[:] += more * jacks.push
        run.cycle(cycles)
        speeds.append(float(np.abs((run.motion.displacement - before) * run.arm).max()) / cycles)
        cycles = int(LONGER * cycles)
        memory = memory_of(run.joints)
        opening = fields_of(run.model, memory, run.motion.displacement, start.progress).opening
        stress = law.normal_stiffness[:, None] * (opening - memory.dilated)
        parted = np.where(stress > law.residual_tensile_strength[:, None], np.inf, 0.0)
        brittle = memory.cracked & ~softens[:, None]
        memory.opened[brittle] = parted[brittle]
        plastic = start.plastic if run.zones is None else run.zones.plastic()
        yield replace(
            start, displacement=run.motion.displacement.copy(), memory=memory, plastic=plastic, jack=load_of_jacks
        )  # fmt: skip
        if come_loose(model, run.motion.displacement, start.progress).any():
            return


def pushed_on(model: Model, state: State, nearly_at_rest: bool) -> State | None:
    """Push a wall on that does not come to rest; return it with what comes loose on its way, None if it is held.

    Parameters
    ----------
    model : Model
        The wall.
    state : State
        Where it has come to.
    nearly_at_rest : bool
        Whether what is out of balance is little; then it is not pushed as long.
    """
    if model.jacks is not None:
        return None
    run = _at(model, state)
    if not goes_on(run, FEW if nearly_at_rest else ROUNDS):
        return None
    plastic = state.plastic if run.zones is None else run.zones.plastic()
    return replace(state, displacement=run.motion.displacement, memory=memory_of(run.joints), plastic=plastic)


def unbalanced_on_its_way(model: Model, state: State) -> float:
    """Return the largest unbalanced force over the mean block weight of a wall that falls.

    Parameters
    ----------
    model : Model
        The wall.
    state : State
        Where it was last seen.
    """
    run = _at(model, state)
    run.cycle(1)
    return float(run.unbalanced().max())


def _at(model: Model, state: State) -> Run:
    """Return the explicit scheme with lasting bonds in a state, at rest."""
    run = Run(replace(lasting_bonds(model), jacks=None), Solver(), settle_every=0)
    run.resume(state.displacement, state.memory, state.load, state.progress, state.plastic, sections=state.sections)
    return run
