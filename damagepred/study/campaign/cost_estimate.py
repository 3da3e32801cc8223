"""What a run will cost, told before it starts by timing one wall."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from damagepred.archive.cautions import wall_cautions
from damagepred.arguments import checked
from damagepred.arrays import FloatArray
from damagepred.assembly import Limits, Model, wall_size
from damagepred.formatting import duration
from damagepred.input_files import read_toml
from damagepred.pipeline import Step, matrix_bytes, model_of, solve
from damagepred.scene import Scene
from damagepred.scene.assumed import ground_line
from damagepred.study.campaign.campaign import Campaign
from damagepred.study.campaign.preset_accuracy import accuracy_lines
from damagepred.study.campaign.warm_up import warm_up
from damagepred.study.settings import StudySettings

LONG_ENOUGH = 60.0
"""Seconds after which no further increment is timed."""


@dataclass(frozen=True)
class Estimate:
    """Size and price of a run.

    Attributes
    ----------
    title : str
        Of the scene or study.
    blocks, contacts, joints, increments : int
        Size of one wall and its path.
    samples, variables : int
        Size of the study; 1 and 0 for a scene.
    compile_seconds, wall_seconds : float
        Time to make the kernels ready, and to solve one wall after that.
    method : str
        Solver.
    matrix_bytes : int
        What the matrices of the quasi-static solver take while a wall is solved; 0 for the explicit one.
    status : str
        How that wall ended.
    deformable_blocks, zones, gridpoints : int
        Of one wall; 0 where all blocks are rigid.
    zone_bytes : int
        What is kept of zones and gridpoints, increment by increment; studies keep nothing of it.
    peak_bytes : int
        Most memory that this process has held, libraries and compiled kernels included; 0 where it cannot be told.
    cautions : tuple of str
        What a reader must know of how that wall was solved.
    accuracy : tuple of str
        What the presets of accuracy set, and the errors measured with them, in words; none for runs in time.
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

    def lines(self) -> list[str]:
        """Return the estimate in words."""
        found = [
            f"{self.title}: valid",
            f"  {self.blocks} blocks, {self.contacts} contacts, {self.joints} joints, {self.increments} increments",
            f"  one wall: {duration(self.wall_seconds)} ({self.status}); kernels made ready in "
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
        if self.ground:
            found.append(f"  {self.ground}")
        return [*found, *(f"  caution: {said}" for said in self.cautions), *self.accuracy]


class _LongEnough(Exception):
    """Enough increments have been timed."""


def zone_bytes(model: Model, increments: int) -> int:
    """Return the memory that the results of zones and gridpoints take (bytes).

    Four stresses and a state of each zone, and the displacement of each gridpoint, at every increment.

    Parameters
    ----------
    model : Model
        With or without a mesh.
    increments : int
        Of the movement.
    """
    if model.mesh is None:
        return 0
    return (increments + 1) * (len(model.mesh.zones) * (4 * 8 + 1) + model.mesh.x.size * 2 * 8)


def peak_bytes() -> int:
    """Return the most memory this process has held (bytes), 0 where that cannot be told."""
    if not sys.platform.startswith("linux"):
        return 0
    import resource

    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


@checked
def estimate_cost(
    path: str | Path,
    on_step: Callable[[Step], None] | None = None,
    limits: Limits = Limits(),  # noqa: B008 - frozen
) -> Estimate:
    """Validate a scene or study file and time one wall of it, or what can be timed of it in a minute.

    Parameters
    ----------
    path : str or Path
        The file; a study has variables, a ``[study]`` table or names a scene.
    on_step : callable, optional
        Called with each increment.
    limits : Limits
        Price above which a wall is not built, and the time that it may take.

    Raises
    ------
    InputError
        If the file is not acceptable, or a wall costs more than the limits.
    """
    tables = read_toml(path)
    samples = variables = 0
    if any(key in tables for key in ("scene", "study", "variables", "correlation")):
        settings = StudySettings.from_toml(path)
        title, samples, variables = settings.title, settings.study.samples, len(settings.variables)
        scene, fields = Campaign(settings, limits).sample(0)
        ground = ground_line(settings.scene, settings.variables)
    else:
        scene, fields = Scene.from_toml(path), {}
        title, ground = scene.title, ground_line(scene)
    wall_size(scene).require(limits)
    began = time.perf_counter()
    warm_up(scene)
    ready = time.perf_counter()
    model = model_of(scene, fields)
    count = scene.movement.increments if scene.dynamics is None else scene.dynamics.outputs
    seconds, status, cautions = _timed(scene, fields, count, on_step, limits)
    mesh = model.mesh
    return Estimate(
        title,
        model.n_blocks,
        model.n_contacts,
        len(model.joints.kind),
        count,
        samples or 1,
        variables,
        ready - began,
        seconds,
        scene.solver.method if scene.dynamics is None else "dynamic",
        matrix_bytes(model, scene.solver),
        status,
        0 if mesh is None else len(mesh.block),
        0 if mesh is None else len(mesh.zones),
        0 if mesh is None else mesh.x.size,
        zone_bytes(model, count),
        peak_bytes(),
        cautions,
        () if scene.dynamics is not None else tuple(accuracy_lines(scene)),
        ground,
    )


def _timed(
    scene: Scene,
    fields: Mapping[str, FloatArray],
    count: int,
    on_step: Callable[[Step], None] | None,
    limits: Limits,
) -> tuple[float, str, tuple[str, ...]]:
    """Return how long a wall takes (s), how it ended, and what must be known of how it was solved.

    After a minute the rest is reckoned from what was timed.
    """
    began = time.perf_counter()

    def watch(step: Step) -> None:
        if on_step is not None:
            on_step(step)
        if 0 < step.increment.number < count and time.perf_counter() - began > LONG_ENOUGH:
            raise _LongEnough(step.increment.number)

    try:
        ds = solve(scene, fields=fields, on_failure="return", on_step=watch, store_zones=False, limits=limits)
    except _LongEnough as stop:
        done = int(stop.args[0])
        return (time.perf_counter() - began) * count / done, f"from the first {done} of {count} increments", ()
    return time.perf_counter() - began, str(ds.attrs["status"]), tuple(wall_cautions(ds))
