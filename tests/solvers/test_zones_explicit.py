"""Deformable blocks in the explicit solver: forces of zones, facets, and equilibria against independent solutions."""

import numpy as np
import pytest

from damagepred import Assembly, BlockMaterial, Joint, Solver
from damagepred.assembly.assembly import rectangle
from damagepred.enumerations import ZoneState
from damagepred.kernels.jit import kernel
from damagepred.kernels.zone.forces import place_facets, scatter_facet_forces, zone_forces
from damagepred.solvers import solve_path
from damagepred.solvers.driver import Outcome
from damagepred.solvers.explicit.scheme import DampedTimeStepping
from damagepred.solvers.explicit.stepper import ExplicitStepper
from damagepred.solvers.state.zone_history import ZoneField
from damagepred.solvers.system.deformable_blocks import facets_of, rigid_motion, transformation_matrix, zone_stiffness
from damagepred.solvers.system.discrete_system import DiscreteSystem
from tests.assembly import reference
from tests.solvers.walls import gridpoint_mass

EXPLICIT = Solver(method="explicit", tolerance=1e-6, symmetric_half=False)


@kernel
def forces_of_zones(zones, displacement, force):
    zone_forces(zones, displacement, force)


@kernel
def there_and_back(facets, displacement, force):
    place_facets(facets, displacement)
    scatter_facet_forces(facets, force)


def cells(plane: str = "stress", strength: float | None = None) -> Assembly:
    """Voronoi cells and bricks, every other one lower: several patterns, batches not full or of two shapes."""
    assembly = Assembly(block=BlockMaterial(cohesion=strength, tensile_strength=strength and 0.3 * strength))
    for polygon in reference.voronoi(np.random.default_rng(3)):
        assembly.add_block(polygon, zone_size=0.2)
    for i in range(9):
        assembly.add_block(rectangle(2 + 0.25 * i, 0, 2.24 + 0.25 * i, 0.08 - 0.01 * (i % 2)), zone_size=0.05)
    return assembly


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("strength", [None, 1e9])
def test_internal_forces_of_zones_are_those_of_their_stiffness_matrix(plane: str, strength: float | None) -> None:
    model = cells(strength=strength).build(Solver(plane=plane))
    rng = np.random.default_rng(1)
    u, force = np.zeros(model.size), np.zeros(model.size)
    for dof in (model.mesh.dof_x, model.mesh.dof_y):
        u[dof] = 1e-7 * rng.normal(size=dof.size)
    field = ZoneField(model)
    forces_of_zones(field.zones, u, force)
    expected = -(zone_stiffness(model) @ u)
    np.testing.assert_allclose(force, expected, atol=1e-12 * np.abs(expected).max())
    assert field.stays_elastic(u)


@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_plastic_strain_of_fixed_zones_is_stress_by_hooke_s_law(plane: str) -> None:
    """Without displacement the elastic strain is minus the plastic one, out of plane in plane strain too."""
    e, nu = 2e9, 0.2
    assembly = Assembly(block=BlockMaterial(elastic_modulus=e, poisson_ratio=nu, cohesion=1e9, tensile_strength=3e8))
    assembly.add_block(rectangle(0.0, 0.0, 0.24, 0.08), zone_size=0.05)
    model = assembly.build(Solver(plane=plane))
    field, plastic = ZoneField(model), np.array([3e-4, -1e-4, 2e-4, 0.5e-4])
    if plane == "stress":
        plastic[3] = 0.0
    field.set_plastic_strain(np.tile(plastic, (len(model.mesh.zones), 1)))
    xx, yy, xy, zz = -plastic
    shear, first = e / (2 * (1 + nu)), e * nu / ((1 + nu) * (1 - 2 * nu))
    if plane == "strain":
        whole = first * (xx + yy + zz)
        exact = [whole + 2 * shear * xx, whole + 2 * shear * yy, shear * xy, whole + 2 * shear * zz]
    else:
        exact = [e / (1 - nu**2) * (xx + nu * yy), e / (1 - nu**2) * (yy + nu * xx), shear * xy, 0.0]
    stress = field.stresses(np.zeros(model.size))
    np.testing.assert_allclose(stress, np.tile(exact, (len(stress), 1)), rtol=1e-9, atol=1e-3)


def test_facets_follow_gridpoints_and_do_the_same_work() -> None:
    model = cells().build()
    rng = np.random.default_rng(2)
    u, force = np.zeros(model.size), np.zeros(model.size)
    u[model.mesh.dof_x], u[model.mesh.dof_y] = rng.normal(size=(2, model.mesh.x.size))
    bodies = slice(3 * (model.n_blocks + 1), 3 * model.n_bodies)
    force[bodies] = rng.normal(size=bodies.stop - bodies.start)
    on_facets = force.copy()
    there_and_back(facets_of(model), u, force)
    np.testing.assert_allclose(u[bodies], (transformation_matrix(model) @ u)[bodies], atol=1e-12)
    points = np.concatenate((model.mesh.dof_x, model.mesh.dof_y))
    assert force[points] @ u[points] == pytest.approx(on_facets[bodies] @ u[bodies], rel=1e-12)


