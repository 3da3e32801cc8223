"""Blocks and joints of a stored wall: how blocks have moved, which blocks a joint lies between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.damage.joints import JointMap
from damagepred.enumerations import ContactKind
from damagepred.plotting.sheet import round_numbers

FINITE_ROTATION = 0.02
"""Rotation (rad) from which it is drawn as it is."""
NO_BLOCK = -1
"""Stands for the ground, and for a block that could not be found."""


DRAWN_DISPLACEMENT = 0.045
"""Largest displacement on the drawing, as a fraction of the wall's length."""

LARGEST_EXAGGERATION = 1000.0


@dataclass(frozen=True)
class Motion:
    """Rigid motion of the blocks at one increment; n of them.

    Attributes
    ----------
    x, y : array (n,)
        Centroids (m).
    displacement : array (n, 2)
        Of the centroids (m).
    rotation : array (n,)
        Counter-clockwise (rad).
    """

    x: FloatArray
    y: FloatArray
    displacement: FloatArray
    rotation: FloatArray

    @classmethod
    def of(cls, ds: xr.Dataset, increment: int) -> Motion:
        """Read the motion from a one-wall dataset at the increment with that position."""
        step = ds.isel(increment=increment)
        moved = np.column_stack((step["block_displacement_x"].values, step["block_displacement_y"].values))
        return cls(ds["block_x"].values, ds["block_y"].values, moved, step["block_rotation"].values)

    def at(self, block: IntArray, points: FloatArray) -> FloatArray:
        """Return the displacement of points that move with blocks."""
        turn = self.rotation[block]
        arm_x, arm_y = points[:, 0] - self.x[block], points[:, 1] - self.y[block]
        large = np.abs(turn) > FINITE_ROTATION
        across, along = np.where(large, np.sin(turn), turn), np.where(large, np.cos(turn) - 1.0, 0.0)
        turned = np.column_stack((along * arm_x - across * arm_y, across * arm_x + along * arm_y))
        return self.displacement[block] + turned


def corners(ds: xr.Dataset) -> tuple[FloatArray, IntArray]:
    """Return the corners of all blocks, (v, 2) in m, and the block each belongs to, (v,)."""
    points = np.column_stack((ds["vertex_x"].values, ds["vertex_y"].values))
    return points, np.asarray(ds["vertex_block"].values, dtype=np.int64)


def polygons(points: FloatArray, block: IntArray) -> list[FloatArray]:
    """Split corners into one polygon a block, in the order of the blocks."""
    return np.split(points, np.flatnonzero(np.diff(block)) + 1)


@dataclass(frozen=True)
class Faces:
    """The interfaces of a wall at one increment; m of them.

    Attributes
    ----------
    start, end : array (m, 2)
        Ends before any movement (m).
    normal : array (m, 2)
        Unit normal, from block a to block b.
    kind : array of int (m,)
        Flag value of ``contact_kind``.
    opening : array (m,)
        Widest opening (m), up to the joint's ends, 0 where it is closed.
    crack : array (m,)
        The same where the bond is broken, 0 if it is nowhere.
    slip : array (m,)
        Largest plastic slip of a contact that is closed (m), either way, 0 if none slips.
    """

    start: FloatArray
    end: FloatArray
    normal: FloatArray
    kind: IntArray
    opening: FloatArray
    crack: FloatArray
    slip: FloatArray

    @classmethod
    def of(cls, ds: xr.Dataset, increment: int) -> Faces:
        """Gather the contacts of a one-wall dataset by interface, at the increment with that position."""
        joints = JointMap.from_dataset(ds)
        shape = joints.contact_x.shape

        def at(name: str) -> FloatArray:
            return np.asarray(ds[f"contact_{name}"].values[increment]).reshape(shape)

        gap = joints.widest(at("opening"))
        crack = np.where(at("state") == 1, gap, 0.0)
        slip = np.zeros(shape)
        if "contact_slip" in ds.variables:
            slip = np.where(at("opening") <= 0.0, np.abs(at("slip")), 0.0)
        normal = np.column_stack([ds[f"contact_normal_{axis}"].values.reshape(shape)[:, 0] for axis in "xy"])
        widest = (values.max(axis=1, initial=0.0) for values in (gap, crack, slip))
        return cls(joints.start, joints.end, normal, joints.kind.astype(np.int64), *widest)

    @property
    def middle_y(self) -> FloatArray:
        """Height of the middle before any movement (m), (m,)."""
        return (self.start[:, 1] + self.end[:, 1]) / 2

    @property
    def is_mortar(self) -> BoolArray:
        """Which are mortar joints between bricks, (m,)."""
        return (self.kind == ContactKind.BED_JOINT) | (self.kind == ContactKind.HEAD_JOINT)

    @property
    def is_footing(self) -> BoolArray:
        """Which lie between wall and footing, (m,)."""
        return self.kind == ContactKind.FOOTING_INTERFACE

    @property
    def is_dpc(self) -> BoolArray:
        """Which are the dpc, (m,)."""
        return self.kind == ContactKind.DPC

    @property
    def is_control(self) -> BoolArray:
        """Which lie in control joints, (m,)."""
        return self.kind == ContactKind.CONTROL_JOINT

    def pick(self, chosen: BoolArray) -> Faces:
        """Return those where ``chosen`` (m,) is True."""
        return Faces(*(getattr(self, name)[chosen] for name in self.__dataclass_fields__))

    def neighbours(self, points: FloatArray, block: IntArray) -> tuple[IntArray, IntArray]:
        """Return the blocks a and b on either side, each (m,), -1 for the ground."""
        middle = (self.start + self.end) / 2
        step = self.normal * 1e-3 * np.hypot(*(self.end - self.start).T)[:, None]
        return block_at(middle - step, points, block), block_at(middle + step, points, block)


