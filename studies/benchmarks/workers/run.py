"""Time of 100 000 or a million walls by number of workers: a model of measured parts, and runs to check it.

    python studies/benchmarks/workers/run.py [--part parts runs] [--wall window solid] [--quick]

``parts`` measures the parts of a study: one worker's time for a wall, sampling, dispatch, merging, bytes. ``runs`` runs
whole studies on the program's own worker processes and on a local Dask cluster. About three minutes in all; on a
machine with other load the runs take longer than the model predicts. parts.csv and runs.csv hold both.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from damagepred.archive.folder import StudyFolder, open_study
from damagepred.archive.parts import joined, read_part, write_part
from damagepred.study import Study
from damagepred.study.campaign.sample import Outcome, run_batch
from damagepred.study.campaign.warm_up import warm_up
from damagepred.study.settings import StudySettings
from studies.benchmarks.pages import replace_rows

HERE = Path(__file__).resolve().parent


def settings_of(wall: str) -> StudySettings:
    """Return a study: a small wall with a window, or the solid wall of the full-scale test."""
    if wall == "solid":
        import runpy

        found = runpy.run_path(str(HERE.parents[1] / "throughput" / "run.py"))["solid_wall_study"](100)
        return found  # type: ignore[no-any-return]
    return StudySettings.from_toml(HERE.parent / "probabilities" / "window.toml")


# -- the parts --------------------------------------------------------------------------------------------------------


class Copies(Executor):
    """A worker that solves nothing: it writes a copy of one solved wall for each sample, and adds up the time."""

    _max_workers = 8

    def __init__(self, row: Any, status: int, seconds: float) -> None:
        self.row, self.status, self.seconds, self.spent = row, status, seconds, 0.0

    def submit(self, function: Any, /, *arguments: Any, **more: Any) -> Future:  # type: ignore[override]
        """Write and return the results, as ``run_batch`` does after solving."""
        began = time.process_time()
        folder, batch = arguments
        rows = joined([self.row] * len(batch))
        rows["sample"].values[:] = [sample for sample, _ in batch]
        place = StudyFolder(folder)
        write_part(place.part_file(batch[0][0], batch[-1][0]), rows, place.study_hash)
        done: Future = Future()
        done.set_result([Outcome(sample, self.status, self.seconds, "") for sample, _ in batch])
        self.spent += time.process_time() - began
        return done


def parts(wall: str, solved: int, copied: int) -> dict[str, float]:
    """Measure the parts of a study in processor time: a few walls solved, and many copies of one."""
    settings = settings_of(wall)
    with tempfile.TemporaryDirectory() as place:
        first = Path(place) / "first.dp"
        starts = []
        for k in range(3):
            began = time.perf_counter()
            Study(settings).run(first if k == 0 else Path(place) / f"start{k}.dp", samples=1, workers=1)
            starts.append(time.perf_counter() - began)
        each = _one_worker(Study(settings), Path(place) / "solved.dp", solved)
        folder = StudyFolder(first)
        (file,) = folder.part_files()
        row = read_part(file)
        study, many = Study(settings), StudyFolder(Path(place) / "many.dp")
        study.run(many.path, samples=1)
        drawing = _seconds(lambda: study._prepare(many, copied))
        copies = Copies(row, 0, each)
        whole = _seconds(lambda: study.run(many.path, samples=copied, executor=copies)) - copies.spent
        merging = _seconds(many.consolidate)
        # sampled again by the run, and merged
        parent = max(whole - merging - drawing, 0.0)
        size = sum(f.stat().st_size for f in many.path.rglob("*") if f.is_file())
    return {
        "wall": each,
        "start": min(starts) - each,
        "drawing": 2 * drawing / copied,
        "parent": parent / copied,
        "merging": merging / copied,
        "bytes": size / copied,
    }


def _seconds(do: Any) -> float:
    began = time.process_time()
    do()
    return time.process_time() - began


def _one_worker(study: Study, path: Path, count: int) -> float:
    """Return a worker's processor time for a wall, writing included."""
    study.run(path, samples=1)
    study._prepare(StudyFolder(path), count)
    warm_up(study.settings.scene)
    values = study.design.wall_values(count)
    batches = [
        [(i, {k: float(v[i]) for k, v in values.items()}) for i in range(a, min(a + 8, count))]
        for a in range(1, count, 8)
    ]
    run_batch(str(path), batches[0])
    return _seconds(lambda: [run_batch(str(path), batch) for batch in batches[1:]]) / (count - 1 - len(batches[0]))


# -- runs to check the model with -------------------------------------------------------------------------------------


def runs(wall: str, samples: int, ways: tuple[str, ...]) -> list[dict[str, Any]]:
    """Run whole studies, and time them by the clock."""
    rows = []
    for way in ways:
        workers = int(way.split()[-2])
        with tempfile.TemporaryDirectory() as place:
            study, out = Study(settings_of(wall)), Path(place) / "study.dp"
            if way.startswith("Dask"):
                seconds, started = _on_dask(study, out, samples, workers)
            else:
                began = time.perf_counter()
                study.run(out, samples=samples, workers=workers)
                seconds, started = time.perf_counter() - began, np.nan
            solving = float(np.nansum(open_study(out)["run_time"].values))
        rows.append(
            {
                "wall": wall,
                "way": way,
                "walls": samples,
                "workers": workers,
                "seconds": seconds,
                "cluster start": started,
                "wall by the clock": solving / samples,
                "busy": solving / (workers * seconds),
                "load": os.getloadavg()[0],
            }
        )
        print(rows[-1], flush=True)
    return rows


def _on_dask(study: Study, out: Path, samples: int, workers: int) -> tuple[float, float]:
    """Run on a local cluster; return how long the study took, and the start of the cluster apart."""
    from distributed import Client, LocalCluster

    began = time.perf_counter()
    with (
        LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        started = time.perf_counter() - began
        began = time.perf_counter()
        study.run(out, samples=samples, executor=client)
        return time.perf_counter() - began, started


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", nargs="+", choices=("parts", "runs"), default=["parts", "runs"])
    parser.add_argument("--wall", nargs="+", choices=("window", "solid"), default=["window", "solid"])
    parser.add_argument("--quick", action="store_true", help="a few walls, to check that it runs")
    parser.add_argument("--into", type=Path, default=HERE, help="folder of the data")
    options = parser.parse_args()
    quick = options.quick
    for wall in options.wall:
        if "parts" in options.part:
            solved, copied = (20, 200) if quick else (33 if wall == "solid" else 201, 10_000)
            found = parts(wall, solved, copied)
            print(wall, found, flush=True)
            replace_rows(pd.DataFrame([{"wall of": wall, **found}]), options.into / "parts.csv", ["wall of"])
        if "runs" in options.part:
            ways = (
                ("own pool, 2 workers",) if quick else ("own pool, 1 worker", "own pool, 2 workers", "Dask, 2 workers")
            )
            samples = 24 if quick else (60 if wall == "solid" else 400)
            rows = runs(wall, samples, ways)
            replace_rows(pd.DataFrame(rows), options.into / "runs.csv", ["wall"])


if __name__ == "__main__":
    main()
