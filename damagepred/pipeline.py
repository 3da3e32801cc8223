"""One wall from description to verdict: assemble, solve, judge, collect."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from damagepred.archive.cautions import TOLERANCES, energy_error_share, implausible, snap_through_share
from damagepred.archive.provenance import given_values, provenance
from damagepred.archive.schema import CATEGORY_VARIABLES, WORST_CATEGORY, dataset, is_dynamic, name_categories
from damagepred.arguments import checked
from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Assembly, Limits, Model, wall_cost, wall_model
from damagepred.assembly.model import LaboratoryTest
from damagepred.damage import (
    GROUP_COUNTS,
    Frames,
    JointMap,
    Rules,
    SightLines,
    Verdict,
    judge,
)
from damagepred.diagnostics import Counters, Energies, Residuals, described
from damagepred.enumerations import ContactKind, ContactState, PathStatus, ZoneState
from damagepred.errors import InputError, SolverError, require_count, require_one_of
from damagepred.kernels.jit import CACHE
from damagepred.one_thread import each_with_one_blas_thread, one_blas_thread
from damagepred.scene import Damage, Dynamics, Movement, Scene, Solver
from damagepred.scene.movement import History
from damagepred.solvers import Increment, solve_path
from damagepred.solvers.options import SolverOptions
from damagepred.solvers.system.footing_forces import section_forces, section_interfaces, support_loads
from damagepred.time_limit import time_limit

if TYPE_CHECKING:
    from damagepred.solvers.dynamics.run import DynamicRun


class Step(NamedTuple):
    """One increment, judged.

    Attributes
    ----------
    increment : Increment
        Equilibrium.
    verdict : Verdict
        Cracks and category; the highest category once part of the wall has collapsed.
    """

    increment: Increment
    verdict: Verdict


class Gauges(NamedTuple):
    """What a wall is measured with: where its joints, its courses and the corners of its openings lie."""

    joints: JointMap
    lines: SightLines
    frames: Frames


_KNOWN: list[tuple[Model, Gauges]] = []
"""Gauges of the last models: samples of one geometry share them."""


def gauges(model: Model) -> Gauges:
    """Return what a model is measured with; that of another model of the very same geometry, if there was one."""
    parts = (model.interfaces, model.blocks, model.jambs)
    for other, known in _KNOWN:
        if all(a is b for a, b in zip(parts, (other.interfaces, other.blocks, other.jambs))):
            return known
    blocks, jambs, joints = model.blocks, model.jambs, joint_map(model)
    centroid = np.column_stack((blocks.x, blocks.y))
    made = Gauges(
        joints,
        SightLines.of_blocks(blocks.x, blocks.y, blocks.course, joints.dpc_level),
        Frames(jambs.block, jambs.arm, centroid[jambs.block] + jambs.arm),
    )
    _KNOWN[:] = [(model, made), *_KNOWN[:3]]
    return made


def joint_map(model: Model) -> JointMap:
    """Return the joints of a model as damage assessment takes them."""
    face = model.interfaces
    tangent = np.stack((face.normal_y, -face.normal_x), axis=-1)
    return JointMap.from_contacts(
        face.x[:, None] + tangent[:, :1] * face.contact_offset,
        face.y[:, None] + tangent[:, 1:] * face.contact_offset,
        face.contact_area * (face.length / face.contact_area.sum(axis=1))[:, None],
        np.column_stack((face.normal_x, face.normal_y)),
        face.kind,
        np.column_stack((face.block_a, face.block_b)),
    )


@each_with_one_blas_thread
def follow(
    model: Model, solver: Solver, damage: Damage, increments: int, run: Iterable[Increment] | None = None
) -> Iterator[Step]:
    """Follow the movement and judge each increment; stop taking steps to stop the solver."""
    joints = gauges(model).joints
    rules = Rules.from_settings(**asdict(damage))
    for increment in solve_path(model, solver, increments) if run is None else run:
        cracked = increment.state == ContactState.CRACKED
        verdict = judge(joints, increment.opening, increment.slip, cracked, rules)
        if increment.collapsed:
            verdict = verdict._replace(damage_category=rules.table.highest, damage_category_band=rules.table.highest)
        yield Step(increment, verdict)


@one_blas_thread()
def model_of(scene: Scene, fields: Mapping[str, FloatArray] | None = None, increments: int | None = None) -> Model:
    """Return the model of a scene; with ``blocks = "auto"`` those blocks are deformable that need it."""

    def build(solver: Solver, chosen: frozenset[int] | None) -> Model:
        return wall_model(replace(scene, solver=solver), fields, chosen)

    settings = scene.solver if scene.dynamics is None else _whole_interfaces(scene.solver)
    return assembled(build, settings, increments or scene.movement.increment_count)


@one_blas_thread()
def assembled(build: Callable[[Solver, frozenset[int] | None], Model], settings: Solver, increments: int) -> Model:
    """Build a model; with ``blocks = "auto"`` select the deformable blocks first, by a rigid run."""
    SolverOptions.of(settings)  # refused before anything is solved
    if settings.blocks != "auto":
        return build(settings, None)
    from damagepred.solvers.zone_selection import blocks_needing_zones

    return build(settings, blocks_needing_zones(build, settings, increments))


def share_kernels() -> None:
    """Let processes that begin from now on load what is compiled."""
    if CACHE is not None:
        CACHE.publish()


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
    """Solve one wall and return all that is known of it.

    Parameters
    ----------
    scene : Scene or Assembly
        What to solve.
    increments : int, optional
        Number of steps of the movement; by default the scene's, 20 for an assembly.
    solver, damage : Solver, Damage, optional
        In place of the scene's.
    dynamics : Dynamics, optional
        In place of the scene's: a run in physical time, with the blocks moving as far as they like. Its outputs are
        the increments, and the coordinate ``time`` (s) tells when they are.
    fields : mapping of str to array (joints,), optional
        Values that vary from joint to joint; see ``damagepred.assembly.wall_model``. Only for a scene.
    on_failure : {"raise", "return"}
        What to do when an increment cannot be solved, or the user interrupts: raise, or return what was reached, with
        the attributes ``status = "failed"`` or ``"interrupted"`` and ``status_message``.
    on_step : callable, optional
        Called with each ``Step`` as it is reached.
    store_zones : bool
        Whether to return stress, state and gridpoints of the zones of deformable blocks; False saves their memory and
        still counts the zones that yield.
    limits : Limits
        Estimated cost above which a scene is refused, and time limit of its path; ``NO_LIMITS`` lifts them.

    Returns
    -------
    xarray.Dataset
        Dimensions ``increment`` with ``block``, ``contact``, ``opening`` or ``vertex``, and with ``zone`` and
        ``gridpoint`` where blocks are deformable; SI units; see ``damagepred.archive.schema.VARIABLES``. The attribute
        ``status`` is complete, collapsed, failed or interrupted; ``solver_method`` tells which solver it was. Of a wall
        that collapsed, ``collapse_progress`` is the progress of the last equilibrium that was found, the collapse
        multiplier of a live load, and it fell at most ``collapse_progress_uncertainty`` later. Of a footing whose jacks
        or outer supports carry nothing before the full movement, ``limit`` says which, ``limit_deflection`` where (m).

    Raises
    ------
    InputError
        If the scene makes no wall, costs more than the limits, or an option is not acceptable.
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
    with time_limit(limits.time):
        return _solve(scene, increments, solver, damage, dynamics, fields, on_failure, on_step, store_zones, limits)


