"""What the presets of ``[solver]`` set, and how wrong walls like the one at hand were with them: for ``check``."""

from __future__ import annotations

from damagepred.scene import Scene
from damagepred.scene.accuracy import PRESETS, Measured, measured, preset

LARGEST_SILENT_FLOOR = 0.01
"""Relative error of a reference above which lines state it."""
DAMAGE = ("widest crack", "damage category")
"""Quantities whose error is always stated, or that it is not known."""


def accuracy_lines(scene: Scene) -> list[str]:
    """Return what each preset sets for the solver of a scene, and the errors measured with it.

    Parameters
    ----------
    scene : Scene
        With a damp-proof course and openings or without: errors are those of such walls, if there are.
    """
    method = scene.solver.method
    found = [row for row in measured() if row.method == method]
    alike = [row for row in found if (row.dpc, row.opening) == (scene.dpc is not None, bool(scene.opening))]
    which = "walls like it" if alike else "other walls"
    alike = alike or found
    own_keys = _besides(scene)
    lines = [f'  accuracy = "{scene.solver.accuracy}"{own_keys}; largest errors measured on {which} ({_walls(alike)}):']
    for accuracy in PRESETS:
        own, others = ([row for row in rows if row.accuracy == accuracy] for rows in (alike, found))
        lines.append(f"    {accuracy}: {_sets(accuracy, method)}")
        if own:
            lines.append(f"      {_errors(own)}")
        lines += [f"      {_elsewhere(q, others)}" for q in DAMAGE if all(row.quantity != q for row in own)]
    return lines


def _besides(scene: Scene) -> str:
    """Say which keys of the scene are not as its preset has them."""
    asked = preset(scene.solver.accuracy, scene.solver.method)
    other = [key for key, value in asked.items() if getattr(scene.solver, key) != value]
    return f", but for {', '.join(other)}" if other else ""


def _sets(accuracy: str, method: str) -> str:
    keys = PRESETS[accuracy][method]
    return ", ".join(f"{key} = {_value(value)}" for key, value in keys.items()) or "the defaults"


def _value(value: object) -> str:
    return f'"{value}"' if isinstance(value, str) else f"{value:g}" if isinstance(value, float) else str(value)


def _walls(rows: list[Measured]) -> str:
    return "; ".join(dict.fromkeys(row.wall for row in rows))


def _errors(rows: list[Measured]) -> str:
    told = [_worst(quantity, rows) for quantity in dict.fromkeys(row.quantity for row in rows)]
    times = sorted(row.times for row in rows)
    span = f"{times[0]:.2g}" + (f"-{times[-1]:.2g}" if times[-1] > 1.1 * times[0] else "")
    return f"{span} times the time of standard; {', '.join(told)}"


def _worst(quantity: str, rows: list[Measured]) -> str:
    """Return the largest error of a quantity, and how well it is known."""
    worst = max((row for row in rows if row.quantity == quantity), key=lambda row: row.error)
    error = f"{worst.error:.0f}" if quantity == "damage category" else _percent(worst.error)
    sure = f" (known to {_percent(worst.floor)})" if worst.floor > LARGEST_SILENT_FLOOR else ""
    return f"{quantity} {error}{sure}"


def _elsewhere(quantity: str, rows: list[Measured]) -> str:
    """Return the error of a quantity on the walls that have it, where none like the one at hand tells it."""
    have = [row for row in rows if row.quantity == quantity]
    if not have:
        return f"{quantity}: error not known, on no wall"
    return f"{quantity}: error not known on walls like it; on other walls ({_walls(have)}) {_worst(quantity, have)}"


def _percent(share: float) -> str:
    return "0 %" if share < 5e-6 else f"{100 * share:.2g} %"
