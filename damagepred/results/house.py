"""Results of a house by wall and by room, and one wall out of the result of a house."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from damagepred.archive.folder import open_study
from damagepred.archive.schema import BY_WALL, OF_HOUSE, VARIABLES
from damagepred.arrays import FloatArray
from damagepred.enumerations import LOCAL, ContactState, PathStatus
from damagepred.errors import InputError, nearest
from damagepred.inputs.arguments import checked
from damagepred.uq.intensity import OF_SITE

if TYPE_CHECKING:
    import pandas as pd

    from damagepred.scene import House, Scene

PLACES = ("block", "contact", "vertex", "opening", "section")
"""Dimensions along which the walls of a house follow each other."""
NOT_OF_HOUSE = ("central_deflection", "deflection_ratio", "base_reaction")
"""Results of each wall whose largest value says nothing about the house; the reaction is a sum."""
_STATE = ("opening", "slip", "state")  # contact fields that damage is judged by


def is_house(ds: xr.Dataset) -> bool:
    """Whether a dataset is the result of a house or of a study of houses, or was fitted to one."""
    return "wall" in ds.dims or ds.attrs.get("sampled") == "house"


def noun(ds: xr.Dataset) -> str:
    """Noun for the samples of a study, or for one result."""
    return "house" if is_house(ds) else "wall"


def wall_names(ds: xr.Dataset) -> list[str]:
    """Names of the walls of a house."""
    return str(ds["wall"].attrs["flag_meanings"]).split()


def house_of(ds: xr.Dataset) -> House:
    """Plan of an archived house."""
    from damagepred.scene import House
    from damagepred.scene.scene import archived_scene

    house = archived_scene(ds.attrs)
    if not isinstance(house, House):
        raise InputError("ds: is the result of one wall; give the result of a house.")
    return house


def study_of(path: str | Path, wall: str | None = None) -> xr.Dataset:
    """Study of a folder; of a study of houses, the house by its worst wall, or one of its walls."""
    ds = open_study(path)
    return ds if wall is None else wall_dataset(ds, wall)


@checked
def wall_dataset(ds: xr.Dataset, name: str) -> xr.Dataset:
    """Result of one wall of a house, or of one wall in a study of houses; energies are of the whole house."""
    if not is_house(ds):
        raise InputError(f"wall = '{name}': this is the result of one wall; walls of a house have names.")
    house, names = house_of(ds), wall_names(ds)
    if name not in names:
        raise InputError(f"wall = '{name}': the house has {', '.join(names)}." + nearest(name, names))
    number = names.index(name)
    walls = {dim: np.atleast_2d(ds[f"{dim}_wall"].values).max(axis=0) for dim in PLACES if f"{dim}_wall" in ds}
    places = {dim: np.flatnonzero(of_places == number) for dim, of_places in walls.items()}
    one = ds.isel({**places, "wall": number}, drop=True)
    own = {f"{end}wall_{key}": f"{end}{key}" for key in BY_WALL for end in ("", "end_") if f"{end}wall_{key}" in one}
    drop = [*(key for key in own.values() if key in one), *(key for key in OF_HOUSE if key in one and key not in own)]
    one = one.drop_vars(drop).rename(own)
    one = one.drop_dims([dim for dim in PLACES if one.sizes.get(dim) == 0])
    for key in ("vertex_block", "contact_interface", "contact_joint"):
        if key in one:
            one[key] = one[key] - one[key].min()
    one = one.set_coords([key for key in ("central_deflection", "deflection_ratio") if key in one])
    if one.attrs.get("status") == PathStatus.COLLAPSED:
        moved = np.hypot(*(ds[f"block_displacement_{axis}"].values[-1] for axis in "xy"))
        if number != ds["block_wall"].values[moved.argmax()]:  # another wall has moved farthest and fallen
            one.attrs["status"] = str(PathStatus.COMPLETE)
    scene, title = house.scenes[number], f"{ds.attrs.get('title', 'house')}: {name}"  # its ground is a table
    size = {
        "span": scene.wall.length,
        "thickness": scene.wall.thickness,
        "ground": LOCAL.get(house.mound.shape, OF_SITE),
    }
    return one.assign_attrs(scene=scene.to_toml(), title=title, **size)


def unfolded(ds: xr.Dataset) -> xr.Dataset:
    """House with its walls in rows in one plane, for drawings of one wall."""
    house = house_of(ds)
    places = np.array(unfolded_places(house))
    flat = ds.drop_dims(["wall", "corner"]).assign_coords(central_deflection=("increment", 0.0 * ds["progress"].values))
    for dim in PLACES[:3]:
        for axis, shift in zip("xy", places[ds[f"{dim}_wall"].values].T):
            flat[f"{dim}_{axis}"] = (dim, flat[f"{dim}_{axis}"].values + shift, flat[f"{dim}_{axis}"].attrs)
    below = house.footing.depth + 0.25 * max(wall.height for wall in house.wall)
    labels = [(name, x, y - below) for name, (x, y) in zip(house.names, places.tolist())]
    return flat.assign_attrs(longest_wall=max(wall.length for wall in house.wall), labels=json.dumps(labels))


def unfolded_places(house: House) -> list[tuple[float, float]]:
    """Left end and level (m) of each wall, in as many rows as a drawing of 4 : 3 has room for."""
    lengths = [wall.length for wall in house.wall]
    pitch, gap = 1.35 * max(wall.height for wall in house.wall) + 1.0, 0.1 * max(lengths)
    runs = [sum(lengths[i:j]) + gap * (j - i - 1) for j in range(len(lengths) + 1) for i in range(j)]
    places: list[tuple[float, float]] = []
    for width in sorted(run for run in runs if run >= max(lengths)):
        x, row, places = 0.0, 0, []
        for length in lengths:
            x, row = (0.0, row + 1) if x > 0.0 and x + length > width + 1e-9 else (x, row)
            places.append((x, -row * pitch))
            x += length + gap
        if (row + 1) * pitch <= 0.75 * width:
            break
    return places


def wall_places(scene: Scene) -> FloatArray:
    """Left end and level (m) of each wall in drawings of a house, or of one wall (w, 2)."""
    from damagepred.scene import House

    return np.array(unfolded_places(scene) if isinstance(scene, House) else [(0.0, 0.0)])


def of_all_walls(parts: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Values of all walls together: blocks and contacts one after the other, results of each wall and the largest."""
    values: dict[str, Any] = {}
    sizes: dict[str, list[int]] = {}
    for name in dict.fromkeys(name for part in parts for name in part):
        arrays, dims = [part[name] for part in parts if name in part], VARIABLES[name].dims
        if (place := next((dim for dim in PLACES if dim in dims), None)) is not None:
            axis = dims.index(place)
            values[name] = np.concatenate(arrays, axis=axis)
            sizes[place] = [part[name].shape[axis] if name in part else 0 for part in parts]
        elif name in BY_WALL:
            missing = np.full(arrays[0].shape, np.nan)
            values[f"wall_{name}"] = np.stack([part.get(name, missing) for part in parts], axis=-1)
            if name not in NOT_OF_HOUSE:
                values[name] = np.fmax.reduce(values[f"wall_{name}"], axis=-1)
        else:
            values[name] = arrays[0]
    values |= {f"{place}_wall": np.repeat(np.arange(len(parts)), size) for place, size in sizes.items()}
    if "wall_base_reaction" in values:
        values["base_reaction"] = values["wall_base_reaction"].sum(axis=-1)
    values["damaged_walls"] = (values["wall_damage_category"] >= 1).sum(axis=-1)
    return values


