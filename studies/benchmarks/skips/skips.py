"""Every skip that can be turned off by a setting, and those that cannot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

from damagepred.scene import BlockMaterial, Scene
from damagepred.solvers.options import DEFAULTS

QUASI_STATIC = ("dishing", "doming", "window", "no dpc", "random joints", "deformable")
RIGID = QUASI_STATIC[:5]
STRONG = BlockMaterial(cohesion=1e12, friction=0.75, tensile_strength=1e12)
"""Bricks with a strength (Pa) that no zone reaches."""
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


def with_bricks(material: BlockMaterial) -> Change:
    """Return a function that changes the bricks of a scene."""
    return lambda scene: replace(scene, block=material)


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
    "auto": Skip(
        "zones in bricks that hardly deform",
        '`[solver] blocks = "auto"`, not `"deformable"`',
        ("deformable",),
        with_solver(blocks="deformable"),
        with_solver(blocks="auto"),
    ),
    "rigid": Skip(
        "zones in all bricks",
        '`[solver] blocks = "rigid"`, not `"deformable"`',
        ("deformable",),
        with_solver(blocks="deformable"),
        with_solver(blocks="rigid"),
    ),
    "no limits": Skip(
        "yield checks of zones without a strength", "a strength of 1e12 Pa", ("deformable",), with_bricks(STRONG)
    ),
    "elastic start": Skip(
        "cycles under dead load: the elastic solution is the start",
        "`explicit_path(..., elastic_start=False)`",
        ("explicit",),
        elastic_start=False,
    ),
    "look seldom": Skip(
        "checks of the unbalanced force, except every 50 cycles",
        "`[solver.advanced.explicit] check_interval = 1`",
        ("explicit",),
        with_solver(advanced={"explicit": {"check_interval": 1, "passed_checks": SAME_REST}}),
    ),
    "no memory": Skip(
        "history and yield checks of zones without a strength",
        "a strength of 1e12 Pa",
        ("explicit, deformable",),
        with_bricks(STRONG),
        with_bricks(BlockMaterial()),
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
    "forces of condensed joints, and displacements of inactive levels, are not computed": (
        "part of static condensation; `condense = false` turns off all of it"
    ),
    "Woodbury corrections in place of factorisations, elimination from the farthest changed level on, "
    "the tangent predictor to the next event, superelements shared by bricks of one shape": (
        "parts of the quasi-static solver without a setting; tests/regressions times their sum"
    ),
    "parts of the joint law that no joint of the wall has": "the compiled kernel is chosen by the laws of the wall",
    "zones are mapped back only where beyond the yield surface (`within_yield_surface`)": (
        "compiled into the law; tests/regressions times elastic and yielding zones"
    ),
    "no footing, no jacks, no dpc, no concrete, no sections, no mesh: their loops are not entered": (
        "without them the loops are empty"
    ),
    "the history of cracking footing sections is updated every 8th cycle (`section_commit_interval`)": (
        "`[solver.advanced.time_stepping]`; a footing on jacks takes minutes"
    ),
    "no more walls once an estimate is good enough (`[study] stop_when`)": (
        "changes the number of walls, not the time of a wall: studies/benchmarks/probabilities"
    ),
    "increments before the end of a sample's movement, and values of joints that follow from the seed, are not stored": (
        '`[study] movement = "sampled"`, `store_fields = false`: bytes of an archive, and no time'
    ),
    "walls that take less than a second share a part of the archive": (
        "a part for each would be the same bytes in more files; measured by studies/throughput"
    ),
    "libraries are loaded when they are needed; kernels are compiled once": (
        "start-up and compiling are measured by tests/regressions"
    ),
}
"""Skips that cannot be turned off here, and why."""
