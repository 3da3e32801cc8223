"""Commands on one wall and its file."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from typer import Argument, Exit, Option

import damagepred as dp
from damagepred.cli import options as opt
from damagepred.cli import terminal
from damagepred.formatting import quantity

if TYPE_CHECKING:
    from damagepred.campaign.settings import StudySettings


_Template = Literal[
    "wall", "mound", "jacks", "control-joint", "seasons", "tree", "end-settlement", "soil-log", "survey", "house"
]
_TEMPLATES = (
    "Ground of prescribed form, clay of class H1, test rig, clay and a joint, thirty years, a tree at one end, an end "
    "that settles, a soil log, cracks and levels of a survey, or walls in plan beside a tree."
)


@opt.command("new")
def new(
    file: Annotated[Path, Argument(help="File to write.", show_default=False)],
    template: Annotated[_Template, Option(help=_TEMPLATES)] = "wall",
) -> None:
    """Write a commented study as a template."""
    from damagepred.campaign.template import write_template
    from damagepred.scene.what_moves import what_moves

    files = write_template(file, template)
    described, settings = _described(file)
    drawing = f"--plot {file.with_suffix('.png')}"
    terminal.say(f"wrote {' and '.join(map(str, files))}; next: damagepred check {file} {drawing}, which draws it")
    terminal.note(what_moves(described if settings is None else settings.mean_wall()[0]))


@opt.command("check", "json", "full", "quiet")
def check(file: opt.SceneOrStudyFile, plot: opt.PictureOrFolder = None, yes: opt.Yes = False) -> None:
    """Validate and draw a file, solve one wall of it and estimate the cost of the whole run."""
    from damagepred.campaign.cost_estimate import estimate_cost
    from damagepred.cli.sentences import cost_lines

    described, settings = _described(file)
    _ask_back(described, settings)
    if plot is not None:
        from damagepred.plotting.pictures import save_scene_picture

        with terminal.doing("drawing the scene"):
            terminal.note(f"drew {save_scene_picture(settings.mean_wall()[0] if settings else described, plot)}")
    with terminal.Bar("solving one sample to price the run") as bar:
        estimate = estimate_cost(file, on_step=bar.step, limits=dp.Limits.asked(yes))
    without = ["cautions", "accuracy", "ground", "site", "wall", "moving", "sampled"]
    terminal.answer(estimate, lambda cost: terminal.lines(cost_lines(cost, terminal.FORM.full)), without)


@opt.command("solve", "full", "quiet")
def solve(
    file: opt.SceneOrStudyFile,
    output: opt.NetcdfFile = None,
    plot: opt.PictureFolder = None,
    no_zones: Annotated[bool, Option("--no-zones", help="Keep no stresses in deformable blocks.")] = False,
    timeout: opt.Timeout = None,
    yes: opt.Yes = False,
) -> None:
    """Solve one wall; of a study file, the wall with every variable at its mean."""
    from damagepred.cli import tables

    described, settings = _described(file)
    mean_wall = ""
    _ask_back(described, settings)
    if settings is not None:
        described, mean_wall = settings.mean_wall()
    count = described.movement.increment_count if described.dynamics is None else described.dynamics.outputs
    with terminal.Bar("solving the path", count + 1) as bar:
        ds = dp.solve(
            described,
            on_failure="return",
            on_step=bar.step,
            store_zones=not no_zones,
            limits=dp.Limits.asked(yes, timeout),
        )
    opt.keep_wall(ds, output, plot)
    if settings is not None:
        from damagepred.analyses.mean_wall import beyond_mean_wall

        terminal.say(f"{mean_wall}\n{beyond_mean_wall(ds, settings, file)}")
    terminal.silent()
    tables.wall_table(ds)
    _say_ground(described, settings)
    raise Exit(opt.exit_code(ds))


@opt.command("replay", "full", "quiet")
def replay(
    folder: opt.StudyFolderPath,
    sample: Annotated[int, Argument(help="Number of the sample, from 0.", min=0, show_default=False)],
    output: opt.NetcdfFile = None,
    plot: opt.PictureFolder = None,
) -> None:
    """Solve one wall of a study again, the very same, and keep all its fields."""
    from damagepred.campaign.replay import replay as replay_sample
    from damagepred.cli import tables

    with terminal.Bar(f"sample {sample}") as bar:
        ds, comparison = replay_sample(folder, sample, on_step=bar.step)
    opt.keep_wall(ds, output, plot)
    terminal.silent()
    tables.wall_table(ds)
    terminal.say(comparison)
    raise Exit(opt.exit_code(ds))


@opt.command("cracks", "json", "full", "quiet")
def cracks_command(
    file: Annotated[Path, Argument(help="Result of solve or replay (*.nc).", show_default=False, is_eager=True)],
    csv: Annotated[Path | None, opt.writes("--csv", "CSV file to write, with all increments.", ".csv")] = None,
    output: opt.NetcdfFile = None,
) -> None:
    """Show the cracks of a solved wall at the end of its path, one by one."""
    from damagepred.archive.files import read_dataset
    from damagepred.cli import tables

    cracks = dp.cracks(read_dataset(file))
    if csv is not None:
        opt.keep_table(dp.crack_frame(cracks, None), csv, index=False)
    opt.keep_wall(cracks, output)
    terminal.answer(dp.crack_frame(cracks), partial(tables.crack_table, cracks))


@opt.command("judge", "full", "quiet")
def judge_command(
    path: opt.WallOrStudy,
    table: Annotated[str | None, Option(help="as2870, bre251, or a file (*.toml) written like data/damage.")] = None,
    plasterboard: Annotated[bool | None, Option(help="Limits for walls lined with it.")] = None,
    count_rule: Annotated[bool | None, Option("--groups/--no-groups", help="Whether groups of cracks count.")] = None,
    group_count: Annotated[int | None, Option(help="Cracks that make a group.")] = None,
    group_distance: Annotated[
        str | None, Option(help='Within which they lie, such as "1 m"; of one wall only.')
    ] = None,
    measure: opt.Measure = None,
    footing_gap: opt.FootingGap = None,
    band_gauge: Annotated[
        str | None, Option(help='Length laid across a band, such as "1 m"; of one wall only.')
    ] = None,
    output: opt.NetcdfFile = None,
) -> None:
    """Judge a wall or a study again under another damage table or other rules, without solving it."""
    from damagepred.cli import tables

    before = opt.open_result(path)
    after = dp.judge_again(
        before,
        table=table,
        plasterboard=plasterboard,
        count_rule=count_rule,
        group_count=group_count,
        group_distance=None if group_distance is None else terminal.quantity("--group-distance", group_distance, "m"),
        measure=measure,
        count_footing_gap=footing_gap,
        band_gauge=None if band_gauge is None else terminal.quantity("--band-gauge", band_gauge, "m"),
    )
    opt.keep_wall(after, output)
    tables.judged_again(before, after)


@opt.command("materials", "json", "quiet")
def materials_command() -> None:
    """List the masonry of the library: values, scatter, source and confidence."""
    from damagepred.scene import masonry_library

    if terminal.FORM.json:
        terminal.print_json(
            {
                name: {**m._asdict(), "correlation": {" with ".join(p): r for p, r in m.correlation.items()}}
                for name, m in masonry_library().items()
            }
        )
        return
    for name, masonry in masonry_library().items():
        rows = []
        for place, value in masonry.values.items():
            number, unit = quantity(value.mean, dp.Scene.unit_of(place))
            scatter = "" if value.cov is None else f"{value.cov:g} ({value.cov_confidence})"
            rows.append([place, f"{number} {unit}".strip(), value.confidence, scatter])
        terminal.table(f'material = "{name}": {masonry.description}', ["value", "mean", "confidence", "cov"], rows)
        terminal.say(f"calibrated on: {masonry.calibrated_on}; source: {masonry.source}")


def _described(file: Path) -> tuple[dp.Scene, StudySettings | None]:
    """Read a scene file, or a study file with its scene."""
    from damagepred.inputs.input_files import read_toml
    from damagepred.scene.scene import STUDY_KEYS
    from damagepred.solvers.options import SolverOptions

    if any(key in read_toml(file) for key in STUDY_KEYS):
        from damagepred.campaign.settings import StudySettings  # slow to import, and not needed for a scene

        settings = StudySettings.from_toml(file)
        return settings.scene, settings
    scene = dp.Scene.from_toml(file)
    SolverOptions.of(scene.solver, str(file))  # refused with the name of the file
    return scene, None


def _ask_back(described: dp.Scene, settings: StudySettings | None) -> None:
    """Name numbers that are unlikely in their unit, that variables replace, and that nothing reads."""
    from damagepred.assembly.brick_cracks import brick_cautions
    from damagepred.scene.assumed import ground_cautions
    from damagepred.scene.plausibility import unlikely_values

    terminal.cautions(unlikely_values(described, settings.means() if settings else None))
    terminal.cautions(settings.other_means() if settings else [])
    for unread in (ground_cautions, brick_cautions):
        terminal.cautions(unread(described, settings.variables if settings else ()))


def _say_ground(described: dp.Scene, settings: StudySettings | None) -> None:
    """Print the surface movement of a soil log, and assumed properties of the ground."""
    from damagepred.scene.assumed import ground_line

    if described.soil_layer:
        from damagepred.campaign.cost_estimate import site_line

        if line := site_line(described, settings):
            terminal.note(line)
    if line := ground_line(described, settings.variables if settings else ()):
        terminal.note(line)
