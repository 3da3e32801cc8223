"""Cost estimates: counted from the description alone, and near what is built."""

import math
import time
import tracemalloc

import pytest

from damagepred import Limits, Scene, Study, solve
from damagepred.assembly import wall_cost, wall_model
from damagepred.campaign.settings import StudySettings
from damagepred.errors import InputError, TimeLimitError

WALLS = {
    "solid": {},
    "dpc": {"dpc": {}},
    "stack": {"wall": {"bond": "stack"}},
    "window": {"opening": [{"x": 2.4, "y": 0.9, "width": 0.96, "height": 1.2}]},
    "dry": {"joint": {"tensile_strength": 0.0, "cohesion": 0.0}},
    "mound": {"movement": {"shape": "mound"}, "footing": {"segment_length": 0.05}},
    "deformable": {"wall": {"length": 2.0, "height": 0.6}, "solver": {"blocks": "deformable"}},
    "footing": {"wall": {"length": 2.0, "height": 0.6}, "solver": {"footing": "deformable"}},
}


@pytest.mark.parametrize("name", WALLS)
def test_counts(name: str) -> None:
    scene = Scene.from_dict(WALLS[name])
    model, cost = wall_model(scene), wall_cost(scene)
    assert cost.blocks == pytest.approx(model.n_blocks, rel=0.15)
    most = 1.5 if model.mesh is None else 3.0
    assert 1.0 / most < cost.contacts / model.n_contacts < most
    zones = 0 if model.mesh is None else len(model.mesh.zones)
    assert cost.zones == pytest.approx(zones, rel=0.6)


COSTLY = {
    "long": {"wall": {"length": 1000.0}},
    "brick of a millimetre": {"wall": {"block_length": 1e-3, "block_height": 1e-3}},
    "increments": {"movement": {"increments": 10**9}},
    "cycles": {"solver": {"method": "explicit", "ramp_cycles": 10**12}},
    "zones": {"solver": {"blocks": "deformable", "zone_size": 1e-6}},
    "footing of zones": {"solver": {"footing": "deformable", "zone_size_footing": 1e-6}},
    "segments": {
        "wall": {"length": 1000.0, "height": 0.3},
        "movement": {"shape": "mound"},
        "footing": {"segment_length": 1e-3},
    },
    "time": {"dynamics": {"duration": 1e9}},
    "outputs": {"dynamics": {"outputs": 10**9}},
}


@pytest.mark.parametrize("name", COSTLY)
@pytest.mark.timeout(30)
def test_costly_walls_are_refused_before_they_are_built(name: str) -> None:
    scene = Scene.from_dict(COSTLY[name])
    tracemalloc.start()
    began = time.perf_counter()
    try:
        for refused in (lambda: solve(scene), lambda: Study(StudySettings(scene=scene))):
            with pytest.raises(InputError, match="would take about") as found:
                refused()
            assert "\n" not in str(found.value)
        assert time.perf_counter() - began < 1.0
        assert tracemalloc.get_traced_memory()[1] < 5e6
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("value", [0, -1, math.nan, "4 GB", True, None])
def test_limits_are_numbers(value: object) -> None:
    with pytest.raises(InputError, match="memory"):
        Limits(memory=value)


@pytest.mark.parametrize("solver", ["quasi_static", "explicit"])
def test_a_wall_that_takes_too_long(solver: str) -> None:
    scene = Scene.from_dict({"wall": {"length": 1.2, "height": 0.6}, "solver": {"method": solver}})
    wait = lambda step: time.sleep(0.9)  # noqa: E731
    with pytest.raises(TimeLimitError, match="longer than its time limit"):
        solve(scene, limits=Limits(time=0.8), on_step=wait)
    ds = solve(scene, limits=Limits(time=0.8), on_step=wait, on_failure="return")
    assert ds.attrs["status"] == "failed"
    assert "time limit" in ds.attrs["status_message"]


def test_a_run_in_time_that_takes_too_long() -> None:
    scene = Scene.from_dict({"wall": {"length": 0.72, "height": 0.3}, "dynamics": {"duration": 0.2, "outputs": 4}})
    with pytest.raises(TimeLimitError):
        solve(scene, limits=Limits(time=0.2), on_step=lambda step: time.sleep(0.3))
