"""Stored walls of a study as states of a back-analysis, with predictions of the observations."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from damagepred.archive.folder import StudyFolder, open_study
from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import wall_model
from damagepred.assembly.house import SPACING, unfolded_starts
from damagepred.campaign.replay import replay
from damagepred.campaign.settings import StudySettings, read_frozen
from damagepred.campaign.workers import LocalPool
from damagepred.damage import sticking_limits
from damagepred.damage.tracing import BELOW_DPC, DPC_OPENING, DPC_SLIP, ORIENTATIONS, WALL
from damagepred.enumerations import SOLVED
from damagepred.errors import InputError, nearest
from damagepred.one_wall.judged_path import joint_map
from damagepred.results.house import wall_dataset
from damagepred.results.wall_cracks import WallCracks
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene import House, Scene
from damagepred.scene.scene import archived_scene
from damagepred.uq.history import Histories, years_from
from damagepred.uq.intensity import (
    attributes,
    chosen_intensity,
    in_unit,
    intensity_values,
    movement_words,
    shown_measure,
)
from damagepred.uq.movement_distribution import MovementDistribution
from damagepred.uq.observations import (
    ROUNDING,
    TABLES,
    CrackObservation,
    LevelObservation,
    Observations,
    WindowObservation,
)
from damagepred.uq.survey_likelihood import CrackPrediction, Fit, series_fit

PARTS = {"wall": (WALL,), "below_dpc": (BELOW_DPC,), "dpc": (DPC_OPENING, DPC_SLIP)}


def require_on(seen: Observations, scene: Scene, source: str) -> None:
    """Check that a wall or house has the walls, places, parts and openings that the survey names."""
    house = isinstance(scene, House)
    walls: dict[str | None, Scene] = dict(zip(scene.names if isinstance(scene, House) else [None], scene.scenes))
    names = [name for name in walls if name is not None]
    has = f"the house of {source} has the walls {', '.join(names)}" if house else f"{source} has one wall, no name"
    for where, reading in (*seen.cracks, *seen.named(TABLES[1:])):
        if house and reading.wall is None and (is_local(reading) or isinstance(reading, WindowObservation)):
            raise InputError(f"{where}: wall: is missing; {has}.")
        for key in ("wall", "to_wall"):
            if (name := getattr(reading, key, None)) is not None and name not in walls:
                raise InputError(f"{where}: {key} = '{name}': {has}." + nearest(name, names))
    for of_wall, one in walls.items():
        _require_on_wall(seen, of_wall, one, source)


def _require_on_wall(seen: Observations, name: str | None, scene: Scene, source: str) -> None:
    wall, which = scene.wall, "wall" if name is None else f"wall '{name}'"
    size = f"the {which} of {source}, {wall.length:g} m long and {wall.height:g} m high"
    under = -scene.footing.depth if scene.footing_model != "none" else 0.0
    cracks = [(where, crack) for where, crack in seen.cracks if crack.wall == name]
    places = [(where, "x", "y", *c.place, 0.0) for where, c in cracks if c.place is not None]
    for k, level in enumerate(seen.level, 1):
        for keys, (of_wall, x, y) in zip((("x", "y"), ("to_x", "to_y")), level.ends):
            places += [(f"level {k}", *keys, x, y, under)] if of_wall == name else []
    for where, x_key, y_key, x, y, lowest in places:
        for key, value, low, high in ((x_key, x, 0.0, wall.length), (y_key, y, lowest, wall.height)):
            if not low - ROUNDING <= value <= high + ROUNDING:
                raise InputError(
                    f"{where}: {key} = {value:g} m lies off {size}; {key} runs from {low:g} to {high:g} m, from "
                    f"its {'left end' if key == x_key else 'underside'}."
                )
        for number, hole in enumerate(scene.opening, 1):
            if hole.x + ROUNDING < x < hole.right - ROUNDING and hole.y + ROUNDING < y < hole.top - ROUNDING:
                raise InputError(
                    f"{where}: {x_key} = {x:g} m, {y_key} = {y:g} m lies in opening {number} of {size} "
                    f"({hole.kind}, x {hole.x:g} to {hole.right:g} m, y {hole.y:g} to {hole.top:g} m); give a "
                    "place on the masonry."
                )
    for where, crack in seen.cracks if scene.dpc is None else ():
        if crack.part != "wall":
            raise InputError(f"{where}: part = '{crack.part}': {size}, has no dpc.")
    for k, window in ((k, window) for k, window in enumerate(seen.window, 1) if window.wall == name):
        if window.opening > (count := len(scene.opening)):
            has = f"openings 1 to {count}" if count else "no opening"
            raise InputError(f"window {k}: opening = {window.opening}: {size}, has {has}.")


class Replayed(NamedTuple):
    """Cracks and displacements of one sample on its whole path."""

    increments: IntArray  # (): number of solved increments, with the dead load
    # (pieces,): of each open piece of joint: increment, part of the wall, index of its crack into
    # ``ORIENTATIONS``
    step: IntArray
    part: IntArray
    direction: IntArray
    x: FloatArray  # (pieces,): position and opening (m)
    y: FloatArray
    width: FloatArray
    block_x: FloatArray  # (blocks,): centroids (m)
    block_y: FloatArray
    rise: FloatArray  # (increments, blocks): displacement of the blocks upwards (m)

    def widest(self, seen: CrackObservation, count: int) -> tuple[FloatArray, FloatArray]:
        """Widest crack near a position, of any and of the observed direction (count,); NaN beyond the path."""
        near = np.isin(self.part, PARTS[seen.part])
        if seen.x is not None and seen.y is not None:
            near &= np.hypot(self.x - seen.x, self.y - seen.y) <= seen.within
        along = near if seen.direction is None else near & (self.direction == ORIENTATIONS.index(seen.direction))
        widest = []
        for chosen in (near, along):
            width = np.full(count, np.nan)
            width[: int(self.increments)] = 0.0
            np.maximum.at(width, self.step[chosen], self.width[chosen])
            widest.append(width)
        return widest[0], widest[1]

    def level(self, start: tuple[float, float], end: tuple[float, float], count: int) -> FloatArray:
        """Height of one point above another (count,), both on the nearest block; NaN beyond the path."""
        first, second = (np.hypot(self.block_x - x, self.block_y - y).argmin() for x, y in (start, end))
        rise = np.full(count, np.nan)
        rise[: int(self.increments)] = self.rise[:, second] - self.rise[:, first]
        return rise


@dataclass(frozen=True)
class ReplayStore:
    """Replayed samples of a study folder, in ``NAME.dp.replays`` beside it: one file each, with the study's hash."""

    folder: Path

    def _file(self, sample: int) -> Path:
        return self.folder.with_name(f"{self.folder.name}.replays") / f"{sample:06d}.npz"

    def count(self) -> int:
        """Number of replayed samples."""
        return len(list(self._file(0).parent.glob("*.npz")))

    def read(self, sample: int) -> Replayed:
        """A replayed sample; it is replayed now if its file is missing or of another study."""
        file = self._file(sample)
        if file.exists():
            with np.load(file) as kept:
                if str(kept["study"]) == StudyFolder(self.folder).study_hash:
                    return Replayed(*(kept[name] for name in Replayed._fields))
        replayed = _replayed(self.folder, sample)
        file.parent.mkdir(exist_ok=True)
        temporary = file.with_suffix(f".{os.getpid()}.tmp")
        with temporary.open("wb") as stream:
            np.savez_compressed(stream, study=StudyFolder(self.folder).study_hash, **replayed._asdict())
        temporary.replace(file)
        return replayed

    def fill(self, samples: Sequence[int], workers: int, on_replay: Callable[[int, int], None] | None) -> None:
        """Replay missing samples; an interrupted call keeps its replays."""
        missing = [sample for sample in samples if not self._file(sample).exists()]
        with ExitStack() as stack:
            stored: Iterable[None] = map(self._store, missing)
            if workers > 1 and len(missing) > workers:
                stored = stack.enter_context(LocalPool(workers, None)).map(self._store, missing)
            for number, _ in enumerate(stored, 1):
                if on_replay is not None:
                    on_replay(number, len(missing))

    def _store(self, sample: int) -> None:
        self.read(sample)


