"""The unit costs that walls' costs are estimated with before they are built, and how near the estimates come.

    python studies/benchmarks/cost_estimate.py

prints for each wall the measured time and memory over the estimated ones, then the unit costs of this machine beside
those of ``damagepred.assembly.CostOptions``. One core, a minute or two.
"""

from __future__ import annotations

import time
import tracemalloc
from dataclasses import fields
from typing import Any

import numpy as np

from damagepred import Scene, solve
from damagepred.assembly import CostOptions, Model, wall_cost, wall_model
from damagepred.one_thread import one_blas_thread

SMALL = {"wall": {"length": 3.0, "height": 1.2}, "dpc": {}, "movement": {"increments": 5}}
WALLS: dict[str, dict[str, Any]] = {
    "quasi-static": SMALL | {"wall": {}, "movement": {}},
    "explicit": SMALL | {"solver": {"method": "explicit"}},
    "zones": SMALL | {"solver": {"blocks": "deformable"}},
    "in time": SMALL | {"dynamics": {"duration": 0.1, "outputs": 5}},
}
MATRIX = 1000
"""Rows of the matrices whose product tells the time of a floating-point operation."""


def seconds(work: Any, *arguments: Any) -> tuple[float, Any]:
    """Return the time of a call (s), and its result."""
    began = time.perf_counter()
    found = work(*arguments)
    return time.perf_counter() - began, found


@one_blas_thread()
def flop_time() -> float:
    """Return the time of a floating-point operation in a product of matrices (s)."""
    a = np.random.default_rng(0).standard_normal((MATRIX, MATRIX))
    return min(seconds(np.matmul, a, a)[0] for _ in range(5)) / (2 * MATRIX**3)


def build_and_measure(scene: Scene) -> tuple[Model, float, int]:
    """Return the model of a scene, the time to build it (s), and the peak memory while it is solved (bytes)."""
    solve(scene, on_failure="return")  # compiles
    longer = scene.with_values({"wall.length": 1.01 * scene.wall.length})  # its geometry is not cached yet
    build_time, model = seconds(wall_model, longer)
    tracemalloc.start()
    solve(scene, on_failure="return")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return model, build_time, peak


def main() -> None:
    """Print both tables."""
    measured: dict[str, float] = {"flop_time": flop_time()}
    print(f"{'wall':<14}{'blocks':>8}{'time (s)':>10}{'estimated':>11}{'memory (MB)':>13}{'estimated':>11}")
    for name, tables in WALLS.items():
        scene = Scene.from_dict(tables)
        cost = wall_cost(scene)
        model, build_time, peak = build_and_measure(scene)
        run_time, ds = seconds(solve, scene)
        print(
            f"{name:<14}{model.n_blocks:>8}{run_time:>10.2f}{cost.time:>11.2f}{peak / 1e6:>13.1f}"
            f"{cost.memory / 1e6:>11.1f}"
        )
        increments = ds.sizes["increment"]
        if name == "quasi-static":
            measured |= {"block_time": build_time / model.n_blocks, "block_memory": peak / model.n_blocks}
            measured["iterations"] = float(ds["newton_iterations"].sum()) / increments
        if name == "explicit":
            cycles = float(ds["cycles"].sum())
            measured["contact_time"] = run_time / cycles / model.n_contacts
            measured["settling_cycles"] = float(ds["cycles"][1:].mean()) - scene.solver.ramp_cycles
    print(f"\n{'unit cost':<30}{'used':>10}{'measured':>12}")
    for field in fields(CostOptions):
        here = f"{measured[field.name]:.2g}" if field.name in measured else "-"
        print(f"{field.name:<30}{field.default:>10g}{here:>12}")


if __name__ == "__main__":
    main()
