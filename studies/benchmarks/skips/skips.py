"""Every skip that can be turned off, by a setting or by a patch, and those that cannot."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import replace
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np

from damagepred.kernels.joint.softening import Softening
from damagepred.scene import BlockMaterial, Scene
from damagepred.solvers.options import DEFAULTS

QUASI_STATIC = ("dishing", "doming", "window", "no dpc", "random joints", "deformable")
RIGID = QUASI_STATIC[:5]
STRONG = 1e12
"""Strength (Pa) that no zone reaches."""

Change = Callable[[Scene], Scene]
Patch = Callable[[], AbstractContextManager[Any]]


class Skip(NamedTuple):
    """One skip.

    Attributes
    ----------
    what : str
        What is skipped.
    how : str
        How it is turned off: the setting, or "patched".
    scenes : tuple of str
        On which walls it is measured.
    off : callable
        Scene -> the scene without the skip.
    put : callable
        Returns a context in which the program computes without the skip.
    on : callable
        Scene -> the scene with the skip, where that is not the default.
    """

    what: str
    how: str
    scenes: tuple[str, ...]
    off: Change = lambda scene: scene
    put: Patch = nullcontext
    on: Change = lambda scene: scene


def with_solver(**changes: Any) -> Change:
    """Return a function that changes settings of the solver in a scene."""
    return lambda scene: replace(scene, solver=replace(scene.solver, **changes))


def with_dynamics(**changes: Any) -> Change:
    """Return a function that changes settings of a run in time in a scene."""
    return lambda scene: replace(scene, dynamics=replace(scene.dynamics, **changes))


def strong_bricks(scene: Scene) -> Scene:
    """Return the wall of bricks with a strength that no zone reaches."""
    law = BlockMaterial(cohesion=STRONG, friction=0.75, tensile_strength=STRONG)
    return replace(scene, block=law)


def without_strength(scene: Scene) -> Scene:
    """Return the wall of bricks that stay elastic."""
    return replace(scene, block=BlockMaterial())


# -- patches ---------------------------------------------------------------------------------------------------------

SYSTEM = "damagepred.solvers.quasi_static.linear_system.BlockTridiagonalSystem"
SUPERELEMENTS = "damagepred.solvers.quasi_static.superelements.Superelements"


def replaced(method: str, by: Callable[..., Any]) -> Patch:
    """Return a function that replaces a method, by its full name, in a context."""
    return lambda: patch(method, by)


def wrapped(method: str, by: Callable[..., Any]) -> Patch:
    """Return the same with a function that takes the replaced method before its arguments."""

    def put() -> AbstractContextManager[Any]:
        known = pkgutil.resolve_name(method)
        return patch(method, lambda *arguments: by(known, *arguments))

    return put


def whole(known: Callable[..., Any], system: Any, changed: Any) -> None:
    """Begin a factorisation at the farthest active level."""
    system._farthest_changed_level = system.active_levels - 1
    known(system, changed)


def forgetful(known: Callable[..., Any], system: Any, force: Any) -> Any:
    """Discard the unit-load responses of changed joints after a solution."""
    answer = known(system, force)
    system.woodbury.discard_responses()
    return answer


def opened(known: Callable[..., Any], superelements: Any, *arguments: Any) -> None:
    """Treat the zones of all deformable blocks as active from the start."""
    known(superelements, *arguments)
    superelements._activate(np.arange(len(superelements.block)))


def by_fixed_point(self: Any, state: Any, start: Any, near: bool) -> float:
    """Solve an equilibrium by the Tresca fixed point."""
    from damagepred.solvers.quasi_static.tresca_fixed_point import coulomb_fixed_point

    supports = self.model.supports
    state.displacement[supports.prescribed] = supports.displacement(state.load_factor)
    if self.jacks is not None:
        state.jack = self.jacks.load_at(state.load_factor, state.jack)
    return coulomb_fixed_point(self, state, False, self.options.coulomb.max_newton_iterations)


@contextmanager
def whole_law() -> Iterator[None]:
    """Evaluate dilation, caps, gaps and softening also for joints without them."""
    with ExitStack() as stack:
        for where in ("time_stepping.scheme", "dynamics.run"):
            for name, needed in (("needs_full_law", True), ("softening_of", Softening(True))):
                stack.enter_context(patch(f"damagepred.solvers.{where}.{name}", lambda model, needed=needed: needed))
        yield


always_factorise = replaced(f"{SYSTEM}._refactorisation_pays", lambda self, changed, new, farthest: changed > 0)
factorise_all_levels = wrapped(f"{SYSTEM}._factorise", whole)
learn_again = wrapped(f"{SYSTEM}.solve", forgetful)
frozen_first = replaced("damagepred.solvers.quasi_static.equilibrium.Equilibrium._find_active", by_fixed_point)
blind = replaced(
    "damagepred.solvers.quasi_static.continuation.Continuation.predict_next_event",
    lambda self, state, target: (state.displacement, 1.0),
)
no_kin = replaced(f"{SUPERELEMENTS}._group_by_shape", lambda self: [np.array([d]) for d in range(len(self.block))])
all_open = wrapped(f"{SUPERELEMENTS}.__init__", opened)
cycled_start = replaced(
    "damagepred.solvers.time_stepping.scheme.DampedTimeStepping.start_from_elastic_solution", lambda self: False
)
SAME_REST = DEFAULTS.explicit.check_interval * (DEFAULTS.explicit.passed_checks - 1) + 1
"""Checks in a row after every cycle, over the same cycles as by default."""

SKIPS: dict[str, Skip] = {
    "condense": Skip(
        "degrees of freedom of elastic courses (statically condensed)",
        "`[solver] condense = false`",
        QUASI_STATIC,
        off=with_solver(condense=False),
    ),
    "half": Skip(
        "the second half of a symmetric wall",
        "`[solver] symmetric_half = false`",
        ("dishing", "doming", "window", "no dpc", "explicit"),
        off=with_solver(symmetric_half=False),
    ),
    "condense and half": Skip(
        "both of these", "both settings", RIGID[:4], off=with_solver(condense=False, symmetric_half=False)
    ),
    "correct": Skip(
        "factorisations that take longer than a Woodbury correction",
        "patched",
        RIGID,
        put=always_factorise,
    ),
    "restart": Skip("factorising levels beyond the farthest that changed", "patched", RIGID, put=factorise_all_levels),
    "keep": Skip("unit-load responses of joints that changed before", "patched", RIGID, put=learn_again),
    "astray": Skip(
        "Newton iterations after divergence is detected",
        "`[solver.advanced.newton] early_divergence_iterations`, a large number",
        ("dishing", "window", "no dpc", "random joints"),
        off=with_solver(advanced={"newton": {"early_divergence_iterations": 10**9}}),
    ),
    "direct": Skip(
        "Tresca fixed-point iterations where Newton's method on Coulomb's law converges",
        "patched",
        ("dishing", "window", "no dpc"),
        put=frozen_first,
    ),
    "predictor": Skip(
        "equilibria that bracket an event: the tangent predicts it",
        "patched",
        ("dishing", "window", "no dpc", "random joints"),
        put=blind,
    ),
    "auto": Skip(
        "zones in bricks that hardly deform",
        '`[solver] blocks = "auto"`, not `"deformable"`',
        ("deformable",),
        on=with_solver(blocks="auto"),
        off=with_solver(blocks="deformable"),
    ),
    "rigid": Skip(
        "zones in all bricks",
        '`[solver] blocks = "rigid"`, not `"deformable"`',
        ("deformable",),
        on=with_solver(blocks="rigid"),
        off=with_solver(blocks="deformable"),
    ),
    "kin": Skip(
        "condensing bricks of one shape one by one", "patched", ("deformable", "deformable, yields"), put=no_kin
    ),
    "rims": Skip(
        "zones inside elastic bricks: only boundary degrees of freedom remain",
        "patched",
        ("deformable, yields",),
        put=all_open,
    ),
    "no limits": Skip(
        "yield checks of zones without a strength", "a strength of 1e12 Pa", ("deformable",), off=strong_bricks
    ),
    "elastic start": Skip(
        "cycles under dead load: the elastic solution is the start", "patched", ("explicit",), put=cycled_start
    ),
    "short law": Skip(
        "parts of the joint law that no joint of the wall has", "patched", ("explicit", "in time, falls"), put=whole_law
    ),
    "look seldom": Skip(
        "checks of the unbalanced force, except every 50 cycles",
        "`[solver.advanced.explicit] check_interval = 1`",
        ("explicit",),
        off=with_solver(advanced={"explicit": {"check_interval": 1, "passed_checks": SAME_REST}}),
    ),
    "no memory": Skip(
        "history and yield checks of zones without a strength",
        "a strength of 1e12 Pa",
        ("explicit, deformable",),
        on=without_strength,
        off=strong_bricks,
    ),
    "search seldom": Skip(
        "neighbour searches while no body has moved through the margin",
        "`[solver.advanced.dynamics] search_distance`, a tiny number",
        ("in time, falls", "in time, rests"),
        off=with_solver(advanced={"dynamics": {"search_distance": 1e-15}}),
    ),
    "no search": Skip(
        "all neighbour searches, where displacements are small",
        "`[dynamics] new_contacts = true`, the default",
        ("in time, rests",),
        on=with_dynamics(new_contacts=False),
        off=with_dynamics(new_contacts=True),
    ),
    "rest": Skip(
        "time steps after the wall has come to rest",
        "`[dynamics] stop_at_rest = false`, the default",
        ("in time, rests",),
        on=with_dynamics(stop_at_rest=True),
        off=with_dynamics(stop_at_rest=False),
    ),
}
"""Skips of the solvers, by short names."""

NOT_TURNED_OFF = {
    "forces of condensed joints, and displacements of inactive levels, are not computed": (
        "part of static condensation; `condense = false` turns off all of it"
    ),
    "unchanged stiffness is not assembled again (elimination restarts level by level)": (
        "measured with `restart`: the compiled sums have no separate switch"
    ),
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
    "walls that take less than a second share a part of the archive": (
        "a part for each would be the same bytes in more files; measured by studies/throughput"
    ),
    "libraries are loaded when they are needed; kernels are compiled once": (
        "start-up and compiling are measured by tests/regressions"
    ),
}
"""Skips that cannot be turned off here, and why."""
