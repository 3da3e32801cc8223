"""Solve many random walls that crack with the quasi-static solver, and count how their paths end.

    python studies/quasi_static_campaign/run.py --walls 500

Every wall follows from its number alone (``--first`` and ``--walls`` choose which), so that any of them can be solved
again by itself:

    python studies/quasi_static_campaign/run.py --first 37 --walls 1

``--law`` gives all joints of the same walls another law than the paper's: dilation, friction that falls when a joint
cracks, bonds that slip breaks, bonds that soften, or strength that a crack leaves.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import csv
import sys
import time
from concurrent.futures import TimeoutError as TooLate
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pebble import ProcessPool

from damagepred.assembly import Model, wall_geometry, wall_model
from damagepred.errors import ConvergenceError, DamagepredError, DivergenceError
from damagepred.scene import Dpc, Joint, Loads, Movement, Opening, Scene, Solver, Wall
from damagepred.solvers import Increment, solve_path

HERE = Path(__file__).resolve().parent
ENDS = ("complete", "collapsed", "not converged", "diverged", "not a number", "other error", "time-out")
FloatArray = NDArray[np.float64]


LAWS: dict[str, dict[str, Any]] = {
    "paper": {},
    "dilation": {"dilation": 0.1},
    "residual_friction": {"residual_friction": 0.35},
    "brittle_shear": {"brittle_shear": True},
    "softening": {"fracture_energy": 10.0},
    "residual_strength": {"residual_tensile_strength": 0.01e6, "residual_cohesion": 0.02e6},
}
"""Other laws of the joints, by name."""


def random_wall(number: int, tolerance: float | None = None, law: str = "paper") -> tuple[Scene, dict[str, FloatArray]]:
    """Return a wall and the strengths of its joints, both from its number alone."""
    rng = np.random.default_rng([2026, number])
    with_dpc, with_window, dishing = rng.random(3) < 0.5
    kind = "dishing" if dishing else "doming"
    wall = Wall(
        length=3.0,
        height=1.2,
        block_length=float(rng.choice([0.24, 0.3, 0.4])),
        block_height=float(rng.choice([0.1, 0.12, 0.15])),
    )
    opening: tuple[Opening, ...] = ()
    if with_window:
        width, sill = float(rng.uniform(0.5, 1.2)), float(rng.choice([0.3, 0.6]))
        top = float(rng.choice([0.9, 1.2]))
        opening = (Opening(x=round(float(rng.uniform(0.4, 2.6 - width)), 3), y=sill, width=width, height=top - sill),)
    scene = Scene(
        title=f"campaign wall {number}",
        wall=wall,
        joint=Joint(friction=float(np.clip(rng.normal(0.75, 0.1), 0.4, 1.1)), **LAWS[law]),
        dpc=Dpc(course=int(rng.integers(1, 3)), friction=float(rng.uniform(0.3, 0.7))) if with_dpc else None,
        opening=opening,
        movement=Movement(
            kind=kind,
            central_deflection=float(rng.uniform(0.010, 0.020)),
            increments=int(rng.integers(10, 21)),
            shape=rng.choice(["three_loads", "parabola"]),
        ),
        loads=Loads(roof=float(rng.choice([0.0, 1500.0, 6000.0]))),
        solver=Solver(method="quasi_static", tolerance=tolerance),
    )
    strength = rng.uniform(0.05e6, 0.45e6)
    joints = len(wall_geometry(scene).joints.kind)
    sigma = np.sqrt(np.log(1.0 + 0.3**2))
    spread = rng.lognormal(-0.5 * sigma**2, sigma, size=(2, joints))
    return scene, {"joint.tensile_strength": strength * spread[0], "joint.cohesion": 0.85 * strength * spread[1]}


def imbalance(model: Model, step: Increment) -> float:
    """Return the largest unbalanced force over the mean block weight, from the contact stresses alone."""
    face, n = model.interfaces, model.n_blocks
    normal = np.column_stack((face.normal_x, face.normal_y))
    tangent = np.column_stack((face.normal_y, -face.normal_x))
    where = np.stack((face.x, face.y), axis=-1)[:, None] + face.contact_offset[..., None] * tangent[:, None]
    pull = step.normal_stress[..., None] * normal[:, None] + step.shear_stress[..., None] * tangent[:, None]
    pull = pull * face.contact_area[..., None]
    centre = np.column_stack((np.append(model.blocks.x, 0.0), np.append(model.blocks.y, 0.0)))
    force = np.zeros((n + 1, 3))
    force[:n] = model.supports.load.reshape(n, 3)
    for block, sign in ((face.block_a, 1.0), (face.block_b, -1.0)):
        arm = where - centre[block][:, None]
        turn = arm[..., 0] * pull[..., 1] - arm[..., 1] * pull[..., 0]
        np.add.at(force, block, sign * np.column_stack((pull.sum(axis=1), turn.sum(axis=1))))
    force[:n, 2] /= np.sqrt(model.blocks.polar / model.blocks.area)
    return float(np.abs(force[:n]).max() / model.mean_block_weight)


def solve_wall(number: int, tolerance: float | None = None, law: str = "paper") -> dict[str, Any]:
    """Solve one wall; return what is known of its path."""
    scene, fields = random_wall(number, tolerance, law)
    model = wall_model(scene, fields)
    row: dict[str, Any] = {
        "wall": number, "blocks": model.n_blocks, "dpc": scene.dpc is not None, "window": bool(scene.opening),
        "kind": scene.movement.kind, "increments": scene.movement.increments, "reached": -1, "end": "complete",
        "residual": 0.0, "residual_from_stresses": 0.0, "cracked": 0, "steps": 0, "time": 0.0, "message": "",
    }  # fmt: skip
    start = time.perf_counter()
    try:
        for step in solve_path(model, scene.solver, scene.movement.increments):
            row["reached"], row["steps"] = step.number, row["steps"] + step.cycles
            if step.collapsed:
                row["end"] = "collapsed"
                break
            row["cracked"] = int((step.state == 1).sum())
            row["residual"] = max(row["residual"], step.unbalanced_force_ratio)
            row["residual_from_stresses"] = max(row["residual_from_stresses"], imbalance(model, step))
            if not (np.isfinite(step.displacement).all() and np.isfinite(step.normal_stress).all()):
                row["end"] = "not a number"
                break
    except DamagepredError as error:
        kinds = {ConvergenceError: "not converged", DivergenceError: "diverged"}
        row["end"], row["message"] = kinds.get(type(error), "other error"), str(error)
    except Exception as error:
        row["end"], row["message"] = "other error", f"{type(error).__name__}: {error}"
    row["time"] = time.perf_counter() - start
    return row


def run(numbers: range, processes: int, limit: float, tolerance: float | None, law: str) -> list[dict[str, Any]]:
    """Solve walls side by side, each within a time limit."""
    rows = []
    solve_wall(numbers[0], tolerance, law)  # compiled once for all
    with ProcessPool(max_workers=processes) as pool:
        jobs = [(n, pool.schedule(solve_wall, args=[n, tolerance, law], timeout=limit)) for n in numbers]
        for done, (number, job) in enumerate(jobs, start=1):
            try:
                row = job.result()
            except TooLate:
                row = {"wall": number, "end": "time-out", "time": limit}
            except Exception as error:  # a worker that died
                row = {"wall": number, "end": "other error", "message": f"{type(error).__name__}: {error}"}
            rows.append(row)
            if row["end"] not in ("complete", "collapsed"):
                print(f"wall {number}: {row['end']}. {row.get('message', '')}", flush=True)
            if done % 10 == 0:
                print(f"{done} of {len(jobs)}", file=sys.stderr, flush=True)
    return rows


def table(rows: list[dict[str, Any]]) -> str:
    """Return what came out, as text."""
    solved = [r for r in rows if r["end"] in ("complete", "collapsed")]
    seconds = np.array([r["time"] for r in rows if "time" in r])
    lines = [f"{'end':<16}{'walls':>8}"]
    lines += [f"{end:<16}{sum(r['end'] == end for r in rows):>8}" for end in ENDS]
    lines.append(f"reached the end or a collapse: {len(solved)} of {len(rows)} ({len(solved) / len(rows):.1%})")
    if solved:
        lines.append(f"worst residual: {max(r['residual'] for r in solved):.2e} block weights as reported,")
        lines.append(
            f"                {max(r['residual_from_stresses'] for r in solved):.2e} from the contact stresses"
        )
    lines.append(
        f"time per wall: median {np.median(seconds):.2f} s, 95 % {np.quantile(seconds, 0.95):.2f} s, "
        f"longest {seconds.max():.2f} s"
    )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--walls", type=int, default=500, help="how many (500)")
    parser.add_argument("--first", type=int, default=0, help="number of the first (0)")
    parser.add_argument("--processes", type=int, default=2, help="side by side (2)")
    parser.add_argument("--limit", type=float, default=120.0, help="seconds that one wall may take (120)")
    parser.add_argument("--tolerance", type=float, default=None, help="block weights (the solver's own)")
    parser.add_argument("--law", choices=LAWS, default="paper", help="law of the joints (paper)")
    parser.add_argument("--csv", type=Path, default=HERE / "results" / "walls.csv", help="one line for each wall")
    options = parser.parse_args()
    numbers = range(options.first, options.first + options.walls)
    rows = run(numbers, options.processes, options.limit, options.tolerance, options.law)
    options.csv.parent.mkdir(parents=True, exist_ok=True)
    with options.csv.open("w", newline="", encoding="utf-8") as file:
        columns = max(rows, key=len)
        writer = csv.DictWriter(file, fieldnames=list(columns))
        writer.writeheader()
        writer.writerows(rows)
    print(table(rows))


if __name__ == "__main__":
    main()