def _solve(
    scene: Scene | Assembly,
    increments: int | None,
    solver: Solver | None,
    damage: Damage | None,
    dynamics: Dynamics | None,
    fields: Mapping[str, FloatArray] | None,
    on_failure: str,
    on_step: Callable[[Step], None] | None,
    store_zones: bool,
    limits: Limits,
) -> xr.Dataset:
    if isinstance(scene, Scene):
        settings, judged = solver or scene.solver, damage or scene.damage
        dynamics = dynamics or scene.dynamics
        settings = settings if dynamics is None else _whole_interfaces(settings)
        described = replace(scene, solver=settings, damage=judged, dynamics=dynamics)
        count = increments or scene.movement.increment_count
        if scene.movement.stage and count != scene.movement.increment_count:
            raise InputError(f"increments = {increments}: the stages of the movement have their own; leave it out.")
        wall_cost(described, count).require(limits)
        model = model_of(described, fields, count)
        attributes: dict[str, object] = {
            "title": scene.title,
            "scene": described.to_toml(),
            **given_values(scene.given),
        }
    else:
        settings, judged = solver or Solver(), damage or Damage()
        settings = settings if dynamics is None else _whole_interfaces(settings)
        count = increments or Movement().increments
        model = assembled(lambda solver, chosen: scene.build(solver, deformable=chosen), settings, count)
        attributes = {"title": "assembly of blocks"}
    run: DynamicRun | None = None
    if dynamics is not None:
        run, count = dynamic_run(model, settings, dynamics), dynamics.outputs
        attributes |= run.attributes()
    steps: list[Step] = []
    status, message = PathStatus.COMPLETE, None
    try:
        for step in follow(model, settings, judged, count, run):
            steps.append(step if store_zones else without_zone_fields(step))
            if on_step is not None:
                on_step(step)
        if steps[-1].increment.collapsed:
            status = PathStatus.COLLAPSED
            last = steps[-1].increment
            message = f"part of the wall collapsed in increment {last.number}"
            attributes["collapse_increment"] = last.number
            if run is not None:
                first = next(s.increment for s in steps if s.increment.collapsed)
                message = f"part of the wall collapsed by {first.time:.4g} s"
                attributes["collapse_increment"] = first.number
            else:
                attributes["collapse_progress"] = last.last_stable_load_factor
                attributes["collapse_progress_uncertainty"] = last.load_factor - last.last_stable_load_factor
    except (SolverError, KeyboardInterrupt) as error:
        if on_failure == "raise" or not steps:
            raise
        status = PathStatus.FAILED if isinstance(error, SolverError) else PathStatus.INTERRUPTED
        message = str(error) or f"stopped after increment {steps[-1].increment.number} of {count}"
    method = settings.method if run is None else "dynamic"
    ending: dict[str, object] = {"status": status.value, "status_message": message, "solver_method": method}
    ending |= {name: getattr(settings, name) for name in (*TOLERANCES.values(), "snap_through_tolerance")}
    ending |= _ending(model, steps[-1])
    ds = _collect(model, steps, judged, settings, attributes | ending, store_zones)
    if "time" in ds and not is_dynamic(ds):
        ds["time"].attrs["units"] = "year"
    if isinstance(scene, Scene) and scene.opening:
        for name, key in (("left", "x"), ("sill", "y"), ("width", "width"), ("height", "height")):
            ds[f"opening_{name}"].values[:] = [getattr(hole, key) for hole in scene.opening]
    return ds


