"""Random walls that crack, with six laws of the joints, and whether the path of equilibria is complete.

Walls of 3 m x 1.2 m, with and without damp-proof course and window, dishing and doming to 10-20 mm in 10-20 increments,
tensile strength and cohesion different in every joint (lognormal, coefficient of variation 0.3), friction of the
damp-proof course 0.3-0.7. The number of a wall determines it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model, wall_geometry, wall_model
from damagepred.scene import Dpc, Joint, Loads, Movement, Opening, Scene, Solver, Wall
from studies.benchmarks.stress.case import Case

LAWS: dict[str, dict[str, Any]] = {
    "paper": {},
    "dilation": {"dilation": 0.1},
    "residual_friction": {"residual_friction": 0.35},
    "brittle_shear": {"brittle_shear": True},
    "softening": {"fracture_energy": 10.0},
    "residual_strength": {"residual_tensile_strength": 0.01e6, "residual_cohesion": 0.02e6},
}
"""Other laws of the joints, by name."""


def random_wall(number: int, law: str = "paper") -> tuple[Scene, np.random.Generator]:
    """Return a wall, and the generator of the strengths of its joints, from its number."""
    rng = np.random.default_rng([2026, number])
    with_dpc, with_window, dishing = rng.random(3) < 0.5
    kind = "dishing" if dishing else "doming"
    wall = Wall(
        length=3.0,
        height=1.2,
        block_length=float(rng.choice([0.24, 0.3, 0.4])),
        block_height=float(rng.choice([0.1, 0.12, 0.15])),
    )
    opening: tuple[Opening, ...] = ()
    if with_window:
        width, sill = float(rng.uniform(0.5, 1.2)), float(rng.choice([0.3, 0.6]))
        top = float(rng.choice([0.9, 1.2]))
        opening = (Opening(x=round(float(rng.uniform(0.4, 2.6 - width)), 3), y=sill, width=width, height=top - sill),)
    return Scene(
        title=f"campaign wall {number}",
        wall=wall,
        joint=Joint(friction=float(np.clip(rng.normal(0.75, 0.1), 0.4, 1.1)), **LAWS[law]),
        dpc=Dpc(course=int(rng.integers(1, 3)), friction=float(rng.uniform(0.3, 0.7))) if with_dpc else None,
        opening=opening,
        movement=Movement(
            kind=kind,
            central_deflection=float(rng.uniform(0.010, 0.020)),
            increments=int(rng.integers(10, 21)),
            shape=rng.choice(["three_loads", "parabola"]),
        ),
        loads=Loads(roof=float(rng.choice([0.0, 1500.0, 6000.0]))),
        solver=Solver(),
    ), rng


def strengths(scene: Scene, rng: np.random.Generator) -> dict[str, FloatArray]:
    """Return the strengths of the joints of a wall."""
    strength = rng.uniform(0.05e6, 0.45e6)
    joints = len(wall_geometry(scene).joints.kind)
    sigma = np.sqrt(np.log(1.0 + 0.3**2))
    spread = rng.lognormal(-0.5 * sigma**2, sigma, size=(2, joints))
    return {"joint.tensile_strength": strength * spread[0], "joint.cohesion": 0.85 * strength * spread[1]}


def model_of_wall(number: int, law: str) -> Model:
    """Return the model of a wall."""
    scene, rng = random_wall(number, law)
    return wall_model(scene, strengths(scene, rng))


def cases(walls: int = 30) -> list[Case]:
    """Return walls for each of the six laws."""
    return [
        Case(
            "six laws",
            f"{law}, wall {number}",
            lambda d, k=number, w=law: model_of_wall(k, w),
            increments=random_wall(number, law)[0].movement.increments,
            ways=("quasi-static, rigid",),
        )
        for law in LAWS
        for number in range(walls)
    ]
