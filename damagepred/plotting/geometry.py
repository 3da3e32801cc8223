"""Blocks, joints and zones of a stored wall: how blocks have moved, which blocks a joint lies between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.damage.joints import JointMap
from damagepred.enumerations import ContactKind
from damagepred.plotting.sheet import nearest_round

FINITE_ROTATION = 0.02
"""Rotation (rad) from which it is drawn in full, not to first order."""
DRAWN_DISPLACEMENT, LARGEST_EXAGGERATION = 0.045, 1000.0
"""Largest displacement on the drawing as a fraction of the wall's length, and largest factor for it."""


@dataclass(frozen=True)
class Motion:
    """Rigid motion of n blocks at an increment: centroids (m), their displacement (n, 2) (m), rotation (rad)."""

    x: FloatArray
    y: FloatArray
    displacement: FloatArray
    rotation: FloatArray

    @classmethod
    def of(cls, ds: xr.Dataset, increment: int) -> Motion:
        """Motion at the increment with that position."""
        step = ds.isel(increment=increment)
        moved = np.column_stack((step["block_displacement_x"].values, step["block_displacement_y"].values))
        return cls(ds["block_x"].values, ds["block_y"].values, moved, step["block_rotation"].values)

    def at(self, block: IntArray, points: FloatArray) -> FloatArray:
        """Displacement (p, 2) of points that move with blocks; of small rotations to first order, to be exaggerated."""
        turn = self.rotation[block]
        arm_x, arm_y = points[:, 0] - self.x[block], points[:, 1] - self.y[block]
        large = np.abs(turn) > FINITE_ROTATION
        across, along = np.where(large, np.sin(turn), turn), np.where(large, np.cos(turn) - 1.0, 0.0)
        turned = np.column_stack((along * arm_x - across * arm_y, across * arm_x + along * arm_y))
        return self.displacement[block] + turned


def corners(ds: xr.Dataset) -> tuple[FloatArray, IntArray]:
    """Corners of all blocks, (v, 2) in m, and the block of each, (v,)."""
    points = np.column_stack((ds["vertex_x"].values, ds["vertex_y"].values))
    return points, np.asarray(ds["vertex_block"].values, dtype=np.int64)


def polygons(points: FloatArray, block: IntArray) -> list[FloatArray]:
    """Split corners into one polygon per block, in the order of the blocks."""
    return np.split(points, np.flatnonzero(np.diff(block)) + 1)


@dataclass(frozen=True)
class Faces:
    """The m interfaces of a wall at an increment, with widths (m,) up to the joints' ends (m)."""

    joints: JointMap
    opening: FloatArray  # widest opening, 0 where the joint is closed
    crack: FloatArray  # widest opening where the bond is broken
    slip: FloatArray  # largest plastic slip of a closed contact

    @classmethod
    def of(cls, ds: xr.Dataset, increment: int) -> Faces:
        """Contacts gathered by interface at the increment with that position."""
        joints = JointMap.from_dataset(ds, with_blocks=True)

        def values(name: str) -> FloatArray:
            return np.asarray(ds[f"contact_{name}"].values[increment]).reshape(joints.contact_x.shape)

        gap = joints.widest(values("opening"))
        crack, slip = np.where(values("state") == 1, gap, 0.0), np.zeros(gap.shape)
        if "contact_slip" in ds.variables:
            slip = np.where(values("opening") <= 0.0, np.abs(values("slip")), 0.0)
        return cls(joints, *(field.max(axis=1, initial=0.0) for field in (gap, crack, slip)))

    def pick(self, chosen: BoolArray) -> Faces:
        """Interfaces where ``chosen`` (m,) is True."""
        return Faces(self.joints.part(chosen), self.opening[chosen], self.crack[chosen], self.slip[chosen])


def footing_blocks(ds: xr.Dataset) -> BoolArray:
    """Blocks of the footing, (n,); no block where the ground moves the wall's underside."""
    joints, beside = JointMap.from_dataset(ds, with_blocks=True), np.zeros(ds.sizes["block"], dtype=np.bool_)
    under = np.isin(joints.kind, (ContactKind.FOOTING_SECTION, ContactKind.SOIL, ContactKind.SUPPORT))
    for side in (joints.blocks[joints.is_footing, 0], *joints.blocks[under].T):
        beside[side[side >= 0]] = True
    return beside & (ds["block_course"].values < 0)