def dynamic_run(model: Model, settings: Solver, dynamics: Dynamics) -> DynamicRun:
    """Prepare a run in physical time from the static equilibrium under dead load, unless that is not wanted."""
    from damagepred.solvers.dynamics.run import DynamicRun, require_supported
    from damagepred.solvers.quasi_static.static_equilibrium import static_equilibrium

    require_supported(model, settings, dynamics)
    initial = static_equilibrium(model, settings) if dynamics.start == "equilibrium" else None
    return DynamicRun(model, dynamics, initial, SolverOptions.of(settings).dynamics)


def _whole_interfaces(settings: Solver) -> Solver:
    """Return the settings of a dynamic run: blocks rock on their corners, where contacts are, and each costs time."""
    return replace(settings, no_tension_subdivisions=settings.no_tension_subdivisions or 1)


@one_blas_thread()
def path_values(model: Model, steps: list[Step]) -> dict[str, FloatArray]:
    """Return what is known of each increment as a whole: arrays (increments,), (increments, openings or groups).

    Of all there is ``group_count`` alone, the coordinate of ``crack_group_width``, does not begin with increments.
    """
    joints, lines, frames = gauges(model)
    moved = _stacked(steps, "displacement")
    progress = _stacked(steps, "load_factor")
    deflection = np.abs(progress) * model.central_deflection
    if model.deflection is not None:
        deflection = np.abs([s.increment.deflection for s in steps])
    in_time = bool(np.isfinite(steps[0].increment.time))
    values = {
        "progress": progress,
        "central_deflection": deflection,
        "deflection_ratio": deflection / model.span,
        **_diagnostics(steps, in_time),
        "base_reaction": _stacked(steps, "base_reaction"),
        **(frames.distortion(moved)._asdict() if len(model.jambs.block) else {}),
        **lines.deviation(moved)._asdict(),
        "group_count": np.array(GROUP_COUNTS, dtype=np.int64),
    }
    control = model.interfaces.kind == ContactKind.CONTROL_JOINT
    if control.any():
        for way, name in ((1.0, "opening"), (-1.0, "closing")):
            most = [float(joints.widest(way * s.increment.opening)[control].max()) for s in steps]
            values[f"control_joint_{name}_max"] = np.maximum(most, 0.0)
    if model.surface_movement is not None:
        values["surface_movement"] = np.abs(progress) * model.surface_movement
    if model.test is not None:
        values |= _test_values(model, model.test, steps)
    elif model.jacks is not None:
        values["jack_load"] = _stacked(steps, "jack_load")
    if in_time:
        values |= {name: _stacked(steps, name) for name in ("time", "searches")}
        values["base_displacement_x"], values["base_displacement_y"] = _stacked(steps, "base").T
    if model.mesh is not None:
        values |= _zone_counts(steps)
    for name in Verdict._fields:
        values[name] = np.array([getattr(s.verdict, name) for s in steps])
    if model.history is not None:
        values |= history_values(model.history, len(steps))
        values["crack_width_worst"] = np.maximum.accumulate(values["crack_width_max"])
    for name in CATEGORY_VARIABLES:
        values[name] = values[name].astype(np.int8)
    if model.history is not None:
        values[WORST_CATEGORY] = np.maximum.accumulate(values["damage_category"])
    return values


