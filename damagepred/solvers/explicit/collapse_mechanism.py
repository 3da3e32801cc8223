"""Collapse-mechanism test of a wall that finds no equilibrium.

Slightly beyond its limit load, a wall accelerates too slowly for a part to detach in an affordable number of cycles. In
a mechanism the unbalanced forces do positive work along the whole motion; otherwise a joint comes to resist. With small
displacements, joints slide and open under constant forces, so a larger speed leads to the same end faster. The test
raises the speed until a part is detached or forces balance. Bonds last: a wall that collapses with them collapses
without them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from damagepred.assembly import Model
from damagepred.solvers.system.collapse_criterion import detached_blocks

CYCLES_PER_HALF_ROUND = 250
"""Cycles of each half of a round; a mechanism moves farther in the second half."""
SPEED_FACTOR = 2.0
"""Factor on the speed after a round in which it does (1)."""
MAX_ROUNDS_NEAR_REST = 40
"""The same where the wall is nearly at rest."""
MAX_ROUNDS = 200
"""Rounds in all. A wall that stops now and then may creep on."""

if TYPE_CHECKING:
    from damagepred.solvers.explicit.scheme import DampedTimeStepping


def with_lasting_bonds(model: Model) -> Model:
    """Model with bonds that do not break, except softening and weak bonds."""
    law = model.properties
    softens, weak = law.critical_opening > 0, law.tensile_strength < model.block_stress
    lasting = law._replace(
        tensile_strength=np.where(softens | weak, law.tensile_strength, np.inf),
        brittle_shear=np.zeros_like(law.brittle_shear),
    )
    return replace(model, properties=lasting)


def is_mechanism(run: DampedTimeStepping, near_rest: bool = False) -> bool:
    """Whether a part of a wall with lasting bonds is detached when its motion is accelerated; changes the motion."""
    rounds = MAX_ROUNDS_NEAR_REST if near_rest else MAX_ROUNDS
    moved, mass = run.motion.displacement, 1.0 / run.motion.inverse_mass[run.free]
    for _ in range(rounds):
        moves = []
        for _ in range(2):
            before = moved[run.free].copy()
            run.cycle(CYCLES_PER_HALF_ROUND)
            moves.append(moved[run.free] - before)
        if not np.isfinite(moved).all():
            return False
        if detached_blocks(run.model, moved, run.load_factor).any():
            return True
        first, second = moves
        load = run.load_share * run.motion.load + run.load_factor * run.motion.live_load
        accelerates = float((mass * first) @ (second - first)) > 0.0 and float(load[run.free] @ second) > 0.0
        # mean speed: local damping of an oscillation acts like friction
        run.motion.velocity[run.free] = (SPEED_FACTOR if accelerates else 1.0) / CYCLES_PER_HALF_ROUND * second
        if run.unbalanced_force_ratio().max() < run.settings.tolerance_used:
            return False
    return False
