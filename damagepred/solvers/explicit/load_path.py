"""Load path of the explicit solver: each increment is cycled until forces balance or a part of the wall collapses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.errors import ConvergenceError
from damagepred.one_thread import each_with_one_blas_thread
from damagepred.scene import Solver
from damagepred.solvers.options import SolverOptions
from damagepred.solvers.state.increment import Increment
from damagepred.solvers.state.joint_history import contact_states, fields_of
from damagepred.solvers.system.detached_blocks import detached_blocks
from damagepred.solvers.system.footing_forces import section_response_of, set_linear_stresses
from damagepred.solvers.system.loading_stages import supported_after_load, supported_during_load
from damagepred.solvers.system.zero_support_load import IllinoisRegulaFalsi, carried
from damagepred.solvers.time_stepping.collapse_mechanism import is_mechanism, with_lasting_bonds
from damagepred.solvers.time_stepping.scheme import Checkpoint, DampedTimeStepping


class ExplicitPath:
    """The load path in progress: increments of the movement on one wall; see ``explicit_path``.

    Parameters
    ----------
    model : Model
        The wall.
    settings : Solver
        Damping, tolerance and limits.

    Attributes
    ----------
    scheme : DampedTimeStepping
        The wall in motion.
    """

    def __init__(self, model: Model, settings: Solver) -> None:
        self.settings, options = settings, SolverOptions.of(settings)
        self.options, self.deflection_tolerance = options.explicit, options.jack_servo.deflection_tolerance
        self.scheme = DampedTimeStepping(model, settings)
        self._displacement_limit = self.options.divergence_displacement * float(
            np.ptp(model.blocks.vertices, axis=0).max()
        )

    def change_supports(self, model: Model) -> None:
        """Continue from the present state with other supports.

        Parameters
        ----------
        model : Model
            The same wall on other supports.
        """
        before, self.scheme = self.scheme, DampedTimeStepping(model, self.settings)
        self.scheme.broken_at[:] = before.broken_at
        self.scheme.restore(before.checkpoint())

    def apply(self, load_factor: float) -> None:
        """Ramp up the movement to a load factor, and the dead load if it is not there yet."""
        self.scheme.advance(self.settings.ramp_cycles, load_factor_to=load_factor, load_to=1.0)
        self.scheme.stop()

    def equilibrate(self, increment: int) -> tuple[float, bool]:
        """Cycle at constant load until forces balance and jacks have reached their deflection.

        Parameters
        ----------
        increment : int
            Number of the increment, for messages.

        Returns
        -------
        float, bool
            Unbalanced force ratio, and whether a part of the wall has collapsed instead.
        """
        try:
            return self._equilibrate(increment)
        finally:
            self.scheme.damping = self.settings.damping

    def _equilibrate(self, increment: int) -> tuple[float, bool]:
        scheme, options, tolerance = self.scheme, self.options, self.settings.tolerance_used
        passed, spent, halved_at = 0, 0, 0
        while True:
            scheme.cycle(options.check_interval)
            spent += options.check_interval
            ratio = scheme.unbalanced_force_ratio()
            largest = float(ratio.max(initial=0.0))
            detached = self._part_detached(increment, spent)
            missing = self._missing_deflection()
            passed = passed + 1 if largest < tolerance and missing < self.deflection_tolerance else 0
            if passed >= options.passed_checks:
                return largest, False
            if detached:
                return largest, True
            if scheme.pump is not None and spent - halved_at >= max(
                options.gain_halving_cycles, options.gain_halving_time * scheme.pump.time_constant
            ):
                halved_at = spent
                if largest >= tolerance:
                    scheme.pump.halve_gain()  # a wall that has become soft may oscillate with the control
            halving = spent % options.damping_halving_cycles < options.check_interval
            if halving and scheme.zones is not None and self._joint_yielded():
                scheme.damping = min(scheme.damping, max(0.5 * scheme.damping, options.minimum_damping))
            if spent >= self.settings.maximum_cycles:
                if scheme.has_too_much_energy():
                    scheme.diverge(increment, spent, "blocks swing with more energy than the loads can have given them")
                if self.collapses():
                    return largest, True
                raise self._not_converged(increment, spent, ratio, missing)

    def _not_converged(self, increment: int, spent: int, ratio: FloatArray, missing: float) -> ConvergenceError:
        largest, dof = float(ratio.max()), int(ratio.argmax())
        block = int(self.scheme.system.block_of_dof[dof])
        suspect = self.settings.time_step_safety > self.options.trusted_time_step and largest > 1.0
        short = "" if missing < self.deflection_tolerance else f", the deflection is {missing:.2g} m short"
        return ConvergenceError(
            f"increment {increment} did not settle within {spent} cycles: the unbalanced force is "
            f"{largest:.2g} block weights at {self.scheme.model.describe_block(block)}, allowed is "
            f"{self.settings.tolerance_used:g}{short}. Raise solver.maximum_cycles or solver.tolerance"
            + (", or lower solver.time_step_safety." if suspect else "."),
            increment=increment,
            block=block,
        )

    def _joint_yielded(self) -> bool:
        """Whether any contact has broken or slid; elastic joints stop ringing by themselves."""
        history = self.scheme.joint_history()
        return bool(history.cracked[self.scheme.bonded].any() or history.slip.any())

    def collapses(self) -> bool:
        """Test whether a wall that does not come to rest is a mechanism; if so, it is left where that took it."""
        if self.scheme.pump is not None:
            return False
        released = DampedTimeStepping(with_lasting_bonds(self.scheme.model), self.settings, commit_sections=False)
        released.restore(self.scheme.checkpoint())
        if not is_mechanism(released):
            return False
        self.scheme.restore(released.checkpoint())
        return True

    def _missing_deflection(self) -> float:
        """Distance (m) of the deflection from the jacks' target; 0 without jacks."""
        scheme = self.scheme
        return 0.0 if scheme.pump is None else abs(scheme.pump.missing(scheme.load_factor, scheme.motion.displacement))

    def _part_detached(self, increment: int, spent: int) -> bool:
        """Whether a part of the wall has detached.

        Raises
        ------
        DivergenceError
            If a displacement has no bound, or detached blocks are faster than the loads explain.
        """
        scheme = self.scheme
        if not (np.abs(scheme.motion.displacement) < self._displacement_limit).all():
            reason = "a displacement is beyond all bounds or no longer a number"
        elif not detached_blocks(scheme.model, scheme.motion.displacement, scheme.load_factor).any():
            return False
        elif scheme.has_too_much_energy():
            reason = "blocks fly off with more energy than the loads can have given them"
        else:
            return True
        scheme.diverge(increment, spent, reason)

    def report(self, number: int, ratio: float, cycles: int, collapsed: bool) -> Increment:
        """Results of the present state.

        Parameters
        ----------
        number : int
            Increment.
        ratio : float
            Unbalanced force ratio.
        cycles : int
            Cycles of the increment.
        collapsed : bool
            Whether a part of the wall has collapsed.
        """
        scheme = self.scheme
        model, displacement = scheme.model, scheme.motion.displacement
        # blocks have moved once more since the last cycle's joint law
        fields = fields_of(model, scheme.joint_history(), displacement, scheme.load_factor)
        scheme.record_broken_bonds(fields.history.cracked)
        if scheme.sections is not None:
            response = section_response_of(model, scheme.sections.memory, displacement)
            set_linear_stresses(model, response, fields.normal_stress, fields.shear_stress)
        return Increment(
            number=number,
            load_factor=scheme.load_factor,
            displacement=displacement[: 3 * model.n_blocks].reshape(-1, 3).copy(),
            opening=fields.opening,
            slip=fields.history.slip,
            normal_stress=fields.normal_stress,
            shear_stress=fields.shear_stress,
            state=contact_states(model, fields.history),
            unbalanced_force_ratio=ratio,
            base_reaction=scheme.system.base_reaction(scheme.motion.force),
            cycles=cycles,
            collapsed=collapsed,
            support_force=scheme.system.support_force(scheme.motion.force),
            zones=None if scheme.zones is None else scheme.zones.picture(displacement),
            deflection=np.nan if model.deflection is None else float(model.deflection @ displacement),
            jack_load=np.nan if scheme.pump is None else scheme.pump.load,
            broken_at=scheme.broken_at.copy(),
        )

    def bisect_collapse(self, stable: Checkpoint, number: int) -> tuple[float, float]:
        """Bracket the collapse load factor by bisection: the last stable load factor, and one of collapse.

        Parameters
        ----------
        stable : Checkpoint
            The last stable state; the wall collapses between it and the present load factor.
        number : int
            Increment.
        """
        collapsed_at = self.scheme.load_factor
        while collapsed_at - stable.load_factor > self.options.collapse_bracket:
            middle = 0.5 * (stable.load_factor + collapsed_at)
            self.scheme.restore(stable)
            self.apply(middle)
            try:
                _, collapsed = self.equilibrate(number)
            except ConvergenceError:
                break  # so near its limit that it neither collapses nor comes to rest
            if collapsed:
                collapsed_at = middle
            else:
                stable = self.scheme.checkpoint()
        return stable.load_factor, collapsed_at

    def carried(self) -> float:
        """Support load (N) at whose end the path ends; see ``damagepred.solvers.system.zero_support_load``."""
        scheme = self.scheme
        if scheme.pump is None:
            return np.inf
        fields = fields_of(scheme.model, scheme.joint_history(), scheme.motion.displacement, scheme.load_factor)
        return carried(scheme.model, scheme.pump.load, fields.normal_stress)

    def find_zero_support_load(self, before: Checkpoint, load: float, number: int, ratio: float) -> float:
        """Find the load factor between an earlier state and the present at which the support load vanishes.

        Parameters
        ----------
        before : Checkpoint
            The earlier state.
        load : float
            Support load there (N).
        number : int
            Increment.
        ratio : float
            Unbalanced force ratio of the present state.

        Returns
        -------
        float
            Unbalanced force ratio at that load factor.
        """
        search = IllinoisRegulaFalsi(
            before.load_factor,
            load,
            self.scheme.load_factor,
            self.carried(),
            enough=self.options.zero_load_ratio * float(np.abs(self.scheme.model.supports.load).sum()),
            close=self.options.zero_load_bracket,
        )
        for _ in range(SolverOptions.of(self.settings).jacks.max_iterations):
            if search.found:
                break
            at = search.between()
            self.scheme.restore(before)
            self.apply(at)
            ratio, collapsed = self.equilibrate(number)
            if collapsed:
                break
            if search.note(at, self.carried()):
                before = self.scheme.checkpoint()
        return ratio