@checked
def room_sides(ds: xr.Dataset, increment: int = -1) -> pd.DataFrame:
    """Widest joint (m) and category on each side of each room, which has a number from 1 and a middle in plan."""
    import pandas as pd

    from damagepred.damage.joints import JointMap
    from damagepred.damage.judge import judge
    from damagepred.results.rejudge import archived_rules

    house, rules, judged, rows = house_of(ds), archived_rules(ds), {}, []
    parts = [wall_dataset(ds, name).isel(increment=increment) for name in house.names]
    joints = [JointMap.from_dataset(part, with_blocks=True) for part in parts]
    for number, room in enumerate(room_bays(house), 1):
        x, y = _corners(house, room).mean(axis=0)
        for bay in room:
            if bay not in judged:
                wall, start, end = bay
                whole, part = joints[wall], parts[wall]
                middle = (whole.start[:, 0] + whole.end[:, 0]) / 2
                own = np.flatnonzero((middle >= start - 1e-6) & (middle <= end + 1e-6))
                fields = (part[f"contact_{key}"].values.reshape(whole.contact_x.shape)[own] for key in _STATE)
                opening, slip, state = fields
                judged[bay] = judge(whole.part(own), opening, slip, state == ContactState.CRACKED, rules)
            verdict, wall = judged[bay], bay[0]
            rows.append((number, x, y, house.names[wall], *bay[1:], verdict.crack_width_max, verdict.damage_category))
    heads = ["room", "x", "y", "wall", "start", "end", "crack_width_max", "damage_category"]
    return pd.DataFrame(rows, columns=heads)


Bay = tuple[int, float, float]


def room_bays(house: House) -> list[list[Bay]]:
    """Bays of walls around each room: the faces of the plan, each traced with the room on the left."""
    from damagepred.scene.plan import PLAN_TOLERANCE

    bays, points = [], []
    for number, wall in enumerate(house.wall):
        cuts = {0.0, wall.length} | {j.x[j.walls.index(number)] for j in house.junctions if number in j.walls}
        for start, end in pairwise(sorted(cuts)):
            bays += [(number, start, end)] * 2
            points += [wall.points(np.array([start, end])), wall.points(np.array([end, start]))]
    ways = np.array(points)  # (k, 2, 2): from and to; way k ^ 1 goes back
    angle = np.arctan2(*(ways[:, 1] - ways[:, 0]).T[::-1])

    def following(k: int) -> int:
        leave = np.flatnonzero(np.hypot(*(ways[:, 0] - ways[k, 1]).T) <= 3 * PLAN_TOLERANCE)
        return int(leave[np.argmin((angle[k ^ 1] - angle[leave] - 1e-9) % (2 * np.pi))])

    left, rooms = set(range(len(ways))), []
    while left:
        loop = [min(left)]
        while (after := following(loop[-1])) != loop[0]:
            loop.append(after)
        left -= set(loop)
        x, y = ways[loop, 0].T
        if (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() > 1e-6:
            rooms.append(list(dict.fromkeys(bays[k] for k in loop)))
    return sorted(rooms, key=lambda room: tuple(np.round(_corners(house, room).mean(axis=0)[::-1], 3)))


def _corners(house: House, room: Sequence[Bay]) -> np.ndarray:
    """Ends of the bays of a room (k, 2) (m)."""
    return np.concatenate([house.wall[number].points(np.array([start, end])) for number, start, end in room])
