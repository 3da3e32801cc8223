"""Parts of the pages of a house: plan, unfolded drawing, tables of walls, corners and rooms."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from damagepred.archive.schema import category_label
from damagepred.formatting import chance, length, number, with_band
from damagepred.report.parts import Part, drawing
from damagepred.report.quality import categories
from damagepred.results.house import house_of, unfolded, wall_dataset, wall_names
from damagepred.results.tables import Table, corner_columns, room_columns, wall_columns
from damagepred.uq.exceedance import exceedance
from damagepred.uq.intensity import movement_measure, movement_words
from damagepred.uq.movement_distribution import MovementDistribution

RULE = "The category of a house is the category of its worst wall."


def house_drawings(ds: xr.Dataset, caption: str = "", walls: Mapping[str, xr.Dataset] | None = None) -> list[Part]:
    """Plan with the category of each wall, and the walls unfolded, which a reader moves."""
    from damagepred.plotting.house import draw_plan, draw_unfolded

    return [
        drawing(
            "plan",
            f"{caption}Plan with the movement of the ground and the damage category of each wall. {RULE}",
            "Plan of the house with the movement of the ground and the damage category of each wall",
            draw_plan(house_of(ds), ds),
        ),
        drawing(
            "unfolded",
            f"{caption}The walls side by side, cracks coloured by category; displacements exaggerated.",
            "Walls of the house side by side, deformed, with their cracks",
            draw_unfolded(ds),
            walls={name: unfolded(one) for name, one in (walls or {"the house": ds}).items()},
        ),
    ]


def house_facts(ds: xr.Dataset) -> list[tuple[str, str]]:
    """Movement, category, damaged walls and corners of a house at the end of its path."""
    names, widths = wall_names(ds), ds["wall_crack_width_max"].values[-1]
    category = ds["wall_damage_category"].values[-1]
    damaged = [f"{name} ({c})" for name, c in zip(names, category) if c >= 1]
    slip, sides = ds["corner_slip_max"].values[-1], ("first", "second")
    facts = [
        ("Movement", f"{movement_words(ds)} of {length(float(ds[movement_measure(ds)].values[-1]))}"),
        ("House", f"category {category_label(ds, int(category.max()))}, of its worst wall, {names[category.argmax()]}"),
        ("Damaged walls", f"{len(damaged)} of {len(names)}" + (f": {', '.join(damaged)}" if damaged else "")),
        ("Widest crack", f"{length(float(widths.max()))}, in wall {names[int(widths.argmax())]}"),
    ]
    if slip.size:
        meet = " and ".join(names[int(ds[f"corner_{side}_wall"][slip.argmax()])] for side in sides)
        facts.append(("Largest slip at a corner", f"{length(float(slip.max()))}, between {meet}"))
    return facts


def house_damage(ds: xr.Dataset) -> list[Part]:
    """Axonometric drawing, and tables of walls, corners and rooms, at the end of the path."""
    from damagepred.plotting.house import draw_axonometric

    view, rooms = draw_axonometric(ds), room_columns(ds)
    for shapes in view.collections:
        shapes.set_rasterized(True)
    parts: list[Part] = [
        drawing(
            "house",
            "The deformed house. Across its plane a wall follows, in the drawing alone, the walls that meet it.",
            "Axonometric drawing of the deformed house with its cracks",
            view,
        ),
        Table.of("Walls at the end of the path", wall_columns(ds), RULE),
        Table.of("Where walls meet: vertical shear and slip", corner_columns(ds), "Forces of the first wall."),
    ]
    if rooms[0].cells:
        parts.append(Table.of("Sides of the rooms", rooms, "A side is a wall between the corners of a room."))
    return parts


def walls_table(ds: xr.Dataset, at: MovementDistribution, confidence: float) -> Table:
    """Probability of each category or worse, of each wall and of the house."""
    rows = []
    for name in (*wall_names(ds), ""):
        one = wall_dataset(ds, name) if name else ds
        found = [exceedance(one, c, at, confidence=confidence).estimate for c, _ in categories(ds)]
        cells = (with_band(chance(e.value), chance(e.lower), chance(e.upper), "\n") for e in found)
        rows.append([name or "house", *cells])
    heads = ["wall", *(f"category {label} or worse" for _, label in categories(ds))]
    damaged = ds["damaged_walls"].values if "damaged_walls" in ds else np.empty(0)
    note = f"{RULE} With {confidence:.0%} intervals."
    if damaged.ndim == 2:
        note += f" Damaged walls per house, on average: {number(float(np.nanmean(np.nanmax(damaged, axis=1))), 2)}."
    return Table("Probability of damage by wall", heads, rows, note=note)
