"""Time of a thousand walls: the solid wall of the full-scale test, per-joint strengths, full paths.

Run: python studies/throughput/run.py [--walls 1000] [--workers 1 2]
"""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import shutil
import sys
import tempfile
import threading
import time
import tomllib
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from damagepred.campaign.settings import StudySettings
from damagepred.campaign.warm_up import warm_up
from damagepred.study import Study, open_study

HERE = Path(__file__).resolve().parent
DATA = HERE.parents[1] / "data"


def solid_wall_study(samples: int) -> StudySettings:
    """Return the study of data/bryant_study.toml for the solid wall, each path followed to its end at 8 mm."""
    tables = tomllib.loads((DATA / "bryant_study.toml").read_text(encoding="utf-8"))
    scene = tomllib.loads((DATA / "bryant_dishing.toml").read_text(encoding="utf-8"))
    del tables["variables"]["movement.central_deflection"]
    tables["study"] |= {"title": "Bryant (1993) solid wall, 8 mm", "samples": samples, "stop_at_category": "none"}
    return StudySettings.from_dict({**tables, "scene": scene})


class Watch(threading.Thread):
    """Monitors the worker processes of this one: the peak memory of each, and its time."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.over, self.memory, self.seconds = threading.Event(), {}, {}

    def run(self) -> None:
        """Sample twice a second; only the workers, for looking at all processes takes 2 % of a core."""
        tick = os.sysconf("SC_CLK_TCK")
        while not self.over.wait(0.5):
            listed = [_text(path) for path in Path("/proc/self/task").glob("*/children")]
            for child in " ".join(listed).split():
                status, stat = (_text(Path(f"/proc/{child}/{name}")) for name in ("status", "stat"))
                if (peak := re.search(r"VmHWM:\s+(\d+)", status)) and stat:
                    user, system = stat.rpartition(")")[2].split()[11:13]
                    self.memory[child], self.seconds[child] = int(peak[1]) / 1024, (int(user) + int(system)) / tick


def _text(path: Path) -> str:
    """Return a file of the system; nothing if its process has just ended."""
    try:
        return path.read_text()
    except OSError:
        return ""


def measure(walls: int, workers: int, folder: Path) -> dict[str, Any]:
    """Run the study and return its times and memory."""
    study, watch = Study(solid_wall_study(walls)), Watch()
    seen: list[tuple[int, float, float]] = []  # walls done, time, processor time of the workers
    watch.start()
    began, cpu = time.perf_counter(), time.process_time()
    summary = study.run(
        folder,
        workers=workers,
        on_progress=lambda state: seen.append((state.done, time.perf_counter(), sum(watch.seconds.values()))),
    )
    total, parent = time.perf_counter() - began, time.process_time() - cpu
    watch.over.set()
    watch.join()
    if summary.failed:
        print(f"{summary.failed} walls failed", file=sys.stderr)
    # after the first walls of each worker: the time of a wall excludes loading libraries and kernels. Walls of a batch
    # are reported together, when the last is done
    done = [row for row, following in pairwise(seen) if following[1] - row[1] > 0.02]
    steady = [row for row in done if row[0] >= min(4 * workers, walls // 2)] or seen
    count, clock, processor = (last - first for first, last in zip(steady[0], seen[-1]))
    solving = float(np.nansum(open_study(folder)["run_time"].values))
    parts = list((folder / "parts").iterdir())
    size = {
        name: sum(f.stat().st_size for f in files)
        for name, files in (
            ("parts", parts),
            ("results", [folder / "results.nc"]),
            ("design", [folder / "design.nc"]),
        )
    }
    return {
        "walls": walls,
        "workers": workers,
        "total_s": total,
        "walls_solved_in_s": solving,
        "worker_processor_s": sum(watch.seconds.values()),
        "parent_processor_s": parent,
        "processor_ms_a_wall": 1e3 * processor / max(count, 1),
        "walls_a_second": count / max(clock, 1e-9),
        "busy": solving / (workers * total),
        "peak_MB_a_worker": max(watch.memory.values(), default=float("nan")),
        "parts": len(parts),
        "bytes_a_wall": {name: value / walls for name, value in size.items()},
        "load_average": os.getloadavg()[0],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--walls", type=int, default=1000, help="how many (1000)")
    parser.add_argument("--workers", type=int, nargs="*", default=[2], help="processes, one run for each number (2)")
    parser.add_argument("--efficiency", type=int, default=40, help="walls to compare 1 with 2 workers; 0: not (40)")
    parser.add_argument("--results", type=Path, default=HERE / "results" / "throughput.json", help="what was measured")
    options = parser.parse_args()
    began = time.perf_counter()
    warm_up(solid_wall_study(1).scene)
    found: dict[str, Any] = {"kernels_ready_s": time.perf_counter() - began, "runs": []}
    with tempfile.TemporaryDirectory(dir=HERE) as place:
        for workers in options.workers:
            found["runs"].append(measure(options.walls, workers, Path(place) / f"{workers}.dp"))
            print(json.dumps(found["runs"][-1], indent=1), flush=True)
        if options.efficiency:
            rates = {}
            for workers in (1, 2):
                row = measure(options.efficiency * workers, workers, Path(place) / f"efficiency-{workers}.dp")
                rates[workers] = row["worker_processor_s"] / row["walls"]
                print(json.dumps(row, indent=1), flush=True)
            found["efficiency_by_processor_time"] = rates[1] / rates[2]
            print("processor time a wall, 1 worker over 2:", found["efficiency_by_processor_time"])
        shutil.rmtree(place, ignore_errors=True)
    found["peak_MB_parent"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    options.results.parent.mkdir(parents=True, exist_ok=True)
    options.results.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
