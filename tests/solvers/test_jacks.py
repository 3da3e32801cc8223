"""Walls on jacks in the quasi-static solver."""

from dataclasses import replace

import numpy as np

import damagepred
from damagepred.scene import Footing, Joint, Loads, Movement, Opening, Rig, Scene, Wall


def test_level_state_is_that_on_bilateral_supports_while_none_pulls() -> None:
    """Under a part of its weight, with unbroken bonds, a wall spans the footing and would lift it off."""
    scene = Scene(
        wall=Wall(length=0.69, height=0.6, thickness=0.24, block_length=0.23, block_height=0.2, bond="stack"),
        joint=Joint(normal_stiffness=5e9, shear_stiffness=2.5e9, tensile_strength=880.0, cohesion=514.0, friction=0.62),
        footing=Footing(width=0.26, depth=0.57, elastic_modulus=3.2e9, density=2419.0),
        movement=Movement(kind="doming", shape="jacks", central_deflection=1e-8, increments=1),
        loads=Loads(roof=8745.0),
    )
    # a copy may have thin piers, as a sampled wall
    scene = replace(scene, opening=(Opening(x=0.466, y=0.268, width=0.168, height=0.221, lintel_bearing=0.06),))
    held, lifts = (
        damagepred.solve(replace(scene, rig=Rig(support=support, stop_at_zero=False)))
        for support in ("held", "lift_off")
    )
    assert lifts.attrs["status"] == "complete"
    assert (held["support_load"] > 0.0).all()
    for name in ("support_load", "jack_load", "contact_opening", "contact_broken_at"):
        np.testing.assert_allclose(lifts[name], held[name], rtol=1e-6, atol=1e-15)
