"""Measure the time that each skip of the program saves, and the differences it makes.

    python studies/benchmarks/skips/run.py [--only condense half ...] [--limit 120] [--quick] [--output FOLDER]

Each is turned off while the others stay at their defaults. Runs with and without alternate, in two rounds; times are
processor times. ``--quick`` measures a few skips on a few bricks.
"""

from __future__ import annotations

from functools import cache, partial
from typing import Any

from studies.benchmarks import cases
from studies.benchmarks.skips.measuring import compare
from studies.benchmarks.skips.scenes import SCENES, smaller
from studies.benchmarks.skips.skips import SKIPS
from studies.benchmarks.skips.study_skips import PARTS

QUICK = ("condense", "half", "elastic start", "stop", "shared")
"""Skips of the quick form: none needs extra compiling."""
ROUNDS = 2


def measure(name: str, wall: str, number: int, small: bool) -> dict[str, Any]:
    """Measure a skip on a wall, or on a few of its bricks."""
    if name in PARTS:
        return PARTS[name].measure(number, small)
    known = SCENES[wall]()
    return compare(smaller(known) if small else known, SKIPS[name], number)


@cache
def make_ready(name: str, wall: str) -> None:
    """Compile, or load what is compiled."""
    measure(name, wall, 0, True)


def one(small: bool, name: str, wall: str, number: int) -> dict[str, Any]:
    """Measure a skip in a round."""
    make_ready(name, wall)
    return measure(name, wall, number, small)


def lost(_: tuple[Any, ...], message: str) -> dict[str, Any]:
    """Return the row of a pair that hung or died."""
    return {"end_on": message, "end_off": message}


def main() -> None:
    """Measure the cases of the command line."""
    options = cases.options(__doc__, __file__, (*SKIPS, *PARTS), 120.0)
    quick, walls = options.quick, {name: skip.scenes for name, skip in SKIPS.items()}
    walls |= {name: (part.scene,) for name, part in PARTS.items()}
    only = options.only or (QUICK if quick else walls)
    keys = [
        (name, wall, number)
        for number in range(1, 2 if quick else ROUNDS + 1)
        for name in only
        for wall in walls[name][: 1 if quick else None]
    ]
    file = options.output / "data.csv"
    cases.run(keys, ("skip", "wall", "round"), partial(one, quick), lost, file, options.limit)


if __name__ == "__main__":
    main()
