"""Sampled walls: from inputs to a part of the archive. Workers run this module."""

from __future__ import annotations

import socket
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache, lru_cache
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from damagepred.archive import schema
from damagepred.archive.cautions import TOLERANCES, energy_shares, implausible
from damagepred.archive.folder import StudyFolder
from damagepred.archive.parts import alike, joined, read_part, study_dims, write_part
from damagepred.archive.provenance import as_table, environment
from damagepred.archive.schema import FLAG_FILL, VARIABLES, Column, Columns
from damagepred.arrays import FloatArray
from damagepred.assembly import wall_geometry
from damagepred.assembly.house import HouseModel
from damagepred.assembly.interfaces import Geometry
from damagepred.assembly.model import Model
from damagepred.campaign.settings import StudySettings, read_frozen
from damagepred.campaign.warm_up import warm_up
from damagepred.damage.judge import Rules
from damagepred.enumerations import FailureKind, SampleStatus
from damagepred.errors import ConvergenceError, DamagepredError, DivergenceError, InputError, StudyError
from damagepred.one_wall.dataset import history_values, movement_values, path_values, shares_of_size
from damagepred.one_wall.house import follow_scene, house_values
from damagepred.one_wall.judged_path import Step, without_zone_fields
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene import House, Scene
from damagepred.uq.design import Design
from damagepred.uq.fields import JointPlaces, course_sequences

OF_SOME = {"time": {"units": "year"}, "surface_movement": schema.GROWING_GROUND}  # attributes of some walls' columns
NOT_STARTED = -1  # status of a sample that was not started because the study is to stop


@dataclass(frozen=True)
class Outcome:
    """Status of a sample (``SampleStatus`` or ``NOT_STARTED``), its time (s), and the message of a failure."""

    sample: int
    status: int
    seconds: float
    message: str = ""


# consecutive samples of one task, each with its values for the whole wall
Batch = Sequence[tuple[int, Mapping[str, float]]]
SampledWall = tuple[Scene, dict[str, FloatArray]]  # scene of a sample, and its values that vary from joint to joint


@one_blas_thread()
def sampled_wall(settings: StudySettings, design: Design, sample: int, values: Mapping[str, float]) -> SampledWall:
    """Scene of one sample, by its values for the whole wall, and its values that vary from joint to joint."""
    scene = settings.scene.with_values(values).with_seed(settings.study.seed, sample)
    if not design.joint:
        return scene, {}
    drawn_on = settings.study.fields_from
    if drawn_on is None:
        return scene, design.joint_values(sample, joint_places(scene))
    if shape := {key: v for key, v in values.items() if key.split(".")[0] in ("wall", "opening", "dpc")}:
        drawn_on = drawn_on.with_values(shape)
    return scene, _on_nearest(design.joint_values(sample, joint_places(drawn_on)), drawn_on, scene)


def sample_of(settings: StudySettings, design: Design, sample: int, samples: int) -> SampledWall:
    """Scene of one sample of a design of some samples, and its values that vary from joint to joint."""
    values = design.wall_values(samples)
    return sampled_wall(settings, design, sample, {key: float(v[sample]) for key, v in values.items()})


def _on_nearest(fields: dict[str, FloatArray], drawn_on: Scene, scene: Scene) -> dict[str, FloatArray]:
    """Values at each joint of a scene from the nearest joint of another, of the same kind if possible."""
    from scipy.spatial import KDTree

    first, chosen = 0, []
    for other_wall, wall in zip(drawn_on.scenes, scene.scenes):
        theirs, ours = wall_geometry(other_wall).mortar, wall_geometry(wall).mortar
        nearest = np.empty(len(ours.kind), dtype=np.int64)
        for kind in np.unique(ours.kind):
            own_joints, other_joints = np.flatnonzero(ours.kind == kind), np.flatnonzero(theirs.kind == kind)
            other_joints = other_joints if other_joints.size else np.arange(len(theirs.kind))
            tree = KDTree(np.column_stack((theirs.x[other_joints], theirs.y[other_joints])))
            nearest[own_joints] = other_joints[tree.query(np.column_stack((ours.x[own_joints], ours.y[own_joints])))[1]]
        chosen.append(first + nearest)
        first += len(theirs.kind)
    return {key: values[np.concatenate(chosen)] for key, values in fields.items()}


def joint_places(scene: Scene) -> JointPlaces:
    """Positions of the joints, and their neighbours in the course; walls of a house are independent."""
    walls = [_places_on(wall_geometry(part), part.wall.block_length) for part in scene.scenes]
    if len(walls) == 1:
        return walls[0]
    first = np.cumsum([0, *(place.sequence[-1] + 1 for place in walls)])
    kinds = [place.kind.astype(np.int64) + 100 * number for number, place in enumerate(walls)]
    numbered = [place._replace(sequence=place.sequence + n, kind=k) for place, n, k in zip(walls, first, kinds)]
    sequence, kind, x, y = (np.concatenate(column) for column in list(zip(*numbered))[:4])
    return JointPlaces(sequence, kind, x, y, walls[0].unit)


