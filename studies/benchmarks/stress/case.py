"""One case of the campaign, the ways to solve it, and its result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from scipy import linalg

from damagepred.assembly import Assembly, Model
from damagepred.one_wall.judged_path import dynamic_run, model_of
from damagepred.scene import Dynamics, Scene, Solver
from damagepred.solvers import Increment, solve_path
from damagepred.solvers.dynamics.run import DynamicRun
from damagepred.solvers.explicit.stepper import explicit_path
from damagepred.solvers.system.deformable_blocks import gridpoint_mass
from damagepred.solvers.system.discrete_system import DiscreteSystem

STATIC = ("quasi-static, rigid", "quasi-static, deformable", "explicit, rigid", "explicit, deformable")
IN_TIME = ("in time, rigid",)
WAYS = STATIC + IN_TIME
"""The solvers, and whether blocks are deformable."""
RIGID = tuple(way for way in WAYS if way.endswith("rigid"))
"""Ways of all cases; zones take longer and are used for some cases only."""
STEPS = 1_000_000
"""Largest number of time steps of a run in time, fewer with more degrees of freedom: some seconds."""
PERIODS = 30.0
"""Periods of the slowest vibration within which a locally damped run in time comes to rest."""


class Check(NamedTuple):
    """An independent answer, and the relative error of the solver's; beyond ``allowed`` it is wrong."""

    by: str
    off: float
    allowed: float = 1e-2


class Found(NamedTuple):
    """Result of a solver: the model, its increments or outputs, and the run if it is one in time."""

    model: Model
    path: list[Increment]
    run: DynamicRun | None = None


class NotTriedError(Exception):
    """A run that would take too long for this campaign."""


@dataclass(frozen=True)
class Case:
    """One wall with an extreme property.

    Attributes
    ----------
    family, name : str
        The extreme property and its value; together unique.
    make : callable
        Whether blocks are deformable -> the wall.
    expect : {"", "stands", "falls", "refused"}
        Result of statics alone, where there is one; "refused" if the input is no wall.
    check : callable, optional
        Result -> its error against an independent answer; None if there is none for this way.
    increments : int
        Of the movement.
    settings : dict
        Of the solver, besides its method.
    dynamics : callable, optional
        Model -> how it is run in time; by default dropped on unstressed joints and damped until it rests.
    elastic_start : bool
        Whether the explicit solver may begin at the elastic solution under dead load, or has to cycle there.
    explicit_tolerance : float, optional
        Of the explicit solver; its default neglects forces of a thousandth of a block's weight.
    follow : callable, optional
        Model, solver -> result, in place of the solver's path.
    most_steps : float
        Time steps times hundreds of degrees of freedom beyond which a run in time is not tried.
    ways : tuple of str
        Solvers of the case.
    expect_in_time : str, optional
        Result where loads follow the displaced blocks, if that is another one.
    """

    family: str
    name: str
    make: Callable[[bool], Assembly | Scene | Model]
    expect: str = ""
    check: Callable[[Found], Check | None] | None = None
    increments: int = 1
    settings: dict[str, Any] = field(default_factory=dict)
    dynamics: Callable[[Model], Dynamics] | None = None
    elastic_start: bool = True
    explicit_tolerance: float | None = None
    follow: Callable[[Model, Solver], Found] | None = None
    most_steps: float = STEPS
    ways: tuple[str, ...] = WAYS
    expect_in_time: str | None = None


def solver_of(case: Case, way: str) -> Solver:
    """Return the solver's settings: its defaults, and those of the case."""
    method, _, blocks = way.partition(", ")
    own = {"method": "explicit" if method == "explicit" else "quasi_static", "blocks": blocks}
    if method == "explicit":
        own["tolerance"] = case.explicit_tolerance
    return Solver(**own | case.settings)


def built(case: Case, way: str) -> tuple[Model, Solver]:
    """Return the model of a case, and its solver."""
    solver = solver_of(case, way)
    made = case.make(way.endswith("deformable"))
    if isinstance(made, Model):
        return made, solver
    if isinstance(made, Scene):
        return model_of(replace(made, solver=solver)), solver
    return made.build(solver), solver


def found(case: Case, way: str) -> Found:
    """Solve a case, unless it is a run in time that takes too long."""
    model, solver = built(case, way)
    if case.follow is not None:
        return case.follow(model, solver)
    if not case.elastic_start and solver.method == "explicit":
        return Found(model, list(explicit_path(model, solver, case.increments, elastic_start=False)))
    if way in STATIC:
        return Found(model, list(solve_path(model, solver, case.increments)))
    dynamics = to_rest(model) if case.dynamics is None else case.dynamics(model)
    run = dynamic_run(model, solver, dynamics)
    steps = run.steps_each * dynamics.outputs
    if steps * (1 + model.size / 100) > case.most_steps:
        raise NotTriedError(f"would take {steps:.1g} steps")
    return Found(model, list(run), run)


def to_rest(model: Model, **more: Any) -> Dynamics:
    """Return a run that lets blocks drop onto unstressed joints and comes to rest."""
    return Dynamics(duration=PERIODS * slowest(model), outputs=60, damping="local", start="unstressed", **more)


def slowest(model: Model) -> float:
    """Return the longest period of vibration (s)."""
    system = DiscreteSystem.of(model)
    free, inertia = system.free_dofs, np.zeros(model.size)
    whole = np.column_stack((model.mass, model.mass, model.mass * model.blocks.polar / model.blocks.area))
    inertia[: whole.size] = whole.ravel()
    if model.mesh is not None:
        inertia[model.mesh.dof_x] = inertia[model.mesh.dof_y] = gridpoint_mass(model)
    root = 1.0 / np.sqrt(inertia[free])
    dynamic = system.elastic_stiffness[free][:, free].toarray() * root[:, None] * root
    # the lowest is lost in rounding: the inverse has it first
    return float(2 * np.pi * np.sqrt(linalg.eigvalsh(linalg.inv(0.5 * (dynamic + dynamic.T)))[-1]))
