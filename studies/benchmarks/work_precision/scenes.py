"""The walls, with the default settings of ``[solver]`` and 20 increments; README.md describes them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from damagepred.scene import Damage, Dpc, Joint, Loads, Movement, Scene, Wall

DATA = Path(__file__).resolve().parents[3] / "data"


def _bryant(name: str) -> Scene:
    scene = Scene.from_toml(DATA / f"bryant_{name}.toml")
    return replace(scene, movement=replace(scene.movement, increments=20))


def scenes() -> dict[str, Scene]:
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
        "dishing": solid,
        "doming": _bryant("doming"),
        "window": window,
        "window, strong": replace(window, joint=strong),
        "no dpc": replace(solid, dpc=None),
        "small": small,
        "stack": stack,
        "large": large,
    }
