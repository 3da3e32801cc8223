"""The page of a study."""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import xarray as xr

from damagepred.archive.folder import StudyFolder
from damagepred.archive.provenance import mixture
from damagepred.campaign.settings import StudySettings, read_frozen
from damagepred.enumerations import SOLVED, SampleStatus
from damagepred.errors import DamagepredError, InputError
from damagepred.formatting import counted, duration, length, named, number
from damagepred.report.back_analysis import back_analysis_section
from damagepred.report.caveats import study_caveats
from damagepred.report.comparison import comparison_parts
from damagepred.report.house import house_damage, house_drawings, walls_table
from damagepred.report.inputs import input_section, place_in_words
from damagepred.report.limits import study_limits
from damagepred.report.parts import Listing, Page, Part, Section, Text, drawing
from damagepred.report.quality import common_movement, monte_carlo, study_quality
from damagepred.report.summary import answers, asked_movement, influences, movement_number, study_summary
from damagepred.report.wall import crack_parts, wall_drawing
from damagepred.results.house import is_house, noun
from damagepred.results.rejudge import footing_gap_note, has_dpc, judge_again, measure_in_words
from damagepred.results.tables import Table, curve_columns, worst_category_columns, year_columns
from damagepred.uq.exceedance import category_capacities, own_movements
from damagepred.uq.fragility import fit_fragility
from damagepred.uq.fragility.bands import POSTERIOR_BELOW
from damagepred.uq.intensity import intensity_values, movement_measure, movement_words

if TYPE_CHECKING:
    from damagepred.one_wall.judged_path import Step
    from damagepred.uq.movement_distribution import MovementDistribution

GOODNESS = 100  # times that walls of a fitted curve are made up to judge its distance from the empirical one

MOST_LINES = 1000
"""Walls that are drawn as lines one by one; of more, the lines together are a picture inside the drawing."""

HALF_PAGE = 5.2, 4.6  # size (inches) of drawings that stand side by side
MOST_FAILURES = 10  # failed walls that are listed one by one

_STUDY_FILE = "Study file with its scene, complete with defaults"


def study_page(
    folder: StudyFolder,
    written: str,
    *,
    replay: bool = True,
    confidence: float = 0.9,
    bootstrap: int = 1000,
    at: float | str | MovementDistribution | None = None,
    posterior: Path | None = None,
    measures: Sequence[Path] = (),
    on_step: Callable[[Step], None] | None = None,
) -> Page:
    """Report of a study, finished or not, with a comparison if there are studies of measures."""
    ds, settings = folder.results(), read_frozen(folder.study_text())
    inferred = [] if posterior is None else [back_analysis_section(posterior, folder.path)]
    if not np.isin(ds["status"].values, SOLVED).any():
        raise InputError(f"{folder.path}: the study has no finished sample yet; run `damagepred study` first.")
    wanted = asked_movement(ds, at)
    question, found = answers(ds, wanted, confidence)
    asked = None if at is None or wanted.own else float(np.median(wanted.points))
    influence, influences_section = influences(ds, found, confidence, wanted.own)
    curves, moved = _fitted(ds, confidence, bootstrap), common_movement(ds)
    paths = ds["damage_category"].ndim == 2
    if paths:
        certainty = monte_carlo(ds, moved if asked is None else min(asked, moved), confidence)
        wall, cracks = _typical(folder, ds, replay, on_step, asked)
    else:
        certainty = [Text(["The study has only the end of each sample's movement: its curves' error is their band."])]
        wall, cracks = [], [_NO_PATHS]
    return Page(
        title=str(ds.attrs.get("title", "study")),
        subtitle=f"How likely is each damage category of a {noun(ds)}? A Monte Carlo study, {written[:10]}",
        warnings=_warnings(folder, ds),
        question=question,
        answers=[*study_summary(ds, found), *([influence] if influence else [])],
        facts=_facts(ds, settings),
        head=folder.manifest().get("report") or {},
        first=[
            *wall,
            *([walls_table(ds, wanted, confidence)] if is_house(ds) else []),
            _curves_drawing(curves, ds, wanted),
            *comparison_parts(folder.path, ds, measures, wanted, found, confidence),
        ],
        sections=[
            Section("damage", "Damage", [*(_damage(ds) if paths else []), *cracks]),
            Section("fragility", "The curves", [_curves_table(curves)]),
            *inferred,
            *filter(None, [influences_section, None if "load_force" in ds else study_limits(ds, confidence)]),
            study_caveats(ds, curves, settings, moved),
        ],
        appendix=[
            input_section(settings.scene, settings, ds.attrs),
            Section("run", "What was run", _run_parts(folder, ds, settings, written)),
            Section("quality", "Quality of the solutions, and Monte Carlo error", study_quality(ds) + certainty),
            Section("files", "The study in full", [Listing(_STUDY_FILE, folder.study_text().strip())]),
        ],
    )


