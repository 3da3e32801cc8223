"""Stress in the blocks: filled contours on the deformed wall."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import Triangulation

from damagepred.archive.schema import is_dynamic
from damagepred.arrays import FloatArray, IntArray
from damagepred.errors import InputError
from damagepred.inputs.arguments import checked
from damagepred.plotting.colours import band_colours
from damagepred.plotting.deformed import Deformed
from damagepred.plotting.geometry import Faces, corners, polygons
from damagepred.plotting.sheet import axes_or_new, figure_of, plain_number, require, set_title
from damagepred.plotting.zone_geometry import has_zones
from damagepred.scene.scene import archived_scene

MPA = 1e-6
"""Megapascals in a pascal."""

COMPONENTS = {
    "xx": r"$\sigma_{xx}$, along the wall",
    "yy": r"$\sigma_{yy}$, upright",
    "xy": r"$\sigma_{xy}$, shear",
    "largest": r"$\sigma_1$, largest principal stress",
    "smallest": r"$\sigma_2$, smallest principal stress",
}
"""What can be drawn, and its name."""

TAIL_PERCENT = 5.0
"""Percentage of the area at either end that does not count for the limits of the colours: corners peak."""
LEVEL_MARGIN = 1.25
"""Reach of the colours over that of the rest."""
ONE_SIDED = 0.1
"""Share on the other side of zero below which only one half of the colours is used."""
SMALLEST_LEVEL = 1e-3
"""Where the colours end if there is no stress at all (MPa)."""
MAX_BANDS = 18
"""Bands of colour at most."""

_CONTACTS = ("contact_normal_stress", "contact_shear_stress")


@checked
def draw_stress(
    ds: xr.Dataset,
    ax: Axes | None = None,
    component: str = "xx",
    increment: int = -1,
    exaggeration: float | None = None,
    levels: Sequence[float] | FloatArray | None = None,
) -> Axes:
    """Draw filled contours of a stress (MPa, tension positive and red) on the deformed wall.

    Of deformable blocks it is the stress of their zones, as means at the gridpoints of each block; of rigid ones the
    mean stress that the forces in their joints make, see ``block_stress``; of elastic ones that mean and the stress of
    their bending, see ``bending_stress``. Segments of a footing are left grey.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall, as ``damagepred.solve`` returns it.
    ax : Axes, optional
        Where to draw; by default on a new figure.
    component : {"xx", "yy", "xy", "largest", "smallest"}
        Which: along the wall, upright, shear, or a principal stress in the wall's plane.
    increment : int
        Position of the increment, -1 for the last.
    exaggeration : float, optional
        Factor on all displacements; by default a round number that shows the largest as about 4.5 % of the
        wall's length.
    levels : sequence of float, optional
        Limits of the bands of colour (MPa), rising; by default those of ``stress_levels``.

    Raises
    ------
    InputError
        If the dataset is not of one wall, or has no such increment or component.

    Examples
    --------
    >>> import damagepred, xarray
    >>> ax = damagepred.plotting.draw_stress(xarray.open_dataset("zones.nc"), component="yy")
    >>> ax.get_xlabel()
    'along the wall (m)'
    """
    _check(ds, component)
    wall = Deformed.of(ds, increment, exaggeration)
    ax = axes_or_new(ax, 10.0, wall.sheet_height(1.4))
    rigid, zoned = _stresses(wall)
    bent, bent_corners = _bent(wall, rigid)
    if levels is None:
        levels = _levels([_every(wall, rigid, zoned, component)])
    limits = np.asarray(levels, dtype=np.float64)
    colours = band_colours(limits)
    norm = BoundaryNorm(list(limits), colours.N, extend="both")
    wall.draw_rigid(ax, colours(norm(MPA * one_of(rigid, component))))
    filled: dict[str, Any] = {
        "levels": limits,
        "colors": [tuple(c) for c in np.asarray(colours.colors)],
        "extend": "both",
        "zorder": 2,
    }
    if len(bent):
        shape, triangles = wall.shape, np.concatenate((bent_corners[:, [0, 1, 2]], bent_corners[:, [0, 2, 3]]))
        picture = ax.tricontourf(
            Triangulation(shape[:, 0], shape[:, 1], triangles), MPA * one_of(bent, component), **filled
        )
        picture.set_label("elastic blocks")
    if len(zoned):
        zones, shape = wall.zones, wall.gridpoints
        smooth = np.column_stack([zones.at_gridpoints(s) for s in zoned.T])
        picture = ax.tricontourf(
            Triangulation(shape[:, 0], shape[:, 1], zones.corners),
            MPA * one_of(smooth, component),
            **filled,
        )
        picture.set_label("zones")
    wall.draw_outlines(ax)
    wall.draw_cracks(ax)
    wall.finish(ax)
    bar = figure_of(ax).colorbar(
        ScalarMappable(norm, colours), cax=ax.inset_axes((1.02, 0.0, 0.025, 1.0)), extend="both", spacing="uniform"
    )
    bar.set_label("MPa, tension positive")
    every = MPA * np.concatenate([one_of(s, component) for s in (rigid, zoned, bent)])
    reach = f"{_signed(every.min())} to {_signed(every.max())} MPa"
    set_title(ax, wall.title, f"{COMPONENTS[component]}, at {wall.movement}: {reach}", wall.scale)
    return ax


def _signed(value: float) -> str:
    return ("-" if value < 0 else "") + plain_number(abs(value))


def _check(ds: xr.Dataset, component: str) -> None:
    require(ds, _CONTACTS, "the result of one wall with all its fields (`damagepred solve`)")
    if component not in COMPONENTS:
        raise InputError(f"component = {component!r}: must be one of {', '.join(COMPONENTS)}.")
    if is_dynamic(ds) and not has_zones(ds):
        raise InputError("stress in rigid blocks is drawn of static runs only: in time, they change neighbours.")


def zone_stress(ds: xr.Dataset, increment: int) -> FloatArray:
    """Return s_xx, s_yy and s_xy of the zones at an increment, (z, 3) (Pa)."""
    return np.column_stack([ds[f"zone_stress_{name}"].values[increment] for name in ("xx", "yy", "xy")])


def block_stress(ds: xr.Dataset, increment: int) -> FloatArray:
    """Return the mean stress s_xx, s_yy and s_xy in every block, (n, 3) (Pa), from the forces in its joints.

    In equilibrium the mean stress of a body is that of the forces f on its boundary at places r from its centroid,
    sum(f r) / volume, whatever it is made of; uniform weight adds nothing. Forces that act on a block as a whole, as
    the roof's, count as if spread over it like weight.
    """
    points, block = corners(ds)
    _, face = np.unique(ds["contact_interface"].values, return_inverse=True)
    sides = Faces.of(ds, increment).neighbours(points, block)
    normal = np.column_stack([ds[f"contact_normal_{axis}"].values for axis in "xy"])
    tangent = np.column_stack((normal[:, 1], -normal[:, 0]))
    length = ds["contact_length"].values[:, None]
    if "contact_thickness" in ds:  # files of before have lengths in terms of the wall's thickness
        length = length * ds["contact_thickness"].values[:, None] / ds.attrs["thickness"]
    pull = ds["contact_normal_stress"].values[increment][:, None] * normal
    force = length * (pull + ds["contact_shear_stress"].values[increment][:, None] * tangent)
    place = np.column_stack([ds[f"contact_{axis}"].values for axis in "xy"])
    centre = np.column_stack([ds[f"block_{axis}"].values for axis in "xy"])
    total = np.zeros((len(centre), 3))
    for side, sign in zip(sides, (1.0, -1.0)):
        own = side[face]
        known = own >= 0
        f, r = sign * force[known], place[known] - centre[own[known]]
        parts = (f[:, 0] * r[:, 0], f[:, 1] * r[:, 1], 0.5 * (f[:, 0] * r[:, 1] + f[:, 1] * r[:, 0]))
        for k, part in enumerate(parts):
            np.add.at(total[:, k], own[known], part)
    area = np.array([_area(p) for p in polygons(points, block)])
    return np.asarray(total / area[:, None])


def bending_stress(ds: xr.Dataset, increment: int) -> FloatArray:
    """Return s_xx (Pa) at the corners of all blocks that their curvature makes, -E kappa (y - y_centre): (v,)."""
    points, block = corners(ds)
    modulus = archived_scene(ds.attrs).block.elastic_modulus
    arm = points[:, 1] - ds["block_y"].values[block]
    return np.asarray(-modulus * ds["block_curvature"].values[increment][block] * arm)


def _bent(wall: Deformed, rigid: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return s_xx, s_yy, s_xy (Pa) at all corners of a wall of elastic blocks, and the corners of these (k, 4)."""
    ds = wall.ds
    if "block_curvature" not in ds.variables or "scene" not in ds.attrs:
        return np.empty((0, 3)), np.empty((0, 4), dtype=np.int64)
    mean = np.zeros((ds.sizes["block"], 3))
    mean[wall.rigid & ~wall.footing] = rigid
    stress = mean[wall.block]
    stress[:, 0] += bending_stress(ds, wall.increment)
    first, count = np.unique(wall.block, return_index=True, return_counts=True)[1:]
    # a rectangle is elastic, and any curvature at all tells it from the rigid ones
    elastic = (count == 4) & (ds["block_curvature"].values != 0.0).any(axis=0) & ~wall.footing
    return stress, first[elastic][:, None] + np.arange(4)


