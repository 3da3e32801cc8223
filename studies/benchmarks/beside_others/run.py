"""The same dry walls in damagepred and in other public solvers: time to equilibrium, and the results.

    python studies/benchmarks/beside_others/run.py                  everything, in pieces (about an hour)
    python studies/benchmarks/beside_others/run.py --quick --output FOLDER     our side of the smallest wall, seconds
    python studies/benchmarks/beside_others/run.py --solvers pymunk --cases settling --sizes 5x6

The other solvers run in separate environments, which ``environments.py`` makes where they are missing. Runs that are in
the data are not repeated, unless ``--again`` is given.
"""

from __future__ import annotations

import argparse
import itertools
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from damagepred.scene import Solver
from studies.benchmarks.beside_others import environments, ours, summary
from studies.benchmarks.beside_others.cases import CASES, SIZES, SIZES_OF, Case
from studies.benchmarks.beside_others.record import Wall
from studies.benchmarks.beside_others.settings import OURS, WIDTH, described, our_solver, settings_of
from studies.benchmarks.pages import replace_rows

HERE = Path(__file__).resolve().parent

RUNS, BASE, MOVED = "runs.csv", "base.csv", "moved.csv"


def other_repeated(repeats: int, *of_one: Any) -> dict[str, Any]:
    """Run a case in another solver's environment; the least of some times, level by level."""
    found = repeated(lambda: other(*of_one), repeats)
    if "settled" not in found[0]:
        return found[0]
    times = np.array([f["settled"]["seconds"] for f in found if "settled" in f], dtype=float)
    least = [None if np.isnan(t).all() else float(np.nanmin(t)) for t in times.T]
    return {**found[0], "build": min(f["build"] for f in found), "settled": {"seconds": least}}


