"""What must not matter to the quasi-static solver: left or right, the unit of length, the number of increments."""

from dataclasses import replace
from pathlib import Path

import pytest

import damagepred
from damagepred.enumerations import ContactKind
from damagepred.scene import Scene, Solver

pytestmark = pytest.mark.quick_cases()

DATA = Path(__file__).resolve().parents[2] / "data"
QUASI_STATIC = Solver(method="quasi_static")


def bryant(name: str, dpc: bool = True) -> Scene:
    scene = Scene.from_toml(DATA / f"{name}.toml")
    return replace(scene, solver=QUASI_STATIC, dpc=scene.dpc if dpc else None)


@pytest.mark.parametrize(
    ("name", "dpc"), [("bryant_dishing", True), ("bryant_dishing", False), ("bryant_doming", True)]
)
def test_the_number_of_increments_does_not_matter(name: str, dpc: bool) -> None:
    scene = bryant(name, dpc)
    ends = [damagepred.solve(scene, increments=n).isel(increment=-1) for n in (5, 20, 80)]
    widest = "dpc_opening_max" if dpc else "crack_width_max"
    for end in ends[1:]:
        assert float(end[widest]) == pytest.approx(float(ends[0][widest]), rel=2e-3)
        other = (end["contact_state"].values == 1) != (ends[0]["contact_state"].values == 1)
        # a contact of the dpc where the wall begins to rest may open between two increments, and shut again
        assert (end["contact_kind"].values[other] == ContactKind.DPC).all()
        assert float(end["contact_length"].values[other].sum()) < 0.01 * scene.wall.length
