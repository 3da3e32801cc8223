"""Blocks, joints and zones of a stored wall, and the deformed wall as a base for drawings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from damagepred.archive.schema import require
from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.damage.cracks import HAIRLINE
from damagepred.damage.joints import JointMap
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.plotting import sheet
from damagepred.plotting.colours import DPC_COLOUR, FOOTING_COLOUR, OUTLINE_COLOUR

FINITE_ROTATION = 0.02  # rotation (rad) from which it is drawn in full, not to first order
DRAWN_DISPLACEMENT, LARGEST_EXAGGERATION = 0.045, 1000.0
"""Largest displacement on the drawing as a fraction of the wall's length, and largest factor for it."""
SHORTEST_GAP = 0.01
"""Distance between two open stretches of a bed (m) below which they are one: they are shown in centimetres."""


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
    """Ground under a wall or footing, left to right: place, height, upward displacement without it, each (g,) (m)."""
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
    return sheet.nearest_round(wanted)


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
    """Start and end of each stretch along which an opening exceeds a threshold, linear between its points.

    At a head joint the opening of a bed jumps: stretches that a jump parts are one.
    """
    above = opening > threshold
    change = np.flatnonzero(np.diff(above.astype(np.int8)))
    share = (threshold - opening[change]) / (opening[change + 1] - opening[change])
    ends = list(x[change] + share * (x[change + 1] - x[change]))
    if above[0]:
        ends.insert(0, x[0])
    if above[-1]:
        ends.append(x[-1])
    jumps = [k for k in range(1, len(ends) - 1, 2) if ends[k + 1] - ends[k] < SHORTEST_GAP]
    ends = [end for k, end in enumerate(ends) if k not in jumps and k - 1 not in jumps]
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


_NEEDED = (
    *(f"vertex_{name}" for name in ("x", "y", "block")),
    *(f"block_{name}" for name in ("x", "y", "displacement_x", "displacement_y", "rotation")),
    *(f"contact_{name}" for name in ("x", "y", "interface", "kind", "length", "opening", "state")),
    *("contact_normal_x", "contact_normal_y", "central_deflection"),
)


