"""Random histories of random small walls: dissipation is never negative, and closed cycles make no energy."""

from collections.abc import Sequence

import numpy as np
import pytest

import damagepred
from damagepred import Scene
from tests.solvers.test_histories import energy_balance

pytestmark = pytest.mark.quick_cases()

FORMS = ("three_loads", "parabola", "arc", "mound")


def random_scene(seed: int) -> Scene:
    """Return a small wall, dry or bonded, with or without dpc and window, on a random closed history."""
    rng = np.random.default_rng(seed)
    shape = str(rng.choice(FORMS))
    size = "surface_movement" if shape == "mound" else "central_deflection"
    ends = rng.uniform(-1.0, 1.0, rng.integers(2, 5)) * 10 ** rng.uniform(-3.5, -2.2)
    stages = [
        {"kind": "doming" if end > 0 else "dishing", size: abs(end), "increments": int(rng.integers(1, 4))}
        for end in [*ends, 0.0]
    ]
    largest = float(np.abs(ends).max())
    joint = {"friction": rng.uniform(0.3, 1.0), "tensile_strength": 0.0, "cohesion": 0.0}
    if rng.random() < 0.5:
        cohesion = 10 ** rng.uniform(4.5, 6.0)
        joint |= {"cohesion": cohesion, "tensile_strength": 0.5 * cohesion}
    tables: dict[str, object] = {
        "wall": {"length": 0.24 * rng.integers(5, 9), "height": 0.075 * rng.integers(5, 9)},
        "joint": joint,
        "movement": {"shape": shape, "stage": stages, **({} if shape == "mound" else {size: largest})},
    }
    if rng.random() < 0.6:
        tables["dpc"] = {"course": 2, "friction": rng.uniform(0.2, 0.8)}
    if shape == "mound":
        tables["mound"] = {"shape": str(rng.choice(["walsh", "mitchell", "tree", "pipe"])), size: largest}
    return Scene.from_dict(tables)


def with_slow_strains(scene: Scene, seed: int) -> Scene:
    """Return the same scene with times, a random strain of the bricks, and random creep of the joints."""
    rng = np.random.default_rng([seed, 1])
    tables = scene.to_dict()
    for stage, time in zip(tables["movement"]["stage"], np.cumsum(rng.uniform(0.1, 2.0, 5)).tolist()):
        stage["time"] = time
    tables["strain"] = {"growth": rng.uniform(-6e-4, 8e-4), "temperature_swing": rng.uniform(0.0, 40.0)}
    tables["creep"] = {"coefficient": rng.uniform(0.0, 2.0)}
    if rng.random() < 0.7:
        tables["creep"]["relaxation_time"] = 10 ** rng.uniform(-1.0, 1.0)
    return Scene.from_dict(tables)


def on_footing(scene: Scene, footing: str) -> Scene:
    """Return the same scene with its footing on jacks, which push one way, or made of zones."""
    tables = scene.to_dict()
    if footing == "deformable":
        return Scene.from_dict({**tables, "solver": {"blocks": "rigid", "footing": footing}})
    stages = [{**stage, "kind": "doming"} for stage in tables["movement"]["stage"]]
    movement = {**tables["movement"], "shape": footing, "kind": "doming", "stage": stages}
    return Scene.from_dict({**tables, "movement": movement, "rig": {"stop_at_zero": False}})


@pytest.mark.parametrize("seed", [0, 1, 2, 5, 9])
def test_strains_and_creep_make_no_energy(seed: int) -> None:
    path = damagepred.solve(with_slow_strains(random_scene(seed), seed))
    assert path.attrs["status"] == "complete"
    energy_balance(path)


@pytest.mark.parametrize(
    ("footing", "seeds"),
    [
        ("jacks", (11, 16, 43)),
        ("deformable", (11, 16, 24)),
        pytest.param("jacks", range(12, 16), marks=pytest.mark.slow),
        pytest.param("deformable", range(12, 15), marks=pytest.mark.slow),
    ],
)
def test_strains_and_creep_on_a_footing_make_no_energy(footing: str, seeds: Sequence[int]) -> None:
    for seed in seeds:
        scene = random_scene(seed)
        if scene.movement.shape != "mound":
            path = damagepred.solve(on_footing(with_slow_strains(scene, seed), footing))
            assert path.attrs["status"] == "complete"
            energy_balance(path)


def test_ten_random_histories_make_no_energy() -> None:
    for seed in range(10):
        path = damagepred.solve(random_scene(seed))
        assert path.attrs["status"] == "complete"
        energy_balance(path)
