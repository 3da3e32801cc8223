"""Tables of results, made once: the page of a report and the terminal render the same columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from damagepred.formatting import length, named, number
from damagepred.rejudge import has_dpc, shown_gaps

if TYPE_CHECKING:
    import pandas as pd

MM = 1e3
"""Millimetres in a metre."""


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes
    ----------
    name : str
        Head on the page, without the unit; empty: not on the page.
    cells : sequence of str
        Formatted values.
    unit : str
        Of the values.
    short : str
        Head on the terminal, in lines; empty: not on the terminal.
    short_cells : sequence of str, optional
        Briefer cells for the terminal.
    words : bool
        Whether the cells are words, which stand to the left on the page.
    """

    name: str
    cells: Sequence[str]
    unit: str = ""
    short: str = ""
    short_cells: Sequence[str] | None = None
    words: bool = False

    @property
    def head(self) -> str:
        """Head on the page, with the unit."""
        return f"{self.name} ({self.unit})" if self.unit else self.name


def path_columns(ds: xr.Dataset) -> list[Column]:
    """Return movement, cracks, category and gaps of a wall, a row an increment.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall.
    """

    def shown(name: str, digits: str, factor: float = MM) -> list[str]:
        return [f"{factor * float(v):{digits}}" for v in ds[name].values]

    in_time = "time" in ds.variables
    columns = []
    if in_time:
        columns.append(Column("time", shown("time", ".3f", 1.0), "s", "time\ns"))
    if "surface_movement" in ds.variables:
        surface = [number(MM * float(v)) for v in ds["surface_movement"].values]
        columns.append(Column("surface movement", surface, "mm", "surface\nmovement\nmm"))
    deflection = shown("central_deflection", ".2f")
    columns.append(Column("deflection", deflection, "mm", "" if in_time else "deflection\nmm"))
    columns.append(Column("widest crack", shown("crack_width_max", ".3f"), "mm", "widest\ncrack\nmm"))
    if "crack_count" in ds.variables:
        columns.append(Column("cracks", shown("crack_count", ".0f", 1.0)))
    categories = [f"{c} {name}" for c, name in zip(ds["damage_category"].values, category_names(ds))]
    unbroken = [category.replace(" ", "\u00a0") for category in categories]
    if has_bands := "crack_band_width_max" in ds.variables:
        bands, by_band = shown("crack_band_width_max", ".3f"), shown("damage_category_band", ".0f", 1.0)
        both = [f"{band} ({category})" for band, category in zip(bands, by_band)]
        columns.append(Column("", both, short="band, mm\nand its\ncategory"))
    columns.append(Column("category", unbroken, "", "damage\ncategory", categories, words=True))
    if has_bands:
        columns += [Column("crack band", bands, "mm"), Column("category by band", by_band)]
    for part in shown_gaps(ds):
        what, brief = {"dpc": ("dpc", "dpc"), "footing": ("bed on footing", "bed")}[part]
        separation = ds[f"{part}_separation_length"]
        # a gap below a dpc that is nowhere wider than the threshold is for the page
        on_terminal = part == "dpc" or not has_dpc(ds) or bool(separation.values.any())
        threshold = float(separation.attrs.get("opening_threshold", np.nan))
        heads = (f"{brief}\nopening\nmm", f"{brief}\nopen\n> {MM * threshold:g}\nmm, m") if on_terminal else ("", "")
        columns.append(Column(f"{what} opening", shown(f"{part}_opening_max", ".3f"), "mm", heads[0]))
        cells = shown(f"{part}_separation_length", ".2f", 1.0)
        columns.append(Column(f"{what} open by over {length(threshold)}", cells, "m", heads[1]))
    for i in range(ds.sizes.get("opening", 0)):
        wider = [f"{MM * v:+.3f}" for v in ds["opening_width_change"].values[:, i]]
        columns.append(Column(f"opening {i + 1} wider by", wider, "mm", f"opening\n{i + 1} wider\nmm"))
    return columns


def category_names(ds: xr.Dataset) -> list[str]:
    """Return the name of the damage category at each increment of a wall."""
    names = str(ds["damage_category"].attrs.get("flag_meanings", "")).split()
    return [named(names[c]) if 0 <= c < len(names) else "not known" for c in ds["damage_category"].values]


def crack_columns(frame: pd.DataFrame, in_time: bool = False) -> list[Column]:
    """Return number, part, width, length, course and origin of cracks, a row a crack.

    Parameters
    ----------
    frame : pandas.DataFrame
        Of one increment, as ``crack_frame`` returns it.
    in_time : bool
        Whether the wall was run in time: cracks then begin at no deflection.
    """
    runs, brief = [], []
    for one in frame.to_dict("records"):
        name = str(one["crack_orientation"])
        slope = f"{one['crack_inclination']:.0f}°" if name in ("stepped", "diagonal") else ""
        through = one["crack_length_through_blocks"] > 0
        runs.append(", ".join(filter(None, (named(name), slope, "through bricks" if through else ""))))
        brief.append(" ".join(filter(None, (name, slope))) + ("*" if through else ""))
    parts = [named(str(part)) for part in frame["crack_part"]]

    def in_mm(head: str, name: str, short: str) -> Column:
        values = [MM * float(v) for v in frame[name]]
        return Column(head, [number(v, 3) for v in values], "mm", short, [f"{v:.2f}" for v in values])

    places = list(zip(frame["crack_x"], frame["crack_y"]))
    columns = [
        Column("crack", [str(n) for n in frame["crack"]], short="no"),
        Column("part", parts, short="part", short_cells=[p.replace("opening", "open") for p in parts], words=True),
        in_mm("width", "crack_width", "width\nmm"),
        in_mm("opening and slip", "crack_displacement", "with\nslip"),
        Column("length", [f"{v:.2f}" for v in frame["crack_length"]], "m", "length\nm"),
        Column("how it runs", runs, short="how it\nruns", short_cells=brief, words=True),
        Column(
            "widest at x, y",
            [f"{x:.2f}, {y:.2f}" for x, y in places],
            "m",
            "widest\nat m",
            short_cells=[f"{x:.2f},{y:.2f}" for x, y in places],
        ),
    ]
    if not in_time:
        columns.append(in_mm("began at a deflection of", "first_central_deflection", "began\nat mm"))
    return columns
