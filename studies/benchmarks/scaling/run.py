"""Growth of time and memory of a path with blocks, contacts, zones and increments.

    python studies/benchmarks/scaling/run.py [--grows blocks ...] [--limit 200] [--quick] [--output FOLDER]

Cases larger than one that exceeded the limit are not run, and both are listed.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from studies.benchmarks import cases as campaign
from studies.benchmarks.scaling.cases import GROWING, QUICK, Case, all_cases
from studies.benchmarks.scaling.measure import measure, warm_up

HERE = Path(__file__).resolve().parent
FINE = ("complete", "collapsed")


def lost(_: tuple[Any, ...], message: str) -> dict[str, Any]:
    """Return the row of a case that hung or died."""
    return {"end": "time-out" if "longer" in message else "failed", "message": message}


def beyond(key: tuple[Any, ...], rows: list[dict[str, Any]]) -> dict[str, Any] | None:
    """Return the row of a case that is larger than one that was not solved; None for others."""
    if any((row["grows"], row["curve"]) == key[:2] and row["end"] not in FINE for row in rows):
        return {"end": "not run", "message": "a smaller case took too long"}
    return None


def run_all(cases: list[Case], data: Path, limit: float) -> None:
    """Run cases, small ones first."""
    for case in {case[:2]: case for case in cases}.values():  # before processes are forked
        warm_up(case)
    campaign.run(cases, Case._fields, measure, lost, data, limit, fresh_process=True, leave_out=beyond)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--grows", nargs="+", choices=tuple(GROWING), help="quantities that grow (all)")
    parser.add_argument("--limit", type=float, default=200.0, help="time of a case (200 s)")
    parser.add_argument("--quick", action="store_true", help="a few small cases")
    parser.add_argument("--output", type=Path, default=HERE, help="folder of the data")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    run_all(QUICK if options.quick else all_cases(options.grows), options.output / "data.csv", options.limit)


if __name__ == "__main__":
    main()
