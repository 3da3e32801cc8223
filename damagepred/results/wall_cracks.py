"""The cracks of an archived wall as objects: a dataset of them all, profiles along them, and a table to read."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from damagepred.archive.schema import Variable, dataset, flag_name, read_variables
from damagepred.damage import HAIRLINE
from damagepred.damage.joints import JointMap
from damagepred.damage.tracing import NO_LINKS, ORIENTATIONS, PARTS, Growth, Numbered, links_of
from damagepred.enumerations import ContactKind, ContactState, ZoneState, flag_meanings
from damagepred.errors import InputError
from damagepred.inputs.arguments import checked
from damagepred.results.house import is_house, wall_dataset, wall_names
from damagepred.runtime.one_thread import one_blas_thread

if TYPE_CHECKING:
    import pandas as pd

_BOTH, _PIECE = ("increment", "crack"), ("piece",)

_DRIVERS = ("load_displacement", "surface_movement")
"""Movements that drive some walls in place of the central deflection."""

_FLAGS = {"crack_part": PARTS, "crack_orientation": ORIENTATIONS, "piece_kind": (*flag_meanings(ContactKind), "block")}
CRACK_VARIABLES = read_variables(Path(__file__).with_name("cracks.csv"), _FLAGS)
"""Variables of ``cracks`` and ``crack_profile``."""


@checked
@one_blas_thread()
def cracks(ds: xr.Dataset, *, hairline: float = HAIRLINE) -> xr.Dataset:
    """Return the cracks of a wall as objects, followed through the increments.

    A crack is a set of pieces of joints that have opened or slid by more than a hairline, joined where pieces
    meet and across bricks whose zones have yielded. It is as straight as one would draw it, with branches of at most
    two joints: a fan or an arch is several cracks. It keeps its number as it grows; of cracks that meet, the oldest
    keeps its. ``crack_width``, the opening normal to the joint, is what damage tables speak of and what categories are
    found by; the widest of the wall proper is ``crack_width_max``. Categories count cracks by whole joints
    (``crack_count``), which may join two cracks of this list.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall or of a house, as ``damagepred.solve`` returns it; of a house ``crack_wall`` is the wall.
    hairline : float
        Opening or slip (m) from which a piece of joint is part of a crack.

    Returns
    -------
    xarray.Dataset
        Dimensions ``increment`` and ``crack``; see ``CRACK_VARIABLES``. What is not there in an
        increment is NaN, or -1.

    Examples
    --------
    >>> import damagepred, xarray
    >>> wall = xarray.open_dataset("wall.nc")
    >>> found = damagepred.cracks(wall)
    >>> found.sizes["crack"]
    25
    >>> float(found["crack_width"][-1].max()) <= float(wall["crack_width_max"][-1])
    True
    """
    return _of_walls(ds, hairline, WallCracks.dataset)


@checked
@one_blas_thread()
def crack_profile(ds: xr.Dataset, increment: int = -1, *, hairline: float = HAIRLINE) -> xr.Dataset:
    """Return courses and widths of the cracks of one increment, piece by piece.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall or of a house, as ``damagepred.solve`` returns it; of a house ``piece_wall`` is the wall.
    increment : int
        Position of the increment, -1 for the last.
    hairline : float
        See ``cracks``.

    Returns
    -------
    xarray.Dataset
        Dimension ``piece``, crack by crack: pieces of the crack's longest course in its order from the lower or
        left end (``piece_on_path``), then its branches.

    Examples
    --------
    >>> import damagepred, xarray
    >>> profile = damagepred.crack_profile(xarray.open_dataset("wall.nc"))
    >>> profile.sizes["piece"], list(profile.data_vars)[:3]
    (257, ['piece_crack', 'piece_on_path', 'piece_along'])
    """
    return _of_walls(ds, hairline, lambda traced: traced.profile(increment))


def _of_walls(ds: xr.Dataset, hairline: float, result: Callable[[WallCracks], xr.Dataset]) -> xr.Dataset:
    """Result of the cracks of a wall, or of all walls of a house, where cracks are numbered on from wall to wall."""
    if not is_house(ds):
        return result(WallCracks(ds, hairline))
    parts, before = [], 0
    for number, name in enumerate(names := wall_names(ds)):
        traced = WallCracks(wall_dataset(ds, name), hairline)
        part = result(traced)
        dim = "crack" if "crack" in part.dims else "piece"
        own = np.full(part.sizes[dim], number, dtype=np.int8)
        flags = Variable((dim,), None, f"wall of the {dim}", tuple(names)).attributes()
        part = part.assign({f"{dim}_wall": (dim, own, flags)}).drop_vars("central_deflection", errors="ignore")
        key = "crack" if dim == "crack" else "piece_crack"
        part[key] = (dim, part[key].values + before, part[key].attrs)
        if "merged_into" in part:
            part["merged_into"] = part["merged_into"].where(part["merged_into"] == 0, part["merged_into"] + before)
        parts.append(part)
        before += traced.count
    found = xr.concat(parts, dim, data_vars="minimal", coords="minimal", compat="override", combine_attrs="override")
    kept = {key: ds.attrs[key] for key in ("title", "scene") if key in ds.attrs}
    return found.assign_attrs({**parts[0].attrs, **kept})


class WallCracks:
    """Follows the cracks of one wall once, for all that is to be read from them."""

    def __init__(self, ds: xr.Dataset, hairline: float = HAIRLINE) -> None:
        if "contact_opening" not in ds or "increment" not in ds["contact_opening"].dims:
            raise InputError("the dataset has no contact_opening; cracks are read from the result of solve or replay.")
        if not hairline > 0:
            raise InputError(f"hairline = {hairline:g}: must be greater than 0 m.")
        self.ds, self.joints = ds, JointMap.from_dataset(ds)
        self.growth = Growth(self.joints, hairline)
        self.states = [self._step(i) for i in range(ds.sizes["increment"])]

    def _step(self, increment: int) -> list[Numbered]:
        opening, slip, state = (self.ds[f"contact_{name}"].values[increment] for name in ("opening", "slip", "state"))
        cracked, hairline, links = state == ContactState.CRACKED, self.growth.hairline, NO_LINKS
        if "zone_state" in self.ds:
            x, y, zones = (self.ds[name].values for name in ("gridpoint_x", "gridpoint_y", "zone_gridpoint"))
            part = (cracked & (opening > hairline)) | (np.abs(slip) > hairline)
            yielded = self.ds["zone_state"].values[increment] != ZoneState.ELASTIC
            links = links_of(self.growth.pieces, part, x, y, zones, yielded)
        return self.growth.step(increment, opening, slip, cracked, links)

    @cached_property
    def _first(self) -> dict[int, Numbered]:
        """Each crack as it was when it was first there."""
        first: dict[int, Numbered] = {}
        for state in self.states:
            for one in state:
                first.setdefault(one.number, one)
        return dict(sorted(first.items()))

    @property
    def count(self) -> int:
        """Number of cracks up to the end of the path."""
        return len(self._first)

    def dataset(self) -> xr.Dataset:
        """Return all cracks through the increments; see ``cracks``."""
        first, steps = self._first, len(self.states)
        row = {number: i for i, number in enumerate(first)}
        shape = (steps, len(first))
        values: dict[str, Any] = {}
        for name, variable in CRACK_VARIABLES.items():
            if variable.dims == _BOTH:
                values[name] = np.full(shape, -1 if variable.flags else np.nan, np.int8 if variable.flags else float)
        for increment, state in enumerate(self.states):
            for one in state:
                for name, value in self._measures(one).items():
                    values[f"crack_{name}"][increment, row[one.number]] = value
        x, y = self.joints.contact_x.ravel(), self.joints.contact_y.ravel()
        began = [one.first_increment for one in first.values()]
        piece = np.array([one.first_piece for one in first.values()], dtype=np.int64)
        values |= {
            "increment": self.ds["increment"].values,
            "crack": np.array(list(first), dtype=np.int64),
            "crack_part": np.array([one.part for one in first.values()], dtype=np.int8),
            "first_increment": self.ds["increment"].values[began] if began else np.empty(0, dtype=np.int64),
            "first_x": x[piece],
            "first_y": y[piece],
            "merged_into": np.array([self.growth.merged.get(n, 0) for n in first], dtype=np.int64),
        }
        for name in self._movements:
            moved = self.ds[name].values
            values |= {name: moved, f"first_{name}": moved[np.array(began, dtype=np.int64)]}
        return dataset(values, self._attributes(), extra=CRACK_VARIABLES)

    @property
    def _movements(self) -> list[str]:
        """Measures of the movement: of the footing, of the ground, and in a laboratory test of the loads."""
        return ["central_deflection", *(name for name in _DRIVERS if name in self.ds)]

    def _attributes(self) -> dict[str, Any]:
        of_wall = {key: self.ds.attrs[key] for key in ("scene",) if key in self.ds.attrs}
        return {"title": self.ds.attrs.get("title", "wall"), "hairline": self.growth.hairline, **of_wall}

    def _measures(self, one: Numbered) -> dict[str, float]:
        crack = one.crack
        place = crack.pieces[crack.widest]
        return {
            "width": float(crack.opening.max()),
            "width_normal": max(float(crack.width.max()), 0.0),
            "displacement": float(crack.displacement.max()),
            "length": crack.length,
            "length_through_blocks": crack.length_through_blocks,
            "branches": crack.branches,
            "inclination": crack.inclination,
            "orientation": crack.orientation,
            "x": float(self.joints.contact_x.ravel()[place]),
            "y": float(self.joints.contact_y.ravel()[place]),
        }

    def profile(self, increment: int = -1) -> xr.Dataset:
        """Return the pieces of the cracks of one increment; see ``crack_profile``."""
        steps = len(self.states)
        if not -steps <= increment < steps:
            raise InputError(f"increment = {increment}: the wall has {steps} increments; take 0 to {steps - 1}, or -1.")
        rows = [self._pieces_of(one) for one in self.states[increment]]
        names = [name for name, variable in CRACK_VARIABLES.items() if variable.dims == _PIECE]
        columns = {name: np.concatenate([r[name] for r in rows]) if rows else np.empty(0) for name in names}
        for name in ("piece_crack", "piece_on_path"):
            columns[name] = columns[name].astype(np.int64)
        columns["piece_kind"] = columns["piece_kind"].astype(np.int8)
        when = {name: float(self.ds[name].values[increment]) for name in self._movements}
        return dataset(columns, {**self._attributes(), **when}, extra=CRACK_VARIABLES)

    def _pieces_of(self, one: Numbered) -> dict[str, Any]:
        crack, pieces = one.crack, self.growth.pieces
        branch = np.setdiff1d(crack.pieces, crack.path_pieces)
        number = np.concatenate((crack.path_pieces, branch))
        known, on_path = number >= 0, np.arange(len(number)) < len(crack.path_pieces)
        order = np.argsort(crack.pieces)
        mine = order[np.minimum(np.searchsorted(crack.pieces[order], number), len(order) - 1)]

        def along(values: Any) -> Any:
            return np.where(known, values[mine], np.nan)

        place = pieces.place[np.maximum(number, 0)].copy()
        place[on_path, 0], place[on_path, 1] = crack.path[:-1], crack.path[1:]
        contact = np.stack((self.joints.contact_x.ravel(), self.joints.contact_y.ravel()))[:, np.maximum(number, 0)]
        at = np.where(known, contact, place.mean(axis=1).T)
        q = self.joints.contact_x.shape[1]
        return {
            "piece_crack": np.full(len(number), one.number),
            "piece_on_path": np.where(on_path, np.arange(len(number)), -1),
            "piece_along": along(crack.along),
            "piece_kind": np.where(known, self.joints.kind[np.maximum(number, 0) // q], len(ContactKind)),
            "piece_x": at[0],
            "piece_y": at[1],
            "piece_x_start": place[:, 0, 0],
            "piece_y_start": place[:, 0, 1],
            "piece_x_end": place[:, 1, 0],
            "piece_y_end": place[:, 1, 1],
            "piece_opening": along(crack.opening),
            "piece_width": along(crack.width),
            "piece_displacement": along(crack.displacement),
        }


def crack_frame(found: xr.Dataset, increment: int | None = -1) -> pd.DataFrame:
    """Return cracks as a table to read, SI units, one row per crack and increment.

    Parameters
    ----------
    found : xarray.Dataset
        Result of ``cracks``, or a wall (``damagepred.solve``).
    increment : int or None
        Position of the increment, -1 for the last; None: all of them.

    Returns
    -------
    pandas.DataFrame
        Sorted by increment, parts of the wall, and width, the widest first; only cracks that are there.

    Examples
    --------
    >>> import damagepred, xarray
    >>> found = damagepred.cracks(xarray.open_dataset("wall.nc"))
    >>> frame = damagepred.crack_frame(found)
    >>> frame[["crack", "crack_width"]].round(5).head(2).to_numpy().tolist()
    [[2.0, 0.0069], [3.0, 0.0069]]
    """
    found = found if "crack" in found.dims else cracks(found)
    at = found if increment is None else found.isel(increment=[increment])
    frame = at.to_dataframe().reset_index()
    frame = frame[np.isfinite(frame["crack_length"])].copy()
    for name in ("crack_part", "crack_orientation"):
        frame[name] = [CRACK_VARIABLES[name].flags[int(value)] for value in frame[name]]
    walls = ["crack_wall"] if "crack_wall" in frame else []
    for name in walls:
        frame[name] = [flag_name(found, int(value), name).replace(" ", "_") for value in frame[name]]
    frame["crack_branches"] = frame["crack_branches"].astype(np.int64)
    drivers = (name for name in ("central_deflection", *_DRIVERS) if name in frame.columns)
    front = ["increment", *drivers, *walls, "crack"]
    frame = frame[front + [name for name in CRACK_VARIABLES if name in frame.columns and name not in front]]
    order = frame.assign(part=[PARTS.index(p) for p in frame["crack_part"]], width=-frame["crack_width"])
    return frame.loc[order.sort_values(["increment", "part", "width", "crack"]).index].reset_index(drop=True)
