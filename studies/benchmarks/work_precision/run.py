"""Error over time of every choice of `[solver]`.

    python studies/benchmarks/work_precision/run.py [--only WALL ...] [--limit 40] [--quick] [--output FOLDER]
    python studies/benchmarks/work_precision/errors.py [FILE]

Each wall is solved with each choice in a separate process; references, whose time is no result, two at a time. At the
end data/accuracy.csv, the errors of the presets, is written. ``--quick`` solves the smallest wall with a few choices.
The second command prints the errors of all choices.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from damagepred.campaign.warm_up import warm_up
from damagepred.errors import DamagepredError
from damagepred.one_wall.judged_path import model_of
from damagepred.one_wall.solve import solve
from damagepred.scene import Scene
from studies import cases
from studies.benchmarks.work_precision.choices import FINEST, Choice, for_scene, scenes
from studies.benchmarks.work_precision.errors import print_errors
from studies.benchmarks.work_precision.quantities import QUANTITIES, SHARES, read

HERE = Path(__file__).resolve().parent
DATA = HERE / "data.csv"
KEY = ("scene", "axis", "value")
QUICK = ("default", "same model", "increments", "explicit")
OF_A_REFERENCE = 200.0
"""Time of a wall of bricks of zones (s): these are references."""
REPEATS, SHORT = 3, 1.0
"""A path that takes less than this (s) is solved ``REPEATS`` times, and the shortest time counts."""


def measured(scene: Scene) -> dict[str, Any]:
    """Solve a wall; return its time and quantities."""
    model, times = model_of(scene), []
    while not times or (len(times) < REPEATS and times[0] < SHORT):
        began = time.process_time()
        ds = solve(scene, on_failure="return", store_zones=False)
        times.append(time.process_time() - began)
    row = {"status": ds.attrs["status"], "seconds": min(times), "blocks": model.n_blocks}
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
        kind += (scene.joint.fracture_energy is None,)
        if kind not in ready:
            warm_up(scene)
        ready.add(kind)


def run(path: Path, names: list[str], only: tuple[str, ...], limit: float) -> None:
    """Solve the cases that are not in the data."""
    chosen = [(name, c) for name in names for c in for_scene(name) if not only or c.axis in only]
    known = cases.keys_in(path, KEY)
    left = [(name, c) for name, c in chosen if (name, c.axis, c.value) not in known]
    make_ready(left)
    for processes, allowed in ((1, limit), (2, max(limit, OF_A_REFERENCE))):
        keys = [(name, c.axis, c.value) for name, c in left if (c.axis in ("zones", FINEST)) == (processes == 2)]
        cases.run(keys, KEY, one, lost, path, allowed, digits=9, processes=processes)


def main() -> None:
    """Read the command line, solve, write the errors of the presets."""
    options = cases.options(__doc__, __file__, scenes(), 40.0)
    data, names = options.output / "data.csv", options.only or (["stack"] if options.quick else list(scenes()))
    run(data, names, QUICK if options.quick else (), options.limit)
    if data != DATA:
        print_errors(data)
        return
    from studies.benchmarks.work_precision.summary import write_presets

    write_presets(data, HERE.parents[2] / "data" / "accuracy.csv")


if __name__ == "__main__":
    main()
