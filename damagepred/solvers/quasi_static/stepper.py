"""Quasi-static solver as the driver of the load path uses it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from damagepred.assembly import Model
from damagepred.diagnostics import Counters, Residuals
from damagepred.errors import ConvergenceError, SolverError, TimeLimitError
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene import Solver
from damagepred.solvers.driver import Bracket, Outcome, follow_movement, least_support_load
from damagepred.solvers.explicit.scheme import DampedTimeStepping
from damagepred.solvers.options import SolverOptions
from damagepred.solvers.quasi_static.continuation import Checkpoint, Continuation
from damagepred.solvers.quasi_static.dynamic_relaxation import residual_in_motion
from damagepred.solvers.state.increment import FootingResults, Increment, PathEnd
from damagepred.solvers.state.wall_state import State, contact_states
from damagepred.solvers.system.collapse_criterion import DetachmentLimit, detached_blocks
from damagepred.solvers.system.discrete_system import DiscreteSystem
from damagepred.solvers.system.loading_stages import (
    activate_deferred_supports,
    level,
    supported_during_load,
    unilateral_supports,
)

ZERO_LOAD_RATIO = 1e-7
"""Share of the dead load below which a support counts as unloaded where a path ends (1)."""
ZERO_LOAD_BRACKET = 1e-7
"""Load factor between two points of the path that count as one in that search (1)."""


class QuasiStaticStepper:
    """Continuation of equilibria; a footing on unilateral supports is first brought to its level state."""

    def __init__(self, model: Model, settings: Solver) -> None:
        self.model, self.settings = model, settings
        self.path = Continuation(supported_during_load(model), settings)
        self.bracket = Bracket(ZERO_LOAD_RATIO * float(np.abs(model.supports.load).sum()), ZERO_LOAD_BRACKET)
        self.number, self._before, self._detachment_limit = 0, Counters(), DetachmentLimit.of(model)

    def begin_increment(self, number: int) -> None:
        """Count work from here on as work of an increment."""
        self.number, self._before = number, self.path.counters

    def counters(self) -> Counters:
        """Work of the current increment."""
        return self.path.counters.since(self._before)

    def checkpoint(self) -> Checkpoint:
        """Return a copy of the present point of the path."""
        return self.path.checkpoint()

    def restore(self, checkpoint: Checkpoint) -> None:
        """Return to a checkpoint."""
        self.path.restore(checkpoint)

    def support_after_load(self) -> None:
        """Continue from the present equilibrium with the supports that act after the dead load."""
        self.path.change_supports(activate_deferred_supports(self.model, self.path.state.displacement))

    def end_increment(self) -> None:
        """From the level state on, the load of jacks may be prescribed."""
        if self.number == 0:
            self.path.control_load()

    def support_load(self) -> float:
        """Return the load (N) whose loss ends the path; see ``least_support_load``."""
        path = self.path
        return least_support_load(path.model, path.state.jack, path.equilibrium.contact_stresses(path.state)[1])

    def step_to(self, load_factor: float) -> Outcome:
        """Follow the path to a load factor, or to collapse; a footing that lifts off starts again from the level."""
        path, ratio = self.path, self.path.advance(1.0, load_factor)
        if self.number == 0 and self._lifted_off(ratio):
            path = self.path = Continuation(level(path.model), self.settings)
            ratio = path.advance(1.0, 0.0)
            ratio = path.release_supports(self.model) if ratio < path.tolerance else ratio
        state, balanced = path.state, ratio < path.tolerance
        limit = self._detachment_limit
        collapsed = bool(detached_blocks(self.model, state.displacement, state.load_factor, limit).any())
        if not (balanced or collapsed):
            raise self._not_converged(ratio)
        if collapsed and not np.isfinite(ratio):
            ratio = residual_in_motion(path.model, state)
        return Outcome(ratio, balanced, collapsed)

    def _lifted_off(self, ratio: float) -> bool:
        """Whether the dead load lifted the footing off unilateral supports, or found no equilibrium."""
        path, free = self.path, unilateral_supports(self.model)
        rests = ratio < path.tolerance and not detached_blocks(path.model, path.state.displacement, 0.0).any()
        return bool(free.size) and not (rests and path.bonds.never_opened[free].all())

    def _not_converged(self, ratio: float) -> ConvergenceError:
        path = self.path
        force, _ = path.equilibrium.residual(path.state, path.state.displacement)
        block = int(path.equilibrium.system.block_of_dof[np.abs(force * path.equilibrium.per_weight).argmax()])
        message = (
            f"increment {self.number}: no equilibrium found; the unbalanced force is {ratio:.2g} block weights at "
            f"{self.model.describe_block(block)}, allowed is {path.tolerance:g}."
        )
        if self.model.supports.live_load.any():
            message += f" The last equilibrium is at load factor {path.last_stable_load_factor:.5g}."
        return ConvergenceError(message, increment=self.number, block=block)

    def report(self, outcome: Outcome) -> Increment:
        """Return the present state as an increment."""
        path = self.path
        model, state, superelements = path.model, path.state, path.equilibrium.superelements
        history, (opening, sigma, tau) = state.history, path.equilibrium.contact_stresses(state)
        violation = path.equilibrium.joint_law_violation(state, sigma, tau)
        force = path.equilibrium.forces_on_supports(state)
        accepted, path.largest_accepted_residual = path.largest_accepted_residual, 0.0
        return Increment(
            number=self.number,
            load_factor=state.load_factor,
            displacement=state.displacement[: 3 * model.n_blocks].reshape(-1, 3).copy(),
            opening=opening,
            slip=history.slip.copy(),
            normal_stress=sigma,
            shear_stress=tau,
            state=contact_states(model, history._replace(cracked=history.cracked & ~path.bonds.never_opened)),
            residuals=Residuals(
                unbalanced_force_ratio=max(outcome.unbalanced_force_ratio, accepted),
                joint_law_violation=float(violation),
            ),
            base_reaction=path.equilibrium.system.base_reaction(force),
            collapsed=outcome.collapsed,
            energy=path.balance.energies(),
            end=PathEnd(last_stable_load_factor=path.last_stable_load_factor if outcome.collapsed else np.nan),
            strain=path.equilibrium.system.strains(state.displacement),
            support_force=path.equilibrium.system.support_force(force),
            zones=None if superelements is None else superelements.zone_results(state),
            footing=FootingResults(
                np.nan if model.deflection is None else float(model.deflection @ state.displacement),
                np.nan if model.jacks is None else state.jack,
            ),
            broken_at=path.bonds.broken_at.copy(),
        )


def quasi_static_path(model: Model, settings: Solver, increments: int) -> Iterator[Increment]:
    """Follow the movement increment by increment."""
    longest_step = SolverOptions.of(settings).creep.longest_step
    yield from follow_movement(QuasiStaticStepper(model, settings), model, increments, longest_step)


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
