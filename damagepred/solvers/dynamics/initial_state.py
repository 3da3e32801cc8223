"""Where a dynamic run begins: in the static equilibrium under dead load, where there is one."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.errors import SolverError, TimeLimitError
from damagepred.scene import Solver
from damagepred.solvers.state.joint_history import JointHistory
from damagepred.solvers.system.detached_blocks import come_loose
from damagepred.solvers.system.elastic_stiffness import dead_load, follow_up
from damagepred.solvers.system.loading_stages import while_loading
from damagepred.solvers.time_stepping.scheme import Run


class Beginning(NamedTuple):
    """Where dead load takes a wall.

    Attributes
    ----------
    displacement : array (size,)
        Of all degrees of freedom (m, rad).
    history : JointHistory
        Of the contacts.
    plastic : array (z, 4) or None
        Plastic strain of the zones; None if nothing has yielded.
    """

    displacement: FloatArray
    history: JointHistory
    plastic: FloatArray | None


def static_equilibrium(model: Model, settings: Solver) -> Beginning | None:
    """Return where dead load takes the wall, and what joints and zones remember; None if it does not stand.

    Parameters
    ----------
    model : Model
        n blocks.
    settings : Solver
        Of the quasi-static solver, which is asked where a joint or a zone gives way.
    """
    held = len(model.interfaces.kind) > 0 or (model.supports.prescribed >= 3 * (model.n_blocks + 1)).any()
    if not held or not dead_load(model).any():
        return None
    model = while_loading(model)
    run = Run(model, settings)
    if run.start_elastic():
        return Beginning(run.motion.displacement.copy(), JointHistory.fresh(model), None)
    from damagepred.solvers.quasi_static.continuation import Path

    try:
        path = Path(model, replace(settings, method="quasi_static", tolerance=None))
        worst = path.advance(1.0, 0.0)
    except TimeLimitError:
        raise
    except SolverError:
        return None
    state = path.state
    if worst >= path.tolerance or come_loose(model, state.displacement, 0.0).any():
        return None
    history = state.history.copy()
    softens = (model.properties.critical_opening > 0)[:, None]
    kappa = np.where(softens, np.minimum(history.kappa, 1e9), 0.0)
    history = history._replace(cracked=history.cracked & ~path.never_opened, kappa=kappa)
    plastic = None if model.mesh is None else state.plastic
    return Beginning(follow_up(model, state.displacement), history, plastic)
