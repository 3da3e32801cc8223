"""Any valid small wall, by any solver: finite results or a plain message, and no gain of energy."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import damagepred
from damagepred.errors import DamagepredError
from damagepred.one_wall.judged_path import model_of
from damagepred.scene import BlockMaterial, Joint, Movement, Scene, Solver, Wall
from damagepred.scene.described import build
from damagepred.solvers import solve_path
from tests.properties.statics import Found, energy_made, not_finite, statics
from tests.properties.strategies import number

pytestmark = pytest.mark.quick_cases()


def size(low: float, high: float) -> st.SearchStrategy[float]:
    """Powers of ten, and zero."""
    return st.one_of(st.just(0.0), number(np.log10(low), np.log10(high)).map(lambda power: float(10.0**power)))


@st.composite
def scenes(draw: st.DrawFn) -> dict[str, Any]:
    units, courses = draw(st.integers(1, 3)), draw(st.integers(1, 3))
    length, height = draw(number(0.05, 0.6)), draw(number(0.03, 0.3))
    friction, stiffness = draw(st.sampled_from([0.0, 0.3, 0.75, 2.0])), draw(number(8, 13))
    tables: dict[str, Any] = {
        "wall": (
            {"length": units * length, "height": courses * height, "block_length": length}
            | {"block_height": height, "bond": draw(st.sampled_from(["running", "stack"]))}
        ),
        "block": {"density": draw(size(1e2, 1e4)), "elastic_modulus": 10.0 ** draw(number(7, 11))},
        "joint": (
            {"normal_stiffness": 10.0**stiffness, "shear_stiffness": 10.0 ** (stiffness - draw(number(0, 1)))}
            | {"tensile_strength": draw(size(1.0, 1e8)), "cohesion": draw(size(1.0, 1e8)), "friction": friction}
            | {"dilation": friction * draw(st.sampled_from([0.0, 0.0, 0.5]))}
            | {"brittle_shear": draw(st.booleans())}
        ),
        "movement": {
            "kind": draw(st.sampled_from(["dishing", "doming"])),
            "increments": draw(st.sampled_from([1, 3])),
            "central_deflection": draw(size(1e-9, 0.1 * units * length)),
        },
        "loads": {"roof": draw(size(1.0, 1e5))},
    }
    if courses > 1 and draw(st.booleans()):
        tables["dpc"] = {"course": 1, "friction": draw(number(0, 1))}
    return tables


def answer(tables: dict[str, Any], method: str, blocks: str) -> tuple[list[Any], str]:
    """Return the solved increments, and the message if they are incomplete."""
    found: list[Any] = []
    try:
        solver = {"method": method, "blocks": blocks, "maximum_cycles": 20_000}
        scene = build(Scene, tables | {"solver": solver}, "scene")  # thin piers and strips, too
        model = model_of(scene)
        found.extend((model, increment) for increment in solve_path(model, scene.solver, scene.movement.increments))
    except DamagepredError as error:
        return found, str(error)
    return found, ""


@pytest.mark.parametrize(
    ("method", "blocks"), [("quasi_static", "rigid"), ("explicit", "rigid"), ("quasi_static", "deformable")]
)
@settings(max_examples=6, deadline=None, derandomize=True)
@given(tables=scenes())
def test_any_wall_is_solved_or_refused_in_words(method: str, blocks: str, tables: dict[str, Any]) -> None:
    found, said = answer(tables, method, blocks)
    assert found or len(said) > 20
    if found:
        whole = Found(found[0][0], [increment for _, increment in found])
        assert not_finite(whole) == ""
        assert energy_made(whole) == ""
        forces, law = statics(whole, 1e-6 if method == "quasi_static" else 1e-3)
        assert law < 3.0
        # gridpoints are in balance one by one, and add up in a block
        assert forces < (30.0 if blocks == "deformable" else 3.0)
    again, word = answer(tables, method, blocks)
    assert word == said
    for (_, one), (_, other) in zip(found, again, strict=True):
        np.testing.assert_array_equal(one.displacement, other.displacement)
        np.testing.assert_array_equal(one.normal_stress, other.normal_stress)


def test_the_checks_find_a_wrong_result() -> None:
    """Forces that do not balance, a law that is exceeded, energy from nothing, no number."""
    scene = Scene(
        wall=Wall(length=0.6, height=0.3, block_length=0.3, block_height=0.1),
        movement=Movement(central_deflection=1e-4, increments=1),
    )
    model = model_of(scene)
    last = list(solve_path(model, scene.solver, 1))[-1]

    def forces_and_law(**changed: Any) -> tuple[float, float]:
        return statics(Found(model, [replace(last, **changed)]), 1e-6)

    assert max(forces_and_law()) < 3.0
    assert forces_and_law(normal_stress=1.01 * last.normal_stress)[0] > 3.0
    assert forces_and_law(shear_stress=last.shear_stress + 1e7)[1] > 3.0
    assert "released_energy" in energy_made(
        Found(model, [replace(last, energy=replace(last.energy, released_energy=-0.1))])
    )
    nothing = np.full_like(last.displacement, np.nan)
    assert not_finite(Found(model, [replace(last, displacement=nothing)])) == f"displacement in increment {last.number}"


def test_a_single_brick() -> None:
    scene = Scene(
        wall=Wall(length=0.24, height=0.075),
        movement=Movement(central_deflection=1e-3, increments=2),
        solver=Solver(method="quasi_static"),
    )
    ds = damagepred.solve(scene)
    assert ds.attrs["status"] == "complete"
    weightless = replace(scene, block=BlockMaterial(density=0.0), joint=Joint(tensile_strength=0.0, cohesion=0.0))
    assert damagepred.solve(weightless, on_failure="return").attrs["status"] in ("complete", "collapsed")
