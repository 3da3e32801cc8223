"""Forces and joint law of the quasi-static solver's states, computed independently from its output."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from damagepred.assembly import Model, wall_model
from damagepred.enumerations import ContactState
from damagepred.scene import Dpc, Joint, Loads, Movement, Opening, Scene, Solver, Wall
from damagepred.solvers import Increment, solve_path
from tests.properties.statics import unbalanced

DATA = Path(__file__).resolve().parents[2] / "data"
TOLERANCE = 1e-6
BREAKING = 1e-5
"""By how much of its strength an intact bond may be overloaded: the solver breaks it beyond 1e-6."""


def check_joint_law(model: Model, step: Increment) -> None:
    """No contact is stressed beyond its law; no dilation."""
    law = model.properties
    sigma, tau, cracked = step.normal_stress, step.shear_stress, step.state == ContactState.CRACKED
    # what a block's weight makes on one contact: stresses below the millionth of it are nothing
    small = 1e-6 * model.mean_block_weight / model.interfaces.contact_area.max()
    strength = law.tensile_strength[:, None]
    # a joint without strength that never opened counts as intact, and carries what a broken one does
    bare = strength <= 0
    # a bond without strength breaks at a thousandth of a block's weight
    slack = np.where(bare, 1e3 * small, 0.0)
    assert (sigma <= np.where(cracked, 0.0, strength * (1 + BREAKING)) + small + slack).all(), "tension"
    cohesion = np.where(cracked, law.residual_cohesion[:, None], law.cohesion[:, None])
    friction = np.where(cracked, law.residual_friction[:, None], law.friction[:, None])
    limit = np.maximum(cohesion - sigma * friction, 0.0)
    assert (np.abs(tau) <= limit * (1 + 1e-9) + small).all(), "shear"
    # cracked: open without stress, or closed and pressed
    broken_open = cracked & (step.opening > 0)
    assert (sigma[broken_open] == 0.0).all()
    assert (tau[broken_open & (law.residual_cohesion[:, None] == 0)] == 0.0).all()
    pressed = cracked & (step.opening <= 0)
    np.testing.assert_allclose(
        sigma[pressed], (law.normal_stiffness[:, None] * step.opening)[pressed], rtol=1e-9, atol=1e-6
    )


def walls() -> dict[str, Scene]:
    bryant = Scene.from_toml(DATA / "bryant_dishing.toml")
    wall = Wall(length=2.4, height=0.9)
    joint = Joint(tensile_strength=0.1e6, cohesion=0.1e6)
    movement = Movement(central_deflection=4e-3, increments=4)
    solver = Solver(method="quasi_static")
    loads = Loads(roof=1000.0)
    small = Scene(wall=wall, joint=joint, movement=movement, loads=loads, solver=solver)
    window = (Opening(x=1.44, y=0.3, width=0.48, height=0.3),)
    return {
        "bryant": replace(bryant, movement=replace(bryant.movement, increments=5), solver=small.solver),
        "cracks": small,
        "cracks, doming": replace(small, movement=replace(small.movement, kind="doming")),
        "window on a dpc": replace(small, opening=window, dpc=Dpc(friction=0.4)),
        "door": replace(small, opening=(Opening(kind="door", x=0.72, width=0.48, height=0.6),)),
        "four midpoints": replace(
            small, solver=Solver(method="quasi_static", quadrature="midpoint", contacts_per_interface=4)
        ),
        "no strength": replace(small, joint=Joint(tensile_strength=0.0, cohesion=0.0)),
    }


@pytest.mark.parametrize("name", walls())
def test_blocks_balance_and_joints_obey_their_law(name: str) -> None:
    scene = walls()[name]
    model = wall_model(scene)
    weight = -model.supports.load.reshape(-1, 3)[:, 1].sum()
    steps = list(solve_path(model, scene.solver, scene.movement.increments))
    assert len(steps) == scene.movement.increments + 1
    for step in steps:
        assert not step.collapsed
        assert np.abs(unbalanced(model, step)).max() <= 1.01 * TOLERANCE
        assert step.residuals.unbalanced_force_ratio <= TOLERANCE
        assert step.base_reaction == pytest.approx(weight, rel=1e-6)
        check_joint_law(model, step)
    if name not in ("bryant",):
        assert (steps[-1].state == ContactState.CRACKED).sum() > 10, "nothing to check"