@lru_cache(maxsize=16)  # most samples of a study share one geometry, of each wall of a house
def _places_on(geometry: Geometry, brick: float) -> JointPlaces:
    joints = geometry.mortar
    # one and a half bricks: more than the distance of neighbouring units, less than across any opening
    sequence = course_sequences(joints.course, joints.kind, joints.x, apart=1.5 * brick)
    return JointPlaces(sequence, joints.kind, joints.x, joints.y, brick)


def prepare(folder: str) -> None:
    """Load the study and the compiled kernels of its walls: the first task of a worker."""
    settings, _ = _read_study(folder, StudyFolder(folder).study_text())
    warm_up(settings.scene, rare=False)


def run_batch(folder: str, batch: Batch) -> list[Outcome]:
    """Solve and judge some samples and write their part, which counts even if the answer is lost."""
    study_folder = StudyFolder(folder)
    if (before := already_done(study_folder, batch)) is not None:
        return before
    if not study_folder.exists:
        raise StudyError(
            f"{folder}: the worker on {socket.gethostname()} cannot see the study's folder; workers on other machines "
            "need a shared file system."
        )
    settings, design = _read_study(folder, study_folder.study_text())
    outcomes: list[Outcome] = []
    rows: list[tuple[int, int, Columns]] = []
    try:
        for sample, values in batch:
            if study_folder.stopping:
                outcomes.append(Outcome(sample, NOT_STARTED, 0.0))
                continue
            solved = solve_sample(settings, design, sample, values)
            if solved.outcome.status == SampleStatus.FAILED:
                study_folder.record_failure(sample, solved.reason, solved.outcome.message, values)
            if solved.columns is not None:
                rows.append((sample, solved.outcome.status, solved.columns))
            outcomes.append(solved.outcome)
    finally:
        _write_parts(study_folder, rows)
    return outcomes


def already_done(folder: StudyFolder, batch: Batch) -> list[Outcome] | None:
    """Outcomes of a batch whose part is already in the folder (the answer was lost), or None."""
    file = folder.part_file(batch[0][0], batch[-1][0])
    if not file.is_file():
        return None
    try:
        columns_read = read_part(file, ("status", "run_time"), folder.study_hash)
    except InputError:  # damaged: solve again and replace
        return None
    columns = (columns_read[name].values.tolist() for name in ("sample", "status", "run_time"))
    kept = {int(i): (int(status), float(seconds)) for i, status, seconds in zip(*columns)}
    return [Outcome(sample, *kept[sample]) for sample, _ in batch] if all(i in kept for i, _ in batch) else None


def _write_parts(folder: StudyFolder, rows: list[tuple[int, int, Columns]]) -> None:
    """Write rows (sample, status, columns) as one part per run of consecutive samples; a failed sample has its own."""
    runs: list[list[tuple[int, int, Columns]]] = []
    for sample, status, columns in rows:
        last = runs[-1][-1] if runs else None
        # a repetition removes the part of a failed sample
        if (
            last is None
            or SampleStatus.FAILED in (status, last[1])
            or sample != last[0] + 1
            or not alike(last[2], columns)
        ):
            runs.append([])
        runs[-1].append((sample, status, columns))
    for run in runs:
        file = folder.part_file(run[0][0], run[-1][0])
        write_part(file, joined([columns for *_, columns in run]), folder.study_hash)


class Solved(NamedTuple):
    """Outcome of a sample, the reason of a failure, and its columns in a part."""

    outcome: Outcome
    reason: str
    columns: Columns | None


@one_blas_thread()
def solve_sample(settings: StudySettings, design: Design, sample: int, values: Mapping[str, float]) -> Solved:
    """Solve and judge one sample; an error becomes the outcome and is not raised."""
    began = time.perf_counter()
    steps: list[Step] = []
    status, reason, message = SampleStatus.COMPLETE, "", ""
    model: Model | None = None
    try:
        scene, fields = sampled_wall(settings, design, sample, values)
        for solved, step in follow_scene(scene, fields, scene.movement.increment_count):
            if step.increment.number == 0:  # also of a path that starts again because a brick breaks
                model = solved
                steps.clear()
            steps.append(without_zone_fields(step))
            if step.increment.collapsed:
                status = SampleStatus.COLLAPSED
            if step.verdict.damage_category >= settings.last_category:
                break
    except Exception as error:  # recorded; the other samples continue
        status, reason, message = SampleStatus.FAILED, _reason(error), f"{type(error).__name__}: {error}"
    seconds = time.perf_counter() - began
    columns = None if model is None or not steps else _row(settings, sample, status, seconds, model, steps)
    return Solved(Outcome(sample, status, seconds, message), reason, columns)


@lru_cache(maxsize=2)
def _read_study(folder: str, text: str) -> tuple[StudySettings, Design]:
    settings = read_frozen(text)
    return settings, settings.design()


def _reason(error: Exception) -> FailureKind:
    if isinstance(error, DivergenceError):
        return FailureKind.DIVERGED
    if isinstance(error, ConvergenceError):
        return FailureKind.NOT_CONVERGED
    return FailureKind.BAD_INPUT if isinstance(error, DamagepredError) else FailureKind.ERROR


