"""The walls for both solvers; name and number determine each."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model, wall_geometry, wall_model
from damagepred.errors import InputError
from damagepred.scene import BlockMaterial, Dpc, Joint, Loads, Movement, Opening, Scene, Wall

DATA = Path(__file__).resolve().parents[2] / "data"
BRYANT = ("bryant_dishing", "bryant_doming", "bryant_window_dishing", "bryant_window_doming")
UNBREAKABLE = {"tensile_strength": 100e6, "cohesion": 200e6}
INCREMENTS = 16
"""Increments of the random walls whose mortar does not break; with few, waves of the explicit solver remain."""


class Case(NamedTuple):
    """A wall by name, with the strengths of its joints where they differ."""

    name: str
    scene: Scene
    fields: dict[str, FloatArray]

    def model(self) -> Model:
        """Model of the solvers."""
        return wall_model(self.scene, self.fields)


def steady_cases(count: int) -> list[Case]:
    """Walls of the test with their own and with unbreakable mortar, and random walls with unbreakable mortar."""
    cases = []
    for name in BRYANT:
        scene = Scene.from_toml(DATA / f"{name}.toml")
        cases.append(Case(name, scene, {}))
        strong = replace(scene, joint=replace(scene.joint, **UNBREAKABLE))
        cases.append(Case(f"{name}, strong mortar", strong, {}))
    return cases + [Case(f"random {number}", strong_wall(number), {}) for number in numbers(count)]


@cache
def numbers(count: int) -> tuple[int, ...]:
    """Numbers of the first valid random walls: openings do not always fit the bricks."""
    valid: list[int] = []
    number = 0
    while len(valid) < count:
        with suppress(InputError):
            wall_model(strong_wall(number))
            valid.append(number)
        number += 1
    return tuple(valid)


def strong_wall(number: int) -> Scene:
    """Random wall of 0.7 to 4 m whose mortar does not break; every fourth has no dpc."""
    rng = np.random.default_rng([2027, number])
    length, height = round(float(rng.uniform(0.7, 4.0)), 2), round(float(rng.uniform(0.5, 1.6)), 2)
    opening: tuple[Opening, ...] = ()
    shape = rng.integers(0, 3) if length > 1.4 else 0
    left, width = round(float(rng.uniform(0.25, 0.5)) * length, 2), round(0.25 * length, 2)
    if shape == 1:
        opening = (Opening(x=left, y=round(0.3 * height, 2), width=width, height=round(0.35 * height, 2)),)
    if shape == 2:
        opening = (Opening(kind="door", x=left, width=width, height=round(0.7 * height, 2)),)
    dpc = Dpc(course=int(rng.integers(1, 3)), friction=float(rng.uniform(0.3, 0.7)))
    return Scene(
        title=f"random wall {number} whose mortar does not break",
        wall=Wall(
            length=length,
            height=height,
            block_length=float(rng.choice([0.24, 0.3, 0.4])),
            block_height=float(rng.choice([0.075, 0.1, 0.15])),
            bond=rng.choice(["running", "stack"]),
        ),
        opening=opening,
        dpc=None if number % 4 == 3 else dpc,
        joint=Joint(
            normal_stiffness=float(rng.uniform(20e9, 100e9)),
            shear_stiffness=float(rng.uniform(8e9, 40e9)),
            friction=float(rng.uniform(0.5, 0.9)),
            **UNBREAKABLE,
        ),
        block=BlockMaterial(elastic_modulus=float(rng.uniform(3e9, 15e9)), density=float(rng.uniform(1600, 2200))),
        movement=Movement(
            kind=rng.choice(["dishing", "doming"]),
            central_deflection=length * float(rng.uniform(0.2e-3, 1.5e-3)),
            increments=INCREMENTS,
            shape=rng.choice(["parabola", "arc", "three_loads"]),
        ),
        loads=Loads(roof=float(rng.choice([0.0, 1000.0, 6000.0]))),
    )


def brittle_case(number: int) -> Case:
    """Wall of 3 m x 1.2 m that cracks, the strengths of its joints scattered by 30 %."""
    rng = np.random.default_rng([2028, number])
    with_dpc, with_window, dishing = rng.random(3) < 0.5
    opening: tuple[Opening, ...] = ()
    if with_window:
        width, sill, top = float(rng.uniform(0.6, 1.2)), float(rng.choice([0.3, 0.6])), float(rng.choice([0.9, 1.2]))
        opening = (Opening(x=round(float(rng.uniform(0.4, 2.6 - width)), 2), y=sill, width=width, height=top - sill),)
    scene = Scene(
        title=f"brittle wall {number}",
        wall=Wall(
            length=3.0,
            height=1.2,
            block_length=float(rng.choice([0.24, 0.3])),
            block_height=float(rng.choice([0.075, 0.1, 0.12])),
        ),
        joint=Joint(friction=float(np.clip(rng.normal(0.75, 0.1), 0.4, 1.1))),
        dpc=Dpc(course=int(rng.integers(1, 3)), friction=float(rng.uniform(0.3, 0.7))) if with_dpc else None,
        opening=opening,
        movement=Movement(
            kind="dishing" if dishing else "doming",
            central_deflection=float(rng.uniform(4e-3, 12e-3)),
            increments=20,
            shape=rng.choice(["three_loads", "parabola"]),
        ),
        loads=Loads(roof=float(rng.choice([0.0, 1500.0, 6000.0]))),
    )
    strength = rng.uniform(0.05e6, 0.35e6)
    joints = len(wall_geometry(scene).joints.kind)
    sigma = np.sqrt(np.log(1.0 + 0.3**2))
    spread = rng.lognormal(-0.5 * sigma**2, sigma, size=(2, joints))
    fields = {"joint.tensile_strength": strength * spread[0], "joint.cohesion": 0.85 * strength * spread[1]}
    return Case(f"brittle {number}", scene, fields)
