"""Cracks and levels of single samples, which archives lack: replayed once, and stored beside the archive."""

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
    rows = [(step, numbered) for step, state in enumerate(cracks.states) for numbered in state]
    pieces = [numbered.crack.pieces for _, numbered in rows]
    size = [len(p) for p in pieces]
    contact = np.concatenate(pieces) if pieces else np.empty(0, dtype=np.int64)

    def each(values: list[int]) -> IntArray:
        return np.repeat(np.array(values, dtype=np.int64), np.array(size, dtype=np.int64))

    return Replayed(
        np.array(len(cracks.states)),
        each([step for step, _ in rows]),
        each([numbered.part for _, numbered in rows]),
        each([numbered.crack.orientation for _, numbered in rows]),
        joints.contact_x.ravel()[contact],
        joints.contact_y.ravel()[contact],
        np.concatenate([numbered.crack.opening for _, numbered in rows]) if rows else np.empty(0),
        ds["block_x"].values,
        ds["block_y"].values,
        ds["block_displacement_y"].values,
    )
