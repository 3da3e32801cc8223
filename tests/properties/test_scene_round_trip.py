"""A scene written as TOML is the same scene when read."""

import tomllib
from pathlib import Path

import pytest
from hypothesis import assume, given, settings

from damagepred.errors import InputError
from damagepred.scene import Scene
from damagepred.scene.described import build
from tests.properties.strategies import scenes

DATA = Path(__file__).resolve().parents[2] / "data"
REFERENCE = sorted(p.name for p in DATA.glob("*.toml") if "study" not in p.name)


@pytest.mark.parametrize("name", REFERENCE)
def test_shipped_scenes(name: str, tmp_path: Path):
    scene = Scene.from_toml(DATA / name)
    scene.to_toml(tmp_path / "again.toml")
    assert Scene.from_toml(tmp_path / "again.toml") == scene


def test_there_are_shipped_scenes():
    assert len(REFERENCE) >= 5


@settings(max_examples=60, deadline=None, derandomize=True)
@given(scenes())
def test_any_scene(tables: dict):
    try:
        scene = build(Scene, tables, "scene")  # files are refused with thin piers and strips besides
    except InputError as error:  # a wall too small for a dpc
        assume("courses" not in str(error))
        raise
    text = scene.to_toml()
    again = build(Scene, tomllib.loads(text), "scene")
    assert again == scene  # every float to the last digit
    assert again.to_toml() == text
    # and what was asked for is what is in it
    assert scene.title == tables["title"]
    assert scene.joint.normal_stiffness == tables["joint"]["normal_stiffness"]
    assert (scene.dpc is None) == ("dpc" not in tables)
    assert len(scene.opening) == len(tables.get("opening", []))
    assert hash(again) == hash(scene)  # scenes are keys of the geometry cache


@settings(max_examples=30, deadline=None, derandomize=True)
@given(scenes())
def test_with_values_of_itself_is_itself(tables: dict):
    try:
        scene = build(Scene, tables, "scene")
    except InputError:
        assume(False)
    values = {}
    for place in scene.numbers:
        value = scene
        for step in place.split("."):
            value = value[int(step) - 1] if step.isdigit() else getattr(value, step)
        values[place] = value
    assert scene.with_values(values) == scene
