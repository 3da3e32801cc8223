"""Energy balance of a run in physical time.

With the kinetic energy m v(n - 1/2) v(n + 1/2) / 2, central differences obey exactly

    change of kinetic energy = sum over the steps of (F(n) + F(n + 1)) (x(n + 1) - x(n)) / 2,

so all works use the trapezoidal rule, and elastic joints balance to rounding. The rest is the error of the time step,
from rotation and from contacts that close or open within a step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.diagnostics import Energies
from damagepred.kernels.dynamics.contact import DASHPOT, FRACTURE, FRICTION, RELEASED
from damagepred.kernels.dynamics.motion import BOUNDARY, DAMPING, LIVE
from damagepred.solvers.dynamics.body_arrays import BodyArrays
from damagepred.solvers.dynamics.body_motion import BlockStrains, Motion, base_velocity, mass_of, moving_parts

DIVERGENCE_ENERGY_RATIO = 10.0
"""Energy over what there was and was put in, from which a run has diverged (1)."""
DIVERGENCE_ENERGY_ERROR = 0.5
"""Created energy over the largest energy reached, from which a run has diverged (1). The longest permitted steps create
some where blocks bounce without damping."""


class EnergyTerms(NamedTuple):
    """Energy terms of contacts and bodies summed by kernels (J)."""

    joint_terms: FloatArray
    body_terms: FloatArray


class EnergyBalance:
    """Energy balance of one run."""

    def __init__(
        self,
        scene: BodyArrays,
        motion: Motion,
        damping: tuple[float, float, float, float],
        time_step: float,
        terms: EnergyTerms,
    ) -> None:
        self._scene, self._motion, self.terms = scene, motion, terms
        self._damping, self._step = damping, time_step
        self._moving = moving_parts(motion)
        self._start = [body.displacement.copy() for body in self._moving]
        self._dead = [body.load.copy() for body in self._moving]
        self._kinetic, self._damped, self._pulled = self._half_steps()
        self._elastic = self.elastic_energy()
        self._input = self._largest = 0.0

    def _half_steps(self) -> tuple[float, float, float]:
        """Kinetic energy, and work of damping and of the base by damping in the last half step (J)."""
        parts = np.array([self._half_step(body, base_velocity(body, self._motion)) for body in self._moving])
        kinetic, damped, pulled = parts.sum(axis=0)
        return float(kinetic), float(damped), float(pulled)

    def _half_step(self, body: Motion | BlockStrains, base: FloatArray) -> tuple[float, float, float]:
        local, viscous, _, _ = self._damping
        before, inverse, mass = body.velocity, body.inverse_mass, mass_of(body)
        force = (body.force + body.load) * (inverse > 0)
        drag = local * np.abs(force) * np.sign(before)
        half = 0.5 * viscous * self._step
        push = self._step * (force - drag) * inverse
        after = (before * (1.0 - half) + 2.0 * half * base + push) / (1.0 + half)
        dashpot = viscous * mass * (0.5 * (before + after) - base)
        kinetic = 0.5 * float((mass * before * after).sum())
        half_step = 0.5 * self._step
        damped = half_step * float((drag * before + dashpot * (before - base)).sum())
        return kinetic, damped, -half_step * float((dashpot * base).sum())

    def elastic_energy(self) -> float:
        """Elastic energy of joints and elastic blocks (J)."""
        points = self._scene.points
        joint = self._scene.laws[points["law"]]
        sigma = points["sigma"]
        # a softening bond unloads to the origin
        softened = (sigma > 0) & (points["cracked"] != 0) & (joint["critical_opening"] > 0)
        opening = np.where(softened, points["opening"] - points["dilatant_opening"], sigma / joint["normal_stiffness"])
        joints = 0.5 * float(
            (points["area"] * (sigma * opening + points["tau"] ** 2 * joint["shear_compliance"])).sum()
        )
        strains = self._motion.strains
        return joints if strains is None else joints + 0.5 * float((strains.stiffness * strains.displacement**2).sum())

    def balance(self) -> Energies:
        """Present balance."""
        joint_terms, body_terms = self.terms
        kinetic, damped, pulled = self._half_steps()
        elastic = self.elastic_energy()
        boundary = float(body_terms[BOUNDARY]) + pulled - self._pulled
        ways = [body.displacement - start for body, start in zip(self._moving, self._start)]
        dead = sum(float((load * way).sum()) for load, way in zip(self._dead, ways))
        external = boundary + dead + float(body_terms[LIVE])
        damping = float(body_terms[DAMPING] + joint_terms[DASHPOT]) + damped - self._damped
        friction, fracture, released = (float(joint_terms[k]) for k in (FRICTION, FRACTURE, RELEASED))
        if self._motion.strains is not None:
            damping += float(self._motion.strains.work[0])
        change = kinetic - self._kinetic + elastic - self._elastic
        return Energies(
            kinetic_energy=kinetic,
            elastic_energy=elastic,
            external_work=external,
            boundary_work=boundary,
            friction_work=friction,
            fracture_work=fracture,
            plastic_work=0.0,
            released_energy=released,
            damping_work=damping,
            energy_error=external - change - friction - fracture - released - damping,
        )

    def diverged(self) -> bool:
        """Whether the energy, or its error, is too large for a stable run."""
        now = self.balance()
        energy = now.kinetic_energy + now.elastic_energy
        self._input = max(self._input, abs(self._kinetic) + self._elastic + max(now.external_work, 0.0))
        self._largest = max(self._largest, self._input, energy)
        possible = energy <= DIVERGENCE_ENERGY_RATIO * self._input + 1e-300
        return not (possible and -now.energy_error <= DIVERGENCE_ENERGY_ERROR * self._largest + 1e-300)
