"""Energy balance of a path, and how well its equilibria obey the law of the joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.model import Ground
from damagepred.kernels.interface.checks import joint_law_violation_of
from damagepred.kernels.interface.energy import energy
from damagepred.kernels.joint.return_mapping import ReturnMapping
from damagepred.solvers.quasi_static.equilibrium import State
from damagepred.solvers.quasi_static.superelements import Superelements
from damagepred.solvers.system.discrete_system import DiscreteSystem
from damagepred.solvers.system.footing_forces import section_energy, section_response_of


class Spent(NamedTuple):
    """Work taken in a step (J): by friction, by joints that are crushed, by zones that yield."""

    friction: float
    crushing: float
    yielding: float


@dataclass
class WorkBalance:
    """Where the work of dead load and movement has gone, all in J, summed along the path.

    Attributes
    ----------
    residual : array (size,)
        Largest residual force of each degree of freedom (N, N m).
    return_mapping : ReturnMapping
        Parameters of the joint law.
    external_work : float
        Work of dead load, live load and movement on the wall.
    elastic_energy : float
        Stored in joints and zones.
    friction_work, fracture_work : float
        Taken by sliding, and by softening bonds and cracking sections of the footing.
    crushing_work : float
        Taken by joints that are crushed.
    plastic_work : float
        Taken by zones that yield.
    released_energy : float
        Set free where bonds broke or the wall gave way at standing movement; a real wall turns it into motion.
    snap_through_energy : float
        Part of that: set free where the wall moved by itself to an equilibrium that was not near.
    energy_error : float
        What does not balance in the steps between, added up without sign: their length is what makes it.
    section_error : float
        Part of that: what cracking sections of the footing give back under load, which no shorter step makes less.
    largest_work : float
        Largest external work so far, without sign.
    residual_work : float
        What it may have worked in the last step (J).
    """

    residual: FloatArray
    return_mapping: ReturnMapping
    external_work: float = 0.0
    elastic_energy: float = 0.0
    friction_work: float = 0.0
    fracture_work: float = 0.0
    crushing_work: float = 0.0
    plastic_work: float = 0.0
    released_energy: float = 0.0
    snap_through_energy: float = 0.0
    energy_error: float = 0.0
    section_error: float = 0.0
    largest_work: float = 0.0
    residual_work: float = 0.0

    def begin(self, model: Model, state: State) -> None:
        """Start the balance at a state.

        Parameters
        ----------
        model : Model
            The wall.
        state : State
            Start of the path.
        """
        self.go_on(model)
        self._keep(state)
        self._reaction = self._mode_1_dissipation = 0.0
        self._cracked = self._most_cracked = np.zeros(0 if model.sections is None else len(model.sections.interface))
        self._ground = model.ground.at(state.load_factor)
        self._on_ground = Ground(np.zeros_like(self._ground.normal), np.zeros_like(self._ground.shear))
        self._sections: FloatArray | None = None

    def go_on(self, model: Model) -> None:
        """Go on with a model of the same wall that is held otherwise."""
        system = DiscreteSystem.of(model)
        self._model, self._loads = model, (system.dead_load, system.live_load)

    def softened(self, work: float) -> None:
        """Count the work (J) that softening took of bonds whose rest slip has broken; the rest is set free."""
        self._mode_1_dissipation += work

    def crack(self, work: FloatArray) -> None:
        """Count the work (J) that a step took of each cracking section; what cracked does not heal."""
        given_back = float((self._most_cracked - self._cracked).sum())
        self._cracked = self._cracked + work
        self._most_cracked = np.maximum(self._most_cracked, self._cracked)
        self.section_error += abs(float((self._most_cracked - self._cracked).sum()) - given_back)

    def _keep(self, state: State) -> None:
        self._load, self._load_factor, self._displacement = state.load, state.load_factor, state.displacement.copy()
        self._jack = state.jack

    def add(
        self,
        state: State,
        spent: Spent,
        mode_1_dissipation: float,
        reaction: float,
        unstable: bool,
        snapped: bool,
        superelements: Superelements | None,
        beyond: tuple[IntArray, float],
    ) -> None:
        """Add the step to a new equilibrium.

        Parameters
        ----------
        state : State
            With the memory of the new equilibrium.
        spent : Spent
            Work taken in the step.
        mode_1_dissipation : float
            Work taken by the tension of bonds that wear by slip (J), which the energy of the joints does not tell.
        reaction : float
            Work per load factor of what moves the supports in the new equilibrium (J).
        unstable : bool
            Whether the step broke bonds at standing movement, or led to an equilibrium that was not near.
        snapped : bool
            Whether it led to an equilibrium that was not near.
        superelements : Superelements or None
            Deformable blocks.
        beyond : (array of int, float)
            Interfaces to look at, and what all others store; see ``Equilibrium.condensed_energy``.
        """
        model, (listed, elsewhere) = self._model, beyond
        ground = model.ground.at(state.load_factor)
        on_ground = Ground(np.zeros_like(ground.normal), np.zeros_like(ground.shear))
        stored, softened = energy(
            listed,
            model.interfaces,
            model.properties,
            self.return_mapping,
            ground,
            state.history,
            state.displacement,
            on_ground,
        )
        stored += elsewhere
        if superelements is not None:
            stored += superelements.elastic_energy(state.displacement, state.plastic)
        if model.sections is not None:
            response = section_response_of(model, state.sections, state.displacement)
            held, cracked = section_energy(model, response, self._sections)
            stored += held
            self.crack(cracked)
            self._sections = response
        softened += float(self._most_cracked.sum())
        self._mode_1_dissipation += mode_1_dissipation
        softened += self._mode_1_dissipation
        moved = state.displacement - self._displacement
        # a wall that gives way does so under the load that it has come to
        before = (state.load, state.load_factor) if unstable else (self._load, self._load_factor)
        dead = 0.5 * (state.load + before[0]) * float(self._loads[0] @ moved)
        live = 0.5 * (state.load_factor + before[1]) * float(self._loads[1] @ moved)
        work = dead + live + 0.5 * (reaction + self._reaction) * (state.load_factor - self._load_factor)
        work += _trapezoidal((self._ground, ground), (self._on_ground, on_ground))
        if model.jacks is not None:
            work += 0.5 * (state.jack + self._jack) * float(model.jacks.push @ moved)
        missing = work - (stored - self.elastic_energy) - (softened - self.fracture_work) - sum(spent)
        self.external_work += work
        self.largest_work = max(self.largest_work, abs(self.external_work))
        self.residual_work = float(self.residual @ np.abs(moved))
        self.elastic_energy, self.fracture_work = stored, softened
        self.friction_work += spent.friction
        self.crushing_work += spent.crushing
        self.plastic_work += spent.yielding
        if unstable and missing > 0.0:
            self.released_energy += missing
            self.snap_through_energy += missing if snapped else 0.0
        else:  # what gives way can only lose energy
            self.energy_error += abs(missing)
        self._keep(state)
        self._reaction, self._ground, self._on_ground = reaction, ground, on_ground


def _trapezoidal(ground: tuple[Ground, Ground], force: tuple[Ground, Ground]) -> float:
    """Return the work (J) of forces (N) on the ground between two states (m), by the trapezoidal rule."""
    (from_n, from_s), (to_n, to_s) = ground
    (before_n, before_s), (after_n, after_s) = force
    along_normal = (before_n + after_n) * (to_n - from_n)
    return 0.5 * float(along_normal.sum() + ((before_s + after_s) * (to_s - from_s)).sum())


def law_violation(model: Model, state: State, sigma: FloatArray, tau: FloatArray) -> float:
    """Return by how much the stresses exceed what the joints carry (Pa), at most; 0 if they obey the law.

    Parameters
    ----------
    model : Model
        m interfaces with q contacts.
    state : State
        With the memory of this equilibrium.
    sigma, tau : array (m, q)
        Normal stress, tension positive, and shear stress (Pa).
    """
    return float(joint_law_violation_of(model.properties, state.history.cracked, state.history.kappa, sigma, tau))
