"""What must not matter to the quasi-static solver: left or right, the unit of length, the number of increments."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import damagepred
from damagepred.enumerations import ContactKind
from damagepred.scene import BlockMaterial, Dpc, Joint, Loads, Movement, Opening, Scene, Solver, Wall

pytestmark = pytest.mark.quick_cases()

DATA = Path(__file__).resolve().parents[2] / "data"
QUASI_STATIC = Solver(method="quasi_static")


def cracking(opening: Opening | None, dpc: bool, kind: str = "dishing") -> Scene:
    return Scene(
        wall=Wall(length=2.4, height=0.9),
        joint=Joint(tensile_strength=0.15e6, cohesion=0.15e6),
        opening=() if opening is None else (opening,),
        dpc=Dpc(friction=0.4) if dpc else None,
        movement=Movement(kind=kind, central_deflection=4e-3, increments=4),  # type: ignore[arg-type]
        loads=Loads(roof=1000.0),
        solver=QUASI_STATIC,
    )


DOOR = Opening(kind="door", x=0.48, width=0.48, height=0.6)


@pytest.mark.parametrize("scale", [0.5, 3.0])
@pytest.mark.parametrize("dpc", [False, True])
def test_similar_walls(scale: float, dpc: bool) -> None:
    """Gravity and density stay, so stresses go with length: strengths and moduli scale as lengths do.

    Displacements scale, too, so joints keep their stiffness (stress over displacement); forces go with length cubed.
    """
    scene = cracking(DOOR, dpc)
    wall, joint, hole, a = scene.wall, scene.joint, scene.opening[0], scale
    lengths = ("length", "height", "thickness", "block_length", "block_height")
    similar = replace(
        scene,
        wall=replace(wall, **{name: a * getattr(wall, name) for name in lengths}),
        opening=(replace(hole, **{n: a * getattr(hole, n) for n in ("x", "width", "height", "lintel_bearing")}),),
        block=replace(BlockMaterial(), elastic_modulus=a * scene.block.elastic_modulus),
        joint=replace(joint, tensile_strength=a * joint.tensile_strength, cohesion=a * joint.cohesion),
        movement=replace(scene.movement, central_deflection=a * scene.movement.central_deflection),
        loads=Loads(roof=a**3 * scene.loads.roof),
    )
    one, other = damagepred.solve(scene), damagepred.solve(similar)
    assert (one["contact_state"].values[-1] == 1).sum() > 10
    assert ((one["contact_state"].values == 1) == (other["contact_state"].values == 1)).all()
    np.testing.assert_allclose(other["base_reaction"], a**3 * one["base_reaction"], rtol=1e-6)
    for name in ("contact_opening", "contact_normal_stress", "block_displacement_y"):
        largest = np.abs(one[name].values).max()
        np.testing.assert_allclose(other[name].values / a, one[name].values, atol=1e-3 * largest, rtol=0)


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
