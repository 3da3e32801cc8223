"""Movements from a picometre to a metre, in one increment or many; walls without weight."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from damagepred.scene import BlockMaterial, Dpc, Joint, Loads, Movement, Scene, Solver
from damagepred.solvers import solve_path
from stressed.case import RIGID, WAYS, Case, Check, Found
from stressed.joints import FOOT, moved

ELASTIC = 1e-4
"""Movement (m) that others are compared with where joints stay elastic."""


def wall(deflection: float, kind: str, unbreakable: bool, **more: object) -> Scene:
    """Return a small wall on a moving ground."""
    joint = Joint(tensile_strength=1e15, cohesion=1e15) if unbreakable else Joint(tensile_strength=5e4, cohesion=5e4)
    dpc = None if unbreakable else Dpc(course=1)
    return Scene(wall=FOOT, joint=joint, dpc=dpc, movement=Movement(kind=kind, central_deflection=deflection), **more)  # type: ignore[arg-type]


def in_proportion(kind: str, deflection: float) -> Callable[[Found], Check | None]:
    """Return a check: an elastic wall moves in proportion to the ground."""

    def check(found: Found) -> Check | None:
        if found.run is not None:
            return None
        exact = _elastic(kind, bool(found.model.mesh is not None))
        way = (found.path[-1].displacement - found.path[0].displacement) / deflection
        return Check("proportion", float(np.abs(way - exact).max() / np.abs(exact).max()))

    return check


def _elastic(kind: str, deformable: bool) -> np.ndarray:
    """Return how far blocks go for each metre of the movement."""
    from damagepred.path import model_of

    own = Solver(blocks="deformable" if deformable else "rigid")
    first, last = solve_path(model_of(wall(ELASTIC, kind, True, solver=own), increments=1), own, 1)
    return np.asarray((last.displacement - first.displacement) / (ELASTIC))


def sizes() -> list[Case]:
    """Return movements of every size, in one increment and in many."""
    made = []
    for kind, deflection, count in itertools.product(
        ("dishing", "doming"), (0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1e-2, 0.1, 1.0), (1, 20)
    ):
        check = in_proportion(kind, deflection) if deflection >= 1e-6 else None
        ways = ("quasi-static, rigid", "explicit, rigid") if count > 1 else WAYS if kind == "dishing" else RIGID
        many = "one increment" if count == 1 else f"{count} increments"
        made += [
            Case("movement", f"{kind} by {deflection:g} m in {many}, unbreakable",
                 lambda d, k=kind, a=deflection: wall(a, k, True), "", check, count, dynamics=moved, ways=ways),
            Case("movement", f"{kind} by {deflection:g} m in {many}",
                 lambda d, k=kind, a=deflection: wall(a, k, False), increments=count, dynamics=moved, ways=ways),
        ]  # fmt: skip
    return [case for case in made if case.increments > 1 or "doming" not in case.name or "unbreakable" not in case.name]


def weightless() -> list[Case]:
    """Return walls without weight, with and without strength and a roof."""
    made = []
    for roof, joint, deflection in itertools.product(
        (0.0, 1e3), ({"tensile_strength": 1e15, "cohesion": 1e15}, {}, {"tensile_strength": 0.0, "cohesion": 0.0}),
        (0.0, 1e-3),
    ):  # fmt: skip
        strength = {1e15: "unbreakable", 0.0: "no bond"}.get(joint.get("tensile_strength", 1.0), "weak")
        made.append(
            Case("no weight", f"roof {roof:g} N, {strength}, dishing by {deflection:g} m",
                 lambda d, r=roof, j=joint, a=deflection: Scene(
                     wall=FOOT, joint=Joint(**j), block=BlockMaterial(density=0.0), loads=Loads(roof=r),
                     movement=Movement(central_deflection=a)),
                 increments=2, dynamics=moved)
        )  # fmt: skip
    return made


def cases() -> list[Case]:
    """Return all of them."""
    return sizes() + weightless()
