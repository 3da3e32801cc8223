"""The cracks of one wall as a table."""

from __future__ import annotations

import numpy as np
import xarray as xr

from damagepred.archive.schema import VARIABLES
from damagepred.damage import find_cracks
from damagepred.damage.cracks import HAIRLINE
from damagepred.plotting.categories import name_of, table_of
from damagepred.rejudge import joints_of
from damagepred.report.parts import Part, Table, Text
from damagepred.report.words import length, number

MOST = 20
"""Cracks that are listed, the widest."""

CRACKED = VARIABLES["contact_state"].flags.index("cracked")


def crack_parts(ds: xr.Dataset) -> list[Part]:
    """Return the table of the cracks of the wall proper at the end of its path, widest first.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall.
    """
    joints, table = joints_of(ds), table_of(ds)
    shape = joints.contact_x.shape
    opening, slip = (ds[f"contact_{name}"].values[-1].reshape(shape) for name in ("opening", "slip"))
    state = ds["contact_state"].values
    found = find_cracks(joints, opening, slip, state[-1].reshape(shape) == CRACKED)
    count = len(found.width)
    if not count:
        return [Text([f"No joint of the wall proper has opened by more than {length(HAIRLINE)}."])]
    deflection, x, y = ds["central_deflection"].values, joints.contact_x.ravel(), joints.contact_y.ravel()
    rows = []
    for i in range(min(count, MOST)):
        here = np.flatnonzero((x == found.x[i]) & (y == found.y[i]))
        gaps = np.where(state[:, here] == CRACKED, ds["contact_opening"].values[:, here], 0.0).max(axis=1)
        category = int(table.by_width(found.width[i]))
        rows.append(
            [str(i + 1), length(float(found.width[i])), f"{category} {name_of(ds, category)}".replace(" ", "\u00a0"),
             number(float(found.x[i]), 3), number(float(found.y[i]), 3), str(int(found.joints[i])),
             length(float(deflection[np.argmax(gaps > HAIRLINE)]))]
        )  # fmt: skip
    note = (
        "Cracked joints that touch make one crack; its width is the largest opening normal to a joint, which is where "
        f"it is said to be. Joints count that opened or slid by more than {length(HAIRLINE)}. “Open since”: deflection "
        "of the first increment in which it was open there. The damp-proof course and the courses below it are not in "
        "the table."
    )
    if count > MOST:
        note = f"The {MOST} widest of {count}. {note}"
    heads = ["crack", "width", "category by its width", "along the wall (m)", "height (m)", "joints", "open since"]
    return [Table("Cracks of the wall at the end of its path, widest first", heads, rows, words=(2,), note=note)]
