"""Cundall's explicit scheme: time stepping with local damping until forces balance.

The time step is 1 and the masses are scaled to it, each degree of freedom by its own stiffness: a static run needs
no physical time. Small displacements: geometry stays that of the undeformed wall.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple, NoReturn

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.section import SectionMemory
from damagepred.errors import ConvergenceError, DivergenceError
from damagepred.kernels.explicit.cycle import run_cycles
from damagepred.one_thread import each_with_one_blas_thread
from damagepred.scene import Solver
from damagepred.solvers.state.increment import Increment
from damagepred.solvers.state.joint_history import JointHistory, contact_states, fields_of, without_bond
from damagepred.solvers.state.zone_history import ZoneField
from damagepred.solvers.system.detached_blocks import come_loose
from damagepred.solvers.system.elastic_stiffness import (
    base_reaction,
    block_of_dof,
    dead_load,
    dof_arms,
    elastic_displacement,
    elastic_stiffness,
    held_dofs,
    live_load,
    residual_scale,
    support_force,
)
from damagepred.solvers.system.footing_forces import as_if_straight, section_response_of
from damagepred.solvers.system.loading_stages import held_after_load, while_loading
from damagepred.solvers.system.zero_support_load import MOST_TRIES, Vanishing, carried
from damagepred.solvers.time_stepping.collapse_mechanism import goes_on, lasting_bonds
from damagepred.solvers.time_stepping.jack_servo import DEFLECTION_FOUND, Pump, Pumped
from damagepred.solvers.time_stepping.tiles import (
    history_of,
    move_ground,
    needs_all_of_the_law,
    needs_softening,
    pack,
    pack_sections,
    set_history,
    take,
)
from damagepred.time_limit import check_time

CHECK_EVERY = 50
"""Cycles between two looks at the unbalanced force."""
CALM_CHECKS = 3
"""Looks in a row that must find it below the tolerance: a swing passes through balance without resting there."""
IMPATIENT, CLOSED = 20_000, 30.0
"""Blocks on jacks that still swing are given half the pace of their control after so many cycles, but not before it has
had so many times its own slowness to close what is missing: else it would be halved to nothing."""
PATIENT, LEAST_DAMPING = 10_000, 0.1
"""Zones between joints that give way are damped by half as much after so many cycles, each time; to this at least.

Gridpoints ring as contacts stick and slip, and local damping takes a share of the forces of that ringing: where all
of a wall goes slowly one way, what it takes opposes that way, as friction would. Walls near their limit then creep.
"""
SAFE = 0.9
"""Share of the largest stable time step up to which it is not suspected where a wall keeps on moving."""
FALL_FOUND = 1e-3
"""Progress between a wall that stands under a live load and one that falls, at most."""
SETTLE_EVERY = 8
"""Cycles after which sections of a footing remember what they have been through, which costs as much as their forces.

