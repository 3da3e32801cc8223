"""What a user can get wrong: each message names the key, the value, and what to do."""

import dataclasses
from pathlib import Path

import pytest

from damagepred.errors import InputError
from damagepred.scene import Movement, Scene, Wall

WINDOW = {"x": 2.0, "y": 0.9, "width": 1.0, "height": 1.0}

# tables, words that must all stand in the message
BAD = {
    "unknown table": ({"wal": {}}, ["wal", "top level", "wall, block, joint", "Did you mean 'wall'?"]),
    "unknown key": ({"wall": {"lenght": 3}}, ["[wall] lenght", "takes length, height", "Did you mean 'length'?"]),
    "unknown key, nothing near": ({"wall": {"colour": 3}}, ["[wall] colour", "takes length, height"]),
    "unknown key in dpc": ({"dpc": {"frction": 0.5}}, ["[dpc] frction", "Did you mean 'friction'?"]),
    "unknown key in opening": (
        {"opening": [WINDOW, WINDOW | {"x": 4.0, "widht": 1}]},
        ["[[opening]] number 2", "widht", "Did you mean 'width'?"],
    ),
    "number for table": ({"wall": 3}, ["wall = 3", "must be a table", "[wall]"]),
    "table for list of tables": ({"opening": WINDOW}, ["opening", "[[opening]]"]),
    "wrong word": ({"wall": {"bond": "runing"}}, ["[wall] bond = 'runing'", "'running', 'stack'", "Did you mean"]),
    "unknown damage table": ({"damage": {"table": "as2780"}}, ["as2780", "Did you mean 'as2870'?"]),
    "negative": ({"joint": {"cohesion": -1.0}}, ["[joint] cohesion = -1", "at least 0 Pa"]),
    "negative with unit": ({"wall": {"length": "-6 m"}}, ["[wall] length", "-6", "greater than 0 m"]),
    "zero": ({"wall": {"thickness": 0}}, ["[wall] thickness = 0", "at least 0.001 m"]),
    "too large": ({"block": {"poisson_ratio": 0.5}}, ["[block] poisson_ratio = 0.5", "less than 0.5"]),
    "above": ({"solver": {"contacts_per_interface": 10}}, ["contacts_per_interface = 10", "at most 9"]),
    "text": ({"wall": {"length": "long"}}, ["[wall] length = 'long'", "'8 mm'"]),
    "wrong unit": ({"joint": {"normal_stiffness": "82 MPa"}}, ["normal_stiffness = '82 MPa'", "'82 N/mm3'"]),
    "decimal comma": ({"wall": {"thickness": "0,11 m"}}, ["[wall] thickness = '0,11 m'", "'8 mm'"]),
    "nan": ({"wall": {"length": float("nan")}}, ["[wall] length = nan", "finite"]),
    "inf": ({"wall": {"height": float("inf")}}, ["[wall] height = inf", "finite"]),
    "huge": ({"wall": {"height": 10**400}}, ["[wall] height", "finite"]),
    "bool for number": ({"wall": {"length": True}}, ["[wall] length = True", "number in m"]),
    "bool for count": ({"movement": {"increments": True}}, ["[movement] increments = True", "whole number"]),
    "fraction for count": ({"movement": {"increments": 2.5}}, ["[movement] increments = 2.5", "integer"]),
    "list for number": ({"wall": {"length": [6.0]}}, ["[wall] length", "number in m"]),
    "number for text": ({"title": 3}, ["title = 3", "string"]),
    "missing": ({"opening": [{"x": 1.0, "y": 1.0, "width": 1.0}]}, ["[[opening]] number 1, height", "is missing"]),
    "touching, the other way round": ({"opening": [WINDOW | {"x": 3.0}, WINDOW]}, ["openings 1 and 2", "touch"]),
    "touching below": (
        {"opening": [WINDOW | {"y": 1.4, "height": 0.5}, WINDOW | {"height": 0.5}]},
        ["openings 1 and 2", "touch"],
    ),
    "door above floor": (
        {"opening": [WINDOW | {"kind": "door"}]},
        ["[[opening]] number 1", "y = 0.9", "door", "leave y out"],
    ),
    "window at floor": ({"opening": [WINDOW | {"y": 0.0}]}, ["y = 0", "sill", "make it a door"]),
    "no increments": ({"movement": {"increments": 0}}, ["[movement] increments = 0", "at least 1"]),
    "stiffness for block cohesion": ({"block": {"cohesion": "1 N/mm3"}}, ["[block] cohesion", "wrong kind of unit"]),
    "no fracture energy": ({"joint": {"fracture_energy": 0}}, ["[joint] fracture_energy = 0", "greater than 0 N/m"]),
    "a strength for a fracture energy": (
        {"joint": {"fracture_energy": "0.1 MPa"}},
        ["[joint] fracture_energy = '0.1 MPa'", "wrong kind of unit", "'10 N/m'"],
    ),
    "damping of one": ({"solver": {"damping": 1.0}}, ["[solver] damping = 1", "less than 1"]),
    "held footing on a mound": (
        {"solver": {"footing": "none"}, "movement": {"shape": "mound"}},
        ["solver.footing = 'none'", "movement.shape = 'mound'", "'beam' or 'deformable'"],
    ),
    "beam under a prescribed movement": (
        {"solver": {"footing": "beam"}},
        ["solver.footing = 'beam'", "'jacks' or 'mound'", "movement.shape = 'three_loads'", "'none' or 'deformable'"],
    ),
    "zones that should crack": (
        {"solver": {"footing": "deformable"}, "movement": {"shape": "jacks"}, "footing": {"concrete": {}}},
        ["footing.concrete", "'deformable'", "footing = 'beam'"],
    ),
    "wires thicker than the footing": (
        {"footing": {"depth": "100 mm", "concrete": {"cover": "45 mm"}}},
        ["footing", "concrete.cover = 0.045 m", "depth = 0.1 m", "smaller", "deeper"],
    ),
    "unknown key in the footing's concrete": (
        {"footing": {"concrete": {"grad": "N25"}}},
        ["[footing.concrete] grad", "Did you mean 'grade'?"],
    ),
    "text for a jack": ({"rig": {"jacks": [2.0, "left"]}}, ["[rig] jacks, item 2 = 'left'", "'8 mm'"]),
    "number for jacks": ({"rig": {"jacks": 2.0}}, ["[rig] jacks = 2.0", "must be a list"]),
    "deflection for jack load": (
        {"rig": {"control": "load", "jack_load": "8 mm"}},
        ["[rig] jack_load = '8 mm'", "wrong kind of unit", "'6 kN'"],
    ),
    "stiffness of a support": (
        {"rig": {"support_stiffness": "1 kN/m2"}},
        ["[rig] support_stiffness", "wrong kind of unit", "N/m'"],
    ),
    "metres for millimetres": (
        {"movement": {"shape": "mound"}, "mound": {"surface_movement": 40}},
        ["mound.surface_movement = 40 m", "tenth", "6 m"],
    ),
    "unknown mound": ({"mound": {"shape": "wlash"}}, ["[mound] shape = 'wlash'", "Did you mean 'walsh'?"]),
    "density of 1e15": ({"block": {"density": 2e15}}, ["[block] density", "at most 100000 kg/m3"]),
    "thickness of a hair": ({"wall": {"thickness": 1e-9}}, ["[wall] thickness", "at least 0.001 m"]),
    "modulus beyond all": ({"block": {"elastic_modulus": 1e30}}, ["[block] elastic_modulus", "at most 1e+16 Pa"]),
    "soil without stiffness": ({"soil": {"swelling_stiffness": 0}}, ["[soil] swelling_stiffness = 0", "Pa/m"]),
    "group of one": ({"damage": {"group_count": 1}}, ["[damage] group_count = 1", "at least 2"]),
}


