"""Commands that read results."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from typer import Argument, Option

import damagepred as dp
from damagepred.cli import options as opt
from damagepred.cli import terminal
from damagepred.errors import InputError
from damagepred.formatting import counted


@opt.command("estimate", "json", "quiet")
def estimate(
    folder: opt.StudyFolderPath,
    category: Annotated[
        Any, opt.category_option("Of damage, or worse; by default the worst that a wall reaches.")
    ] = None,
    at: opt.MovementOrClass = "site",
    wall: opt.Wall = None,
    confidence: opt.Confidence = 0.9,
    study_file: Annotated[
        Path | None, Option("--study", help="Study file whose [study.epistemic] to take instead.")
    ] = None,
) -> None:
    """Estimate the probability of each category from a study: Monte Carlo error, failed walls, uncertain inputs."""
    from damagepred.analyses.epistemic import alternatives
    from damagepred.campaign.settings import StudySettings
    from damagepred.cli.sentences import estimate_lines
    from damagepred.report.summary import answers
    from damagepred.results.house import is_house, study_of
    from damagepred.results.tables import Table, probability_columns
    from damagepred.uq.capacity import category_number
    from damagepred.uq.movement_distribution import movement_distribution

    movement = movement_distribution(at, option="--at")
    others = StudySettings.from_toml(study_file).study.epistemic if study_file else None
    ds = study_of(folder, wall)
    chosen = None if category is None else category_number(ds, category)
    question, found = answers(ds, movement, confidence)
    if chosen is None:
        chosen = max((c for c, one in found.items() if one.estimate.value > 0), default=1)
    estimates = alternatives(folder, chosen, movement, others=others, confidence=confidence, wall=wall)
    points = () if movement.own else movement.points  # shares of each wall's own movement
    values = [{**one._asdict(), "name": one.name or None} for one in estimates]
    asked = {"category": chosen, "at": movement.name, "movement": points[0] if len(points) == 1 else points}
    every = [{"category": c, **one._asdict()} for c, one in found.items()]

    def show(_: object) -> None:
        terminal.show(Table.brief(question, probability_columns(ds, found)))
        terminal.lines(estimate_lines(estimates, chosen, movement.words, is_house(ds)))

    terminal.answer({**asked, "alternatives": values, "categories": every}, show)


@opt.command("compare", "json", "quiet")
def compare(
    folders: Annotated[list[Path], Argument(help="Study folders (*.dp); the first is the reference.")],
    category: opt.Category,
    at: opt.MovementOrClass = "site",
    wall: opt.Wall = None,
    confidence: opt.Confidence = 0.9,
    output: opt.NetcdfFile = None,
    plot: opt.Picture = None,
) -> None:
    """Compare studies: change of a probability of damage by each measure, with the same samples."""
    from damagepred.analyses.stored_walls import study_name
    from damagepred.cli.sentences import comparison_lines
    from damagepred.results.house import is_house, study_of
    from damagepred.uq.capacity import category_number
    from damagepred.uq.movement_distribution import movement_distribution

    movement = movement_distribution(at, option="--at")
    names = [study_name(folder) for folder in folders]
    if len(set(names)) < len(names):
        names = [str(folder) for folder in folders]
    if twice := [name for name in names if names.count(name) > 1]:
        raise InputError(f"{twice[0]}: is given twice; compare it with another study.")
    studies = {name: study_of(folder, wall) for name, folder in zip(names, folders)}
    category = category_number(next(iter(studies.values())), category)
    comparison = dp.compare(studies, categories=[category], at=[movement], confidence=confidence)
    if terminal.FORM.json:
        terminal.print_json(comparison)
    terminal.say(f"P(category >= {category} at {counted(movement.words, any(map(is_house, studies.values())))})")
    terminal.lines(comparison_lines(comparison, category, float(comparison["movement"][0])))
    if movement.assumption:
        terminal.note(movement.assumption)
    if output is not None or plot is not None:
        opt.keep_curves(dp.compare(studies, categories=[category], confidence=confidence), output, plot)


_STUDIES_AND_SURVEY = "Study folders (*.dp), one per cause, and then the observations (*.toml, *.csv, *.xlsx)."


@opt.command("infer", "json", "full", "quiet")
def infer_command(
    files: Annotated[list[Path], Argument(help=_STUDIES_AND_SURVEY, show_default=False)],
    replays: Annotated[int, Option(min=1, help="Samples a study that are replayed for local cracks, at most.")] = 200,
    new_walls: Annotated[
        int, Option(min=0, help="Walls a round that are run where too few samples are effective.")
    ] = 0,
    until: Annotated[
        list[str] | None,
        Option(help="Date of a forecast, such as 2031 or 2031-06-30; repeat it for more dates."),
    ] = None,
    workers: opt.Workers = 1,
    output: opt.NetcdfFile = None,
    plot: opt.Picture = None,
) -> None:
    """Infer movement and cause from observed cracks, levels and windows, and what further movement would bring."""
    from damagepred.analyses.back_analysis import prices
    from damagepred.analyses.inference_options import InferenceOptions
    from damagepred.analyses.posterior_tables import reported
    from damagepred.cli import tables
    from damagepred.report.back_analysis import posterior_cautions
    from damagepred.scene.survey_tables import SUFFIXES
    from damagepred.uq.observations import Observations

    if len(files) < 2 or files[-1].suffix.lower() not in (".toml", *SUFFIXES):
        raise InputError("infer: give one study folder or more, and then the observations (*.toml, *.csv, *.xlsx).")
    options = InferenceOptions(replays=replays, new_walls=new_walls)
    seen = Observations.from_toml(files[-1], until or ())
    for price in prices(files[:-1], seen, options, workers):
        terminal.note(price)
    with terminal.Bar("replays") as bar:
        posterior = dp.infer(
            files[:-1], seen, workers=workers, options=options, on_replay=bar.replays, on_walls=bar.walls
        )
    opt.keep_curves(posterior, output, plot)
    terminal.cautions(posterior_cautions(posterior))
    terminal.answer(reported(posterior), lambda _: tables.back_analysis(posterior))


_MEASURES = f"Of the movement: {', '.join(get_args(opt.Intensity))}; on mounds by default the first."


@opt.command("fragility", "json", "full", "quiet")
def fragility(
    folder: opt.StudyFolderPath,
    output: opt.NetcdfFile = None,
    plot: opt.Picture = None,
    csv: opt.CsvFile = None,
    wall: opt.Wall = None,
    intensity: Annotated[opt.Intensity | None, Option(metavar="MEASURE", help=_MEASURES)] = None,
    model: Annotated[
        Literal["separate", "common", "empirical"],
        Option(help="A lognormal for each category, all of one dispersion (never cross), or no form."),
    ] = "separate",
    confidence: opt.Confidence = 0.9,
    bootstrap: Annotated[int, Option(help="Resamples for the band.", min=0)] = 1000,
    goodness: Annotated[int, Option(help="Times samples are made up to judge the fit.", min=0)] = 100,
    export: Annotated[
        Literal["pelicun", "openquake", "openquake-discrete"] | None,
        Option(help="Write for another program, beside -o or the study folder."),
    ] = None,
    extrapolated: opt.Extrapolated = False,
    categories: opt.Categories = None,
    against: Annotated[str | None, Option(help="Input to fit a surface to, of the category of --categories.")] = None,
    measure: opt.Measure = None,
    footing_gap: opt.FootingGap = None,
) -> None:
    """Fit fragility curves to a study."""
    from damagepred.cli import tables
    from damagepred.cli.sentences import surface_lines
    from damagepred.results.house import study_of
    from damagepred.results.rejudge import footing_gap_note

    wanted = terminal.categories(categories)
    study = study_of(folder, wall)
    if measure is not None or footing_gap is not None:
        study = dp.judge_again(study, measure=measure, count_footing_gap=footing_gap)
    fit: dict[str, Any] = {"intensity": intensity, "confidence": confidence, "bootstrap": bootstrap}
    if against is not None:
        if wanted is None or len(wanted) != 1:
            raise InputError("--against: a surface is of one category; name it, such as --categories 2.")
        surface = dp.fit_surface(study, wanted[0], against, **fit)
        opt.keep_curves(surface, output, plot)
        terminal.answer(surface, lambda _: terminal.lines(surface_lines(surface)))
        return
    curves = dp.fit_fragility(study, model=model, categories=wanted, goodness=goodness, **fit)
    opt.keep_curves(curves, output, plot)
    if csv is not None:
        opt.keep_table(dp.frame(curves), csv)
        if intensity == "time":
            from damagepred.results.tables import year_frame

            opt.keep_table(year_frame(study, confidence), csv.with_stem(f"{csv.stem}_years"))
    if export is not None:
        opt.say_files("wrote", *dp.exports.export_curves(curves, export, output or folder, extrapolated=extrapolated))
    terminal.answer(curves, tables.fragility_table)
    if intensity == "time" and not terminal.FORM.json:
        tables.year_table(study, confidence)
    if note := footing_gap_note(study):
        terminal.note(f"note: {note}")


@opt.command("export", "quiet")
def export(
    path: Annotated[Path, Argument(help="Study folder (*.dp), or curves of fragility (*.nc).")],
    form: Annotated[
        Literal["pelicun", "openquake", "openquake-discrete", "curves", "walls"],
        Argument(help="Program; or CSV of curves, or of the walls of a study.", show_default=False),
    ],
    output: Annotated[
        Path | None, opt.writes("-o --output", "File to write (csv, xml), by default beside the input.", ".csv", ".xml")
    ] = None,
    categories: opt.Categories = None,
    extrapolated: opt.Extrapolated = False,
) -> None:
    """Write curves or walls for another program."""
    from damagepred.archive.files import read_dataset
    from damagepred.exports.frames import curves_frame

    wanted = terminal.categories(categories)
    place = output or path.with_name(f"{path.stem}_{form}.csv")
    if form == "walls":
        opt.keep_table(dp.frame(dp.open_study(path)), place)
        return
    curves = dp.fit_fragility(dp.open_study(path), categories=wanted) if path.is_dir() else read_dataset(path)
    if form == "curves":
        opt.keep_table(curves_frame(curves), place)
    else:
        opt.say_files("wrote", *dp.exports.export_curves(curves, form, output or path, wanted, extrapolated))


@opt.command("sensitivity", "json", "full", "quiet")
def sensitivity(
    folder: opt.StudyFolderPath,
    category: Annotated[Any, opt.category_option("Category of the capacity.")] = None,
    result: Annotated[str | None, Option("--of", help="Of this result, at the end of the movement.")] = None,
    at: Annotated[str | None, Option(metavar="site", help="Of damage at each wall's own movement.")] = None,
    wall: opt.Wall = None,
    plot: opt.Picture = None,
    output: opt.NetcdfFile = None,
    confidence: opt.Confidence = 0.9,
) -> None:
    """Rank the inputs of a study by their influence on damage: rank correlations and shares of variance."""
    from damagepred.cli import tables
    from damagepred.results.house import study_of

    if at not in (None, "site"):
        raise InputError(
            f"--at {at}: must be site, each wall's own movement. Without it, sensitivity is of the movement at which a "
            "category is reached."
        )
    chosen = 1 if category is None and result is None else category
    indices = dp.study_sensitivity(
        study_of(folder, wall), category=chosen, output=result, own_ground=at is not None, confidence=confidence
    )
    opt.keep_curves(indices, output, plot)
    terminal.answer(indices, tables.sensitivity_tables)


@opt.command("plot", "quiet")
def plot(
    path: opt.WallOrStudy,
    output: Annotated[Path, opt.writes("-o --output", "Folder for pictures.")] = Path("pictures"),
    gif: Annotated[
        Path | None, opt.writes("--gif", "Moving picture of a wall's path instead.", ".gif", new_folder=True)
    ] = None,
) -> None:
    """Draw a solved wall or a study."""
    ds = opt.open_result(path)
    if gif is not None:
        if "sample" in ds.sizes:
            raise InputError(
                f"--gif {gif}: goes with one wall; `damagepred replay {path} SAMPLE -o wall.nc` solves one."
            )
        opt.say_files("drew", dp.plotting.save_animation(ds, gif))
    elif path.is_dir() or "sample" in ds.sizes:  # a study, or one judged again
        opt.say_files("drew", *dp.plotting.save_study_pictures(ds, output))
    elif "contact_opening" not in ds:
        raise InputError(f"{path}: is not the result of solve or replay (it has no contact_opening).")
    else:
        opt.keep_wall(ds, None, output)


@opt.command("scales", "json", "full", "quiet")
def scales_command(
    path: opt.WallOrStudy,
    increment: Annotated[int | None, Option(help="Of which increment; by default of all.", min=0)] = None,
    output: opt.NetcdfFile = None,
    plot: opt.Picture = None,
) -> None:
    """Judge a wall or a study by all published scales and limits that ship, and show their agreement."""
    from damagepred.cli import tables

    agreement = dp.compare_scales(opt.open_result(path), increment)
    opt.keep_curves(agreement, output, plot)
    terminal.answer(agreement, tables.scales)


@opt.command("report", "quiet")
def report(
    path: opt.WallOrStudy,
    measures: Annotated[
        list[Path] | None, Argument(help="Folders of the same study with measures, to compare.")
    ] = None,
    output: Annotated[
        Path | None, opt.writes("-o --output", "HTML file to write; by default beside the input.", ".html", ".htm")
    ] = None,
    at: Annotated[
        str | None, Option(help='Movement ("60 mm"), site class ("H1") or "site", for which the summary answers.')
    ] = None,
    confidence: opt.Confidence = 0.9,
    bootstrap: Annotated[int, Option(help="Resamples for the bands of curves.", min=0)] = 1000,
    no_replay: Annotated[
        bool, Option("--no-replay", help="Do not solve a typical wall of a study again to draw it.")
    ] = False,
    posterior: Annotated[
        Path | None, Option(help="Back-analysis of the study (infer -o), which gets a section.")
    ] = None,
) -> None:
    """Write one self-contained page about a solved wall or a study."""
    from damagepred.uq.movement_distribution import movement_distribution

    with terminal.Bar("solving a typical sample again" if path.is_dir() else "drawing the page") as bar:
        place = dp.report.write_report(
            path,
            output,
            replay=not no_replay,
            confidence=confidence,
            bootstrap=bootstrap,
            at=None if at is None else movement_distribution(at, option="--at"),
            posterior=posterior,
            measures=measures or [],
            on_step=bar.step,
        )
    opt.say_files("wrote", place)
