"""Damped time stepping: central differences with local damping and scaled masses (Cundall 1971, 1987).

The time step is 1 and the masses are scaled to it, each degree of freedom by its own stiffness (density scaling): a
static run needs no physical time. Displacements are small: geometry of the undeformed wall.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple, NoReturn

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.imposed_history import ImposedHistory
from damagepred.assembly.section import SectionMemory
from damagepred.errors import DivergenceError
from damagepred.kernels.explicit.cycle import run_cycles
from damagepred.runtime.time_limit import check_time
from damagepred.scene import Solver
from damagepred.solvers.explicit.jack_servo import Pump, PumpLine, PumpState
from damagepred.solvers.explicit.tiles import (
    history_of,
    move_ground,
    needs_full_law,
    pack_joints,
    pack_sections,
    set_history,
    softening_of,
    take,
)
from damagepred.solvers.state.wall_state import NO_ZONES, JointHistory, State, fields_of, without_bond
from damagepred.solvers.state.zone_history import ZoneField
from damagepred.solvers.system.collapse_criterion import detached_blocks
from damagepred.solvers.system.discrete_system import DiscreteSystem

SECTION_COMMIT_INTERVAL = 8
"""Cycles from one commit of the sections to the next."""
DIVERGENCE_ENERGY_RATIO = 10.0
"""Kinetic energy over the work of the loads that no falling block can have (1)."""

DRIFT_CYCLES = 100
"""Least cycles of a mean velocity: a short part of the slow oscillations that damping must oppose."""


class Checkpoint(NamedTuple):
    """State of a wall at rest, and of the pump of its jacks."""

    state: State
    pump: PumpState | None


class Motion(NamedTuple):
    """Motion of all degrees of freedom, arrays (size,); local damping opposes ``velocity`` less ``drift``."""

    load: FloatArray
    live_load: FloatArray
    inverse_mass: FloatArray
    drift: FloatArray
    velocity: FloatArray
    displacement: FloatArray
    force: FloatArray
    prescribed: IntArray
    prescribed_displacement: FloatArray
    start: FloatArray


def scaled_mass(model: Model, damping: float, safety: float, pump: Pump | None = None) -> FloatArray:
    """Masses (size,) (kg, kg m2) for which a time step of 1 is stable (density scaling), infinite where prescribed.

    Central differences are stable while omega^2 <= 4; local damping adds up to ``damping`` times the unbalanced force,
    which lowers the limit to 4 / (1 + damping). Gershgorin's circles of the intact wall bound omega^2.
    """
    system = DiscreteSystem.of(model)
    scale, stiffness = system.arms, abs(system.elastic_stiffness)
    # columns of prescribed degrees of freedom count: a margin beside supports
    row_sum = (stiffness @ (1.0 / scale)) / scale
    if pump is not None:
        row_sum += pump.row_sum(scale)
    mass = (1.0 + damping) / (4.0 * safety**2) * row_sum * scale**2
    mass[system.constrained_dofs] = np.inf
    # a block without any joint gets the median mass
    loose = mass == 0.0
    if loose.any():
        mass[loose] = np.median(mass[np.isfinite(mass) & ~loose]) if (np.isfinite(mass) & ~loose).any() else 1.0
    return mass


class DampedTimeStepping:
    """A wall in motion under damped time stepping."""

    def __init__(self, model: Model, settings: Solver, commit_sections: bool = True) -> None:
        self.model, self.settings = model, settings
        commit_interval = SECTION_COMMIT_INTERVAL if commit_sections else 0
        self.joints, self.sections = pack_joints(model), pack_sections(model, commit_interval)
        self.special = True if needs_full_law(model) else None
        self.softening = softening_of(model)
        self.zones = None if model.mesh is None else ZoneField(model)
        size = model.size
        self.system = DiscreteSystem.of(model)
        self.pump = None if model.jacks is None else Pump(model)
        mass = scaled_mass(model, settings.damping, settings.time_step_safety, self.pump)
        if self.pump is not None:
            self.pump.set_gain(mass, settings.damping)
        self.motion = Motion(
            load=self.system.dead_load.copy(),
            live_load=self.system.live_load.copy(),
            inverse_mass=1.0 / mass,
            drift=np.zeros(size),
            velocity=np.zeros(size),
            displacement=np.zeros(size),
            force=np.zeros(size),
            prescribed=model.supports.prescribed,
            prescribed_displacement=model.supports.prescribed_displacement,
            start=model.supports.start,
        )
        self.free, self.arm = self.system.free_dofs, self.system.arms
        self.load_share = self.load_factor = 0.0
        self.cycles, self.damping = 0, settings.damping
        self.broken_at = np.full(model.interfaces.contact_area.shape, np.nan)
        self.bonded = ~without_bond(model)

    def start_from_elastic_solution(self) -> bool:
        """Put the wall in its linear elastic equilibrium under dead load; False if a joint or zone yields there."""
        if self.sections is not None:  # even uncracked, their stiffness differs from their interfaces'
            return False
        displacement = self.system.elastic_displacement() if self.pump is None else self.pump.level
        if displacement is None:
            return False
        law = self.model.properties
        fields = fields_of(self.model, JointHistory.fresh(self.model), displacement, 0.0)
        # stresses differ from the elastic ones where a joint cracks or slips; a joint with a gap has none
        whole = (law.gap == 0.0)[:, None]
        if not (
            np.array_equal(fields.normal_stress, whole * law.normal_stiffness[:, None] * fields.opening)
            and np.array_equal(fields.shear_stress, whole * law.shear_stiffness[:, None] * fields.shear)
        ):
            return False
        if self.zones is not None and not self.zones.stays_elastic(displacement):
            return False
        self.motion.displacement[:] = displacement
        self.load_share = 1.0
        if self.pump is not None:
            self.pump.begin_level()
        return True

    def joint_history(self) -> JointHistory:
        """Copy of the history variables of the joints."""
        return history_of(self.joints)

    def checkpoint(self) -> Checkpoint:
        """Copy of the present state."""
        plastic = NO_ZONES if self.zones is None else self.zones.plastic()
        sections = SectionMemory.fresh(0) if self.sections is None else self.sections.memory.copy()
        state = State(
            load=self.load_share,
            load_factor=self.load_factor,
            displacement=self.motion.displacement.copy(),
            history=self.joint_history(),
            plastic=plastic,
            jack=0.0 if self.pump is None else self.pump.load,
            sections=sections,
        )
        return Checkpoint(state, None if self.pump is None else self.pump.checkpoint())

    def restore(self, state: State, pump: PumpState | None = None) -> None:
        """Restore a state at rest; without a pump state, the jacks do not change."""
        self.motion.displacement[:] = state.displacement
        if self.zones is not None:
            self.zones.set_plastic_strain(state.plastic)
        if self.pump is not None and pump is not None:
            self.pump.restore(pump)
        if self.sections is not None:
            for now, then in zip(self.sections.memory, state.sections, strict=True):
                now[:] = then
        set_history(self.joints, state.history)
        self.load_share, self.load_factor = state.load, state.load_factor
        self.broken_at[~state.history.cracked] = np.nan
        self.stop()

    def cycle(self, count: int) -> None:
        """Run cycles at constant movement and load."""
        self._cycle(count, self.load_share, self.load_factor, 0.0)

    def advance(self, cycles: int, load_factor_to: float, load_to: float) -> None:
        """Run cycles while movement and dead load are ramped smoothly to new values, in pieces of constant rate."""
        # damping opposes velocity beyond the drift, the mean velocity of the last cycles: a drag of constant sign would
        # let a moving wall ring (UDEC's combined damping has the same purpose)
        load_factor_from, load_from = self.load_factor, self.load_share
        stages = min(cycles, self.settings.ramp_pieces)
        since, before = self.cycles, self.motion.displacement.copy()
        for stage in range(stages):
            count = cycles * (stage + 1) // stages - cycles * stage // stages
            share = (stage + 1) / stages
            reached = share * share * (3.0 - 2.0 * share)  # zero slope at either end
            load_factor = load_factor_from + reached * (load_factor_to - load_factor_from)
            load = load_from + reached * (load_to - load_from)
            if self.pump is not None:
                self.pump.deliver((load - self.load_share) * self.pump.level_volume)  # compression of the line
            self._cycle(count, load, self.load_factor, (load_factor - self.load_factor) / count)
            if self.cycles - since >= DRIFT_CYCLES:
                moved = self.motion.displacement - before
                self.motion.drift[self.free] = moved[self.free] / (self.cycles - since)
                since, before = self.cycles, before + moved
            self.load_factor, self.load_share = load_factor, load
            self.record_broken_bonds()
            # blocks at rest gain at most the work of the dead load: more kinetic energy is divergence
            alone = load_from == load_factor_from == load_factor_to == 0.0
            if alone and self.has_too_much_energy():
                self.diverge(0, self.cycles, "blocks move with more energy than the loads can have given them")
        self.load_factor, self.load_share = load_factor_to, load_to
        self.motion.drift[:] = 0.0

    def stop(self) -> None:
        """Set all velocities to zero, so that no block overshoots a near equilibrium."""
        self.motion.velocity[:] = 0.0

    def _cycle(self, count: int, load_share: float, load_factor: float, step: float) -> None:
        check_time()
        motion, line = self.motion, None if self.pump is None else self.pump.line
        if not self.model.ground.proportional:
            move_ground(self.joints, self.model.ground, load_factor, load_factor + count * step)
        if isinstance(self.model.ground, ImposedHistory):
            motion, line = self._along(self.model.ground, load_factor)
        zones = self.zones and self.zones.packed
        run_cycles(
            self.joints,
            self.special,
            self.softening,
            zones,
            self.sections,
            line,
            motion,
            self.damping,
            load_share,
            load_factor,
            step,
            count,
        )
        self.cycles += count
        if self.zones is not None:
            self.zones.mean_motion(self.motion.displacement)

    def _along(self, history: ImposedHistory, coordinate: float) -> tuple[Motion, PumpLine | None]:
        """Motion and jacks in the step from a path coordinate on, with a load factor linear in the coordinate."""
        rate, supports = history.load_factor_rate(coordinate), self.model.supports
        start = history.load_factor_at(coordinate) - rate * coordinate
        motion = self.motion._replace(
            start=supports.displacement(start), prescribed_displacement=rate * supports.prescribed_displacement
        )
        return motion, None if self.pump is None else self.pump.along(start, rate)

    def unbalanced_force_ratio(self) -> FloatArray:
        """Unbalanced force (size,) in mean block weights, with resultants of deformable blocks; 0 where prescribed."""
        force = np.zeros_like(self.motion.force)
        force[self.free] = (self.motion.force / self.system.residual_scale)[self.free]
        if self.zones is not None:
            self.zones.add_resultants(force)
        return np.abs(force)

    def kinetic_energy(self) -> float:
        """Kinetic energy (J, of the scaled masses)."""
        speed = self.motion.velocity[self.free]
        return 0.5 * float((speed**2 / self.motion.inverse_mass[self.free]).sum())

    def has_too_much_energy(self) -> bool:
        """Whether the kinetic energy far exceeds the possible work of the loads."""
        return self.kinetic_energy() > DIVERGENCE_ENERGY_RATIO * self.work_of_loads() > 0.0

    def work_of_loads(self) -> float:
        """Upper bound of the work of dead and live load up to now (J)."""
        load = np.abs(self.motion.load) + self.load_factor * np.abs(self.motion.live_load)
        if self.pump is not None:
            load += abs(self.pump.load) * np.abs(self.pump.jacks.push)
        return float((load * np.abs(self.motion.displacement)).sum())

    def record_broken_bonds(self, cracked: BoolArray | None = None) -> None:
        """Record the load factor of bonds that broke since the last call; cracked contacts (m, q) may be given."""
        broken = take(self.joints.tiles["cracked"], self.joints.lane) != 0.0 if cracked is None else cracked
        self.broken_at[broken & self.bonded[:, None] & np.isnan(self.broken_at)] = self.load_factor

    def diverge(self, increment: int, spent: int, reason: str) -> NoReturn:
        """Raise a DivergenceError that names the block with the largest displacement."""
        path = np.abs(self.motion.displacement)
        path = np.where(np.isfinite(path), path, np.inf)[: 3 * self.model.n_blocks].reshape(-1, 3)
        block = int(np.hypot(path[:, 0], path[:, 1]).argmax())
        raise DivergenceError(
            f"diverged in increment {increment} after {spent} cycles: {reason}; furthest is "
            f"{self.model.describe_block(block)}. Lower solver.time_step_safety.",
            increment=increment,
            block=block,
        )


CYCLES_PER_HALF_ROUND = 250
"""Cycles of each half of a round; a mechanism moves farther in the second half."""
SPEED_FACTOR = 2.0
"""Factor on the speed after a round in which it does (1)."""
MAX_ROUNDS_NEAR_REST = 40
"""The same where the wall is nearly at rest."""
MAX_ROUNDS = 200
"""Rounds in all. A wall that stops now and then may creep on."""


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
    """Collapse-mechanism test: whether a part of a wall with lasting bonds is detached when its motion is accelerated.

    Slightly beyond its limit load a wall accelerates too slowly to detach in an affordable number of cycles. In a
    mechanism the unbalanced forces do positive work along the whole motion; otherwise a joint comes to resist. The test
    raises the speed until a part is detached or forces balance; a wall that collapses with its bonds does without them.
    """
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