def history_values(history: History, count: int) -> dict[str, FloatArray | IntArray]:
    """Return stage and, where they are known, time and strain of the first increments of a history."""
    columns = {name: getattr(history, name) for name in ("stage", "time", "strain")}
    return {name: column[:count] for name, column in columns.items() if column is not None}


def _diagnostics(steps: list[Step], in_time: bool) -> dict[str, FloatArray]:
    """Return the diagnostics of each increment; what only dynamic runs have is left out of other paths."""
    increments = [s.increment for s in steps]
    records: dict[type, list[Any]] = {
        Residuals: increments,
        Counters: [i.counters for i in increments],
        Energies: [i.energy for i in increments],
    }
    return {
        name: np.array([getattr(one, name) for one in values])
        for record, values in records.items()
        for name, diagnostic in described(record).items()
        if in_time or not diagnostic.in_time
    }


def matrix_bytes(model: Model, solver: Solver) -> int:
    """Return what the matrices of the quasi-static solver take (bytes): those of all fronts, dense."""
    if solver.method != "quasi_static":
        return 0
    from damagepred.solvers.quasi_static.elimination_tree import EliminationTree
    from damagepred.solvers.quasi_static.superelements import Superelements
    from damagepred.solvers.symmetry import reduce_by_symmetry
    from damagepred.solvers.system.discrete_system import DiscreteSystem

    options = SolverOptions.of(solver)
    half = reduce_by_symmetry(model, options.symmetry) if solver.symmetric_half else None
    solved = model if half is None else half
    system = DiscreteSystem.of(solved, options.elastic_solution)
    blocks = None if solved.mesh is None else Superelements(system, options.newton.interior_tolerance)
    return 8 * EliminationTree.of(system, blocks, options.linear_system).matrix_entries


def shares_of_size(model: Model, steps: list[Step]) -> dict[str, float]:
    """Return how far blocks move beyond the ground, and the widest crack, over the larger of length and height.

    Increments in which the wall has collapsed do not count; a run in time, in which blocks may move as far as they
    like, has neither: then they are NaN.
    """
    standing = [s for s in steps if not s.increment.collapsed]
    if not standing or np.isfinite(standing[0].increment.time):
        return dict.fromkeys(("displacement_share", "crack_share"), float("nan"))
    size = max(float(np.ptp(along)) for along in model.blocks.vertices.T)
    x, y, _ = np.moveaxis(_stacked(standing, "displacement"), -1, 0)
    moved = float(np.sqrt((x**2 + y**2).max()))
    given = [state.largest() for state in model.ground.states()]
    given += [float(np.abs(model.supports.prescribed_displacement).max(initial=0.0)), model.central_deflection]
    widest = max(max(s.verdict.crack_width_max, s.verdict.crack_band_width_max) for s in standing)
    return {"displacement_share": max(moved - max(given), 0.0) / size, "crack_share": float(widest) / size}


