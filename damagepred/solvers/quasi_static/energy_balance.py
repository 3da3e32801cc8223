"""Energy balance of a path of equilibria."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.assembly.model import Ground
from damagepred.diagnostics import Energies, described
from damagepred.kernels.equilibrium.work import external_work
from damagepred.solvers.quasi_static.residual import JointEnergy
from damagepred.solvers.quasi_static.superelements import Superelements
from damagepred.solvers.state.wall_state import State
from damagepred.solvers.system.discrete_system import DiscreteSystem
from damagepred.solvers.system.footing_forces import section_energy


@dataclass
class EnergyBalance:
    """Energy balance of dead load and movement (J), summed along the path; copies share arrays, which never change."""

    residual: FloatArray  # (size,) Largest residual force of each degree of freedom (N, N m)
    external_work: float = 0.0  # work of dead load, live load and movement on the wall
    elastic_energy: float = 0.0  # stored in joints and zones
    friction_work: float = 0.0  # dissipated by sliding, and by softening bonds and cracking sections of the footing
    fracture_work: float = 0.0
    crushing_work: float = 0.0  # dissipated by crushed joints
    plastic_work: float = 0.0  # dissipated by zones that yield
    # released where bonds broke or the wall snapped through at constant movement; a real wall turns it into motion
    released_energy: float = 0.0
    snap_through_energy: float = 0.0  # part of the released energy: of snap-throughs
    energy_error: float = 0.0  # sum of the absolute errors of all other steps: it shrinks with their length
    # part of the error: work that cracking sections of the footing return under load, however short the step
    section_error: float = 0.0
    largest_work: float = 0.0  # largest absolute external work up to now
    residual_work: float = 0.0  # bound of the work of the residual in the last step

    def energies(self) -> Energies:
        """Return the balance as an increment reports it."""
        names = described(Energies)
        return Energies(**{name: value for name, value in vars(self).items() if name in names})

    def imbalance(self) -> float:
        """External work that is neither stored, nor dissipated, nor released (J)."""
        dissipated = self.fracture_work + self.friction_work + self.crushing_work + self.plastic_work
        return self.external_work - self.elastic_energy - dissipated - self.released_energy

    def count_as_snap_through(self, before: EnergyBalance) -> None:
        """Count the loss of energy in the last step as released: the wall has snapped through."""
        lost = self.imbalance() - before.imbalance()
        if lost > 0.0:  # a snap-through can only lose energy
            self.energy_error = before.energy_error
            self.released_energy += lost
            self.snap_through_energy += lost

    def begin(self, model: Model, state: State) -> None:
        """Start the balance at a state."""
        self.change_supports(model)
        self._mode_1_dissipation, ground = 0.0, model.ground.at(state.load_factor)
        self._keep(state, ground, Ground(*map(np.zeros_like, ground)), 0.0)
        self._section_work = self._largest_section_work = np.zeros(
            0 if model.sections is None else len(model.sections.interface)
        )
        self._sections: FloatArray | None = None

    def _keep(self, state: State, ground: Ground, on_ground: Ground, reaction: float) -> None:
        """Keep the last equilibrium, its ground, the forces on the ground, and the reaction of moving supports."""
        self._last = replace(state, displacement=state.displacement.copy()), ground, on_ground, reaction

    def change_supports(self, model: Model) -> None:
        """Continue with a model of the same wall with other supports."""
        system = DiscreteSystem.of(model)
        self._model, self._loads = model, (system.dead_load, system.live_load)

    def add_mode_1_dissipation(self, work: float) -> None:
        """Add the work (J) dissipated in tension by bonds that slip has broken; ``JointEnergy`` lacks it."""
        self._mode_1_dissipation += work

    def add_section_work(self, work: FloatArray) -> None:
        """Add the work (J) of a step on cracking sections; its largest sum is dissipated, for cracks do not heal."""
        returned = float((self._largest_section_work - self._section_work).sum())
        self._section_work = self._section_work + work
        self._largest_section_work = np.maximum(self._largest_section_work, self._section_work)
        self.section_error += abs(float((self._largest_section_work - self._section_work).sum()) - returned)

    def add(
        self,
        state: State,
        joints: JointEnergy,
        on_ground: Ground,
        plastic_work: float,
        reaction: float,
        unstable: bool,
        snapped: bool,
        superelements: Superelements | None,
        sections: FloatArray | None,
    ) -> None:
        """Add the step from the last equilibrium; ``unstable``: at constant load; ``snapped``: by snap-through."""
        model, ground = self._model, self._model.ground.at(state.load_factor)
        last, last_ground, last_on_ground, last_reaction = self._last
        stored, softened = float(joints.stored), float(joints.softened)
        friction, crushing = float(joints.friction), float(joints.crushing)
        if superelements is not None:
            stored += superelements.elastic_energy(state)
        if sections is not None:
            section_stored, section_work = section_energy(model, sections, self._sections)
            stored += section_stored
            self.add_section_work(section_work)
            self._sections = sections
            softened += float(self._largest_section_work.sum())
        self._mode_1_dissipation += float(joints.mode_1_dissipation)
        softened += self._mode_1_dissipation
        dead, live, by_ground, residual_work = external_work(
            self._loads,
            self.residual,
            last.displacement,
            state.displacement,
            last_ground,
            ground,
            last_on_ground,
            on_ground,
        )
        # a wall that snaps through does so under the load that it has reached
        before = (state.load, state.load_factor) if unstable else (last.load, last.load_factor)
        work = 0.5 * ((state.load + before[0]) * dead + (state.load_factor + before[1]) * live)
        now, then = (model.ground.load_factor_at(coordinate) for coordinate in (state.load_factor, last.load_factor))
        work += 0.5 * (reaction + last_reaction) * (now - then)
        if state.load_factor != last.load_factor:
            work += by_ground
        if model.jacks is not None:
            lifted = float(model.jacks.push @ (state.displacement - last.displacement))
            work += 0.5 * (state.jack + last.jack) * lifted
        missing = work - (stored - self.elastic_energy) - (softened - self.fracture_work)
        missing -= friction + crushing + plastic_work
        self.external_work += work
        self.largest_work = max(self.largest_work, abs(self.external_work))
        self.residual_work = residual_work
        self.elastic_energy, self.fracture_work = stored, softened
        self.friction_work += friction
        self.crushing_work += crushing
        self.plastic_work += plastic_work
        if unstable and missing > 0.0:
            self.released_energy += missing
            self.snap_through_energy += missing if snapped else 0.0
        else:  # a snap-through can only lose energy
            self.energy_error += abs(missing)
        self._keep(state, ground, on_ground, reaction)