def block_at(places: FloatArray, points: FloatArray, block: IntArray) -> IntArray:
    """Return the convex block that each place lies in, -1 where there is none."""
    first = np.concatenate(([0], np.flatnonzero(np.diff(block)) + 1))
    following = np.arange(1, len(points) + 1)
    following[np.append(first[1:], len(points)) - 1] = first
    edge = points[following] - points
    found = np.full(len(places), NO_BLOCK, dtype=np.int64)
    for rows in np.array_split(np.arange(len(places)), len(places) // 256 + 1):
        arm = places[rows, None, :] - points
        left_of = edge[:, 0] * arm[..., 1] - edge[:, 1] * arm[..., 0] >= 0.0
        inside = np.logical_and.reduceat(left_of, first, axis=1)
        found[rows] = np.where(inside.any(axis=1), block[first[inside.argmax(axis=1)]], NO_BLOCK)
    return found


def footing_blocks(ds: xr.Dataset) -> BoolArray:
    """Return which blocks are the footing, (n,): none where the movement is that of the wall's underside."""
    faces, (points, block) = Faces.of(ds, 0), corners(ds)
    found = np.zeros(ds.sizes["block"], dtype=np.bool_)
    below, _ = faces.pick(faces.is_footing).neighbours(points, block)
    ours = faces.pick(np.isin(faces.kind, (ContactKind.FOOTING_SECTION, ContactKind.SOIL, ContactKind.SUPPORT)))
    for side in (below, *ours.neighbours(points, block)):
        found[side[side >= 0]] = True
    return found & (ds["block_course"].values < 0)


def ground_profile(
    ds: xr.Dataset, increment: int, kind: int = ContactKind.FOOTING_INTERFACE
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the ground under a wall from left to right: place, height and upward displacement, each (g,) in m.

    The ground is the underside of the wall less the opening of the footing's interface; of soil, which
    gives under a footing, it is the surface as it would be without the footing.
    """
    footing = np.flatnonzero(ds["contact_kind"].values == kind)
    if not footing.size:
        return np.empty(0), np.empty(0), np.empty(0)
    place = np.column_stack([ds[f"contact_{axis}"].values[footing] for axis in "xy"])
    face = ds["contact_interface"].values[footing]
    # a contact at a corner belongs to the block over the middle of its interface
    _, which = np.unique(face, return_inverse=True)
    count = np.bincount(which)
    middle = np.column_stack([np.bincount(which, along) / count for along in place.T])
    reach = np.bincount(which, ds["contact_length"].values[footing])
    above = block_at(middle + np.column_stack((0 * reach, 1e-3 * reach)), *corners(ds))[which]
    rise = Motion.of(ds, increment).at(above, place)[:, 1]
    rise = rise - ds["contact_opening"].values[increment, footing]
    x, which = np.unique(np.round(place[:, 0], 9), return_inverse=True)
    count = np.bincount(which)
    return x, np.bincount(which, place[:, 1]) / count, np.bincount(which, rise) / count


def soil_surface(ds: xr.Dataset, increment: int, footing: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the surface of soil under a footing, pressed down where this rests on it; see ``ground_profile``."""
    x, height, rise = ground_profile(ds, increment, ContactKind.SOIL)
    if not len(x):
        return x, height, rise
    return x, height, np.minimum(rise, np.interp(x, *footing_rise(ds, increment, footing)))


def settlement(ds: xr.Dataset) -> float | None:
    """Return the mean upward displacement (m) of a footing on soil under dead load; None without soil."""
    if not (ds["contact_kind"].values == ContactKind.SOIL).any():
        return None
    return float(footing_rise(ds, 0, footing_blocks(ds))[1].mean())


def round_exaggeration(displacement: FloatArray, length: float) -> float:
    """Return the round number that shows the largest displacement as about 4.5 % of the wall's length."""
    largest = float(np.hypot(displacement[..., 0], displacement[..., 1]).max(initial=0.0))
    if not np.isfinite(largest) or largest <= 0.0:
        return 1.0
    wanted = min(max(DRAWN_DISPLACEMENT * length / largest, 1.0), LARGEST_EXAGGERATION)
    factors = round_numbers(4)
    return float(factors[np.argmin(np.abs(np.log(factors / wanted)))])


def footing_rise(ds: xr.Dataset, increment: int, chosen: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Return places along a footing (m), left to right, and how far it has gone up there (m)."""
    if "gridpoint_x" in ds.variables and np.isin(np.flatnonzero(chosen), ds["gridpoint_block"].values).any():
        own = np.flatnonzero(chosen[ds["gridpoint_block"].values])
        y = ds["gridpoint_y"].values[own]
        own = own[y < y.min() + 1e-9]
        order = own[np.argsort(ds["gridpoint_x"].values[own])]
        return ds["gridpoint_x"].values[order], ds["gridpoint_displacement_y"].values[increment, order]
    motion = Motion.of(ds, increment)
    own = np.flatnonzero(chosen)
    own = own[np.argsort(motion.x[own])]
    left, right = float(ds["vertex_x"].values.min()), float(ds["vertex_x"].values.max())
    # a beam of segments is true to their middles; its ends go with the outermost
    x, block = np.concatenate(([left], motion.x[own], [right])), np.concatenate((own[:1], own, own[-1:]))
    return x, motion.at(block, np.column_stack((x, motion.y[block])))[:, 1]