@pytest.mark.parametrize("name", BAD)
def test_message_names_key_value_and_remedy(name: str):
    tables, words = BAD[name]
    with pytest.raises(InputError) as caught:
        Scene.from_dict(tables, source="house.toml")
    message = str(caught.value)
    for word in words:
        assert word in message, message
    assert all(line.startswith("house.toml: ") for line in message.splitlines())
    assert "pydantic" not in message
    assert "http" not in message


def test_scenes_are_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Scene().wall.length = 3.0


@pytest.fixture
def house() -> Scene:
    return Scene.from_dict(
        {
            "dpc": {},
            "opening": [WINDOW, WINDOW | {"x": 4.0}],
            "movement": {"shape": "table", "table": [[0, 0], [0.3, 0.8], [0.5, 1], [1, 0]]},
        }
    )


@pytest.mark.parametrize(
    ("place", "value", "look"),
    [
        ("joint.cohesion", 0.2e6, lambda s: s.joint.cohesion),
        ("opening.1.width", 0.7, lambda s: s.opening[0].width),
        ("opening.2.x", 4.2, lambda s: s.opening[1].x),
        ("movement.central_deflection", 0.03, lambda s: s.movement.central_deflection),
        ("movement.table.2.2", 0.7, lambda s: s.movement.table[1][1]),
        ("dpc.friction", 0.4, lambda s: s.dpc.friction),
        ("damage.group_distance", 2.0, lambda s: s.damage.group_distance),
    ],
)
def test_with_values_changes_that_number_and_no_other(house: Scene, place: str, value: float, look):
    changed = house.with_values({place: value})
    assert look(changed) == value
    assert look(house) != value  # the original stays
    old = {p: _at(house, p) for p in house.numbers}
    new = {p: _at(changed, p) for p in changed.numbers}
    assert new == old | {place: value}


def _at(scene: Scene, place: str):
    value = scene
    for step in place.split("."):
        value = value[int(step) - 1] if step.isdigit() else getattr(value, step)
    return value


@pytest.mark.parametrize(
    ("place", "words"),
    [
        (
            "opening.0.width",
            "no opening '0'; numbers count from 1, here to 2. Older files counted from 0: opening.0 is",
        ),
        ("opening.3.width", "no opening '3'; numbers count from 1, here to 2"),
        ("opening.-1.width", "no opening '-1'; numbers count from 1, here to 2"),
        ("opening.door.width", "no opening 'door'; numbers count from 1, here to 2"),
        ("movement.table.0.1", "no movement.table '0'; numbers count from 1, here to 4"),
        ("movement.table.1.3", "no movement.table.1 '3'; numbers count from 1, here to 2"),
        ("control_joint.1.x", "no control_joint '1'; the scene has none"),
        ("movement.stage.1.central_deflection", "no movement.stage '1'; the scene has none"),
    ],
)
def test_items_of_lists_count_from_1(house: Scene, place: str, words: str):
    with pytest.raises(InputError) as caught:
        house.with_values({place: 1.0})
    assert words in str(caught.value)


def test_message_from_a_file_names_the_file(tmp_path: Path):
    file = tmp_path / "house.toml"
    file.write_text("[wall]\nlenght = 3\n")
    with pytest.raises(InputError, match=r"house\.toml: unknown key \[wall\] lenght"):
        Scene.from_toml(file)


def test_python_users_get_the_same_checks():
    with pytest.raises(ValueError, match="greater than 0"):
        Wall(length=-1.0)
    assert Movement(central_deflection="8 mm").central_deflection == 8e-3
