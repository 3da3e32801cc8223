"""Presets of accuracy: their settings, overrides, and reported errors."""

import tomllib
from dataclasses import replace

import pytest

from damagepred.campaign.cost_estimate import accuracy_lines
from damagepred.errors import InputError
from damagepred.scene import Dpc, Scene, Solver
from damagepred.scene.accuracy import PRESETS, measured


def solver(**keys: object) -> Solver:
    return Scene.from_dict({"solver": keys}).solver


@pytest.mark.parametrize("keys", [{"accuracy": "draft"}, {"accuracy": "reference", "blocks": "rigid"}])
def test_written_and_read_again_it_is_the_same(keys: dict):
    scene = Scene.from_dict({"solver": keys})
    assert Scene.from_dict(tomllib.loads(scene.to_toml())) == scene


def test_another_preset_in_place_of_one():
    fine = Solver(accuracy="reference")
    assert fine.with_accuracy("fine") == Solver()
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
    assert 'accuracy = "fine";' in text
    assert 'accuracy = "standard";' in accuracy_lines(Scene(solver=Solver(blocks="rigid")))[0]