def _fitted(ds: xr.Dataset, confidence: float, bootstrap: int) -> xr.Dataset:
    """Curves fitted each for itself, or with one dispersion if they cross."""
    fit = partial(fit_fragility, ds, confidence=confidence, bootstrap=bootstrap, goodness=min(GOODNESS, bootstrap))
    curves = fit()
    enough = ds.sizes["sample"] >= POSTERIOR_BELOW  # curves with one dispersion have a band
    return fit(model="common") if int(curves.attrs["curves_cross"]) and enough else curves


def _warnings(folder: StudyFolder, ds: xr.Dataset) -> list[str]:
    status, walls = ds["status"].values, f"{noun(ds)}s"
    missing, failed = int((status == SampleStatus.MISSING).sum()), int((status == SampleStatus.FAILED).sum())
    said = []
    if missing:
        said.append(
            f"This study is unfinished: {missing} of {len(status)} {walls} have not been run. All that follows is of "
            f"the {len(status) - missing} that have. The same `damagepred study` command goes on."
        )
    if failed:
        said.append(
            f"{failed} of {len(status)} {walls} failed: shares leave them out, curves count them as far as they were "
            f"followed; bounds with all of them undamaged or damaged are given. Their reasons are in "
            f"{folder.path.name}/failures."
        )
    said += [counted(f"{words[0].upper()}{words[1:]}.", is_house(ds)) for words in mixture(ds)]
    if gap := footing_gap_note(ds):
        said.append(f"{gap[0].upper()}{gap[1:]}.")
    return said


def _facts(ds: xr.Dataset, settings: StudySettings) -> list[tuple[str, str]]:
    status = ds["status"].values
    uncertain = [place_in_words(place) for place in (*settings.variables, *settings.study.table_columns)]
    varied = f"; uncertain: {', '.join(uncertain)}" if uncertain else ""
    solved = int(np.isin(status, SOLVED).sum())
    return [
        (f"{noun(ds).capitalize()}s", f"{solved} solved of {len(status)}{varied}"),
        ("Categories", f"{ds.attrs.get('damage_table', '')}, by the {measure_in_words(ds)}"),
    ]


def _run_parts(folder: StudyFolder, ds: xr.Dataset, settings: StudySettings, written: str) -> list[Part]:
    manifest, how = folder.manifest(), settings.study
    status, wall = ds["status"].values, noun(ds)
    version, commit = (manifest.get(f"damagepred_{name}", "unknown") for name in ("version", "commit"))
    words = ("complete", "collapsed", "failed", "not run yet")
    counts = [f"{(status == value).sum()} {word}" for value, word in zip(SampleStatus, words)]
    rows = [
        ["folder", folder.path.resolve().name],
        ["program", f"damagepred {version}, commit {commit}"],
        ["study begun", str(manifest.get("created", "?"))],
        ["report written", written],
        [f"{wall}s", f"{len(status)}: {', '.join(counts)}"],
        ["seed", str(how.seed)],
        ["sampler", how.sampler + (f", {how.replicates} independent scrambles" if how.replicates > 1 else "")],
        ["solver", settings.scene.solver.method.replace("_", "-")],
        ["increments", str(settings.scene.movement.increment_count)],
        [f"a {wall} is followed to", _followed(settings)],
    ]
    if "run_time" in ds and np.isfinite(ds["run_time"].values).any():
        mean, most = (duration(float(of(ds["run_time"].values))) for of in (np.nanmean, np.nanmax))
        rows.append([f"time of a {wall}", f"{mean} on average, {most} at most"])
    if "weight" in ds:
        rows.append(["importance sampling", f"{wall}s have weights, which shares and curves count"])
    parts: list[Part] = [Table("Program and study", ["", ""], rows, words=(0, 1))]
    if failed := sorted(folder.failed_samples()):
        records = [folder.failure(i) for i in failed]
        reasons = Counter(str(record["reason"]) for record in records).most_common()
        parts.append(Table(f"Why {wall}s failed", ["reason", f"{wall}s"], [[named(r), str(n)] for r, n in reasons]))
        replay = f"damagepred replay {folder.path.name}"
        rows = [[str(r["sample"]), str(r["message"]), f"{replay} {r['sample']}"] for r in records[:MOST_FAILURES]]
        note = f"{len(failed) - MOST_FAILURES} more are on record in the folder." if len(failed) > MOST_FAILURES else ""
        parts.append(Table(f"Failed {wall}s", ["sample", "what happened", "to solve it again"], rows, (1, 2), note))
    return parts


