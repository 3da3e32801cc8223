"""Compilation of the kernels before workers start."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import Any

from damagepred.assembly import NO_LIMITS
from damagepred.errors import SolverError
from damagepred.one_wall.judged_path import follow, model_of, share_kernels
from damagepred.one_wall.solve import solve
from damagepred.scene import House, Loads, Movement, Scene


def warm_up(scene: Scene, rare: bool = True) -> None:
    """Compile the kernels for a scene, so that workers only load them; ``rare``: also kernels few walls need."""
    if isinstance(scene, House):
        scene = scene.scenes[0]
    left_out: dict[str, Any] = dict.fromkeys(("opening", "support", "load", "soil_layer"), ())
    left_out |= dict.fromkeys(("loading", "suction", "strain", "creep", "dynamics"))
    # small, with joints that open, slide and break, so that all kernels are compiled
    small = replace(
        scene,
        wall=replace(scene.wall, length=1.44, height=0.6, top=(), block_length=0.24, block_height=0.075),
        control_joint=tuple(replace(joint, x=0.72) for joint in scene.control_joint[:1]),
        dpc=replace(scene.dpc, course=1) if scene.dpc else None,
        movement=Movement(kind="dishing", central_deflection=20e-3, increments=1),
        loads=Loads(),
        solver=replace(scene.solver, footing="deformable" if scene.footing_model == "deformable" else None),
        **left_out,
    )
    runs, quasi_static = [], scene.solver.method == "quasi_static"
    if rare or not quasi_static:  # a wall that collapses moves by the explicit scheme, whatever the solver
        runs.append((small, replace(small.solver, method="explicit", tolerance=0.1)))
    if quasi_static:
        runs.append((small, small.solver))
        if scene.dpc is not None:
            runs.append((replace(small, dpc=None), small.solver))
        if not scene.movement.prescribed:
            on_ground = replace(  # a footing that bends freely until it cracks
                small,
                movement=replace(scene.movement, central_deflection=5e-3, increments=1, stage=(), seasons=None),
                mound=replace(scene.mound, surface_movement=0.02),
                rig=replace(scene.rig, supports=(), jacks=(), stop_at_zero=False),
                soil=replace(scene.soil, swelling_stiffness=1e8, shrinking_stiffness=1e8),
                solver=scene.solver,
            )
            runs.append((on_ground, scene.solver))
    for wall, solver in runs:
        with suppress(SolverError):
            list(follow(model_of(replace(wall, solver=solver)), solver, wall.damage, wall.movement.increment_count))
    if scene.dynamics is not None:
        brief = replace(scene.dynamics, duration=1e-3, outputs=1, base=())
        with suppress(SolverError):
            solve(replace(small, dynamics=brief), solver=scene.solver, limits=NO_LIMITS)
    share_kernels()
