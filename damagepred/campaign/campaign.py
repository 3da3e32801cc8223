"""Monte Carlo campaign: samples are drawn, solved and archived."""

from __future__ import annotations

import signal
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
import xarray as xr

from damagepred.archive.files import write_dataset
from damagepred.archive.folder import StudyFolder
from damagepred.archive.provenance import environment, given_values, program, programs, provenance
from damagepred.archive.schema import SCHEMA_VERSION, Variable, dataset
from damagepred.arrays import FloatArray, Int8Array
from damagepred.assembly import NO_LIMITS, Limits
from damagepred.campaign.cost_estimate import require_affordable
from damagepred.campaign.dispatch import Batches, Engine, LostSample, run_all, sample_timeout
from damagepred.campaign.sample import joint_places, prepare, sample_of
from damagepred.campaign.settings import StudySettings, read_frozen
from damagepred.campaign.warm_up import warm_up
from damagepred.campaign.workers import LocalPool
from damagepred.enumerations import UNSOLVED, SampleStatus
from damagepred.errors import ArchiveWarning, InputError, StudyError, require_count
from damagepred.inputs.arguments import checked
from damagepred.inputs.documentation import documented
from damagepred.runtime.numpy_defaults import numpy_defaults
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene import Scene
from damagepred.scene.described import plain
from damagepred.scene.keys import differing_keys
from damagepred.solvers.options import SolverOptions
from damagepred.uq.fields import WallFields

MOST_VALUES = 25_000_000  # limit of the values of joints in a design (200 MB); they follow from the seed


@documented
class Progress(NamedTuple):
    """Status of a run.

    Examples
    --------
    >>> from damagepred import study
    >>> progress = study.Progress(total=128, done=32, failed=1)
    >>> f"{progress.done / progress.total:.0%}"
    '25%'
    """

    total: int
    done: int
    failed: int
    """Requested samples, finished samples (with failed ones), failed samples."""
    just_failed: str = ""
    """Reason if the last sample failed."""
    seconds_left: float = np.nan
    """Mean time of the samples of this run times the remaining samples over the workers (s); NaN before the first."""


@documented
@dataclass(frozen=True)
class RunSummary:
    """Result of a run.

    Examples
    --------
    A complete study has no samples left to solve:

    >>> from damagepred import Study
    >>> summary = Study.from_toml("house.toml").run("house.dp")
    >>> summary.done, summary.failed, summary.interrupted
    (24, 0, False)
    """

    folder: Path
    """Study folder."""
    total: int
    done: int
    failed: int
    """Requested samples, finished samples (with failed ones), failed samples."""
    interrupted: bool
    """Whether the run was stopped before the last sample."""
    seconds: float
    """Time of this run."""


def study_differences(frozen: StudySettings, settings: StudySettings) -> list[str]:
    """Keys in which two studies differ, without keys that leave the walls unchanged, such as their number."""
    was, now = frozen.to_dict(), settings.to_dict()
    for content in (was, now):
        content["scene"]["solver"].pop("accuracy")  # its keys count
        for key in ("samples", "stop_when", "epistemic", "table"):
            content["study"].pop(key, None)
    return differing_keys(was, now)


