"""The same dry walls in damagepred and in other public solvers: time to equilibrium, and the results.

    python studies/benchmarks/beside_others/run.py                  everything
    python studies/benchmarks/beside_others/run.py --quick --output FOLDER     our side of the smallest wall, seconds
    python studies/benchmarks/beside_others/run.py --solvers pymunk --cases settling --sizes 5x6

The other solvers run in separate environments, which ``environments.py`` makes where they are missing.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from studies.benchmarks import cases as campaign
from studies.benchmarks.beside_others import environments, ours, summary
from studies.benchmarks.beside_others.cases import CASES, SIZES, SIZES_OF, Case
from studies.benchmarks.beside_others.record import Wall
from studies.benchmarks.beside_others.settings import OURS, WIDTH, described, our_solver, settings_of

HERE = Path(__file__).resolve().parent
ENVIRONMENTS = "DAMAGEPRED_BENCHMARK_ENVIRONMENTS"
"""Variable of the environment that names the folder of the other solvers' environments."""
LIMIT = 60.0
"""Processor time of one run of another solver (s)."""
REPEATS, ENOUGH = 10, 0.5
"""Times that a wall is solved which takes less than this in all (s): short times are noisy, and the least counts."""

Found = dict[str, Any]


def repeated(solve: Callable[[], Found]) -> Found:
    """Solve repeatedly; return the first result with the least times, level by level."""
    found = [solve()]
    while len(found) < REPEATS and sum(f.get("seconds", ENOUGH) for f in found) < ENOUGH:
        found.append(solve())
    if "settled" not in found[0]:
        return found[0]
    times = np.array([f["settled"] for f in found if "settled" in f], dtype=float)
    least = [None if np.isnan(t).all() else float(np.nanmin(t)) for t in times.T]
    return {**found[0], "build": min(f["build"] for f in found), "settled": least}


def other(solver: str, case: Case, settings: dict[str, Any]) -> Found:
    """Run a case in another solver's environment; return the answer of its script, or the reason why there is none."""
    folder = Path(os.environ.get(ENVIRONMENTS, environments.default_folder()))
    with tempfile.TemporaryDirectory() as place:
        case_file, answer = Path(place) / "case.json", Path(place) / "answer.json"
        case_file.write_text(json.dumps(case), encoding="utf-8")
        script = [str(environments.python_of(solver, folder)), str(HERE / f"in_{solver}.py")]
        command = [*script, str(case_file), json.dumps({**settings, "limit": LIMIT}), str(answer)]
        done = subprocess.run(
            command, env=environments.variables(solver, folder), capture_output=True, cwd=place, check=False
        )
        if not answer.exists():
            words = done.stderr.decode(errors="replace").strip().splitlines() or [f"exit code {done.returncode}"]
            return {"note": words[-1][:200]}
        found = json.loads(answer.read_text(encoding="utf-8"))
    return found | ({"settled": found["settled"]["seconds"]} if "settled" in found else {})


def own(solver: str, case: Case, settings: dict[str, Any]) -> Found:
    """Solve a case by one of our solvers."""
    others = {name: value for name, value in settings.items() if name != "increments"}
    chosen = our_solver(solver, others)
    if case["name"] == "tilt":
        return ours.push(case, chosen)
    found = ours.solve(case, chosen, settings.get("increments", ours.INCREMENTS))
    reached = min(found["residual"], chosen.tolerance_used)
    return {**found, "settled": [found["seconds"] if level >= reached else None for level in case["levels"]]}


def limit_of(case: Case) -> Found:
    """Return the load factor of limit analysis by linear programming, with dilatant joints."""
    from tests.verification.limit_analysis import collapse_factor

    wall = Wall(case)
    blocks = [[tuple(c) for c in corners] for corners in [*case["blocks"], *case["ground"]]]
    count = len(blocks)
    dead, live = np.zeros((count, 3)), np.zeros((count, 3))
    dead[: len(wall.mass), 1], live[: len(wall.mass), 0] = -wall.weight, wall.weight
    began = time.process_time()
    factor = collapse_factor(blocks, set(range(len(wall.mass), count)), case["friction"], dead, live)
    return {"low": factor, "high": factor, "seconds": time.process_time() - began}


def solved(name: str, size: str, solver: str, words: str) -> Found:
    """Return the result of a case by a solver with settings, which are named by words."""
    case = CASES[name](size)
    settings = next(s for s in settings_of(solver, name, size) if described(s) == words)
    if solver == "limit analysis":
        return limit_of(case)
    if solver in OURS:
        return repeated(lambda: own(solver, case, settings))
    bracket = {"bracket": [0.0, 1.0], "width": WIDTH} if name == "tilt" else {}
    return repeated(lambda: other(solver, case, settings | bracket))


def one(name: str, size: str, solver: str, words: str) -> dict[str, Any]:
    """Return the row of a run."""
    return summary.row_of(CASES[name](size), solver, words, solved(name, size, solver, words))


def lost(key: tuple[Any, ...], message: str) -> dict[str, Any]:
    """Return the row of a run that hung or died."""
    name, size, solver, words = key
    return summary.row_of(CASES[name](size), solver, words, {"note": message})


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    every = [*OURS, "limit analysis", *environments.SOLVERS]
    parser.add_argument("--solvers", nargs="+", choices=every, default=every)
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=list(CASES))
    parser.add_argument("--sizes", nargs="+", choices=list(SIZES), default=list(SIZES))
    parser.add_argument("--quick", action="store_true", help="only our solvers, the smallest wall, not pushed")
    parser.add_argument("--output", type=Path, default=HERE, help="folder of the data")
    options = parser.parse_args(arguments)
    if options.quick:
        options.solvers, options.cases, options.sizes = list(OURS), ["settling", "gap"], ["5x6"]
    options.output.mkdir(parents=True, exist_ok=True)
    keys = [
        (name, size, solver, described(settings))
        for size, name in itertools.product(options.sizes, options.cases)
        if size in SIZES_OF[name]
        for solver in options.solvers
        for settings in settings_of(solver, name, size)
    ]
    file = options.output / "runs.csv"
    left = {key[2] for key in keys if key not in campaign.keys_in(file, summary.KEY)}
    for solver in left & set(environments.SOLVERS):
        environments.make_ready(solver, Path(os.environ.get(ENVIRONMENTS, environments.default_folder())))
    for solver, name in itertools.product(left & set(OURS), ("settling", "gap")):  # compiles
        own(solver, CASES[name]("5x6"), {})
    campaign.run(keys, summary.KEY, one, lost, file, REPEATS * (8 * LIMIT + 60), digits=6)


if __name__ == "__main__":
    main()
