"""Stress in blocks and zones: from the forces in joints, from bending of elastic blocks, from stored zones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.ticker import MaxNLocator

from damagepred.archive.schema import is_dynamic, require
from damagepred.arrays import FloatArray, IntArray
from damagepred.damage.joints import JointMap
from damagepred.errors import InputError
from damagepred.plotting.geometry import Deformed, corners, polygons
from damagepred.plotting.sheet import MPA
from damagepred.scene.scene import archived_scene

STRESSES = {
    "stress_xx": r"$\sigma_{xx}$, along the wall",
    "stress_yy": r"$\sigma_{yy}$, upright",
    "stress_xy": r"$\sigma_{xy}$, shear",
    "stress_largest": r"$\sigma_1$, largest principal stress",
    "stress_smallest": r"$\sigma_2$, smallest principal stress",
}
"""Stresses of rigid, elastic and deformable blocks alike, and their names."""

TAIL_PERCENT = 5.0
"""Percentage of the area at either end that does not count for the limits of the colours: corners peak."""
LEVEL_MARGIN = 1.25  # reach of the colours over the largest stress of the rest
ONE_SIDED = 0.1  # share on the other side of zero below which only one half of the colours is used
SMALLEST_LEVEL = 1e-3  # end of the colours without any stress (MPa)
MAX_BANDS = 18  # bands of colour at most


def check_stress(ds: xr.Dataset) -> None:
    """Refuse datasets without stresses."""
    needed = ("contact_normal_stress", "contact_shear_stress")
    require(ds, needed, "the result of one wall with all its fields (`damagepred solve`)")
    if is_dynamic(ds) and "zone_state" not in ds:
        raise InputError("stress in rigid blocks is drawn of static runs only: in time, they change neighbours.")


def block_stress(ds: xr.Dataset, increment: int) -> FloatArray:
    """Mean stress s_xx, s_yy and s_xy in every block, (n, 3) (Pa): sum(f r) / volume over the forces in its joints."""
    # forces on a block as a whole, such as the roof's, count as if spread over it like weight, which adds nothing
    points, block = corners(ds)
    _, face = np.unique(ds["contact_interface"].values, return_inverse=True)
    sides = JointMap.from_dataset(ds, with_blocks=True).blocks.T
    normal = np.column_stack([ds[f"contact_normal_{axis}"].values for axis in "xy"])
    tangent = np.column_stack((normal[:, 1], -normal[:, 0]))
    length = ds["contact_length"].values[:, None]
    if "contact_thickness" in ds:  # in older files lengths are in terms of the wall's thickness
        length = length * ds["contact_thickness"].values[:, None] / ds.attrs["thickness"]
    pull = ds["contact_normal_stress"].values[increment][:, None] * normal
    force = length * (pull + ds["contact_shear_stress"].values[increment][:, None] * tangent)
    place = np.column_stack([ds[f"contact_{axis}"].values for axis in "xy"])
    centre = np.column_stack([ds[f"block_{axis}"].values for axis in "xy"])
    total = np.zeros((len(centre), 3))
    for side, sign in zip(sides, (1.0, -1.0)):
        beside = side[face]
        inner = beside >= 0
        f, r = sign * force[inner], place[inner] - centre[beside[inner]]
        products = (f[:, 0] * r[:, 0], f[:, 1] * r[:, 1], 0.5 * (f[:, 0] * r[:, 1] + f[:, 1] * r[:, 0]))
        for k, product in enumerate(products):
            np.add.at(total[:, k], beside[inner], product)
    return np.asarray(total / _areas(points, block)[:, None])


def bending_stress(ds: xr.Dataset, increment: int) -> FloatArray:
    """Bending stress s_xx (Pa) at the corners of all blocks, -E kappa (y - y_centre): (v,)."""
    points, block = corners(ds)
    modulus = archived_scene(ds.attrs).block.elastic_modulus
    arm = points[:, 1] - ds["block_y"].values[block]
    return np.asarray(-modulus * ds["block_curvature"].values[increment][block] * arm)


def elastic_stress(wall: Deformed, mean: FloatArray) -> tuple[FloatArray, IntArray]:
    """Stresses (Pa) at all corners from the means (k, 3) and bending, and corners of the elastic blocks (e, 4)."""
    ds = wall.ds
    if "block_curvature" not in ds.variables or "scene" not in ds.attrs:
        return np.empty((0, 3)), np.empty((0, 4), dtype=np.int64)
    stress = np.zeros((ds.sizes["block"], 3))
    stress[wall.rigid & ~wall.footing] = mean
    stress = stress[wall.block]
    stress[:, 0] += bending_stress(ds, wall.increment)
    first, count = np.unique(wall.block, return_index=True, return_counts=True)[1:]
    # an elastic block is a rectangle, and has some curvature on the path
    elastic = (count == 4) & (ds["block_curvature"].values != 0.0).any(axis=0) & ~wall.footing
    return stress, first[elastic][:, None] + np.arange(4)


def _areas(points: FloatArray, block: IntArray) -> FloatArray:
    """Area of each block (n,) (m2)."""
    centred = (polygon - polygon[0] for polygon in polygons(points, block))
    return np.array([0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) for x, y in (p.T for p in centred)])


def one_of(stress: FloatArray, component: str) -> FloatArray:
    """One component of stresses s_xx, s_yy, s_xy (k, 3), or the "largest" or "smallest" principal stress; (k,)."""
    if component in ("xx", "yy", "xy"):
        return np.asarray(stress[:, ("xx", "yy", "xy").index(component)])
    middle, half = 0.5 * (stress[:, 0] + stress[:, 1]), 0.5 * (stress[:, 0] - stress[:, 1])
    radius = np.hypot(half, stress[:, 2])
    return np.asarray(middle + radius if component == "largest" else middle - radius)


def stresses(wall: Deformed) -> tuple[FloatArray, FloatArray]:
    """Stresses s_xx, s_yy, s_xy (Pa) of the rigid blocks (k, 3) and of all zones (z, 3)."""
    bricks = wall.rigid & ~wall.footing
    rigid = block_stress(wall.ds, wall.increment)[bricks] if bricks.any() else np.empty((0, 3))
    if "zone_state" not in wall.ds:
        return rigid, np.empty((0, 3))
    zoned = [wall.ds[f"zone_stress_{name}"].values[wall.increment] for name in ("xx", "yy", "xy")]
    return rigid, np.column_stack(zoned)


def stress_levels(ds: xr.Dataset, variable: str, increments: Sequence[int]) -> FloatArray:
    """Round limits (MPa) of bands of colour for a stress at some increments; nearly all of the area lies within."""
    check_stress(ds)
    low, high = 0.0, 0.0
    for wall in (Deformed.of(ds, increment, 1.0) for increment in increments):
        rigid, zoned = stresses(wall)
        values = np.concatenate([one_of(s, variable.removeprefix("stress_")) for s in (rigid, zoned)])
        weight = _areas(wall.points, wall.block)[wall.rigid & ~wall.footing]
        weight = np.concatenate((weight, wall.zones.area)) if len(zoned) else weight
        order = np.argsort(values)
        share = np.cumsum(weight[order]) / weight.sum()
        ends = values[order][np.searchsorted(share, [TAIL_PERCENT / 100, 1 - TAIL_PERCENT / 100])]
        low, high = min(low, float(ends[0])), max(high, float(ends[1]))
    reach = LEVEL_MARGIN * MPA * max(-low, high) or SMALLEST_LEVEL
    two_sided = min(-low, high) >= ONE_SIDED * max(-low, high)
    lowest, highest = -reach if two_sided or -low > high else 0.0, reach if two_sided or high > -low else 0.0
    locator = MaxNLocator(MAX_BANDS, steps=[1, 2, 2.5, 5, 10], symmetric=two_sided)
    return np.asarray(locator.tick_values(lowest, highest))
