"""The deformed wall as a base for fields: factor, outlines, open joints, scale bar, words for the title."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.damage.cracks import HAIRLINE
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.plotting import geometry, sheet
from damagepred.plotting.colours import DPC_COLOUR, FOOTING_COLOUR, OUTLINE_COLOUR

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
    motion: geometry.Motion
    points: FloatArray  # (v, 2): corners of the blocks before any movement (m)
    block: IntArray  # (v,): block of each corner
    factor: float
    rigid: BoolArray  # (n,): blocks without zones
    footing: BoolArray  # (n,): blocks of the footing
    datum: float | None = None  # on soil the upward displacement of the footing under dead load (m)

    @classmethod
    def of(cls, ds: xr.Dataset, increment: int, exaggeration: float | None) -> Deformed:
        """Wall at the increment with that position; by default with a round factor on displacements."""
        sheet.require(ds, _NEEDED, "the result of one wall with all its fields (`damagepred solve`)")
        steps = ds.sizes["increment"]
        if not -steps <= increment < steps:
            raise InputError(
                f"increment = {increment}: the wall has {steps} increments; take 0 to {steps - 1}, or -1 for the last."
            )
        if exaggeration is not None and not (np.isfinite(exaggeration) and exaggeration >= 0):
            raise InputError(f"exaggeration = {exaggeration!r}: must be a number of 0 or more.")
        motion, (points, block) = geometry.Motion.of(ds, increment), geometry.corners(ds)
        footing, datum = geometry.footing_blocks(ds), geometry.settlement(ds)
        drawn = motion.at(block, points)
        if datum is not None:
            motion = replace(motion, displacement=motion.displacement - [0.0, datum])
            rise = geometry.soil_surface(ds, increment, footing)[2] - datum
            drawn = np.concatenate((motion.at(block, points), np.column_stack((0.0 * rise, rise))))
        if exaggeration is None:
            exaggeration = geometry.round_exaggeration(drawn, float(ds.attrs.get("longest_wall", np.ptp(points[:, 0]))))
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
        return geometry.polygons(self.shape, self.block)

    @cached_property
    def faces(self) -> geometry.Faces:
        """Interfaces at the increment."""
        return geometry.Faces.of(self.ds, self.increment)

    @cached_property
    def zones(self) -> geometry.Zones:
        """Zones before any movement."""
        return geometry.Zones.of(self.ds)

    @cached_property
    def gridpoints(self) -> FloatArray:
        """Gridpoints as drawn (g, 2) (m)."""
        moved = [self.ds[f"gridpoint_displacement_{axis}"].values[self.increment] for axis in "xy"]
        moved[1] = moved[1] - (self.datum or 0.0)
        return np.asarray(self.zones.points + self.factor * np.column_stack(moved))

    def gaps(self, faces: geometry.Faces) -> FloatArray:
        """Gap between the two blocks of each interface as drawn: quadrilaterals (m, 4, 2)."""
        start, end, sides = faces.joints.start, faces.joints.end, faces.joints.blocks.T

        def shown(side: int, place: FloatArray) -> FloatArray:
            # where one side was not found, the other stands for both
            block = np.where(sides[side] >= 0, sides[side], sides[1 - side])
            return place + self.factor * self.motion.at(block, place) * (block >= 0)[:, None]

        return np.stack((shown(0, start), shown(0, end), shown(1, end), shown(1, start)), 1)

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

    def sheet_height(self, room: float) -> float:
        """Height (inches) of a sheet 10 wide, with room for title, axis, colour bar and legend."""
        return sheet.height_to_scale(self.shape, room)

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
