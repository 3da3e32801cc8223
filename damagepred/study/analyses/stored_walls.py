"""Stored walls of a study as states of a back-analysis, with what is predicted of them at places that were observed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from damagepred.archive.folder import open_study
from damagepred.arrays import FloatArray, IntArray
from damagepred.damage import sticking_limits
from damagepred.enumerations import SOLVED
from damagepred.errors import InputError
from damagepred.one_thread import one_blas_thread
from damagepred.study.analyses.local_cracks import Replayed, ReplayStore
from damagepred.uq.intensity import attributes, chosen_intensity, intensity_values
from damagepred.uq.movement_distribution import MovementDistribution
from damagepred.uq.observations import CrackPrediction, Discrepancy, Fit, Observations, censored, crack_fit, measured

_WIDEST = {"wall": "crack_width_max", "below_dpc": "base_crack_width_max", "dpc": "dpc_opening_max"}


@dataclass
class StoredWalls:
    """States of one study, with what is predicted of them at places that were observed.

    Attributes
    ----------
    path : Path
        Study folder.
    more : tuple of Path
        Folders of more samples of the same study, drawn by importance sampling.
    shares : tuple of float
        Share of the prior weight that each folder has.
    """

    path: Path
    more: tuple[Path, ...] = ()
    shares: tuple[float, ...] = (1.0,)
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
            self.measure = "strain"  # nothing moves but the bricks
        if "increment" not in self.ds[self.measure].dims if self.measure in self.ds else True:
            raise InputError(
                f"{self.path}: infer needs the increments of each wall; run the study with [study] movement = 'path'."
            )
        self.name = study_name(self.path)
        self.units = attributes(self.ds, self.measure)["units"]
        self.movement = intensity_values(self.ds, self.measure)
        if (np.diff(self.movement, axis=1) < 0).any():
            raise InputError(
                f"{self.path}: infer needs a movement that only grows; the {self.measure} there falls, too."
            )
        self.known = np.isin(self.ds["status"].values, SOLVED)
        weight = self.ds["weight"].values if "weight" in self.ds else np.ones(len(self.known))
        weight = np.where(self.known, weight, 0.0)
        for share, start, end in zip(self.shares, self.first, self.first[1:]):
            weight[start:end] *= share / max(weight[start:end].sum(), 1e-300)
        self.weight = weight
        middle = 0.5 * (self.movement[:, 1:] + self.movement[:, :-1])
        self.edges = np.concatenate((self.movement[:, :1], middle, self.movement[:, -1:]), axis=1)
        if not np.isfinite(self.edges[self.known]).all():
            # a rig that let go, or a failed path: the increments beyond are not part of the prior
            last = np.where(np.isfinite(self.movement), self.movement, -np.inf).max(axis=1, keepdims=True)
            self.edges = np.where(np.isfinite(self.edges), self.edges, last)

    @property
    def largest(self) -> float:
        """The largest movement of the study."""
        return float(np.nanmax(self.edges[self.known]))

    def log_prior(self, movement: MovementDistribution | None) -> FloatArray:
        """Return the logarithm of the prior probability of each state, array (samples, increments)."""
        if movement is None:
            share = np.diff(self.edges, axis=1) / np.maximum(np.ptp(self.edges, axis=1), 1e-300)[:, None]
        else:
            movement.require_measure(self.measure)
            points = np.asarray(movement.points)
            if beyond := float(np.mean(points > self.largest)):
                raise InputError(
                    f"movement = {movement.name}: {beyond:.0%} of it lies beyond {self.largest:g}, the largest "
                    f"movement of {self.path}; run the study with a larger movement."
                )
            share = np.array([np.histogram(points, np.maximum.accumulate(row))[0] for row in self.edges]) / len(points)
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(share) + np.log(self.weight)[:, None])

    def fit_of_archive(self, seen: Observations, model: Discrepancy) -> Fit:
        """Return the fit of what the archive itself tells.

        Parameters
        ----------
        seen, model
            What was observed, and the discrepancy of the model.
        """
        shape = self.movement.shape
        total = Fit(np.zeros(shape), np.zeros(shape))
        for crack in (c for c in seen.crack if c.x is None):
            width = self._values(_WIDEST[crack.part], "cracks of this part")
            total = total + crack_fit(crack, CrackPrediction(width, width), model)
        for name, found in (("slope_max", seen.slope), ("tilt_max", seen.tilt)):
            for one in found:
                total = total + measured(
                    self._values(name, "slopes"), one.value, np.full(shape, np.hypot(one.error, model.slope))
                )
        for window in seen.window:
            count = self.ds.sizes.get("opening", 0)
            if window.opening > count or "opening_distortion" not in self.ds:
                raise InputError(f"window.opening = {window.opening}: the walls of {self.path} have {count} openings.")
            if window.width_change is not None:
                value = self.ds["opening_width_change"].values[..., window.opening - 1]
                deviation = np.hypot(window.error, model.distortion_share * value)
                total = total + measured(value, window.width_change, deviation)
                continue
            limit = sticking_limits().angle[0]
            value = self.ds["opening_distortion"].values[..., window.opening - 1]
            deviation = np.maximum(model.distortion_share * value, model.distortion_share * limit)
            bounds = (limit, np.inf) if window.sticks else (-np.inf, limit)
            total = total + censored(value, *bounds, deviation)
        return total

    def _values(self, name: str, what: str) -> FloatArray:
        if name not in self.ds or self.ds[name].ndim != 2:
            raise InputError(f"{self.path}: the archive does not hold {name}; {what} cannot be observed on its walls.")
        return np.asarray(self.ds[name].values, dtype=np.float64)

    def crack_map(
        self, weight: FloatArray, cell: float, wider: float, shape: tuple[int, int], negligible: float
    ) -> FloatArray:
        """Return the probability that a crack wider than a limit runs through each cell, array (y, x).

        Parameters
        ----------
        weight : array (samples, increments)
            Posterior weights of the states.
        cell, wider : float
            Side of the cells and limit (m).
        shape : (int, int)
            Number of cells upwards and along the wall.
        negligible : float
            Share of the posterior up to which a sample is left out.
        """
        found = np.zeros(shape[0] * shape[1])
        share = weight.sum(axis=1)
        for sample in np.flatnonzero(share > negligible * share.sum()):
            one = self.replayed(int(sample))
            open_ = one.width > wider
            row = np.minimum((one.y[open_] / cell).astype(np.int64), shape[0] - 1)
            column = np.minimum((one.x[open_] / cell).astype(np.int64), shape[1] - 1)
            states = np.unique(np.stack((row * shape[1] + column, one.step[open_])), axis=1)
            np.add.at(found, states[0], weight[sample, states[1]])
        return found.reshape(shape)

    def fit_of_replays(self, seen: Observations, model: Discrepancy, samples: IntArray) -> Fit:
        """Return the fit of local cracks and levels, (chosen samples, increments).

        Parameters
        ----------
        seen, model
            See ``fit_of_archive``.
        samples : array of int
            Samples that have been replayed.
        """
        shape = (len(samples), self.movement.shape[1])
        total = Fit(np.zeros(shape), np.zeros(shape))
        for crack in (c for c in seen.crack if c.x is not None):
            key = (crack.x, crack.y, crack.within, crack.part, crack.direction)
            found = self._predicted(key, samples, lambda one, c=crack: one.widest(c, shape[1]))
            total = total + crack_fit(crack, CrackPrediction(*found), model)
        for level in seen.level:
            ends = (level.x, level.y), (level.to_x, level.to_y)
            (rise,) = self._predicted(ends, samples, lambda one, e=ends: (one.level(*e, shape[1]),))
            deviation = np.full(shape, np.hypot(level.error, model.level))
            total = total + measured(rise, level.difference, deviation)
        return total

    def _predicted(
        self, key: tuple[Any, ...], samples: IntArray, read: Callable[..., tuple[FloatArray, ...]]
    ) -> tuple[FloatArray, ...]:
        key = (*key, samples.tobytes())
        if key not in self._local:
            rows = [read(self.replayed(int(sample))) for sample in samples]
            self._local[key] = tuple(np.array(column) for column in zip(*rows))
        return self._local[key]

    def replayed(self, sample: int) -> Replayed:
        """Return a replayed sample."""
        part = int(np.searchsorted(self.first, sample, side="right")) - 1
        return self.stores[part].read(sample - int(self.first[part]))

    def replay(self, samples: IntArray, workers: int, on_replay: Callable[[int, int], None] | None) -> None:
        """Replay samples; see ``ReplayStore.fill``.

        Parameters
        ----------
        samples, workers, on_replay
            Numbers of the samples, processes, and the call that reports progress.
        """
        for store, start, end in zip(self.stores, self.first, self.first[1:]):
            store.fill((samples[(samples >= start) & (samples < end)] - start).tolist(), workers, on_replay)


def study_name(path: str | Path) -> str:
    """Return the name that a study has as a cause: that of its folder, without the suffix."""
    return Path(path).name.removesuffix(".dp")


def _joined(studies: Sequence[xr.Dataset]) -> xr.Dataset:
    """Return the samples of studies of the same walls as one dataset, with weights."""
    weighted = [
        ds if "weight" in ds else ds.assign(weight=("sample", np.ones(ds.sizes["sample"])))
        for ds in (one.drop_vars("movement", errors="ignore") for one in studies)
    ]
    names = [
        name
        for name in weighted[0].data_vars
        if weighted[0][name].dims[:1] == ("sample",) and all(name in ds for ds in weighted)
    ]
    joined = xr.concat(
        [ds[names] for ds in weighted], "sample", combine_attrs="override", coords="minimal", compat="override"
    )
    return joined.assign_attrs(studies[0].attrs)
