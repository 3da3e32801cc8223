"""Presets of accuracy: their settings, overrides, and reported errors."""

import re
import tomllib
from dataclasses import fields, replace

import pytest

from damagepred.campaign.cost_estimate import accuracy_lines
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


@pytest.mark.parametrize("method", METHODS)
def test_every_preset_has_been_measured(method: str):
    found = {(r.accuracy, r.method) for r in measured()}
    assert {(accuracy, method) for accuracy in PRESETS} <= found
    assert preset("standard", method) == STANDARD
