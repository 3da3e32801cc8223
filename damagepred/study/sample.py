"""One sampled wall: from its number to its part of the archive. This is what workers run."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from damagepred.archive.files import write_dataset
from damagepred.archive.folder import FAILED, StudyFolder
from damagepred.archive.schema import FLAG_FILL, SAMPLE_STATUS, dataset, name_categories
from damagepred.assembly import wall_geometry
from damagepred.assembly.model import Model
from damagepred.damage import damage_table
from damagepred.errors import ConvergenceError, DamagepredError, DivergenceError, StudyError
from damagepred.path import Step, follow, model_of, path_values, without_zone_fields
from damagepred.scene import Scene
from damagepred.study.settings import StudySettings, read_frozen
from damagepred.uq.design import Design
from damagepred.uq.fields import course_sequences

FloatArray = NDArray[np.float64]

HANDED_BACK = -1
"""Status of a sample that was not begun because the study is to stop."""

COMPLETE, COLLAPSED = SAMPLE_STATUS.index("complete"), SAMPLE_STATUS.index("collapsed")


@dataclass(frozen=True)
class Outcome:
    """How a sample ended.

    Attributes
    ----------
    sample : int
        Its number.
    status : int
        Index into ``SAMPLE_STATUS``, or ``HANDED_BACK``.
    message : str
        Why it failed, if it did.
    seconds : float
        Time it took.
    """

    sample: int
    status: int
    message: str
    seconds: float


def sampled_wall(
    settings: StudySettings, design: Design, sample: int, values: Mapping[str, float]
) -> tuple[Scene, dict[str, FloatArray]]:
    """Return the scene of one sample and its values that vary from joint to joint.

    Parameters
    ----------
    settings : StudySettings
        The study.
    design : Design
        Its distributions.
    sample : int
        Number of the sample.
    values : mapping of str to float
        Its values that hold for the whole wall.
    """
    scene = settings.scene.with_values(values)
    if not design.joint:
        return scene, {}
    return scene, design.joint_values(sample, joint_sequence(scene))


def joint_sequence(scene: Scene) -> NDArray[np.int64]:
    """Return which joints of a scene's wall are neighbours in a course."""
    joints = wall_geometry(scene).joints
    # a brick and a half: more than from one unit to the next, less than any opening leaves between two
    return course_sequences(joints.course, joints.kind, joints.x, apart=1.5 * scene.wall.block_length)


def run_sample(folder: str, sample: int, values: Mapping[str, float]) -> Outcome:
    """Solve one sample, judge it and write its part; a failure is written down, too.

    Parameters
    ----------
    folder : str
        Study folder, with the frozen study in it.
    sample : int
        Number of the sample.
    values : mapping of str to float
        Its values that hold for the whole wall.

    Raises
    ------
    StudyError
        If the part cannot be written.
    """
    began = time.perf_counter()
    place = StudyFolder(folder)
    if place.stopping:
        return Outcome(sample, HANDED_BACK, "", 0.0)
    settings, design = _frozen(folder, place.study_text())
    steps: list[Step] = []
    status, reason, message = COMPLETE, "", ""
    model: Model | None = None
    try:
        scene, fields = sampled_wall(settings, design, sample, values)
        model = model_of(scene, fields)
        for step in follow(model, scene.solver, scene.damage, scene.movement.increments):
            steps.append(without_zone_fields(step))
            if step.increment.collapsed:
                status = COLLAPSED
            if step.verdict.damage_category >= settings.last_category:
                break
    except StudyError:
        raise
    except Exception as error:  # whatever it is, the other samples go on, and this one is on record
        status, reason, message = FAILED, _reason(error), f"{type(error).__name__}: {error}"
    seconds = time.perf_counter() - began
    if status == FAILED:
        place.record_failure(sample, reason, message, values)
    if model is not None and steps:
        increments = settings.scene.movement.increments
        part = _part(sample, status, seconds, model, steps, increments)
        table = damage_table(settings.scene.damage)
        name_categories(part, table.category_names, f"{table.name}; {table.source}")
        part["dpc_separation_length"].attrs["opening_threshold"] = settings.scene.damage.dpc_threshold
        write_dataset(part, place.part_file(sample))
    return Outcome(sample, status, message, seconds)


@lru_cache(maxsize=2)
def _frozen(folder: str, text: str) -> tuple[StudySettings, Design]:
    settings = read_frozen(text)
    return settings, settings.design()


def _reason(error: Exception) -> str:
    if isinstance(error, DivergenceError):
        return "diverged"
    if isinstance(error, ConvergenceError):
        return "not_converged"
    return "bad_input" if isinstance(error, DamagepredError) else "error"


def _part(sample: int, status: int, seconds: float, model: Model, steps: list[Step], increments: int) -> xr.Dataset:
    """Make the dataset of one sample; increments after the end of its path are NaN.

    The category is the exception: a path that ended because the wall fell or passed the last category of interest
    keeps that category for the movement beyond. A path that ended because the jacks or supports carry nothing any more
    has come to the limit of the rig: beyond it nothing is known, and there is no movement.
    """
    values = path_values(model, steps)
    beyond = increments + 1 - len(steps)
    last = steps[-1].increment
    filled: dict[str, np.ndarray] = {}
    for name, column in values.items():
        if column.dtype == np.int8:
            rest = FLAG_FILL if status == FAILED or last.ended else column[-1]
        else:
            rest = np.nan if column.dtype.kind == "f" else -1
        tail = np.full((beyond, *column.shape[1:]), rest, dtype=column.dtype)
        filled[name] = np.concatenate((column, tail))[None]
    # a given movement is known also where it was not solved; a footing's own deflection is not
    progress = np.arange(increments + 1) / increments
    if model.deflection is None:
        filled["central_deflection"] = (progress * model.central_deflection)[None]
        filled["deflection_ratio"] = (progress * model.central_deflection / model.span)[None]
    if model.surface_movement is not None:
        filled["surface_movement"] = (progress * model.surface_movement)[None]
    if model.jacks is not None:
        filled["limit_deflection"] = np.array([abs(last.deflection) if last.ended else np.nan])
    filled |= {
        "sample": np.array([sample]),
        "increment": np.arange(increments + 1),
        "status": np.array([status], dtype=np.int8),
        "run_time": np.array([seconds]),
        "apex_limited": np.array([model.apex_limited]),
    }
    dims = dict.fromkeys(values, ("sample", "increment")) | {"opening_width_change": ("sample", "increment", "opening")}
    return dataset(filled, {}, dims)
