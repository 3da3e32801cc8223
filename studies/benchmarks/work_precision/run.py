"""Error over time of every choice of `[solver]`.

    python studies/benchmarks/work_precision/run.py [--scenes NAME ...] [--seconds 270] [--limit 60]
    python studies/benchmarks/work_precision/run.py --from-data
    python studies/benchmarks/work_precision/run.py --quick
    python studies/benchmarks/work_precision/run.py --axes NAME ... --data FILE

Each wall is solved with each choice in a separate process, with a limit of processor time, and written to data.csv at
once: the same command resumes. ``--from-data`` prints the errors of all choices, and writes data/accuracy.csv, the
errors of the presets. ``--quick`` solves the smallest wall with a few choices, in seconds, and prints their errors;
``--data`` writes another file and prints its.
"""

from __future__ import annotations

import argparse
import csv
import multiprocessing
import resource
import signal
import tempfile
import time
from pathlib import Path
from typing import Any

from damagepred.errors import DamagepredError
from damagepred.pipeline import model_of, solve
from damagepred.scene import Scene
from damagepred.study.campaign.warm_up import warm_up
from studies.benchmarks.work_precision.choices import Choice, for_scene
from studies.benchmarks.work_precision.quantities import QUANTITIES, SHARES, read
from studies.benchmarks.work_precision.scenes import scenes

HERE = Path(__file__).resolve().parent
DATA = HERE / "data.csv"
COLUMNS = ["scene", "axis", "value", "status", "seconds", "build_seconds", "blocks", "contacts", "zones", "iterations"]
COLUMNS += [f"{name}@{share:g}" for name in QUANTITIES for share in SHARES]
QUICK = ["default", "same model", "increments", "explicit"]
REPEATS, SHORT = 5, 1.0
"""A path that takes less than this (s) is solved ``REPEATS`` times, and the shortest time counts."""


def measured(scene: Scene) -> dict[str, Any]:
    """Solve a wall; return its time and quantities."""
    began = time.process_time()
    model = model_of(scene)
    built = time.process_time() - began
    times = []
    while not times or (len(times) < REPEATS and times[0] < SHORT):
        began = time.process_time()
        ds = solve(scene, on_failure="return", store_zones=False)
        times.append(time.process_time() - began)
    row = {
        "status": ds.attrs["status"],
        "seconds": min(times),
        "build_seconds": built,
        "blocks": model.n_blocks,
        "contacts": model.n_contacts,
        "zones": 0 if model.mesh is None else len(model.mesh.zones),
        "iterations": int(ds["newton_iterations"].sum() + ds["cycles"].sum()),
    }
    for name, values in read(ds, model).items():
        row |= {f"{name}@{share:g}": value for share, value in zip(SHARES, values)}
    return row


def _in_child(scene: Scene, limit: float, pipe: Any) -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (int(limit + time.process_time()) + 1, resource.RLIM_INFINITY))
    try:
        pipe.send(measured(scene))
    except DamagepredError as error:
        pipe.send({"status": f"failed: {error}"[:200]})
    pipe.close()


def in_process(scene: Scene, limit: float) -> dict[str, Any]:
    """Solve a wall in a separate process with kernels loaded; it is terminated after ``limit`` seconds."""
    here, there = multiprocessing.get_context("fork").Pipe(duplex=False)
    child = multiprocessing.get_context("fork").Process(target=_in_child, args=(scene, limit, there))
    child.start()
    there.close()
    try:
        row = here.recv()
    except EOFError:
        row = {}
    child.join()
    if row:
        return row
    over = child.exitcode == -signal.SIGXCPU
    return {"status": f"over {limit:g} s" if over else f"died ({child.exitcode})", "seconds": limit if over else ""}


def known(path: Path) -> set[tuple[str, str, str]]:
    """Return the solved cases: wall, axis and value."""
    if not path.exists():
        return set()
    with path.open(newline="") as file:
        return {(row["scene"], row["axis"], row["value"]) for row in csv.DictReader(file)}


def note(path: Path, row: dict[str, Any]) -> None:
    """Append a row, and the head before the first."""
    new = not path.exists()
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, restval="", lineterminator="\n")
        if new:
            writer.writeheader()
        writer.writerow({key: f"{v:.9g}" if isinstance(v, float) else v for key, v in row.items()})


_READY: set[tuple[int, str, str, str | None, bool]] = set()


def make_ready(scene: Scene) -> None:
    """Compile or load the kernels of a wall, once: some are compiled for a number of contacts."""
    solver = scene.solver
    key = (
        solver.contacts_per_interface,
        solver.method,
        solver.blocks,
        solver.below_dpc,
        scene.joint.fracture_energy is None,
    )
    if scene.dynamics is not None or key not in _READY:
        warm_up(scene)
    _READY.add(key)


def run(path: Path, names: list[str], only: list[str], seconds: float, limit: float) -> None:
    """Solve the cases that are not in the data, within the time limit."""
    began = time.monotonic()
    for name in names:
        todo = [c for c in for_scene(name) if (name, c.axis, c.value) not in known(path)]
        todo = [c for c in todo if not only or c.axis in only]
        if todo:
            print(f"{name}: {len(todo)} ways to go, at most {limit * len(todo):.0f} s of processor time", flush=True)
        for choice in todo:
            if time.monotonic() - began > seconds:
                print("time is up: the same command resumes")
                return
            solve_one(path, name, choice, limit)
    print("all is known")


def solve_one(path: Path, name: str, choice: Choice, limit: float) -> None:
    """Solve one wall with one choice and write its row."""
    scene = choice.scene(scenes()[name])
    make_ready(scene)
    row = in_process(scene, limit)
    note(path, {"scene": name, "axis": choice.axis, "value": choice.value, **row})
    print(f"  {choice.name:45} {row['status']:12} {row.get('seconds', 0) or 0:8.2f} s", flush=True)


def quick() -> None:
    """Solve the smallest wall with a few choices and print the errors."""
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "data.csv"
        run(data, ["stack"], QUICK, 60.0, 10.0)
        print_errors(data)


def print_errors(data: Path) -> None:
    """Print the errors of a file of results, by wall and way, against the finest model and the finest solution."""
    from studies.benchmarks.work_precision.errors import load, with_errors

    lines = with_errors(load(data))
    for against in ("model", "solution"):
        known = lines.dropna(subset=[against])
        table = known.pivot_table(index=["scene", "axis", "value"], columns="quantity", values=against, sort=False)
        print(f"relative error against the finest {against}\n{table.to_string(float_format='{:.4f}'.format)}\n")


def main() -> None:
    """Read the command line, solve, write the errors of the presets."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", nargs="+", default=list(scenes()), choices=list(scenes()), metavar="NAME")
    parser.add_argument("--axes", nargs="+", default=[], help="only these")
    parser.add_argument("--seconds", type=float, default=1e9, help="begin nothing new after these")
    parser.add_argument("--limit", type=float, default=60.0, help="processor time for one wall in one way (s)")
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--from-data", action="store_true", help="print all errors; only write those of the presets")
    parser.add_argument("--quick", action="store_true", help="only the smallest wall, in a few ways")
    asked = parser.parse_args()
    if asked.quick:
        quick()
        return
    if not asked.from_data:
        run(asked.data, asked.scenes, asked.axes, asked.seconds, asked.limit)
    if asked.data != DATA or asked.from_data:
        print_errors(asked.data)
    if asked.data == DATA:
        from studies.benchmarks.work_precision.summary import write_presets

        write_presets(asked.data, HERE.parents[2] / "data" / "accuracy.csv")


if __name__ == "__main__":
    main()
