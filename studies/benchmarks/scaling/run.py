"""Growth of time and memory of a path and a study with blocks, contacts, zones, increments and samples.

    python studies/benchmarks/scaling/run.py [--grows blocks ...] [--rounds 1] [--limit 200] [--budget 3000]

Each case runs in a separate process that ends after ``--limit`` seconds of processor time. Cases larger than one that
exceeded the limit are not run, and both are listed. Every run is a row of ``data.csv``, written at once: the same
command resumes an interrupted one. ``--rounds 2`` runs every case once more, after all others, so that medians are over
different times of day.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from studies.benchmarks.pages import keep_rows, kept_rows
from studies.benchmarks.scaling.cases import GROWING, QUICK, Case, all_cases
from studies.benchmarks.scaling.one import alone

HERE = Path(__file__).resolve().parent

LIMIT = 200.0
"""Limit of processor time of a case (s)."""
FINE = ("complete", "collapsed")
Row = dict[str, Any]


def run_one(case: Case, limit: float) -> Row:
    """Run a case in a separate process; return its measurements within the limit (s)."""
    command = [sys.executable, str(HERE / "run.py"), "--one", *map(str, case), "--limit", str(limit)]
    began = time.perf_counter()
    done = subprocess.run(command, capture_output=True, check=False)
    row: Row = {**case._asdict()}
    for line in done.stdout.decode().splitlines():
        try:
            row |= json.loads(line)
        except json.JSONDecodeError:  # cut off by the limit
            continue
    row["clock"] = time.perf_counter() - began
    if "seconds" not in row:
        late = done.returncode < 0
        row["end"] = "time-out" if late else "failed"
        trouble = done.stderr.decode(errors="replace").strip()[-300:]
        row["message"] = f"more than {limit:g} s" if late else row.get("message") or trouble
    return row


def run_all(curves: list[list[Case]], data: Path, rounds: int, limit: float, budget: float) -> bool:
    """Run cases that are not in the data, small ones first; return whether all were done within the budget."""
    began, rows = time.perf_counter(), kept_rows(data)
    for number in range(1, rounds + 1):
        done = {(r["grows"], r["curve"], r["size"]) for r in rows if r["round"] == number}
        stopped = {(r["grows"], r["curve"]) for r in rows if r["end"] not in FINE}
        for rank in range(max(map(len, curves))):
            for curve in curves:
                if rank >= len(curve) or tuple(curve[rank]) in done:
                    continue
                case = curve[rank]
                if case[:2] in stopped and number > 1:
                    continue  # once is enough
                if time.perf_counter() - began > budget:
                    return False
                row: Row = case._asdict()
                if case[:2] in stopped:
                    row |= {"end": "not run", "message": "a smaller case took too long"}
                else:
                    row = run_one(case, limit)
                    if row["end"] not in FINE:
                        stopped.add(case[:2])
                rows.append(row | {"round": number, "limit": limit})
                keep_rows(rows, data)
                took = f"{row['seconds']:.3g} s" if "seconds" in row else row["end"]
                print(f"{case.grows}, {case.curve}, {case.size:g}: {took}", file=sys.stderr, flush=True)
    return True


def main() -> int:
    """Run cases, or one case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--grows", nargs="+", choices=tuple(GROWING), help="quantities that grow (all)")
    parser.add_argument("--rounds", type=int, default=1, help="runs of each case (1)")
    parser.add_argument("--limit", type=float, default=LIMIT, help="processor time of a case (200 s)")
    parser.add_argument("--budget", type=float, default=1e6, help="start no case after this time (s)")
    parser.add_argument("--quick", action="store_true", help="a few small cases")
    parser.add_argument("--output", type=Path, default=HERE, help="folder of the data")
    parser.add_argument("--one", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        what, curve, size = options.one
        alone(Case(what, curve, float(size)), options.limit)
        return 0
    options.output.mkdir(parents=True, exist_ok=True)
    data = options.output / "data.csv"
    curves = [[case] for case in QUICK] if options.quick else all_cases(options.grows)
    print(f"{sum(map(len, curves))} cases, {options.rounds} times; hours if all of them", file=sys.stderr)
    if not run_all(curves, data, options.rounds, options.limit, options.budget):
        print("the budget is spent; the same command resumes", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
