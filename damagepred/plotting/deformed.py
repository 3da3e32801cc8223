"""The deformed wall as a ground to draw fields on: factor, outlines, open joints, scale bar, words for the title."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.damage.cracks import HAIRLINE
from damagepred.plotting.colours import DPC_COLOUR, FOOTING_COLOUR, OUTLINE_COLOUR
from damagepred.plotting.geometry import Faces, Motion, footing_blocks, gaps_of, moved_corners, polygons
from damagepred.plotting.sheet import MM, below, plain_number, title_of
from damagepred.plotting.zone_geometry import Zones, moved_gridpoints


@dataclass(frozen=True)
class Deformed:
    """A wall at one increment, drawn with its displacements multiplied.

    Attributes
    ----------
    ds : xarray.Dataset
        Of one wall.
    increment : int
        Position of the increment.
    motion : Motion
        Of the blocks.
    points : array (v, 2), block : array of int (v,)
        Corners of the blocks before any movement (m), and their blocks.
    factor : float
        On displacements.
    rigid : array of bool (n,)
        Blocks without zones.
    footing : array of bool (n,)
        Of them, segments of a footing, which have no stress of their own to be drawn.
    """

    ds: xr.Dataset
    increment: int
    motion: Motion
    points: FloatArray
    block: IntArray
    factor: float
    rigid: BoolArray
    footing: BoolArray

    @classmethod
    def of(cls, ds: xr.Dataset, increment: int, exaggeration: float | None) -> Deformed:
        """Read a wall at an increment; see ``draw_stress`` for the arguments.

        Parameters
        ----------
        ds : xarray.Dataset
            Of one wall.
        increment : int
            Position of the increment.
        exaggeration : float or None
            Factor on displacements; None: a round one.

        Raises
        ------
        InputError
            If the dataset is not of one wall, or has no such increment, or the factor is none.
        """
        motion, points, block, factor = moved_corners(ds, increment, exaggeration)
        rigid = np.ones(len(motion.x), dtype=np.bool_)
        if "zone_block" in ds.variables:
            rigid[ds["zone_block"].values] = False
        return cls(ds, increment, motion, points, block, factor, rigid, rigid & footing_blocks(ds))

    @property
    def shape(self) -> FloatArray:
        """Where the corners are drawn (v, 2) (m)."""
        return self.points + self.factor * self.motion.at(self.block, self.points)

    @property
    def length(self) -> float:
        """Of the wall (m)."""
        return float(np.ptp(self.points[:, 0]))

    @property
    def title(self) -> str:
        """Name of the wall."""
        return title_of(self.ds, "wall")

    @property
    def movement(self) -> str:
        """What has moved, and how far."""
        deflection = float(self.ds["central_deflection"].values[self.increment]) * MM
        if "time" in self.ds.variables:
            return f"{plain_number(float(self.ds['time'].values[self.increment]))} s"
        if deflection == 0.0:
            progress = float(self.ds["progress"].values[self.increment]) if "progress" in self.ds.variables else 0.0
            return f"{plain_number(100 * progress)} % of the movement" if progress else "dead load"
        return f"{_kind(self.ds)} {deflection:.1f} mm"

    @property
    def scale(self) -> str:
        """How large displacements are drawn."""
        if self.factor == 1.0:
            return "displacements to scale"
        return f"displacements exaggerated {plain_number(self.factor)} times"

    def sheet_height(self, other: float) -> float:
        """Return the height (inches) of a sheet 10 wide, with room for legend and title."""
        width, height = np.ptp(self.shape, axis=0)
        return float(np.clip(8.0 * height / width + other, 3.2, 9.0))

    def draw_rigid(self, ax: Axes, colours: Any) -> None:
        """Fill the rigid blocks with a colour, or with one each; segments of a footing are grey.

        Parameters
        ----------
        ax : Axes
            Where to draw.
        colours : object
            One colour, or one a rigid block.
        """
        outlines = polygons(self.shape, self.block)
        segments = [outlines[i] for i in np.flatnonzero(self.footing)]
        if segments:
            ax.add_collection(
                PolyCollection(segments, facecolors=FOOTING_COLOUR, zorder=2, label="footing", snap=False)
            )
        chosen = [outlines[i] for i in np.flatnonzero(self.rigid & ~self.footing)]
        if chosen:
            blocks = PolyCollection(chosen, edgecolors="none", zorder=2, label="rigid blocks", snap=False)
            blocks.set_facecolor(colours)
            ax.add_collection(blocks)

    def draw_outlines(self, ax: Axes) -> None:
        """Draw the edges of all blocks."""
        loops = [np.vstack((p, p[:1])) for p in polygons(self.shape, self.block)]
        lines = [loops[i] for i in np.flatnonzero(self.rigid)]
        if not self.rigid.all():
            zones = Zones.of(self.ds)
            lines += list(moved_gridpoints(self.ds, zones, self.increment, self.factor)[zones.rims()])
        ax.add_collection(LineCollection(lines, colors=OUTLINE_COLOUR, linewidths=0.25, zorder=3, label="outlines"))

    def draw_cracks(self, ax: Axes) -> None:
        """Draw both faces of cracked or open joints: mortar black, the dpc in its colour."""
        faces = Faces.of(self.ds, self.increment)
        parts = (
            ("cracks", faces.pick(faces.is_mortar & (faces.crack > HAIRLINE)), "black"),
            ("dpc opening", faces.pick(faces.is_dpc & (faces.opening > HAIRLINE)), DPC_COLOUR),
        )
        for label, chosen, colour in parts:
            if len(chosen.kind):
                gaps = gaps_of(chosen, self.motion, self.points, self.block, self.factor)
                sides = np.stack((gaps[:, :2], gaps[:, 2:]), axis=1).reshape(-1, 2, 2)
                ax.add_collection(LineCollection(list(sides), colors=colour, linewidths=0.6, zorder=4, label=label))

    def finish(self, ax: Axes) -> None:
        """Write the axes."""
        ax.set_aspect("equal")
        low, high = self.shape.min(axis=0), self.shape.max(axis=0)
        room = 0.02 * (high - low)[0]
        ax.set_xlim(low[0] - room, high[0] + room)
        ax.set_ylim(low[1] - room, high[1] + room)
        ax.set_xlabel("along the wall (m)")
        ax.set_ylabel("height (m)")
        for side in ("top", "right"):
            ax.spines[side].set_visible(False)


def _kind(ds: xr.Dataset) -> str:
    """Return the name of the movement, from the scene that the dataset keeps."""
    try:
        scene = tomllib.loads(str(ds.attrs.get("scene", "")))
    except tomllib.TOMLDecodeError:
        return "central deflection"
    return str(scene.get("movement", {}).get("kind", "central deflection"))


def add_magnification(ax: Axes, wall: Deformed) -> None:
    """Draw a bar under the wall's right end that is as long as a round displacement is drawn.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    wall : Deformed
        As it is drawn.
    """
    if wall.factor == 1.0:
        return
    wanted = 0.08 * wall.length / wall.factor
    steps = np.outer(10.0 ** np.arange(-7, 3), [1.0, 2.0, 5.0]).ravel()
    size = float(steps[np.argmin(np.abs(np.log(steps / wanted)))])
    right = float(wall.shape[:, 0].max())
    left = right - wall.factor * size
    where = below(ax, 0.47, ax.get_xaxis_transform())
    ax.plot(
        [left, right],
        [0.0, 0.0],
        color="black",
        linewidth=2.0,
        solid_capstyle="butt",
        transform=where,
        clip_on=False,
        label="magnification",
    )
    ax.text(
        left - 0.01 * wall.length,
        0.0,
        f"displacement of {plain_number(size * MM)} mm",
        transform=where,
        ha="right",
        va="center",
        fontsize="small",
    )