def _followed(settings: StudySettings) -> str:
    stop = settings.study.stop_at_category
    if stop == "none" or (settings.study.movement != "path" and stop is None):
        return "the end of its movement"
    return f"category {settings.last_category if stop is None else stop}, or the end of its movement"


def _damage(ds: xr.Dataset) -> list[Part]:
    """Shares of the categories, widths of all walls, and walls by the worst category."""
    from damagepred.plotting import draw, draw_category_shares
    from damagepred.plotting.sheet import new_figure

    wall = noun(ds)
    shares, widths = (new_figure(*HALF_PAGE).subplots() for _ in range(2))
    draw_category_shares(ds, shares)
    draw(ds, "crack_width_max", widths)
    if ds.sizes["sample"] > MOST_LINES:
        for lines in widths.collections:
            lines.set_rasterized(lines.get_label() == "each wall")
    parts: list[Part] = [
        drawing(
            "shares",
            f"Share of the {wall}s in each category, by the highest category reached.",
            f"Shares of {wall}s by damage category against the movement",
            shares,
            along="movement",
        ),
        drawing(
            "widths",
            f"Widest crack of every {wall}, with median and quantiles over the {wall}s.",
            f"Widest crack of each {wall} against the movement, with quantiles",
            widths,
            along="movement",
        ),
        _measures(ds),
    ]
    if "time" in ds:
        note = "With 90 % intervals. So far: by the worst category until then; now: cracks may have closed again."
        parts.append(Table.of("Probability of damage by year", year_columns(ds), note))
    return parts


def _typical(
    folder: StudyFolder, ds: xr.Dataset, replay: bool, on_step: Callable[[Step], None] | None, at: float | None
) -> tuple[list[Part], list[Part]]:
    """Drawing of a typical wall, and its cracks."""
    chosen = typical_and_worst(ds, at)
    if chosen is None:
        return [], []
    said = (
        f"Typical is sample {chosen.typical}, {chosen.why_typical}; the worst is sample {chosen.worst}, "
        f"{chosen.why_worst}. `damagepred replay {folder.path.name} {chosen.worst} -o worst.nc --plot worst` solves it "
        "again, with all its fields and pictures."
    )
    if not replay:
        return [], [Text([said])]
    from damagepred.campaign.replay import replay as solve_again

    try:
        wall, comparison = solve_again(folder.path, chosen.typical, on_step)
    except DamagepredError as error:
        return [], [Text([said, f"The typical {noun(ds)} could not be solved again: {error}"])]
    walls = {f"typical, sample {chosen.typical}": wall}
    if chosen.worst != chosen.typical:
        with contextlib.suppress(DamagepredError):  # the page has no such drawing
            walls[f"worst, sample {chosen.worst}"] = solve_again(folder.path, chosen.worst, on_step)[0]
    if comparison.startswith("bit for bit"):
        comparison = "agrees bit for bit with the study."
    again = Text([f"{said} Solved again for this report, the typical {noun(ds)} {comparison}"])
    if is_house(wall):
        figures = house_drawings(wall, f"A typical house, sample {chosen.typical}. ", walls)
        return figures, [again, *house_damage(wall), *crack_parts(wall)]
    figure = wall_drawing(wall, "typical", f"A typical wall, sample {chosen.typical}. ", walls)
    return [figure], [again, *crack_parts(wall)]


def _measures(ds: xr.Dataset) -> Table:
    """Return the share of walls in each category at worst, by each width that categories can be found by."""
    judged = {"by the widest crack": judge_again(ds, measure="joint", count_footing_gap=False)}
    note = f"Categories elsewhere on this page are by the {measure_in_words(ds)}. "
    if "crack_band_width_max" in ds:
        judged["by the widest crack band"] = judge_again(ds, measure="band")
        gauge = number(float(ds["crack_band_width_max"].attrs.get("gauge_length", np.nan)), 3)
        note += f"A crack band adds up the openings of neighbouring joints along {gauge} m."
    else:
        note += "Written by an older version, the archive does not hold the widths of crack bands."
    if "footing_opening_max" in ds and not has_dpc(ds):
        judged["by the widest crack or gap on the footing"] = judge_again(ds, measure="joint", count_footing_gap=True)
    caption = f"{noun(ds).capitalize()}s by the worst category of their path"
    return Table.of(caption, worst_category_columns(judged), note)


_NO_PATHS = Text(
    ["The study has only the end of each sample's movement ([study] movement = “sampled”): there are no paths to draw."]
)


