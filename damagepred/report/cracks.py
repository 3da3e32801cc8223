"""The cracks of one wall: a drawing, and a table of the widest."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

import numpy as np
import xarray as xr

from damagepred.damage import HAIRLINE
from damagepred.report.parts import Part, Table, Text, drawing
from damagepred.report.words import length, named, number
from damagepred.wall_cracks import WallCracks, crack_frame

MOST = 25
"""Cracks that are listed."""


def crack_parts(ds: xr.Dataset) -> list[Part]:
    """Return drawing and table of a wall's cracks at the end of its path.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall.
    """
    known = WallCracks(ds)
    frame = crack_frame(known.dataset())
    if frame.empty:
        return [Text([f"No joint has opened or slid by more than {length(HAIRLINE)}."])]
    from damagepred.plotting.cracks import draw_cracks

    figure = drawing(
        "cracks",
        "The cracks where they run, on the wall as it was built; numbers are those of the table.",
        f"Drawing of the wall with {len(frame)} numbered cracks, coloured by width",
        draw_cracks(ds, known=known),
    )
    rows = [_row(one, "time" in ds.variables) for one in frame.head(MOST).to_dict("records")]
    note = (
        "Width is the largest opening normal to a joint, which damage tables speak of; the displacement has the slip "
        f"in it. What has opened or slid by more than {length(HAIRLINE)} and touches is one crack. Length "
        "includes branches."
    )
    if len(frame) > MOST:
        note = f"The first {MOST} of {len(frame)}, the widest of each part of the wall first. {note}"
    since = "" if "time" in ds.variables else "began at a deflection of"
    heads = ["crack", "part", "width", "opening and slip", "length (m)", "how it runs", "widest at x, y (m)"]
    caption = "Cracks at the end of the path, the widest of each part of the wall first"
    return [figure, Table(caption, [*heads, *([since] if since else [])], rows, words=(1, 5), note=note)]


def _row(one: dict[Hashable, Any], in_time: bool) -> list[str]:
    runs = named(str(one["crack_orientation"]))
    if runs in ("stepped", "diagonal"):
        runs += f", {number(float(np.round(one['crack_inclination'])))}°"
    if one["crack_length_through_blocks"] > 0:
        runs += ", through bricks"
    return [
        str(one["crack"]),
        named(str(one["crack_part"])),
        length(one["crack_width"]),
        length(one["crack_displacement"]),
        f"{one['crack_length']:.2f}",
        runs,
        f"{one['crack_x']:.2f}, {one['crack_y']:.2f}",
        *([] if in_time else [length(one["first_central_deflection"])]),
    ]