def without_zone_fields(step: Step) -> Step:
    """Return an increment with only the states of its zones, for the memory that the rest takes."""
    zones = step.increment.zones
    if zones is None:
        return step
    light = zones._replace(displacement=np.empty((0, 2)), stress=np.empty((0, 4)))
    return step._replace(increment=replace(step.increment, zones=light))


def _stacked(steps: list[Step], name: str) -> NDArray:
    """Return a field of all increments, one after the other."""
    return np.array([getattr(s.increment, name) for s in steps])


def _test_values(model: Model, test: LaboratoryTest, steps: list[Step]) -> dict[str, FloatArray]:
    """Return what a laboratory test measures, from the dead load on, by variable."""
    moved = _stacked(steps, "displacement").reshape(len(steps), -1)
    moved = moved - moved[0]
    force = _stacked(steps, "load_factor") * test.force
    if model.jacks is not None:
        force = _stacked(steps, "jack_load")
        force[0] = 0.0
        force[[step.increment.collapsed for step in steps]] = np.nan  # in motion
    values = {"load_force": force, "load_displacement": moved @ test.push}
    if test.gauge is not None:
        values["gauge_opening"] = moved @ test.gauge
    return values


def _footing_values(model: Model, steps: list[Step]) -> dict[str, FloatArray]:
    """Return what is known of a footing that is part of the model, by variable."""
    values: dict[str, FloatArray] = {}
    if model.footing is None:
        return values
    here = section_interfaces(model)
    if here.size:
        found = section_forces(model, *(_stacked(steps, n) for n in ("opening", "normal_stress", "shear_stress")))
        values["section_x"] = model.interfaces.x[here]
        values |= {f"section_{name}": getattr(found, name) for name in found._fields}
    if model.jacks is not None:
        at, load = support_loads(model, _stacked(steps, "normal_stress"))
        values |= {"support_x": at, "support_load": load, "jack_x": model.jacks.at}
    return values


def _ending(model: Model, last: Step) -> dict[str, object]:
    """Return, as attributes, at which limit a path ended early."""
    ended = last.increment.ended
    if not ended or model.jacks is None:
        return {}
    if model.test is not None:
        return {"limit": "loads", "status_message": "the load has fallen to nothing"}
    deflection = abs(last.increment.deflection)
    what = "the jacks carry" if ended == "jacks" else "an outer support carries"
    return {
        "limit": ended,
        "limit_deflection": deflection,
        "status_message": f"{what} nothing any more at a deflection of {1e3 * deflection:.3g} mm",
    }


def _zone_counts(steps: list[Step]) -> dict[str, NDArray]:
    """Return how many zones yield, and how, in each increment: arrays (increments,)."""
    kinds = {
        "zones_in_shear": (ZoneState.SHEAR, ZoneState.SHEAR_AND_TENSION),
        "zones_in_tension": (ZoneState.TENSION, ZoneState.SHEAR_AND_TENSION),
        "zones_yielded_before": (ZoneState.YIELDED,),
    }
    pictures = [s.increment.zones for s in steps]
    return {
        name: np.array([0 if p is None else np.isin(p.state, states).sum() for p in pictures], dtype=np.int64)
        for name, states in kinds.items()
    }


def _zone_values(model: Model, steps: list[Step]) -> dict[str, NDArray]:
    """Return all that is known of zones and gridpoints, by variable."""
    mesh = model.mesh
    pictures = [s.increment.zones for s in steps if s.increment.zones is not None]
    if mesh is None or len(pictures) < len(steps):
        return {}
    # component by component, so that all of the largest arrays is not held twice
    moved = {
        f"gridpoint_displacement_{axis}": np.array([p.displacement[:, i] for p in pictures])
        for i, axis in enumerate("xy")
    }
    stress = {
        f"zone_stress_{name}": np.array([p.stress[:, i] for p in pictures])
        for i, name in enumerate(("xx", "yy", "xy", "zz"))
    }
    return {
        "zone_mesh": np.array(0, dtype=np.int32),
        "gridpoint_x": mesh.x,
        "gridpoint_y": mesh.y,
        "gridpoint_block": mesh.gridpoint_block,
        "zone_gridpoint": mesh.zones.astype(np.int32),
        "zone_block": mesh.zone_block,
        **moved,
        **stress,
        "zone_state": np.array([p.state for p in pictures]),
    }


