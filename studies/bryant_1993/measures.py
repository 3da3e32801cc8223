"""Quantities of a solved wall, as measured in the test."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.damage.cracks import HAIRLINE
from damagepred.enumerations import ContactKind
from damagepred.plotting.geometry import Zones, open_stretches
from damagepred.plotting.stress import block_stress, one_of

THRESHOLDS = (0.5e-3, 1.0e-3)
"""Openings (m) from which a dpc counts as separated: the threshold of the test is not reported."""
AROUND = 0.6
"""Distance around a window within which stresses are evaluated (m)."""


def at(ds: xr.Dataset, deflection: float) -> int:
    """Return the position of the increment at a deflection (m), or of the last one if the path ends before."""
    moved = ds["central_deflection"].values
    return int(np.argmin(np.abs(moved - deflection)))


@dataclass(frozen=True)
class Dpc:
    """The dpc along the wall: place, opening, normal stress, plastic slip and length of contacts; ends (m, Pa)."""

    x: FloatArray
    opening: FloatArray
    stress: FloatArray
    slip: FloatArray
    reach: FloatArray
    left: float
    right: float

    @classmethod
    def of(cls, ds: xr.Dataset, increment: int) -> Dpc:
        """Return the dpc of a dataset."""
        order = _contacts_along(ds)
        along = (ds[f"contact_{name}"].values[increment, order] for name in ("opening", "normal_stress", "slip"))
        x = ds["vertex_x"].values
        return cls(
            ds["contact_x"].values[order], *along, ds["contact_length"].values[order], float(x.min()), float(x.max())
        )

    def stretches(self, threshold: float) -> list[tuple[float, float]]:
        """Return the contacts with an opening above a threshold (m)."""
        return open_stretches(self.x, self.opening, threshold)

    def separated(self, threshold: float) -> float:
        """Return the length (m) with an opening above a threshold (m)."""
        return sum(b - a for a, b in self.stretches(threshold))

    def closed_at_ends(self, threshold: float) -> tuple[float, float]:
        """Return the distance from each end (m) without an opening above a threshold (m): half the wall if none."""
        found = self.stretches(threshold)
        if not found:
            return (self.right - self.left) / 2, (self.right - self.left) / 2
        return found[0][0] - self.left, self.right - found[-1][1]

    def opening_at(self, distance: float) -> float:
        """Return the opening at a distance from the ends (m), the mean of both."""
        places = (self.left + distance, self.right - distance)
        return float(np.mean([np.interp(x, self.x, self.opening) for x in places]))

    @property
    def end_gaps(self) -> tuple[float, float]:
        """Opening at both ends (m), none if closed."""
        return max(float(self.opening[0]), 0.0), max(float(self.opening[-1]), 0.0)

    @property
    def bearing(self) -> float:
        """Length of the wall on which the dpc bears (m)."""
        return float(self.reach[self.stress < 0].sum())

    @property
    def sliding(self) -> float:
        """Largest plastic slip where it bears (m)."""
        return float(np.abs(self.slip[self.stress < 0]).max(initial=0.0))


def _contacts_along(ds: xr.Dataset) -> IntArray:
    """Return the numbers of the contacts of the dpc from left to right; of one place by interface."""
    dpc = np.flatnonzero(ds["contact_kind"].values == ContactKind.DPC)
    _, face = np.unique(ds["contact_interface"].values[dpc], return_inverse=True)
    x = ds["contact_x"].values[dpc]
    middle = (np.bincount(face, x) / np.bincount(face))[face]
    return dpc[np.lexsort((x, middle))]


@dataclass(frozen=True)
class Line:
    """Straight line y = start + slope x, and the share r2 of the variance of y that it explains."""

    slope: float
    start: float
    r2: float


def line_through(x: FloatArray, y: FloatArray) -> Line:
    """Return the line of least squares."""
    slope, start = np.polyfit(x, y, 1)
    left = y - (start + slope * x)
    return Line(float(slope), float(start), 1.0 - float((left**2).sum() / ((y - y.mean()) ** 2).sum()))


def width_against_separation(ds: xr.Dataset) -> Line:
    """Return the regression of the window's width (m) on the widest opening of the dpc (m), once that is visible."""
    gap, change = ds["dpc_opening_max"].values, ds["opening_width_change"].values[:, 0]
    visible = gap > HAIRLINE
    return line_through(gap[visible], change[visible]) if visible.sum() > 2 else Line(np.nan, np.nan, np.nan)