def ground_profile(
    ds: xr.Dataset, increment: int, kind: int = ContactKind.FOOTING_INTERFACE
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Ground under a wall from left to right: place, height and upward displacement, each (g,) in m.

    Underside of the wall less the opening of the footing's interface; of soil the surface without the footing.
    """
    footing = np.flatnonzero(ds["contact_kind"].values == kind)
    if not footing.size:
        return np.empty(0), np.empty(0), np.empty(0)
    place = np.column_stack([ds[f"contact_{axis}"].values[footing] for axis in "xy"])
    joints, face = JointMap.from_dataset(ds, with_blocks=True), ds["contact_interface"].values[footing]
    upwards = joints.end[face, 0] > joints.start[face, 0]  # the normal points up, from the first block to the second
    above = np.where(upwards, joints.blocks[face, 1], joints.blocks[face, 0])
    rise = Motion.of(ds, increment).at(above, place)[:, 1]
    rise = rise - ds["contact_opening"].values[increment, footing]
    x, which = np.unique(np.round(place[:, 0], 9), return_inverse=True)
    count = np.bincount(which)
    return x, np.bincount(which, place[:, 1]) / count, np.bincount(which, rise) / count


def soil_surface(ds: xr.Dataset, increment: int, footing: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Surface of soil under a footing, pressed down where the footing rests on it; see ``ground_profile``."""
    x, height, rise = ground_profile(ds, increment, ContactKind.SOIL)
    if not len(x):
        return x, height, rise
    return x, height, np.minimum(rise, np.interp(x, *footing_rise(ds, increment, footing)))


def settlement(ds: xr.Dataset) -> float | None:
    """Mean upward displacement (m) of a footing on soil under dead load; None without soil."""
    if not (ds["contact_kind"].values == ContactKind.SOIL).any():
        return None
    return float(footing_rise(ds, 0, footing_blocks(ds))[1].mean())


def round_exaggeration(displacement: FloatArray, length: float) -> float:
    """Round factor that shows the largest displacement (..., 2) as about 4.5 % of the wall's length (m)."""
    largest = float(np.hypot(displacement[..., 0], displacement[..., 1]).max(initial=0.0))
    if not np.isfinite(largest) or largest <= 0.0:
        return 1.0
    wanted = min(max(DRAWN_DISPLACEMENT * length / largest, 1.0), LARGEST_EXAGGERATION)
    return nearest_round(wanted)


def footing_rise(ds: xr.Dataset, increment: int, footing: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Places along a footing (m), left to right, and its upward displacement there (m)."""
    if "gridpoint_x" in ds.variables and np.isin(np.flatnonzero(footing), ds["gridpoint_block"].values).any():
        points = np.flatnonzero(footing[ds["gridpoint_block"].values])
        y = ds["gridpoint_y"].values[points]
        points = points[y < y.min() + 1e-9]
        order = points[np.argsort(ds["gridpoint_x"].values[points])]
        return ds["gridpoint_x"].values[order], ds["gridpoint_displacement_y"].values[increment, order]
    motion = Motion.of(ds, increment)
    segments = np.flatnonzero(footing)
    segments = segments[np.argsort(motion.x[segments])]
    left, right = float(ds["vertex_x"].values.min()), float(ds["vertex_x"].values.max())
    # a beam of segments is exact at their middles; its ends move with the outermost segments
    x = np.concatenate(([left], motion.x[segments], [right]))
    block = np.concatenate((segments[:1], segments, segments[-1:]))
    return x, motion.at(block, np.column_stack((x, motion.y[block])))[:, 1]


def open_stretches(x: FloatArray, opening: FloatArray, threshold: float) -> list[tuple[float, float]]:
    """Start and end of each stretch along which an opening exceeds a threshold, linear between its points."""
    above = opening > threshold
    change = np.flatnonzero(np.diff(above.astype(np.int8)))
    share = (threshold - opening[change]) / (opening[change + 1] - opening[change])
    ends = list(x[change] + share * (x[change + 1] - x[change]))
    if above[0]:
        ends.insert(0, x[0])
    if above[-1]:
        ends.append(x[-1])
    return [(float(a), float(b)) for a, b in zip(ends[::2], ends[1::2])]


def opening_along(ds: xr.Dataset, kind: int = ContactKind.DPC) -> tuple[FloatArray, FloatArray, list[IntArray]]:
    """Places along a bed (m), its opening there (increments, places) up to the joints' ends, points of each piece."""
    joints = JointMap.from_dataset(ds)
    number = np.flatnonzero(joints.kind == kind)
    left, right = np.sort(np.column_stack((joints.start[number, 0], joints.end[number, 0])), axis=1).T
    order = np.argsort(left)
    number, left, right = number[order], left[order], right[order]
    profile, shape = joints.profile(number), joints.contact_x.shape
    opening = np.stack([profile.of(values.reshape(shape)) for values in ds["contact_opening"].values])
    backwards = joints.start[number, 0] > joints.end[number, 0]
    x = np.where(backwards, -1.0, 1.0)[:, None] * profile.way + joints.start[number, :1]
    x[backwards], opening[:, backwards] = x[backwards, ::-1], opening[:, backwards, ::-1]
    interrupted = np.flatnonzero(left[1:] > right[:-1] + 1e-9) + 1
    pieces = np.split(np.arange(x.size), interrupted * x.shape[1])
    return x.ravel(), opening.reshape(len(opening), -1), pieces


@dataclass(frozen=True)
class Zones:
    """Zones before any movement: g gridpoints (g, 2) (m), gridpoints of each zone (z, 3), block of each zone (z,)."""

    points: FloatArray
    corners: IntArray
    block: IntArray

    @classmethod
    def of(cls, ds: xr.Dataset) -> Zones:
        """Zones of a dataset."""
        points = np.column_stack((ds["gridpoint_x"].values, ds["gridpoint_y"].values))
        return cls(points, ds["zone_gridpoint"].values.astype(np.int64), ds["zone_block"].values.astype(np.int64))

    @property
    def area(self) -> FloatArray:
        """Area of each zone (z,) (m2)."""
        a, b, c = (self.points[self.corners[:, k]] for k in range(3))
        return np.asarray(0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (c - a)[:, 0] * (b - a)[:, 1]), dtype=np.float64)

    def at_gridpoints(self, values: FloatArray) -> FloatArray:
        """Values of the zones (z,) as means at the gridpoints (g,), weighted by area, each block for itself."""
        weight = np.repeat(self.area, 3)
        count = len(self.points)
        total = np.bincount(self.corners.ravel(), weight * np.repeat(values, 3), count)
        return np.asarray(total / np.bincount(self.corners.ravel(), weight, count))

    def rims(self) -> IntArray:
        """Gridpoints at both ends of every edge on a block's boundary, (r, 2)."""
        edges = np.concatenate([self.corners[:, [k, (k + 1) % 3]] for k in range(3)])
        key = edges.min(axis=1) * len(self.points) + edges.max(axis=1)
        _, first, count = np.unique(key, return_index=True, return_counts=True)
        return np.asarray(edges[first[count == 1]])
