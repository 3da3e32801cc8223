"""The application: options that commands share, exit codes, output that is checked before work."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

import damagepred as dp
from damagepred.cli import terminal
from damagepred.enumerations import PathStatus

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


app: typer.Typer = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # brackets in help texts are no markup
    context_settings={"help_option_names": ["-h", "--help"]},
)

OK, BAD_INPUT, SOME_FAILED, INTERRUPTED = 0, 2, 3, 130
"""Exit codes."""


def writes(names: str, help: str, *suffixes: str, new_folder: bool = False, or_folder: bool = False) -> Any:
    """Option for a file to write, or without suffixes a folder, which is checked before the command does anything."""

    def check(context: typer.Context, value: Path | None) -> Path | None:
        if value is not None and not context.resilient_parsing:
            from damagepred.archive.files import check_output

            # typer 0.20 makes a Path of an argument only after this check
            arguments = {p.name for p in context.command.params if p.param_type_name == "argument"}
            given = [
                v for name, v in context.params.items() if isinstance(v, (str, Path) if name in arguments else Path)
            ]
            inputs = [Path(value) for value in given]
            folder = or_folder and (value.is_dir() or not value.suffix)
            check_output(value, *(() if folder else suffixes), inputs=inputs, new_folder=new_folder and not folder)
        return value

    return typer.Option(*names.split(), help=help, callback=check)


PICTURES = (".png", ".pdf", ".svg")

SceneOrStudyFile = Annotated[Path, typer.Argument(help="Scene or study file (TOML).", show_default=False)]
StudyFile = Annotated[Path, typer.Argument(help="Study file (TOML).", show_default=False)]
StudyFolderPath = Annotated[Path, typer.Argument(help="Study folder (*.dp).", show_default=False)]
Wall = Annotated[str | None, typer.Option("--wall", help="Wall of a house; by default the house, by its worst wall.")]
WallOrStudy = Annotated[
    Path, typer.Argument(help="Result of solve (*.nc) or study folder (*.dp).", show_default=False, is_eager=True)
]
NetcdfFile = Annotated[Path | None, writes("-o --output", "netCDF file to write.", ".nc")]
Picture = Annotated[Path | None, writes("--plot", "Picture to draw (png, svg, pdf).", *PICTURES, new_folder=True)]
PictureFolder = Annotated[Path | None, writes("--plot", "Folder for pictures.")]
_DRAWN = "Picture to draw (png, svg, pdf), or folder for it."
PictureOrFolder = Annotated[Path | None, writes("--plot", _DRAWN, *PICTURES, new_folder=True, or_folder=True)]


def category_option(help: str) -> Any:
    """Option for a category of damage."""
    return typer.Option("--category", parser=terminal.category, metavar="NUMBER|NAME", help=help)


Category = Annotated[Any, category_option('Of damage, or worse: 2, or "slight".')]
AtMovement = Annotated[str, typer.Option("--at", help='Movement, such as "8 mm".')]
_AT = 'Movement ("8 mm"), site class ("H1"), distribution; "site": the end of each wall\'s own.'
MovementOrClass = Annotated[str, typer.Option("--at", help=_AT)]
Samples = Annotated[int | None, typer.Option("-n", "--samples", min=1, help="Samples in all.")]
Workers = Annotated[int, typer.Option("-j", "--workers", min=1, help="Processes.")]
Seed = Annotated[int | None, typer.Option("--seed", min=0, help="Instead of the file's.")]
Yes = Annotated[bool, typer.Option("--yes", help="Solve samples whatever memory and time they are estimated to take.")]
Timeout = Annotated[float | None, typer.Option(help="Seconds a wall may take, by default 3600; inf lifts the limit.")]
_MIX = "Go on although another version has solved samples; status will say so."
MixVersions = Annotated[bool, typer.Option("--mix-versions", help=_MIX)]
Confidence = Annotated[float, typer.Option(help="Of intervals and bands.", min=0.01, max=0.999)]
Categories = Annotated[str | None, typer.Option(help="Categories, such as 1,2 or slight,moderate; by default all.")]
_BEYOND = "Export curves whose median lies beyond the movement of the samples."
Extrapolated = Annotated[bool, typer.Option("--extrapolated", help=_BEYOND)]
CsvFile = Annotated[Path | None, writes("--csv", "CSV file to write.", ".csv")]
_WIDTH = "Width that makes the category: of one joint, or of a crack band (neighbouring joints)."
Measure = Annotated[Literal["joint", "band"] | None, typer.Option(help=_WIDTH)]
FootingGap = Annotated[bool | None, typer.Option(help="Whether a gap on the footing counts without a dpc.")]


def _show_version(asked: bool) -> None:
    if asked:
        terminal.say(f"damagepred {dp.__version__}")
        raise typer.Exit


def _form(option: typer.CallbackParam, value: bool) -> bool:
    setattr(terminal.FORM, str(option.name), value)
    return value


_FORMS = {
    "json": "Print the result as JSON, numbers not rounded.",
    "full": "Tables with all columns and rows.",
    "quiet": "Neither progress nor notes; errors stay.",
}
"""Options of the output, which set ``terminal.FORM``, and their help."""


def command(name: str, *forms: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Decorator of a command with some options of the output, which its function does not take."""

    def register(function: Callable[..., None]) -> Callable[..., None]:
        @wraps(function)
        def run(**given: Any) -> None:
            function(**{key: value for key, value in given.items() if key not in forms})

        own, more = inspect.signature(function, eval_str=True), []
        for form in forms:
            option = Annotated[bool, typer.Option(f"--{form}", callback=_form, is_eager=True, help=_FORMS[form])]
            more.append(inspect.Parameter(form, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=option))
        run.__signature__ = own.replace(parameters=[*own.parameters.values(), *more])  # type: ignore[attr-defined]
        app.command(name, short_help=inspect.getdoc(function))(run)  # whole: click would cut it at one line
        return function

    return register