def _area(polygon: FloatArray) -> float:
    x, y = (polygon - polygon[0]).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def one_of(stress: FloatArray, component: str) -> FloatArray:
    """Return one component of stresses s_xx, s_yy, s_xy (k, 3), or a principal stress; array (k,)."""
    if component in ("xx", "yy", "xy"):
        return np.asarray(stress[:, ("xx", "yy", "xy").index(component)])
    middle, half = 0.5 * (stress[:, 0] + stress[:, 1]), 0.5 * (stress[:, 0] - stress[:, 1])
    radius = np.hypot(half, stress[:, 2])
    return np.asarray(middle + radius if component == "largest" else middle - radius)


def stress_levels(ds: xr.Dataset, component: str, increments: Sequence[int]) -> FloatArray:
    """Return round limits (MPa) of bands of colour for a stress at some increments."""
    _check(ds, component)
    walls = [Deformed.of(ds, increment, 1.0) for increment in increments]
    return _levels([_every(wall, *_stresses(wall), component) for wall in walls])


def _levels(fields: Sequence[tuple[FloatArray, FloatArray]]) -> FloatArray:
    """Return levels (MPa) for stresses (Pa) that stand for areas."""
    low, high = 0.0, 0.0
    for values, weight in fields:
        order = np.argsort(values)
        share = np.cumsum(weight[order]) / weight.sum()
        found = values[order][np.searchsorted(share, [TAIL_PERCENT / 100, 1 - TAIL_PERCENT / 100])]
        low, high = min(low, float(found[0])), max(high, float(found[1]))
    reach = LEVEL_MARGIN * MPA * max(-low, high) or SMALLEST_LEVEL
    two_sided = min(-low, high) >= ONE_SIDED * max(-low, high)
    ends = (-reach if two_sided or -low > high else 0.0, reach if two_sided or high > -low else 0.0)
    return np.asarray(MaxNLocator(MAX_BANDS, steps=[1, 2, 2.5, 5, 10], symmetric=two_sided).tick_values(*ends))


def _stresses(wall: Deformed) -> tuple[FloatArray, FloatArray]:
    """Return s_xx, s_yy, s_xy (Pa) of the rigid blocks (k, 3) and of all zones (z, 3)."""
    bricks = wall.rigid & ~wall.footing
    rigid = block_stress(wall.ds, wall.increment)[bricks] if bricks.any() else np.empty((0, 3))
    return rigid, zone_stress(wall.ds, wall.increment) if has_zones(wall.ds) else np.empty((0, 3))


def _every(wall: Deformed, rigid: FloatArray, zoned: FloatArray, component: str) -> tuple[FloatArray, FloatArray]:
    """Return all stresses (Pa), and the areas they stand for."""
    area = np.array([_area(p) for p in polygons(wall.points, wall.block)])[wall.rigid & ~wall.footing]
    weight = [area, wall.zones.area] if len(zoned) else [area]
    return np.concatenate([one_of(s, component) for s in (rigid, zoned)]), np.concatenate(weight)