@each_with_one_blas_thread
def explicit_path(
    model: Model, settings: Solver, increments: int, *, elastic_start: bool = True
) -> Iterator[Increment]:
    """Follow the movement increment by increment.

    Parameters
    ----------
    model : Model
        The wall.
    settings : Solver
        Damping, tolerance and limits.
    increments : int
        Number of equal steps of the movement.
    elastic_start : bool
        Whether to begin from the elastic solution under dead load, where it breaks no joint: it does not depend
        on how the load came on. False always cycles.

    Yields
    ------
    Increment
        First the state under dead load (number 0), then one each step. The path ends early after an increment in
        which a part of the wall collapsed.

    Raises
    ------
    DivergenceError
        If blocks move as nothing could move them; the message names increment and block.
    ConvergenceError
        If an increment does not come to rest; the message names increment and block.
    """
    path = ExplicitPath(supported_during_load(model), settings)
    seeks_collapse = bool(model.supports.live_load.any())
    stops = model.jacks is not None and bool(model.jacks.stop)
    load = np.inf
    for number in range(increments + 1):
        scheme = path.scheme
        cycles_before = scheme.cycles
        before = scheme.checkpoint() if seeks_collapse or stops else None
        if number > 0 or not (elastic_start and scheme.start_from_elastic_solution()):
            path.apply(number / increments)
        ratio, collapsed = path.equilibrate(number)
        load_before, load = load, path.carried() if stops else np.inf
        ended = load <= 0.0 and not collapsed
        if ended and before is not None and number > 0:
            ratio = path.find_zero_support_load(before, load_before, number, ratio)
        increment = path.report(number, ratio, scheme.cycles - cycles_before, collapsed)
        if ended and model.jacks is not None:
            yield replace(increment, ended=model.jacks.stop)
            return
        if collapsed:
            stable_at, collapsed_at = (number - 1) / increments, number / increments
            if seeks_collapse and before is not None and number > 0:
                broken_at = scheme.broken_at.copy()
                stable_at, collapsed_at = path.bisect_collapse(before, number)
                # bonds that broke beyond the collapse load factor broke in the collapse
                increment = replace(increment, broken_at=np.minimum(broken_at, collapsed_at))
            yield replace(
                increment,
                load_factor=collapsed_at,
                last_stable_load_factor=max(stable_at, 0.0),
                cycles=scheme.cycles - cycles_before,
            )
            return
        yield increment
        if scheme.pump is not None:
            scheme.pump.extrapolate_volume(scheme.load_factor)
            if number == 0:
                scheme.pump.control_load()
        if number == 0 and model.supports.after_load.any():
            path.change_supports(supported_after_load(model, scheme.motion.displacement))