def _curves_drawing(curves: xr.Dataset, ds: xr.Dataset, at: MovementDistribution) -> Part:
    """Fragility curves with the movement of the answers, code limits and site classes."""
    from damagepred.plotting import draw_fragility

    confidence, measure = float(curves.attrs["confidence"]), movement_words(curves)
    ends = own_movements(ds, str(curves.attrs["intensity_measure"])) if at.own else np.asarray(at.points)
    shown = at.name if len(at.points) > 1 else movement_number(at.largest, measure)
    name = f"each {noun(ds)}'s own movement" if at.own else f"the answer above: {shown}"
    marks = {name: (float(ends.min()), float(ends.max()))} if ends.size else {}
    caption = (
        f"Probability of each category or worse against the {measure}: lognormal curves with {confidence:.0%} bands, "
        f"and the shares of {noun(ds)}s at the increments."
    )
    return drawing(
        "fragility",
        caption,
        f"Fragility curves of the damage categories against the {measure}, with confidence bands",
        draw_fragility(curves, marks=marks),
        along="movement",
    )


def _curves_table(curves: xr.Dataset) -> Table:
    note = (
        "Lognormal capacities, fitted by maximum likelihood to the intervals between increments in which each wall "
        "reached the category; a wall that did not reach it counts as not yet damaged at its last movement (censored). "
        "The dispersion is the standard deviation of the capacity's logarithm. Bands: "
        f"{int(curves.attrs['bootstrap_samples'])} bootstrap samples of walls; of a category with fewer than "
        f"{POSTERIOR_BELOW} informative walls, quantiles of the posterior. Goodness of fit: share of samples "
        "from the curve itself that lie as far from it as these walls do; below 0.05 the curve is doubtful."
    )
    if str(curves.attrs["model"]) == "common":
        note += " Fitted each for itself, curves would cross; these have one dispersion for all."
    return Table.of("The curves", curve_columns(curves), counted(note, is_house(curves)))


class Chosen(NamedTuple):
    """Numbers of a typical and of the worst wall, and the criterion of each choice."""

    typical: int
    worst: int
    why_typical: str
    why_worst: str


def typical_and_worst(ds: xr.Dataset, at: float | None = None) -> Chosen | None:
    """Wall with the median of the widest crack, at a movement (m) or the end, and wall that is the worst first."""
    # a wall that ended before in the worst category or in collapse counts as wider, the earlier the wider; other walls
    # that were not followed as far are left out
    capacities = {c: category_capacities(ds, c) for c in range(1, int(ds.attrs["highest_category"]) + 1)}
    capacities = {c: known.part(~known.failing) for c, known in capacities.items()}
    some = [c for c, known in capacities.items() if np.isfinite(known.upper).any()]
    sample, weight = capacities[1].sample, capacities[1].weight
    if not len(sample):
        return None
    path = np.fmax.accumulate(ds["crack_width_max"].values[sample], axis=1)
    moved = np.where(np.isfinite(path), intensity_values(ds, movement_measure(ds))[sample], np.nan)
    width, last = np.fmax.reduce(path, axis=1), np.fmax.reduce(moved, axis=1)
    gone = np.fmax.reduce(ds["damage_category"].values[sample], axis=1) >= int(ds.attrs["highest_category"])
    gone |= ds["status"].values[sample] == SampleStatus.COLLAPSED
    where, short = "at the end of its movement", np.ones(len(sample), dtype=np.bool_)
    key = width.copy()
    if at is not None:
        where, short = f"at a {movement_words(ds)} of {length(at)}", last < at * (1 - 1e-9)
        key[:] = [np.interp(at, m[np.isfinite(m)], p[np.isfinite(m)]) for m, p in zip(moved, path)]
        key[short] = np.nan
    key[gone & short] = np.inf
    heavy = np.where(np.isnan(key), 0.0, 1.0 if weight is None else weight)
    if not heavy.any():
        return None
    order = np.lexsort((-last, np.nan_to_num(key, nan=np.inf, posinf=np.inf)))
    middle = int(order[np.searchsorted(np.cumsum(heavy[order]), 0.5 * heavy.sum() * (1 - 1e-12))])
    typical = int(sample[middle])
    why = f"whose widest crack {where} is the median of all samples, {length(key[middle])}"
    if np.isinf(key[middle]):
        why = f"the median of all samples {where}: it fell, or reached the worst category, at {length(last[middle])}"
    if not some:
        reason = f"whose widest crack is the widest, {length(float(width.max()))}"
        return Chosen(typical, int(sample[np.argmax(width)]), why, reason)
    known = capacities[some[-1]]
    first = int(np.argmin(known.upper))
    reason = f"which reached category {some[-1]} first, at {length(known.upper[first])}"
    return Chosen(typical, int(known.sample[first]), why, reason)
