"""Cost estimate of a run: one wall is timed and scaled to the study, its memory follows from the elimination tree."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from damagepred.archive.cautions import wall_cautions
from damagepred.arrays import FloatArray
from damagepred.assembly import NO_LIMITS, Limits, wall_cost
from damagepred.campaign.sample import sample_of
from damagepred.campaign.settings import StudySettings
from damagepred.campaign.warm_up import warm_up
from damagepred.enumerations import LOCAL
from damagepred.errors import InputError, SolverError, require_number
from damagepred.inputs.arguments import checked
from damagepred.inputs.input_files import read_toml
from damagepred.one_wall.judged_path import Step, matrix_bytes, model_of
from damagepred.one_wall.solve import solve
from damagepred.scene import House, Scene, Suction, site_class, site_classes, surface_movement
from damagepred.scene.accuracy import PRESETS, Measured, measured, preset
from damagepred.scene.assumed import ground_line
from damagepred.scene.keys import step_names
from damagepred.scene.scene import STUDY_KEYS
from damagepred.scene.what_moves import what_moves

MOST_SAMPLES = 10**9  # largest number of samples: the points of a scrambled Sobol sequence
TIMING_LIMIT, HISTORY_WALLS = 60.0, 4
"""Time (s) after which a wall is no longer timed; number of timed walls of a study of histories."""
REPEATED_BELOW = 1 / 3
"""Share of the timing limit below which a wall is timed again: the first one also compiles or loads kernels."""
DESIGN_COPIES = 8  # copies of each input of each sample (8 bytes) while a design is drawn and written


def require_affordable(settings: StudySettings, limits: Limits, samples: int | None = None) -> None:
    """Check that the estimated cost of one wall of a study, of its fields and of its design is within limits."""
    fields = [v.field for v in settings.variables.values() if v.field is not None]
    dense = 0 if all(f.by_course for f in fields) else len(fields)
    for scene in {settings.scene, settings.study.fields_from or settings.scene}:
        wall_cost(scene).require(limits, dense)
    count = settings.study.samples if samples is None else samples
    require_number("samples", count, 1, MOST_SAMPLES)
    needed = 8.0 * DESIGN_COPIES * count * (len(settings.variables) + 1)
    if needed > limits.memory:
        raise InputError(
            f"samples = {count}: the design alone would take about {needed / 1e9:.2g} GB of memory, more than "
            f"{limits.memory / 1e9:.2g} GB; --yes, or limits=NO_LIMITS in Python, draws it all the same."
        )


@dataclass(frozen=True)
class CostEstimate:
    """Size and cost of a run."""

    title: str
    blocks: int
    contacts: int
    joints: int
    increments: int
    samples: int  # 1 for a scene
    variables: int  # 0 for a scene
    compile_seconds: float  # to compile the kernels or load them
    wall_seconds: float  # to solve one wall, mean of the timed walls
    method: str
    matrix_bytes: int  # matrices of the quasi-static solver
    status: str  # of the timed wall
    deformable_blocks: int = 0
    zones: int = 0
    gridpoints: int = 0
    zone_bytes: int = 0  # results of zones and gridpoints at all increments; studies store none
    peak_bytes: int = 0  # peak memory of this process with libraries and kernels; 0 if unknown
    cautions: tuple[str, ...] = ()
    accuracy: tuple[str, ...] = ()  # keys and measured errors of the presets
    ground: str | None = None  # assumed properties of the ground
    site: str | None = None  # surface movement and site class of a soil log
    timed: tuple[float, ...] = ()  # times of all timed walls (s); walls of histories differ
    wall: str = ""  # sizes of wall, openings, dpc and footing
    moving: str = ""  # what moves, of a study at the means of its variables
    sampled: tuple[str, ...] = ()  # keys of the variables


class _TimingLimit(Exception):
    """Increments have been timed for long enough."""


def seconds_per_wall(scenes: Sequence[Scene]) -> float:
    """Mean time to solve some walls, once the kernels of the first are compiled (s)."""
    warm_up(scenes[0])
    began = time.perf_counter()
    for scene in scenes:
        with suppress(SolverError):
            solve(scene, limits=NO_LIMITS)
    return (time.perf_counter() - began) / len(scenes)


def _peak_bytes() -> int:
    """Peak memory of this process (bytes), 0 on systems other than Linux."""
    if not sys.platform.startswith("linux"):
        return 0
    import resource

    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


@checked
def estimate_cost(
    path: str | Path,
    on_step: Callable[[Step], None] | None = None,
    limits: Limits = Limits(),  # noqa: B008 - frozen
) -> CostEstimate:
    """Validate a scene or study file and time one wall of it; of a study of histories ``HISTORY_WALLS``."""
    tables = read_toml(path)
    samples, variables = 1, 0
    sampled: Callable[[int], tuple[Scene, Mapping[str, FloatArray]]] | None
    if any(key in tables for key in STUDY_KEYS):
        settings = StudySettings.from_toml(path)
        require_affordable(settings, limits)
        title, samples, variables = settings.title, settings.study.samples, len(settings.variables)
        sampled = partial(sample_of, settings, settings.design(), samples=samples)
        scene, fields = sampled(0)
        mean, names = settings.mean_wall()[0], tuple(settings.means())
        ground, site = ground_line(settings.scene, settings.variables), site_line(mean, settings)
    else:
        scene, fields = Scene.from_toml(path), {}
        sampled, mean, names = None, scene, ()
        title, ground, site = scene.title, ground_line(scene), site_line(scene)
    wall_cost(scene).require(limits)
    began = time.perf_counter()
    warm_up(scene)
    compile_seconds = time.perf_counter() - began
    model = model_of(scene, fields)
    dynamics, mesh = scene.dynamics, model.mesh
    count = scene.movement.increment_count if dynamics is None else dynamics.outputs
    began = time.perf_counter()
    seconds, status, cautions = _timed(scene, fields, count, on_step, limits)
    if seconds < REPEATED_BELOW * TIMING_LIMIT:
        seconds = min(seconds, _timed(scene, fields, count, None, limits)[0])
    timed = [seconds]
    if sampled is not None and scene.movement.stage:
        for number in range(1, min(HISTORY_WALLS, samples)):
            if time.perf_counter() - began > TIMING_LIMIT:
                break
            timed.append(_timed(*sampled(number), count, on_step, limits)[0])
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
        # stress and state of zones, displacements of gridpoints
        zone_bytes=0 if mesh is None else (count + 1) * (len(mesh.zones) * (4 * 8 + 1) + mesh.x.size * 2 * 8),
        peak_bytes=_peak_bytes(),
        cautions=cautions,
        accuracy=() if dynamics is not None else tuple(accuracy_lines(scene)),
        ground=ground,
        site=site,
        timed=tuple(timed),
        wall=_size(mean),
        moving=what_moves(mean),
        sampled=names,
    )


def _size(scene: Scene) -> str:
    """Size of a wall or house, for the screen."""
    if isinstance(scene, House):
        return f"house of {len(scene.wall)} walls, corners and T-joints: {len(scene.junctions)}"
    wall, dpc = scene.wall, "no dpc" if scene.dpc is None else f"dpc on course {scene.dpc.course}"
    return f"wall {wall.length:.4g} m long, {wall.height:.4g} m high, openings: {len(scene.opening)}, {dpc}"


OnStep = Callable[[Step], None] | None


def _timed(
    scene: Scene, fields: Mapping[str, FloatArray], count: int, on_step: OnStep, limits: Limits
) -> tuple[float, str, tuple[str, ...]]:
    """Time of a wall (s), extrapolated beyond the timing limit, its status, and cautions."""
    began = time.perf_counter()

    def watch(step: Step) -> None:
        if on_step is not None:
            on_step(step)
        if 0 < step.increment.number < count and time.perf_counter() - began > TIMING_LIMIT:
            raise _TimingLimit(step.increment.number)

    try:
        ds = solve(scene, fields=fields, on_failure="return", on_step=watch, store_zones=False, limits=limits)
    except _TimingLimit as stop:
        done = int(stop.args[0])
        return (time.perf_counter() - began) * count / done, f"from the first {done} of {count} increments", ()
    return time.perf_counter() - began, str(ds.attrs["status"]), tuple(wall_cautions(ds))


LARGEST_SILENT_FLOOR = 0.01  # relative error of a reference above which the lines show it
DAMAGE = ("widest crack", "damage category")  # quantities whose error is always shown, or reported as unknown


def accuracy_lines(scene: Scene) -> list[str]:
    """Keys of each preset for the solver of a scene, and errors measured on walls with the same dpc and openings."""
    method = scene.solver.method
    rows = [row for row in measured() if row.method == method]
    similar = [row for row in rows if (row.dpc, row.opening) == (scene.dpc is not None, bool(scene.opening))]
    which = "walls like it" if similar else "other walls"
    similar = similar or rows
    values = preset(scene.solver.accuracy, method)
    other = [key for key, value in values.items() if getattr(scene.solver, key) != value]
    exceptions = f", except {', '.join(other)}" if other else ""
    head = f'  accuracy = "{scene.solver.accuracy}"{exceptions}; largest errors measured on {which}'
    lines = [f"{head} ({_walls(similar)}):"]
    for accuracy in PRESETS:
        of_preset = [row for row in similar if row.accuracy == accuracy]
        others = [row for row in rows if row.accuracy == accuracy]
        keys = ((key, f'"{v}"' if isinstance(v, str) else f"{v:g}") for key, v in PRESETS[accuracy][method].items())
        lines.append(f"    {accuracy}: {', '.join(map(' = '.join, keys)) or 'the defaults'}")
        if of_preset:
            lines.append(f"      {_errors(of_preset)}")
        lines += [f"      {_elsewhere(q, others)}" for q in DAMAGE if all(row.quantity != q for row in of_preset)]
    return lines


def _walls(rows: list[Measured]) -> str:
    return "; ".join(dict.fromkeys(row.wall for row in rows))


def _errors(rows: list[Measured]) -> str:
    worst = [_worst(quantity, rows) for quantity in dict.fromkeys(row.quantity for row in rows)]
    times = sorted(row.times for row in rows)
    span = f"{times[0]:.2g}" + (f"-{times[-1]:.2g}" if times[-1] > 1.1 * times[0] else "")
    return f"{span} times the time of standard; {', '.join(worst)}"


def _worst(quantity: str, rows: list[Measured]) -> str:
    """Largest error of a quantity, with the uncertainty of its reference."""
    worst = max((row for row in rows if row.quantity == quantity), key=lambda row: row.error)
    error = f"{worst.error:.0f}" if quantity == "damage category" else _percent(worst.error)
    sure = f" (known to {_percent(worst.floor)})" if worst.floor > LARGEST_SILENT_FLOOR else ""
    return f"{quantity} {error}{sure}"


def _elsewhere(quantity: str, rows: list[Measured]) -> str:
    """Error of a quantity on other walls, where no wall like this one has it."""
    have = [row for row in rows if row.quantity == quantity]
    if not have:
        return f"{quantity}: error unknown, on no wall"
    return f"{quantity}: error unknown on walls like it; on other walls ({_walls(have)}) {_worst(quantity, have)}"


def _percent(share: float) -> str:
    return "0 %" if share < 5e-6 else f"{100 * share:.2g} %"


DRAWN = 1024  # draws of the soil, if a study has fewer samples


def surface_movements(settings: StudySettings, samples: int) -> list[float]:
    """Characteristic surface movement y_s of each sample of a study with a soil log (m)."""
    scene, values = settings.scene, settings.design().wall_values(samples)

    def drawn(table: str, described: Any, i: int) -> Any:
        keys = (key for key in values if key.rpartition(".")[0] == table)
        return replace(described, **{key.rpartition(".")[2]: float(values[key][i]) for key in keys})

    def of_sample(i: int) -> float:
        named = zip(step_names(scene.soil_layer), scene.soil_layer)
        layers = [drawn(f"soil_layer.{name}", layer, i) for name, layer in named]
        suction = drawn("suction", scene.suction or Suction(), i)
        return surface_movement(layers, suction, drawn("mound", scene.mound, i).suction_depth)

    return [of_sample(i) for i in range(samples)]


def site_line(scene: Scene, settings: StudySettings | None = None) -> str | None:
    """y_s, site class and probability of each class of a soil log, in a sentence; None without a log."""
    if not scene.soil_layer:
        return None
    suction, depth = scene.suction or Suction(), scene.mound.suction_depth
    y_s = surface_movement(scene.soil_layer, suction, depth)
    at_tree = scene.mound.shape in ("tree", "pipe")  # local movements have no site class
    line = f"soil log: {LOCAL[scene.mound.shape] if at_tree else 'y_s'} = {1e3 * y_s:.0f} mm"
    line += "" if at_tree else f", site class {site_class(y_s).name}"
    if suction.below_log and (end := sum(layer.thickness for layer in scene.soil_layer)) < depth:
        below = "the last layer goes on" if suction.below_log == "extend" else "nothing moves"
        line += f"; below the log, from {end:g} to {depth:g} m, {below} (suction.below_log)"
    soil = ("soil_layer", "suction")
    keys = settings.variables if settings is not None else ()
    uncertain = any(key.split(".")[0] in soil or key == "mound.suction_depth" for key in keys)
    if settings is None or not uncertain or at_tree:
        return line
    samples = max(settings.study.samples, DRAWN)
    classes = [site_class(y).name for y in surface_movements(settings, samples)]
    shares = {c.name: classes.count(c.name) / samples for c in site_classes()}
    listed = ", ".join(f"{name} {share:.2g}" for name, share in shares.items() if share > 0)
    return f"{line} at the means; probability of each class: {listed}"
