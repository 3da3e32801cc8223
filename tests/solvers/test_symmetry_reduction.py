"""The expanded solution of half a symmetric wall is that of the whole wall; only symmetric walls are halved."""

import itertools
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from damagepred.assembly import Assembly, Model, wall_model
from damagepred.assembly.assembly import rectangle
from damagepred.enumerations import ContactState
from damagepred.errors import ConvergenceError
from damagepred.scene import Dpc, Joint, Loads, Movement, Opening, Scene, Solver, Wall
from damagepred.solvers import Increment, solve_path
from damagepred.solvers.explicit.stepper import explicit_path
from damagepred.solvers.quasi_static import stepper as quasi_static
from damagepred.solvers.state.increment import ZoneResults
from damagepred.solvers.symmetry import _unfolded, reduce_by_symmetry
from tests.properties.statics import unbalanced
from tests.solvers.walls import stack

QUASI_STATIC, EXPLICIT = Solver(method="quasi_static"), Solver(method="explicit", tolerance=1e-5)
WEAK = Joint(tensile_strength=0.1e6, cohesion=0.1e6)
EVEN, ODD = 2.4, 2.64
"""Lengths (m) with a perpend on the axis in the first course and a brick across it in the second, and the reverse."""
MIDDLE = Opening(x=0.96, y=0.3, width=0.48, height=0.3)
DOOR = Opening(kind="door", x=0.96, width=0.48, height=0.6)
SIDES = (Opening(x=0.36, y=0.3, width=0.48, height=0.3), Opening(x=1.56, y=0.3, width=0.48, height=0.3))


def scene(length: float = EVEN, bond: str = "running", kind: str = "dishing", **other: object) -> Scene:
    return Scene(
        wall=Wall(length=length, height=0.9, bond=bond),
        movement=Movement(kind=kind, central_deflection=4e-3, increments=4),
        **{"joint": WEAK, "loads": Loads(roof=1000.0), "solver": QUASI_STATIC, **other},
    )


def model_of(length: float = EVEN, **other: object) -> Model:
    return wall_model(scene(length, **other))


def positions(model: Model) -> np.ndarray:
    """Return the positions of the contacts, (m, q, 2)."""
    face = model.interfaces
    tangent = np.stack((face.normal_y, -face.normal_x), axis=-1)
    return np.stack((face.x, face.y), axis=-1)[:, None] + face.contact_offset[..., None] * tangent[:, None]


def nearest(points: np.ndarray, axis: float) -> np.ndarray:
    image = points * (-1.0, 1.0) + (2 * axis, 0.0)
    distance = np.hypot(*(points[:, None] - image[None]).T)
    assert distance.min(axis=1).max() < 1e-9
    return distance.argmin(axis=1)


def mirrored(model: Model, step: Increment) -> Increment:
    """Return the mirror image of an increment, contact by contact."""
    axis = (model.blocks.vertices[:, 0].min() + model.blocks.vertices[:, 0].max()) / 2
    block = nearest(np.column_stack((model.blocks.x, model.blocks.y)), axis)
    face = nearest(np.column_stack((model.interfaces.x, model.interfaces.y)), axis)
    here = positions(model)
    there = here * (-1.0, 1.0) + (2 * axis, 0.0)
    point = np.abs(there[:, None] - here[face][:, :, None]).sum(axis=-1).argmin(axis=1)  # of i, as it is in its image
    rows = np.repeat(face[:, None], point.shape[1], axis=1)
    return replace(
        step,
        displacement=step.displacement[block] * (-1.0, 1.0, -1.0),
        **{name: getattr(step, name)[rows, point] for name in ("opening", "normal_stress", "state")},
        **{name: -getattr(step, name)[rows, point] for name in ("slip", "shear_stress")},
    )


def symmetric_part(model: Model, step: Increment) -> Increment:
    """Mean of an increment and its mirror image, for positions that are not unique (sliding walls, loose bricks)."""
    image = mirrored(model, step)
    names = ("displacement", "opening", "slip", "normal_stress", "shear_stress")
    return replace(step, **{name: (getattr(step, name) + getattr(image, name)) / 2 for name in names})


def assert_near(one: np.ndarray, other: np.ndarray, share: float, least: float = 0.0) -> None:
    np.testing.assert_allclose(one, other, rtol=0, atol=max(share * float(np.abs(other).max()), least))


