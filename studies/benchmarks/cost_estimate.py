"""The unit costs that walls' costs are estimated with before they are built, and how near the estimates come.

    python studies/benchmarks/cost_estimate.py

prints for each wall the measured time and memory beside the estimated ones, then the unit costs of this machine beside
those of ``damagepred.assembly.CostOptions``. One core, a minute or two.
"""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np
import pandas as pd

from damagepred import Scene, solve
from damagepred.assembly import CostOptions, wall_cost, wall_model
from damagepred.runtime.one_thread import one_blas_thread

SMALL = {"wall": {"length": 3.0, "height": 1.2}, "dpc": {}, "movement": {"increments": 5}}
WALLS: dict[str, dict[str, Any]] = {
    "quasi-static": SMALL | {"wall": {}, "movement": {}},
    "explicit": SMALL | {"solver": {"method": "explicit"}},
    "zones": SMALL | {"solver": {"blocks": "deformable"}},
    "in time": SMALL | {"dynamics": {"duration": 0.1, "outputs": 5}},
}
MATRIX = 1000
"""Rows of the matrices whose product tells the time of a floating-point operation."""


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Return the time of a call (s), and its result."""
    began = time.perf_counter()
    found = work()
    return time.perf_counter() - began, found


@one_blas_thread()
def main() -> None:
    """Print both tables."""
    a, rows = np.random.default_rng(0).standard_normal((MATRIX, MATRIX)), []
    here: dict[str, float] = {"flop_time": min(timed(lambda: a @ a)[0] for _ in range(5)) / (2 * MATRIX**3)}
    for name, tables in WALLS.items():
        scene = Scene.from_dict(tables)
        longer = scene.with_values({"wall.length": 1.01 * scene.wall.length})  # its geometry is not cached yet
        cost, _ = wall_cost(scene), solve(scene, on_failure="return")  # compiles
        build, model = timed(lambda: wall_model(longer))  # noqa: B023
        tracemalloc.start()
        solve(scene, on_failure="return")
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        run, ds = timed(lambda: solve(scene))  # noqa: B023
        rows.append((name, model.n_blocks, run, cost.time, peak / 1e6, cost.memory / 1e6))
        if name == "quasi-static":
            here |= {"block_time": build / model.n_blocks, "block_memory": peak / model.n_blocks}
            here["iterations"] = float(ds["newton_iterations"].sum()) / ds.sizes["increment"]
        if name == "explicit":
            here["contact_time"] = run / float(ds["cycles"].sum()) / model.n_contacts
            here["settling_cycles"] = float(ds["cycles"][1:].mean()) - scene.solver.ramp_cycles
    columns = ["wall", "blocks", "time (s)", "estimated", "memory (MB)", "estimated"]
    print(pd.DataFrame(rows, columns=columns).to_string(index=False, float_format="{:.3g}".format))
    costs = [(field.name, field.default, here.get(field.name)) for field in fields(CostOptions)]
    print(pd.DataFrame(costs, columns=["unit cost", "used", "measured"]).to_string(index=False))


if __name__ == "__main__":
    main()
