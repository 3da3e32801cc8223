"""Solve one wall."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import xarray as xr

from damagepred.archive.cautions import TOLERANCES
from damagepred.archive.provenance import given_values
from damagepred.archive.schema import is_dynamic
from damagepred.arrays import FloatArray
from damagepred.assembly import NO_LIMITS, Assembly, Limits, wall_cost
from damagepred.assembly.house import HouseModel
from damagepred.enumerations import PathStatus
from damagepred.errors import InputError, SolverError, require_count, require_one_of
from damagepred.inputs.arguments import checked
from damagepred.one_wall.dataset import collect, ending_attributes
from damagepred.one_wall.house import collect_house, follow_scene
from damagepred.one_wall.judged_path import (
    Step,
    dynamic_run,
    follow,
    model_of,
    whole_interfaces,
    without_zone_fields,
)
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.runtime.time_limit import interrupts_between_kernels, time_limit
from damagepred.scene import Damage, Dynamics, House, Movement, Scene, Solver
from damagepred.scene.plausibility import require_possible
from damagepred.solvers.options import SolverOptions

if TYPE_CHECKING:
    from damagepred.solvers.dynamics.run import DynamicRun


@checked
@one_blas_thread()
def solve(
    scene: Scene | Assembly,
    *,
    increments: int | None = None,
    solver: Solver | None = None,
    damage: Damage | None = None,
    dynamics: Dynamics | None = None,
    fields: Mapping[str, FloatArray] | None = None,
    on_failure: str = "raise",
    on_step: Callable[[Step], None] | None = None,
    store_zones: bool = True,
    limits: Limits = Limits(),  # noqa: B008 - frozen
) -> xr.Dataset:
    """Solve one wall, or a house, and return its path as a dataset.

    Parameters
    ----------
    scene : Scene or Assembly
        Wall, or a ``House``: its dataset also has the dimensions ``wall`` and ``corner``, and ``block_wall`` has the
        wall of each block; ``damagepred.results.house.wall_dataset`` takes out one wall.
    increments : int, optional
        Number of steps of the movement; by default the scene's, 20 for an assembly.
    solver, damage : Solver, Damage, optional
        Settings that replace the scene's.
    dynamics : Dynamics, optional
        Settings that replace the scene's: a run in physical time with large displacements. Increments are its
        outputs, at the coordinate ``time`` (s).
    fields : mapping of str to array (joints,), optional
        Values of each joint, for a scene only; see ``damagepred.assembly.wall_model``.
    on_failure : {"raise", "return"}
        When an increment cannot be solved or the user interrupts: raise, or return the increments before, with the
        attributes ``status = "failed"`` or ``"interrupted"`` and ``status_message``.
    on_step : callable, optional
        Called with each ``Step``.
    store_zones : bool
        Store stress, state and gridpoints of zones; with False, only the number of yielding zones.
    limits : Limits
        Highest estimated memory and time, and time limit of the path; ``NO_LIMITS`` for none.

    Returns
    -------
    xarray.Dataset
        Dimensions ``increment`` with ``block``, ``contact``, ``opening`` or ``vertex``, and with ``zone`` and
        ``gridpoint`` where blocks are deformable; SI units; see ``damagepred.archive.schema.VARIABLES``. The attribute
        ``status`` is complete, collapsed, failed or interrupted; ``solver_method`` is the solver. For a collapsed wall,
        ``collapse_progress`` is the progress of the last equilibrium, the collapse multiplier of a live load, and
        collapse follows within ``collapse_progress_uncertainty``. For a footing whose jacks or outer supports lose
        all load before the full movement, ``limit`` is ``"jacks"`` or ``"supports"``, ``limit_deflection`` in m.

    Raises
    ------
    InputError
        If the scene or an option is invalid, or the estimated cost exceeds the limits.
    SolverError
        If an increment cannot be solved and ``on_failure = "raise"``.

    Examples
    --------
    >>> import damagepred
    >>> wall = damagepred.solve(damagepred.Scene.from_toml("wall.toml"), increments=4)
    >>> wall.sizes["increment"], int(wall["damage_category"][-1])
    (5, 3)
    """
    if not isinstance(scene, Scene | Assembly):
        raise InputError(f"scene: is of type {type(scene).__name__}; give a Scene or an Assembly.")
    if increments is not None:
        require_count("increments", increments)
    require_one_of("on_failure", on_failure, ("raise", "return"))
    with time_limit(limits.time), interrupts_between_kernels():
        if isinstance(scene, Scene):
            if limits is not NO_LIMITS:  # a wall of a study is as it was sampled
                require_possible(scene, {}, "scene")
            settings, judged = solver or scene.solver, damage or scene.damage
            dynamics = dynamics or scene.dynamics
            settings = settings if dynamics is None else whole_interfaces(settings)
            described = replace(scene, solver=settings, damage=judged, dynamics=dynamics)
            count = increments or scene.movement.increment_count
            if scene.movement.stage and count != scene.movement.increment_count:
                raise InputError(f"increments = {increments}: the stages of the movement have their own; leave it out.")
            wall_cost(described, count).require(limits)
            attributes: dict[str, object] = {"title": scene.title, "scene": described.to_toml()}
            attributes |= given_values(scene.given)
        else:
            settings, judged = solver or Solver(), damage or Damage()
            settings = settings if dynamics is None else whole_interfaces(settings)
            count = increments or Movement().increments
            SolverOptions.of(settings)  # refused before anything is solved
            model = scene.build(settings)
            attributes = {"title": "assembly of blocks"}
        run: DynamicRun | None = None
        if isinstance(scene, Scene) and dynamics is not None:
            model = model_of(described, fields)
        if dynamics is not None:
            run, count = dynamic_run(model, settings, dynamics), dynamics.outputs
            attributes |= run.attributes()
        steps: list[Step] = []
        status, message = PathStatus.COMPLETE, None
        if isinstance(scene, Scene) and run is None:
            path = follow_scene(described, fields, count)
        else:
            path = ((model, step) for step in follow(model, settings, judged, count, run))
        try:
            for solved, step in path:
                if step.increment.number == 0:  # also of a path that starts again because a brick breaks
                    model = solved
                    steps.clear()
                steps.append(step if store_zones else without_zone_fields(step))
                if on_step is not None:
                    on_step(step)
            if steps[-1].increment.collapsed:
                status = PathStatus.COLLAPSED
                first = next(s.increment for s in steps if s.increment.collapsed)
                attributes["collapse_increment"] = first.number
                if first.motion is not None:
                    message = f"part of the wall collapsed by {first.motion.time:.4g} s"
                else:
                    message, stable = f"part of the wall collapsed in increment {first.number}", first.end
                    attributes["collapse_progress"] = stable.last_stable_load_factor
                    attributes["collapse_progress_uncertainty"] = first.load_factor - stable.last_stable_load_factor
        except (SolverError, KeyboardInterrupt) as error:
            if on_failure == "raise" or not steps:
                raise
            status = PathStatus.FAILED if isinstance(error, SolverError) else PathStatus.INTERRUPTED
            message = str(error) or f"stopped after increment {steps[-1].increment.number} of {count}"
        method = settings.method if run is None else "dynamic"
        ending: dict[str, object] = {"status": status.value, "status_message": message, "solver_method": method}
        ending |= {name: getattr(settings, name) for name in (*TOLERANCES.values(), "snap_through_tolerance")}
        ending |= ending_attributes(model, steps[-1])
        if isinstance(scene, House) and isinstance(model, HouseModel):
            return collect_house(scene, model, steps, judged, settings, attributes | ending)
        openings = scene.opening if isinstance(scene, Scene) else ()
        ds = collect(model, steps, judged, settings, attributes | ending, store_zones, openings)
        if "time" in ds and not is_dynamic(ds):
            ds["time"].attrs["units"] = "year"
        return ds
