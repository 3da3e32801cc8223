"""Whole scenes: their values, what follows from them, and the ground's form, against the lists in ``scenes/``."""

import dataclasses
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from damagepred.errors import InputError
from damagepred.scene import Movement, Scene, Seasons, Wall
from damagepred.scene.assumed import assumed_seasons, assumed_slow_strains, ground_cautions, ground_line
from damagepred.scene.plausibility import unlikely_values
from damagepred.scene.what_moves import load_factors, turning_points, what_moves
from tests.recorded import check, check_parts, parts_of

LISTS = Path(__file__).parent / "scenes"

FOOTING = {"width": 0.3, "depth": 0.3}
LAYER = {"thickness": 1.5, "shrink_swell_index": 0.05}
SETTLES = {"kind": "settle", "settlement": 0.02}
SEASONS = {"years": 3, "swing": 0.012, "trend": 0.004, "shift": 0.002, "increments": 2}
STAGES = [("dishing", 6e-3, 2, 0.5), ("doming", 4e-3, 3, 1.5), ("dishing", 0.0, 1, 3.0)]
DRIED = {"year": 1.0, "movement": 0.01, "rise": 0.5}


def on_mound(kind: str, shape: str, **mound: Any) -> dict[str, Any]:
    """Wall on ground of a form."""
    return {"footing": FOOTING, "movement": {"shape": "mound", "kind": kind}, "mound": {"shape": shape, **mound}}


SCENES: dict[str, dict[str, Any]] = {
    "dishing": {"movement": {"central_deflection": 0.009}, "dpc": {"course": 3}},
    "arc": {"movement": {"kind": "doming", "shape": "arc"}, "joint": {"tensile_strength": 0.4e6, "friction": 0.6}},
    "table": {
        "movement": {"shape": "table", "table": [[0.0, 0.0], [0.3, -0.6], [0.7, -1.0], [1.0, 0.0]]},
        "opening": [
            {"kind": "door", "x": 0.9, "width": 0.8, "height": 1.8},
            {"kind": "window", "x": 2.5, "y": 0.9, "width": 1.2, "height": 1.2},
        ],
    },
    "step": {"movement": SETTLES | {"shape": "step", "position": 1.4}},
    "tilt": {"movement": SETTLES | {"shape": "tilt", "end": "right"}},
    "settle": {"movement": SETTLES | {"shape": "settle", "end": "right", "reach": 2.5}},
    "parabola": {"movement": {"shape": "parabola", "central_deflection": 0.004}},
    "trough": {
        "movement": SETTLES | {"shape": "trough", "trough_width": 1.2, "position": 2.5, "settlement_is": "range"}
    },
    "tunnel": {
        "movement": (
            {"shape": "trough", "kind": "settle", "trough_width": 5.0, "tunnel_depth": 10.0, "tunnel_diameter": 4.0}
            | {"volume_loss": 0.01, "position": -1.0}
        )
    },
    "stages": {
        "movement": {"stage": [dict(zip(("kind", "central_deflection", "increments", "time"), row)) for row in STAGES]},
        "strain": {"growth": 4e-4, "temperature_swing": 20.0, "temperature_change": -5.0},
        "creep": {"coefficient": 0.8, "relaxation_time": 2.0},
    },
    "seasons": {"movement": {"seasons": SEASONS | {"step": [DRIED]}}},
    "walsh": on_mound("doming", "walsh", embedment=0.4),
    "walsh_dishing": on_mound("dishing", "walsh", surface_movement=0.03),
    "mitchell": on_mound("dishing", "mitchell", movement_ratio=0.6),
    "tree": on_mound("settle", "tree", reach=5.0, position=-1.0),
    "pipe": on_mound("heave", "pipe", reach=2.0, position=2.5),
    "ground_tunnel": on_mound("settle", "tunnel", tunnel_depth=8.0),
    "soil_log": {
        **on_mound("doming", "walsh", suction_depth=2.3),
        "soil_layer": [LAYER | {"name": "clay"}, LAYER | {"thickness": 2.0, "shrink_swell_index": 0.02}],
        "suction": {"change": 1.3, "cracked_share": 0.4},
    },
    "soil_seasons": {
        "footing": FOOTING,
        "movement": {"shape": "mound", "kind": "doming", "seasons": {"years": 2}},
        "soil_layer": [LAYER | {"thickness": 5.0}],
    },
    "jacks": {"footing": FOOTING, "movement": {"shape": "jacks", "kind": "doming"}, "rig": {"supports": [5.5, 0.5]}},
    "concrete": {
        "footing": FOOTING | {"concrete": {"grade": "N32", "bottom": "3-L12TM", "top": "3-L8TM"}},
        "movement": {"shape": "mound"},
        "loads": {"roof": 9e3},
    },
    "shaking": {
        "solver": {"method": "explicit"},
        "dynamics": {"base": [{"kind": "half_sine", "acceleration": 1.0, "duration": 1.5, "start": 0.5}]},
    },
}


