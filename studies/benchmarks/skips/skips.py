"""The walls on which skips are measured; every skip that can be turned off by a setting, and those that cannot."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from damagepred.arrays import FloatArray
from damagepred.scene import BaseMotion, Dynamics, Joint, Loads, Movement, Scene, Solver, Wall
from damagepred.solvers.options import DEFAULTS
from damagepred.study import Study
from damagepred.study.settings import StudySettings

DATA = Path(__file__).resolve().parents[3] / "data"


class Known(NamedTuple):
    """A wall, and the values of its joints where they differ."""

    scene: Scene
    fields: dict[str, FloatArray] | None = None


def bryant(name: str) -> Known:
    """Return a wall of the full-scale test."""
    return Known(Scene.from_toml(DATA / f"bryant_{name}.toml"))


def without_dpc() -> Known:
    """Return the solid wall that dishes, built without a damp-proof course: it cracks."""
    return Known(replace(bryant("dishing").scene, dpc=None))


def deformable() -> Known:
    """Return the solid wall that dishes, of deformable bricks."""
    scene = bryant("dishing").scene
    return Known(replace(scene, solver=Solver(blocks="deformable"), movement=replace(scene.movement, increments=8)))


def random() -> Known:
    """Return the solid wall with joints of random strength, as it is sampled in a study, without a dpc: it cracks."""
    tables = tomllib.loads((DATA / "bryant_study.toml").read_text(encoding="utf-8"))
    scene = tomllib.loads((DATA / "bryant_dishing.toml").read_text(encoding="utf-8"))
    for place in ("movement.central_deflection", "dpc.friction"):
        del tables["variables"][place]
    del scene["dpc"]
    return Known(*Study(StudySettings.from_dict({**tables, "scene": scene})).sample(0, 1))


def explicit() -> Known:
    """Return a smaller wall that dishes, for the explicit solver."""
    scene = part_of_test(bryant("dishing").scene, 2.88, 1.2)
    solver = Solver(method="explicit")
    return Known(replace(scene, solver=solver, movement=replace(scene.movement, increments=4)))


def in_time() -> Known:
    """Return a small wall without mortar on ground that shakes: bricks slide and fall."""
    pulse = BaseMotion(kind="full_sine", acceleration=20.0, duration=0.3)
    return Known(
        Scene(
            wall=Wall(length=1.44, height=0.6),
            joint=Joint(tensile_strength=0.0, cohesion=0.0, friction=0.6),
            dynamics=Dynamics(duration=0.5, outputs=10, base=(pulse,)),
        )
    )


def in_time_at_rest() -> Known:
    """Return a small wall with mortar on slowly moving ground, until it comes to rest."""
    return Known(
        Scene(
            wall=Wall(length=1.44, height=0.6),
            loads=Loads(roof=1440.0),
            movement=Movement(kind="dishing", central_deflection=0.5e-3),
            dynamics=Dynamics(duration=1.0, outputs=50, movement_time=0.1, damping="local"),
        )
    )


def part_of_test(scene: Scene, length: float, height: float) -> Scene:
    """Return a smaller wall of the same bricks, at the same deflection ratio and the same load on every metre."""
    scale = length / scene.wall.length
    return replace(
        scene,
        wall=replace(scene.wall, length=length, height=height),
        movement=replace(scene.movement, central_deflection=scale * scene.movement.central_deflection),
        loads=Loads(roof=scale * scene.loads.roof),
    )


SCENES: dict[str, Callable[[], Known]] = {
    "dishing": lambda: bryant("dishing"),
    "doming": lambda: bryant("doming"),
    "window": lambda: bryant("window_dishing"),
    "no dpc": without_dpc,
    "random joints": random,
    "deformable": deformable,
    "explicit": explicit,
    "in time, falls": in_time,
    "in time, rests": in_time_at_rest,
}
"""Walls, by their names in the tables."""


def smaller(known: Known) -> Known:
    """Return a wall of a few bricks in place of a scene's, for the quick form."""
    scene = part_of_test(replace(known.scene, opening=()), 1.44, 0.45)
    return Known(replace(scene, movement=replace(scene.movement, increments=4)))


QUASI_STATIC = ("dishing", "doming", "window", "no dpc", "random joints", "deformable")
SAME_REST = DEFAULTS.explicit.check_interval * (DEFAULTS.explicit.passed_checks - 1) + 1
"""Checks in a row after every cycle, over the same cycles as by default."""

