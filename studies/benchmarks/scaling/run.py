"""Growth of time and memory of a path with blocks, contacts, zones and increments.

    python studies/benchmarks/scaling/run.py [--only blocks ...] [--limit 100] [--quick] [--output FOLDER]

Cases larger than one that exceeded the limit are not run, and both are listed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from studies.benchmarks import cases as campaign
from studies.benchmarks.scaling.cases import GROWING, Case, all_cases
from studies.benchmarks.scaling.measure import measure, warm_up

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
    """Run cases, small ones first; what they need is compiled before processes are forked."""

    def ready() -> None:
        for case in {case[:2]: case for case in cases}.values():
            warm_up(case)

    campaign.run(cases, Case._fields, measure, lost, data, limit, fresh_process=True, leave_out=beyond, before=ready)


if __name__ == "__main__":
    options = campaign.options(__doc__, __file__, GROWING, 100.0)
    asked = [case for case in all_cases() if not options.only or case.grows in options.only]
    small = [case for case in asked if case[:2] == ("blocks", "quasi-static, dpc")][:2]
    run_all(small if options.quick else asked, options.output / "data.csv", options.limit)