@dataclass(frozen=True)
class Deformed:
    """A wall at one increment, drawn with its displacements multiplied by a factor."""

    ds: xr.Dataset
    increment: int
    motion: Motion
    points: FloatArray  # (v, 2): corners of the blocks before any movement (m)
    block: IntArray  # (v,): block of each corner
    factor: float
    rigid: BoolArray  # (n,): blocks without zones
    footing: BoolArray  # (n,): blocks of the footing
    datum: float | None = None  # on soil the upward displacement of the footing under dead load (m)

    @classmethod
    def of(cls, ds: xr.Dataset, increment: int, exaggeration: float | None) -> Deformed:
        """Wall at the increment with that position; by default with a round factor on displacements."""
        require(ds, _NEEDED, "the result of one wall with all its fields (`damagepred solve`)")
        steps = ds.sizes["increment"]
        if not -steps <= increment < steps:
            raise InputError(
                f"increment = {increment}: the wall has {steps} increments; take 0 to {steps - 1}, or -1 for the last."
            )
        if exaggeration is not None and not (np.isfinite(exaggeration) and exaggeration >= 0):
            raise InputError(f"exaggeration = {exaggeration!r}: must be a number of 0 or more.")
        motion, (points, block) = Motion.of(ds, increment), corners(ds)
        footing, datum = footing_blocks(ds), settlement(ds)
        drawn = motion.at(block, points)
        if datum is not None:
            motion = replace(motion, displacement=motion.displacement - [0.0, datum])
            rise = soil_surface(ds, increment, footing)[2] - datum
            drawn = np.concatenate((motion.at(block, points), np.column_stack((0.0 * rise, rise))))
        if exaggeration is None:
            exaggeration = round_exaggeration(drawn, float(ds.attrs.get("longest_wall", np.ptp(points[:, 0]))))
        rigid = np.ones(len(motion.x), dtype=np.bool_)
        if "zone_block" in ds.variables:
            rigid[ds["zone_block"].values] = False
        return cls(ds, increment, motion, points, block, float(exaggeration), rigid, footing, datum)

    @cached_property
    def shape(self) -> FloatArray:
        """Corners as drawn (v, 2) (m)."""
        return self.points + self.factor * self.motion.at(self.block, self.points)

    @cached_property
    def outlines(self) -> list[FloatArray]:
        """Corners of each block as drawn (m)."""
        return polygons(self.shape, self.block)

    @cached_property
    def faces(self) -> Faces:
        """Interfaces at the increment."""
        return Faces.of(self.ds, self.increment)

    @cached_property
    def zones(self) -> Zones:
        """Zones before any movement."""
        return Zones.of(self.ds)

    @cached_property
    def gridpoints(self) -> FloatArray:
        """Gridpoints as drawn (g, 2) (m)."""
        moved = [self.ds[f"gridpoint_displacement_{axis}"].values[self.increment] for axis in "xy"]
        moved[1] = moved[1] - (self.datum or 0.0)
        return np.asarray(self.zones.points + self.factor * np.column_stack(moved))

    def gaps(self, faces: Faces) -> FloatArray:
        """Gap between the two blocks of each interface as drawn: quadrilaterals (m, 4, 2)."""
        start, end, sides = faces.joints.start, faces.joints.end, faces.joints.blocks.T

        def shown(side: int, place: FloatArray) -> FloatArray:
            # where one side was not found, the other stands for both
            block = np.where(sides[side] >= 0, sides[side], sides[1 - side])
            return place + self.factor * self.motion.at(block, place) * (block >= 0)[:, None]

        return np.stack((shown(0, start), shown(0, end), shown(1, end), shown(1, start)), 1)

    def middles(self, faces: Faces) -> FloatArray:
        """Lines midway between the two blocks of each interface as drawn (m, 2, 2)."""
        gaps = self.gaps(faces)
        return (gaps[:, :2] + gaps[:, [3, 2]]) / 2

    @property
    def scale(self) -> str:
        """Scale of displacements in words."""
        if self.factor in (0.0, 1.0):
            return "displacements to scale" if self.factor else "undeformed"
        return f"displacements exaggerated {sheet.plain_number(self.factor)} times"

    @cached_property
    def unbroken(self) -> FloatArray:
        """Both faces, as drawn, of the middles of bricks that have not broken (k, 4, 2) (m)."""
        faces = self.faces
        return self.gaps(faces.pick((faces.joints.kind == ContactKind.BRICK_JOINT) & (faces.crack <= HAIRLINE)))

    def draw_rigid(self, ax: Axes, colours: Any) -> None:
        """Fill the rigid blocks with one colour, or one per block; segments of a footing are grey."""
        segments = [self.outlines[i] for i in np.flatnonzero(self.rigid & self.footing)]
        if segments:
            sheet.add_shapes(ax, segments, facecolors=FOOTING_COLOUR, zorder=2, label="footing", snap=False)
        chosen = [self.outlines[i] for i in np.flatnonzero(self.rigid & ~self.footing)]
        if chosen:
            style = {"facecolors": colours, "edgecolors": "none", "zorder": 2, "snap": False}
            sheet.add_shapes(ax, chosen, label="rigid blocks", **style)

    def draw_outlines(self, ax: Axes) -> None:
        """Draw the edges of all blocks, and both faces of open joints: mortar black, the dpc in its colour."""
        rigid = (self.outlines[i] for i in np.flatnonzero(self.rigid))
        lines = [np.vstack((p, p[:1])) for p in rigid]
        if len(self.unbroken):
            sides = np.concatenate([np.stack((p[:-1], p[1:]), axis=1) for p in lines])
            middle, hidden = sides.mean(axis=1), self.unbroken.reshape(-1, 2, 2).mean(axis=1)
            near = np.hypot(*(middle[:, None] - hidden).transpose(2, 0, 1)).min(axis=1)
            lines = list(sides[near > 1e-6 * float(np.ptp(self.points))])
        if not self.rigid.all():
            lines += list(self.gridpoints[self.zones.rims()])
        sheet.add_lines(ax, lines, colors=OUTLINE_COLOUR, linewidths=0.25, zorder=3, label="outlines")
        faces = self.faces
        parts = (
            ("cracks", faces.pick(faces.joints.is_masonry & (faces.crack > HAIRLINE)), "black"),
            ("dpc opening", faces.pick(faces.joints.is_dpc & (faces.opening > HAIRLINE)), DPC_COLOUR),
        )
        for label, chosen, colour in parts:
            if len(chosen.crack):
                gaps = self.gaps(chosen)
                sides = np.stack((gaps[:, :2], gaps[:, 2:]), axis=1).reshape(-1, 2, 2)
                sheet.add_lines(ax, sides, colors=colour, linewidths=0.6, zorder=4, label=label)

    def finish(self, ax: Axes, words: str) -> None:
        """Draw outlines, axes and title of a field, and the scale bar of displacements."""
        self.draw_outlines(ax)
        sheet.set_title(ax, sheet.title_of(self.ds, "wall"), words, self.scale)
        sheet.elevation(ax)
        low, high = self.shape.min(axis=0), self.shape.max(axis=0)
        room = 0.02 * (high - low)[0]
        ax.set_xlim(low[0] - room, high[0] + room)
        ax.set_ylim(low[1] - room, high[1] + room)
        if self.factor in (0.0, 1.0):
            return
        # under the wall's right end, as long as a round displacement is drawn
        length = float(np.ptp(self.points[:, 0]))
        size = sheet.nearest_round(0.08 * length / self.factor, (1.0, 2.0, 5.0))
        right = float(self.shape[:, 0].max())
        left = right - self.factor * size
        under = sheet.below(ax, 0.47, ax.get_xaxis_transform())
        style: dict[str, Any] = {"linewidth": 2.0, "solid_capstyle": "butt", "label": "magnification"}
        ax.plot([left, right], [0.0, 0.0], color="black", transform=under, clip_on=False, **style)
        words = f"displacement of {sheet.plain_number(size * sheet.MM)} mm"
        ax.text(left - 0.01 * length, 0.0, words, transform=under, ha="right", va="center", fontsize=sheet.small(ax))
