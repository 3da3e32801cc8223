"""Random walls: scenes as a user could write them, and walls whose joints all differ, with six laws.

Each is determined by its number. The walls of the six laws are 3 m x 1.2 m, with and without damp-proof course and
window, dishing and doming to 10-20 mm in 10-20 increments, with tensile strength and cohesion different in every joint
(lognormal, coefficient of variation 0.3); they are followed to the end of the movement.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from damagepred.assembly import Model, wall_geometry, wall_model
from damagepred.scene import Dpc, Joint, Loads, Movement, Opening, Scene, Wall
from studies.benchmarks.stress.case import RIGID, WAYS, Case
from studies.benchmarks.stress.joints import moved

SEED = 2026


def tables(number: int, most: int = 60, rng: np.random.Generator | None = None) -> dict[str, Any]:
    """Return the tables of a scene of about ``most`` blocks, from a generator, by default seeded with the number."""
    rng = np.random.default_rng([SEED, number]) if rng is None else rng

    def log(low: float, high: float) -> float:
        return float(10.0 ** rng.uniform(np.log10(low), np.log10(high)))

    def sometimes(share: float, low: float, high: float) -> float:
        return log(low, high) if rng.random() > share else 0.0

    courses, units = int(rng.integers(1, 9)), int(rng.integers(1, 9))
    while courses * units > most:
        courses, units = max(1, courses // 2), max(1, units // 2)
    block_length, block_height = round(log(0.05, 1.0), 3), round(log(0.03, 0.5), 3)
    length, height = round(units * block_length, 4), round(courses * block_height, 4)
    friction = float(rng.choice([0.0, 0.3, 0.75, 1.2, 2.0]))
    strength, cohesion = sometimes(0.2, 1e2, 1e8), sometimes(0.2, 1e2, 1e8)
    joint: dict[str, Any] = {
        "normal_stiffness": log(1e8, 1e13),
        "tensile_strength": strength,
        "cohesion": cohesion,
        "friction": friction,
    }
    joint["shear_stiffness"] = joint["normal_stiffness"] * log(0.05, 2.0)
    law = rng.choice(["plain", "plain", "plain", "dilation", "brittle_shear", "softening", "residual"])
    if law == "dilation":
        joint["dilation"] = friction * float(rng.uniform(0.0, 1.0))
    elif law == "brittle_shear":
        joint["brittle_shear"] = True
    elif law == "softening":
        joint["fracture_energy"] = log(0.1, 100.0)
    elif law == "residual":
        joint |= {"residual_cohesion": 0.1 * cohesion, "residual_friction": 0.7 * friction}
    found: dict[str, Any] = {
        "title": f"random scene {number}",
        "wall": {
            "length": length,
            "height": height,
            "block_length": block_length,
            "block_height": block_height,
            "thickness": log(0.05, 0.5),
            "bond": str(rng.choice(["running", "running", "stack"])),
        },
        "block": {"elastic_modulus": log(1e8, 1e11), "density": sometimes(0.05, 1e2, 1e4)},
        "joint": joint,
        "movement": {
            "kind": str(rng.choice(["dishing", "doming"])),
            "central_deflection": sometimes(0.05, 1e-7, 0.1),
            "increments": int(rng.choice([1, 2, 5])),
            "shape": str(rng.choice(["three_loads", "parabola", "arc"])),
        },
        "loads": {"roof": sometimes(0.4, 10.0, 1e5)},
    }
    if rng.random() < 0.4 and courses > 1:
        found["dpc"] = {"course": 1, "friction": float(rng.uniform(0.0, 1.0))}
    if rng.random() < 0.3 and courses > 2 and units > 2:
        wide, high = float(rng.uniform(0.2, 0.6)) * length, float(rng.uniform(0.2, 0.6)) * height
        found["opening"] = [
            {
                "x": round(float(rng.uniform(0.1, 0.9)) * (length - wide), 3),
                "width": round(wide, 3),
                "y": round(float(rng.uniform(0.1, 0.9)) * (height - high), 3),
                "height": round(high, 3),
            }
        ]
    return found


LAWS: dict[str, dict[str, Any]] = {
    "paper": {},
    "dilation": {"dilation": 0.1},
    "residual_friction": {"residual_friction": 0.35},
    "brittle_shear": {"brittle_shear": True},
    "softening": {"fracture_energy": 10.0},
    "residual_strength": {"residual_tensile_strength": 0.01e6, "residual_cohesion": 0.02e6},
}
"""Laws of the joints, by name."""


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
    ), rng


def model_of_wall(_: bool, number: int, law: str) -> Model:
    """Return the model of a wall whose joints all differ in strength."""
    scene, rng = random_wall(number, law)
    strength, joints = rng.uniform(0.05e6, 0.45e6), len(wall_geometry(scene).joints.kind)
    sigma = np.sqrt(np.log(1.0 + 0.3**2))
    spread = rng.lognormal(-0.5 * sigma**2, sigma, size=(2, joints))
    fields = {"joint.tensile_strength": strength * spread[0], "joint.cohesion": 0.85 * strength * spread[1]}
    return wall_model(scene, fields)


def cases(scenes: int = 120, all_ways: int = 30, walls: int = 30) -> list[Case]:
    """Return walls with each of six laws; and random scenes, the first also with deformable blocks and in time."""
    made = []
    for law in LAWS:
        for number in range(walls):
            make, count = partial(model_of_wall, number=number, law=law), random_wall(number)[0].movement.increments
            made.append(Case("six laws", f"{law}, wall {number}", make, increments=count, ways=RIGID[:1]))
    for number in range(scenes):
        found = tables(number)
        make, count = partial(scene, found), found["movement"]["increments"]
        ways = WAYS if number < all_ways else RIGID[:2]
        made.append(Case("random scenes", f"scene {number}", make, increments=count, dynamics=moved, ways=ways))
    return made


def scene(found: dict[str, Any], _: bool) -> Scene:
    """Return the scene of some tables."""
    return Scene.from_dict(found)
