"""Solve random accepted scenes of all laws with both solvers, and check every result from its archive alone.

    python studies/audit/run.py [--scenes 2000] [--seed 1] [--solver both] [-j N] [--time-limit 60]

Scene i of a seed depends on (seed, i) alone. Every run has a separate process with a limit of ``--time-limit`` seconds.
Its row is stored in ``scenes.csv`` and not repeated, unless with ``--fresh``: the same command resumes, and a larger
``--scenes`` extends. ``--csv`` stores the rows in another file and does not write the page; ``--from-data`` only writes
the page.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]

from audited import page  # noqa: E402
from audited.campaign import METHODS, jobs, kept, run  # noqa: E402

from studies.benchmarks.pages import machine, put_in  # noqa: E402

ROWS = HERE / "scenes.csv"
SECONDS = {"quasi_static": 0.4, "explicit": 0.9}
"""Mean processor time of a run with its checks (s): see the page."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=2000, help="number of scenes (2000)")
    parser.add_argument("--seed", type=int, default=1, help="from which the scenes follow (1)")
    parser.add_argument("--solver", choices=(*METHODS, "both"), default="both")
    parser.add_argument("-j", "--processes", type=int, default=1, help="side by side (1)")
    parser.add_argument("--time-limit", type=float, default=60.0, help="seconds that one run may take (60)")
    parser.add_argument("--csv", type=Path, default=ROWS, help="where rows are kept")
    parser.add_argument("--fresh", action="store_true", help="forget what is kept")
    parser.add_argument("--from-data", action="store_true", help="only make the page")
    options = parser.parse_args()
    if options.fresh:
        options.csv.unlink(missing_ok=True)
    wanted = jobs(options.seed, options.scenes, METHODS if options.solver == "both" else (options.solver,))
    if not options.from_data:
        known = kept(options.csv)
        left = [job for job in wanted if job not in known]
        minutes = sum(SECONDS[job.solver] for job in left) / 60 / options.processes
        most = options.time_limit * len(left) / 60 / options.processes
        print(
            f"{len(left)} of {len(wanted)} runs are left: about {minutes:.0f} minutes, at most {most:.0f}",
            file=sys.stderr,
        )
        try:
            run(wanted, options.csv, options.time_limit, options.processes)
        except KeyboardInterrupt:
            print("stopped; the same command resumes", file=sys.stderr)
            return 130
    rows = page.read(options.csv)
    print(page.in_a_word(rows))
    if options.csv == ROWS:
        put_in(HERE / "README.md", page.text(rows) + f"\n\nMeasured on {machine()}.")
    return int((rows["silent"] != "").any() or rows["outcome"].isin(("traceback", "died")).any())


if __name__ == "__main__":
    sys.exit(main())
