"""Quantities of a path at a quarter, a half, three quarters and all of the movement."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from damagepred.arrays import FloatArray
from damagepred.assembly import Model

SHARES = (0.25, 0.5, 0.75, 1.0)
"""Shares of the movement at which quantities are taken; runs in time have the last only."""
MORTAR = (0, 1)
"""Kinds of contact that crack: bed joints and perpends."""


class Quantity(NamedTuple):
    """A quantity of a path: its words on the page, the smallest value that counts (SI), and its variable if it is one.

    Errors are shares of the reference, or of the smallest value where that is larger (a hairline crack, for example).
    """

    words: str
    least: float = 1e-4
    variable: str = ""


QUANTITIES = {
    "dpc_opening": Quantity("opening of the dpc", variable="dpc_opening_max"),
    "separation_length": Quantity("separation length of the dpc", 0.1, "dpc_separation_length"),
    "crack_width": Quantity("widest crack", variable="crack_width_max"),
    "base_crack_width": Quantity("widest crack below the dpc", variable="base_crack_width_max"),
    "window": Quantity("change of the window's width"),
    "window_diagonal": Quantity("change of the window's diagonal"),
    "first_crack": Quantity("movement at first crack"),
    "category": Quantity("damage category", 1.0, "damage_category"),
    "base_reaction": Quantity("base reaction", 1.0, "base_reaction"),
    "block_tension": Quantity("largest tension of a block along the wall", 1e4),
    "block_compression": Quantity("largest upright pressure of a block", 1e4),
}


def read(ds: xr.Dataset, model: Model) -> dict[str, list[float]]:
    """Return all quantities of a path, at each of ``SHARES``; NaN where it has none."""
    places = [int(np.abs(ds["progress"].values - share).argmin()) for share in SHARES]
    reached = [abs(float(ds["progress"][p]) - share) < 1e-9 for p, share in zip(places, SHARES)]
    tension, compression = block_stresses(ds, model)
    found = {name: ds[one.variable].values.astype(float) for name, one in QUANTITIES.items() if one.variable}
    found |= {"block_tension": tension, "block_compression": compression}
    if "opening" in ds.sizes:
        of_first = {"window": "opening_width_change", "window_diagonal": "opening_diagonal_change"}
        found |= {name: ds[variable].values[:, 0] for name, variable in of_first.items()}
    values = {
        name: [float(series[p]) if known else float("nan") for p, known in zip(places, reached)]
        for name, series in found.items()
    }
    values["first_crack"] = [float("nan")] * (len(SHARES) - 1) + [first_crack(ds)]
    return values


def first_crack(ds: xr.Dataset) -> float:
    """Return the movement (m) at which the first bond of a mortar joint breaks; NaN if none does."""
    if "contact_broken_at" not in ds:
        return float("nan")
    mortar = np.isin(ds["contact_kind"].values, MORTAR)
    broken = ds["contact_broken_at"].values[mortar]
    if not np.isfinite(broken).any():
        return float("nan")
    return float(np.nanmin(broken)) * float(ds["central_deflection"][-1] / ds["progress"][-1])


def block_stresses(ds: xr.Dataset, model: Model) -> tuple[FloatArray, FloatArray]:
    """Return the largest mean stress of a block along the wall, and the largest vertical pressure, by increment (Pa).

    The mean stress of a block follows from the forces on its edges, for rigid and deformable blocks: the integral of
    position times traction over its boundary, divided by its volume. The top course, which carries the roof, is left
    out.
    """
    face, blocks = model.interfaces, model.blocks
    shape = face.contact_area.shape
    count, n = ds.sizes["increment"], model.n_blocks
    sigma = ds["contact_normal_stress"].values.reshape(count, *shape)
    tau = ds["contact_shear_stress"].values.reshape(count, *shape)
    x, y = (ds[f"contact_{axis}"].values.reshape(shape) for axis in "xy")
    n_x, n_y = face.normal_x[:, None], face.normal_y[:, None]
    along = face.contact_area * (sigma * n_x + tau * n_y)
    upright = face.contact_area * (sigma * n_y - tau * n_x)
    volume = blocks.area * model.thickness
    mean_x, mean_y = np.zeros((count, n)), np.zeros((count, n))
    for block, sign in ((face.block_a, 1.0), (face.block_b, -1.0)):
        known = np.flatnonzero(block < n)
        own = block[known]
        arm_x, arm_y = x[known] - blocks.x[own, None], y[known] - blocks.y[own, None]
        for row in range(count):
            mean_x[row] += np.bincount(own, sign * (arm_x * along[row, known]).sum(axis=1), n)
            mean_y[row] += np.bincount(own, sign * (arm_y * upright[row, known]).sum(axis=1), n)
    inner = (blocks.course >= 0) & (blocks.course < blocks.course.max())
    return (mean_x / volume)[:, inner].max(axis=1), -(mean_y / volume)[:, inner].min(axis=1)
