"""Walls, and choices of how they are solved: those of ``walls.toml`` and ``choices.toml``, and the presets."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from damagepred.scene import Scene
from damagepred.scene.accuracy import PRESETS, preset
from studies.benchmarks import walls

HERE = Path(__file__).resolve().parent
SOLID, FINEST = "same model", "finest model"
PRESET = {
    "draft": ("contacts", "midpoint 2"),
    "standard": ("default", "quasi-static"),
    "fine": ("elastic blocks", "Lobatto 3"),
    "reference": (FINEST, "40 mm, Lobatto 5"),
}
"""Which choice each preset of the quasi-static solver is."""


@dataclass(frozen=True)
class Choice:
    """Way to solve a wall: what is varied, to what, keys of ``[solver]``, increments, whether the model changes."""

    axis: str
    value: str
    solver: dict[str, Any] = field(default_factory=dict)
    increments: int = 20
    model: bool = False

    def scene(self, scene: Scene) -> Scene:
        """Return a wall that is solved so; bricks are rigid where ``solver`` states none."""
        return walls.changed(
            scene, {"solver": {"blocks": "rigid", **self.solver}, "movement": {"increments": self.increments}}
        )


@cache
def choices() -> list[Choice]:
    """Return all choices."""
    known = walls.read(HERE / "choices.toml")
    found = [Choice(**one, model=kind == "model") for kind in ("numerical", "model") for one in known[kind]]
    own = [(name, {**preset(name, "explicit"), "method": "explicit"}) for name in PRESETS]
    return found + [Choice("preset, explicit", name, solver, model=True) for name, solver in own]


def for_scene(name: str) -> list[Choice]:
    """Return the choices that mean something for a wall."""
    spared = walls.read(HERE / "choices.toml")["spared"].get(name, [])
    if name not in ("small", "stack"):
        spared.append("preset, explicit: reference")  # bricks of zones by the explicit solver
    return [c for c in choices() if not any(part in f"{c.axis}: {c.value}" for part in spared)]


@cache
def scenes() -> dict[str, Scene]:
    """Return the walls by name, with the default settings and 20 increments; README.md describes them."""
    return {name: walls.scene(tables) for name, tables in walls.read(HERE / "walls.toml").items()}
