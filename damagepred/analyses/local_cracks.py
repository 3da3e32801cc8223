"""Cracks and levels of single samples, which archives do not hold: replayed once, and kept beside the archive."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np

from damagepred.archive.folder import StudyFolder
from damagepred.arrays import FloatArray, IntArray
from damagepred.campaign.replay import replay
from damagepred.damage.growth import BELOW_DPC, DPC_OPENING, DPC_SLIP, WALL
from damagepred.damage.tracing import ORIENTATIONS
from damagepred.results.wall_cracks import WallCracks
from damagepred.uq.observations import CrackObservation

PARTS = {"wall": (WALL,), "below_dpc": (BELOW_DPC,), "dpc": (DPC_OPENING, DPC_SLIP)}


class Replayed(NamedTuple):
    """Cracks and displacements of one sample on its whole path.

    Attributes
    ----------
    increments : array ()
        Increments that were solved, with that of the dead load.
    step, part, direction : array (pieces,)
        Increment, part of the wall and index into ``ORIENTATIONS`` of the crack of each open piece of joint.
    x, y, width : array (pieces,)
        Place and opening (m).
    block_x, block_y : array (blocks,)
        Centroids (m).
    rise : array (increments, blocks)
        Displacement of the blocks upwards (m).
    """

    increments: IntArray
    step: IntArray
    part: IntArray
    direction: IntArray
    x: FloatArray
    y: FloatArray
    width: FloatArray
    block_x: FloatArray
    block_y: FloatArray
    rise: FloatArray

    def widest(self, seen: CrackObservation, count: int) -> tuple[FloatArray, FloatArray]:
        """Widest crack near a place, of any and of the observed direction, arrays (count,); NaN beyond the path."""
        near = np.isin(self.part, PARTS[seen.part])
        if seen.x is not None and seen.y is not None:
            near &= np.hypot(self.x - seen.x, self.y - seen.y) <= seen.within
        along = near if seen.direction is None else near & (self.direction == ORIENTATIONS.index(seen.direction))
        found = []
        for chosen in (near, along):
            width = np.full(count, np.nan)
            width[: int(self.increments)] = 0.0
            np.maximum.at(width, self.step[chosen], self.width[chosen])
            found.append(width)
        return found[0], found[1]

    def level(self, at: tuple[float, float], to: tuple[float, float], count: int) -> FloatArray:
        """Height of one point above another, array (count,), both on the nearest block; NaN beyond the path."""
        first, second = (np.hypot(self.block_x - x, self.block_y - y).argmin() for x, y in (at, to))
        rise = np.full(count, np.nan)
        rise[: int(self.increments)] = self.rise[:, second] - self.rise[:, first]
        return rise


@dataclass(frozen=True)
class ReplayStore:
    """Replayed samples of a study, in ``NAME.dp.replays`` beside it: one file each, bound to the study by its hash.

    Attributes
    ----------
    folder : Path
        Study folder.
    """

    folder: Path

    def _file(self, sample: int) -> Path:
        return self.folder.with_name(f"{self.folder.name}.replays") / f"{sample:06d}.npz"

    def count(self) -> int:
        """Return how many samples have been replayed."""
        return len(list(self._file(0).parent.glob("*.npz")))

    def read(self, sample: int) -> Replayed:
        """Return a sample, replayed now if it has not been before or the study is another one."""
        file = self._file(sample)
        if file.exists():
            with np.load(file) as kept:
                if str(kept["study"]) == StudyFolder(self.folder).study_hash:
                    return Replayed(*(kept[name] for name in Replayed._fields))
        found = _replayed(self.folder, sample)
        file.parent.mkdir(exist_ok=True)
        temporary = file.with_suffix(f".{os.getpid()}.tmp")
        with temporary.open("wb") as stream:
            np.savez_compressed(stream, study=StudyFolder(self.folder).study_hash, **found._asdict())
        temporary.replace(file)
        return found

    def fill(self, samples: Sequence[int], workers: int, on_replay: Callable[[int, int], None] | None) -> None:
        """Replay missing samples; an interrupted call keeps its replays."""
        missing = [sample for sample in samples if not self._file(sample).exists()]
        if workers > 1 and len(missing) > workers:
            with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
                for number, _ in enumerate(pool.map(self._store, missing), 1):
                    if on_replay is not None:
                        on_replay(number, len(missing))
            return
        for number, sample in enumerate(missing, 1):
            self._store(sample)
            if on_replay is not None:
                on_replay(number, len(missing))

    def _store(self, sample: int) -> None:
        self.read(sample)


def _replayed(folder: Path, sample: int) -> Replayed:
    ds, _ = replay(folder, sample)
    cracks = WallCracks(ds)
    joints = cracks.joints
    place = joints.contact_x.ravel(), joints.contact_y.ravel()
    rows = [(step, one) for step, state in enumerate(cracks.states) for one in state]
    pieces = [one.crack.pieces for _, one in rows]
    size = [len(p) for p in pieces]
    at = np.concatenate(pieces) if pieces else np.empty(0, dtype=np.int64)

    def each(values: list[int]) -> IntArray:
        return np.repeat(np.array(values, dtype=np.int64), np.array(size, dtype=np.int64))

    return Replayed(
        np.array(len(cracks.states)),
        each([step for step, _ in rows]),
        each([one.part for _, one in rows]),
        each([one.crack.orientation for _, one in rows]),
        place[0][at],
        place[1][at],
        np.concatenate([one.crack.opening for _, one in rows]) if rows else np.empty(0),
        ds["block_x"].values,
        ds["block_y"].values,
        ds["block_displacement_y"].values,
    )