def _row(settings: StudySettings, sample: int, status: int, seconds: float, model: Model, steps: list[Step]) -> Columns:
    """Columns of one sample in a part; beyond the end of its path they are NaN, except the category."""
    increments = settings.scene.movement.increment_count
    rules = Rules.from_settings(**asdict(settings.scene.damage))
    table = rules.table
    whole: dict[str, np.ndarray] = {}
    if isinstance(model, HouseModel):
        values, walls = house_values(model, steps), model.walls
        whole = {"wall": values.pop("wall")}
        if "opening_wall" in values:
            whole["opening_wall"] = values.pop("opening_wall")[None]
        parts = [[step.walls[number] for step in steps] for number in range(len(walls))]
    else:
        values, walls, parts = path_values(model, steps), (model,), [steps]
    whole["group_count"] = values.pop("group_count")
    of_walls = [shares_of_size(wall, part) for wall, part in zip(walls, parts)]
    shares = energy_shares(values) | {name: max(share[name] for share in of_walls) for name in of_walls[0]}
    beyond = increments + 1 - len(steps)
    last = steps[-1].increment
    filled: dict[str, np.ndarray] = {}
    for name, column in values.items():
        if not beyond:
            filled[name] = column[None]
            continue
        if column.dtype == np.int8:
            rest = FLAG_FILL if status == SampleStatus.FAILED or last.end.unloaded else column[-1]
            if name.startswith("wall_"):  # the end of the path of a house is no end for its sounder walls
                rest = np.where(column[-1] < table.highest, FLAG_FILL, column[-1])
        else:
            rest = np.nan if column.dtype.kind == "f" else -1
        tail = np.full((beyond, *column.shape[1:]), rest, dtype=column.dtype)
        filled[name] = np.concatenate((column, tail))[None]
    # a prescribed movement is known in unsolved increments too; the deflection of a free footing is not
    progress = np.arange(increments + 1) / increments
    if model.history is not None:
        progress = np.abs(model.history.load_factors)
        filled |= {name: value[None] for name, value in history_values(model.history, increments + 1).items()}
    filled |= {name: value[None] for name, value in movement_values(walls[0], progress).items()}
    if model.jacks is not None:
        filled["limit_deflection"] = np.array([abs(last.footing.deflection) if last.end.unloaded else np.nan])
    filled |= {
        "sample": np.array([sample]),
        "increment": np.arange(increments + 1),
        **whole,
        "status": np.array([status], dtype=np.int8),
        "run_time": np.array([seconds]),
        "apex_limited": np.array([model.apex_limited]),
        "environment": np.array([0]),
        "snap_back_limited": np.array([model.snap_back_limited]),
        **{name: np.array([share]) for name, share in shares.items()},
        "implausible": np.array([implausible(shares, settings.scene.solver)], dtype=np.int8),
    }
    columns = {name: _blank(name)._replace(values=value) for name, value in filled.items()}
    solver, source = settings.scene.solver, f"{table.name}; {table.source}"
    names = (*schema.CATEGORY_VARIABLES, schema.WORST_CATEGORY)
    categories = [c for name in names for c in (name, f"wall_{name}") if c in columns]
    for name, more in (
        ("environment", as_table([environment()])),
        *((category, schema.category_attributes(table.category_names, source, category)) for category in categories),
        *rules.attributes().items(),
        *((share, {"tolerance": getattr(solver, option)}) for share, option in TOLERANCES.items()),
        ("snap_through_share", {"tolerance": solver.snap_through_tolerance}),
        *((name, more) for name, more in OF_SOME.items() if name in columns),
    ):
        columns[name] = columns[name]._replace(attributes={**columns[name].attributes, **more})
    if isinstance(settings.scene, House):
        columns["wall"] = columns["wall"]._replace(attributes=schema.wall_attributes(settings.scene.names))
    # an unloaded rig ends the movement
    return _kept_of_movement(columns, settings.study.movement, len(steps) - 1 if last.end.unloaded else increments)


@cache
def _blank(name: str) -> Column:
    """Column of a registered variable in a study, without values."""
    return Column(study_dims(name), np.empty(0), MappingProxyType(VARIABLES[name].attributes()))


def _kept_of_movement(columns: Columns, kept: str, end: int) -> Columns:
    """Stored columns of a path that ends at an increment: "path", "sampled" (its end) or "both"."""
    if kept == "path":
        return columns
    at_end = {
        name: column._replace(dims=("sample", *column.dims[2:]), values=column.values[:, end])
        for name, column in columns.items()
        if column.dims[:2] == ("sample", "increment")
    }
    if kept == "sampled":
        return {name: column for name, column in (columns | at_end).items() if name != "increment"}
    more = {f"end_{name}": column for name, column in at_end.items() if f"end_{name}" in VARIABLES}
    names = {name: VARIABLES[name].attributes()["long_name"] for name in more}
    return columns | {n: c._replace(attributes={**c.attributes, "long_name": names[n]}) for n, c in more.items()}
