"""Any valid joint law: the quasi-static solver ends with finite results or a plain message."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import damagepred
from damagepred.scene import BlockMaterial, Dpc, Joint, Loads, Movement, Scene, Solver, Wall


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    height = draw(st.sampled_from([0.1, 0.3, 0.5]))
    tensile, cohesion = draw(st.sampled_from([(0.0, 0.0), (1e4, 2e4), (1e5, 2e5), (1e9, 1e10)]))
    rule, contacts = draw(st.sampled_from([("lobatto", 2), ("lobatto", 3), ("lobatto", 5), ("midpoint", 2)]))
    length = draw(st.sampled_from([0.3, 0.9, 1.5]))
    bond = draw(st.sampled_from(["running", "stack"]))
    wall = Wall(length=length, height=height, block_length=0.3, block_height=0.1, bond=bond)
    joint = Joint(tensile_strength=tensile, cohesion=cohesion, friction=draw(st.sampled_from([0.0, 0.3, 0.75, 1.5])))
    dpc = (
        Dpc(course=1, friction=draw(st.sampled_from([0.0, 0.3, 1.5]))) if draw(st.booleans()) and height > 0.1 else None
    )
    block = BlockMaterial(density=draw(st.sampled_from([0.0, 2000.0, 2000.0])))
    loads = Loads(roof=draw(st.sampled_from([0.0, 1e3, 1e5])))
    movement = Movement(
        kind=draw(st.sampled_from(["dishing", "doming"])),
        central_deflection=draw(st.sampled_from([0.0, 1e-4, 1e-3, 5e-3])),
        increments=draw(st.sampled_from([1, 3])),
    )
    solver = Solver(method="quasi_static", quadrature=rule, contacts_per_interface=contacts)
    return Scene(wall=wall, joint=joint, dpc=dpc, block=block, loads=loads, movement=movement, solver=solver)


@pytest.mark.thorough
@pytest.mark.timeout(120)
@settings(max_examples=60, deadline=None, derandomize=True)
@given(scenes())
def test_walls(scene: Scene) -> None:
    ds = damagepred.solve(scene, on_failure="return")
    assert ds.attrs["status"] in ("complete", "collapsed", "failed")
    for name in ("contact_normal_stress", "contact_shear_stress", "contact_slip", "block_displacement_x"):
        assert np.isfinite(ds[name].values).all()
    if ds.attrs["status"] == "complete":
        assert (ds["unbalanced_force_ratio"].values <= 1e-6).all()


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