def followed(value: Any, name: str) -> Iterator[tuple[str, Any]]:
    for key in sorted(dir(type(value))):
        member = getattr(type(value), key)
        if isinstance(member, property | cached_property) and not key.startswith("_"):
            yield f"{name}.{key}", getattr(value, key)
    for field in dataclasses.fields(value):
        items = getattr(value, field.name)
        for number, item in enumerate(items if isinstance(items, tuple) else (items,)):
            if dataclasses.is_dataclass(item):
                yield from followed(item, f"{name}.{field.name}{number}")


def values_of(scene: Scene) -> dict[str, str]:
    return dict(part for key, value in [("scene", scene), *followed(scene, "of")] for part in parts_of(value, key))


DEFAULT = values_of(Scene())


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_is_its_list(name: str) -> None:
    scene = Scene.from_dict(SCENES[name])
    # all values once, then those that differ
    values = values_of(scene).items()
    parts = {key: value for key, value in values if name == "dishing" or DEFAULT.get(key) != value}
    length, movement = scene.wall.length, scene.movement
    x = np.linspace(-0.5 if movement.shape == "mound" else 0.0, length, 23)
    for factor in load_factors(scene) if movement.shape != "jacks" else ():
        parts |= parts_of(scene.ground_rise(x, factor), f"ground.rise {factor:g}")
        parts |= parts_of(turning_points(scene.ground_rise(x, factor)), f"ground.turns {factor:g}")
    if movement.prescribed and movement.shape != "loads":
        parts |= parts_of([movement.profile(x, length, f) for f in (0.4, 1.0)], "movement.profile")
        parts |= parts_of([f * movement.horizontal_profile(x, length) for f in (0.4, 1.0)], "movement.horizontal")
        parts |= parts_of(movement.measures(Wall(length=length)), "movement.measures")
    if movement.shape == "mound":
        mound, kind = scene.mound, movement.kind
        parts |= parts_of([mound.at(f).profile(x, length, kind) for f in (0.5, 1.0)], "mound.profile")
        parts |= parts_of([mound.at(f).horizontal(x, length, kind) for f in (0.5, 1.0)], "mound.horizontal")
        parts |= parts_of([mound.largest(kind), mound.mound_exponent(length), mound.axis(length)], "mound.numbers")
        parts |= parts_of(
            [mound.extent(length), scene.soil.stiffness(kind), scene.soil.stiffness_along(kind)], "soil.k"
        )
        if mound.shape in ("walsh", "mitchell"):
            parts |= parts_of(mound.edge(length, kind), "mound.edge")
    if movement.seasons is not None:
        parts |= parts_of(movement.seasons.movements(), "seasons.movements")
    said = [what_moves(scene), ground_line(scene) or "", *ground_cautions(scene), *assumed_seasons(scene)]
    parts |= parts_of([*said, *assumed_slow_strains(scene), *unlikely_values(scene)], "said")
    parts |= parts_of([scene.unread(), list(scene.free_tables())], "keys")
    parts |= parts_of(scene.movement.increments_of_history(), "history")
    if movement.shape == "jacks":
        parts |= parts_of([scene.rig.support_places(length), scene.rig.jack_places(length)], "rig.places")
    check_parts(LISTS / f"{name}.txt", parts)
    assert Scene.from_dict(scene.to_dict()) == scene