def _strain_values(steps: list[Step]) -> dict[str, NDArray]:
    """Return strain and curvature of elastic blocks, by variable."""
    strains = [s.increment.strain for s in steps if s.increment.strain is not None]
    if len(strains) < len(steps):
        return {}
    return {name: np.array([s[:, i] for s in strains]) for i, name in enumerate(("block_strain", "block_curvature"))}


def _collect(
    model: Model,
    steps: list[Step],
    damage: Damage,
    settings: Solver,
    attributes: Mapping[str, object],
    store_zones: bool,
) -> xr.Dataset:
    blocks, face, joints = model.blocks, model.interfaces, gauges(model).joints
    per_joint = face.contact_area.shape[1]
    openings = len(model.jambs.block)
    rules = Rules.from_settings(**asdict(damage))

    zoning: dict[str, object] = {}
    if model.mesh is not None:
        zoning = {"deformable_blocks": len(model.mesh.block), "zones": len(model.mesh.zones), "plane": model.plane}

    def at_contacts(name: str) -> NDArray:
        return _stacked(steps, name).reshape(len(steps), -1)

    def spread(values: NDArray) -> NDArray:
        return np.repeat(values, per_joint)

    moved = _stacked(steps, "displacement")
    unknown = np.full_like(moved[0], np.nan)
    support = np.array([unknown if s.increment.support_force is None else s.increment.support_force for s in steps])
    values = {
        "increment": _stacked(steps, "number").astype(np.int64),
        **path_values(model, steps),
        **{f"opening_{name}": np.full(openings, np.nan) for name in ("left", "sill", "width", "height") if openings},
        "block_x": blocks.x,
        "block_y": blocks.y,
        "block_course": blocks.course,
        "block_displacement_x": moved[..., 0],
        "block_displacement_y": moved[..., 1],
        "block_rotation": moved[..., 2],
        **_strain_values(steps),
        "block_support_force_x": support[..., 0],
        "block_support_force_y": support[..., 1],
        "block_support_moment": support[..., 2],
        "vertex_x": blocks.vertices[:, 0],
        "vertex_y": blocks.vertices[:, 1],
        "vertex_block": np.repeat(np.arange(model.n_blocks), np.diff(blocks.first_vertex)),
        "contact_x": joints.contact_x.ravel(),
        "contact_y": joints.contact_y.ravel(),
        "contact_length": joints.contact_length.ravel(),
        "contact_thickness": (face.contact_area / joints.contact_length).ravel(),
        "contact_kind": spread(face.kind),
        "contact_joint": spread(face.joint),
        "contact_interface": spread(np.arange(len(face.kind))),
        "contact_normal_x": spread(face.normal_x),
        "contact_normal_y": spread(face.normal_y),
        "contact_tensile_strength": spread(model.properties.tensile_strength),
        "contact_cohesion": spread(model.properties.cohesion),
        "contact_friction": spread(model.properties.friction),
        "contact_opening": at_contacts("opening"),
        "contact_slip": at_contacts("slip"),
        "contact_normal_stress": at_contacts("normal_stress"),
        "contact_shear_stress": at_contacts("shear_stress"),
        "contact_state": at_contacts("state"),
        **({} if (broken_at := steps[-1].increment.broken_at) is None else {"contact_broken_at": broken_at.ravel()}),
        **_footing_values(model, steps),
        **(_zone_values(model, steps) if store_zones else {}),
    }
    ds = dataset(
        values,
        {
            **attributes,
            **provenance(),
            "solver_options": SolverOptions.of(settings).to_json(),
            "damage_table": rules.table.name,
            "damage_measure": rules.measure,
            "count_footing_gap": rules.count_footing_gap,
            "apex_limited_joints": model.apex_limited,
            "snap_back_limited_joints": model.snap_back_limited,
            "span": model.span,
            "thickness": model.thickness,
            "mean_block_weight": model.mean_block_weight,
            **zoning,
        },
    )
    for share in (energy_error_share, snap_through_share):
        if np.isfinite(found := share(values)):
            ds.attrs[share.__name__] = found
    ds.attrs |= {name: share for name, share in shares_of_size(model, steps).items() if np.isfinite(share)}
    ds.attrs["implausible"] = int(implausible(ds.attrs, settings))
    for name, more in rules.attributes().items():
        ds[name].attrs.update(more)
    name_categories(ds, rules.table.category_names, f"{rules.table.name}; {rules.table.source}")
    return ds
