"""The sentence on what moves: places, directions and sizes are computed by hand for each kind of movement."""

from typing import Any

import numpy as np
import pytest

from damagepred.scene import Scene
from damagepred.scene.what_moves import what_moves

WALL = {"length": "10 m", "height": "2.4 m"}
STAGES = [{"kind": "dishing", "surface_movement": "40 mm"}, {"kind": "doming", "surface_movement": "30 mm"}]
LOADS = {"side": "left", "at": "1 m", "width": "0.2 m"}
PULSE = {"kind": "half_sine", "acceleration": "2 m/s2", "duration": "0.4 s", "start": "1 s"}


def scene(**tables: Any) -> Scene:
    return Scene.from_dict({"wall": WALL, **tables})


def on_mound(kind: str, **mound: Any) -> Scene:
    return scene(movement={"shape": "mound", "kind": kind}, mound=mound)


@pytest.mark.parametrize(
    ("described", "words"),
    [
        (scene(movement={"central_deflection": 0.0}), "The ground does not move"),
        (  # the middle is 10 - (0 + 4) / 2 = 8 from the chord, and 10 / 8 of the 8 mm
            scene(
                movement={
                    "shape": "table",
                    "central_deflection": "8 mm",
                    "table": [[0, 0], [0.25, -5], [0.5, 10], [1, 4]],
                }
            ),
            "goes down by 10 mm",
        ),
        (  # 0.5 y_s over 0.2 L
            on_mound("dishing", surface_movement="40 mm"),
            "Both ends of the ground go up by 20 mm, to nothing at 1.4 and 8.6 m; swelling clay, 4000 kPa/m",
        ),
        (
            on_mound("settle", shape="tree", surface_movement="25 mm", reach="3 m"),
            "The left end of the ground goes down by 25 mm, to nothing 3 m from that end; drying clay, 5000 kPa/m",
        ),
        (
            on_mound("settle", shape="tree", surface_movement="25 mm", reach="3 m", position="11 m"),
            "The right end of the ground goes down by 11.1 mm, to nothing 2 m from that end",  # (1 - 1 / 3)^2 25
        ),
        (on_mound("settle", shape="tree", reach="3 m", position="-5 m"), "The ground does not move"),
        (
            on_mound("heave", shape="pipe", surface_movement="30 mm", position="7 m", reach="2 m"),
            "The ground at 7 m goes up by 30 mm, to nothing in the middle and nothing at 9 m; soil, 4000 kPa/m",
        ),
        (  # exp(-9 / 32) and exp(-49 / 32) of it; along the wall i / z0 exp(-1 / 2) of it
            on_mound("settle", shape="tunnel", surface_movement="20 mm", position="3 m", tunnel_depth="8 m"),
            "The ground at 3 m goes down by 20 mm, to 15.1 mm at the left end and 4.33 mm at the right end; soil, "
            "5000 kPa/m",
        ),
        (
            on_mound("settle", shape="table", surface_movement="10 mm", table=[[0, 1], [1, 1]]),
            "The whole ground goes down by 10 mm; soil, 5000 kPa/m",
        ),
        (
            on_mound("settle", shape="table", surface_movement="10 mm", table=[[0, 1], [0.5, 0], [1, -0.5]]),
            "left end of the ground goes down by 10 mm, to nothing in the middle; it goes up by 5 mm at the right end",
        ),
        (
            on_mound("settle", shape="table", surface_movement="10 mm", table=[[0, 1], [0.5, -0.5], [1, 1]]),
            "m; it goes up by 5 mm in the middle; soil",
        ),
        (  # the larger side first: 0.7 of 30 mm
            scene(movement={"shape": "mound", "kind": "dishing", "stage": STAGES}),
            "Both ends of the ground go down by 21 mm",
        ),
        (
            scene(movement={"shape": "mound", "kind": "dishing", "stage": STAGES}),
            "in its history also: both ends of the ground go up by 20 mm",
        ),
        (  # 5 mm of the swing and 0.5 mm of the trend, then 5 mm less 1 mm
            scene(movement={"seasons": {"years": 1, "swing": "10 mm", "swing_cov": 0, "trend": "1 mm"}}),
            "in its history also: the middle of the ground goes up by 4 mm",
        ),
        (
            scene(movement={"shape": "jacks", "central_deflection": "8 mm"}, rig={"jacks": [4, 6]}),
            "The middle of the footing goes down by 8 mm; jacks at 4, 6 m, supports at 0, 10 m",
        ),
        (
            scene(
                movement={"shape": "jacks", "kind": "doming"}, rig={"jacks": [4], "control": "load", "jack_load": 5e3}
            ),
            "The middle of the footing goes up under 5 kN per jack; jacks at 4 m, supports at 0, 10 m",
        ),
        (
            scene(movement={"shape": "loads"}, load=[LOADS], loading={"force": "40 kN"}),
            "The ground does not move; loads towards the left grow to 40 kN in all",
        ),
        (
            scene(
                movement={"shape": "loads", "stage": [{"load_factor": 1.0}, {"load_factor": -0.5}]},
                load=[{"direction": "along"}],
                loading={"control": "displacement", "displacement": "2 mm"},
            ),
            "loads along the top grow to 2 mm of displacement; history of 2 stages",
        ),
        (
            scene(movement={"central_deflection": "5 mm"}, dynamics={"movement_time": "3 s", "base": [PULSE]}),
            "nothing at both ends; the base shakes along the wall from 1 to 1.4 s (half sine)",
        ),
        (  # without movement_time the ground stays
            scene(dynamics={"base": [{"time": [0, 1, 2], "values": [0, -2, 0], "scale": 1.5, "direction": "y"}]}),
            "The ground does not move; the base shakes up and down from 0 to 2 s (record)",
        ),
    ],
)
def test_the_sentence_has_place_direction_and_size(described: Scene, words: str) -> None:
    assert words in what_moves(described)


def test_the_ground_rises_as_the_model_follows_it() -> None:
    described, x = scene(movement={"shape": "mound", "kind": "dishing", "stage": STAGES}), np.array([0.0, 5.0, 10.0])
    assert described.ground_rise(x, -0.75) == pytest.approx([-0.021, 0.0, -0.021])
    assert described.ground_rise(x) == pytest.approx([0.02, 0.0, 0.02])