What they see on the way counts, as it does for joints: without, a section that unloads would go back along its curve
of loading, which has no energy, and could swing on it. Eight cycles are a short part of any swing that bends a footing.
"""
NOTHING, CLOSE = 1e-4, 1e-4
"""Share of all dead load that counts as no load; progress between two points that count as one."""
ABSURD = 1e3
"""A displacement of that many wall sizes is no movement of a wall any more."""
ENERGY_MARGIN = 10.0
"""Blocks with so many times the work of the loads as energy did not merely fall."""


class Standing(NamedTuple):
    """A state to come back to: what ``Run.resume`` takes."""

    displacement: FloatArray
    history: JointHistory
    load_share: float
    progress: float
    plastic: FloatArray | None
    pumped: Pumped | None
    sections: SectionMemory | None


class Motion(NamedTuple):
    """Motion of all degrees of freedom, arrays (size,); see ``run_cycles`` and ``damagepred.assembly.mesh.Mesh``."""

    load: FloatArray
    live_load: FloatArray
    inverse_mass: FloatArray
    velocity: FloatArray
    displacement: FloatArray
    force: FloatArray
    prescribed: IntArray
    prescribed_displacement: FloatArray
    start: FloatArray


def scaled_mass(model: Model, damping: float, safety: float, pump: Pump | None = None) -> FloatArray:
    """Return masses for which a time step of 1 is stable.

    Central differences are stable while omega^2 <= 4. Local damping adds up to ``damping`` times the unbalanced
    force and so lowers the limit to 4 / (1 + damping). The largest omega^2 is bounded by Gershgorin's circles of
    the intact wall; cracking and slipping only take stiffness away.

    Parameters
    ----------
    model : Model
        n blocks.
    damping : float
        Local damping.
    safety : float
        Fraction of the largest stable time step to use.
    pump : Pump, optional
        Of jacks under the footing.

    Returns
    -------
    array (size,)
        Mass of each degree of freedom (kg, kg m2); infinite where it is held, and where nothing joins it.
    """
    scale = dof_arms(model)
    stiffness = abs(elastic_stiffness(model))
    # what is held counts, too, though it does not swing along: a margin where it is joined
    row_sum = (stiffness @ (1.0 / scale)) / scale
    if pump is not None:
        row_sum += pump.row_sum(scale)
    mass = (1.0 + damping) / (4.0 * safety**2) * row_sum * scale**2
    mass[held_dofs(model)] = np.inf
    # a block without any joint: its weight moves it as if on the mean joint
    loose = mass == 0.0
    if loose.any():
        mass[loose] = np.median(mass[np.isfinite(mass) & ~loose]) if (np.isfinite(mass) & ~loose).any() else 1.0
    return mass


class Run:
    """One path in progress; see ``explicit_path``.

    Parameters
    ----------
    model : Model
        The wall.
    settings : Solver
        Damping, tolerance and limits.
    settle_every : int
        Cycles after which sections of a footing that cracks remember what they have been through; 0 is never.
    """

    def __init__(self, model: Model, settings: Solver, settle_every: int = SETTLE_EVERY) -> None:
        self.model, self.settings = model, settings
        self.joints, self.sections = pack(model), pack_sections(model, settle_every)
        self.special = True if needs_all_of_the_law(model) else None
        self.softening = True if needs_softening(model) else None
        self.zones = None if model.mesh is None else ZoneField(model)
        size = model.size
        held = held_dofs(model)
        self.pump = None if model.jacks is None else Pump(model)
        mass = scaled_mass(model, settings.damping, settings.time_step_safety, self.pump)
        if self.pump is not None:
            self.pump.set_pace(mass, settings.damping)
        self.motion = Motion(
            load=dead_load(model),
            live_load=live_load(model),
            inverse_mass=1.0 / mass,
            velocity=np.zeros(size),
            displacement=np.zeros(size),
            force=np.zeros(size),
            prescribed=model.supports.prescribed,
            prescribed_displacement=model.supports.prescribed_displacement,
            start=model.supports.start,
        )
        self.free = np.setdiff1d(np.arange(size), held)
        self.arm, self._residual_scale = dof_arms(model), residual_scale(model)
        self.load_share = self.progress = 0.0
        self.cycles, self.damping = 0, settings.damping
        self.broken_at = np.full(model.interfaces.contact_area.shape, np.nan)
        self._bonded = ~without_bond(model)[:, None]
        self.absurd_at = ABSURD * float(np.ptp(model.blocks.vertices, axis=0).max())

    def start_elastic(self) -> bool:
        """Put the blocks where the dead load takes the intact wall, if no joint gives way there; tell whether."""
        if self.sections is not None:  # whose stiffness, even whole, is not that of their interfaces
            return False
        displacement = elastic_displacement(self.model) if self.pump is None else self.pump.level
        if displacement is None:
            return False
        law = self.model.properties
        fields = fields_of(self.model, JointHistory.fresh(self.model), displacement, 0.0)
        # a joint that cracks or slips carries less than the elastic one would; one with a gap carries nothing
        whole = (law.gap == 0.0)[:, None]
        if not (
            np.array_equal(fields.normal_stress, whole * law.normal_stiffness[:, None] * fields.opening)
            and np.array_equal(fields.shear_stress, whole * law.shear_stiffness[:, None] * fields.shear)
        ):
            return False
        if self.zones is not None and not self.zones.within_limits(displacement):
            return False
        self.motion.displacement[:] = displacement
        self.load_share = 1.0
        if self.pump is not None:
            self.pump.begin_level()
        return True

    def resume(
        self,
        displacement: FloatArray,
        history: JointHistory,
        load_share: float,
        progress: float,
        plastic: FloatArray | None = None,
        pumped: Pumped | None = None,
        sections: SectionMemory | None = None,
    ) -> None:
        """Put the blocks somewhere, with joints that remember something, at rest.

        Parameters
        ----------
        displacement : array (size,)
            Of all degrees of freedom.
        history : JointHistory
            Of the joints.
        load_share, progress : float
            Share of the dead load and of the full movement.
        plastic : array (z, 4), optional
            Plastic strain of the zones.
        pumped : Pumped, optional
            Of the pump.
        sections : SectionMemory, optional
            Of the sections of a footing that cracks.
        """
        self.motion.displacement[:] = displacement
        if self.zones is not None and plastic is not None:
            self.zones.set_plastic_strain(plastic)
        if self.pump is not None and pumped is not None:
            self.pump.resume(pumped)
        if self.sections is not None and sections is not None:
            for now, then in zip(self.sections.memory, sections, strict=True):
                now[:] = then
        set_history(self.joints, history)
        self.load_share, self.progress = load_share, progress
        self.broken_at[~history.cracked] = np.nan
        self.halt()

    def standing(self) -> Standing:
        """Return what ``resume`` takes to come back to the present state."""
        plastic = None if self.zones is None else self.zones.plastic()
        pumped = None if self.pump is None else self.pump.standing()
        sections = None if self.sections is None else self.sections.memory.copy()
        return Standing(
            self.motion.displacement.copy(),
            history_of(self.joints),
            self.load_share,
            self.progress,
            plastic,
            pumped,
            sections,
        )

    def cycle(self, count: int) -> None:
        """Run cycles at standing movement and load."""
        self._cycle(count, self.load_share, self.progress, 0.0)

    def advance(self, cycles: int, progress_to: float, load_to: float) -> None:
        """Run cycles while movement and load go to their new values, starting and stopping gently.

        A sudden start sends a jolt through the wall that cracks joints which a slow movement leaves whole.
        """
        progress_from, load_from = self.progress, self.load_share
        stages = min(cycles, self.settings.ramp_pieces)
        for stage in range(stages):
            count = cycles * (stage + 1) // stages - cycles * stage // stages
            reached = gentle((stage + 1) / stages)
            progress = progress_from + reached * (progress_to - progress_from)
            load = load_from + reached * (load_to - load_from)
            if self.pump is not None:
                self.pump.with_dead_load(load - self.load_share)
            self._cycle(count, load, self.progress, (progress - self.progress) / count)
            self.progress, self.load_share = progress, load
            self.note_broken()
            # from rest, dead load alone cannot make blocks faster than by its work; once broken, they only seem to fall
            alone = load_from == progress_from == progress_to == 0.0
            if alone and self.energy() > ENERGY_MARGIN * self.work_of_loads() > 0.0:
                self._diverged(0, self.cycles, "blocks move with more energy than the loads can have given them")
        self.progress, self.load_share = progress_to, load_to

    def halt(self) -> None:
        """Stop all blocks, so that none runs past the balance it is near."""
        self.motion.velocity[:] = 0.0

    def _cycle(self, count: int, load_share: float, progress: float, step: float) -> None:
        check_time()
        if not self.model.ground.proportional:
            move_ground(self.joints, self.model.ground, progress, progress + count * step)
        run_cycles(
            self.joints,
            self.special,
            self.softening,
            self.zones and self.zones.packed,
            self.sections,
            self.pump and self.pump.line,
            self.motion,
            self.damping,
            load_share,
            progress,
            step,
            count,
        )
        self.cycles += count
        if self.zones is not None:
            self.zones.mean_motion(self.motion.displacement)

    def unbalanced(self) -> FloatArray:
        """Return the unbalanced force of every degree of freedom over the mean block weight, 0 where it is held.

        A deformable block counts as a whole, too, its turning included: a little on each of many gridpoints is much
        together.
        """
        force = np.zeros_like(self.motion.force)
        force[self.free] = (self.motion.force / self._residual_scale)[self.free]
        if self.zones is not None:
            self.zones.add_up(force)
        return np.abs(force)

    def ramp(self, progress: float) -> None:
        """Bring on the movement, or the dead load."""
        self.advance(self.settings.ramp_cycles, progress_to=progress, load_to=1.0)
        self.halt()

    def settle(self, increment: int) -> tuple[float, bool]:
        """Cycle until forces balance and jacks have made their deflection.

        Returns
        -------
        float, bool
            Unbalanced ratio, and whether a part came loose instead.
        """
        try:
            return self._settle(increment)
        finally:
            self.damping = self.settings.damping

    def _settle(self, increment: int) -> tuple[float, bool]:
        calm, spent, paced = 0, 0, 0
        while True:
            self.cycle(CHECK_EVERY)
            spent += CHECK_EVERY
            ratio = self.unbalanced()
            largest = float(ratio.max(initial=0.0))
            loose = self.watch(increment, spent)
            missing = self.missing_deflection()
            calm = calm + 1 if largest < self.settings.tolerance_used and missing < DEFLECTION_FOUND else 0
            if calm >= CALM_CHECKS:
                return largest, False
            if loose:
                return largest, True
            if self.pump is not None and spent - paced >= max(IMPATIENT, CLOSED * self.pump.slowness):
                paced = spent
                if largest >= self.settings.tolerance_used:
                    self.pump.slow_down()  # a wall that has become soft may swing with the control
            if spent % PATIENT == 0 and self.zones is not None and self._gives_way():
                self.damping = min(self.damping, max(0.5 * self.damping, LEAST_DAMPING))
            if spent >= self.settings.maximum_cycles:
                if self.energy() > ENERGY_MARGIN * self.work_of_loads() > 0.0:
                    self._diverged(increment, spent, "blocks swing with more energy than the loads can have given them")
                if self.falls():
                    return largest, True
                worst = block_of_dof(self.model, int(ratio.argmax()))
                shaken = self.settings.time_step_safety > SAFE and largest > 1.0
                short = "" if missing < DEFLECTION_FOUND else f", the deflection is {missing:.2g} m short"
                raise ConvergenceError(
                    f"increment {increment} did not settle within {spent} cycles: the unbalanced force is "
                    f"{largest:.2g} block weights at {describe_block(self.model, worst)}, allowed is "
                    f"{self.settings.tolerance_used:g}{short}. Raise solver.maximum_cycles or solver.tolerance"
                    + (", or lower solver.time_step_safety." if shaken else "."),
                    increment=increment,
                    block=worst,
                )

    def _gives_way(self) -> bool:
        """Tell whether any contact has broken or slid: joints that stay elastic ring down by themselves."""
        history = history_of(self.joints)
        return bool(history.cracked[self._bonded.ravel()].any() or history.slip.any())

    def falls(self) -> bool:
        """Tell whether a wall that does not settle is on its way down; it is left where that took it."""
        if self.pump is not None:
            return False
        pushed = Run(lasting_bonds(self.model), self.settings, settle_every=0)
        pushed.resume(*self.standing())
        if not goes_on(pushed):
            return False
        self.resume(*pushed.standing())
        return True

    def missing_deflection(self) -> float:
        """Return by how much (m) the deflection differs from that which the jacks are to make; 0 without."""
        return 0.0 if self.pump is None else abs(self.pump.missing(self.progress, self.motion.displacement))

    def watch(self, increment: int, spent: int) -> bool:
        """Tell whether a part has come loose.

        Raises
        ------
        DivergenceError
            If a block is beyond all bounds, or loose and faster than a fall explains.
        """
        path = np.abs(self.motion.displacement)
        if not (path < self.absurd_at).all():
            reason = "a displacement is beyond all bounds or no longer a number"
        elif not come_loose(self.model, self.motion.displacement, self.progress).any():
            return False
        elif self.energy() > ENERGY_MARGIN * self.work_of_loads() > 0.0:
            reason = "blocks fly off with more energy than the loads can have given them"
        else:
            return True
        self._diverged(increment, spent, reason)

    def _diverged(self, increment: int, spent: int, reason: str) -> NoReturn:
        path = np.abs(self.motion.displacement)
        path = np.where(np.isfinite(path), path, np.inf)[: 3 * self.model.n_blocks].reshape(-1, 3)
        block = int(np.hypot(path[:, 0], path[:, 1]).argmax())
        raise DivergenceError(
            f"diverged in increment {increment} after {spent} cycles: {reason}; furthest is "
            f"{describe_block(self.model, block)}. Lower solver.time_step_safety.",
            increment=increment,
            block=block,
        )

    def energy(self) -> float:
        """Return the kinetic energy (J, of the scaled masses)."""
        speed = self.motion.velocity[self.free]
        return 0.5 * float((speed**2 / self.motion.inverse_mass[self.free]).sum())

    def work_of_loads(self) -> float:
        """Return a bound of the work of dead and live load so far (J)."""
        load = np.abs(self.motion.load) + self.progress * np.abs(self.motion.live_load)
        if self.pump is not None:
            load += abs(self.pump.load) * np.abs(self.pump.jacks.push)
        return float((load * np.abs(self.motion.displacement)).sum())

    def note_broken(self, cracked: BoolArray | None = None) -> None:
        """Write down at which progress bonds broke that have broken since the last time.

        Parameters
        ----------
        cracked : array of bool (m, q), optional
            What has cracked; by default by the last cycle.
        """
        broken = take(self.joints.tiles["cracked"], self.joints.lane) != 0.0 if cracked is None else cracked
        self.broken_at[broken & self._bonded & np.isnan(self.broken_at)] = self.progress

    def report(self, number: int, ratio: float, cycles: int, collapsed: bool) -> Increment:
        """Take a picture of the present state."""
        # blocks have moved once more since the last cycle's joint law
        fields = fields_of(self.model, history_of(self.joints), self.motion.displacement, self.progress)
        history = fields.history
        self.note_broken(history.cracked)
        if self.sections is not None:
            response = section_response_of(self.model, self.sections.memory, self.motion.displacement)
            as_if_straight(self.model, response, fields.normal_stress, fields.shear_stress)
        weights = self.model.deflection
        return Increment(
            number=number,
            progress=self.progress,
            displacement=self.motion.displacement[: 3 * self.model.n_blocks].reshape(-1, 3).copy(),
            opening=fields.opening,
            slip=history.slip,
            normal_stress=fields.normal_stress,
            shear_stress=fields.shear_stress,
            state=contact_states(self.model, history),
            unbalanced_force_ratio=ratio,
            base_reaction=base_reaction(self.model, self.motion.force),
            cycles=cycles,
            collapsed=collapsed,
            support_force=support_force(self.model, self.motion.force),
            zones=None if self.zones is None else self.zones.picture(self.motion.displacement),
            deflection=np.nan if weights is None else float(weights @ self.motion.displacement),
            jack_load=np.nan if self.pump is None else self.pump.load,
            broken_at=self.broken_at.copy(),
        )

    def find_fall(self, stood: Standing, number: int) -> tuple[float, float]:
        """Return the progress at which the wall still stands, and that at which it falls, close together.

        Parameters
        ----------
        stood : tuple
            The state it stood in last; it fell on the way from there to the present progress.
        number : int
            Increment.
        """
        falls = self.progress
        while falls - stood.progress > FALL_FOUND:
            middle = 0.5 * (stood.progress + falls)
            self.resume(*stood)
            self.ramp(middle)
            try:
                _, fell = self.settle(number)
            except ConvergenceError:
                break  # so near its limit that it neither falls nor comes to rest
            if fell:
                falls = middle
            else:
                stood = self.standing()
        return stood.progress, falls

    def carried(self) -> float:
        """Return the load (N) at whose end the path ends; see ``damagepred.solvers.system.zero_support_load``."""
        if self.pump is None:
            return np.inf
        fields = fields_of(self.model, history_of(self.joints), self.motion.displacement, self.progress)
        return carried(self.model, self.pump.load, fields.normal_stress)

    def end_where_nothing_is_carried(self, stood: Standing, load: float, number: int, ratio: float) -> float:
        """Find the point between an earlier state and the present where the load that ends the path is just gone.

        Parameters
        ----------
        stood : tuple
            The earlier state.
        load : float
            What was carried there (N).
        number : int
            Increment.
        ratio : float
            Unbalanced ratio of the present state.

        Returns
        -------
        float
            Unbalanced ratio at the end.
        """
        search = Vanishing(
            stood.progress,
            load,
            self.progress,
            self.carried(),
            enough=NOTHING * float(np.abs(self.model.supports.load).sum()),
            close=CLOSE,
        )
        for _ in range(MOST_TRIES):
            if search.found:
                break
            at = search.between()
            self.resume(*stood)
            self.ramp(at)
            ratio, fell = self.settle(number)
            if fell:
                break
            if search.note(at, self.carried()):
                stood = self.standing()
        return ratio


def gentle(share: float) -> float:
    """Rise from 0 to 1 with no speed at either end."""
    return share * share * (3.0 - 2.0 * share)


def describe_block(model: Model, block: int) -> str:
    """Say where a block is, in words for a message."""
    course = int(model.blocks.course[block])
    where = f"x = {model.blocks.x[block]:.3g} m, y = {model.blocks.y[block]:.3g} m"
    return f"block {block} ({where}" + (f", course {course + 1})" if course >= 0 else ")")


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
        which a part of the wall came loose.

    Raises
    ------
    DivergenceError
        If blocks move as nothing could move them; the message names increment and block.
    ConvergenceError
        If an increment does not settle; the message names increment and block.
    """
    run = Run(while_loading(model), settings)
    sought = bool(model.supports.live_load.any())
    stops = run.pump is not None and bool(run.pump.jacks.stop)
    load = np.inf
    for number in range(increments + 1):
        before, stood = run.cycles, run.standing() if sought or stops else None
        if number > 0 or not (elastic_start and run.start_elastic()):
            run.ramp(number / increments)
        ratio, collapsed = run.settle(number)
        before_load, load = load, run.carried() if stops else np.inf
        ended = load <= 0.0 and not collapsed
        if ended and stood is not None and number > 0:
            ratio = run.end_where_nothing_is_carried(stood, before_load, number, ratio)
        increment = run.report(number, ratio, run.cycles - before, collapsed)
        if ended and run.pump is not None:
            yield replace(increment, ended=run.pump.jacks.stop)
            return
        if collapsed:
            standing, falls = (number - 1) / increments, number / increments
            if sought and stood is not None and number > 0:
                broken_at = run.broken_at.copy()
                standing, falls = run.find_fall(stood, number)
                # bonds that broke on the way beyond broke in the fall
                increment = replace(increment, broken_at=np.minimum(broken_at, falls))
            yield replace(increment, progress=falls, standing_progress=max(standing, 0.0), cycles=run.cycles - before)
            return
        yield increment
        if run.pump is not None:
            run.pump.look_ahead(run.progress)
            if number == 0:
                run.pump.control_load()
        if number == 0 and model.supports.after_load.any():
            held = held_after_load(model, run.motion.displacement)
            state = run.standing()
            broken_at = run.broken_at
            run = Run(held, settings)
            run.broken_at[:] = broken_at
            run.resume(*state)
