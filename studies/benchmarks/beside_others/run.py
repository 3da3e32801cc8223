"""The same dry walls in damagepred and in other public solvers: time to equilibrium, and the results.

    python studies/benchmarks/beside_others/run.py [--only SOLVER ...] [--limit 600] [--quick] [--output FOLDER]

The other solvers run in separate environments, which ``environments.py`` makes where they are missing. ``--quick`` is
our side of the smallest wall.
"""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from damagepred import Assembly
from damagepred.scene import BlockMaterial, Joint, Solver
from damagepred.solvers import solve_path
from studies import cases as campaign
from studies.benchmarks.beside_others import environments, summary
from studies.benchmarks.beside_others.cases import CASES, DATA, SIZES, Case, dry_wall
from studies.benchmarks.beside_others.record import Wall

HERE = Path(__file__).resolve().parent
LIMIT, LIMITS = 20.0, {"lmgc90": 100.0}
"""Processor time of one run of another solver (s): enough to show that it is ten, or 200 times slower."""
REPEATS, ENOUGH = 10, 0.5
"""Times that a wall is solved which takes less than this in all (s): short times are noisy, and the least counts."""
Found = dict[str, Any]
INCREMENTS = 20
"""Default number of increments of the ground's settlement."""
OURS = ("quasi_static", "explicit")


def assembly(case: Case) -> Assembly:
    """Return the wall of a case; its blocks come first, then the ground."""
    wall = Assembly(
        thickness=case["thickness"],
        gravity=(0.0, -case["gravity"]),
        joint=Joint(
            normal_stiffness=case["normal_stiffness"],
            shear_stiffness=case["shear_stiffness"],
            tensile_strength=0.0,
            cohesion=0.0,
            friction=case["friction"],
        ),
        block=BlockMaterial(
            elastic_modulus=case["elastic_modulus"], poisson_ratio=case["poisson_ratio"], density=case["density"]
        ),
    )
    for corners in case["blocks"]:
        wall.add_block(corners)
    for corners, drop in zip(case["ground"], case["drop"], strict=True):
        piece = wall.add_block(corners)
        wall.support(piece)
        if drop:
            wall.move(piece, y=-drop)
    return wall


def solve(case: Case, settings: Solver, increments: int = INCREMENTS) -> Found:
    """Return the results of a solver for a case: seconds, residual, displacements, base forces."""
    wall, began = Wall(case), time.process_time()
    model = assembly(case).build(settings)
    built, moves = time.process_time(), any(case["drop"])
    last = list(islice(solve_path(model, settings, increments), None if moves else 1))[-1]
    seconds = time.process_time() - built
    face, count = model.interfaces, len(wall.mass)
    on_ground, block = (face.block_a >= count) ^ (face.block_b >= count), np.minimum(face.block_a, face.block_b)
    force = -(last.normal_stress * face.contact_area).sum(axis=1) * np.abs(face.normal_y)
    return {
        "build": built - began,
        "seconds": seconds,
        "residual": last.residuals.unbalanced_force_ratio,
        "steps": last.counters.newton_iterations + last.counters.cycles,
        "base": np.array([force[on_ground & (block == b)].sum() for b in wall.lowest]),
        "displacement": last.displacement[:count],
    }


def settings_of(solver: str, case: str, size: str) -> list[Found]:
    """Return the settings a solver is tried with; the fastest of them counts at each residual."""
    asked = [
        one for one in DATA["settings"][solver] if one.get("only", case) == case and size in one.get("sizes", size)
    ]
    return [{name: value for name, value in one.items() if name not in ("only", "sizes")} for one in asked]


def described(settings: Found) -> str:
    """Return settings in one line."""
    told = (f"{name} {value:g}" if isinstance(value, float) else f"{name} {value}" for name, value in settings.items())
    return ", ".join(told) or "default"