@pytest.mark.parametrize(
    ("name", "key", "free"),
    [
        ("seasons", "movement.central_deflection", "movement.seasons.trend"),
        ("seasons", "movement.stage.1.central_deflection", "movement.seasons.swing"),
        ("soil_seasons", "mound.surface_movement", "soil_layer.1.shrink_swell_index"),
        ("soil_seasons", "movement.seasons.swing", "movement.seasons.swing_share"),
        ("soil_log", "mound.surface_movement", "suction.change"),
    ],
)
def test_values_that_follow_from_others_are_refused(name: str, key: str, free: str) -> None:
    scene = Scene.from_dict(SCENES[name])
    with pytest.raises(InputError, match=f"'{key}': follows from other keys"):
        scene.with_values({key: 0.01})
    value = 1.5 * scene.numbers[free]
    assert scene.with_values({free: value}).numbers[free] == value


WRONG: list[dict[str, Any]] = [
    {"wall": {"length": {"x": 1}}},
    {"wall": 6.0},
    {"wall": {"height": "tall", "thickness": -0.1}},
    {"wall": {"length": "6 kg"}},
    {"opening": {"x": 1.0}},
    {"opening": [{"kind": "gate", "x": 1.0, "width": 1.0, "height": 1.0}]},
    {"opening": [{"x": 5.5, "y": 0.9, "width": 1.0, "height": 1.0}]},
    {"opening": [{"x": 1.0, "y": 0.9, "width": 1.0, "height": 1.0}, {"x": 1.5, "y": 0.9, "width": 1.0, "height": 1.0}]},
    {"joint": {"tensile_strength": 0.453}},
    {"joint": {"friction": 36.9}},
    {"block": {"elastic_modulus": 9.0}},
    {"dpc": {"course": 0}},
    {"dpc": {"course": 99}},
    {"movement": {"shape": "table", "table": [[0.0, 0.0], [0.6, 1.0], [0.4, 1.0], [1.0, 0.0]]}},
    {"movement": {"shape": "table", "table": [[0.0, 0.0], [1.0, "one"]]}},
    {"movement": {"kind": "sideways"}},
    {"movement": {"shape": "trough", "settlement": 0.02}},
    {"movement": {"seasons": SEASONS, "central_deflection": 0.009}},
    {"movement": {"stage": [{"central_deflection": 1e-3}, {}]}},
    {"footing": FOOTING | {"concrete": {"grade": "N99"}}},
    {"footing": FOOTING | {"concrete": {"bottom": "3-L99TM"}}, "movement": {"shape": "mound"}},
    {"movement": {"shape": "jacks"}, "rig": {"jacks": [9.0]}},
    {"movement": {"shape": "loads"}, "load": [{"at": 0.1, "width": 1.0}], "loading": {"force": 1e3}},
    {"solver": {"quadrature": "lobatto", "contacts_per_interface": 1}},
    {"dynamics": {"base": [{"kind": "half_sine"}]}, "solver": {"method": "explicit"}},
    {"strain": {"growth": 0.4}},
    {"creep": {"relaxation_time": 2.0}},
]


def test_a_wrong_scene_has_its_sentence() -> None:
    lines = []
    for tables in WRONG:
        with pytest.raises(InputError) as refused:
            Scene.from_dict(tables)
        lines += str(refused.value).splitlines()
    check(LISTS / "refused.txt", lines)


def test_python_is_refused_as_a_file_is() -> None:
    with pytest.raises(InputError, match=r"Scene: movement\.central_deflection = 0\.009: follows from"):
        Scene(movement=Movement(seasons=Seasons(years=2, swing=0.01), central_deflection=0.009))
