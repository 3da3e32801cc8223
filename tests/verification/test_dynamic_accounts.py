"""Energy accounts of runs in time: elastic joints balance under any damping and movement."""

from dataclasses import replace

import numpy as np
import pytest

from damagepred.assembly import Assembly
from damagepred.assembly.assembly import rectangle
from damagepred.one_wall.judged_path import dynamic_run
from damagepred.scene import BaseMotion, BlockMaterial, Dynamics, Joint, Solver
from tests.verification.test_energy_accounts import ONE_STEP, TORN, drawn_pair, elastic_energy, softening_work

SOFT = Joint(normal_stiffness=4e8, shear_stiffness=1.5e8, tensile_strength=1e9, cohesion=1e9)
BASE = (
    BaseMotion(kind="half_sine", direction="x", acceleration=4.0, duration=0.03),
    BaseMotion(kind="full_sine", direction="y", acceleration=-7.0, duration=0.02, start=0.004),
)
DAMPED = {
    "none": {"damping": "none"},
    "local": {"damping": "local", "local_damping": 0.35},
    "viscous": {"damping": "viscous", "damping_ratio": 0.15, "frequency": 90.0},
    "rayleigh": {"damping": "rayleigh", "damping_ratio": 0.08, "frequency": 60.0, "second_frequency": 400.0},
}


@pytest.mark.parametrize("damping", DAMPED)
def test_works_in_time_balance_at_every_output(damping: str) -> None:
    """Three blocks on shaken ground, one of which is pushed, one of which starts with a speed, one moved."""
    wall = Assembly(thickness=0.11, joint=SOFT, block=BlockMaterial(elastic_modulus=1e9))
    for k in range(3):
        wall.add_block(rectangle(0.02 * k, 0.1 * k, 0.2 + 0.02 * k, 0.1 * (k + 1)))
    wall.rest_on_ground([0], lambda x: 2e-5 * x)
    wall.set_velocity(1, x=0.03, y=-0.02)
    wall.set_velocity(2, x=-0.02, y=0.04, rotation=0.3)
    wall.load(2, x=3.0, y=-60.0, moment=1.0)
    wall.push(1, x=25.0, y=-40.0)
    wall.move(0, rotation=1e-6)
    model = wall.build(Solver(lump_block_elasticity=False))
    drifts = model.ground.map(lambda state: state._replace(shear=1.5e-5 + 0.5 * state.normal))
    model = replace(model, ground=drifts)
    dynamics = Dynamics(
        duration=0.03,
        outputs=9,
        base=BASE,
        movement_time=0.02,
        start="unstressed",
        new_contacts=False,
        **DAMPED[damping],
    )
    path = list(dynamic_run(model, Solver(lump_block_elasticity=False), dynamics))
    kinetic = max(step.energy.kinetic_energy for step in path)
    polar = model.density[2] * model.blocks.polar[2] * 0.11
    begun = 0.5 * (model.mass[1] * (0.03**2 + 0.02**2) + model.mass[2] * (0.02**2 + 0.04**2) + polar * 0.3**2)
    # less what the forces that act at first make of it in half a step either way
    assert path[0].energy.kinetic_energy == pytest.approx(begun, rel=0.1)
    taken = [step.energy.damping_work for step in path]
    assert (max(map(abs, taken)) > 0.05 * kinetic) == (damping != "none")
    assert max(abs(step.energy.boundary_work) for step in path) > 0.05 * kinetic
    law = model.properties
    for step in path:
        assert abs(step.energy.energy_error) < 5e-6 * kinetic
        held = law.normal_stiffness[:, None] * step.opening
        np.testing.assert_allclose(step.normal_stress, held, atol=1e-6 * np.abs(held).max())
        assert step.energy.elastic_energy == pytest.approx(elastic_energy(model, step), rel=0.0, abs=2e-8 * kinetic)
        first, now = path[0].energy, step.energy
        went = now.kinetic_energy + now.elastic_energy + now.damping_work + now.energy_error
        assert now.external_work == pytest.approx(went - first.kinetic_energy - first.elastic_energy, abs=1e-9)
        assert (now.friction_work, now.fracture_work, now.plastic_work, now.released_energy) == (0.0,) * 4
    assert np.isfinite(taken).all()


def test_a_bond_that_softens_in_time_holds_and_has_taken_what_its_secant_says() -> None:
    """A block that is pulled off another and turned: some of its contacts soften, others are pressed."""
    model = drawn_pair(TORN, x=0.02e-3, y=0.06e-3, rotation=0.5e-3)
    # all degrees of freedom are prescribed: a step is as long as the time between two outputs
    dynamics = Dynamics(duration=0.05, outputs=400, movement_time=0.05, start="unstressed", new_contacts=False)
    path = list(dynamic_run(model, ONE_STEP, dynamics))
    assert (path[-1].state == 1).any()
    assert (path[-1].normal_stress < 0).any()
    for k in range(1, len(path), 41):
        assert path[k].energy.elastic_energy == pytest.approx(elastic_energy(model, path[k]), rel=1e-6, abs=1e-9)
        assert path[k].energy.fracture_work == pytest.approx(softening_work(model, path[: k + 1]), rel=5e-3, abs=1e-6)
        assert abs(path[k].energy.energy_error) < 1e-6 * path[-1].energy.external_work
