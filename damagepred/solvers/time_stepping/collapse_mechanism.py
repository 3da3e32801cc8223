"""Does a wall fall that finds no rest? It is pushed on along the way that it goes, to see whether anything stops it.

A little beyond the load that it can carry, a wall sets off so slowly that in any number of cycles it hardly gets
anywhere: it is not at rest, and nothing is detached. What is left out of balance then either does work as the wall
moves on, however far, or something that it meets on its way resists. With small displacements joints that slide and
open do so with the same forces all the way, so moving faster changes no more than how soon it is seen. Bonds do not
break meanwhile: of them the wall has more than it may have.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from damagepred.assembly import Model
from damagepred.solvers.system.detached_blocks import detached_blocks

if TYPE_CHECKING:
    from damagepred.solvers.time_stepping.scheme import DampedTimeStepping


def with_lasting_bonds(model: Model) -> Model:
    """Return the model with bonds that do not break; they may soften, and weak ones break."""
    law = model.properties
    softens, weak = law.critical_opening > 0, law.tensile_strength < model.block_stress
    lasting = law._replace(
        tensile_strength=np.where(softens | weak, law.tensile_strength, np.inf),
        brittle_shear=np.zeros_like(law.brittle_shear),
    )
    return replace(model, properties=lasting)


def is_mechanism(run: DampedTimeStepping, near_rest: bool = False) -> bool:
    """Tell whether what moves comes loose when it is pushed on.

    Parameters
    ----------
    run : DampedTimeStepping
        A wall on its way, with lasting bonds; it is left where it was pushed to.
    near_rest : bool
        Whether the wall is nearly at rest; then it gets fewer rounds.
    """
    options = run.options.mechanism
    rounds = options.max_rounds_near_rest if near_rest else options.max_rounds
    moved, mass = run.motion.displacement, 1.0 / run.motion.inverse_mass[run.free]
    for _ in range(rounds):
        ways = []
        for _ in range(2):
            before = moved[run.free].copy()
            run.cycle(options.cycles)
            ways.append(moved[run.free] - before)
        if not np.isfinite(moved).all():
            return False
        if detached_blocks(run.model, moved, run.load_factor).any():
            return True
        first, second = ways
        load = run.load_share * run.motion.load + run.load_factor * run.motion.live_load
        gains = float((mass * first) @ (second - first)) > 0.0 and float(load[run.free] @ second) > 0.0
        # the mean speed: what only swings to and fro makes local damping brake like a friction that is not there
        run.motion.velocity[run.free] = (options.speed_factor if gains else 1.0) / options.cycles * second
        if run.unbalanced_force_ratio().max() < run.settings.tolerance_used:
            return False
    return False
