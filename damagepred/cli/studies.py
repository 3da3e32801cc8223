"""Commands that run studies and tend their folders."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

from typer import Argument, Exit, Option

import damagepred as dp
from damagepred.cli import options as opt
from damagepred.cli import terminal
from damagepred.cli.walls import _ask_back, _say_ground
from damagepred.formatting import counted


@opt.command("study", "quiet")
def study(
    file: opt.StudyFile,
    samples: Annotated[int | None, Option("-n", "--samples", min=1, help="Samples in all.")] = None,
    workers: opt.Workers = 1,
    output: Annotated[Path | None, opt.writes("-o --output", "Study folder (*.dp).")] = None,
    seed: opt.Seed = None,
    timeout: opt.Timeout = None,
    retry_failed: Annotated[bool, Option("--retry-failed", help="Run failed samples again.")] = False,
    mix_versions: opt.MixVersions = False,
    scheduler: Annotated[
        str | None, Option(help="Run on the workers of this Dask scheduler (tcp://HOST:PORT).")
    ] = None,
    yes: opt.Yes = False,
) -> None:
    """Run a Monte Carlo study; the same command resumes it, a larger -n extends it."""
    from damagepred.archive.cautions import STUDIED, study_cautions
    from damagepred.archive.folder import StudyFolder
    from damagepred.campaign.dispatch import connect_dask_scheduler
    from damagepred.campaign.settings import StudySettings
    from damagepred.campaign.stopping import run_until
    from damagepred.cli.sentences import ending_lines

    settings = StudySettings.from_toml(file).with_samples(samples, seed)
    folder, houses = output or file.with_suffix(".dp"), isinstance(settings.scene, dp.scene.House)
    _ask_back(settings.scene, settings)
    _say_ground(settings.mean_wall()[0] if settings.scene.soil_layer else settings.scene, settings)
    with ExitStack() as open_until_the_end:
        client = open_until_the_end.enter_context(connect_dask_scheduler(scheduler)) if scheduler else None
        bar = open_until_the_end.enter_context(terminal.StudyBar(houses))
        ending = run_until(
            dp.Study(settings, dp.Limits.asked(yes, timeout)),
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
    if settings.study.stop_when is not None:
        terminal.lines(counted(line, houses) for line in ending_lines(ending, settings.study.stop_when))
    word = "interrupted" if summary.interrupted else "complete"
    done = f"{summary.done} of {summary.total} {bar.noun} done, {summary.failed} failed"
    terminal.say(f"{folder}: {word}, {done}, {summary.seconds:.1f} s this time")
    terminal.cautions([counted(line, houses) for line in study_cautions(StudyFolder(folder).results(STUDIED))])
    if summary.interrupted:
        terminal.say(f"all finished {bar.noun} are stored; the same command goes on from here")
        raise Exit(opt.INTERRUPTED)
    if summary.failed:
        terminal.say(f"reasons of the failures: {folder / 'failures'}", error=True)
        raise Exit(opt.SOME_FAILED)


@opt.command("status", "json", "full", "quiet")
def status(folder: opt.StudyFolderPath) -> None:
    """Show walls done, failed and left, and the present estimate; the study may be running."""
    from damagepred.campaign.status import StudyStatus, study_status
    from damagepred.cli.sentences import share_rows, status_lines

    def show(report: StudyStatus) -> None:
        terminal.lines(status_lines(report))
        if report.categories:
            noun = "houses" if report.houses else "walls"
            title = f"Share of {noun} by category reached by the end of the movement"
            columns = ("category", noun, "share", "or worse", "90 % interval", "failed counted")
            terminal.table(title, columns, share_rows(report))

    terminal.answer(study_status(folder), show, without=["cautions"])


@opt.command("verify")
def verify(
    path: Annotated[Path, Argument(help="Study folder (*.dp), or file (*.nc).", show_default=False)],
    samples: Annotated[int, Option(help="Number of samples to solve again and compare bit by bit.", min=0)] = 0,
) -> None:
    """Check a study folder or a file: exit code 0 if it is sound, 2 if damaged, 3 if walls solved again differ."""
    from damagepred.campaign.verify import verify as verify_archive

    verification = verify_archive(path, samples, terminal.say)
    said = [*verification.damaged, *verification.differing, *verification.notes]
    terminal.lines([*said, f"files checked: {verification.files}; damaged: {len(verification.damaged) or 'none'}"])
    if verification.damaged:
        if path.is_dir():
            terminal.say(f"next: damagepred repair {path}", error=True)
        raise Exit(opt.BAD_INPUT)
    if verification.differing:
        raise Exit(opt.SOME_FAILED)


@opt.command("repair")
def repair(folder: opt.StudyFolderPath) -> None:
    """Rebuild derived files of a study folder; set damaged files aside, so that `study` solves their walls again."""
    from damagepred.campaign.verify import repair as repair_folder

    terminal.lines(repair_folder(folder) or [f"{folder}: nothing to repair"])


@opt.command("rare", "json", "quiet")
def rare(
    file: opt.StudyFile,
    category: opt.Category,
    at: opt.AtMovement,
    samples: Annotated[
        int | None, Option("-n", "--samples", min=10, help="Samples per level of a run; 200 in a new folder.")
    ] = None,
    runs: Annotated[
        int | None, Option(min=1, help="Independent runs, which tell the error; 5 in a new folder.")
    ] = None,
    workers: opt.Workers = 1,
    output: Annotated[Path | None, opt.writes("-o --output", "Folder (*.rare).")] = None,
    seed: opt.Seed = None,
    level_share: Annotated[float, Option(help="Share of a level's samples that the next starts from.")] = 0.1,
    reach: Annotated[float, Option(help="Factor on the movement to which samples are solved.")] = 2.0,
    timeout: opt.Timeout = None,
    yes: opt.Yes = False,
    mix_versions: opt.MixVersions = False,
) -> None:
    """Estimate a small probability of damage by subset simulation; the same command resumes it."""
    from damagepred.analyses.limit_state import Question
    from damagepred.analyses.rare_event import kept_sizes, rare_event
    from damagepred.campaign.settings import StudySettings
    from damagepred.cli.sentences import rare_lines
    from damagepred.uq.capacity import numbered_category

    movement, settings = terminal.quantity("--at", at, "m"), StudySettings.from_toml(file).with_samples(None, seed)
    if isinstance(category, str):
        names = settings.damage_table.category_names
        category = numbered_category(category, {name: i for i, name in enumerate(names) if i})
    question = Question(category, movement, reach)
    folder = output or file.with_suffix(".rare")
    sizes = {"samples": 200, "runs": 5} | kept_sizes(folder)
    sizes |= {key: value for key, value in (("samples", samples), ("runs", runs)) if value is not None}
    result = rare_event(
        settings,
        question,
        folder,
        **sizes,
        level_share=level_share,
        workers=workers,
        timeout=timeout,
        limits=dp.Limits.asked(yes, timeout),
        mix_versions=mix_versions,
        on_level=lambda level: terminal.note(f"level reached: margin {level.limit:.4g}, share {level.share:.3g}"),
    )
    if terminal.FORM.json:
        terminal.print_json(result)
    houses = isinstance(settings.scene, dp.scene.House)
    terminal.lines(counted(line, houses) for line in rare_lines(result, question))
    if result.failed:
        raise Exit(opt.SOME_FAILED)


@opt.command("design", "json", "full", "quiet")
def design_command(
    file: Annotated[Path, Argument(help="File of the choices (TOML).", show_default=False)],
    workers: opt.Workers = 1,
    folder: Annotated[Path | None, opt.writes("--folder", "Folder of the alternatives' studies.")] = None,
    output: opt.NetcdfFile = None,
    plot: opt.Picture = None,
) -> None:
    """Search the cheapest alternative with unlikely damage, or the least expected cost; the same command resumes."""
    from damagepred.analyses.design_search import price_of_search
    from damagepred.cli import tables

    terminal.note(price_of_search(file, workers))
    with terminal.Bar("solving alternatives") as bar:
        search = dp.search_design(
            file,
            folder or file.with_suffix(".design"),
            workers=workers,
            on_round=lambda size, count: terminal.note(f"{count} alternatives, {size} samples each"),
            on_walls=bar.walls,
        )
    opt.keep_curves(search, output, plot)
    terminal.answer(search, tables.design_search)


@opt.command("portfolio", "json", "full", "quiet")
def portfolio_command(
    houses: Annotated[Path, Argument(help="Table of houses (CSV, xlsx), one row each.", show_default=False)],
    file: opt.StudyFile,
    samples: Annotated[int | None, Option("-n", "--samples", min=1, help="Samples per house.")] = None,
    workers: opt.Workers = 1,
    folder: Annotated[Path | None, opt.writes("--folder", "Folder of the houses' studies.")] = None,
    at: opt.MovementOrClass = "site",
    output: opt.NetcdfFile = None,
    table: Annotated[Path | None, opt.writes("--table", "Table to write (csv, gpkg).", ".csv", ".gpkg")] = None,
    crs: Annotated[str | None, Option(help="Coordinate system of eastings, such as EPSG:28354.")] = None,
    plot: opt.Picture = None,
) -> None:
    """Assess a street: one row per house in, one row per house out; the same command resumes."""
    from damagepred.analyses.portfolio import map_columns, price_of_portfolio, write_portfolio
    from damagepred.cli import tables
    from damagepred.scene.number_table import read_number_table

    if table is not None and table.suffix == ".gpkg":
        map_columns(read_number_table(houses).names, table, crs)
    terminal.note(price_of_portfolio(houses, file, workers, samples, at))
    with terminal.doing("solving houses") as activity:

        def on_house(number: int, count: int, name: str) -> None:
            activity[0] = f"solving {name}, house {number} of {count}"

        street = dp.assess_portfolio(
            houses,
            file,
            folder or houses.with_suffix(".portfolio"),
            samples=samples,
            at=at,
            workers=workers,
            on_house=on_house,
        )
    if table is not None:
        write_portfolio(street, table, crs)
        opt.say_files("wrote", table)
    opt.keep_curves(street, output, plot)
    terminal.answer(street, tables.portfolio)
    if street["failed"].any():
        raise Exit(opt.SOME_FAILED)
