"""The command line: thin, and quick to start; everything is imported when a command needs it."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

import typer
from typer.core import TyperGroup

from damagepred import screen
from damagepred.enumerations import PathStatus

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    import xarray as xr

    from damagepred.scene import Scene
    from damagepred.study.settings import StudySettings
    from damagepred.uq.fragility import FragilityOptions


class _Commands(TyperGroup):
    """Commands with the whole first sentence of their help: click cuts it at one line."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands, each with its sentence."""
        commands = ((name, self.get_command(ctx, name)) for name in self.list_commands(ctx))
        rows = [(name, (command.help or "").strip().partition("\n\n")[0]) for name, command in commands if command]
        with formatter.section("Commands"):
            formatter.write_dl(rows)


app = typer.Typer(
    cls=_Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # else brackets in help texts are taken for markup
    context_settings={"help_option_names": ["-h", "--help"]},
)

OK, BAD_INPUT, SOME_FAILED, INTERRUPTED = 0, 2, 3, 130
"""Exit codes."""


def _output(*suffixes: str, new_folder: bool = False) -> Callable[[typer.Context, Path | None], Path | None]:
    """Check of an option that names a file to write, or without suffixes a folder, before the command does anything."""

    def check(context: typer.Context, value: Path | None) -> Path | None:
        if value is not None and not context.resilient_parsing:
            from damagepred.archive.files import check_output

            inputs = [given for given in context.params.values() if isinstance(given, Path)]
            check_output(value, *suffixes, inputs=inputs, new_folder=new_folder)
        return value

    return check


PICTURES = (".png", ".pdf", ".svg")

SceneOrStudyFile = Annotated[Path, typer.Argument(help="Scene or study file (TOML).", show_default=False)]
StudyFile = Annotated[Path, typer.Argument(help="Study file (TOML).", show_default=False)]
StudyFolderPath = Annotated[Path, typer.Argument(help="Study folder (*.dp).", show_default=False)]
WallOrStudy = Annotated[
    Path, typer.Argument(help="Result of solve (*.nc) or study folder (*.dp).", show_default=False, is_eager=True)
]
NetcdfFile = Annotated[
    Path | None, typer.Option("-o", "--output", help="netCDF file to write.", callback=_output(".nc"))
]
Picture = Annotated[
    Path | None,
    typer.Option("--plot", help="Picture to draw (png, svg, pdf).", callback=_output(*PICTURES, new_folder=True)),
]
PictureFolder = Annotated[Path | None, typer.Option("--plot", help="Folder for pictures.", callback=_output())]
Category = Annotated[
    int,
    typer.Option(
        "--category", parser=screen.category, metavar="NUMBER|NAME", help='Of damage, or worse: 2, or "slight".'
    ),
]
AtMovement = Annotated[str, typer.Option("--at", help='Movement, such as "8 mm".')]
MovementOrClass = Annotated[
    str,
    typer.Option(
        "--at", help='Movement ("8 mm"), site class ("H1"), distribution; "site": the end of each wall\'s own.'
    ),
]
Workers = Annotated[int, typer.Option("-j", "--workers", min=1, help="Processes.")]
Seed = Annotated[int | None, typer.Option("--seed", min=0, help="Instead of the file's.")]
Yes = Annotated[bool, typer.Option("--yes", help="Solve walls whatever memory and time they are estimated to take.")]
Timeout = Annotated[
    float | None, typer.Option("--timeout", help="Seconds a wall may take, by default 3600; inf lifts the limit.")
]
MixVersions = Annotated[
    bool, typer.Option("--mix-versions", help="Go on although another version has solved walls; status will say so.")
]
Measure = Annotated[
    Literal["joint", "band"] | None,
    typer.Option("--measure", help="Width that makes the category: widest joint or crack band."),
]
FootingGap = Annotated[
    bool | None,
    typer.Option("--footing-gap/--no-footing-gap", help="Whether a gap on the footing counts without a dpc."),
]


def _show_version(asked: bool) -> None:
    if asked:
        from damagepred.version import __version__

        screen.say(f"damagepred {__version__}")
        raise typer.Exit


def _form(option: typer.CallbackParam, value: bool) -> bool:
    setattr(screen.FORM, str(option.name), value)
    return value


Json = Annotated[
    bool, typer.Option("--json", callback=_form, is_eager=True, help="Print the result as JSON, numbers not rounded.")
]
Quiet = Annotated[
    bool, typer.Option("--quiet", callback=_form, is_eager=True, help="Neither progress nor notes; errors stay.")
]
Full = Annotated[bool, typer.Option("--full", callback=_form, is_eager=True, help="Tables with all columns and rows.")]
Intensity = Literal[
    "surface_movement",
    "central_deflection",
    "deflection_ratio",
    "curvature",
    "footing_curvature",
    "time",
    "differential_movement",
]


_DOING = {
    "new": "writing the template",
    "check": "reading the file",
    "solve": "reading the file",
    "study": "reading the study",
    "status": "reading the study",
    "verify": "checking files, and solving walls again where asked",
    "repair": "checking and repairing files",
    "rare": "solving walls of the levels",
    "estimate": "reading the study and estimating",
    "compare": "reading the studies and comparing them",
    "infer": "reading the studies and the observations",
    "design": "pricing the search: solving one wall",
    "two-level": "solving walls, fine and coarse",
    "fragility": "fitting curves, their bands and their goodness",
    "export": "reading, fitting and writing",
    "sensitivity": "reading the walls and resampling them",
    "replay": "reading the study",
    "plot": "drawing",
    "cracks": "tracing cracks",
    "judge": "judging again",
    "materials": "reading the library",
    "scales": "judging by all scales",
    "report": "collecting and drawing for the page",
    "guide": "reading the guide",
}
"""What each command does while it says nothing else."""


