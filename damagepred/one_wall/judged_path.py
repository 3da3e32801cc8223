"""Path of one wall with the damage of each increment."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model, wall_model
from damagepred.assembly.brick_cracks import BrickWatch, bricks_break
from damagepred.assembly.house import house_model
from damagepred.damage.deviation import Frames, SightLines, largest_distortion
from damagepred.damage.joints import JointMap
from damagepred.damage.judge import Rules, Verdict, judge
from damagepred.enumerations import ContactState
from damagepred.kernels.jit import CACHE
from damagepred.runtime.one_thread import each_with_one_blas_thread, one_blas_thread
from damagepred.scene import Damage, Dynamics, House, Scene, Solver
from damagepred.solvers import Increment, solve_path
from damagepred.solvers.options import SolverOptions

if TYPE_CHECKING:
    from damagepred.solvers.dynamics.run import DynamicRun


class Step(NamedTuple):
    """One increment and its damage."""

    increment: Increment
    verdict: Verdict  # its category is the highest once part of the wall has collapsed; of a house the largest values
    walls: tuple[Step, ...] = ()  # of a house: the step of each wall


class Gauges(NamedTuple):
    """Joints, courses and opening corners at which damage is measured."""

    joints: JointMap
    lines: SightLines
    frames: Frames


_RECENT: list[tuple[Model, Gauges]] = []  # gauges of the last models; a house has one per wall


def gauges(model: Model) -> Gauges:
    """Gauges of a model; models of one geometry share them."""
    parts = (model.interfaces, model.blocks, model.jambs)
    for other, shared in _RECENT:
        if all(a is b for a, b in zip(parts, (other.interfaces, other.blocks, other.jambs))):
            return shared
    blocks, jambs, joints = model.blocks, model.jambs, joint_map(model)
    centroid = np.column_stack((blocks.x, blocks.y))
    new = Gauges(
        joints,
        SightLines.of_blocks(blocks.x, blocks.y, blocks.course, joints.dpc_level),
        Frames(jambs.block, jambs.arm, centroid[jambs.block] + jambs.arm),
    )
    _RECENT[:] = [(model, new), *_RECENT[:15]]
    return new


def joint_map(model: Model) -> JointMap:
    """Joints of a model for damage assessment."""
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


def distortion(frames: Frames, increment: Increment) -> float:
    """Largest distortion of the openings (rad); 0 without any."""
    return float(largest_distortion(frames.distortion(increment.displacement).opening_distortion))


@each_with_one_blas_thread
def follow(
    model: Model, solver: Solver, damage: Damage, increments: int, run: Iterable[Increment] | None = None
) -> Iterator[Step]:
    """Solve a path and yield each increment with its damage."""
    places, rules = gauges(model), Rules.from_settings(**asdict(damage))
    for increment in solve_path(model, solver, increments) if run is None else run:
        yield judged(places, increment, rules)


def judged(places: Gauges, increment: Increment, rules: Rules) -> Step:
    """Increment with its damage."""
    cracked = increment.state == ContactState.CRACKED
    distorted = distortion(places.frames, increment) if rules.table.measures else 0.0
    verdict = judge(places.joints, increment.opening, increment.slip, cracked, rules, distorted)
    if increment.collapsed:
        verdict = verdict._replace(damage_category=rules.table.highest, damage_category_band=rules.table.highest)
    return Step(increment, verdict)


def follow_wall(scene: Scene, fields: Mapping[str, FloatArray] | None, increments: int) -> Iterator[tuple[Model, Step]]:
    """Solve the static path of a scene; yield each increment, with the model; again from 0 once a brick may break."""
    if bricks_break(scene) and scene.solver.brick_cracks == "reached":
        model = model_of(replace(scene, solver=replace(scene.solver, brick_cracks="none")), fields)
        watch = BrickWatch.of(scene, model)
        for step in follow(model, scene.solver, scene.damage, increments):
            if watch.near(model, step.increment.normal_stress, step.increment.shear_stress):
                break
            yield model, step
        else:
            return
    model = model_of(scene, fields)
    for step in follow(model, scene.solver, scene.damage, increments):
        yield model, step


@one_blas_thread()
def model_of(scene: Scene, fields: Mapping[str, FloatArray] | None = None) -> Model:
    """Model of a scene with the solver settings of its run."""
    settings = scene.solver if scene.dynamics is None else whole_interfaces(scene.solver)
    SolverOptions.of(settings)  # raises before the model is built
    if isinstance(scene, House):
        return house_model(replace(scene, solver=settings), fields)
    return wall_model(replace(scene, solver=settings), fields)


def share_kernels() -> None:
    """Publish compiled kernels to processes started from now on."""
    if CACHE is not None:
        CACHE.publish()


def dynamic_run(model: Model, settings: Solver, dynamics: Dynamics) -> DynamicRun:
    """Dynamic run, from static equilibrium under dead load or from rest."""
    from damagepred.solvers.dynamics.run import DynamicRun, require_supported
    from damagepred.solvers.quasi_static.stepper import static_equilibrium

    require_supported(model, settings, dynamics)
    initial = static_equilibrium(model, settings) if dynamics.start == "equilibrium" else None
    return DynamicRun(model, dynamics, initial)


def whole_interfaces(settings: Solver) -> Solver:
    """Solver settings of a dynamic run: contacts at corners only, no zones."""
    settings.require_no_zones()
    return replace(settings, no_tension_subdivisions=settings.no_tension_subdivisions or 1)


def without_zone_fields(step: Step) -> Step:
    """Increment without displacement and stress of its zones, to save memory."""
    zones = step.increment.zones
    if zones is None:
        return step
    light = zones._replace(displacement=np.empty((0, 2)), stress=np.empty((0, 4)))
    return step._replace(increment=replace(step.increment, zones=light))


def matrix_bytes(model: Model, solver: Solver) -> int:
    """Memory of the matrices of all fronts of the quasi-static solver, dense (bytes); 0 for the other solvers."""
    if solver.method != "quasi_static":
        return 0
    from damagepred.solvers.quasi_static.elimination_tree import EliminationTree
    from damagepred.solvers.quasi_static.superelements import Superelements
    from damagepred.solvers.symmetry import reduce_by_symmetry
    from damagepred.solvers.system.discrete_system import DiscreteSystem

    half = reduce_by_symmetry(model) if solver.symmetric_half else None
    system = DiscreteSystem.of(half or model)
    blocks = None if system.model.mesh is None else Superelements(system)
    return 8 * EliminationTree.of(system, blocks).matrix_entries
