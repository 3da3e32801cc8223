"""Limit-state function for rare events: distance of a wall from a damage category."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.campaign.settings import StudySettings
from damagepred.damage.judge import Rules
from damagepred.damage.table import share_of_limit
from damagepred.errors import InputError, SolverError
from damagepred.one_wall.house import follow_scene
from damagepred.one_wall.judged_path import distortion, gauges
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene import Scene
from damagepred.uq.capacity import ROUNDING, interpolated_capacity


@dataclass(frozen=True)
class Question:
    """Question of a rare event: whether a category is reached by a movement."""

    category: int  # or a worse one
    at: float  # movement (m): central deflection, or on a mound the surface's movement
    reach: float = 2.0  # factor on this movement to which walls are solved, to measure their distance from the category

    def check(self, settings: StudySettings) -> None:
        """Refuse a question that a study cannot answer."""
        highest = settings.damage_table.highest
        if not 1 <= self.category <= highest:
            raise InputError(f"category = {self.category}: must be from 1 to {highest}.")
        if not self.at > 0:
            raise InputError(f"at = {self.at:g}: must be a movement greater than 0.")
        if not self.reach >= 1:
            raise InputError(f"reach = {self.reach:g}: must be 1 or more.")


def study_for_limit_state(settings: StudySettings, question: Question) -> StudySettings:
    """Study with the movement of the limit state instead of its own."""
    if settings.scene.movement.stage:
        raise InputError("rare: needs one growing movement; leave out [[movement.stage]] or its CSV file.")
    key = settings.scene.movement_key
    steps = settings.scene.movement.increments
    beyond = max(round(question.reach * steps), steps)
    scene = settings.scene.with_values({key: question.at * beyond / steps})
    correlation = {
        a: kept
        for a, row in settings.correlation.items()
        if a != key and (kept := {b: value for b, value in row.items() if b != key})
    }
    plain: dict[str, Any] = {"sampler": "random", "replicates": 1, "importance": {}, "nominal_share": 0.0}
    plain |= {"table": None, "table_columns": (), "stop_when": None, "movement": "path"}
    return replace(
        settings,
        scene=replace(scene, movement=replace(scene.movement, increments=beyond)),
        study=replace(settings.study, stop_at_category=question.category, **plain),
        variables={name: variable for name, variable in settings.variables.items() if name != key},
        correlation=correlation,
    )


class Margin(NamedTuple):
    """Distance of a wall from a category: 0 or less if it is reached by the movement of the question."""

    least: float  # after a failure: as if the category had been reached immediately
    most: float  # after a failure: infinite, as if it had never been reached
    why: str = ""  # reason of a failure


NOTHING_KNOWN = Margin(-1.0, np.inf)  # margin of a wall without any increment


@one_blas_thread()
def margin(scene: Scene, fields: Mapping[str, FloatArray], question: Question) -> Margin:
    """Distance of one wall from a category, by solving it.

    Its capacity (``damagepred.uq.capacity``) over the movement of the question, minus 1. If the category is not reached
    on the path: the relative length of the path beyond the movement, plus the relative increase of the widest crack to
    the limit. A path that fails beyond the movement counts as the latter.
    """
    rules = Rules.from_settings(**asdict(scene.damage))
    own = rules.table.measures
    limit = 1.0 if own else rules.table.limits[question.category - 1]
    before, width_before = 0.0, 0.0
    try:
        for model, step in follow_scene(scene, fields, scene.movement.increments):
            full = model.central_deflection if model.surface_movement is None else model.surface_movement
            full = scene.movement.size if scene.movement.settles else full
            if step.increment.number == 0:  # also of a path that starts again because a brick breaks
                before, width_before = 0.0, 0.0
            moved = step.increment.load_factor * full
            if model.deflection is not None and model.surface_movement is None:
                moved = max(abs(step.increment.footing.deflection), before)
            verdict = step.verdict
            openings = verdict.crack_width_max, verdict.crack_band_width_max, verdict.footing_opening_max
            widths = rules.widths(*openings, scene.dpc is not None)
            width = float(widths[rules.measure == "band"])
            if own:
                stored = {**verdict._asdict(), **dict(zip(("crack_width_max", "crack_band_width_max"), widths))}
                stored["opening_distortion"] = distortion(gauges(model).frames, step.increment)
                width = share_of_limit(rules.table, stored, question.category)
            if verdict.damage_category >= question.category:
                reached = interpolated_capacity((before, moved), (width_before, width), limit) / question.at - 1.0
                return Margin(reached, reached)
            before, width_before = moved, width
    except (SolverError, ArithmeticError, np.linalg.LinAlgError) as error:
        if before < question.at * (1 - ROUNDING):
            return Margin(before / question.at - 1.0, np.inf, f"{type(error).__name__}: {error}")
    beyond = max(before / question.at - 1.0, 0.0) + max(1.0 - width_before / limit, 1e-9)
    return Margin(beyond, beyond)