_OfWall = Literal["surface_movement", "central_deflection", "deflection_ratio", "settlement", "differential_settlement"]
_OfGround = Literal["angular_distortion", "ground_tilt", "horizontal_strain"]
_Others = Literal["curvature", "footing_curvature", "time", "differential_movement"]
Intensity = Literal[_OfWall, _OfGround, _Others]


DOING = {
    "new": "writing the template",
    "check": "reading the file",
    "solve": "reading the file",
    "study": "reading the study",
    "status": "reading the study",
    "verify": "checking files, and solving samples again where asked",
    "repair": "checking and repairing files",
    "rare": "solving the levels",
    "estimate": "reading the study and estimating",
    "compare": "reading the studies and comparing them",
    "infer": "reading the studies and the observations",
    "design": "pricing the search: solving one sample",
    "portfolio": "reading the houses, pricing the run with three of them, and drawing",
    "fragility": "fitting curves, their bands and their goodness",
    "export": "reading, fitting and writing",
    "sensitivity": "reading the samples and resampling them",
    "replay": "reading the study",
    "plot": "drawing",
    "cracks": "tracing cracks",
    "judge": "judging again",
    "materials": "reading the library",
    "scales": "judging by all scales",
    "report": "collecting and drawing for the page",
    "guide": "reading the guide",
    "cache": "looking for compiled code",
}
"""Activity of each command, shown while it prints no results; the help lists the commands in this order."""


@app.callback()
def common(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """How likely is each damage category of a masonry wall when the ground under it moves?"""  # noqa: D400
    context.with_resource(terminal.doing(DOING[str(context.invoked_subcommand)]))


def open_result(path: Path) -> xr.Dataset:
    """Study of a folder, or the dataset of a file."""
    from damagepred.archive.files import read_dataset

    return dp.open_study(path) if path.is_dir() else read_dataset(path)


def say_files(verb: str, *files: Path) -> None:
    """Name the files that were written or drawn."""
    for file in files:
        terminal.note(f"{verb} {file}")


def keep_table(frame: pd.DataFrame, file: Path, index: bool = True) -> None:
    """Write a table as CSV."""
    from damagepred.exports.programs import write_csv

    write_csv(frame, file, index=index)
    say_files("wrote", file)


def keep_wall(ds: xr.Dataset, output: Path | None, plot: Path | None = None) -> None:
    """Write and draw a wall on request, before all other output."""
    from damagepred.archive.files import write_dataset

    if output is not None:
        write_dataset(ds, output)
        say_files("wrote", output)
    if plot is not None:
        with terminal.doing("drawing the result"):
            say_files("drew", *dp.plotting.save_wall_pictures(ds, plot))


def keep_curves(ds: xr.Dataset, output: Path | None, plot: Path | None) -> None:
    """Write and draw a result of a study on request."""
    from damagepred.archive.schema import SCHEMA_VERSION

    keep_wall(ds.assign_attrs(schema_version=SCHEMA_VERSION), output)
    if plot is not None:
        with terminal.doing("drawing"):
            say_files("drew", dp.plotting.save_fragility_picture(ds, plot))


def exit_code(ds: xr.Dataset) -> int:
    """Print how a path ended, if early, and return the exit code."""
    ending = ds.attrs["status"]
    if ending != PathStatus.COMPLETE:
        terminal.say(f"{ending}: {ds.attrs['status_message']}", error=True)
    return {PathStatus.FAILED: SOME_FAILED, PathStatus.INTERRUPTED: INTERRUPTED}.get(ending, OK)
