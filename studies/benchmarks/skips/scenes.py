"""The walls on which skips are measured."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from damagepred.arrays import FloatArray
from damagepred.scene import BaseMotion, BlockMaterial, Dynamics, Joint, Loads, Movement, Scene, Solver, Wall
from damagepred.study import Study
from damagepred.study.settings import StudySettings

DATA = Path(__file__).resolve().parents[3] / "data"
WEAK = BlockMaterial(cohesion=0.12e6, friction=0.75, tensile_strength=0.08e6)
"""Bricks of which some zones yield."""


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


def explicit_deformable() -> Known:
    """Return a small wall of weak deformable bricks for the explicit solver."""
    scene = part_of_test(bryant("dishing").scene, 1.44, 0.45)
    solver = Solver(method="explicit", blocks="deformable", zone_size=0.075, maximum_cycles=1_000_000)
    return Known(replace(scene, block=WEAK, solver=solver, movement=replace(scene.movement, increments=2)))


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
    "explicit, deformable": explicit_deformable,
    "in time, falls": in_time,
    "in time, rests": in_time_at_rest,
}
"""Walls, by their names in the tables."""


def smaller(known: Known) -> Known:
    """Return a wall of a few bricks in place of a scene's, for the quick form."""
    scene = part_of_test(replace(known.scene, opening=()), 1.44, 0.45)
    return Known(replace(scene, movement=replace(scene.movement, increments=4)))
