"""Where a dynamic run begins: in the static equilibrium under dead load, where there is one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from damagepred.assembly import Model
from damagepred.errors import SolverError
from damagepred.scene import Solver
from damagepred.solvers.explicit import Run
from damagepred.solvers.stages import while_loading
from damagepred.solvers.state import JointMemory, come_loose

FloatArray = NDArray[np.float64]


def static_equilibrium(model: Model, settings: Solver) -> tuple[FloatArray, JointMemory] | None:
    """Return where dead load takes the wall, and what the joints remember of it; None if it does not stand.

    Parameters
    ----------
    model : Model
        n blocks.
    settings : Solver
        Of the quasi-static solver, which is asked where a joint gives way.

    Returns
    -------
    displacement : array (n + 1, 3)
        Of the blocks and the ground (m, rad).
    memory : JointMemory
        Of the contacts.
    """
    if not len(model.interfaces.kind) or not model.supports.load.any():
        return None
    model = while_loading(model)
    run = Run(model, settings)
    if run.start_elastic():
        return run.motion.displacement.reshape(-1, 3).copy(), JointMemory.fresh(model)
    from damagepred.solvers.quasi_static.path import Path

    try:
        path = Path(model, replace(settings, method="quasi_static", tolerance=None))
        worst = path.advance(1.0, 0.0)
    except SolverError:
        return None
    state = path.state
    if worst >= path.tolerance or come_loose(model, state.displacement, 0.0).any():
        return None
    memory = state.memory.copy()
    softens = (model.properties.critical_opening > 0)[:, None]
    opened = np.where(softens, np.minimum(memory.opened, 1e9), 0.0)
    memory = memory._replace(cracked=memory.cracked & ~path.unopened, opened=opened)
    return state.displacement.reshape(-1, 3).copy(), memory
