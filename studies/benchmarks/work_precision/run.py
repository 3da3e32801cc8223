"""Error over time of every choice of `[solver]`.

    python studies/benchmarks/work_precision/run.py [--scenes NAME ...] [--axes NAME ...] [--limit 40] [--data FILE]
    python studies/benchmarks/work_precision/run.py --from-data
    python studies/benchmarks/work_precision/run.py --quick

Each wall is solved with each choice in a separate process. At the end data/accuracy.csv, the errors of the presets, is
written. ``--from-data`` only writes these, and prints the errors of all choices. ``--quick`` solves the smallest wall
with a few choices, in seconds, and prints their errors; so does ``--data``, which writes another file.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import Any

from damagepred.errors import DamagepredError
from damagepred.pipeline import model_of, solve
from damagepred.scene import Scene
from damagepred.study.campaign.warm_up import warm_up
from studies.benchmarks import cases
from studies.benchmarks.work_precision.choices import FINEST, Choice, for_scene
from studies.benchmarks.work_precision.errors import load, with_errors
from studies.benchmarks.work_precision.quantities import QUANTITIES, SHARES, read
from studies.benchmarks.work_precision.scenes import scenes

HERE = Path(__file__).resolve().parent
DATA = HERE / "data.csv"
KEY = ("scene", "axis", "value")
QUICK = ["default", "same model", "increments", "explicit"]
LIMIT, OF_A_REFERENCE = 40.0, 200.0
"""Time of one wall in one way (s); that of bricks of zones, which are references."""
REFERENCES = ("zones", FINEST)
REPEATS, SHORT = 3, 1.0
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
    row = {"status": ds.attrs["status"], "seconds": min(times), "build_seconds": built, "blocks": model.n_blocks}
    row |= {"contacts": model.n_contacts, "zones": 0 if model.mesh is None else len(model.mesh.zones)}
    row["iterations"] = int(ds["newton_iterations"].sum() + ds["cycles"].sum())
    row |= {f"{name}@{share:g}": float("nan") for name in QUANTITIES for share in SHARES}  # not all walls have all
    for name, values in read(ds, model).items():
        row |= {f"{name}@{share:g}": value for share, value in zip(SHARES, values)}
    return row


def one(name: str, axis: str, value: str) -> dict[str, Any]:
    """Solve one wall in one way."""
    choice = next(c for c in for_scene(name) if (c.axis, c.value) == (axis, value))
    try:
        return measured(choice.scene(scenes()[name]))
    except DamagepredError as error:
        return {"status": f"failed: {error}"[:200]}


def lost(_: tuple[Any, ...], message: str) -> dict[str, Any]:
    """Return the row of a path that takes too long, or whose process dies."""
    return {"status": message.replace("took longer than", "over")}


def make_ready(chosen: list[tuple[str, Choice]]) -> None:
    """Compile or load the kernels before processes are forked: some are compiled for a number of contacts."""
    ready = set()
    for name, choice in chosen:
        scene = choice.scene(scenes()[name])
        solver = scene.solver
        kind = (solver.contacts_per_interface, solver.method, solver.blocks, solver.below_dpc)
        kind += (scene.joint.fracture_energy is None, repr(scene.dynamics))
        if kind not in ready:
            warm_up(scene)
        ready.add(kind)


def run(path: Path, names: list[str], only: list[str], limit: float) -> None:
    """Solve the cases that are not in the data."""
    chosen = [(name, c) for name in names for c in for_scene(name) if not only or c.axis in only]
    known = cases.keys_in(path, KEY)
    left = [(name, c) for name, c in chosen if (name, c.axis, c.value) not in known]
    make_ready(left)
    for allowed, own in ((limit, False), (max(limit, OF_A_REFERENCE), True)):
        keys = [(name, c.axis, c.value) for name, c in left if (c.axis in REFERENCES) == own]
        cases.run(keys, KEY, one, lost, path, allowed, digits=9)


def print_errors(data: Path) -> None:
    """Print the errors of a file of results, by wall and way, against the finest model and the finest solution."""
    lines = with_errors(load(data))
    for against in ("model", "solution"):
        known = lines.dropna(subset=[against])
        table = known.pivot_table(index=list(KEY), columns="quantity", values=against, sort=False)
        print(f"relative error against the finest {against}\n{table.to_string(float_format='{:.4f}'.format)}\n")


def main() -> None:
    """Read the command line, solve, write the errors of the presets."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", nargs="+", default=list(scenes()), choices=list(scenes()), metavar="NAME")
    parser.add_argument("--axes", nargs="+", default=[], help="only these")
    parser.add_argument("--limit", type=float, default=LIMIT, help=f"time of one wall in one way ({LIMIT:g} s)")
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--from-data", action="store_true", help="print all errors; only write those of the presets")
    parser.add_argument("--quick", action="store_true", help="only the smallest wall, in a few ways")
    asked = parser.parse_args()
    if asked.quick:
        with tempfile.TemporaryDirectory() as folder:
            run(Path(folder) / "data.csv", ["stack"], QUICK, asked.limit)
            print_errors(Path(folder) / "data.csv")
        return
    if not asked.from_data:
        run(asked.data, asked.scenes, asked.axes, asked.limit)
    if asked.data != DATA or asked.from_data:
        print_errors(asked.data)
    if asked.data == DATA:
        from studies.benchmarks.work_precision.summary import write_presets

        write_presets(asked.data, HERE.parents[2] / "data" / "accuracy.csv")


if __name__ == "__main__":
    main()
