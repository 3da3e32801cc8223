"""Walls in the state in which their kernels are timed."""

from collections.abc import Callable

import numba

from damagepred.assembly import wall_model
from damagepred.kernels.jit import FLAGS
from damagepred.kernels.zone.forces import zone_forces
from damagepred.scene import BlockMaterial, Dpc, Loads, Movement, Opening, Scene, Solver, Wall
from damagepred.solvers.explicit.scheme import DampedTimeStepping

EXPLICIT = Solver(method="explicit", blocks="rigid")
STRONG = BlockMaterial(cohesion=20e6, friction=0.75, tensile_strength=5e6)
WEAK = BlockMaterial(cohesion=0.06e6, friction=0.75, tensile_strength=0.03e6)


def intact() -> DampedTimeStepping:
    """Return the solid wall at rest under dead load."""
    scene = Scene(dpc=Dpc(), loads=Loads(roof=6000.0), solver=EXPLICIT)
    run = DampedTimeStepping(wall_model(scene), scene.solver)
    run.start_from_elastic_solution()
    return run


def cracked() -> DampedTimeStepping:
    """Return the wall with a window, still moving after a dishing of 4 mm."""
    scene = Scene(
        dpc=Dpc(),
        loads=Loads(roof=6000.0),
        opening=(Opening(x=2.55, y=0.9, width=0.9, height=1.5),),
        movement=Movement(kind="dishing", central_deflection=4e-3),
        solver=EXPLICIT,
    )
    run = DampedTimeStepping(wall_model(scene), scene.solver)
    run.advance(2000, load_factor_to=0.0, load_to=1.0)
    run.advance(4000, load_factor_to=1.0, load_to=1.0)
    return run


@numba.njit(**FLAGS)  # not kept: what a script leaves in the cache, a test that imports it could not load
def zones_alone(zones, displacement, force, cycles):
    for _ in range(cycles):
        zone_forces(zones, displacement, force)


def bent(block: BlockMaterial, size: Wall) -> DampedTimeStepping:
    """Return the wall of deformable blocks, still moving while it dishes by 1 mm."""
    movement = Movement(kind="dishing", central_deflection=1e-3)
    solver = Solver(method="explicit", blocks="deformable")
    loads = Loads(roof=6000.0)
    scene = Scene(wall=size, block=block, dpc=Dpc(), loads=loads, movement=movement, solver=solver)
    run = DampedTimeStepping(wall_model(scene), scene.solver)
    run.start_from_elastic_solution()
    run.advance(1500, load_factor_to=1.0, load_to=1.0)
    return run


def whole(run: DampedTimeStepping) -> Callable[[int], object]:
    return lambda cycles: run._cycle(cycles, run.load_share, run.load_factor, 0.0)


def alone(run: DampedTimeStepping) -> Callable[[int], object]:
    """Return a function that runs zones alone, at constant displacement."""
    zones, displacement, force = run.zones.packed[1], run.motion.displacement, run.motion.force.copy()
    return lambda cycles: zones_alone(zones, displacement, force, cycles)
