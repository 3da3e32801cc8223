"""Walls as data for the drawing that a reader moves: blocks, joints, and their path, packed small.

Arrays are compressed and stand in the page as text. Displacements and widths are whole multiples of a 32 000th of the
largest, which no screen shows.
"""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from damagepred.archive.schema import category_label, is_dynamic
from damagepred.enumerations import ContactKind
from damagepred.formatting import length
from damagepred.plotting import colours
from damagepred.plotting.colours import table_of
from damagepred.plotting.geometry import Deformed, Faces, Motion, ground_profile
from damagepred.plotting.sheet import MM, moved_to
from damagepred.uq.fragility import movement_measure

LEVELS = 32_000  # steps from 0 to the largest value of a packed array
MOST_SHOWN = 41  # increments of a path that a reader can choose among at most


def explorer(walls: Mapping[str, xr.Dataset]) -> str:
    """Walls as JSON for the script of a page."""
    table = table_of(next(iter(walls.values())))
    shared = {
        "limits": [limit * MM for limit in table.limits],
        "colours": list(colours.CATEGORY_COLOURS[: len(table.limits) + 1]),
        "bricks": list(colours.BRICK_COLOURS),
        "edge": colours.BRICK_EDGE,
        "dpc": colours.DPC_COLOUR,
        "control": colours.CONTROL_JOINT_COLOUR,
        "footing": colours.FOOTING_COLOUR,
        "levels": LEVELS,
        "walls": [{"name": name, **_wall(ds)} for name, ds in walls.items()],
    }
    return json.dumps(shared, separators=(",", ":"), allow_nan=False).replace("</", "<\\/")


def _wall(ds: xr.Dataset) -> dict[str, Any]:
    steps = _steps(ds)
    end = Deformed.of(ds, -1, None)
    first = np.concatenate(([0], np.flatnonzero(np.diff(end.block)) + 1, [len(end.block)]))
    motions = [Motion.of(ds, i) for i in steps]
    faces = [Faces.of(ds, i) for i in steps]
    joints = faces[0].joints
    gap = [np.where(joints.is_masonry, one.crack, one.opening) for one in faces]
    kind = (joints.is_masonry, joints.is_dpc, joints.kind == ContactKind.CONTROL_JOINT)
    ground = [ground_profile(ds, i) for i in steps] if not end.footing.any() else []
    x, height = (ground[0][0], ground[0][1]) if ground else (np.empty(0), np.empty(0))
    return {
        "factor": end.factor,
        "corner": _packed(end.points, "float32"),
        "first": _packed(first, "int32"),
        "centre": _packed(np.column_stack((motions[0].x, motions[0].y)), "float32"),
        "footing": _packed(end.footing, "uint8"),
        "end": _packed(np.column_stack((joints.start, joints.end)), "float32"),
        "side": _packed(joints.blocks, "int32"),
        "kind": _packed(np.select(kind, [0, 1, 2], 3), "uint8"),
        "ground": _packed(np.column_stack((x, height)), "float32"),
        "moved": _scaled([one.displacement for one in motions]),
        "turned": _scaled([one.rotation for one in motions]),
        "gap": _scaled(gap),
        "rise": _scaled([one[2] for one in ground]),
        "movement": (ds["time"] if is_dynamic(ds) else ds[movement_measure(ds)] * MM).values[steps].tolist(),
        "said": [_said(ds, i) for i in steps],
        "labels": json.loads(ds.attrs.get("labels", "[]")),
    }


def _steps(ds: xr.Dataset) -> list[int]:
    """Positions of the increments to show: all, or as many as can be, first and last among them."""
    followed = np.flatnonzero(np.isfinite(ds["crack_width_max"].values))
    chosen = np.linspace(0, len(followed) - 1, min(len(followed), MOST_SHOWN)).round().astype(int)
    return [int(i) for i in followed[chosen]]


def _said(ds: xr.Dataset, increment: int) -> str:
    category = category_label(ds, int(ds["damage_category"].values[increment]))
    width = length(float(ds["crack_width_max"].values[increment]))
    return f"At {moved_to(ds, increment)}: category {category}, widest crack {width}."


def _scaled(values: ArrayLike) -> dict[str, Any]:
    """Numbers as whole multiples of a ``LEVELS``-th of the largest."""
    array = np.asarray(values, dtype=np.float64)
    largest = float(np.abs(array).max(initial=0.0)) or 1.0
    return {"largest": largest, **_packed(np.rint(array * (LEVELS / largest)), "int16")}


def _packed(values: ArrayLike, kind: str) -> dict[str, str]:
    """Array as text: little-endian, compressed, in base 64."""
    raw = np.ascontiguousarray(values).astype(np.dtype(kind).newbyteorder("<")).tobytes()
    return {"type": kind, "data": base64.b64encode(zlib.compress(raw, 9)).decode("ascii")}