def compare(model, settings, increments, displacement, stress):
    """Follow both ways; they agree up to those shares of the largest values."""
    assert reduce_by_symmetry(model) is not None
    pairs = list(
        zip(
            solve_path(model, settings, increments),
            solve_path(model, replace(settings, symmetric_half=False), increments),
            strict=True,
        )
    )
    weight = -model.supports.load.reshape(-1, 3)[:, 1].sum()
    # stresses and what they make of the joints, that count as nothing
    nothing = stress * model.mean_block_weight / float(model.interfaces.contact_area.max())
    for one, whole in pairs:
        other = symmetric_part(model, whole)
        for name in ("displacement", "opening", "slip"):
            assert_near(getattr(one, name), getattr(other, name), displacement, 1e-12)
        for name in ("normal_stress", "shear_stress"):
            assert_near(getattr(one, name), getattr(whole, name), stress, nothing)
        if one.zones is not None and whole.zones is not None:
            assert_near(one.zones.displacement, whole.zones.displacement, displacement, 1e-12)
            assert_near(one.zones.stress, whole.zones.stress, stress, nothing)
        # a joint without strength breaks by rounding where it carries nothing, which shows only where it opens
        bare = (model.properties.tensile_strength == 0.0)[:, None] & (whole.opening < 1e-8)
        np.testing.assert_array_equal(*((step.state == ContactState.CRACKED) & ~bare for step in (one, whole)))
        assert one.base_reaction == pytest.approx(weight, rel=10 * settings.tolerance_used)
        assert (one.number, one.load_factor, one.collapsed) == (whole.number, whole.load_factor, whole.collapsed)
    return pairs


NO_STRENGTH = Joint(tensile_strength=0.0, cohesion=0.0)
LITTLE = {kind: Movement(kind=kind, central_deflection=0.5e-3, increments=1) for kind in ("dishing", "doming")}
"""On a dpc bricks come to hang loose, and then lie now here, now there: before that."""
WALLS = {
    "even, dishing": scene(),
    "even, doming": scene(kind="doming"),
    "odd, dishing": scene(ODD),
    "odd, doming": scene(ODD, kind="doming"),
    "odd, doming on a dpc": replace(scene(ODD, dpc=Dpc(friction=0.4)), movement=LITTLE["doming"]),
    "stack bond, joints on the axis": scene(EVEN, "stack"),
    "stack bond, blocks on the axis": scene(ODD, "stack", "doming"),
    "window on a dpc": replace(scene(opening=(MIDDLE,), dpc=Dpc(friction=0.4)), movement=LITTLE["dishing"]),
    "window, doming": scene(kind="doming", opening=(MIDDLE,)),
    "door": scene(opening=(DOOR,)),
    "two windows on a dpc": replace(scene(opening=SIDES, dpc=Dpc()), movement=LITTLE["dishing"]),
    "two windows, doming": scene(kind="doming", opening=SIDES),
    "four midpoints": scene(solver=replace(QUASI_STATIC, quadrature="midpoint", contacts_per_interface=4)),
    "no strength": scene(joint=NO_STRENGTH),
    "no strength, on the steps of the increments": scene(
        joint=NO_STRENGTH, solver=replace(QUASI_STATIC, step_energy_tolerance=1e9)
    ),
    "strength left, few contacts": scene(
        joint=replace(WEAK, residual_cohesion=0.02e6), solver=replace(QUASI_STATIC, no_tension_subdivisions=1)
    ),
    "strength left": scene(joint=replace(WEAK, residual_cohesion=0.02e6)),
    "dilation": scene(kind="doming", joint=replace(WEAK, dilation=0.1)),
    "brittle shear": scene(kind="doming", joint=replace(WEAK, brittle_shear=True)),
}


@pytest.mark.quick_cases
@pytest.mark.parametrize("name", WALLS)
def test_small_walls_follow_the_same_path(name: str) -> None:
    model, wall = wall_model(WALLS[name]), WALLS[name]
    pairs = compare(model, wall.solver, wall.movement.increments, displacement=1e-5, stress=1e-4)
    for one, _ in pairs:
        assert np.abs(unbalanced(model, one)).max() <= 1.001 * one.residuals.unbalanced_force_ratio + 1e-8
        assert one.residuals.unbalanced_force_ratio < QUASI_STATIC.tolerance_used
    end = pairs[-1][0]
    assert (end.state == ContactState.CRACKED).sum() > 10, "nothing happened"
    assert np.abs(end.shear_stress).max() > 1e3


ZONES = replace(QUASI_STATIC, blocks="deformable")


