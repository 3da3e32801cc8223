"""Run all solvers with extreme input and count the outcomes.

    python studies/benchmarks/stress/run.py [--only FAMILY ...] [--limit 60] [--quick] [--output FOLDER]

Finished runs are stored in ``cases.csv`` and not repeated: the same command resumes. Times are not the result, so two
run at a time. ``--quick`` runs every twentieth.
"""

from __future__ import annotations

from functools import cache, partial
from typing import Any

import numpy as np

from studies.benchmarks import cases
from studies.benchmarks.stress import collapse, elastic, geometry, in_time, joints, summary
from studies.benchmarks.stress.case import WAYS, Case
from studies.benchmarks.stress.checks import judge

KEY = ("family", "case", "way")
EVERY = 20
"""The quick form runs every twentieth case."""


@cache
def all_cases() -> dict[tuple[str, str], Case]:
    """Return every case by family and name, in the order of the page."""
    listed = [case for part in (elastic, joints, collapse, geometry, in_time) for case in part.cases()]
    found = {(case.family, case.name): case for case in listed}
    if len(found) != len(listed):
        raise ValueError("two cases have one name")
    return found


def one(family: str, name: str, way: str) -> dict[str, Any]:
    """Do one job."""
    row = judge(all_cases()[family, name], way)
    if row["verdict"] in ("FAILED", "WRONG"):
        print(f"{family} | {name} | {way}: {row['verdict']} {row['message']}", flush=True)
    return row


def lost(_: tuple[Any, ...], message: str) -> dict[str, Any]:
    """Return the row of a job that hung or died."""
    return {"verdict": "FAILED", "by": "", "off": np.nan, "seconds": np.nan, "message": message}


def warm_up() -> None:
    """Compile all kernels, before workers are forked."""
    with np.errstate(all="ignore"):
        for way in WAYS:
            for key in (("proportion", "in proportion"), ("strengths", "both bonds wear")):
                judge(all_cases()[key], way)


def main() -> int:
    """Run the cases of the command line."""
    keys = [(*key, way) for key, case in all_cases().items() for way in case.ways]
    options = cases.options(__doc__, __file__, {key[0] for key in keys}, 60.0)
    keys = [key for key in keys if not options.only or key[0] in options.only][:: EVERY if options.quick else 1]
    campaign = partial(cases.run, processes=2, digits=3, every=50, before=warm_up)
    campaign(keys, KEY, one, lost, options.output / "cases.csv", options.limit)
    print(summary.in_a_word(summary.read(options.output / "cases.csv")))
    return 0


if __name__ == "__main__":
    main()
