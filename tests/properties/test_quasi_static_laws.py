"""Random small walls of every law: equilibria are in balance, obey the joint law, and conserve energy."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from damagepred.assembly import Model, wall_model
from damagepred.enumerations import ContactState
from damagepred.scene import Dpc, Joint, Loads, Movement, Opening, Scene, Solver, Wall
from damagepred.solvers import Increment, solve_path
from tests.properties.statics import unbalanced

pytestmark = pytest.mark.quick_cases()

LAWS: dict[str, dict[str, Any]] = {
    "paper": {},
    "dilation": {"dilation": 0.1},
    "residual friction": {"residual_friction": 0.35},
    "brittle shear": {"brittle_shear": True},
    "softening": {"fracture_energy": 10.0},
    "residual strength": {"residual_tensile_strength": 0.01e6, "residual_cohesion": 0.02e6},
    "softening and dilation": {"fracture_energy": 10.0, "dilation": 0.1},
}
SETTINGS = Solver(method="quasi_static")
SHORT_STEPS = Solver(method="quasi_static", step_energy_tolerance=0.003)
"""In long steps, rounding alone may decide whether one is repeated shorter; the work then changes by 3e-4."""
BALANCED = 1e-6
UNBALANCED = 0.06
"""Share of the work that five increments may leave unbalanced: softening and sliding in one of them is no straight
line, and the trapezoidal rule takes it for one. The error falls with the increments, see below."""


def random_wall(law: str, seed: int, length: float = 1.2) -> tuple[Scene, Model]:
    """Return a wall whose every joint has its own strength."""
    rng = np.random.default_rng([20, seed])
    opening: tuple[Opening, ...] = ()
    if rng.random() < 0.4:
        opening = (Opening(x=float(rng.choice([0.3, 0.45])), y=0.15, width=0.45, height=0.3),)
    scene = Scene(
        wall=Wall(length=length, height=0.6, block_length=0.3, block_height=0.15),
        joint=Joint(tensile_strength=0.1e6, cohesion=0.1e6, friction=float(rng.uniform(0.5, 0.9)), **LAWS[law]),
        opening=opening,
        dpc=Dpc(course=1, friction=float(rng.uniform(0.3, 0.6))) if rng.random() < 0.5 else None,
        movement=Movement(
            kind=str(rng.choice(["dishing", "doming"])), central_deflection=float(rng.uniform(1e-3, 5e-3)), increments=5
        ),
        loads=Loads(roof=float(rng.choice([0.0, 2000.0, 6000.0]))),
        solver=SETTINGS,
    )
    joints = len(wall_model(scene).joints.kind)
    spread = rng.lognormal(-0.045, 0.3, size=(2, joints))
    fields = {"joint.tensile_strength": 0.1e6 * spread[0], "joint.cohesion": 0.1e6 * spread[1]}
    return scene, wall_model(scene, fields)


def within_law(model: Model, step: Increment) -> None:
    """Assert that no contact exceeds its law, as far as an increment shows."""
    law, sigma, tau = model.properties, step.normal_stress, step.shear_stress

    def each(values: np.ndarray) -> np.ndarray:
        return np.broadcast_to(values[:, None], sigma.shape)

    small = 1e-4 * model.mean_block_weight / float(model.interfaces.contact_area.max())
    cracked, softens = step.state == ContactState.CRACKED, each(law.critical_opening) > 0
    first = each(law.tensile_strength) / each(law.normal_stiffness)
    # kappa is at least the present opening less the dilation
    with np.errstate(divide="ignore", invalid="ignore"):
        bond = np.clip((each(law.critical_opening) - step.opening) / (each(law.critical_opening) - first), 0.0, 1.0)
    bond = np.where(softens, np.where(each(law.dilation) > 0, 1.0, bond), 0.0)
    bond = np.where(cracked, bond, 1.0)
    strength = each(law.residual_tensile_strength)
    strength = strength + bond * (each(law.tensile_strength) - strength)
    # a bond without strength carries up to the stress of a thousandth of a block's weight
    bare = np.where(~cracked & (strength == 0.0), 1e3 * small, 0.0)
    assert (sigma <= strength * (1 + 1e-5) + small + bare).all(), "tension"
    cohesion = each(law.residual_cohesion) + bond * each(law.cohesion - law.residual_cohesion)
    friction = each(law.residual_friction) + bond * each(law.friction - law.residual_friction)
    limit = np.maximum(cohesion - sigma * friction, 0.0)
    assert (np.abs(tau) <= limit * (1 + 1e-5) + small).all(), "shear"


def follow(model: Model, increments: int, settings: Solver = SETTINGS) -> list[Increment]:
    return list(solve_path(model, settings, increments))


def check_path(model: Model, steps: list[Increment], increments: int) -> None:
    assert steps[-1].collapsed or len(steps) == increments + 1
    released = 0.0
    for step in steps:
        for values in (step.displacement, step.normal_stress, step.shear_stress, step.slip):
            assert np.isfinite(values).all()
        if step.collapsed:
            continue
        assert step.residuals.unbalanced_force_ratio <= BALANCED
        assert np.abs(unbalanced(model, step)).max() <= 1.05 * BALANCED
        within_law(model, step)
        assert step.residuals.joint_law_violation < 1e-5 * float(model.properties.cohesion.max())
        energy = step.energy
        for name in ("elastic_energy", "friction_work", "fracture_work"):
            assert getattr(energy, name) >= -1e-9 * abs(energy.external_work), name
        assert energy.released_energy >= released - 1e-3 * abs(energy.external_work)
        released = energy.released_energy
        spent = energy.elastic_energy + energy.friction_work + energy.fracture_work + energy.released_energy
        assert abs(energy.external_work - spent) <= energy.energy_error * (1 + 1e-6) + 1e-9
        most = max(abs(energy.external_work), energy.elastic_energy, energy.friction_work, energy.fracture_work)
        assert energy.energy_error <= UNBALANCED * max(most, energy.released_energy)


@pytest.mark.parametrize("law", LAWS)
def test_equilibria_balance_and_obey_the_law(law: str) -> None:
    cracked = 0
    for seed in (1, 2, 3, 4) if "softening" in law else (0, 1, 2, 3, 4):
        scene, model = random_wall(law, seed)
        steps = follow(model, scene.movement.increments)
        check_path(model, steps, scene.movement.increments)
        cracked += int((steps[-1].state == ContactState.CRACKED).sum())
    assert cracked > 10, "nothing to check"


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 102))
@pytest.mark.parametrize("law", LAWS)
def test_equilibria_of_more_walls(law: str, seed: int) -> None:
    scene, model = random_wall(law, seed, length=1.8)
    check_path(model, follow(model, scene.movement.increments), scene.movement.increments)


def sliding_wall() -> Model:
    """An unbreakable wall that slides on its dpc."""
    wall = Wall(length=1.2, height=0.45, block_length=0.3, block_height=0.15)
    joint = Joint(tensile_strength=1e8, cohesion=1e8)
    dpc = Dpc(course=1, friction=0.1)
    movement = Movement(central_deflection=1e-3)
    loads = Loads(roof=6000.0)
    scene = Scene(wall=wall, joint=joint, dpc=dpc, movement=movement, loads=loads, solver=SETTINGS)
    model = wall_model(scene)
    # nor does the dpc open, which has no strength
    return replace(model, properties=model.properties._replace(tensile_strength=np.full(len(model.interfaces.x), 1e8)))


def test_where_no_bond_breaks_the_energy_error_falls_with_the_number_of_increments() -> None:
    model = sliding_wall()
    error = {}
    for increments in (5, 20, 80):
        last = follow(model, increments)[-1]
        assert (last.state == ContactState.SLIPPING).any()
        assert last.energy.released_energy == pytest.approx(0.0, abs=1e-9)
        assert last.energy.friction_work > 0
        error[increments] = last.energy.energy_error / abs(last.energy.external_work)
    assert error[80] < 1e-2
    assert error[80] < 0.5 * error[20] < 0.5 * error[5]


def images(model: Model, other: Model, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the block, and the joint of mortar, of another model that is the mirror image of each."""

    def nearest(x: np.ndarray, y: np.ndarray, of_x: np.ndarray, of_y: np.ndarray) -> np.ndarray:
        distance = np.hypot(length - x[:, None] - of_x, y[:, None] - of_y)
        assert distance.min(axis=1).max() < 1e-9
        return distance.argmin(axis=1)

    blocks = nearest(model.blocks.x, model.blocks.y, other.blocks.x, other.blocks.y)
    return blocks, nearest(model.joints.x, model.joints.y, other.joints.x, other.joints.y)