def arch(stones: int, spread: float = 2e-3) -> Assembly:
    """Ring of wedges from 10 to 170 degrees; the springers move apart. Its joints have all inclinations."""
    wall = Assembly(joint=Joint(tensile_strength=0.05e6, cohesion=0.2e6))
    angles = np.deg2rad(np.linspace(10, 170, stones + 1))
    inner, outer = (3.0 + r * np.column_stack((np.cos(angles), np.sin(angles))) for r in (1.0, 1.2))
    for i in range(stones):
        wall.add_block([inner[i], outer[i], outer[i + 1], inner[i + 1]])
    for stone, side in ((0, 1.0), (stones - 1, -1.0)):
        wall.support(stone)
        wall.move(stone, x=side * spread, rotation=side * 1e-3)
    return wall


def wall_by_hand() -> Assembly:
    wall = Assembly(joint=WEAK)
    for course in range(4):
        edges = [0.0, 0.24, 0.48, 0.72, 0.96] if course % 2 else [0.0, 0.12, 0.36, 0.6, 0.84, 0.96]
        for left, right in itertools.pairwise(edges):
            wall.add_block(rectangle(left, 0.1 * course, right, 0.1 * (course + 1)), course=course)
    wall.rest_on_ground(range(5), lambda x: -2e-3 * (1 - ((x - 0.48) / 0.48) ** 2))
    return wall


def test_energies_of_the_half_are_doubled() -> None:
    model = model_of()
    whole = list(quasi_static.quasi_static_path(model, QUASI_STATIC, 4))[-1]
    part = reduce_by_symmetry(model)
    of_half = list(quasi_static.quasi_static_path(part, QUASI_STATIC, 4))[-1]
    unfolded = part.expand(of_half)
    for name in ("external_work", "elastic_energy", "friction_work", "released_energy"):
        assert getattr(unfolded.energy, name) == 2 * getattr(of_half.energy, name)
        assert getattr(unfolded.energy, name) == pytest.approx(getattr(whole.energy, name), rel=1e-4, abs=1e-3)
    assert unfolded.base_reaction == 2 * of_half.base_reaction
    assert unfolded.base_reaction == pytest.approx(whole.base_reaction, rel=1e-4, abs=1e-3)
    assert (unfolded.number, unfolded.counters) == (of_half.number, of_half.counters)


def test_geometry_is_halved_once_for_walls_that_share_it() -> None:
    walls = [model_of(joint=replace(WEAK, tensile_strength=strength)) for strength in (0.1e6, 0.12e6, 0.14e6)]
    assert len({id(reduce_by_symmetry(wall).geometry) for wall in walls}) == 1


def random_strengths() -> Model:
    walls = scene()
    joints = len(wall_model(walls).joints.x)
    return wall_model(walls, {"joint.tensile_strength": np.random.default_rng(1).uniform(0.05e6, 0.1e6, joints)})


def one_changed(name: str, factor: float = 0.99) -> Model:
    model = model_of()
    values = getattr(model.properties, name).copy()
    values[np.argmin(model.interfaces.x)] *= factor
    return replace(model, properties=model.properties._replace(**{name: values}))


def by_hand(change: Callable[[Assembly], object]) -> Model:
    wall = wall_by_hand()
    change(wall)
    return wall.build()


def test_zones_of_the_other_half_are_mirror_images() -> None:
    both, mirrored_half = np.zeros(2, dtype=np.int64), np.array([False, True])
    half = SimpleNamespace(gridpoint=both, zone=both, mirrored_gridpoint=mirrored_half, mirrored_zone=mirrored_half)
    whole = _unfolded(half, ZoneResults(np.array([[1.0, 2.0]]), np.array([[3.0, 4.0, 5.0, 6.0]]), np.array([7])))
    assert whole.displacement.tolist() == [[1.0, 2.0], [-1.0, 2.0]]
    assert whole.stress.tolist() == [[3.0, 4.0, 5.0, 6.0], [3.0, 4.0, -5.0, 6.0]]
    assert whole.state.tolist() == [7, 7]


def sheared_ground() -> Model:
    model = model_of()
    return replace(model, ground=model.ground.map(lambda state: state._replace(shear=np.full_like(state.shear, 1e-3))))


def shift_a_block(wall: Assembly) -> None:
    for left, right in ((0.0, 0.2), (0.76 + 1e-6, 0.96)):
        wall.add_block(rectangle(left, 0.4, right, 0.5))