@app.callback()
def common(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """How likely is which damage to a masonry wall when the ground under it moves."""
    context.with_resource(screen.doing(_DOING.get(context.invoked_subcommand or "", "loading the program")))


@app.command()
def new(
    file: Annotated[Path, typer.Argument(help="File to write.", show_default=False)],
    template: Annotated[
        Literal["wall", "mound", "jacks", "control-joint", "seasons"],
        typer.Option(
            "--template",
            help="Ground of prescribed form, clay of class H1, test rig, clay and a joint, or thirty years.",
        ),
    ] = "wall",
) -> None:
    """Write a commented study as a template."""
    from damagepred.study.campaign.template import write_template

    write_template(file, template)
    screen.say(f"wrote {file}; next: damagepred check {file}")


@app.command()
def check(
    file: SceneOrStudyFile,
    yes: Yes = False,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Validate a file, solve one wall of it and say what the whole run will cost."""
    from damagepred.assembly import Limits
    from damagepred.study.campaign.cost_estimate import estimate_cost

    _ask_back(*_described(file))
    with screen.Bar("solving one wall to price the run") as bar:
        estimate = estimate_cost(file, on_step=bar.step, limits=Limits.asked(yes))
    if json:
        screen.print_json(estimate)
        return
    for line in estimate.lines():
        screen.say(line)


@app.command()
def solve(
    file: SceneOrStudyFile,
    output: NetcdfFile = None,
    plot: PictureFolder = None,
    no_zones: Annotated[bool, typer.Option("--no-zones", help="Keep no stresses in deformable blocks.")] = False,
    timeout: Timeout = None,
    yes: Yes = False,
    full: Full = False,
    quiet: Quiet = False,
) -> None:
    """Solve one wall; of a study file, the wall with every variable at its mean."""
    from damagepred.assembly import Limits
    from damagepred.pipeline import solve as solve_wall

    described, settings = _described(file)
    mean_wall = ""
    _ask_back(described, settings)
    if settings is not None:
        described, mean_wall = settings.mean_wall()
    count = described.movement.increment_count if described.dynamics is None else described.dynamics.outputs
    with screen.Bar("solving the wall", count + 1) as bar:
        ds = solve_wall(
            described,
            on_failure="return",
            on_step=bar.step,
            store_zones=not no_zones,
            limits=Limits.asked(yes, timeout),
        )
    _keep_wall(ds, output, plot)
    if settings is not None:
        from damagepred.study.analyses.mean_wall import beyond_mean_wall

        screen.say(f"{mean_wall}\n{beyond_mean_wall(ds, settings, file)}")
    screen.wall_table(ds)
    _say_ground(described, settings)
    raise typer.Exit(_ending(ds))


@app.command()
def study(
    file: StudyFile,
    samples: Annotated[int | None, typer.Option("-n", "--samples", min=1, help="Walls in all.")] = None,
    workers: Workers = 1,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Study folder (*.dp).", callback=_output())
    ] = None,
    seed: Seed = None,
    timeout: Timeout = None,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Run failed walls again.")] = False,
    mix_versions: MixVersions = False,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", help="Run on the workers of this Dask scheduler (tcp://HOST:PORT).")
    ] = None,
    yes: Yes = False,
    quiet: Quiet = False,
) -> None:
    """Run a Monte Carlo study; the same command resumes it, a larger -n extends it."""
    from damagepred.archive.cautions import STUDIED, study_cautions
    from damagepred.archive.folder import StudyFolder
    from damagepred.assembly import Limits
    from damagepred.study import Study
    from damagepred.study.campaign.cluster import connect_dask_scheduler
    from damagepred.study.campaign.stopping import run_until
    from damagepred.study.settings import StudySettings

    settings = StudySettings.from_toml(file).with_samples(samples, seed)
    folder = output or file.with_suffix(".dp")
    _ask_back(settings.scene, settings)
    _say_ground(settings.mean_wall()[0] if settings.scene.soil_layer else settings.scene, settings)
    with ExitStack() as open_until_the_end:
        client = open_until_the_end.enter_context(connect_dask_scheduler(scheduler)) if scheduler else None
        bar = open_until_the_end.enter_context(screen.StudyBar())
        ending = run_until(
            Study(settings, Limits.asked(yes, timeout)),
            folder,
            samples,
            workers,
            client,
            timeout=timeout,
            retry_failed=retry_failed,
            mix_versions=mix_versions,
            on_progress=bar.update,
        )
    summary = ending.summary
    if settings.study.stop_when is not None or ending.reason == "time":
        for line in ending.lines(settings.study.stop_when):
            screen.say(line)
    if ending.reason == "time":
        summary = replace(summary, total=summary.done, interrupted=False)
    word = "interrupted" if summary.interrupted else "complete"
    screen.say(
        f"{folder}: {word}, {summary.done} of {summary.total} walls done, {summary.failed} failed, "
        f"{summary.seconds:.1f} s this time"
    )
    screen.cautions(study_cautions(StudyFolder(folder).results(STUDIED)))
    if summary.interrupted:
        screen.say("what was done is kept; the same command goes on from here")
        raise typer.Exit(INTERRUPTED)
    if summary.failed:
        screen.say(f"reasons of the failures: {folder / 'failures'}", error=True)
        raise typer.Exit(SOME_FAILED)


@app.command()
def status(
    folder: StudyFolderPath,
    watch: Annotated[bool, typer.Option("--watch", help="Show it again and again, until all is done.")] = False,
    every: Annotated[float, typer.Option("--every", min=0.1, help="Seconds between two looks of --watch.")] = 5.0,
    json: Json = False,
    full: Full = False,
    quiet: Quiet = False,
) -> None:
    """Show what is done, failed and left, and the estimate so far; the study may be running."""
    from damagepred.study.campaign.status import study_status, watching

    title = "Share of walls by category reached by the end of the movement"
    if watch:
        screen.silent()
    for report in watching(folder, every) if watch else (study_status(folder),):
        if json:
            screen.print_json(report)
            continue
        if watch:
            screen.clear()
        for line in report.lines:
            screen.say(line)
        screen.table(title, report.columns, report.rows)


@app.command()
def verify(
    path: Annotated[Path, typer.Argument(help="Study folder (*.dp), or file (*.nc).", show_default=False)],
    samples: Annotated[
        int, typer.Option("--samples", help="Number of walls to solve again and compare bit by bit.", min=0)
    ] = 0,
) -> None:
    """Check a study folder or a file: exit code 0 if it is sound, 2 if damaged, 3 if walls solved again differ."""
    from damagepred.study.campaign.verify import verify as verify_archive

    found = verify_archive(path, samples, screen.say)
    for line in found.lines:
        screen.say(line)
    if found.damaged:
        if path.is_dir():
            screen.say(f"next: damagepred repair {path}", error=True)
        raise typer.Exit(BAD_INPUT)
    if found.differing:
        raise typer.Exit(SOME_FAILED)


@app.command()
def repair(folder: StudyFolderPath) -> None:
    """Make again what of a study folder is derived; set aside what is damaged, so that `study` solves it again."""
    from damagepred.study.campaign.verify import repair as repair_folder

    for line in repair_folder(folder) or [f"{folder}: nothing to repair"]:
        screen.say(line)


@app.command()
def rare(
    file: StudyFile,
    category: Category,
    at: AtMovement,
    samples: Annotated[
        int | None, typer.Option("-n", "--samples", min=10, help="Walls a level of a run; 200 in a new folder.")
    ] = None,
    runs: Annotated[
        int | None, typer.Option("--runs", min=1, help="Independent runs, which tell the error; 5 in a new folder.")
    ] = None,
    workers: Workers = 1,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder (*.rare).", callback=_output())] = None,
    seed: Seed = None,
    level_share: Annotated[float, typer.Option(help="Share of a level's walls that the next starts from.")] = 0.1,
    reach: Annotated[float, typer.Option(help="Factor on the movement to which walls are solved.")] = 2.0,
    timeout: Timeout = None,
    yes: Yes = False,
    mix_versions: MixVersions = False,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Estimate a small probability of damage by subset simulation; the same command resumes it."""
    from damagepred.assembly import Limits
    from damagepred.study.analyses.limit_state import Question
    from damagepred.study.analyses.rare_event import kept_sizes, rare_event
    from damagepred.study.settings import StudySettings

    question = Question(category, screen.quantity("--at", at, "m"), reach)
    settings = StudySettings.from_toml(file).with_samples(None, seed)
    folder = output or file.with_suffix(".rare")
    sizes = {"samples": 200, "runs": 5} | kept_sizes(folder)
    sizes |= {key: value for key, value in (("samples", samples), ("runs", runs)) if value is not None}
    found = rare_event(
        settings,
        question,
        folder,
        **sizes,
        level_share=level_share,
        workers=workers,
        timeout=timeout,
        limits=Limits.asked(yes, timeout),
        mix_versions=mix_versions,
        on_level=lambda level: screen.note(f"level reached: margin {level.limit:.4g}, share {level.share:.3g}"),
    )
    if json:
        screen.print_json(found)
    for line in found.lines(question):
        screen.say(line)
    if found.failed:
        raise typer.Exit(SOME_FAILED)


@app.command()
def estimate(
    folder: StudyFolderPath,
    category: Category,
    at: MovementOrClass = "site",
    confidence: Annotated[float, typer.Option(help="Of the interval.", min=0.01, max=0.999)] = 0.9,
    study_file: Annotated[
        Path | None, typer.Option("--study", help="Study file whose [study.epistemic] to take instead.")
    ] = None,
    shifts: Annotated[
        bool, typer.Option("--propose", help="Say what importance sampling should shift, with these walls as a pilot.")
    ] = False,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Estimate a probability from a study: Monte Carlo error, failed walls and what the inputs leave open, apart."""
    from damagepred.study.analyses.epistemic import alternatives, lines
    from damagepred.study.settings import StudySettings
    from damagepred.uq.movement_distribution import movement_distribution

    if shifts:
        from damagepred.study.analyses.importance_proposal import propose

        proposed = propose(folder, category, screen.quantity("--at", at, "m"))
        if json:
            screen.print_json(proposed)
            return
        for line in proposed.lines():
            screen.say(line)
        return
    movement = movement_distribution(at, option="--at")
    others = StudySettings.from_toml(study_file).study.epistemic if study_file else None
    found = alternatives(folder, category, movement, others=others, confidence=confidence)
    if json:
        screen.print_json({"category": category, "movement": movement.name, "alternatives": found})
        return
    for line in lines(found, category, movement):
        screen.say(line)


@app.command()
def compare(
    folders: Annotated[list[Path], typer.Argument(help="Study folders (*.dp); the first is the reference.")],
    category: Category,
    at: MovementOrClass = "site",
    confidence: Annotated[float, typer.Option(help="Of the intervals.", min=0.01, max=0.999)] = 0.9,
    output: NetcdfFile = None,
    plot: Picture = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Compare studies: how far each measure changes a probability of damage, the same samples under each."""
    from damagepred.archive.folder import open_study
    from damagepred.errors import InputError
    from damagepred.uq.comparison import compare as compare_studies
    from damagepred.uq.comparison import sentences
    from damagepred.uq.movement_distribution import movement_distribution

    movement = movement_distribution(at, option="--at")
    names = [folder.name.removesuffix(".dp") for folder in folders]
    if len(set(names)) < len(names):
        names = [str(folder) for folder in folders]
    if twice := [name for name in names if names.count(name) > 1]:
        raise InputError(f"{twice[0]}: is given twice; compare it with another study.")
    studies = {name: open_study(folder) for name, folder in zip(names, folders)}
    found = compare_studies(studies, categories=[category], at=[movement], confidence=confidence)
    if json:
        screen.print_json(found)
    screen.say(f"P(category >= {category} at {movement.words})")
    for line in sentences(found, category, float(found["movement"][0])):
        screen.say(line)
    if movement.assumption:
        screen.note(movement.assumption)
    if output is not None or plot is not None:
        _keep_curves(compare_studies(studies, categories=[category], confidence=confidence), output, plot)


@app.command("infer")
def infer_command(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="Study folders (*.dp), one a cause, and then the observations (*.toml).", show_default=False
        ),
    ],
    replays: Annotated[
        int, typer.Option("--replays", min=1, help="Samples a study that are replayed for local cracks, at most.")
    ] = 200,
    new_walls: Annotated[
        int, typer.Option("--new-walls", min=0, help="Walls a round that are run where too few samples are effective.")
    ] = 0,
    workers: Workers = 1,
    output: NetcdfFile = None,
    plot: Picture = None,
    json: Json = False,
    full: Full = False,
    quiet: Quiet = False,
) -> None:
    """Infer movement and cause from observed cracks, levels and windows, and what further movement would bring."""
    from damagepred.errors import InputError
    from damagepred.study.analyses.back_analysis import InferenceOptions, infer, prices
    from damagepred.study.analyses.posterior_tables import reported, sentences

    if len(files) < 2 or files[-1].suffix != ".toml":
        raise InputError("infer: give one study folder or more, and then the file of the observations (*.toml).")
    options = InferenceOptions(replays=replays, new_walls=new_walls)
    for price in prices(files[:-1], files[-1], options, workers):
        screen.note(price)
    with screen.ReplayBar() as bar:
        found = infer(files[:-1], files[-1], workers=workers, options=options, on_replay=bar.update, on_walls=bar.walls)
    _keep_curves(found, output, plot)
    said = sentences(found)
    screen.cautions(said)
    if json:
        screen.print_json({"cautions": said, **reported(found).to_dict("list")})
        return
    screen.back_analysis(found)


@app.command("design")
def design_command(
    file: Annotated[Path, typer.Argument(help="File of the choices (TOML).", show_default=False)],
    workers: Workers = 1,
    folder: Annotated[
        Path | None, typer.Option("--folder", help="Folder of the alternatives' studies.", callback=_output())
    ] = None,
    output: NetcdfFile = None,
    plot: Picture = None,
    json: Json = False,
    full: Full = False,
    quiet: Quiet = False,
) -> None:
    """Search the cheapest alternative with unlikely damage, or the least expected cost; the same command resumes."""
    from damagepred.study.analyses.design_search import price_of_search, search_design

    screen.note(price_of_search(file, workers))
    with screen.ReplayBar("solving walls of alternatives") as bar:
        found = search_design(
            file,
            folder or file.with_suffix(".design"),
            workers=workers,
            on_round=lambda size, count: screen.note(f"{count} alternatives, {size} samples each"),
            on_walls=bar.walls,
        )
    _keep_curves(found, output, plot)
    if json:
        screen.print_json(found)
        return
    screen.design_search(found)


@app.command("two-level")
def two_level(
    file: Annotated[Path, typer.Argument(help="Study file (TOML) with [study.coarse].", show_default=False)],
    category: Category,
    at: AtMovement,
    budget: Annotated[
        float | None, typer.Option("--budget", help="Work after the pilot, in walls of the study.")
    ] = None,
    pilot: Annotated[int, typer.Option("--pilot", min=10, help="Walls of the pilot run.")] = 32,
    workers: Workers = 1,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder (*.two).", callback=_output())] = None,
    seed: Seed = None,
    yes: Yes = False,
    mix_versions: MixVersions = False,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Estimate a probability with a coarse wall as control variate, if a pilot run shows that it pays."""
    from damagepred.assembly import Limits
    from damagepred.study.analyses.two_level import run_two_level
    from damagepred.study.settings import StudySettings

    found = run_two_level(
        StudySettings.from_toml(file).with_samples(None, seed),
        category,
        screen.quantity("--at", at, "m"),
        output or file.with_suffix(".two"),
        pilot=pilot,
        budget=budget,
        workers=workers,
        mix_versions=mix_versions,
        on_pilot=lambda report: screen.note(report.line()),
        limits=Limits.asked(yes),
    )
    if json:
        screen.print_json(found)
    e = found.estimate
    screen.say(
        f"P(category >= {category} at {at}) = {e.value:.4g}, {e.lower:.4g} to {e.upper:.4g} ({e.confidence:.0%}), from "
        f"{found.fine} walls and {found.coarse} coarse ones"
        + (f"; as sure as {e.effective_samples:.0f} random walls alone" if found.coarse else "")
    )
    if found.failed:
        screen.say(
            f"{found.failed} walls failed or ended before: {found.failed_undamaged.value:.4g} if none of them had "
            f"reached the category, {found.failed_damaged.value:.4g} if all had",
            error=True,
        )
        raise typer.Exit(SOME_FAILED)


@app.command()
def fragility(
    folder: StudyFolderPath,
    output: NetcdfFile = None,
    plot: Picture = None,
    csv: Annotated[Path | None, typer.Option("--csv", help="CSV file to write.", callback=_output(".csv"))] = None,
    intensity: Annotated[
        Intensity | None,
        typer.Option(
            metavar="MEASURE",
            help=f"Of the movement: {', '.join(get_args(Intensity))}; on mounds by default the first.",
        ),
    ] = None,
    model: Annotated[
        Literal["separate", "common", "empirical"],
        typer.Option(help="A lognormal for each category, all of one dispersion (never cross), or no form."),
    ] = "separate",
    band: Annotated[
        Literal["bca", "percentile", "profile"],
        typer.Option(help="Resampled walls (bca, percentile) or profile likelihood."),
    ] = "bca",
    confidence: Annotated[float, typer.Option(help="Of the band.", min=0.01, max=0.999)] = 0.9,
    bootstrap: Annotated[int, typer.Option(help="Resamples for the band.", min=0)] = 1000,
    goodness: Annotated[int, typer.Option(help="Times walls are made up to judge the fit.", min=0)] = 100,
    export: Annotated[
        Literal["pelicun", "openquake", "openquake-discrete"] | None,
        typer.Option("--export", help="Write for another program, beside -o or the study folder."),
    ] = None,
    extrapolated: Annotated[
        bool, typer.Option("--extrapolated", help="Export curves whose median lies beyond what walls were moved to.")
    ] = False,
    categories: Annotated[
        str | None,
        typer.Option("--categories", help="Categories to fit, such as 1,2 or slight,moderate; by default all."),
    ] = None,
    against: Annotated[
        str | None, typer.Option("--against", help="Input to fit a surface to, of the category of --categories.")
    ] = None,
    options: Annotated[
        Path | None,
        typer.Option("--options", help="TOML file with options of the fit, for experts.", show_default=False),
    ] = None,
    measure: Measure = None,
    footing_gap: FootingGap = None,
    json: Json = False,
    full: Full = False,
    quiet: Quiet = False,
) -> None:
    """Fit fragility curves to a study."""
    from damagepred.archive.folder import open_study
    from damagepred.rejudge import footing_gap_note, judge_again
    from damagepred.uq.fragility import fit_fragility

    wanted = screen.categories("--categories", categories) if categories else None
    study = open_study(folder)
    if measure is not None or footing_gap is not None:
        study = judge_again(study, measure=measure, count_footing_gap=footing_gap)
    if against is not None:
        chosen = screen.fragility_options(options)
        _fragility_surface(study, against, wanted, intensity, confidence, bootstrap, chosen, output, plot, json)
        return
    curves = fit_fragility(
        study,
        model=model,
        intensity=intensity,
        categories=wanted,
        confidence=confidence,
        band=band,
        bootstrap=bootstrap,
        goodness=goodness,
        options=screen.fragility_options(options),
    )
    _keep_curves(curves, output, plot)
    if csv is not None:
        from damagepred.exports import curves_frame, write_csv

        write_csv(curves_frame(curves), csv)
        screen.note(f"wrote {csv}")
        if intensity == "time":
            from damagepred.year_tables import year_frame

            write_csv(year_frame(study, confidence), by_year := csv.with_stem(f"{csv.stem}_years"))
            screen.note(f"wrote {by_year}")
    if export is not None:
        from damagepred.exports import export_curves

        for file in export_curves(curves, export, output or folder, extrapolated=extrapolated):
            screen.note(f"wrote {file}")
    if json:
        screen.print_json(curves)
    else:
        screen.fragility_table(curves)
        if intensity == "time":
            screen.year_table(study, confidence)
    if note := footing_gap_note(study):
        screen.note(f"note: {note}")


@app.command()
def export(
    path: Annotated[Path, typer.Argument(help="Study folder (*.dp), or curves of fragility (*.nc).")],
    form: Annotated[
        Literal["pelicun", "openquake", "openquake-discrete", "curves", "walls"],
        typer.Argument(help="Program; or CSV of curves, or of the walls of a study.", show_default=False),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="File to write (csv, xml), by default beside the input.",
            callback=_output(".csv", ".xml"),
        ),
    ] = None,
    categories: Annotated[
        str | None,
        typer.Option("--categories", help="Categories to export, such as 1,2 or slight,moderate; by default all."),
    ] = None,
    extrapolated: Annotated[
        bool, typer.Option("--extrapolated", help="Export curves whose median lies beyond what walls were moved to.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Write curves or walls for another program."""
    from damagepred.archive.files import read_dataset
    from damagepred.archive.folder import open_study
    from damagepred.exports import curves_frame, export_curves, walls_frame, write_csv
    from damagepred.uq.fragility import fit_fragility

    wanted = screen.categories("--categories", categories) if categories else None
    place = output or path.with_name(f"{path.stem}_{form}.csv")
    if form == "walls":
        write_csv(walls_frame(open_study(path)), place)
        screen.note(f"wrote {place}")
        return
    curves = fit_fragility(open_study(path), categories=wanted) if path.is_dir() else read_dataset(path)
    if form == "curves":
        write_csv(curves_frame(curves), place)
        screen.note(f"wrote {place}")
        return
    for file in export_curves(curves, form, output or path, wanted, extrapolated):
        screen.note(f"wrote {file}")


@app.command()
def sensitivity(
    path: Annotated[Path, typer.Argument(help="Study file (TOML), or study folder (*.dp).", show_default=False)],
    category: Annotated[
        int | None,
        typer.Option("--category", parser=screen.category, metavar="NUMBER|NAME", help="Of the capacity for it."),
    ] = None,
    result: Annotated[str | None, typer.Option("--of", help="Of this result, at the end of the movement.")] = None,
    samples: Annotated[int | None, typer.Option("-n", "--samples", min=8, help="Walls in all, for a file.")] = None,
    workers: Workers = 1,
    folder: Annotated[
        Path | None, typer.Option("--folder", help="Study folder of the walls that are run.", callback=_output())
    ] = None,
    plot: Picture = None,
    output: NetcdfFile = None,
    confidence: Annotated[float, typer.Option(help="Of the intervals.", min=0.01, max=0.999)] = 0.9,
    yes: Yes = False,
    mix_versions: MixVersions = False,
    json: Json = False,
    full: Full = False,
    quiet: Quiet = False,
) -> None:
    """Say what damage depends on; of a file, run crossed walls first, which tell what varies from joint to joint."""
    from damagepred.archive.folder import open_study
    from damagepred.assembly import Limits
    from damagepred.study import Study
    from damagepred.study.analyses.variance_shares import crossed_study, study_sensitivity
    from damagepred.study.settings import StudySettings

    place, failed = path, 0
    if not path.is_dir():
        place = folder or path.with_suffix(".crossed.dp")
        crossed = crossed_study(StudySettings.from_toml(path).with_samples(samples, None))
        with screen.StudyBar() as bar:
            walls = Study(crossed, Limits.asked(yes))
            summary = walls.run(place, samples, workers, mix_versions=mix_versions, on_progress=bar.update)
        screen.say(f"{place}: {summary.done} of {summary.total} walls done, {summary.failed} failed")
        if summary.interrupted:
            raise typer.Exit(INTERRUPTED)
        failed = summary.failed
    asked = 1 if category is None and result is None else category
    found = study_sensitivity(open_study(place), category=asked, output=result, confidence=confidence)
    _keep_curves(found, output, plot)
    if json:
        screen.print_json(found)
    else:
        screen.sensitivity_tables(found)
    if failed:
        raise typer.Exit(SOME_FAILED)


@app.command()
def replay(
    folder: StudyFolderPath,
    sample: Annotated[int, typer.Argument(help="Number of the sample, from 0.", min=0, show_default=False)],
    output: NetcdfFile = None,
    plot: PictureFolder = None,
    full: Full = False,
    quiet: Quiet = False,
) -> None:
    """Solve one wall of a study again, the very same, and keep all its fields."""
    from damagepred.study.campaign.replay import replay as replay_sample

    with screen.Bar(f"sample {sample}") as bar:
        ds, comparison = replay_sample(folder, sample, on_step=bar.step)
    _keep_wall(ds, output, plot)
    screen.wall_table(ds)
    screen.say(comparison)
    raise typer.Exit(_ending(ds))


@app.command()
def plot(
    path: WallOrStudy,
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for pictures.", callback=_output())] = Path(
        "pictures"
    ),
    quiet: Quiet = False,
) -> None:
    """Draw a solved wall or a study."""
    from damagepred.archive.files import read_dataset
    from damagepred.archive.folder import open_study

    ds = open_study(path) if path.is_dir() else read_dataset(path)
    if path.is_dir() or "sample" in ds.sizes:  # a study, or one judged again
        from damagepred.plotting import save_study_pictures

        _drew(save_study_pictures(ds, output))
        return
    if "contact_opening" not in ds:
        from damagepred.errors import InputError

        raise InputError(f"{path}: is not the result of solve or replay (it has no contact_opening).")
    _keep_wall(ds, None, output)


@app.command("cracks")
def cracks_command(
    file: Annotated[Path, typer.Argument(help="Result of solve or replay (*.nc).", show_default=False, is_eager=True)],
    csv: Annotated[
        Path | None, typer.Option("--csv", help="CSV file to write, with all increments.", callback=_output(".csv"))
    ] = None,
    output: NetcdfFile = None,
    json: Json = False,
    full: Full = False,
    quiet: Quiet = False,
) -> None:
    """Show the cracks of a solved wall at the end of its path, one by one."""
    from damagepred.archive.files import read_dataset
    from damagepred.exports import write_csv
    from damagepred.wall_cracks import crack_frame
    from damagepred.wall_cracks import cracks as cracks_of

    found = cracks_of(read_dataset(file))
    if csv is not None:
        write_csv(crack_frame(found, None), csv, index=False)
        screen.note(f"wrote {csv}")
    _keep_wall(found, output)
    if json:
        screen.print_json(crack_frame(found))
    else:
        screen.crack_table(found, crack_frame(found))


@app.command("judge")
def judge_command(
    path: WallOrStudy,
    table: Annotated[
        str | None, typer.Option("--table", help="as2870, bre251, or a file (*.toml) written like data/damage.")
    ] = None,
    plasterboard: Annotated[
        bool | None, typer.Option("--plasterboard/--no-plasterboard", help="Limits for walls lined with it.")
    ] = None,
    count_rule: Annotated[
        bool | None, typer.Option("--groups/--no-groups", help="Whether groups of cracks count.")
    ] = None,
    group_count: Annotated[int | None, typer.Option("--group-count", help="Cracks that make a group.")] = None,
    group_distance: Annotated[
        str | None, typer.Option("--group-distance", help='Within which they lie, such as "1 m"; of one wall only.')
    ] = None,
    measure: Measure = None,
    footing_gap: FootingGap = None,
    band_gauge: Annotated[
        str | None, typer.Option("--band-gauge", help='Length laid across a band, such as "1 m"; of one wall only.')
    ] = None,
    output: NetcdfFile = None,
    full: Full = False,
    quiet: Quiet = False,
) -> None:
    """Judge a wall or a study again under another damage table or other rules; nothing is solved."""
    from damagepred.archive.files import read_dataset
    from damagepred.archive.folder import open_study
    from damagepred.rejudge import judge_again

    before = open_study(path) if path.is_dir() else read_dataset(path)
    after = judge_again(
        before,
        table=table,
        plasterboard=plasterboard,
        count_rule=count_rule,
        group_count=group_count,
        group_distance=None if group_distance is None else screen.quantity("--group-distance", group_distance, "m"),
        measure=measure,
        count_footing_gap=footing_gap,
        band_gauge=None if band_gauge is None else screen.quantity("--band-gauge", band_gauge, "m"),
    )
    _keep_wall(after, output)
    screen.judged_again(before, after)


@app.command("materials")
def materials_command(json: Json = False, quiet: Quiet = False) -> None:
    """List the masonry of the library: values, scatter, source and confidence."""
    from damagepred.formatting import quantity
    from damagepred.scene import Scene, masonry_library

    if json:
        screen.print_json(
            {
                name: {**m._asdict(), "correlation": {" with ".join(p): r for p, r in m.correlation.items()}}
                for name, m in masonry_library().items()
            }
        )
        return
    for name, found in masonry_library().items():
        rows = []
        for place, value in found.values.items():
            number, unit = quantity(value.mean, Scene.unit_of(place))
            scatter = "" if value.cov is None else f"{value.cov:g} ({value.cov_confidence})"
            rows.append([place, f"{number} {unit}".strip(), value.confidence, scatter])
        screen.table(f'material = "{name}": {found.description}', ["value", "mean", "confidence", "cov"], rows)
        screen.say(f"source: {found.source}")


@app.command("scales")
def scales_command(
    path: WallOrStudy,
    increment: Annotated[
        int | None, typer.Option("--increment", help="Of which increment; by default of all.", min=0)
    ] = None,
    output: NetcdfFile = None,
    plot: Picture = None,
    json: Json = False,
    full: Full = False,
    quiet: Quiet = False,
) -> None:
    """Judge a wall or a study by all published scales and limits that ship, and show how far they agree."""
    from damagepred.archive.files import read_dataset
    from damagepred.archive.folder import open_study
    from damagepred.scales import compare_scales

    found = compare_scales(open_study(path) if path.is_dir() else read_dataset(path), increment)
    _keep_curves(found, output, plot)
    if json:
        screen.print_json(found)
        return
    screen.scales(found)


@app.command()
def report(
    path: WallOrStudy,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", help="HTML file to write; by default beside the input.", callback=_output(".html", ".htm")
        ),
    ] = None,
    at: Annotated[
        str | None,
        typer.Option("--at", help='Movement ("60 mm"), site class ("H1") or "site", for which the summary answers.'),
    ] = None,
    confidence: Annotated[float, typer.Option(help="Of bands and intervals.", min=0.01, max=0.999)] = 0.9,
    bootstrap: Annotated[int, typer.Option(help="Resamples for the bands of curves.", min=0)] = 1000,
    no_replay: Annotated[
        bool, typer.Option("--no-replay", help="Do not solve a typical wall of a study again to draw it.")
    ] = False,
    posterior: Annotated[
        Path | None, typer.Option("--posterior", help="Back-analysis of the study (infer -o), which gets a section.")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Write one self-contained page about a solved wall or a study."""
    from damagepred.report import write_report
    from damagepred.uq.movement_distribution import movement_distribution

    with screen.Bar("solving a typical wall again") as bar:
        place = write_report(
            path,
            output,
            replay=not no_replay,
            confidence=confidence,
            bootstrap=bootstrap,
            at=None if at is None else movement_distribution(at, option="--at"),
            posterior=posterior,
            on_step=bar.step,
        )
    screen.note(f"wrote {place}")


@app.command()
def guide(
    topic: Annotated[str | None, typer.Argument(help="Page to read; left out, the pages are listed.")] = None,
) -> None:
    """Read the guide in the terminal."""
    from damagepred.guide import TOPICS, page, title

    if topic is not None:
        screen.markdown(page(topic))
        return
    screen.say("damagepred guide TOPIC, with one of these topics:")
    for name in TOPICS:
        screen.say(f"  {name:20} {title(name)}")


def main() -> None:
    """Run the command line; every expected error is one message and an exit code."""
    from damagepred.errors import InputError, SolverError, StudyError

    screen.FORM.quiet = screen.FORM.json = False
    screen.FORM.full = True
    screen.show_archive_warnings()
    try:
        app(prog_name="damagepred")
    except (InputError, StudyError) as error:
        screen.say(str(error), error=True)
        sys.exit(BAD_INPUT)
    except SolverError as error:
        screen.say(str(error), error=True)
        sys.exit(SOME_FAILED)
    except OSError as error:
        screen.say(f"{error.filename or 'system'}: {error.strerror or error}", error=True)
        sys.exit(BAD_INPUT)
    except SystemExit as ending:
        if isinstance(getattr(ending.__context__, "__cause__", None), KeyboardInterrupt):  # as Typer ends then
            screen.say("interrupted", error=True)
        if (reason := screen.lost_output()) and not ending.code:
            screen.say(f"the output could not be written: {reason}", error=True)
            sys.exit(BAD_INPUT)
        raise


def _fragility_surface(
    study: xr.Dataset,
    second: str,
    categories: list[int] | None,
    intensity: Intensity | None,
    confidence: float,
    bootstrap: int,
    options: FragilityOptions,
    output: Path | None,
    plot: Path | None,
    json: bool,
) -> None:
    from damagepred.errors import InputError
    from damagepred.uq.fragility import fit_surface

    if categories is None or len(categories) != 1:
        raise InputError("--against: a surface is of one category; name it, such as --categories 2.")
    surface = fit_surface(
        study,
        categories[0],
        second,
        intensity=intensity,
        confidence=confidence,
        bootstrap=bootstrap,
        options=options,
    )
    _keep_curves(surface, output, plot)
    if json:
        screen.print_json(surface)
        return
    for line in screen.surface_lines(surface):
        screen.say(line)


def _described(file: Path) -> tuple[Scene, StudySettings | None]:
    """Read a scene file, or a study file with its scene."""
    from damagepred.input_files import read_toml
    from damagepred.scene import Scene
    from damagepred.scene.scene import STUDY_KEYS
    from damagepred.solvers.options import SolverOptions

    if any(key in read_toml(file) for key in STUDY_KEYS):
        from damagepred.study.settings import StudySettings  # slow to import, and a scene needs none of it

        settings = StudySettings.from_toml(file)
        return settings.scene, settings
    scene = Scene.from_toml(file)
    SolverOptions.of(scene.solver, str(file))  # refused with the name of the file
    return scene, None


def _ask_back(described: Scene, settings: StudySettings | None) -> None:
    """Name numbers that are unlikely in their unit, that variables replace, and that nothing reads."""
    from damagepred.scene.assumed import ground_cautions
    from damagepred.scene.plausibility import unlikely_values

    screen.cautions(unlikely_values(described, settings.means() if settings else None))
    screen.cautions(settings.other_means() if settings else [])
    screen.cautions(ground_cautions(described, settings.variables if settings else ()))


def _say_ground(described: Scene, settings: StudySettings | None) -> None:
    """Print the surface movement of a soil log, and assumed properties of the ground."""
    from damagepred.scene.assumed import ground_line
    from damagepred.study.campaign.site_classes import site_line

    for line in (site_line(described, settings), ground_line(described, settings.variables if settings else ())):
        if line:
            screen.note(line)


def _drew(files: Iterable[Path]) -> None:
    for file in files:
        screen.note(f"drew {file}")


def _keep_wall(ds: xr.Dataset, output: Path | None, plot: Path | None = None) -> None:
    """Write and draw a wall where asked, before anything else is printed."""
    from damagepred.archive.files import write_dataset

    if output is not None:
        write_dataset(ds, output)
        screen.note(f"wrote {output}")
    if plot is not None:
        from damagepred.plotting import save_wall_pictures

        with screen.doing("drawing the wall"):
            _drew(save_wall_pictures(ds, plot))


def _keep_curves(ds: xr.Dataset, output: Path | None, plot: Path | None) -> None:
    """Write and draw what was found from a study where asked."""
    from damagepred.archive.schema import SCHEMA_VERSION

    _keep_wall(ds.assign_attrs(schema_version=SCHEMA_VERSION), output)
    if plot is not None:
        from damagepred.plotting import save_fragility_picture

        with screen.doing("drawing"):
            screen.note(f"drew {save_fragility_picture(ds, plot)}")


def _ending(ds: xr.Dataset) -> int:
    """Print how a path ended, if early, and return the exit code."""
    ending = ds.attrs["status"]
    if ending != PathStatus.COMPLETE:
        screen.say(f"{ending}: {ds.attrs['status_message']}", error=True)
    return {PathStatus.FAILED: SOME_FAILED, PathStatus.INTERRUPTED: INTERRUPTED}.get(ending, OK)