def test_a_rigid_motion_causes_no_strain_and_is_the_mean_motion() -> None:
    model = cells().build()
    mesh, turn = model.mesh, 1e-3
    u = np.zeros(model.size)
    u[mesh.dof_x], u[mesh.dof_y] = 0.3 - turn * mesh.y, -0.2 + turn * mesh.x
    force = np.zeros(model.size)
    forces_of_zones(ZoneField(model).zones, u, force)
    assert np.abs(force).max() < 1e-12 * np.abs(zone_stiffness(model)).max()
    mean = (rigid_motion(model) @ u).reshape(-1, 3)
    blocks = model.blocks
    np.testing.assert_allclose(mean[:, 0], 0.3 - turn * blocks.y, rtol=1e-9)
    np.testing.assert_allclose(mean[:, 1], -0.2 + turn * blocks.x, rtol=1e-9)
    np.testing.assert_allclose(mean[:, 2], turn, rtol=1e-9)


def test_small_moments_of_gridpoints_add_up_on_the_block() -> None:
    model = cells().build()
    run, mesh = DampedTimeStepping(model, EXPLICIT), model.mesh
    d = len(mesh.block) - 1
    own = slice(mesh.first_gridpoint[d], mesh.first_gridpoint[d + 1])
    x, y = mesh.x[own] - mesh.x[own].mean(), mesh.y[own] - mesh.y[own].mean()
    run.motion.force[mesh.dof_x[own]], run.motion.force[mesh.dof_y[own]] = -np.sign(y), np.sign(x)
    moment = (np.abs(x) + np.abs(y)).sum() / np.sqrt(0.24**2 / 12 + 0.08**2 / 12)
    assert moment > 10.0
    assert run.unbalanced_force_ratio().max() * model.mean_block_weight == pytest.approx(moment, rel=1e-9)


def test_loads_on_blocks_keep_force_and_moment_when_spread() -> None:
    model = cells().build()
    rng, mesh = np.random.default_rng(5), model.mesh
    load = rng.normal(size=3 * model.n_blocks)
    out = DiscreteSystem.of(model)._load(load, None)
    block, x, y = mesh.gridpoint_block, out[mesh.dof_x], out[mesh.dof_y]
    turning = (mesh.x - model.blocks.x[block]) * y - (mesh.y - model.blocks.y[block]) * x
    for axis, values in enumerate((x, y, turning)):
        np.testing.assert_allclose(np.bincount(block, values, model.n_blocks), load[axis::3], rtol=1e-9, atol=1e-9)
    mass = np.bincount(block, gridpoint_mass(model), model.n_blocks)
    np.testing.assert_allclose(mass, model.mass, rtol=1e-12)


def test_a_block_that_is_too_weak_yields_and_reports_it() -> None:
    """A column of weak material under its own weight yields at its foot, where the stress reaches the strength."""
    cohesion, friction = 4e3, 0.5
    strength = 2 * cohesion * (np.hypot(1, friction) + friction)  # uniaxial compression
    height = 1.5 * strength / (2000 * 9.81)
    material = BlockMaterial(elastic_modulus=1e8, poisson_ratio=0.0, cohesion=cohesion, friction=friction)
    assembly = Assembly(block=material)
    assembly.add_block(rectangle(0, 0, 0.5, height), zone_size=0.25)
    assembly.rest_on_ground([0], joint=Joint(friction=0.0, cohesion=0.0, tensile_strength=0.0))
    model = assembly.build(EXPLICIT)
    path = ExplicitStepper(model, EXPLICIT)
    run = path.scheme
    assert not run.start_from_elastic_solution()
    run.advance(2000, 0.0, 0.6)  # 0.9 of its strength
    run.cycle(2000)
    picture = path.report(Outcome(0.0, balanced=True, collapsed=False)).zones
    assert (picture.state == ZoneState.ELASTIC).all()
    run.advance(2000, 0.0, 1.0)
    picture = path.report(Outcome(0.0, balanced=True, collapsed=False)).zones
    assert (picture.state == ZoneState.SHEAR).any()
    middle = model.mesh.y[model.mesh.zones].mean(axis=1)
    assert middle[picture.state == ZoneState.SHEAR].min() < 0.1 * height
    assert -picture.stress[:, 1].min() <= strength * (1 + 1e-9)


def test_an_unsupported_block_of_zones_collapses() -> None:
    """Its stiffness is singular except for rounding: the elastic solution must be rejected."""
    made = Assembly()
    first = made.add_block(rectangle(0.0, 0.0, 0.24, 0.075), zone_size=0.075)
    made.add_block(rectangle(0.0, 0.076, 0.24, 0.151), zone_size=0.075)
    made.rest_on_ground([first])
    settings = Solver(method="explicit")
    model = made.build(settings)
    assert DiscreteSystem.of(model).elastic_displacement() is None
    (last,) = solve_path(model, settings, 1)
    assert last.collapsed
