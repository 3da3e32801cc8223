"""The comparison with other solvers: damagepred's part, the record of a run, and pymunk where it is installed."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from damagepred.scene import Solver
from studies.benchmarks.beside_others import run, summary

ROOM = Path(__file__).resolve().parents[2] / "studies" / "benchmarks" / "beside_others"
WEIGHT = 5 * 6 * 0.24 * 0.075 * 0.11 * 2000 * 9.81


@pytest.mark.thorough
def test_damagepred_in_the_comparison(tmp_path: Path) -> None:
    run.main(["--quick", "--output", str(tmp_path)])
    runs = pd.read_csv(tmp_path / "runs.csv").set_index(["case", "solver", "settings"])
    for solver in run.OURS:
        assert runs.loc[("settling", solver, "default"), "residual"] < Solver(method=solver).tolerance_used
    np.testing.assert_allclose(runs["weight on the ground"], 1.0, atol=1e-4)
    settled, dropped = (run.solved(case, "5x6", "quasi_static", "default") for case in ("settling", "gap"))
    # uniform under its own weight: perpends carry nothing, and half bricks stand at the ends of every other course
    np.testing.assert_allclose(settled["base"], WEIGHT / 5, rtol=1e-3)
    # over the dropped ground the lowest course goes down with it, and leaves most of the weight to its neighbours
    np.testing.assert_allclose(dropped["displacement"][1:4, 1], -8e-3, atol=1e-4)
    carried = runs.loc["gap", "weight on what dropped"]
    assert ((carried > 0.09) & (carried < 0.25)).all()


def test_the_committed_data() -> None:
    runs = pd.read_csv(ROOM / "runs.csv")
    assert not runs.duplicated(summary.KEY).any()
    assert runs["version"].str.startswith("0.").all()
    settled = runs[(runs["case"] == "settling") & (runs["residual"] < 1e-3)]
    assert {"quasi_static", "explicit", "pymunk", "lmgc90"} <= set(settled["solver"])
    np.testing.assert_allclose(settled["weight on the ground"], 1.0, atol=1e-3)
