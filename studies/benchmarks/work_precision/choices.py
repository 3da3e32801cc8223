"""Every choice that changes how a wall is solved, one at a time from the defaults; and the references."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from damagepred.scene import Dynamics, Scene
from damagepred.scene.accuracy import PRESETS, preset

FINE = {"blocks": "deformable"}
SOLID = "same model"
FINEST = "finest model"


@dataclass(frozen=True)
class Choice:
    """One way to solve a wall.

    Attributes
    ----------
    axis : str
        What is varied.
    value : str
        To what; with ``axis`` it names the choice.
    solver : dict
        Keys of ``[solver]``.
    increments : int
        Of the movement.
    dynamics : dict or None
        Keys of ``[dynamics]``, of a run in time.
    model : bool
        Whether it changes the model of the wall, and not only how its equations are solved.
    """

    axis: str
    value: str
    solver: dict[str, Any] = field(default_factory=dict)
    increments: int = 20
    dynamics: dict[str, Any] | None = None
    model: bool = False

    @property
    def name(self) -> str:
        """Axis and value."""
        return f"{self.axis}: {self.value}"

    def scene(self, scene: Scene) -> Scene:
        """Return a wall that is solved so."""
        return replace(
            scene,
            solver=replace(scene.solver, **self.solver),
            movement=replace(scene.movement, increments=self.increments),
            dynamics=None if self.dynamics is None else Dynamics(**self.dynamics),
        )


def _axis(axis: str, key: str, values: list[Any], model: bool = False, **more: Any) -> list[Choice]:
    return [Choice(axis, f"{value:g}", {key: value, **more}, model=model) for value in values]


def numerical() -> list[Choice]:
    """Return choices that change how the equations of one model are solved: rigid blocks, 3 contacts a joint."""
    strict = {"tolerance": 1e-9, "condense": False, "symmetric_half": False}
    explicit = {"method": "explicit"}
    slow = {**explicit, "ramp_cycles": 30_000, "tolerance": 1e-5, "maximum_cycles": 2_000_000}
    time = {"duration": 0.4, "outputs": 4, "new_contacts": False}
    return [
        Choice("default", "quasi-static"),
        *[Choice("increments", str(n), increments=n) for n in (4, 8, 40, 80)],
        *_axis("tolerance", "tolerance", [1e-1, 1e-2, 1e-3, 1e-4, 1e-9]),
        Choice("skips", "not condensed", {"condense": False}),
        Choice("skips", "whole wall", {"symmetric_half": False}),
        Choice(SOLID, "160 increments", strict, increments=160),
        Choice(SOLID, "320 increments", strict, increments=320),
        Choice("explicit", "default", explicit),
        *[Choice("explicit increments", str(n), explicit, increments=n) for n in (4, 80)],
        *_axis("explicit damping", "damping", [0.3, 0.5, 0.9, 0.95], **explicit),
        *_axis("explicit ramp", "ramp_cycles", [100, 300, 1000, 3000], **explicit),
        *_axis("explicit tolerance", "tolerance", [1e-1, 1e-2, 1e-4, 1e-5], **explicit),
        *_axis("explicit time step", "time_step_safety", [0.5, 0.7, 1.0], **explicit),
        Choice("explicit", "slow", slow),
        *[
            Choice(
                "in time, true mass",
                f"local 0.8, {t:g} s",
                dynamics={**time, "duration": 2.0 * t, "movement_time": t, "damping": "local"},
            )
            for t in (0.05, 0.2)
        ],
        *[
            Choice(
                "in time, true mass",
                f"{kind}, 0.2 s",
                dynamics={
                    **time,
                    "movement_time": 0.2,
                    "damping": kind,
                    "damping_ratio": 0.3,
                    "frequency": 20.0,
                    "second_frequency": 2000.0,
                },
            )
            for kind in ("viscous", "rayleigh")
        ],
    ]


def of_the_model() -> list[Choice]:
    """Return choices that change the model: what the wall is made of."""
    found = [
        *[Choice("contacts", f"Lobatto {n}", {"contacts_per_interface": n}, model=True) for n in (2, 4, 5, 7, 9)],
        *[
            Choice("contacts", f"midpoint {n}", {"quadrature": "midpoint", "contacts_per_interface": n}, model=True)
            for n in (2, 3, 5, 9)
        ],
        Choice("rigid blocks", "not lumped", {"lump_block_elasticity": False}, model=True),
        Choice("elastic blocks", "Lobatto 3", {"blocks": "elastic"}, model=True),
        Choice("elastic blocks", "Lobatto 5", {"blocks": "elastic", "contacts_per_interface": 5}, model=True),
        Choice("auto", "10 %", {"blocks": "auto", "rigid_error": 0.1}, model=True),
        Choice("auto", "3 %", {"blocks": "auto", "rigid_error": 0.03}, model=True),
        Choice("auto", "1 %", {"blocks": "auto", "rigid_error": 0.01}, model=True),
        *[
            Choice(
                "auto",
                f"{share:.0%}, 40 mm".replace("%", " %"),
                {"blocks": "auto", "rigid_error": share, "zone_size": 0.04},
                model=True,
            )
            for share in (0.1, 0.03, 0.01)
        ],
        Choice("parts", "below the dpc deformable", {"below_dpc": "deformable"}, model=True),
        Choice("parts", "below the dpc deformable, 40 mm", {"below_dpc": "deformable", "zone_size": 0.04}, model=True),
        Choice("zones", "default size", FINE, model=True),
        *[Choice("zones", f"{1e3 * size:g} mm", {**FINE, "zone_size": size}, model=True) for size in (0.06, 0.04)],
        *[
            Choice("zones", f"default size, Lobatto {n}", {**FINE, "contacts_per_interface": n}, model=True)
            for n in (5, 7)
        ],
        Choice("zones", "60 mm, Lobatto 5", {**FINE, "zone_size": 0.06, "contacts_per_interface": 5}, model=True),
        Choice(FINEST, "40 mm, Lobatto 5", {**FINE, "zone_size": 0.04, "contacts_per_interface": 5}, model=True),
        Choice(FINEST, "40 mm, Lobatto 7", {**FINE, "zone_size": 0.04, "contacts_per_interface": 7}, model=True),
        Choice(FINEST, "30 mm, Lobatto 7", {**FINE, "zone_size": 0.03, "contacts_per_interface": 7}, model=True),
    ]
    return found


def presets() -> list[Choice]:
    """Return the presets of the explicit solver; those of the quasi-static one are other choices, see ``PRESET``."""
    return [
        Choice("preset, explicit", accuracy, {**preset(accuracy, "explicit"), "method": "explicit"}, model=True)
        for accuracy in PRESETS
    ]


PRESET = {
    "draft": ("contacts", "midpoint 2"),
    "standard": ("default", "quasi-static"),
    "fine": ("elastic blocks", "Lobatto 3"),
    "reference": (FINEST, "40 mm, Lobatto 5"),
}
"""Which choice each preset of the quasi-static solver is."""


def choices() -> list[Choice]:
    """Return all choices."""
    return [*numerical(), *of_the_model(), *presets()]


SPARED = {
    "large": {
        *("in time, true mass", "explicit damping", "explicit time step", "explicit increments", "explicit ramp"),
        *("explicit tolerance", "rigid blocks", "skips", "auto", "finest model", "preset, explicit"),
    },
    "window": {"auto"},
    "no dpc": {"auto", "parts"},
    "small": {"parts"},
}
"""Axes that a wall is spared: on the large wall they say what smaller walls say, and take long.

The window wall and that without a dpc have no converged model to compare "auto" with, and the last two have no dpc.
"""
SLOW = {
    "large": ("slow", "Lobatto 7", "40 mm", "zones: default size"),
    "window": ("finest model",),
    "no dpc": ("finest model",),
}
"""Parts of the names of choices that a wall is spared: walls of zones that crack all over take many minutes."""


def for_scene(name: str) -> list[Choice]:
    """Return the choices that mean something for a wall."""
    found = [c for c in choices() if c.axis not in SPARED.get(name, ())]
    slow = SLOW.get(name, ())
    if name not in ("small", "stack"):
        slow += ("preset, explicit: reference",)  # bricks of zones by the explicit solver
    if name in ("window", "no dpc"):
        found = [c for c in found if "Lobatto 7" not in c.value or c.axis == "contacts"]
    return [c for c in found if not any(part in c.name for part in slow)]