Change = Callable[[Scene], Scene]


class Skip(NamedTuple):
    """One skip.

    Attributes
    ----------
    what : str
        What is skipped.
    how : str
        The setting that turns it off.
    scenes : tuple of str
        On which walls it is measured.
    off : callable
        Scene -> the scene without the skip.
    on : callable
        Scene -> the scene with the skip, where that is not the default.
    elastic_start : bool
        Whether the explicit solver without the skip begins at the elastic solution under dead load.
    """

    what: str
    how: str
    scenes: tuple[str, ...]
    off: Change = lambda scene: scene
    on: Change = lambda scene: scene
    elastic_start: bool = True


def with_solver(**changes: Any) -> Change:
    """Return a function that changes settings of the solver in a scene."""
    return lambda scene: replace(scene, solver=replace(scene.solver, **changes))


def with_dynamics(**changes: Any) -> Change:
    """Return a function that changes settings of a run in time in a scene."""
    return lambda scene: replace(scene, dynamics=replace(scene.dynamics, **changes))


SKIPS: dict[str, Skip] = {
    "condense": Skip(
        "degrees of freedom of elastic courses (statically condensed)",
        "`[solver] condense = false`",
        QUASI_STATIC,
        with_solver(condense=False),
    ),
    "half": Skip(
        "the second half of a symmetric wall",
        "`[solver] symmetric_half = false`",
        ("dishing", "doming", "window", "no dpc", "explicit"),
        with_solver(symmetric_half=False),
    ),
    "astray": Skip(
        "Newton iterations after divergence is detected",
        "`[solver.advanced.newton] early_divergence_iterations`, a large number",
        ("dishing", "window", "no dpc", "random joints"),
        with_solver(advanced={"newton": {"early_divergence_iterations": 10**9}}),
    ),
    "elastic start": Skip(
        "cycles under dead load: the elastic solution is the start",
        "`explicit_path(..., elastic_start=False)`; the whole wall both times",
        ("explicit",),
        with_solver(symmetric_half=False),
        with_solver(symmetric_half=False),
        elastic_start=False,
    ),
    "look seldom": Skip(
        "checks of the unbalanced force, except every 50 cycles",
        "`[solver.advanced.explicit] check_interval = 1`",
        ("explicit",),
        with_solver(advanced={"explicit": {"check_interval": 1, "passed_checks": SAME_REST}}),
    ),
    "search seldom": Skip(
        "neighbour searches while no body has moved through the margin",
        "`[solver.advanced.dynamics] search_distance`, a tiny number",
        ("in time, falls", "in time, rests"),
        with_solver(advanced={"dynamics": {"search_distance": 1e-15}}),
    ),
    "no search": Skip(
        "all neighbour searches, where displacements are small",
        "`[dynamics] new_contacts = true`, the default",
        ("in time, rests",),
        with_dynamics(new_contacts=True),
        with_dynamics(new_contacts=False),
    ),
    "rest": Skip(
        "time steps after the wall has come to rest",
        "`[dynamics] stop_at_rest = false`, the default",
        ("in time, rests",),
        with_dynamics(stop_at_rest=False),
        with_dynamics(stop_at_rest=True),
    ),
}
"""Skips of the solvers, by short names."""

NOT_TURNED_OFF = {
    "zones in bricks that hardly deform (`blocks`)": "choices of studies/benchmarks/work_precision, with their errors",
    "forces of condensed joints, and displacements of inactive levels": "part of static condensation (`condense`)",
    "factorisations (Woodbury corrections), elimination beyond the farthest changed level, equilibria before an event "
    "(tangent predictor), condensing bricks of one shape": "parts of the solver; tests/regressions times their sum",
    "parts of the joint law that no joint of the wall has; zones within the yield surface": "compiled into the laws",
    "loops over what a wall does not have (footing, jacks, dpc, concrete, sections, mesh)": "without it they are empty",
    "history of cracking footing sections, but for every 8th cycle": "a footing on jacks takes minutes",
    "walls once an estimate is good enough (`[study] stop_when`)": "see studies/benchmarks/probabilities",
    "storage of zones, of increments before the end and of values of joints": "bytes, and no time: studies/throughput",
    "loading of libraries, compiling of kernels": "measured by tests/regressions",
}
"""Skips that are not turned off here, and why."""
