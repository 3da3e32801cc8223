"""A million steps: drift of energy and momentum, and of a wall at rest."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from damagepred.assembly import Assembly, Model
from damagepred.assembly.assembly import rectangle
from damagepred.pipeline import dynamic_run
from damagepred.scene import Dynamics, Joint, Solver
from damagepred.solvers.driver import Outcome
from damagepred.solvers.dynamics.time_step import highest_frequency, time_step
from damagepred.solvers.explicit.stepper import ExplicitStepper
from studies.benchmarks.stress.case import IN_TIME, Case, Check, Found

STEPS = 1_000_000
BOND = Joint(tensile_strength=1e15, cohesion=1e15)
DRY = Joint(tensile_strength=0.0, cohesion=0.0, friction=0.6)


def steps_of(steps: int, **more: Any) -> Callable[[Model], Dynamics]:
    """Return a run in time of a given number of steps."""

    def dynamics(model: Model) -> Dynamics:
        once = Dynamics(duration=1.0, outputs=1, **more)
        run = dynamic_run(model, Solver(), replace(once, duration=1e-6))
        highest = highest_frequency(model, run.bodies, run.motion.inverse_mass, run.options, run.grid)
        frequency = highest.touched if once.new_contacts else highest.intact
        dry = bool((model.properties.tensile_strength <= 0.0).any())
        return replace(once, duration=steps * 0.999 * time_step(frequency, once, dry), outputs=20)

    return dynamics


def pair(deformable: bool) -> Assembly:
    """Return two bonded blocks in free flight with rotation, without gravity."""
    made = Assembly(gravity=(0.0, 0.0), joint=BOND)
    for i in range(2):
        block = made.add_block(rectangle(0.0, 0.1 * i, 0.24, 0.1 * (i + 1)), zone_size=0.24 * deformable)
        # as one body, about the joint's middle
        made.set_velocity(block, x=0.3 - 20.0 * (0.1 * i - 0.05), y=0.2, rotation=20.0)
    return made


def ringing(deformable: bool) -> Assembly:
    """Return a bonded stack on the ground with an initial velocity of its top."""
    made = Assembly(joint=BOND)
    for i in range(5):
        made.add_block(rectangle(0.0, 0.1 * i, 0.24, 0.1 * (i + 1)), zone_size=0.24 * deformable)
    made.rest_on_ground([0])
    made.set_velocity(4, x=0.01, y=0.01)
    return made


def rocking(deformable: bool) -> Assembly:
    """Return a dry pier on a plate that rocks after an impulse."""
    made = Assembly(joint=DRY)
    plate = made.add_block(rectangle(-0.5, -0.1, 1.0, 0.0), zone_size=0.0)
    made.support(plate)
    for i in range(3):
        block = made.add_block(rectangle(0.0, 0.3 * i, 0.3, 0.3 * (i + 1)), zone_size=0.3 * deformable)
        made.set_velocity(block, x=0.3 * (i + 0.5) * 0.3, rotation=-0.3)
    return made


def momentum(found: Found) -> Check:
    """Compare final and initial linear and angular momentum, and energy."""
    run = found.run
    assert run is not None
    model, (first, last) = found.model, (found.path[0], found.path[-1])
    way = (model.mass @ (last.displacement[:, :2] - first.displacement[:, :2])) / model.mass.sum()
    off = np.abs(way / (np.array([0.3, 0.2]) * last.time) - 1.0).max()
    begun, ended = (step.energy.kinetic_energy + step.energy.elastic_energy for step in (first, last))
    energy = abs(ended / begun - 1.0)
    turned = last.displacement[:, 2].mean() / (20.0 * last.time)  # lengthened a little by its rotation
    return Check("momentum and energy", float(max(off, energy, abs(turned - 1.0))), 1e-3)


def drift(found: Found) -> Check:
    """Compare the final energy with the initial energy and the work of loads."""
    path = found.path
    whole = [step.energy.kinetic_energy + step.energy.elastic_energy - step.energy.external_work for step in path]
    size = max(step.energy.kinetic_energy for step in path)
    return Check("energy", max(abs(e - whole[0]) for e in whole) / size, 2e-2)


def still(found: Found) -> Check:
    """Compare positions after a million further cycles with those at rest."""
    before, after = found.path[-2].displacement, found.path[-1].displacement
    return Check("rest", float(np.abs(after - before).max() / np.abs(before).max()), 1e-3)


def dry_wall(deformable: bool) -> Assembly:
    """Return a dry wall in dishing of 2 mm."""
    made, low = Assembly(joint=DRY), []
    for course in range(4):
        edges = np.array([0.0, *(np.arange(1, 6) * 0.24 - 0.12 * (course % 2 == 0)), 1.2])
        for left, right in itertools.pairwise(edges):
            if right - left > 1e-9:
                corners = rectangle(left, 0.1 * course, right, 0.1 * (course + 1))
                block = made.add_block(corners, course=course, zone_size=0.12 * deformable)
                low += [block] if course == 0 else []
    made.rest_on_ground(low, lambda x: -2e-3 * (1 - ((x - 0.6) / 0.6) ** 2))
    return made


def goes_on(model: Model, solver: Solver) -> Found:
    """Solve to convergence with the explicit solver, and cycle a million times more."""
    path = ExplicitStepper(model, solver)
    found, scheme = [], path.scheme
    for number, progress in enumerate((0.0, 1.0)):
        path.begin_increment(number)
        path.apply(progress)
        found.append(path.report(path.equilibrate()))
    path.begin_increment(2)
    scheme.cycle(STEPS)
    ratio = float(scheme.unbalanced_force_ratio().max())
    return Found(model, [*found, path.report(Outcome(ratio, balanced=True, collapsed=False))])


def chattering(deformable: bool) -> Assembly:
    """Return a dry block on a plate with an unstressed joint, on which it bounces."""
    made = Assembly(joint=DRY)
    made.support(made.add_block(rectangle(-0.5, -0.1, 1.0, 0.0), zone_size=0.0))
    made.add_block(rectangle(0.0, 0.0, 0.3, 0.3), zone_size=0.3 * deformable)
    return made


def made_by_bouncing(found: Found) -> Check:
    """Compare the gain of energy with the energy exchanged."""
    size = max(step.energy.kinetic_energy + step.energy.elastic_energy for step in found.path)
    return Check("energy", max(-step.energy.energy_error for step in found.path) / size, 2e-2)


def chatter() -> list[Case]:
    """Return a block that chatters, with decreasing steps, and with a little damping."""
    little = {"damping": "rayleigh", "damping_ratio": 0.05, "frequency": 0.5, "second_frequency": 1000.0}
    tried: dict[str, dict[str, Any]] = {
        **{f"undamped, step {share:g} of the limit": {"time_step_safety": share} for share in (0.5, 0.25, 0.1)},
        "undamped, step left to the solver": {},
        "a little damped, step 0.5 of the limit": little,
    }
    return [
        Case(
            "chatter",
            name,
            chattering,
            check=made_by_bouncing,
            dynamics=lambda model, more=more: Dynamics(duration=0.2, outputs=20, start="unstressed", **more),
            ways=IN_TIME,
        )
        for name, more in tried.items()
    ]


def cases() -> list[Case]:
    """Return all cases."""
    endless = {"most_steps": np.inf}
    unstressed = steps_of(STEPS, start="unstressed")
    rings = steps_of(STEPS, start="equilibrium", new_contacts=False)
    family, explicit = "a million steps", ("explicit, rigid", "explicit, deformable")
    return [
        Case(family, "a bonded pair flies and turns", pair, "", momentum, dynamics=unstressed, ways=IN_TIME, **endless),
        Case(family, "a bonded stack rings", ringing, "", drift, dynamics=rings, ways=IN_TIME, **endless),
        Case(family, "a dry pier rocks", rocking, dynamics=unstressed, ways=IN_TIME[:1], **endless),
        Case(family, "a dry wall at rest", dry_wall, "", still, follow=goes_on, ways=explicit),
        *chatter(),
    ]
