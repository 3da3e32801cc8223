"""Measure the time that each skip of the program saves, and the differences it makes.

    python studies/benchmarks/skips/run.py [--rounds 2] [--only condense half ...] [--quick] [--output FOLDER]

Each is turned off while the others stay at their defaults. Runs with and without alternate; times are processor times.
"""

from __future__ import annotations

import argparse
from functools import cache
from pathlib import Path
from typing import Any

from studies.benchmarks import cases
from studies.benchmarks.skips.measuring import compare
from studies.benchmarks.skips.scenes import SCENES, smaller
from studies.benchmarks.skips.skips import SKIPS
from studies.benchmarks.skips.study_skips import PARTS

HERE = Path(__file__).resolve().parent
QUICK = ("condense", "half", "correct", "restart", "keep", "elastic start", "stop")
"""Skips of the quick form: none needs extra compiling."""
LIMIT = 300.0
"""Time of a pair of runs (s)."""


def measure(name: str, wall: str, number: int, small: bool) -> dict[str, Any]:
    """Measure a skip on a wall, or on a few of its bricks."""
    if name in PARTS:
        return PARTS[name].measure(number, small)
    known = SCENES[wall]()
    return compare(smaller(known) if small else known, SKIPS[name], bool(number % 2))


@cache
def make_ready(name: str, wall: str) -> None:
    """Compile, or load what is compiled."""
    measure(name, wall, 0, True)


def one(name: str, wall: str, number: int, small: bool) -> dict[str, Any]:
    """Measure a skip in a round."""
    make_ready(name, wall)
    return measure(name, wall, number, small)


def whole(name: str, wall: str, number: int) -> dict[str, Any]:
    """Measure a skip on the whole wall."""
    return one(name, wall, number, False)


def part(name: str, wall: str, number: int) -> dict[str, Any]:
    """Measure a skip on a few bricks of the wall."""
    return one(name, wall, number, True)


def lost(_: tuple[Any, ...], message: str) -> dict[str, Any]:
    """Return the row of a pair that hung or died."""
    return {"end_on": message, "end_off": message}


def pairs(only: list[str], quick: bool) -> list[tuple[str, str]]:
    """Return every skip with each of its walls."""
    walls = {name: skip.scenes[:1] if quick else skip.scenes for name, skip in SKIPS.items()}
    walls |= {name: (one.scene,) for name, one in PARTS.items()}
    return [(name, wall) for name, own in walls.items() if name in only for wall in own]


def main() -> None:
    """Measure the cases of the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=2, help="pairs of runs with and without (2)")
    parser.add_argument("--only", nargs="+", choices=(*SKIPS, *PARTS), help="of these skips (all)")
    parser.add_argument("--quick", action="store_true", help="a few skips on small walls, one round")
    parser.add_argument("--output", type=Path, default=HERE, help="folder of the data")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    only = options.only or list(QUICK if options.quick else (*SKIPS, *PARTS))
    rounds = range(1, 2 if options.quick else options.rounds + 1)
    keys = [(*pair, number) for number in rounds for pair in pairs(only, options.quick)]
    work = part if options.quick else whole
    cases.run(keys, ("skip", "wall", "round"), work, lost, options.output / "data.csv", LIMIT)


if __name__ == "__main__":
    main()
