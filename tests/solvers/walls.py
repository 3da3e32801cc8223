"""Walls small enough for a test."""

import numpy as np

from damagepred.assembly import Assembly, Model, wall_model
from damagepred.assembly.assembly import rectangle
from damagepred.scene import Dpc, Joint, Loads, Movement, Opening, Scene, Solver, Wall


def stack(count: int, solver: Solver, thickness: float = 0.11) -> Model:
    """Blocks of 240 x 75 mm one on the other, the lowest on the ground."""
    tower = Assembly(thickness=thickness)
    for i in range(count):
        tower.add_block(rectangle(0.0, 0.075 * i, 0.24, 0.075 * (i + 1)), course=i)
    tower.rest_on_ground([0])
    return tower.build(solver)


def gridpoint_mass(model: Model) -> np.ndarray:
    """Mass of the gridpoints (g,) (kg): a third of each zone's that meets there (paper, after Eq. 7)."""
    mesh, law = model.mesh, model.block_law
    assert mesh is not None
    third = mesh.zone_area * law.thickness[mesh.zone_block] * model.density[mesh.zone_block] / 3.0
    return np.bincount(mesh.zones.ravel(), np.repeat(third, 3), mesh.x.size)


def small_scene(window_at: float | None = None, movement: Movement | None = None, **solver: float) -> Scene:
    """Wall of 2.4 x 0.9 m on a dpc for the explicit solver; the window, if any, at ``window_at`` from the left."""
    opening = () if window_at is None else (Opening(x=window_at, y=0.3, width=0.48, height=0.3),)
    return Scene(
        wall=Wall(length=2.4, height=0.9),
        opening=opening,
        dpc=Dpc(),
        movement=movement or Movement(central_deflection=2e-3, increments=4),
        loads=Loads(roof=1000.0),
        solver=Solver(**{"method": "explicit", "blocks": "rigid", "tolerance": 1e-2, **solver}),
    )


def small_wall(window_at: float | None = None, **solver: float) -> Model:
    return wall_model(small_scene(window_at, **solver))


def weak_pair(solver: Solver) -> Model:
    """Return a block that nothing holds up: it hangs from another by a joint without strength."""
    pair = Assembly(joint=Joint(tensile_strength=0.0, cohesion=0.0))
    top = pair.add_block(rectangle(0.0, 0.075, 0.24, 0.15))
    pair.add_block(rectangle(0.0, 0.0, 0.24, 0.075))
    pair.support(top)
    return pair.build(solver)
