"""Error of a fragility median and of a small probability over computing time, measured by repetition.

    python studies/benchmarks/probabilities/run.py [--only window joints] [--limit 900] [--quick] [--output FOLDER]

Sets of walls are solved, two at a time, and kept in ``results``; the same call resumes. At the end data.csv is written.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from damagepred.campaign.warm_up import warm_up
from studies import cases
from studies.benchmarks.probabilities import errors, walls
from studies.benchmarks.probabilities.walls import SETS, WALLS


def lost(_: tuple[Any, ...], message: str) -> dict[str, Any]:
    """Return the row of a set that took too long, or whose process died."""
    return {"message": message}


def make_ready(names: Sequence[str]) -> None:
    """Compile, or load what is compiled, before processes are forked."""
    for wall in names:
        for variant in ("", *SETS[wall]["variants"]):
            warm_up(walls.settings_of(wall, variant).scene)


def main() -> None:
    """Measure what the command line asks for."""
    options = cases.options(__doc__, __file__, WALLS, 900.0)
    quick, names = options.quick, options.only or WALLS[: 1 if options.quick else 2]
    folder: Path = options.output / "results"
    ready = partial(make_ready, names)
    folder.mkdir(exist_ok=True)
    keys = [(wall, plan.name) for wall in names for plan in walls.plans(wall, quick)]
    work, sets = partial(walls.solve, folder, quick), folder / "sets.csv"
    cases.run(keys, ("wall", "set"), work, lost, sets, options.limit, processes=2, before=ready)
    levels = {wall: SETS["quick" if quick else wall]["subset_runs"] for wall in names}
    runs = [(wall, int(level), run) for wall in names for level, n in levels[wall].items() for run in range(n)]
    key, file = ("wall", "level", "run"), folder / "subset.csv"
    cases.run(runs, key, walls.subset, lost, file, options.limit, processes=2, before=ready)
    errors.write(options.output, folder, {wall: [p.name for p in walls.plans(wall, quick)] for wall in names})


if __name__ == "__main__":
    main()
