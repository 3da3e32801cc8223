"""Run all solvers with extreme input and count the outcomes.

    python studies/benchmarks/stress/run.py [--family NAME] [--way NAME] [--fresh] [-j N]

Every case is solved in a separate process, within ``--limit`` seconds. Finished cases are stored in ``cases.csv`` and
not repeated, unless with ``--fresh``: the same command resumes an interrupted run. ``--quick`` runs every twentieth
case and stores nothing.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import pandas as pd

from studies.benchmarks.stress import summary
from studies.benchmarks.stress.campaign import jobs, run
from studies.benchmarks.stress.time_steps import SHARES, cracking, longer_steps

HERE = Path(__file__).resolve().parent

CASES, STEPS, CRACKS = (HERE / name for name in ("cases.csv", "time_steps.csv", "cracking.csv"))
EVERY = 20
"""The quick form runs every twentieth case."""


def time_steps() -> None:
    """Run the cases of the time step, and write their results."""
    rows = [
        {"share": share, "solver": name} | found.row()
        for share in SHARES
        for name, found in longer_steps(share).items()
    ]
    pd.DataFrame(rows).to_csv(STEPS, index=False, float_format="%.3g")
    pd.DataFrame(cracking()).to_csv(CRACKS, index=False, float_format="%.3g")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--family", action="append", default=[], help="only this family (repeat for more)")
    parser.add_argument("--way", action="append", default=[], help="only this solver, as 'explicit, rigid'")
    parser.add_argument("--limit", type=float, default=60.0, help="seconds that one case may take (60)")
    parser.add_argument(
        "-j", "--processes", type=int, default=2, help="number of processes (2): times are not the result"
    )
    parser.add_argument("--csv", type=Path, default=CASES, help="file of the rows")
    parser.add_argument("--fresh", action="store_true", help="delete the stored rows")
    parser.add_argument("--quick", action="store_true", help=f"every {EVERY}th case, storing nothing")
    options = parser.parse_args()
    wanted = jobs(options.family, options.way)
    if options.quick:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "cases.csv"
            run(wanted[::EVERY], file, options.limit, options.processes)
            rows = summary.read(file)
        print(summary.in_a_word(rows))
        return int(rows["verdict"].isin(["WRONG", "FAILED"]).any())
    if options.fresh:
        options.csv.unlink(missing_ok=True)
    if options.fresh or not CRACKS.exists():  # written last
        time_steps()
    print(f"{len(wanted)} runs, about half a second each", file=sys.stderr)
    run(wanted, options.csv, options.limit, options.processes)
    print(summary.in_a_word(summary.read(options.csv)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
