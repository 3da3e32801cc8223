"""Presets of accuracy: their settings, overrides, and reported errors."""

import re
import tomllib
from dataclasses import fields, replace

import pytest

from damagepred.campaign.preset_accuracy import accuracy_lines
from damagepred.errors import InputError
from damagepred.scene import Dpc, Opening, Scene, Solver
from damagepred.scene.accuracy import PRESETS, STANDARD, measured, preset

METHODS = ("quasi_static", "explicit")


def solver(**keys: object) -> Solver:
    return Scene.from_dict({"solver": keys}).solver


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("accuracy", list(PRESETS))
def test_a_preset_sets_its_keys_and_no_others(method: str, accuracy: str):
    found, plain = solver(method=method, accuracy=accuracy), Solver(method=method)
    for field in fields(Solver):
        if field.name == "accuracy":
            continue
        expected = PRESETS[accuracy][method].get(field.name, getattr(plain, field.name))
        assert getattr(found, field.name) == expected, field.name
    assert found == Solver(method=method, accuracy=accuracy)  # in Python as in a file


def test_standard_is_the_defaults():
    assert solver(accuracy="standard") == solver() == Solver()
    assert {key: getattr(Solver(), key) for key in STANDARD} == STANDARD
    assert all(set(keys) <= set(STANDARD) for by_method in PRESETS.values() for keys in by_method.values())


def test_what_is_given_stands():
    found = solver(accuracy="reference", contacts_per_interface=9, zone_size="60 mm")
    assert (found.contacts_per_interface, found.zone_size, found.blocks) == (9, 0.06, "deformable")


@pytest.mark.parametrize("keys", [{"accuracy": "draft"}, {"accuracy": "reference", "blocks": "rigid"}])
def test_written_and_read_again_it_is_the_same(keys: dict):
    scene = Scene.from_dict({"solver": keys})
    assert Scene.from_dict(tomllib.loads(scene.to_toml())) == scene


def test_another_preset_in_place_of_one():
    fine = Solver(accuracy="reference")
    assert fine.with_accuracy("standard") == Solver()
    assert fine.with_accuracy("draft") == Solver(accuracy="draft")
    assert replace(fine, tolerance=1e-3).with_accuracy("reference") == fine


def test_unknown_presets_are_named():
    with pytest.raises(InputError, match=r"\[solver\] accuracy = 'standart'.*Did you mean 'standard'"):
        solver(accuracy="standart")
    with pytest.raises(InputError, match="accuracy = 3"):
        solver(accuracy=3)


def test_what_is_told_is_what_was_measured():
    scene = Scene(dpc=Dpc())
    text = "\n".join(accuracy_lines(scene))
    rows = [r for r in measured() if r.method == "quasi_static" and r.dpc and not r.opening]
    assert {r.wall for r in rows} >= {"dishing", "doming"}
    worst = max(r.error for r in rows if r.accuracy == "draft" and r.quantity == "opening of the dpc")
    draft = text[text.index("draft:") : text.index("standard:")]
    assert f"opening of the dpc {100 * worst:.2g} %" in draft
    assert all(f"{key} = " in draft for key in PRESETS["draft"]["quasi_static"])
    assert 'accuracy = "standard";' in text


def test_walls_are_told_from_walls_with_openings():
    hole = Opening(x=2.0, y=0.9, width=0.9, height=1.2)
    assert accuracy_lines(Scene(dpc=Dpc())) != accuracy_lines(Scene(dpc=Dpc(), opening=(hole,)))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("dpc", [True, False])
@pytest.mark.parametrize("hole", [True, False])
def test_the_error_of_damage_is_that_of_walls_that_crack(method: str, dpc: bool, hole: bool):
    """A wall that has no crack tells nothing of crack widths: they are another wall's, or not known."""
    opening = (Opening(x=2.0, y=0.9, width=0.9, height=1.2),) if hole else ()
    scene = Scene(dpc=Dpc() if dpc else None, opening=opening, solver=Solver(method=method))
    text = "\n".join(accuracy_lines(scene))
    parts = dict(zip(PRESETS, re.split("|".join(f"    {p}: " for p in PRESETS), text)[1:]))
    for accuracy, part in parts.items():
        rows = [r for r in measured() if (r.accuracy, r.method) == (accuracy, method)]
        for quantity in ("widest crack", "damage category"):
            alike = [r for r in rows if (r.dpc, r.opening, r.quantity) == (dpc, hole, quantity)]
            assert not any("strong" in r.wall for r in alike)
            assert quantity in part
            assert alike or f"{quantity}: error unknown" in part or "measured on other walls" in text
            assert "widest crack 0 %" not in part


def test_no_error_is_told_that_no_wall_could_show():
    """The wall of mortar that does not break has no crack, walls without a dpc no gap in it, and weight is weight."""
    rows = measured()
    assert rows
    assert not [r for r in rows if r.wall == "window strong" and "crack" in r.quantity]
    assert not [r for r in rows if r.wall in ("window strong", "stack") and r.quantity == "damage category"]
    assert not [r for r in rows if "dpc" in r.quantity and "below" not in r.quantity and not r.dpc]
    assert not [r for r in rows if r.quantity == "base reaction"]


def test_keys_besides_the_preset_are_told():
    scene = Scene(dpc=Dpc(), solver=Solver(contacts_per_interface=5))
    assert 'accuracy = "standard", except contacts_per_interface;' in accuracy_lines(scene)[0]


@pytest.mark.parametrize("method", METHODS)
def test_every_preset_has_been_measured(method: str):
    found = {(r.accuracy, r.method) for r in measured()}
    assert {(accuracy, method) for accuracy in PRESETS} <= found
    assert preset("standard", method) == STANDARD
