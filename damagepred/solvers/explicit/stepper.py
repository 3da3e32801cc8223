"""Explicit solver: cycles until forces balance or a part of the wall collapses."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.diagnostics import Counters, Residuals
from damagepred.errors import ConvergenceError
from damagepred.scene import Solver
from damagepred.solvers.driver import Bracket, Outcome, follow_movement, least_support_load
from damagepred.solvers.explicit.scheme import Checkpoint, DampedTimeStepping, is_mechanism, with_lasting_bonds
from damagepred.solvers.options import SolverOptions
from damagepred.solvers.state.increment import FootingResults, Increment
from damagepred.solvers.state.wall_state import contact_states, fields_of
from damagepred.solvers.system.collapse_criterion import detached_blocks
from damagepred.solvers.system.footing_forces import section_response_of, set_linear_stresses
from damagepred.solvers.system.loading_stages import activate_deferred_supports, supported_during_load

DEFLECTION_TOLERANCE = 1e-7
"""Deflection that may be missing at rest (m)."""
CHECK_INTERVAL = 50
"""Cycles between two checks of the unbalanced force."""
PASSED_CHECKS = 3
"""Checks in a row below the tolerance; an oscillation passes through balance without rest."""
GAIN_HALVING_CYCLES = 20_000
"""Cycles after which the gain of the jacks' control is halved where the wall still oscillates."""
GAIN_HALVING_TIME = 30.0
"""The same in time constants of the control, if that is longer (1)."""
DAMPING_HALVING_CYCLES = 10_000
"""Cycles after which local damping is halved where zones ring between joints that yield."""
MINIMUM_DAMPING = 0.1
"""Least local damping (1)."""
TRUSTED_TIME_STEP = 0.9
"""Share of the largest stable time step up to which it is not suspected where a wall keeps moving (1)."""
COLLAPSE_BRACKET = 1e-3
"""Load factor between the last stable state and collapse under live load (1)."""
ZERO_LOAD_RATIO = 1e-4
"""Share of the dead load below which a support counts as unloaded where a path ends (1)."""
ZERO_LOAD_BRACKET = 1e-4
"""Load factor between two points of the path that count as one in that search (1)."""
DIVERGENCE_DISPLACEMENT = 1e3
"""Displacement over the size of the wall from which a run has diverged (1)."""


