"""Measure the time that each skip of the program saves, and the differences it makes.

    python studies/benchmarks/skips/run.py [--rounds 3] [--only condense half ...] [--budget 3000]

Each is turned off while the others stay at their defaults. Runs with and without alternate; times are processor times.
Every pair of runs is a row of ``data.csv``, written at once: the same command resumes an interrupted one. A round takes
some minutes.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from studies.benchmarks.pages import keep_rows, kept_rows
from studies.benchmarks.skips.measuring import compare
from studies.benchmarks.skips.scenes import SCENES, Known, smaller
from studies.benchmarks.skips.skips import SKIPS, Skip
from studies.benchmarks.skips.study_skips import PARTS

HERE = Path(__file__).resolve().parent

Row = dict[str, Any]
QUICK = ("condense", "half", "correct", "restart", "keep", "elastic start", "stop")
"""Skips of the quick form: none needs extra compiling."""


def pairs(only: list[str] | None, quick: bool) -> Iterator[tuple[str, str, Callable[[int, bool], Row]]]:
    """Yield every skip, each of its walls, and the function that measures it: round, small wall -> row."""
    for name, skip in SKIPS.items():
        if only is None or name in only:
            for scene in skip.scenes[:1] if quick else skip.scenes:
                yield name, scene, partial(of_wall, skip, SCENES[scene])
    for name, part in PARTS.items():
        if only is None or name in only:
            yield name, part.scene, part.measure


def of_wall(skip: Skip, scene: Callable[[], Known], number: int, small: bool) -> Row:
    """Measure a skip on a wall, or on a few of its bricks."""
    return compare(smaller(scene()) if small else scene(), skip, bool(number % 2))


def run_all(data: Path, rounds: int, only: list[str] | None, quick: bool, budget: float) -> bool:
    """Measure the cases that are not in the data; return whether all were done within the budget (s)."""
    began, rows = time.perf_counter(), kept_rows(data)
    done = {(r["skip"], r["wall"], r["round"]) for r in rows}
    ready: set[tuple[str, str]] = set()
    for number in range(1, rounds + 1):
        for name, scene, measure in pairs(only, quick):
            if (name, scene, number) in done:
                continue
            if time.perf_counter() - began > budget:
                return False
            if (name, scene) not in ready:
                measure(0, True)  # compiles, or loads what is compiled
                ready.add((name, scene))
            row = {"skip": name, "wall": scene, "round": number} | measure(number, quick)
            rows.append(row)
            keep_rows(rows, data)
            print(
                f"{name}, {scene}: {row.get('seconds_on')} and {row.get('seconds_off')} s", file=sys.stderr, flush=True
            )
    return True


def main() -> int:
    """Measure the cases of the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3, help="pairs of runs with and without (3)")
    parser.add_argument("--only", nargs="+", choices=(*SKIPS, *PARTS), help="of these skips (all)")
    parser.add_argument("--budget", type=float, default=1e6, help="start no pair of runs after this time (s)")
    parser.add_argument("--quick", action="store_true", help="a few skips on small walls")
    parser.add_argument("--output", type=Path, default=HERE, help="folder of the data")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    only = list(QUICK) if options.quick and options.only is None else options.only
    data, rounds = options.output / "data.csv", 1 if options.quick else options.rounds
    if not run_all(data, rounds, only, options.quick, options.budget):
        print("the budget is spent; the same command resumes", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