def other(solver: str, case: Case, settings: dict[str, Any], limit: float, folder: Path) -> dict[str, Any]:
    """Run a case in another solver's environment; return the answer of its script, or the reason why there is none."""
    with tempfile.TemporaryDirectory() as place:
        case_file, answer = Path(place) / "case.json", Path(place) / "answer.json"
        case_file.write_text(json.dumps(case), encoding="utf-8")
        command = [str(environments.python_of(solver, folder)), str(HERE / f"in_{solver}.py"), str(case_file)]
        command += [json.dumps({**settings, "limit": limit}), str(answer)]
        try:
            done = subprocess.run(
                command,
                env=environments.variables(solver, folder),
                capture_output=True,
                timeout=8 * limit + 60,
                cwd=place,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return {"note": "stopped by the clock"}
        if not answer.exists():
            words = done.stderr.decode(errors="replace").strip().splitlines() or [f"exit code {done.returncode}"]
            return {"note": words[-1][:200]}
        found = json.loads(answer.read_text(encoding="utf-8"))
    if "looks" in found:
        found["residual"], found["seconds"] = found["looks"][-1][2], found["looks"][-1][0]
    return found


def repeated(solve: Callable[[], dict[str, Any]], repeats: int, enough: float = 0.5) -> list[dict[str, Any]]:
    """Solve repeatedly, up to a number of times or a total time (s): short times are noisy."""
    found = [solve()]
    while len(found) < repeats and sum(f.get("seconds", enough) for f in found) < enough:
        found.append(solve())
    return found


def own(solver: Solver, case: Case, repeats: int, increments: int = ours.INCREMENTS) -> dict[str, Any]:
    """Solve a case by one of our solvers; the least of some times."""
    found = repeated(lambda: ours.solve(case, solver, increments), 5 * repeats)  # others are tried with more settings
    least = min(found, key=lambda f: f["seconds"])
    reached = least["residual"]
    times = [least["seconds"] if level >= min(reached, solver.tolerance_used) else None for level in case["levels"]]
    return {**least, "build": min(f["build"] for f in found), "settled": {"seconds": times}}


def solved_by_us(solver: str, settings: dict[str, Any], case: Case, repeats: int) -> dict[str, Any]:
    """Solve a case by one of our solvers with given settings."""
    others = {name: value for name, value in settings.items() if name != "increments"}
    chosen = our_solver(solver, others)
    if case["name"] == "tilt":
        return push_ours(chosen, case, 1.5)
    return own(chosen, case, repeats, settings.get("increments", ours.INCREMENTS))


def flat(found: dict[str, Any]) -> dict[str, Any]:
    settled = found.get("settled")
    return {**found, "settled": settled["seconds"]} if settled else found


def store(folder: Path, case: Case, solver: str, words: str, found: dict[str, Any]) -> None:
    """Put a run into the data."""
    found = flat(found)
    key = {"case": case["name"], "size": case["size"], "solver": solver, "settings": words}
    replace_rows(pd.DataFrame([summary.row_of(case, solver, words, found)]), folder / RUNS, summary.KEY)
    if "displacement" not in found:
        return
    wall, moved = Wall(case), np.array(found["displacement"])
    rows = pd.DataFrame({"x": wall.centre[wall.lowest, 0], "force": found["base"]})
    replace_rows(rows.assign(**key)[[*key, *rows]], folder / BASE, summary.KEY)
    if case["name"] == "gap":
        rows = pd.DataFrame(np.round(np.column_stack((1e3 * moved[:, :2], moved[:, 2])), 6), columns=["x", "y", "turn"])
        rows.insert(0, "block", range(len(rows)))
        replace_rows(rows.assign(**key)[[*key, *rows]], folder / MOVED, summary.KEY)


def known(folder: Path) -> set[tuple[str, ...]]:
    path = folder / RUNS
    return set(pd.read_csv(path)[summary.KEY].itertuples(index=False, name=None)) if path.exists() else set()


def push_ours(solver: Solver, case: Case, top: float) -> dict[str, Any]:
    found, seconds = ours.collapse_factor(case, solver, top)
    width = 1e-3 if solver.method == "quasi_static" else top / 200
    return {"low": found, "high": found + width * found, "seconds": seconds}


def limit_of(case: Case) -> dict[str, Any]:
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


def pieces(options: argparse.Namespace) -> list[tuple[str, str, str, dict[str, Any]]]:
    """Return the runs asked for that are not known yet: case, size, solver, settings."""
    done = set() if options.again else known(options.output)
    return [
        (name, size, solver, settings)
        for size, name in itertools.product(options.sizes, options.cases)
        if size in SIZES_OF[name]
        for solver in options.solvers
        for settings in settings_of(solver, name, size)
        if (name, size, solver, described(settings)) not in done
    ]


def run(options: argparse.Namespace) -> None:
    """Run the selected cases that are not in the data."""
    left = pieces(options)
    others = sum(solver in environments.SOLVERS for _, _, solver, _ in left)
    print(f"{len(left)} runs, {others} of other solvers, each at most about {options.limit:g} s", file=sys.stderr)
    if any(solver in OURS for _, _, solver, _ in left):
        for method, name in itertools.product(OURS, ("settling", "gap")):  # compile
            own(our_solver(method, {}), CASES[name]("5x6"), 1)
    for name, size, solver, settings in left:
        case, words = CASES[name](size), described(settings)
        if solver == "limit analysis":
            found = limit_of(case)
        elif solver in OURS:
            found = solved_by_us(solver, settings, case, options.repeats)
        else:
            bracket = {"bracket": [0.0, 1.0], "width": WIDTH} if name == "tilt" else {}
            of_one = (solver, case, {**settings, **bracket}, options.limit, options.environments)
            found = other_repeated(options.repeats, *of_one)
        store(options.output, case, solver, words, found)
        print(
            f"{name} {size} {solver} {words}: {found.get('seconds', np.nan):.3g} s, residual "
            f"{found.get('residual', np.nan):.2g} {found.get('note', '')}",
            file=sys.stderr,
            flush=True,
        )


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    every = [*OURS, "limit analysis", *environments.SOLVERS]
    parser.add_argument("--solvers", nargs="+", choices=every, default=every)
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=list(CASES))
    parser.add_argument("--sizes", nargs="+", choices=list(SIZES), default=list(SIZES))
    parser.add_argument("--limit", type=float, default=60.0, help="seconds that one run of another may take (60)")
    parser.add_argument(
        "--repeats",
        type=int,
        default=10,
        help="times a wall is solved that takes below half a second; the least counts (10)",
    )
    parser.add_argument("--again", action="store_true", help="repeat runs that are in the data")
    parser.add_argument("--quick", action="store_true", help="only our solvers, the smallest wall, not pushed")
    parser.add_argument("--environments", type=Path, default=environments.default_folder(), help="where they are kept")
    parser.add_argument("--output", type=Path, default=HERE, help="folder of the data")
    options = parser.parse_args(arguments)
    if options.quick:
        options.solvers, options.cases, options.sizes, options.repeats = list(OURS), ["settling", "gap"], ["5x6"], 1
    options.output.mkdir(parents=True, exist_ok=True)
    for solver in set(options.solvers) & set(environments.SOLVERS):
        if not environments.works(solver, options.environments):
            environments.create(solver, options.environments)
    run(options)


if __name__ == "__main__":
    main()
