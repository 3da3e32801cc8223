"""The walls; every choice that changes how a wall is solved, one at a time from the defaults; and the references."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from damagepred.scene import Damage, Dpc, Joint, Loads, Movement, Scene, Wall
from damagepred.scene.accuracy import PRESETS, preset

DATA = Path(__file__).resolve().parents[3] / "data"
SOLID = "same model"
FINEST = "finest model"


@dataclass(frozen=True)
class Choice:
    """One way to solve a wall.

    Attributes
    ----------
    axis, value : str
        What is varied, and to what: its name.
    solver : dict
        Keys of ``[solver]``.
    increments : int
        Of the movement.
    model : bool
        Whether it changes the model of the wall, and not only how its equations are solved.
    """

    axis: str
    value: str
    solver: dict[str, Any] = field(default_factory=dict)
    increments: int = 20
    model: bool = False

    @property
    def name(self) -> str:
        """Axis and value."""
        return f"{self.axis}: {self.value}"

    def scene(self, scene: Scene) -> Scene:
        """Return a wall that is solved so."""
        solver, movement = replace(scene.solver, **self.solver), replace(scene.movement, increments=self.increments)
        return replace(scene, solver=solver, movement=movement)


def numerical() -> list[Choice]:
    """Return choices that change how the equations of one model are solved: rigid blocks, 3 contacts a joint."""
    strict = {"tolerance": 1e-9, "condense": False, "symmetric_half": False}
    explicit = {"method": "explicit"}
    slow = {**explicit, "ramp_cycles": 30_000, "tolerance": 1e-5, "maximum_cycles": 2_000_000}
    tables: dict[tuple[str, str], tuple[float, ...]] = {
        ("tolerance", "tolerance"): (1e-1, 1e-2, 1e-3, 1e-4, 1e-9),
        ("explicit damping", "damping"): (0.5, 0.95),
        ("explicit ramp", "ramp_cycles"): (100, 300, 1000, 3000),
        ("explicit tolerance", "tolerance"): (1e-2, 1e-4),
    }
    return [
        Choice("default", "quasi-static"),
        *[Choice("increments", str(n), increments=n) for n in (4, 8, 40, 80)],
        *[Choice(SOLID, f"{n} increments", strict, n) for n in (160, 320)],
        Choice("explicit", "default", explicit),
        Choice("explicit increments", "4", explicit, 4),
        Choice("explicit", "slow", slow),
        *[
            Choice(axis, f"{value:g}", {key: value} | (explicit if "explicit" in axis else {}))
            for (axis, key), values in tables.items()
            for value in values
        ],
    ]


def of_the_model() -> list[Choice]:
    """Return choices that change the model: what the wall is made of."""
    contacts, size = "contacts_per_interface", "zone_size"
    zones: dict[str, Any] = {"blocks": "deformable"}
    below: dict[str, Any] = {"below_dpc": "deformable"}
    found: list[tuple[str, str, dict[str, Any]]] = [
        *[("contacts", f"Lobatto {n}", {contacts: n}) for n in (2, 4, 5, 7, 9)],
        *[("contacts", f"midpoint {n}", {"quadrature": "midpoint", contacts: n}) for n in (2, 3, 5, 9)],
        ("rigid blocks", "not lumped", {"lump_block_elasticity": False}),
        ("elastic blocks", "Lobatto 3", {"blocks": "elastic"}),
        ("elastic blocks", "Lobatto 5", {"blocks": "elastic", contacts: 5}),
        *[
            ("auto", f"{100 * share:g} %, 40 mm", {"blocks": "auto", "rigid_error": share, size: 0.04})
            for share in (0.1, 0.03, 0.01)
        ],
        ("parts", "below the dpc deformable", below),
        ("parts", "below the dpc deformable, 40 mm", {**below, size: 0.04}),
        ("zones", "default size", zones),
        *[("zones", f"{1e3 * h:g} mm", {**zones, size: h}) for h in (0.06, 0.04)],
        *[("zones", f"default size, Lobatto {n}", {**zones, contacts: n}) for n in (5, 7)],
        ("zones", "60 mm, Lobatto 5", {**zones, size: 0.06, contacts: 5}),
        *[
            (FINEST, f"{1e3 * h:g} mm, Lobatto {n}", {**zones, size: h, contacts: n})
            for h, n in ((0.04, 5), (0.04, 7), (0.03, 7))
        ],
        # those of the quasi-static solver are other choices: see PRESET
        *[("preset, explicit", name, {**preset(name, "explicit"), "method": "explicit"}) for name in PRESETS],
    ]
    return [Choice(axis, value, solver, model=True) for axis, value, solver in found]


PRESET = {
    "draft": ("contacts", "midpoint 2"),
    "standard": ("default", "quasi-static"),
    "fine": ("elastic blocks", "Lobatto 3"),
    "reference": (FINEST, "40 mm, Lobatto 5"),
}
"""Which choice each preset of the quasi-static solver is."""


def choices() -> list[Choice]:
    """Return all choices."""
    return [*numerical(), *of_the_model()]


SPARED: dict[str, tuple[str, ...]] = {
    "large": (
        *("explicit damping", "explicit increments", "explicit ramp", "explicit tolerance", "explicit: slow"),
        *("rigid blocks", "auto", FINEST, "Lobatto 7", "40 mm", "zones: default size", "parts", "preset, explicit"),
    ),
    "window": ("auto", FINEST, "zones: default size, Lobatto 7", "parts: below the dpc deformable, 40 mm"),
    "no dpc": ("auto", FINEST, "zones: default size, Lobatto 7", "parts"),
    "small": ("parts",),
}
"""Parts of the names of choices that a wall is spared: large ones say what small ones say, and take long.

The window wall and that without a dpc have no converged model to compare "auto" with; the last two have no dpc.
"""


def for_scene(name: str) -> list[Choice]:
    """Return the choices that mean something for a wall."""
    spared = SPARED.get(name, ())
    if name not in ("small", "stack"):
        spared += ("preset, explicit: reference",)  # bricks of zones by the explicit solver
    return [c for c in choices() if not any(part in c.name for part in spared)]


def _bryant(name: str) -> Scene:
    scene = Scene.from_toml(DATA / f"bryant_{name}.toml")
    return replace(scene, movement=replace(scene.movement, increments=20))


def scenes() -> dict[str, Scene]:
    """Return the walls by name, with the default settings and 20 increments; README.md describes them."""
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