def repeated(once: Callable[[], Found]) -> Found:
    """Solve repeatedly; return the first result with the least times, level by level."""
    found = [once()]
    while len(found) < REPEATS and sum(f.get("seconds", ENOUGH) for f in found) < ENOUGH:
        found.append(once())
    if "settled" not in found[0]:
        return found[0]
    times = np.array([f["settled"] for f in found if "settled" in f], dtype=float)
    least = [None if np.isnan(t).all() else float(np.nanmin(t)) for t in times.T]
    return {**found[0], "build": min(f["build"] for f in found), "settled": least}


def other(solver: str, case: Case, settings: Found) -> Found:
    """Run a case in another solver's environment; return the answer of its script, or the reason why there is none."""
    settings = {**settings, "limit": LIMITS.get(solver, LIMIT)}
    with tempfile.TemporaryDirectory() as place:
        case_file, answer = Path(place) / "case.json", Path(place) / "answer.json"
        case_file.write_text(json.dumps(case), encoding="utf-8")
        script = [str(environments.python_of(solver)), str(HERE / f"in_{solver}.py")]
        done = subprocess.run(
            [*script, str(case_file), json.dumps(settings), str(answer)],
            env=environments.variables(),
            capture_output=True,
            cwd=place,
            check=False,
        )
        if not answer.exists():
            words = done.stderr.decode(errors="replace").strip().splitlines() or [f"exit code {done.returncode}"]
            return {"note": words[-1][:200]}
        found: Found = json.loads(answer.read_text(encoding="utf-8"))
        return found


def own(solver: str, case: Case, settings: Found) -> Found:
    """Solve a case by one of our solvers."""
    settings = {"increments": INCREMENTS, **settings}
    increments = settings.pop("increments")
    chosen = Solver(method=solver, **{"blocks": "rigid", **settings})  # type: ignore[arg-type]
    found = solve(case, chosen, increments)
    reached = min(found["residual"], chosen.tolerance_used)
    return {**found, "settled": [found["seconds"] if level >= reached else None for level in case["levels"]]}


def solved(name: str, size: str, solver: str, words: str) -> Found:
    """Return the result of a case by a solver with settings, which are named by words."""
    case, settings = dry_wall(name, size), next(s for s in settings_of(solver, name, size) if described(s) == words)
    return repeated(lambda: (own if solver in OURS else other)(solver, case, settings))


def one(name: str, size: str, solver: str, words: str) -> dict[str, Any]:
    """Return the row of a run."""
    return summary.row_of(dry_wall(name, size), solver, words, solved(name, size, solver, words))


def lost(key: tuple[Any, ...], message: str) -> dict[str, Any]:
    """Return the row of a run that hung or died."""
    name, size, solver, words = key
    return summary.row_of(dry_wall(name, size), solver, words, {"note": message})


def main(arguments: list[str] | None = None) -> None:
    """Run the cases of the command line."""
    every = (*OURS, *environments.IMPORTED)
    options = campaign.options(__doc__, __file__, every, 600.0, arguments)
    keys = [
        (name, size, solver, described(settings))
        for name, size in itertools.product(CASES, SIZES)
        for solver in options.only or (OURS if options.quick else every)
        for settings in settings_of(solver, name, size)
        if not options.quick or size == "5x6"
    ]
    file = options.output / "runs.csv"
    left = {key[2] for key in keys if key not in campaign.keys_in(file, summary.KEY)}
    absent = {solver for solver in left & set(environments.IMPORTED) if not environments.made(solver)}

    def ready() -> None:
        for solver, name in itertools.product(left & set(OURS), CASES):
            own(solver, dry_wall(name, "5x6"), {})

    keys = [key for key in keys if key[2] not in absent]
    campaign.run(keys, summary.KEY, one, lost, file, options.limit, digits=6, before=ready)
    if absent:
        sys.exit(f"not installed, and not measured: {', '.join(sorted(absent))}")


if __name__ == "__main__":
    main()
