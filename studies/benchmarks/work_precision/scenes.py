"""The walls of the diagrams, with their descriptions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from damagepred.scene import Damage, Dpc, Joint, Loads, Movement, Scene, Wall

DATA = Path(__file__).resolve().parents[3] / "data"


class Place(NamedTuple):
    """A wall of the diagrams.

    Attributes
    ----------
    scene : Scene
        With the default settings of ``[solver]`` and 20 increments.
    what : str
        Description.
    """

    scene: Scene
    what: str


def _bryant(name: str) -> Scene:
    scene = Scene.from_toml(DATA / f"bryant_{name}.toml")
    return replace(scene, movement=replace(scene.movement, increments=20))


def scenes() -> dict[str, Place]:
    """Return the walls by name."""
    solid, window = _bryant("dishing"), _bryant("window_dishing")
    strong = replace(window.joint, tensile_strength=100e6, cohesion=200e6)
    small = Scene(
        title="small wall that softens",
        wall=Wall(length=1.44, height=0.6),
        joint=Joint(tensile_strength=0.1e6, cohesion=0.1e6, fracture_energy=10.0),
        movement=Movement(kind="doming", central_deflection=4e-3),
        loads=Loads(roof=80e3),
    )
    stack = Scene(
        title="small stack",
        wall=Wall(length=0.96, height=0.45, bond="stack"),
        dpc=Dpc(course=1),
        movement=Movement(kind="dishing", central_deflection=0.25e-3),
        damage=Damage(dpc_threshold=1e-4),
    )
    factor = 17.0 / 6.0
    large = replace(
        solid,
        title="large wall",
        wall=replace(solid.wall, length=17.04, height=6.75),
        movement=replace(solid.movement, central_deflection=8e-3 * factor),
        loads=Loads(roof=6000.0 * factor),
    )
    return {
        "dishing": Place(solid, "test wall, dishing to 8 mm: parts along its dpc"),
        "doming": Place(_bryant("doming"), "test wall, doming to 7 mm: hangs over at both ends"),
        "window": Place(window, "test wall with a window, dishing to 8 mm: cracks under the sill"),
        "window, strong": Place(
            replace(window, joint=strong), "test wall with a window, of mortar that does not break: there is one answer"
        ),
        "no dpc": Place(replace(solid, dpc=None), "test wall without a dpc, dishing to 8 mm: cracks from below"),
        "small": Place(small, "1.44 m x 0.6 m, no dpc, heavily loaded, doming to 4 mm, bonds soften (10 N/m)"),
        "stack": Place(stack, "0.96 m x 0.45 m in stack bond on a dpc, dishing to 0.25 mm: no bond breaks"),
        "large": Place(large, "17 m x 6.75 m of the same bricks, dishing by the same ratio"),
    }
