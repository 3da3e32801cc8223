"""The four walls of the test, the ways to load them, and their scenes."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from damagepred.scene import Rig, Scene
from damagepred.scene.concrete import ReinforcedConcrete

HERE = Path(__file__).resolve().parent
DATA = HERE.parents[1] / "data"
NAMES = ("dishing", "doming", "window_dishing", "window_doming")
GRADE, MESH = "N25", "3-L11TM"
"""Concrete and mesh of the footing, top and bottom: typical of house footings, those of the tested beam are not
reported."""
STEP = 0.2e-3
"""Movement of an increment (m): the paper's 1 mm and 6 mm, and the test's 7 and 8 mm, are among them."""


@dataclass(frozen=True)
class Case:
    """One wall of the test as the paper loads it, deflections drawn (m), results, opposite deflection (m)."""

    name: str
    scene: Scene
    shown: tuple[float, ...]
    test: dict[str, Any]
    other_way: float

    @property
    def has_window(self) -> bool:
        """Whether the wall has a window."""
        return bool(self.scene.opening)

    @property
    def deflection(self) -> float:
        """Of the test at its end (m)."""
        return self.scene.movement.central_deflection


def results_of_the_test() -> dict[str, Any]:
    """Return the reported results of the test and of the paper's model."""
    return tomllib.loads((DATA / "test_results" / "bryant_1993.toml").read_text(encoding="utf-8"))


def read_case(name: str) -> Case:
    """Read one case."""
    settings = tomllib.loads((HERE / "cases.toml").read_text(encoding="utf-8"))[name]
    described = Scene.from_toml(DATA / settings["scene"])
    test = results_of_the_test()
    to = end_of_the_test(name)
    movement = replace(described.movement, central_deflection=to, increments=round(to / STEP))
    return Case(
        name,
        replace(described, movement=movement),
        tuple(settings["shown"]),
        test[name],
        end_of_the_test(counterpart(name)),
    )


def end_of_the_test(name: str) -> float:
    """Return the largest deflection of a test (m); for a window wall, not reported, that of the solid wall."""
    test = results_of_the_test()
    return float(test[name.removeprefix("window_")]["central_deflection"])


def on_jacks(scene: Scene, concrete: ReinforcedConcrete | None = None) -> Scene:
    """Return a wall on its footing on the rig: fixed supports, three equal jacks, from the level state."""
    return replace(
        scene,
        movement=replace(scene.movement, shape="jacks"),
        rig=Rig(support="held", control="deflection", stop_at_zero=True),
        footing=replace(scene.footing, concrete=concrete),
    )


def further(scene: Scene) -> Scene:
    """Return a wall on jacks up to the full deflection, with jacks and supports that can pull."""
    return replace(scene, rig=replace(scene.rig, stop_at_zero=False))


def virgin() -> ReinforcedConcrete:
    """Return the uncracked reinforced concrete of the footing."""
    return ReinforcedConcrete(grade=GRADE, bottom=MESH)


def bent_before(moment: float) -> ReinforcedConcrete:
    """Return concrete cracked by an earlier moment (Nm) of both signs, with tension stiffening after EN 1992."""
    return replace(virgin(), earlier_moment=moment, tension_stiffening=0.5)


def counterpart(name: str) -> str:
    """Return the case of the opposite movement."""
    return name.replace("dishing", "doming") if "dishing" in name else name.replace("doming", "dishing")
