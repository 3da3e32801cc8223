"""Runs in time: a million steps without drift, bouncing blocks, and time steps beyond the limit.

A user may set shares of the limit up to 1; beyond, the solvers' check is bypassed. Limits are bounds: where a share
above 1 is stable, the bound is not sharp (of runs in time that may meet new blocks it is the stiffness of faces in full
contact).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any
from unittest import mock

import numpy as np

from damagepred.assembly import Assembly, Model
from damagepred.assembly.assembly import rectangle
from damagepred.one_wall.judged_path import dynamic_run
from damagepred.scene import Dynamics, Joint, Solver
from damagepred.solvers.dynamics import run as in_time
from damagepred.solvers.dynamics.time_step import highest_frequency, time_step
from damagepred.solvers.explicit import scheme as explicit
from damagepred.solvers.explicit.stepper import explicit_path
from studies.benchmarks.stress.case import IN_TIME, STATIC, Case, Check, Found, to_rest
from studies.benchmarks.stress.elastic import UNLUMPED, against_reference, stack

STEPS = 1_000_000
BOND = Joint(tensile_strength=1e15, cohesion=1e15)
SHARES = (0.1, 0.5, 0.9, 1.0, 1.05, 1.2, 1.5, 2.0)
"""Time steps over the limit."""


def steps_of(**more: Any) -> Callable[[Model], Dynamics]:
    """Return a run in time of a million steps."""

    def dynamics(model: Model) -> Dynamics:
        once = Dynamics(duration=1.0, outputs=1, **more)
        run = dynamic_run(model, Solver(), replace(once, duration=1e-6))
        highest = highest_frequency(model, run.bodies, run.motion.inverse_mass, run.options)
        frequency = highest.touched if once.new_contacts else highest.intact
        dry = bool((model.properties.tensile_strength <= 0.0).any())
        return replace(once, duration=STEPS * 0.999 * time_step(frequency, once, dry), outputs=20)

    return dynamics


def bonded(deformable: bool, blocks: int) -> Assembly:
    """Return two bonded blocks in free flight with rotation, without gravity; or a stack that rings on the ground."""
    flies = blocks == 2
    made = Assembly(gravity=(0.0, 0.0 if flies else -9.81), joint=BOND)
    for i in range(blocks):
        block = made.add_block(rectangle(0.0, 0.1 * i, 0.24, 0.1 * (i + 1)), zone_size=0.24 * deformable)
        if flies:  # as one body, about the joint's middle
            made.set_velocity(block, x=0.3 - 20.0 * (0.1 * i - 0.05), y=0.2, rotation=20.0)
    if not flies:
        made.rest_on_ground([0])
        made.set_velocity(blocks - 1, x=0.01, y=0.01)
    return made


def bouncing(deformable: bool) -> Assembly:
    """Return a dry block on a plate with an unstressed joint, on which it bounces."""
    made = Assembly(joint=Joint(tensile_strength=0.0, cohesion=0.0, friction=0.6))
    made.support(made.add_block(rectangle(-0.5, -0.1, 1.0, 0.0), zone_size=0.0))
    made.add_block(rectangle(0.0, 0.0, 0.3, 0.3), zone_size=0.3 * deformable)
    return made


def momentum(found: Found) -> Check:
    """Compare final and initial linear and angular momentum, and energy."""
    model, (first, last) = found.model, (found.path[0], found.path[-1])
    way = (model.mass @ (last.displacement[:, :2] - first.displacement[:, :2])) / model.mass.sum()
    off = np.abs(way / (np.array([0.3, 0.2]) * last.time) - 1.0).max()
    begun, ended = (step.energy.kinetic_energy + step.energy.elastic_energy for step in (first, last))
    turned = last.displacement[:, 2].mean() / (20.0 * last.time)  # lengthened a little by its rotation
    return Check("momentum and energy", float(max(off, abs(ended / begun - 1.0), abs(turned - 1.0))), 1e-3)


def drift(found: Found) -> Check:
    """Compare the final energy with the initial energy and the work of loads."""
    each = [step.energy for step in found.path]
    whole = [energy.kinetic_energy + energy.elastic_energy - energy.external_work for energy in each]
    return Check("energy", max(abs(e - whole[0]) for e in whole) / max(e.kinetic_energy for e in each), 2e-2)


def made_by_bouncing(found: Found) -> Check:
    """Compare the gain of energy with the energy exchanged."""
    size = max(step.energy.kinetic_energy + step.energy.elastic_energy for step in found.path)
    return Check("energy", max(-step.energy.energy_error for step in found.path) / size, 2e-2)


def beyond(model: Model, solver: Solver, share: float, new_contacts: bool) -> Found:
    """Solve the stack with a time step of a share of the limit, beyond 1 of the wider limit under local damping."""
    forced, (scaled, stepped) = max(share, 1.0), (explicit.scaled_mass, in_time.time_step)

    def widened(damping: float) -> float:
        """Square of the limit that masses keep, 2/√(1 + α), over the limit of stability, 2/√(1 - α²)."""
        return 1.0 - damping if share > 1.0 else 1.0

    with (
        mock.patch.object(explicit, "scaled_mass", lambda *a: scaled(*a) * widened(a[1]) / forced**2),
        mock.patch.object(in_time, "time_step", lambda *a: forced * stepped(*a) / np.sqrt(widened(a[1].local_damping))),
        np.errstate(all="ignore"),
    ):
        if solver.method == "explicit":
            return Found(model, [next(iter(explicit_path(model, solver, 1, elastic_start=False)))])
        run = dynamic_run(
            model, solver, to_rest(model, time_step_safety=solver.time_step_safety, new_contacts=new_contacts)
        )
        return Found(model, list(run), run)


def time_steps() -> list[Case]:
    """Return the stack with time steps from a tenth to twice the limit."""
    made = []
    for share, new_contacts in itertools.product(SHARES, (True, False)):
        name = f"{share:g} of the limit" + ", no new contacts" * (not new_contacts)
        made.append(
            Case(
                "time steps",
                name,
                stack,
                "stands",
                against_reference,
                settings=UNLUMPED | {"time_step_safety": min(share, 1.0)},
                follow=partial(beyond, share=share, new_contacts=new_contacts),
                ways=(*STATIC[2:], *IN_TIME) if new_contacts else IN_TIME[:1],
            )
        )
    return made


def chatter() -> list[Case]:
    """Return a block that chatters, with decreasing steps, and with a little damping."""
    little = {"damping": "rayleigh", "damping_ratio": 0.05, "frequency": 0.5, "second_frequency": 1000.0}
    tried: dict[str, dict[str, Any]] = {
        **{f"undamped, step {share:g} of the limit": {"time_step_safety": share} for share in (0.5, 0.25, 0.1)},
        "undamped, step left to the solver": {},
        "a little damped, step 0.5 of the limit": little,
    }
    made = []
    for name, more in tried.items():
        bounces = Dynamics(duration=0.2, outputs=20, start="unstressed", **more)
        made.append(
            Case("chatter", name, bouncing, "", made_by_bouncing, dynamics=lambda _, d=bounces: d, ways=IN_TIME)  # type: ignore[misc]
        )
    return made


def cases() -> list[Case]:
    """Return all cases."""
    falls, rings = steps_of(start="unstressed"), steps_of(start="equilibrium", new_contacts=False)
    pair, five = (partial(bonded, blocks=blocks) for blocks in (2, 5))
    once = Case("a million steps", "a bonded pair flies and turns", pair, "", momentum, dynamics=falls, ways=IN_TIME)
    endless = [once, replace(once, name="a bonded stack rings", make=five, check=drift, dynamics=rings)]
    return [*(replace(case, most_steps=np.inf) for case in endless), *chatter(), *time_steps()]