def _replayed(folder: Path, sample: int) -> Replayed:
    ds, _ = replay(folder, sample)
    scene = archived_scene(ds.attrs)
    if not isinstance(scene, House):
        return _replayed_wall(ds)
    walls = [_replayed_wall(wall_dataset(ds, name)) for name in scene.names]
    starts = zip(walls, unfolded_starts(scene))
    moved = [wall._replace(x=wall.x + left, block_x=wall.block_x + left) for wall, left in starts]
    columns = [np.concatenate(column, axis=-1) for column in list(zip(*moved))[1:]]
    return Replayed(walls[0].increments, *columns)


def _replayed_wall(ds: xr.Dataset) -> Replayed:
    cracks = WallCracks(ds)
    joints = cracks.joints
    rows = [(step, one.part, one.crack) for step, state in enumerate(cracks.states) for one in state]
    contact = np.concatenate([np.empty(0, dtype=np.int64), *(crack.pieces for _, _, crack in rows)])
    width = np.concatenate([np.empty(0), *(crack.opening for _, _, crack in rows)])
    of_crack = np.array([(step, part, crack.orientation) for step, part, crack in rows], dtype=np.int64).reshape(-1, 3)
    steps, parts, directions = np.repeat(of_crack, [len(crack.pieces) for _, _, crack in rows], axis=0).T
    x, y = (position.ravel()[contact] for position in (joints.contact_x, joints.contact_y))
    block_x, block_y, rise = (ds[name].values for name in ("block_x", "block_y", "block_displacement_y"))
    return Replayed(np.array(len(cracks.states)), steps, parts, directions, x, y, width, block_x, block_y, rise)