def separation_at(ds: xr.Dataset, change: float) -> float | None:
    """Return the widest opening of the dpc (m) at which the window's width has first changed by a given amount (m)."""
    gap, found = ds["dpc_opening_max"].values, np.abs(ds["opening_width_change"].values[:, 0])
    past = np.flatnonzero(found >= abs(change))
    if not past.size or past[0] == 0:
        return None
    i = int(past[0])
    share = (abs(change) - found[i - 1]) / (found[i] - found[i - 1])
    return float(gap[i - 1] + share * (gap[i] - gap[i - 1]))


@dataclass(frozen=True)
class AroundWindow:
    """Largest mean stress of a brick by a window (Pa): along the wall, principal; broken perpends under the sill."""

    horizontal: float
    principal: float
    cracked_under_sill: int

    @classmethod
    def of(cls, ds: xr.Dataset, increment: int) -> AroundWindow:
        """Evaluate bricks above the dpc within ``AROUND`` of the window, and joints under its sill."""
        left, sill = float(ds["opening_left"][0]), float(ds["opening_sill"][0])
        width, height = float(ds["opening_width"][0]), float(ds["opening_height"][0])
        x, y = ds["block_x"].values, ds["block_y"].values
        level = float(ds["contact_y"].values[ds["contact_kind"].values == ContactKind.DPC].max())
        near = (x > left - AROUND) & (x < left + width + AROUND) & (y > max(level, sill - AROUND))
        near &= y < sill + height + AROUND
        stress = block_stress(ds, increment)[near]
        cx, cy, kind = (ds[f"contact_{name}"].values for name in ("x", "y", "kind"))
        under = (kind == ContactKind.HEAD_JOINT) & (cx > left) & (cx < left + width) & (cy > level) & (cy < sill)
        broken = ds["contact_interface"].values[under & (ds["contact_state"].values[increment] == 1)]
        return cls(float(one_of(stress, "xx").max()), float(one_of(stress, "largest").max()), len(np.unique(broken)))


def cracked_above_dpc(ds: xr.Dataset, increment: int) -> int:
    """Return the number of broken mortar joints above the dpc."""
    kind, y = ds["contact_kind"].values, ds["contact_y"].values
    mortar = ((kind == ContactKind.BED_JOINT) | (kind == ContactKind.HEAD_JOINT)) & (
        y > y[kind == ContactKind.DPC].max()
    )
    return len(np.unique(ds["contact_interface"].values[mortar & (ds["contact_state"].values[increment] == 1)]))


def parts(ds: xr.Dataset) -> dict[str, BoolArray]:
    """Zones above the dpc, away from its ends, below the dpc, and in the footing."""
    course = ds["block_course"].values[ds["zone_block"].values]
    zones = Zones.of(ds)
    x = zones.points[zones.corners].mean(axis=1)[:, 0]
    above = course >= 2
    inside = (x > 0.6) & (x < ds.attrs["span"] - 0.6)
    found = {
        "above the dpc": above,
        "- of it, 0.6 m and more from the ends": above & inside,
        "two courses below the dpc": (course >= 0) & ~above,
        "footing": course < 0,
    }
    return {name: chosen for name, chosen in found.items() if chosen.any()}


def stress_table(ds: xr.Dataset, increments: tuple[int, int]) -> list[str]:
    """Table of the stress along the wall at two increments, by part of the wall."""
    weight = Zones.of(ds).area
    early, late = (1e-6 * ds["zone_stress_xx"].values[i] for i in increments)
    lines = [
        "| zones | stress along the wall at {:.0f} mm, MPa | at {:.0f} mm, MPa | change, MPa |".format(
            *1e3 * ds["central_deflection"].values[list(increments)]
        ),
        "|---|---|---|---|",
    ]
    for name, chosen in parts(ds).items():
        cells = [f"{_middle(s[chosen], weight[chosen])}" for s in (early, late, late - early)]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return lines


def _middle(values: FloatArray, weight: FloatArray) -> str:
    """Range without 2.5 % of the area at either end, and root mean square."""
    order = np.argsort(values)
    share = np.cumsum(weight[order]) / weight.sum()
    low, high = values[order][np.searchsorted(share, [0.025, 0.975])]
    size = float(np.sqrt((weight * values**2).sum() / weight.sum()))
    return f"{low:.3f} to {high:.3f}; rms {size:.3f}"