@pytest.mark.parametrize("law", LAWS)
def test_a_wall_in_a_mirror(law: str) -> None:
    rng, length = np.random.default_rng(77), 1.5
    scene = Scene(
        wall=Wall(length=length, height=0.6, block_length=0.3, block_height=0.15),
        joint=Joint(tensile_strength=0.1e6, cohesion=0.1e6, **LAWS[law]),
        opening=(Opening(x=0.3, y=0.15, width=0.45, height=0.3),),
        movement=Movement(kind="doming", central_deflection=2e-3, increments=4),
        loads=Loads(roof=2000.0),
        solver=SHORT_STEPS,
    )
    hole = scene.opening[0]
    other_scene = replace(scene, opening=(replace(hole, x=length - hole.x - hole.width),))
    plain = wall_model(scene)
    blocks, joints = images(plain, wall_model(other_scene), length)
    strength = 0.1e6 * rng.lognormal(-0.045, 0.3, size=(2, len(joints)))
    there = np.empty_like(strength)
    there[:, joints] = strength
    names = ("joint.tensile_strength", "joint.cohesion")
    model = wall_model(scene, dict(zip(names, strength)))
    other = wall_model(other_scene, dict(zip(names, there)))
    for one, image in zip(follow(model, 4, SHORT_STEPS), follow(other, 4, SHORT_STEPS), strict=True):
        moved = image.displacement[blocks] * (-1.0, 1.0, -1.0)
        # the position of freely sliding parts is not unique, because of friction
        scale = 1e-4 * max(float(np.abs(moved).max()), 1e-6)
        np.testing.assert_allclose(one.displacement, moved, rtol=0, atol=scale)
        np.testing.assert_allclose(np.sort(one.opening.ravel()), np.sort(image.opening.ravel()), rtol=0, atol=scale)
        assert (one.state == ContactState.CRACKED).sum() == (image.state == ContactState.CRACKED).sum()
        assert one.energy.external_work == pytest.approx(image.energy.external_work, rel=1e-4)
    assert (one.state == ContactState.CRACKED).any()