_WIDEST = {"wall": "crack_width_max", "below_dpc": "base_crack_width_max", "dpc": "dpc_opening_max"}


@dataclass
class StoredWalls:
    """States of one study, with further folders of importance samples and the prior weight of each folder."""

    path: Path
    more: tuple[Path, ...] = ()
    shares: tuple[float, ...] = (1.0,)
    walls: dict[str | None, int] = field(default_factory=dict)  # number of each wall
    left: dict[str | None, float] = field(default_factory=dict)  # start of each wall in the unfolded elevation (m)
    _local: dict[tuple[Any, ...], tuple[FloatArray, ...]] = field(default_factory=dict)

    @one_blas_thread()
    def __post_init__(self) -> None:
        """Open the study."""
        opened = [open_study(folder) for folder in (self.path, *self.more)]
        self.ds = _joined(opened) if self.more else opened[0]
        self.stores = [ReplayStore(Path(folder)) for folder in (self.path, *self.more)]
        self.first = np.cumsum([0, *(ds.sizes["sample"] for ds in opened)])
        self.measure = chosen_intensity(self.ds, None)
        if "strain" in self.ds.variables and not intensity_values(self.ds, self.measure).any():
            self.measure = "strain"  # only the bricks move
        if "increment" not in self.ds[self.measure].dims if self.measure in self.ds else True:
            raise InputError(
                f"{self.path}: infer needs the increments of each sample; run the study with [study] movement = 'path'."
            )
        self.name = study_name(self.path)
        self.units = attributes(self.ds, self.measure)["units"]
        self.shown = shown_measure(movement_words(self.ds, self.measure), self.units)
        self.movement = intensity_values(self.ds, self.measure)
        if (np.diff(self.movement, axis=1) < 0).any():
            raise InputError(f"{self.path}: infer needs an increasing movement; its {self.measure} also decreases.")
        self.known = np.isin(self.ds["status"].values, SOLVED)
        weight = self.ds["weight"].values if "weight" in self.ds else np.ones(len(self.known))
        weight = np.where(self.known, weight, 0.0)
        for share, start, end in zip(self.shares, self.first, self.first[1:]):
            weight[start:end] *= share / max(weight[start:end].sum(), 1e-300)
        self.weight = weight
        middle = 0.5 * (self.movement[:, 1:] + self.movement[:, :-1])
        self.edges = np.concatenate((self.movement[:, :1], middle, self.movement[:, -1:]), axis=1)
        if not np.isfinite(self.edges[self.known]).all():
            # after the end of a path (unloaded rig, failure) increments are not part of the prior
            last = np.where(np.isfinite(self.movement), self.movement, -np.inf).max(axis=1, keepdims=True)
            self.edges = np.where(np.isfinite(self.edges), self.edges, last)

    @cached_property
    def settings(self) -> StudySettings:
        """Frozen settings of the study."""
        return read_frozen(StudyFolder(self.path).study_text())

    @property
    def largest(self) -> float:
        """Largest movement of the study."""
        return float(np.nanmax(self.edges[self.known]))

    def require(self, seen: Observations) -> None:
        """Check that the survey fits these walls: positions, parts, openings, and joints near the cracks."""
        scene = self.settings.scene
        require_on(seen, scene, self.path.name)
        self.walls, self.left = {None: 0}, {None: 0.0}
        if isinstance(scene, House):
            self.walls = {name: number for number, name in enumerate(scene.names)}
            self.left |= dict(zip(scene.names, unfolded_starts(scene).tolist()))
        for name, wall in zip(self.walls, scene.scenes):
            self._require_near_joints(seen, name, wall)

    def _require_near_joints(self, seen: Observations, name: str | None, scene: Scene) -> None:
        """Check that joints of one wall are near its cracks, and that points of levels are on two blocks."""
        local = [(where, c, c.place) for where, c in seen.cracks if c.place is not None and c.wall == name]
        if far := [(where, crack) for where, crack, _ in local if name is not None and crack.within > SPACING]:
            where, crack = far[0]
            raise InputError(f"{where}: within = {crack.within:g} m: at most {SPACING:g} m on a wall of a house.")
        if self.settings.shape_varies or not (local or seen.level):
            return
        model = wall_model(replace(scene, solver=replace(scene.solver, blocks="rigid")))
        joints, blocks = joint_map(model), model.blocks
        joints_of_part = {"wall": joints.is_wall, "below_dpc": joints.is_base, "dpc": joints.is_dpc}
        for where, crack, (x, y) in local:
            distance = np.hypot(joints.contact_x - x, joints.contact_y - y)[joints_of_part[crack.part]]
            if (nearest := distance.min(initial=np.inf)) > crack.within:
                raise InputError(
                    f"{where}: no joint of its part ({crack.part}) lies within {crack.within * 1e3:g} mm of x = "
                    f"{x:g} m, y = {y:g} m; the nearest is {nearest * 1e3:.3g} mm away. Cracks run in "
                    "joints: give a larger `within`, or the position of a joint."
                )
        for k, level in enumerate(seen.level, 1):
            ends = [place for of_wall, *place in level.ends if of_wall == name]
            if len(ends) == 2 and len({int(np.hypot(blocks.x - x, blocks.y - y).argmin()) for x, y in ends}) < 2:
                raise InputError(
                    f"level {k}: both points are on one block, which stays level; give points farther apart."
                )

    def log_prior(self, movement: MovementDistribution | None) -> FloatArray:
        """Logarithm of the prior probability of each state, array (samples, increments)."""
        if movement is None:
            share = np.diff(self.edges, axis=1) / np.maximum(np.ptp(self.edges, axis=1), 1e-300)[:, None]
        else:
            movement.require_measure(self.ds, self.measure)
            points = np.asarray(movement.points)
            if beyond := float(np.mean(points > self.largest)):
                raise InputError(
                    f"movement = {movement.name}: {beyond:.0%} of it lies beyond {in_unit(self.largest, self.units)}, "
                    f"the largest movement of {self.path}; run the study with a larger movement."
                )
            share = np.array([np.histogram(points, np.maximum.accumulate(row))[0] for row in self.edges]) / len(points)
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(share) + np.log(self.weight)[:, None])

    def fit(
        self,
        seen: Observations,
        past: Histories,
        model: Any,
        rows: IntArray,
        replayed: bool,
        quantities: Sequence[tuple[str, list[Any]]] | None = None,
    ) -> Fit:
        """Fit of all or some quantities, local ones if replayed, on (rows, increments, histories or terms of model)."""
        days = seen.dates
        nothing = np.zeros((len(rows), self.movement.shape[1], 1))
        total = Fit(nothing, nothing)
        reached, _, part = past.at(years_from(days[-1], days)) if days else np.ones((3, 1, 1))
        visit = {day: (reached[:, k], part[:, k]) for k, day in enumerate(days)}
        for table, series in seen.series if quantities is None else quantities:
            if is_local(series[0]) and not replayed:
                continue
            each, along = self._predicted(table, series, rows)
            directed = any(getattr(reading, "direction", None) for reading in series)
            at: dict[Any, CrackPrediction] = {}
            for day in {day for reading in series for day in (reading.date, reading.since)}:
                found = self._followed(each, rows, visit.get(day))
                at[day] = CrackPrediction(found, self._followed(along, rows, visit.get(day)) if directed else found)
            predicted = [at[r.date] if r.since is None else replace(at[r.date], before=at[r.since]) for r in series]
            total += series_fit(series, predicted, model)
        return total

    def _followed(self, values: FloatArray, rows: IntArray, visit: tuple[FloatArray, FloatArray] | None) -> FloatArray:
        """Values (rows, increments, histories) at a visit, of walls that end it at each increment's movement."""
        if visit is None or (visit[0] == 1.0).all():
            return values[..., None] * (1.0 if visit is None else visit[1])
        reached, part = visit
        followed = np.full((*values.shape, len(reached)), np.nan)
        for row, (movement, value) in enumerate(zip(self.movement[rows], values)):
            known = np.isfinite(movement) & np.isfinite(value)
            if known.any():
                then = np.interp(movement[:, None] * reached, movement[known], value[known])
                followed[row] = np.where(reached == 1.0, value[:, None], then)
        return followed * part

    def _predicted(self, table: str, series: Sequence[Any], rows: IntArray) -> list[FloatArray]:
        """Values of a quantity (rows, increments): of cracks of any direction, and of the observed one."""
        first = next((reading for reading in series if getattr(reading, "direction", None)), series[0])
        if is_local(first):
            key = (table, first.quantity, getattr(first, "direction", None))
            return [np.array(values) for values in zip(*(self._local_values(key, first, int(row)) for row in rows))]
        if table == "crack":
            value = self._values(_WIDEST[first.part], "cracks of this part", wall=first.wall)
        elif table != "window":
            value = self._values(f"{table}_max", "slopes", wall=first.wall)
        elif first.width_change is not None:
            value = self._values("opening_width_change", "openings", 3)[..., self._opening(first)]
        else:
            value = self._values("opening_distortion", "openings", 3)[..., self._opening(first)]
            value = value / sticking_limits().angle[0]
        return [value[rows]] * 2

    def _local_values(self, key: tuple[Any, ...], seen: Any, sample: int) -> tuple[FloatArray, ...]:
        """Values along the path of a replayed sample, read once."""
        if (*key, sample) not in self._local:
            replayed, count = self.replayed(sample), self.movement.shape[1]
            if isinstance(seen, LevelObservation):
                start, end = ((self.left[wall] + x, y) for wall, x, y in seen.ends)
                read = (replayed.level(start, end, count),) * 2
            else:
                read = replayed.widest(replace(seen, x=self.left[seen.wall] + seen.x), count)
            self._local[(*key, sample)] = read
        return self._local[(*key, sample)]

    def _opening(self, seen: WindowObservation) -> int:
        """Number of an opening in the list of all walls."""
        if seen.wall is None:
            return seen.opening - 1
        walls = self.ds["opening_wall"].values.max(axis=0)
        return int(np.flatnonzero(walls == self.walls[seen.wall])[seen.opening - 1])

    def _values(self, name: str, what: str, dimensions: int = 2, wall: str | None = None) -> FloatArray:
        if wall is not None:
            name, dimensions = f"wall_{name}", 3
        values = np.asarray(self.ds[name].values if name in self.ds else np.nan, dtype=np.float64)
        number = () if wall is None else (..., self.walls[wall])
        if values.ndim != dimensions or np.isnan(values[number]).all():
            raise InputError(f"{self.path}: the archive has no {name}; {what} cannot be observed on its walls.")
        return values[number]

    def crack_map(
        self,
        weight: FloatArray,
        cell: float,
        wider: float,
        shape: tuple[int, int],
        negligible: float,
        places: FloatArray,
    ) -> FloatArray:
        """Probability that a crack wider than a limit (m) runs through each cell, array (y, x); ``places`` of walls."""
        probability = np.zeros(shape[0] * shape[1])
        share, starts = weight.sum(axis=1), np.array([*self.left.values()][1:] or [0.0])
        for sample in np.flatnonzero(share > negligible * share.sum()):
            replayed = self.replayed(int(sample))
            open_ = replayed.width > wider
            x, y = replayed.x[open_], replayed.y[open_]
            wall = np.searchsorted(starts - 0.5 * SPACING, x, side="right") - 1
            row = np.minimum(((y + places[wall, 1]) / cell).astype(np.int64), shape[0] - 1)
            column = np.minimum(((x - starts[wall] + places[wall, 0]) / cell).astype(np.int64), shape[1] - 1)
            states = np.unique(np.stack((row * shape[1] + column, replayed.step[open_])), axis=1)
            np.add.at(probability, states[0], weight[sample, states[1]])
        return probability.reshape(shape)

    def replayed(self, sample: int) -> Replayed:
        """A replayed sample."""
        folder = int(np.searchsorted(self.first, sample, side="right")) - 1
        return self.stores[folder].read(sample - int(self.first[folder]))

    def replay(self, samples: IntArray, workers: int, on_replay: Callable[[int, int], None] | None) -> None:
        """Replay samples; see ``ReplayStore.fill``."""
        for store, start, end in zip(self.stores, self.first, self.first[1:]):
            store.fill((samples[(samples >= start) & (samples < end)] - start).tolist(), workers, on_replay)


def is_local(reading: Any) -> bool:
    """Whether a reading is of a level or of a crack with a place, which archives lack."""
    return isinstance(reading, LevelObservation) or getattr(reading, "x", None) is not None


def study_name(path: str | Path) -> str:
    """Name of a study as a cause: its folder without the suffix."""
    return Path(path).name.removesuffix(".dp")


def _joined(studies: Sequence[xr.Dataset]) -> xr.Dataset:
    """Samples of studies of the same walls as one dataset, with weights."""
    weighted = [
        ds if "weight" in ds else ds.assign(weight=("sample", np.ones(ds.sizes["sample"])))
        for ds in (study.drop_vars("movement", errors="ignore") for study in studies)
    ]
    by_sample = [name for name, values in weighted[0].data_vars.items() if values.dims[:1] == ("sample",)]
    names = [name for name in by_sample if all(name in ds for ds in weighted)]
    joined = xr.concat(
        [ds[names] for ds in weighted], "sample", combine_attrs="override", coords="minimal", compat="override"
    )
    return joined.assign_attrs(studies[0].attrs)