class Campaign:
    """Samples of a study, and the run that solves them.

    Parameters
    ----------
    settings : StudySettings
        Scene, variables and sampling.
    limits : Limits
        Estimated cost of one wall above which the study is refused, and time limit of a wall; ``NO_LIMITS`` lifts them.

    Examples
    --------
    >>> study = Campaign.from_toml("house.toml")                 # doctest: +SKIP
    >>> study.run("house.dp", samples=100, workers=2)         # doctest: +SKIP
    """

    @checked
    def __init__(self, settings: StudySettings, limits: Limits = Limits()) -> None:  # noqa: B008 - frozen
        require_affordable(settings, limits)
        SolverOptions.of(settings.scene.solver)  # refused before anything is solved
        self.settings, self.limits = settings, limits
        self.design = settings.design()
        if isinstance(self.design.fields, WallFields):  # refuse here, not wall by wall
            self.design.joint_values(0, joint_places(settings.scene))

    @classmethod
    def from_toml(cls, path: str | Path, limits: Limits = Limits()) -> Self:  # noqa: B008 - frozen
        """Read a study file.

        Parameters
        ----------
        path : str or Path
            TOML file.
        limits : Limits
            Estimated cost above which the study is refused, and time limit of a wall.

        Raises
        ------
        InputError
            If the file, or its scene file, is missing or invalid.
        """
        return cls(StudySettings.from_toml(path), limits)

    @classmethod
    def from_folder(cls, path: str | Path) -> Self:
        """Read the frozen study of a study folder; another folder raises InputError."""
        folder = StudyFolder(path)
        folder.require()
        return cls.from_text(folder.study_text())

    @classmethod
    def from_text(cls, text: str) -> Self:
        """Read the frozen copy of a study from its text."""
        return cls(read_frozen(text), NO_LIMITS)

    @checked
    def sample(self, number: int) -> tuple[Scene, dict[str, FloatArray]]:
        """Scene of one sample, by its number from 0, and its values that vary from joint to joint."""
        require_count("number", number, 0)
        count = max(self.settings.study.samples, number + 1)
        require_affordable(self.settings, self.limits, count)
        return sample_of(self.settings, self.design, number, count)

    @numpy_defaults()
    def run(
        self,
        out: str | Path,
        samples: int | None = None,
        workers: int = 1,
        executor: Executor | None = None,
        *,
        timeout: float | None = None,
        retry_failed: bool = False,
        mix_versions: bool = False,
        on_progress: Callable[[Progress], None] | None = None,
    ) -> RunSummary:
        """Run the missing samples of the study into a folder.

        Parameters
        ----------
        out : str or Path
            Study folder; an existing study is resumed, and extended to a larger number of samples.
        samples : int, optional
            Total number of samples; by default the study's.
        workers : int
            Number of worker processes.
        executor : concurrent.futures.Executor, optional
            Executor, or Dask client, for the samples; its workers write into the same folder.
        timeout : float, optional
            Time limit of a sample (s), without an executor. By default an hour; ``math.inf`` lifts it.
        retry_failed : bool
            Whether to run failed samples again.
        mix_versions : bool
            Whether to resume a study whose samples another version of the program has solved; status and report then
            list the versions.
        on_progress : callable, optional
            Called with a ``Progress`` at the start and after each archived sample.

        Raises
        ------
        StudyError
            If the folder holds another study, or samples of another version, is in use, or cannot be written.
        InputError
            If a Latin hypercube is to be extended, or the design is damaged.
        """
        require_count("workers", workers)
        if samples is not None:
            require_count("samples", samples)
            require_affordable(self.settings, self.limits, samples)
        timeout = sample_timeout(timeout, self.limits, executor)
        began = time.perf_counter()
        folder = StudyFolder(out)
        where = str(folder.path.resolve())
        pool: LocalPool | None = None  # of this run
        ready = partial(prepare, where)
        if not folder.exists:
            folder.check_new()
        lock = folder.lock()
        try:
            folder.tidy()
            requested = self.settings.study.samples if samples is None else int(samples)
            if executor is None and not folder.exists:  # workers load the program while the design is drawn
                pool = LocalPool(min(workers, requested), timeout, ready, preload=True)
            study = self._resuming(folder) if folder.exists else self
            run = UNSOLVED if retry_failed else (SampleStatus.MISSING,)
            drawn, status = study._prepare(folder, requested, run, mix_versions)
            if retry_failed:
                failures = set(np.flatnonzero(status == SampleStatus.FAILED).tolist()) | folder.failed_samples()
                folder.forget_failures({i for i in failures if i < requested})
            values = self.design.wall_values(drawn)

            def inputs(sample: int) -> dict[str, float]:
                return {key: float(column[sample]) for key, column in values.items()}

            failures = folder.failed_samples()
            finished_samples = {i for i in folder.finished() | failures if i < requested}
            remaining = [i for i in range(requested) if i not in finished_samples]
            failed = sum(i < requested for i in failures)
            state = Progress(requested, len(finished_samples), failed)
            if on_progress:
                on_progress(state)
            with _interruptible() as stop:
                if remaining:
                    stop.at_first = folder.ask_to_stop
                    if executor is None:
                        pool = pool or LocalPool(min(workers, len(remaining)), timeout, ready)
                        stop.at_once = pool.terminate
                    engine = Engine(where, pool if executor is None else executor)
                    batches = Batches(((i, inputs(i)) for i in remaining), len(remaining), timeout)
                    state = study._run(folder, batches, inputs, engine, stop, state, on_progress)
                if pool is not None:
                    pool.shutdown(cancel_futures=stop.count > 1)
            folder.consolidate()
            if executor is None or not stop.count:  # remote workers may not have seen the request to stop
                folder.tidy()
        finally:
            if pool is not None:
                pool.shutdown(cancel_futures=True)
            lock.release()
        seconds = time.perf_counter() - began
        return RunSummary(folder.path, *state[:3], state.done < state.total, seconds)

    def _run(
        self,
        folder: StudyFolder,
        batches: Batches,
        inputs: Callable[[int], dict[str, float]],
        engine: Engine,
        stop: _Stop,
        state: Progress,
        on_progress: Callable[[Progress], None] | None,
    ) -> Progress:
        times: list[float] = []
        warm_up(self.settings.scene)  # while local workers load the program
        for result in run_all(engine, batches, lambda: stop.count):
            message = ""
            if isinstance(result, LostSample):
                folder.record_failure(result.sample, result.reason, result.message, inputs(result.sample))
                message = f"sample {result.sample}: {result.reason}: {result.message}"
            else:
                times.append(result.seconds)
                if result.status == SampleStatus.FAILED:
                    message = f"sample {result.sample}: {result.message}"
            done = state.done + 1
            rounds = (state.total - done) / max(1, min(engine.width, state.total - done))
            left = float(np.mean(times)) * rounds if times else np.nan
            state = Progress(state.total, done, state.failed + bool(message), message, left)
            if on_progress:
                on_progress(state)
        return state

    def _resuming(self, folder: StudyFolder) -> Campaign:
        """Study that a folder continues."""
        return self

    # -- folder ---------------------------------------------------------------------------------------------------

    def _prepare(
        self,
        folder: StudyFolder,
        requested: int,
        run: tuple[int, ...] = (SampleStatus.MISSING,),
        mix_versions: bool = False,
    ) -> tuple[int, Int8Array]:
        """Make or check the folder and its design; return the number of drawn samples, and the status of each."""
        if not folder.exists:
            folder.create(self.settings.to_toml(), self._manifest(requested), self.design_dataset(requested))
            return requested, np.full(requested, SampleStatus.MISSING, dtype=np.int8)
        folder.require()
        if differences := study_differences(read_frozen(folder.study_text()), self.settings):
            raise StudyError(
                f"{folder.path}: holds a different study; nothing was changed. These keys differ:\n  "
                + "\n  ".join(differences)
                + "\nRun into another folder with -o, or set the keys back."
            )
        self._check_table(folder)
        manifest = folder.manifest()
        drawn = int(manifest["samples"])
        if not folder.design_file.is_file():
            self.write_design(folder, drawn)
        status = self._check_parts(folder, run, requested, mix_versions)
        if requested > drawn:
            if self.settings.study.sampler == "lhs":
                raise InputError(
                    f"{folder.path}: a Latin hypercube of {drawn} samples cannot be extended to {requested}; use "
                    "sampler = 'sobol' or 'random' in a new study, which can."
                )
            drawn = requested
            self.write_design(folder, drawn)
        changed = {**manifest, "samples": drawn, **self._head}
        if changed != manifest or manifest["schema_version"] != SCHEMA_VERSION:
            folder.write_manifest(changed)
        added = np.full(max(0, drawn - len(status)), SampleStatus.MISSING, dtype=np.int8)
        return drawn, np.concatenate((status, added))

    def _check_parts(self, folder: StudyFolder, run: tuple[int, ...], requested: int, mix_versions: bool) -> Int8Array:
        """Set damaged files aside, refuse a mixture of program versions; return the status of all samples."""
        results, left_out = folder.read(("environment",))
        status = results["status"].values
        now = program(environment())
        others = [words for words in programs(results) if words != now]
        if others and not mix_versions and (requested > len(status) or np.isin(status[:requested], run).any()):
            raise StudyError(
                f"{folder.path}: its samples were solved by {'; '.join(others)}, and this is {now}; use that program, "
                "or mix versions with --mix-versions (mix_versions=True); status and report then list them."
            )
        for file, why in left_out.items():
            again = "it is made again" if file == folder.results_file else "its samples are run again"
            warnings.warn(f"{why} It is set aside as {folder.set_aside(file)}; {again}.", ArchiveWarning, stacklevel=3)
        return status

    def _check_table(self, folder: StudyFolder) -> None:
        """Refuse a table whose first rows are not the drawn samples."""
        if self.settings.study.sampler != "table" or not folder.design_file.is_file():
            return
        design = folder.design()
        for key, values in self.design.wall_values(design.sizes["sample"]).items():
            if (other := np.flatnonzero(values != design[key].values)).size:
                raise StudyError(
                    f"{folder.path}: holds other samples than the table; nothing was changed. The first difference is "
                    f"{key} of sample {other[0]} (was {design[key].values[other[0]]:g}, is {values[other[0]]:g}). "
                    "Rows may be added at the table's end, but not changed."
                )

    def _manifest(self, samples: int) -> dict[str, Any]:
        return {
            "title": self.settings.title,
            "samples": samples,
            "seed": self.settings.study.seed,
            "sampler": self.settings.study.sampler,
            "created": datetime.now(UTC).isoformat(timespec="seconds"),
            **self._head,
            **provenance(),
        }

    @property
    def _head(self) -> dict[str, Any]:
        """Head of the report for the manifest, the only file of a study that is written again."""
        return {} if self.settings.report is None else {"report": plain(self.settings.report)}

    def write_design(self, folder: StudyFolder, samples: int) -> None:
        """Write the inputs of the first samples to a folder with its frozen study."""
        design = self.design_dataset(samples).assign_attrs(study=folder.study_text())
        write_dataset(design, folder.design_file, folder.study_hash)

    @checked
    @one_blas_thread()
    def design_dataset(self, samples: int) -> xr.Dataset:
        """Every input of the first samples by its key; on (sample, joint) if stored fields fit (``MOST_VALUES``)."""
        require_count("samples", samples)
        require_affordable(self.settings, self.limits, samples)
        values = self.design.wall_values(samples)
        columns: dict[str, Any] = {"sample": np.arange(samples), **values}
        if (weight := self.design.weights(samples)) is not None:
            columns["weight"] = weight
        if self.settings.study.store_fields and self.design.joint and not self.settings.shape_varies:
            joints_of_wall = joint_places(self.settings.scene)
            joints = len(joints_of_wall.x)
            if samples * joints * len(self.design.joint) <= MOST_VALUES:
                drawn = [self.design.joint_values(i, joints_of_wall) for i in range(samples)]
                columns |= {key: np.array([d[key] for d in drawn]) for key in self.design.joint}
        extra = {
            key: Variable(
                ("sample", "joint") if key in self.design.joint else ("sample",),
                Scene.unit_of(key).replace("**", ""),
                f"sampled input {key}" + (" of each joint" if key in self.design.joint else ""),
            )
            for key in (*self.design.wall, *self.design.joint)
        }
        settings = self.settings
        ds = dataset(
            columns,
            {
                "title": settings.title,
                "seed": settings.study.seed,
                "sampler": settings.study.sampler,
                "replicates": settings.study.replicates,
                "crossed": settings.study.crossed or None,
                "study": settings.to_toml(),
                "scene": settings.scene.to_toml(),
                **given_values(settings.scene.given),
                "damage_table": settings.damage_table.name,
                "damage_measure": settings.scene.damage.measure,
                "count_footing_gap": settings.scene.damage.count_footing_gap,
                "highest_category": settings.damage_table.highest,
                "span": max(scene.wall.length for scene in settings.scene.scenes),
                "solver_options": SolverOptions.of(settings.scene.solver).to_json(),
                **provenance(),
            },
            extra=extra,
        )
        for key in (*self.design.wall, *self.design.joint):
            if key in ds:
                stated = settings.variables.get(key)
                ds[key].attrs.update(role="input", distribution=stated.distribution if stated else "table")
        return ds


class _Stop:
    """Counter of interrupts: the first lets running samples finish, the second ends them."""

    def __init__(self) -> None:
        self.count = 0
        self.at_first: Callable[[], None] | None = None
        self.at_once: Callable[[], None] | None = None

    def __call__(self, number: int, frame: object) -> None:
        self.count += 1
        if self.count == 1 and self.at_first is not None:
            self.at_first()
        if self.count == 2 and self.at_once is not None:
            self.at_once()
        if self.count > 2:
            raise KeyboardInterrupt


@contextmanager
def _interruptible() -> Iterator[_Stop]:
    """Handle Ctrl-C and SIGTERM as requests to stop, in the main thread."""
    stop = _Stop()
    before: dict[signal.Signals, Any] = {}
    for number in (signal.SIGINT, signal.SIGTERM):
        try:
            before[number] = signal.signal(number, stop)
        except ValueError:  # not the main thread: the caller handles its own interrupts
            break
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
