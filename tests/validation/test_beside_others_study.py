"""The comparison with other solvers: our side of it, what is kept of a run, and pymunk where it is installed."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

ROOM = Path(__file__).resolve().parents[2] / "studies" / "benchmarks" / "beside_others"
WEIGHT = 5 * 6 * 0.24 * 0.075 * 0.11 * 2000 * 9.81


@pytest.fixture
def room(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Let modules of the room be imported, and forgotten again."""
    monkeypatch.syspath_prepend(str(ROOM.parent))
    monkeypatch.syspath_prepend(str(ROOM))
    before = set(sys.modules)
    yield
    for name in set(sys.modules) - before:
        if str(ROOM.parent) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]


@pytest.mark.usefixtures("room")
def test_our_wall_stands_on_all_its_ground() -> None:
    import ours
    from cases import settling
    from settings import OURS, our_solver

    case = settling("5x6")
    for name in OURS:
        solver = our_solver(name, {})
        found = ours.solve(case, solver)
        assert found["residual"] < solver.tolerance_used
        assert found["base"].sum() == pytest.approx(WEIGHT, rel=1e-6)
        # uniform: the perpends carry nothing, and half bricks stand at the ends of every other course
        np.testing.assert_allclose(found["base"], WEIGHT / 5, rtol=1e-3)


@pytest.mark.usefixtures("room")
def test_blocks_over_dropped_ground() -> None:
    import ours
    from cases import gap
    from record import Wall
    from settings import our_solver
    from tables import on_dropped

    case = gap("5x6")
    found = ours.solve(case, our_solver("quasi_static", {}))
    inside = on_dropped(case, Wall(case))
    assert inside.tolist() == [False, True, True, True, False]
    # in the lowest course what lies over the dropped ground goes down with it, and leaves the rest to the neighbours
    np.testing.assert_allclose(found["displacement"][:5, 1][inside], -8e-3, atol=1e-4)
    assert 0 < found["base"][inside].sum() < 0.25 * WEIGHT
    assert found["base"].sum() == pytest.approx(WEIGHT, rel=1e-5)


@pytest.mark.usefixtures("room")
def test_when_a_run_has_settled() -> None:
    from cases import settling
    from record import HOLD, Record, Wall

    case = settling("5x6") | {"levels": [1e-1, 1e-3]}
    record = Record(case, limit=1.0)
    residuals = [1.0, 0.05, 0.5, 0.09, 0.01, *[1e-4] * HOLD]
    for i, residual in enumerate(residuals):
        record.seconds = 0.01 * i
        go_on = record.look(0.1 * (i + 1), residual, 0.0)
        assert go_on == (i < len(residuals) - 1)
    assert record.settled()["seconds"] == [0.03, 0.05]  # not at the dip before
    wall = Wall(case)
    falling = np.tile([0.0, -9.81e-3, 0.0], (len(wall.mass), 1))
    assert wall.from_velocity(falling, 1e-3) == pytest.approx(wall.weight.max() / wall.weight.mean())


@pytest.mark.usefixtures("room")
def test_the_committed_data() -> None:
    import tables

    runs = pd.read_csv(ROOM / "runs.csv")
    assert not runs.duplicated(tables.KEY).any()
    settled = runs[(runs["case"] == "settling") & (runs["residual"] < 1e-3)]
    assert {"quasi_static", "explicit", "pymunk", "lmgc90"} <= set(settled["solver"])
    np.testing.assert_allclose(settled["weight on the ground"], 1.0, atol=1e-3)
    # limit analysis takes joints to dilate: nothing stands beyond it
    falls = runs[runs["case"] == "tilt"].set_index(["size", "solver"])
    for size, part in falls.groupby("size"):
        bound = falls.loc[(size, "limit analysis"), "low"].item()
        ours = part[part.index.get_level_values("solver") == "quasi_static"]
        assert (ours["low"] <= 1.01 * bound).all()
        assert (ours["low"] >= 0.95 * bound).all()
    page = (ROOM / "README.md").read_text(encoding="utf-8")
    assert tables.text(runs) in page


@pytest.mark.usefixtures("room")
def test_pymunk_says_so_too(tmp_path: Path) -> None:
    pytest.importorskip("pymunk")
    import in_pymunk
    from cases import settling

    case = settling("5x6")
    found = in_pymunk.settle(case, {"dt": 1e-3, "iterations": 30}, limit=5.0)
    assert found["settled"]["seconds"][2] is not None
    assert np.sum(found["base"]) == pytest.approx(WEIGHT, rel=1e-3)
    json.dumps(found["looks"])
