"""Find the static equilibrium under dead load, the initial state of a run in physical time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from damagepred.assembly import Model
from damagepred.errors import SolverError, TimeLimitError
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene import Solver
from damagepred.solvers.explicit.scheme import DampedTimeStepping
from damagepred.solvers.quasi_static.continuation import Continuation
from damagepred.solvers.state.wall_state import State
from damagepred.solvers.system.collapse_criterion import detached_blocks
from damagepred.solvers.system.discrete_system import DiscreteSystem
from damagepred.solvers.system.loading_stages import supported_during_load


@one_blas_thread()
def static_equilibrium(model: Model, settings: Solver) -> State | None:
    """Static equilibrium under dead load, or None where the wall has no support or falls."""
    supported = len(model.interfaces.kind) > 0 or (model.supports.prescribed >= 3 * (model.n_blocks + 1)).any()
    if not supported or not DiscreteSystem.of(model).dead_load.any():
        return None
    model = supported_during_load(model)
    scheme = DampedTimeStepping(model, settings)
    if scheme.start_from_elastic_solution():
        return replace(State.rest(model), load=1.0, displacement=scheme.motion.displacement.copy())
    try:
        path = Continuation(model, replace(settings, method="quasi_static", tolerance=None))
        worst = path.advance(1.0, 0.0)
    except TimeLimitError:
        raise
    except SolverError:
        return None
    state = path.state
    if worst >= path.tolerance or detached_blocks(model, state.displacement, 0.0).any():
        return None
    history = state.history.copy()
    softens = (model.properties.critical_opening > 0)[:, None]
    kappa = np.where(softens, np.minimum(history.kappa, 1e9), 0.0)
    history = history._replace(cracked=history.cracked & ~path.bonds.never_opened, kappa=kappa)
    return replace(state, displacement=path.equilibrium.system.complete(state.displacement), history=history)
