"""The cracks of one wall: a drawing, and a table of the widest."""

from __future__ import annotations

import xarray as xr

from damagepred.archive.schema import is_dynamic
from damagepred.damage import HAIRLINE
from damagepred.formatting import length
from damagepred.report.parts import Part, Text, drawing
from damagepred.results.house import is_house
from damagepred.results.tables import Table, crack_columns
from damagepred.results.wall_cracks import WallCracks, crack_frame

MAX_CRACKS = 8
"""Cracks that are listed."""


def crack_parts(ds: xr.Dataset) -> list[Part]:
    """Drawing and table of a wall's cracks at the end of its path."""
    traced = None if is_house(ds) else WallCracks(ds)
    frame = crack_frame(ds if traced is None else traced.dataset())
    if frame.empty:
        return [Text([f"No joint has opened or slid by more than {length(HAIRLINE)}."])]
    figures: list[Part] = []
    if traced is not None:
        from damagepred.plotting import draw_cracks

        caption = "The cracks where they run, on the undeformed wall; the table has the same numbers."
        label = f"Drawing of the wall with {len(frame)} numbered cracks, coloured by width"
        figures = [drawing("cracks", caption, label, draw_cracks(ds, traced=traced))]
    note = (
        "Width is the largest opening normal to a joint, which damage tables speak of; the displacement has the slip "
        f"in it. What has opened or slid by more than {length(HAIRLINE)} and touches is one crack. Length "
        "includes branches."
    )
    if "crack_wall" in frame:
        frame = frame.sort_values("crack_width", ascending=False)
    if len(frame) > MAX_CRACKS:
        note = f"The first {MAX_CRACKS} of {len(frame)}, the widest of each part of the wall first. {note}"
    caption = "Cracks at the end of the path, the widest of each part of the wall first"
    return [*figures, Table.of(caption, crack_columns(frame.head(MAX_CRACKS), is_dynamic(ds)), note)]
