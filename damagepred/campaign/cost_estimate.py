"""Cost estimate of a run before it starts: memory and time counted from its description, then one wall timed."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from damagepred.archive.cautions import wall_cautions
from damagepred.arrays import FloatArray
from damagepred.assembly import CostOptions, Limits, Model, wall_cost
from damagepred.campaign.preset_accuracy import accuracy_lines
from damagepred.campaign.sample import sample_of
from damagepred.campaign.settings import StudySettings
from damagepred.campaign.site_classes import site_line
from damagepred.campaign.warm_up import warm_up
from damagepred.errors import InputError, require_number
from damagepred.formatting import duration
from damagepred.inputs.arguments import checked
from damagepred.inputs.input_files import read_toml
from damagepred.one_wall.judged_path import Step, matrix_bytes, model_of
from damagepred.one_wall.solve import solve
from damagepred.scene import Scene
from damagepred.scene.assumed import ground_line
from damagepred.scene.scene import STUDY_KEYS

MOST_SAMPLES = 10**9
"""Samples of a study: as many as a scrambled Sobol sequence has points."""


def require_affordable(settings: StudySettings, limits: Limits, samples: int | None = None) -> None:
    """Check that the estimated cost of one wall of a study, of its fields and of its design is within limits.

    Parameters
    ----------
    settings : StudySettings
        The study.
    limits : Limits
        What is accepted.
    samples : int, optional
        Number of samples; by default the study's.

    Raises
    ------
    InputError
        If it is not.
    """
    fields = [v.field for v in settings.variables.values() if v.field is not None]
    dense = 0 if all(f.by_course for f in fields) else len(fields)
    for scene in {settings.scene, settings.study.fields_from or settings.scene}:
        wall_cost(scene).require(limits, dense)
    count = settings.study.samples if samples is None else samples
    require_number("samples", count, 1, MOST_SAMPLES)
    needed = 8.0 * CostOptions().design_copies * count * (len(settings.variables) + 1)
    if needed > limits.memory:
        raise InputError(
            f"samples = {count}: the design alone would take about {needed / 1e9:.2g} GB of memory, more than "
            f"{limits.memory / 1e9:.2g} GB; --yes, or limits=NO_LIMITS in Python, draws it all the same."
        )


@dataclass(frozen=True)
class CostEstimate:
    """Size and cost of a run.

    Attributes
    ----------
    title : str
        Of the scene or study.
    blocks, contacts, joints, increments : int
        Size of one wall and its path.
    samples, variables : int
        Size of the study; 1 and 0 for a scene.
    compile_seconds, wall_seconds : float
        Time to compile the kernels or load them, and to solve one wall after that, on average of those timed.
    method : str
        Solver.
    matrix_bytes : int
        Memory of the quasi-static solver's matrices while a wall is solved; 0 for the explicit one.
    status : str
        How that wall ended.
    deformable_blocks, zones, gridpoints : int
        Of one wall; 0 where all blocks are rigid.
    zone_bytes : int
        Memory of the results of zones and gridpoints at all increments; studies keep none of them.
    peak_bytes : int
        Peak memory of this process, libraries and compiled kernels included; 0 where it cannot be told.
    cautions : tuple of str
        Cautions on the solution of that wall.
    accuracy : tuple of str
        Keys that the presets of accuracy set, and errors measured with them, in words; none for runs in time.
    ground : str or None
        Assumed properties of the ground, in words.
    site : str or None
        Surface movement and site class of a soil log, in words.
    timed : tuple of float
        Times of all walls that were timed (s), where there are several: those of histories differ.
    """

    title: str
    blocks: int
    contacts: int
    joints: int
    increments: int
    samples: int
    variables: int
    compile_seconds: float
    wall_seconds: float
    method: str
    matrix_bytes: int
    status: str
    deformable_blocks: int = 0
    zones: int = 0
    gridpoints: int = 0
    zone_bytes: int = 0
    peak_bytes: int = 0
    cautions: tuple[str, ...] = ()
    accuracy: tuple[str, ...] = ()
    ground: str | None = None
    site: str | None = None
    timed: tuple[float, ...] = ()

    def lines(self) -> list[str]:
        """Return the estimate in words."""
        found = [
            f"{self.title}: valid",
            f"  {self.blocks} blocks, {self.contacts} contacts, {self.joints} joints, {self.increments} increments",
            f"  one wall: {duration(self.wall_seconds)} ({self.status}{self._spread}); kernels made ready in "
            f"{duration(self.compile_seconds)}",
            f"  solver: {self.method}"
            + (f", {self.matrix_bytes / 1e6:.2g} MB of matrices" if self.matrix_bytes else ""),
        ]
        if self.zones:
            kept = "" if self.variables else f", {self.zone_bytes / 1e6:.2g} MB of results (none with --no-zones)"
            peak = f"; at most {self.peak_bytes / 1e6:.0f} MB of memory in all" if self.peak_bytes else ""
            found.append(
                f"  {self.deformable_blocks} deformable blocks: {self.zones} zones, {self.gridpoints} gridpoints"
                f"{kept}{peak}"
            )
        if self.variables:
            total = self.samples * self.wall_seconds
            found.append(
                f"  {self.samples} walls with {self.variables} uncertain numbers: about {duration(total)} with -j 1, "
                f"{duration(total / 2)} with -j 2"
            )
        found += [f"  {said}" for said in (self.site, self.ground) if said]
        return [*found, *(f"  caution: {said}" for said in self.cautions), *self.accuracy]

    @property
    def _spread(self) -> str:
        """How the times of several walls differ, in words."""
        if len(self.timed) < 2:
            return ""
        least, most = duration(min(self.timed)), duration(max(self.timed))
        return f"; on average of {len(self.timed)} walls, {least} to {most}"


class _TimingLimit(Exception):
    """Increments have been timed for long enough."""


def _zone_bytes(model: Model, increments: int) -> int:
    """Return the memory (bytes) of zones' four stresses and state and of gridpoints' displacements, all increments."""
    if model.mesh is None:
        return 0
    return (increments + 1) * (len(model.mesh.zones) * (4 * 8 + 1) + model.mesh.x.size * 2 * 8)


def _peak_bytes() -> int:
    """Return the peak memory of this process (bytes), 0 where the system does not tell it."""
    if not sys.platform.startswith("linux"):
        return 0
    import resource

    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


@checked
def estimate_cost(
    path: str | Path,
    on_step: Callable[[Step], None] | None = None,
    limits: Limits = Limits(),  # noqa: B008 - frozen
    timing_limit: float = 60.0,
    history_walls: int = 4,
) -> CostEstimate:
    """Validate a scene or study file and time one wall of it, or its first increments; of a history several walls.

    Parameters
    ----------
    path : str or Path
        The file; a study has variables, a ``[study]`` table or names a scene.
    on_step : callable, optional
        Called with each increment.
    limits : Limits
        Estimated cost above which a wall is not built, and the time that it may take.
    timing_limit : float
        Time (s) after which no further increment of a wall is timed, and no further wall.
    history_walls : int
        Walls of a study of histories that are timed: samples move differently, and walls differ by several times.

    Raises
    ------
    InputError
        If the file is not acceptable, or a wall costs more than the limits.
    """
    tables = read_toml(path)
    samples, variables = 1, 0
    sampled: Callable[[int], tuple[Scene, Mapping[str, FloatArray]]] | None
    if any(key in tables for key in STUDY_KEYS):
        settings = StudySettings.from_toml(path)
        require_affordable(settings, limits)
        title, samples, variables = settings.title, settings.study.samples, len(settings.variables)
        sampled = partial(sample_of, settings, settings.design(), samples=samples)
        scene, fields = sampled(0)
        ground, site = ground_line(settings.scene, settings.variables), site_line(settings.mean_wall()[0], settings)
    else:
        scene, fields = Scene.from_toml(path), {}
        sampled = None
        title, ground, site = scene.title, ground_line(scene), site_line(scene)
    wall_cost(scene).require(limits)
    began = time.perf_counter()
    warm_up(scene)
    compile_seconds = time.perf_counter() - began
    model = model_of(scene, fields)
    dynamics, mesh = scene.dynamics, model.mesh
    count = scene.movement.increment_count if dynamics is None else dynamics.outputs
    began = time.perf_counter()
    seconds, status, cautions = _timed(scene, fields, count, on_step, limits, timing_limit)
    timed = [seconds]
    if sampled is not None and scene.movement.stage:
        for number in range(1, min(history_walls, samples)):
            if time.perf_counter() - began > timing_limit:
                break
            timed.append(_timed(*sampled(number), count, on_step, limits, timing_limit)[0])
    return CostEstimate(
        title=title,
        blocks=model.n_blocks,
        contacts=model.n_contacts,
        joints=len(model.joints.kind),
        increments=count,
        samples=samples,
        variables=variables,
        compile_seconds=compile_seconds,
        wall_seconds=float(np.mean(timed)),
        method=scene.solver.method if dynamics is None else "dynamic",
        matrix_bytes=matrix_bytes(model, scene.solver),
        status=status,
        deformable_blocks=0 if mesh is None else len(mesh.block),
        zones=0 if mesh is None else len(mesh.zones),
        gridpoints=0 if mesh is None else mesh.x.size,
        zone_bytes=_zone_bytes(model, count),
        peak_bytes=_peak_bytes(),
        cautions=cautions,
        accuracy=() if dynamics is not None else tuple(accuracy_lines(scene)),
        ground=ground,
        site=site,
        timed=tuple(timed),
    )


def _timed(
    scene: Scene,
    fields: Mapping[str, FloatArray],
    count: int,
    on_step: Callable[[Step], None] | None,
    limits: Limits,
    timing_limit: float,
) -> tuple[float, str, tuple[str, ...]]:
    """Return the time of a wall (s), extrapolated beyond the timing limit, how it ended, and cautions on it."""
    began = time.perf_counter()

    def watch(step: Step) -> None:
        if on_step is not None:
            on_step(step)
        if 0 < step.increment.number < count and time.perf_counter() - began > timing_limit:
            raise _TimingLimit(step.increment.number)

    try:
        ds = solve(scene, fields=fields, on_failure="return", on_step=watch, store_zones=False, limits=limits)
    except _TimingLimit as stop:
        done = int(stop.args[0])
        return (time.perf_counter() - began) * count / done, f"from the first {done} of {count} increments", ()
    return time.perf_counter() - began, str(ds.attrs["status"]), tuple(wall_cautions(ds))