def heavy_block() -> Model:
    model = model_of()
    load = model.supports.load.copy()
    load[1] *= 1.001
    return replace(model, supports=model.supports._replace(load=load))


def contacts_aside(way: float) -> Model:
    model = model_of()
    offset = model.interfaces.contact_offset.copy()
    offset[np.argmin(model.interfaces.x)] += way
    return replace(model, interfaces=model.interfaces._replace(contact_offset=offset))


def opposite_moves(**move: float) -> Model:
    wall = arch(10, spread=0.0)
    for stone in (0, 9):
        wall.move(stone, **move)
    return wall.build()


def one_stiff_brick() -> Model:
    model = model_of(solver=ZONES)
    modulus = model.block_law.elastic_modulus.copy()
    modulus[0] *= 2.0
    return replace(model, block_law=model.block_law._replace(elastic_modulus=modulus))


NOT_SYMMETRIC: dict[str, Callable[[], Model]] = {
    "random strengths": random_strengths,
    "one strength": lambda: one_changed("tensile_strength"),
    "one strength by little": lambda: one_changed("tensile_strength", 1 - 1e-12),
    "one stiffness": lambda: one_changed("normal_stiffness"),
    "one friction": lambda: one_changed("residual_friction"),
    "one bond that softens": lambda: replace(
        model_of(),
        properties=model_of().properties._replace(critical_opening=np.eye(1, len(model_of().interfaces.x))[0]),
    ),
    "window off the middle": lambda: model_of(opening=(replace(MIDDLE, x=0.72),)),
    "window by a hair": lambda: model_of(opening=(replace(MIDDLE, x=0.96 + 1e-6),)),
    "half bricks at one end": lambda: model_of(2.52),
    "lopsided movement": lambda: wall_model(
        replace(scene(), movement=Movement(shape="table", table=((0, 0), (0.3, 0.9), (0.5, 1), (1, 0))))
    ),
    "lopsided ground": lambda: by_hand(lambda wall: wall.rest_on_ground(range(5), lambda x: -2e-3 * x)),
    "ground that drags": sheared_ground,
    "one load": lambda: by_hand(lambda wall: wall.load(9, y=-100.0)),
    "pushed aside": lambda: by_hand(lambda wall: wall.load(9, x=1.0)),
    "turned": lambda: by_hand(lambda wall: wall.load(9, moment=1.0)),
    "one heavy block": heavy_block,
    "one support": lambda: by_hand(lambda wall: wall.support(5, y=False, rotation=False)),
    "one block aside": lambda: by_hand(shift_a_block),
    "contacts of one joint to one side": lambda: contacts_aside(1e-3),
    "contacts of one joint to the other": lambda: contacts_aside(-1e-3),
    "both springers to the right": lambda: opposite_moves(x=1e-3),
    "both springers turned alike": lambda: opposite_moves(rotation=1e-3),
    "leaning": lambda: by_hand(lambda wall: setattr(wall, "gravity", (0.5, -9.8))),
    "all blocks on the axis": lambda: stack(5, QUASI_STATIC),
    "one stiff brick": one_stiff_brick,
    "bricks of one cell, without a line along the axis": lambda: model_of(ODD, solver=replace(ZONES, zone_size=0.3)),
    "one dense block": lambda: replace(model_of(), density=np.where(np.arange(model_of().n_blocks) == 0, 1e3, 2e3)),
}


@pytest.mark.quick_cases
@pytest.mark.parametrize("name", NOT_SYMMETRIC)
def test_asymmetric_walls_are_solved_in_full(name: str) -> None:
    assert reduce_by_symmetry(NOT_SYMMETRIC[name]()) is None


def test_an_error_names_the_block_by_its_number_in_the_whole_wall() -> None:
    model = model_of()
    settings = Solver(method="explicit", maximum_cycles=50, ramp_cycles=50)
    part = reduce_by_symmetry(model)
    with pytest.raises(ConvergenceError) as of_half:
        list(explicit_path(part, settings, 1))
    with pytest.raises(ConvergenceError) as caught:
        list(solve_path(model, settings, 1))
    there, here = caught.value.block, of_half.value.block
    assert there != here
    assert (model.blocks.x[there], model.blocks.y[there]) == (part.blocks.x[here], part.blocks.y[here])
    assert caught.value.increment == of_half.value.increment
    assert str(caught.value) == str(of_half.value).replace(f"block {here} (", f"block {there} (")
