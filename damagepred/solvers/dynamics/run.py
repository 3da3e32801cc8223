"""A run in physical time: steps between outputs, the search for new contacts, and results."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.diagnostics import Counters, Residuals
from damagepred.enumerations import ContactState
from damagepred.errors import DivergenceError, InputError
from damagepred.kernels.dynamics.contact import BONDED, JOINT_TERMS
from damagepred.kernels.dynamics.cycle import first_forces, run_steps
from damagepred.kernels.dynamics.motion import BODY_TERMS
from damagepred.kernels.joint.softening import Softening
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.runtime.time_limit import check_time
from damagepred.scene import Solver
from damagepred.scene.dynamics import Dynamics
from damagepred.solvers.dynamics.base_motion import base_displacement
from damagepred.solvers.dynamics.body_arrays import body_arrays
from damagepred.solvers.dynamics.body_motion import (
    base_velocity,
    block_strains,
    mass_of,
    motion_of,
    moving_parts,
    update_poses,
)
from damagepred.solvers.dynamics.contact_search import NeighbourSearch, world_coordinates
from damagepred.solvers.dynamics.energy_balance import EnergyBalance, EnergyTerms
from damagepred.solvers.dynamics.time_step import contact_damping, highest_frequency, time_step
from damagepred.solvers.explicit.tiles import needs_full_law, softening_of
from damagepred.solvers.state.increment import FootingResults, Increment, MotionResults
from damagepred.solvers.state.wall_state import JointHistory, State
from damagepred.solvers.system.collapse_criterion import detached_blocks
from damagepred.solvers.system.discrete_system import DiscreteSystem

SKIN = 0.1
"""Distance within which blocks are neighbours of a point, over the size of the smallest block (1)."""
SEARCH_DISTANCE = 0.4
"""Movement of a point that triggers the next search, over that distance (1). Below one half, two points that approach
each other have not met before."""
POINT_STEPS_PER_CHECK = 5_000_000
"""Points times steps between two checks for an interruption and for finite displacements."""
OUTPUTS_AT_REST = 3
"""Outputs in a row with a speed below ``dynamics.rest_speed`` that end a run."""


class Imposed(NamedTuple):
    """Points on the ground (i,), and displacement under them per load factor (m)."""

    point: IntArray
    normal: FloatArray
    shear: FloatArray


class Timing(NamedTuple):
    """Time between outputs (s), steps in it, and their length (s)."""

    interval: float
    steps: int
    step: float


class DynamicRun:
    """Run in physical time, iterable over its outputs."""

    @one_blas_thread()
    def __init__(self, model: Model, dynamics: Dynamics, initial: State | None = None) -> None:
        self.model, self.dynamics, self.system = model, dynamics, DiscreteSystem.of(model)
        origin = np.array([model.blocks.x.mean(), model.blocks.y.mean()])
        self.bodies = body_arrays(model, origin)
        strains = block_strains(model, self.bodies)
        self.motion = motion_of(model, origin)._replace(strains=strains)
        points = self.bodies.points
        count = 2 * model.n_contacts
        self._bonded_at_start = points[:count].copy(), None if strains is None else strains.target[:count].copy()
        self.frequency = highest_frequency(model, self.bodies, self.motion.inverse_mass, strains)
        highest = self.frequency.touched if dynamics.new_contacts else self.frequency.intact
        interval = dynamics.run_duration / dynamics.outputs
        dry = bool((model.properties.tensile_strength <= 0.0).any())
        contacts = contact_damping(model, dynamics)
        longest = time_step(highest, dynamics, dry, contacts)
        steps = max(1, int(np.ceil(interval / longest - 1e-9)))
        self.timing = Timing(interval, steps, interval / steps)
        local = dynamics.local_damping if dynamics.damping == "local" else 0.0
        self.damping = (local, dynamics.mass_damping, dynamics.stiffness_damping, contacts)
        # only two variants of the joint law, plain and full, because of their compile time
        softening = softening_of(model)
        special = needs_full_law(model) or softening is not None
        self.law = (True, softening or Softening(None)) if special else (None, softening)
        self.ground_rate, self.has_live_load = _ground_rate(model), bool(self.system.live_load.any())
        dynamics.check_base()
        self.base = base_displacement(dynamics.base)
        skin = SKIN * float(np.sqrt(model.blocks.area.min()))
        self.search = NeighbourSearch(
            self.bodies, self.motion, skin, SEARCH_DISTANCE * skin if dynamics.new_contacts else 0.0
        )
        self.steps = self.output = 0
        self._begin(initial)
        terms = EnergyTerms(np.zeros(JOINT_TERMS), np.zeros(BODY_TERMS))
        self.energy = EnergyBalance(self.bodies, self.motion, self.damping, self.timing.step, terms)

    def _begin(self, initial: State | None) -> None:
        motion, points = self.motion, self.bodies.points
        self.begins_in_equilibrium = initial is not None
        if initial is not None:
            motion.displacement[:] = initial.displacement[: motion.displacement.size].reshape(-1, 3)
            m, q = self.model.interfaces.contact_area.shape
            for name in JointHistory._fields:
                remembered = getattr(initial.history, name)[:, None, :]
                points[name][: 2 * m * q] = np.repeat(remembered, 2, axis=1).ravel()
            if motion.strains is not None:
                motion.strains.displacement[:-1] = initial.displacement[self.system.strain_dofs].reshape(-1, 2)
        motion.held_start[:] = motion.displacement.ravel()[motion.held]
        update_poses(motion)
        self.search.update()
        # opening and shear of the step before
        opening, shear = self._bonded_kinematics()
        points["opening"][: opening.size], points["shear"][: shear.size] = opening.ravel(), shear.ravel()
        search = self.dynamics.new_contacts
        still = EnergyTerms(np.zeros(JOINT_TERMS), np.zeros(BODY_TERMS))
        first_forces(self.bodies, self.search.neighbours, motion, *self.law, search, still)
        if self.model.initial_velocity is not None:
            motion.velocity[:-1] = self.model.initial_velocity
        acting = motion.force + motion.load
        motion.velocity[:] -= 0.5 * self.timing.step * acting * motion.inverse_mass
        strains = motion.strains
        if strains is not None:
            strains.velocity[:] -= 0.5 * self.timing.step * strains.force * strains.inverse_mass

    @property
    def time(self) -> float:
        """Physical time (s)."""
        return self.output * self.timing.interval

    def load_factor(self, time: FloatArray) -> FloatArray:
        """Load factor of the movement at times (s): quintic, with zero speed and acceleration at both ends."""
        if self.dynamics.movement_time is None:
            return np.zeros_like(time)
        share = np.clip(time / self.dynamics.movement_time, 0.0, 1.0)
        return np.asarray(share**3 * (10.0 - 15.0 * share + 6.0 * share**2))

    def __iter__(self) -> Iterator[Increment]:
        """Yield the state at the start and after each interval."""
        slow = 0
        yield self.report(0)
        while self.output < self.dynamics.outputs:
            before = self.steps
            self.advance()
            yield self.report(self.steps - before)
            still = self.speed() < self.dynamics.rest_speed and self.time >= self.dynamics.loading_end
            slow = slow + 1 if still else 0
            if self.dynamics.stop_at_rest and slow >= OUTPUTS_AT_REST:
                return

    @one_blas_thread()
    def advance(self) -> None:
        """Run to the next output."""
        count = self.timing.steps
        time: FloatArray = self.time + self.timing.step * np.arange(count + 1, dtype=np.float64)
        loading = np.column_stack((self.base(time), self.load_factor(time)))
        stretch = max(1, POINT_STEPS_PER_CHECK // len(self.bodies.points))
        done = 0
        ground_rate, line_end = self.ground_rate, 0
        while done < count:
            check_time()
            if done == line_end:
                ground_rate, line_end = self._next_ground_rate(loading[:, 2], done)
            reached = run_steps(
                self.bodies,
                self.search.neighbours,
                self.motion,
                *self.law,
                ground_rate,
                self.has_live_load,
                loading,
                done,
                min(line_end, done + stretch),
                self.damping,
                self.timing.step,
                self.search.searched_at,
                self.search.distance,
                self.energy.terms,
            )
            self.steps += reached - done
            done = reached
            if not all(np.isfinite(body.displacement).all() for body in moving_parts(self.motion)):
                self._diverged(time[done])
            self.search.update_if_moved()
        self.output += 1
        if self.energy.diverged():
            self._diverged(self.time)

    def _next_ground_rate(self, load_factor: FloatArray, first: int) -> tuple[Imposed, int]:
        """Rate of the ground movement from a step on, and the end of its constant piece."""
        last, ground = len(load_factor) - 1, self.model.ground
        if ground.proportional or load_factor[last] == load_factor[first]:
            return self.ground_rate, last
        before = float(load_factor[first])
        end = int(np.searchsorted(load_factor, before + 1.0 / self.dynamics.ground_pieces, side="right"))
        end = min(max(end, first + 1), last)
        after = float(load_factor[end])
        if after == before:
            return self.ground_rate, end
        lines = (
            np.repeat((final - first_state)[:, None, :], 2, axis=1).ravel() / (after - before)
            for first_state, final in zip(ground.at(before), ground.at(after), strict=True)
        )
        return Imposed(self.ground_rate.point, *lines), end

    def _diverged(self, time: float) -> None:
        speed = np.hypot(*self.motion.velocity[:-1, :2].T)
        block = int(np.where(np.isfinite(speed), speed, np.inf).argmax())
        raise DivergenceError(
            f"diverged at {time:.4g} s (step {self.steps}): blocks move with more energy than was put in; fastest is "
            f"{self.model.describe_block(block)}. Lower dynamics.time_step_safety.",
            increment=self.output,
            block=block,
        )

    def speed(self) -> float:
        """Root mean square speed relative to the base, weighted by mass (m/s)."""
        total, energy = 0.0, 0.0
        for body in moving_parts(self.motion):
            mass = mass_of(body)
            energy += float((mass * (body.velocity - base_velocity(body, self.motion)) ** 2).sum())
            total += 0.0 if body is self.motion.strains else float(mass[:, :2].sum())
        return float(np.sqrt(energy / total)) if total > 0 else 0.0

    def attributes(self) -> dict[str, object]:
        """Attributes of the run for archives."""
        run, end = self.dynamics.run_duration, self.dynamics.loading_end
        unfinished = {"loading_not_run": f"from {run:g} to {end:g} s"} if end > run * (1.0 + 1e-9) else {}
        return unfinished | {
            "time_step": self.timing.step,
            "highest_frequency": self.frequency.intact,
            "highest_frequency_bound": self.frequency.touched,
            "begins_in_equilibrium": self.begins_in_equilibrium,
            "contact_points": len(self.bodies.points),
            "impacts": impacts(self.dynamics),
        }

    # -- reports ----------------------------------------------------------------------------------------------------

    def _bonded_kinematics(self) -> tuple[FloatArray, FloatArray]:
        """Opening and shear (m) of all contacts against their first edges (m, 2, q)."""
        m, q = self.model.interfaces.contact_area.shape
        (home, target), pose = self._bonded_at_start, self.motion.pose
        home_x, home_y, strains = home["x"], home["y"], self.motion.strains
        if strains is not None:
            now, count = strains.displacement[strains.number], len(home)
            strained = np.einsum("pik,pk->pi", strains.own[:count], now[home["body"]])
            home_x, home_y = home_x + strained[:, 0], home_y + strained[:, 1]
        position = world_coordinates(pose, home["body"], home_x, home_y)
        edge = self.bodies.edges[home["target"]]
        b = edge["body"]
        x, y = position[:, 0] - pose[b, 0], position[:, 1] - pose[b, 1]
        local_x = pose[b, 2] * x + pose[b, 3] * y - edge["x"]
        local_y = pose[b, 2] * y - pose[b, 3] * x - edge["y"]
        opening = edge["along_x"] * local_y - edge["along_y"] * local_x + home["offset"]
        shear = edge["along_x"] * local_x + edge["along_y"] * local_y - home["anchor"]
        if strains is not None and target is not None:
            away = np.einsum("pik,pk->pi", target, now[b])
            opening, shear = opening - away[:, 1], shear - away[:, 0]
        return opening.reshape(m, 2, q), shear.reshape(m, 2, q)

    def report(self, steps: int) -> Increment:
        """Present state as an increment."""
        model, motion = self.model, self.motion
        m, q = model.interfaces.contact_area.shape
        points = self.bodies.points[: 2 * m * q].reshape(m, 2, q)
        bonded = points["status"] == BONDED
        opening, shear = self._bonded_kinematics()
        load_factor = float(self.load_factor(np.array([self.time]))[0])
        ground = model.ground.at(load_factor)
        first = m - len(ground.normal)
        opening[first:] -= ground.normal[:, None, :]
        shear[first:] -= ground.shear[:, None, :]
        slip = np.where(bonded, points["slip"], shear).mean(axis=1)
        cracked = ((points["cracked"] != 0) | ~bonded).any(axis=1)
        slipped = np.where(slip != 0.0, ContactState.SLIPPING, ContactState.INTACT)
        moved = motion.displacement.copy()
        moved[:, :2] -= motion.displacement[-1, :2]
        loose = detached_blocks(model, moved.ravel(), load_factor)
        strains = motion.strains
        displacement = self._all_dofs(motion.displacement, None if strains is None else strains.displacement)
        acting = self._all_dofs(motion.force + motion.load, None if strains is None else strains.force)
        unbalanced = np.abs(acting / self.system.residual_scale)[self.system.free_dofs]
        return Increment(
            number=self.output,
            load_factor=load_factor,
            displacement=moved[:-1],
            strain=self.system.strains(displacement),
            opening=opening.mean(axis=1),
            slip=slip,
            normal_stress=np.where(bonded, points["sigma"], 0.0).mean(axis=1),
            shear_stress=np.where(bonded, points["tau"], 0.0).mean(axis=1),
            state=np.where(cracked, ContactState.CRACKED, slipped).astype(np.int8),
            residuals=Residuals(unbalanced_force_ratio=float(unbalanced.max(initial=0.0))),
            base_reaction=self.system.base_reaction(acting),
            counters=Counters(cycles=steps),
            support_force=self.system.support_force(acting),
            collapsed=bool(loose.any()),
            motion=MotionResults(
                self.time, (float(motion.displacement[-1, 0]), float(motion.displacement[-1, 1])), self.search.count
            ),
            footing=FootingResults(np.nan if model.deflection is None else float(model.deflection @ displacement)),
            energy=self.energy.balance(),
        )

    def _all_dofs(self, blocks: FloatArray, strains: FloatArray | None) -> FloatArray:
        """Values of blocks (n + 1, 3) and strains (d + 1, 2) as all degrees of freedom."""
        values = np.zeros(self.model.size)
        values[: blocks.size] = blocks.ravel()
        if strains is not None:
            values[self.system.strain_dofs] = strains[:-1].ravel()
        return values


def impacts(dynamics: Dynamics) -> str:
    """Sentence on the energy of impacts."""
    share = dynamics.contact_damping
    if share > 0.0:
        return f"damped: dynamics.contact_damping = {share:g} of critical"
    more = "" if dynamics.damping == "none" else f", except by damping = '{dynamics.damping}'"
    return f"elastic: no energy is lost where blocks strike (dynamics.contact_damping = 0){more}"


def _ground_rate(model: Model) -> Imposed:
    """Rate of the ground movement under moved points."""
    m, q = model.interfaces.contact_area.shape
    ground = model.ground.full
    first = m - len(ground.normal)
    normal, shear = (np.repeat(values[:, None, :], 2, axis=1).ravel() for values in ground)
    moves = (normal != 0) | (shear != 0) | (not model.ground.proportional)
    return Imposed((2 * first * q + np.arange(len(normal)))[moves], normal[moves], shear[moves])


def require_supported(model: Model, settings: Solver, dynamics: Dynamics) -> None:
    """Refuse scenes that a run in physical time does not support."""
    if model.mesh is not None:
        raise InputError("zone_size: a run in time has no zones; leave it out, or the run in time.")
    if model.is_strained:
        raise InputError("strain: a run in time has none; leave out the strain of blocks, or the run in time.")
    if model.sections is not None:
        raise InputError(
            "footing.concrete: in a run in time the footing stays elastic and does not crack; leave out "
            "[footing.concrete] and give footing.elastic_modulus, or leave out [dynamics]."
        )
    if settings.quadrature == "midpoint" and dynamics.new_contacts:
        raise InputError(
            "solver.quadrature = 'midpoint': leaves the corners of blocks without a contact, so they could pass "
            "through each other; take 'lobatto', or dynamics.new_contacts = false."
        )
