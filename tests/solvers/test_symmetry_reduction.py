"""The expanded solution of half a symmetric wall is that of the whole wall; only symmetric walls are halved."""

import itertools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from damagepred.assembly import Assembly, Model, wall_model
from damagepred.assembly.assembly import rectangle
from damagepred.errors import ConvergenceError
from damagepred.scene import Joint, Loads, Movement, Opening, Scene, Solver, Wall
from damagepred.solvers import solve_path
from damagepred.solvers.explicit.stepper import explicit_path
from damagepred.solvers.symmetry import HalfModel, reduce_by_symmetry
from tests.solvers.walls import stack

QUASI_STATIC, EXPLICIT = Solver(method="quasi_static"), Solver(method="explicit", tolerance=1e-5)
WEAK = Joint(tensile_strength=0.1e6, cohesion=0.1e6)
EVEN, ODD = 2.4, 2.64
"""Lengths (m) with a perpend on the axis in the first course and a brick across it in the second, and the reverse."""
MIDDLE = Opening(x=0.96, y=0.3, width=0.48, height=0.3)


def scene(length: float = EVEN, bond: str = "running", kind: str = "dishing", **other: object) -> Scene:
    return Scene(
        wall=Wall(length=length, height=0.9, bond=bond),  # type: ignore[arg-type]
        movement=Movement(kind=kind, central_deflection=4e-3, increments=4),  # type: ignore[arg-type]
        **{"joint": WEAK, "loads": Loads(roof=1000.0), "solver": QUASI_STATIC, **other},  # type: ignore[arg-type]
    )


def model_of(length: float = EVEN, **other: object) -> Model:
    return wall_model(scene(length, **other))  # type: ignore[arg-type]


def halved(model: Model) -> HalfModel:
    found = reduce_by_symmetry(model)
    assert found is not None
    return found


# -- the mirror, found anew by looking for the nearest ----------------------------------------------------------------


def nearest(points: np.ndarray, axis: float) -> np.ndarray:
    image = points * (-1.0, 1.0) + (2 * axis, 0.0)
    distance = np.hypot(*(points[:, None] - image[None]).T)
    assert distance.min(axis=1).max() < 1e-9
    return distance.argmin(axis=1)


# -- the same path ----------------------------------------------------------------------------------------------------


ZONES = replace(QUASI_STATIC, blocks="deformable")


# -- by hand ----------------------------------------------------------------------------------------------------------


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


# -- what the half is -------------------------------------------------------------------------------------------------


def test_geometry_is_halved_once_for_walls_that_share_it() -> None:
    walls = [model_of(joint=replace(WEAK, tensile_strength=strength)) for strength in (0.1e6, 0.12e6, 0.14e6)]
    assert len({id(halved(wall).geometry) for wall in walls}) == 1


# -- what is not halved -----------------------------------------------------------------------------------------------


def random_strengths() -> Model:
    walls = scene()
    joints = len(wall_model(walls).joints.x)
    return wall_model(walls, {"joint.tensile_strength": np.random.default_rng(1).uniform(0.05e6, 0.1e6, joints)})


def one_changed(name: str, factor: float = 0.99) -> Model:
    model = model_of()
    values = getattr(model.properties, name).copy()
    values[np.argmin(model.interfaces.x)] *= factor
    return replace(model, properties=model.properties._replace(**{name: values}))


def pushed(**load: float) -> Model:
    wall = wall_by_hand()
    wall.load(9, **load)
    return wall.build()


def held(block: int) -> Model:
    wall = wall_by_hand()
    wall.support(block, y=False, rotation=False)
    return wall.build()


def lopsided_ground() -> Model:
    wall = wall_by_hand()
    wall.rest_on_ground(range(5), lambda x: -2e-3 * x)
    return wall.build()


def sheared_ground() -> Model:
    model = model_of()
    return replace(model, ground=model.ground.map(lambda state: state._replace(shear=np.full_like(state.shear, 1e-3))))


def shifted_block() -> Model:
    wall = wall_by_hand()
    wall.add_block(rectangle(0.0, 0.4, 0.2, 0.5))
    wall.add_block(rectangle(0.76 + 1e-6, 0.4, 0.96, 0.5))
    return wall.build()


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
    "lopsided ground": lopsided_ground,
    "ground that drags": sheared_ground,
    "one load": lambda: pushed(y=-100.0),
    "pushed aside": lambda: pushed(x=1.0),
    "turned": lambda: pushed(moment=1.0),
    "one heavy block": heavy_block,
    "one support": lambda: held(5),
    "one block aside": shifted_block,
    "contacts of one joint to one side": lambda: contacts_aside(1e-3),
    "contacts of one joint to the other": lambda: contacts_aside(-1e-3),
    "both springers to the right": lambda: opposite_moves(x=1e-3),
    "both springers turned alike": lambda: opposite_moves(rotation=1e-3),
    "leaning": lambda: leaning(),
    "all blocks on the axis": lambda: stack(5, QUASI_STATIC),
    "one stiff brick": lambda: one_stiff_brick(),
    "bricks of one cell, without a line along the axis": lambda: model_of(ODD, solver=replace(ZONES, zone_size=0.3)),
    "one dense block": lambda: replace(model_of(), density=np.where(np.arange(model_of().n_blocks) == 0, 1e3, 2e3)),
}


def one_stiff_brick() -> Model:
    model = model_of(solver=ZONES)
    modulus = model.block_law.elastic_modulus.copy()
    modulus[0] *= 2.0
    return replace(model, block_law=model.block_law._replace(elastic_modulus=modulus))


def leaning() -> Model:
    wall = wall_by_hand()
    wall.gravity = (0.5, -9.8)
    return wall.build()


@pytest.mark.quick_cases
@pytest.mark.parametrize("name", NOT_SYMMETRIC)
def test_asymmetric_walls_are_solved_in_full(name: str) -> None:
    assert reduce_by_symmetry(NOT_SYMMETRIC[name]()) is None


# -- the solvers' side ------------------------------------------------------------------------------------------------


def test_an_error_names_the_block_by_its_number_in_the_whole_wall() -> None:
    model = model_of()
    settings = Solver(method="explicit", maximum_cycles=50, ramp_cycles=50)
    part = halved(model)
    with pytest.raises(ConvergenceError) as of_half:
        list(explicit_path(part, settings, 1))
    with pytest.raises(ConvergenceError) as caught:
        list(solve_path(model, settings, 1))
    there, here = caught.value.block, of_half.value.block
    assert there != here
    assert (model.blocks.x[there], model.blocks.y[there]) == (part.blocks.x[here], part.blocks.y[here])
    assert caught.value.increment == of_half.value.increment
    assert str(caught.value) == str(of_half.value).replace(f"block {here} (", f"block {there} (")