class ExplicitStepper:
    """Damped time stepping as a ``Stepper`` of the load path."""

    def __init__(self, model: Model, settings: Solver, elastic_start: bool = True) -> None:
        self.model, self.settings = model, settings
        self.bracket = Bracket(
            support_load=ZERO_LOAD_RATIO * float(np.abs(model.supports.load).sum()),
            load_factor=ZERO_LOAD_BRACKET,
            collapse=COLLAPSE_BRACKET,
        )
        self.scheme = DampedTimeStepping(supported_during_load(model), settings)
        self.number, self._cycles_before, self._elastic_start = 0, 0, elastic_start
        self._displacement_limit = DIVERGENCE_DISPLACEMENT * float(np.ptp(model.blocks.vertices, axis=0).max())

    def begin_increment(self, number: int) -> None:
        """Begin to count the cycles of an increment."""
        self.number, self._cycles_before = number, self.scheme.cycles

    def counters(self) -> Counters:
        """Cycles of the current increment."""
        return Counters(cycles=self.scheme.cycles - self._cycles_before)

    def checkpoint(self) -> Checkpoint:
        """Copy of the present state."""
        return self.scheme.checkpoint()

    def restore(self, checkpoint: Checkpoint) -> None:
        """Return to a checkpoint."""
        self.scheme.restore(*checkpoint)

    def support_after_load(self) -> None:
        """Continue from the present state with the supports that act after the dead load."""
        before = self.scheme
        self.scheme = DampedTimeStepping(
            activate_deferred_supports(self.model, before.motion.displacement), self.settings
        )
        self.scheme.broken_at[:] = before.broken_at
        self.scheme.restore(*before.checkpoint())

    def end_increment(self) -> None:
        """Extrapolate the volume of the pump; after the level state, prescribe the load of jacks controlled by load."""
        if self.scheme.pump is not None:
            self.scheme.pump.extrapolate_volume(self.scheme.load_factor)
            if self.number == 0:
                self.scheme.pump.control_load()

    def step_to(self, load_factor: float) -> Outcome:
        """Equilibrium or collapse at a load factor."""
        if self.number > 0 or not (self._elastic_start and self.scheme.start_from_elastic_solution()):
            self.apply(load_factor)
        return self.equilibrate()

    def apply(self, load_factor: float) -> None:
        """Ramp the movement to a load factor, and the dead load to its full value."""
        self.scheme.advance(self.settings.ramp_cycles, load_factor_to=load_factor, load_to=1.0)
        self.scheme.stop()

    def equilibrate(self) -> Outcome:
        """Cycle at constant load until forces balance and jacks reach their deflection, or a part collapses."""
        try:
            return self._equilibrate()
        finally:
            self.scheme.damping = self.settings.damping

    def _equilibrate(self) -> Outcome:
        scheme, tolerance = self.scheme, self.settings.tolerance_used
        passed, spent, halved_at = 0, 0, 0
        while True:
            scheme.cycle(CHECK_INTERVAL)
            spent += CHECK_INTERVAL
            ratio = scheme.unbalanced_force_ratio()
            largest = float(ratio.max(initial=0.0))
            detached = self._part_detached(spent)
            missing = self._missing_deflection()
            passed = passed + 1 if largest < tolerance and missing < DEFLECTION_TOLERANCE else 0
            if passed >= PASSED_CHECKS:
                return Outcome(largest, balanced=True, collapsed=False)
            if detached:
                return Outcome(largest, balanced=False, collapsed=True)
            if scheme.pump is not None and spent - halved_at >= max(
                GAIN_HALVING_CYCLES, GAIN_HALVING_TIME * scheme.pump.time_constant
            ):
                halved_at = spent
                if largest >= tolerance:
                    scheme.pump.halve_gain()  # a wall that has softened may oscillate with the control
            halving = spent % DAMPING_HALVING_CYCLES < CHECK_INTERVAL
            if halving and scheme.zones is not None and self._joint_yielded():
                scheme.damping = min(scheme.damping, max(0.5 * scheme.damping, MINIMUM_DAMPING))
            if spent >= self.settings.maximum_cycles:
                if scheme.has_too_much_energy():
                    reason = "blocks swing with more energy than the loads can have given them"
                    scheme.diverge(self.number, spent, reason)
                if self.collapses():
                    return Outcome(largest, balanced=False, collapsed=True)
                raise self._not_converged(spent, ratio, missing)

    def _not_converged(self, spent: int, ratio: FloatArray, missing: float) -> ConvergenceError:
        largest, dof = float(ratio.max()), int(ratio.argmax())
        block = int(self.scheme.system.block_of_dof[dof])
        suspect = self.settings.time_step_safety > TRUSTED_TIME_STEP and largest > 1.0
        short = "" if missing < DEFLECTION_TOLERANCE else f", the deflection is {missing:.2g} m short"
        return ConvergenceError(
            f"increment {self.number} did not settle within {spent} cycles: the unbalanced force is "
            f"{largest:.2g} block weights at {self.scheme.model.describe_block(block)}, allowed is "
            f"{self.settings.tolerance_used:g}{short}. Raise solver.maximum_cycles or solver.tolerance"
            + (", or lower solver.time_step_safety." if suspect else "."),
            increment=self.number,
            block=block,
        )

    def _joint_yielded(self) -> bool:
        """Whether any contact has broken or slid; oscillations of elastic joints decay anyway."""
        history = self.scheme.joint_history()
        return bool(history.cracked[self.scheme.bonded].any() or history.slip.any())

    def collapses(self) -> bool:
        """Whether a wall without equilibrium is a mechanism; if so, its motion continues."""
        if self.scheme.pump is not None:
            return False
        released = DampedTimeStepping(with_lasting_bonds(self.scheme.model), self.settings, commit_sections=False)
        released.restore(*self.scheme.checkpoint())
        if not is_mechanism(released):
            return False
        self.scheme.restore(*released.checkpoint())
        return True

    def _missing_deflection(self) -> float:
        """Error of the deflection on jacks (m); 0 without jacks."""
        scheme = self.scheme
        return 0.0 if scheme.pump is None else abs(scheme.pump.missing(scheme.load_factor, scheme.motion.displacement))

    def _part_detached(self, spent: int) -> bool:
        """Whether a part of the wall is detached; DivergenceError if the loads cannot explain its motion."""
        scheme = self.scheme
        if not (np.abs(scheme.motion.displacement) < self._displacement_limit).all():
            reason = "a displacement is beyond all bounds or no longer a number"
        elif not detached_blocks(scheme.model, scheme.motion.displacement, scheme.load_factor).any():
            return False
        elif scheme.has_too_much_energy():
            reason = "blocks fly off with more energy than the loads can have given them"
        else:
            return True
        scheme.diverge(self.number, spent, reason)

    def report(self, outcome: Outcome) -> Increment:
        """Present state as an increment."""
        scheme = self.scheme
        model, displacement = scheme.model, scheme.motion.displacement
        # blocks have moved once since the last joint law
        fields = fields_of(model, scheme.joint_history(), displacement, scheme.load_factor)
        scheme.record_broken_bonds(fields.history.cracked)
        if scheme.sections is not None:
            response = section_response_of(model, scheme.sections.memory, displacement)
            set_linear_stresses(model, response, fields.normal_stress, fields.shear_stress)
        return Increment(
            number=self.number,
            load_factor=scheme.load_factor,
            displacement=displacement[: 3 * model.n_blocks].reshape(-1, 3).copy(),
            opening=fields.opening,
            slip=fields.history.slip,
            normal_stress=fields.normal_stress,
            shear_stress=fields.shear_stress,
            state=contact_states(model, fields.history),
            residuals=Residuals(unbalanced_force_ratio=outcome.unbalanced_force_ratio),
            base_reaction=scheme.system.base_reaction(scheme.motion.force),
            collapsed=outcome.collapsed,
            strain=scheme.system.strains(displacement),
            support_force=scheme.system.support_force(scheme.motion.force),
            zones=None if scheme.zones is None else scheme.zones.results(displacement),
            footing=FootingResults(
                np.nan if model.deflection is None else float(model.deflection @ displacement),
                np.nan if scheme.pump is None else scheme.pump.load,
            ),
            broken_at=scheme.broken_at.copy(),
        )

    def support_load(self) -> float:
        """Load (N) whose loss ends the path."""
        scheme = self.scheme
        if scheme.pump is None:
            return np.inf
        fields = fields_of(scheme.model, scheme.joint_history(), scheme.motion.displacement, scheme.load_factor)
        return least_support_load(scheme.model, scheme.pump.load, fields.normal_stress)


def explicit_path(
    model: Model, settings: Solver, increments: int, *, elastic_start: bool = True
) -> Iterator[Increment]:
    """Increments of the movement; ``elastic_start``: begin from the elastic solution under dead load."""
    longest_step = SolverOptions.of(settings).creep.longest_step
    yield from follow_movement(ExplicitStepper(model, settings, elastic_start), model, increments, longest_step)
