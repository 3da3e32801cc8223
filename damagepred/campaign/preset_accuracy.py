"""Presets of ``[solver]``: their keys, and the errors measured with them on similar walls, for ``check``."""

from __future__ import annotations

from damagepred.scene import Scene
from damagepred.scene.accuracy import PRESETS, Measured, measured, preset

LARGEST_SILENT_FLOOR = 0.01
"""Relative error of a reference above which the lines show it."""
DAMAGE = ("widest crack", "damage category")
"""Quantities whose error is always shown, or reported as unknown."""


def accuracy_lines(scene: Scene) -> list[str]:
    """Keys of each preset for the solver of a scene, and errors measured on walls with the same dpc and openings."""
    method = scene.solver.method
    rows = [row for row in measured() if row.method == method]
    similar = [row for row in rows if (row.dpc, row.opening) == (scene.dpc is not None, bool(scene.opening))]
    which = "walls like it" if similar else "other walls"
    similar = similar or rows
    head = f'  accuracy = "{scene.solver.accuracy}"{_exceptions(scene)}; largest errors measured on {which}'
    lines = [f"{head} ({_walls(similar)}):"]
    for accuracy in PRESETS:
        of_preset = [row for row in similar if row.accuracy == accuracy]
        others = [row for row in rows if row.accuracy == accuracy]
        lines.append(f"    {accuracy}: {_sets(accuracy, method)}")
        if of_preset:
            lines.append(f"      {_errors(of_preset)}")
        lines += [f"      {_elsewhere(q, others)}" for q in DAMAGE if all(row.quantity != q for row in of_preset)]
    return lines


def _exceptions(scene: Scene) -> str:
    """Keys of the scene that differ from its preset."""
    values = preset(scene.solver.accuracy, scene.solver.method)
    other = [key for key, value in values.items() if getattr(scene.solver, key) != value]
    return f", except {', '.join(other)}" if other else ""


def _sets(accuracy: str, method: str) -> str:
    keys = PRESETS[accuracy][method]
    return ", ".join(f"{key} = {_value(value)}" for key, value in keys.items()) or "the defaults"


def _value(value: object) -> str:
    return f'"{value}"' if isinstance(value, str) else f"{value:g}" if isinstance(value, float) else str(value)


def _walls(rows: list[Measured]) -> str:
    return "; ".join(dict.fromkeys(row.wall for row in rows))


def _errors(rows: list[Measured]) -> str:
    worst = [_worst(quantity, rows) for quantity in dict.fromkeys(row.quantity for row in rows)]
    times = sorted(row.times for row in rows)
    span = f"{times[0]:.2g}" + (f"-{times[-1]:.2g}" if times[-1] > 1.1 * times[0] else "")
    return f"{span} times the time of standard; {', '.join(worst)}"


def _worst(quantity: str, rows: list[Measured]) -> str:
    """Largest error of a quantity, with the uncertainty of its reference."""
    worst = max((row for row in rows if row.quantity == quantity), key=lambda row: row.error)
    error = f"{worst.error:.0f}" if quantity == "damage category" else _percent(worst.error)
    sure = f" (known to {_percent(worst.floor)})" if worst.floor > LARGEST_SILENT_FLOOR else ""
    return f"{quantity} {error}{sure}"


def _elsewhere(quantity: str, rows: list[Measured]) -> str:
    """Error of a quantity on other walls, where no wall like this one has it."""
    have = [row for row in rows if row.quantity == quantity]
    if not have:
        return f"{quantity}: error unknown, on no wall"
    return f"{quantity}: error unknown on walls like it; on other walls ({_walls(have)}) {_worst(quantity, have)}"


def _percent(share: float) -> str:
    return "0 %" if share < 5e-6 else f"{100 * share:.2g} %"
