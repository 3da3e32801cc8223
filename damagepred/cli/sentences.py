"""Sentences of the command line: results of studies and estimates in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from damagepred.formatting import chance, counted, duration

if TYPE_CHECKING:
    import xarray as xr

    from damagepred.analyses.epistemic import Alternative
    from damagepred.analyses.limit_state import Question
    from damagepred.analyses.rare_event import RareEvent
    from damagepred.campaign.cost_estimate import CostEstimate
    from damagepred.campaign.status import StudyStatus
    from damagepred.campaign.stopping import Ending
    from damagepred.uq.stopping import StopWhen
    from damagepred.uq.subset import SubsetEstimate


def cost_lines(cost: CostEstimate, full: bool = False) -> list[str]:
    """Wall, movement, variables and cost of a run; ``full``: also sizes, solver and errors of the presets."""
    noun = counted("wall", cost.wall.startswith("house of"))
    one = f"one {noun}: {duration(cost.wall_seconds)} ({cost.status}{_spread(cost.timed, noun)})"
    sampled, walls = f"one {noun}, all numbers as given", one
    if cost.variables:
        total = cost.samples * cost.wall_seconds
        sampled = f"{cost.samples} {noun}s with {cost.variables} uncertain numbers: {', '.join(cost.sampled)}"
        walls = f"about {duration(total)} with -j 1, {duration(total / 2)} with -j 2; {one}"
    said = [f"{cost.title}: valid; {cost.wall}", *(f"  {line}" for line in (cost.moving, sampled, walls))]
    if full:
        said += [
            f"  {cost.blocks} blocks, {cost.contacts} contacts, {cost.joints} joints, {cost.increments} increments; "
            f"kernels made ready in {duration(cost.compile_seconds)}",
            f"  solver: {cost.method}"
            + (f", {cost.matrix_bytes / 1e6:.2g} MB of matrices" if cost.matrix_bytes else ""),
        ]
    if full and cost.zones:
        results = "" if cost.variables else f", {cost.zone_bytes / 1e6:.2g} MB of results (none with --no-zones)"
        peak = f"; at most {cost.peak_bytes / 1e6:.0f} MB of memory in all" if cost.peak_bytes else ""
        mesh = f"{cost.deformable_blocks} deformable blocks: {cost.zones} zones, {cost.gridpoints} gridpoints"
        said.append(f"  {mesh}{results}{peak}")
    said += [f"  {ground}" for ground in (cost.site, cost.ground) if ground]
    return [*said, *(f"  caution: {caution}" for caution in cost.cautions), *(cost.accuracy if full else ())]


def _spread(times: tuple[float, ...], noun: str) -> str:
    """Least and most of several times (s)."""
    if len(times) < 2:
        return ""
    return f"; on average of {len(times)} {noun}s, {duration(min(times))} to {duration(max(times))}"


def ending_lines(ending: Ending, rule: StopWhen) -> list[str]:
    """Estimates at the looks of a study, and the reason why it ended."""
    said = []
    for look in ending.looks:
        e = look.estimate
        over = f"{e.lower:.4g} to {e.upper:.4g} ({rule.confidence:.0%} over all looks)"
        said.append(f"look at {look.samples} walls: {rule.name()} = {e.value:.4g}, {over}")
    reasons = {
        "enough": "narrow enough: no further walls are run",
        "samples": "all walls allowed are run, and the interval is not narrow enough yet",
        "interrupted": "",
    }
    return [*said, *filter(None, [reasons[ending.reason]])]


def estimate_lines(alternatives: list[Alternative], category: int, where: str, houses: bool = False) -> list[str]:
    """Walls that were not followed as far, the range that the inputs leave open, and the answer."""
    from damagepred.report.answers import estimate_answer

    first, noun, said = alternatives[0].found, counted("wall", houses), []
    if first.not_followed and np.isfinite(first.estimate.value):
        said.append(
            f"{first.not_followed} {noun}s ended at a smaller movement of their own; they count like the {noun}s "
            "followed further, which is right if they did not end there because they are weak or strong"
        )
    for other in alternatives[1:]:
        o = other.found.estimate
        few = ", too few: run it as a study" if other.effective_samples < 0.2 * o.samples else ""
        said.append(
            f"  {other.name}: {chance(o.value)}, {chance(o.lower)} to {chance(o.upper)} "
            f"({other.effective_samples:.0f} effective {noun}s{few})"
        )
    values = [a.found.estimate.value for a in alternatives]
    if len(values) > 1 and np.isfinite(values).all():
        reach = f"{chance(min(values))} to {chance(max(values))}"
        said.append(f"category {category}, epistemic range of the inputs: {reach}, without the Monte Carlo error")
    return [*said, estimate_answer(first.estimate, f"{category} or worse at {counted(where, houses)}", noun)]


def rare_lines(result: RareEvent, question: Question) -> list[str]:
    """Levels and probability of a rare event, and its bounds over failed walls."""
    e, all_damaged = result.estimate, result.failed_damaged
    said = [f"run {k}: {p:.3g}" for k, p in enumerate(e.runs, start=1)]
    if not e.runs:
        said.append(
            "the interval is from a single run, and covers the true value less often than stated: take --runs 4 or more"
        )
    said += [
        f"level {k}: margin {level.limit:.4g} or less for {level.share:.3g} of the walls"
        + ("" if np.isnan(level.acceptance) else f", {level.acceptance:.0%} of proposals accepted")
        for k, level in enumerate(e.levels, start=1)
    ]
    said.append(f"P(category >= {question.category} at {1e3 * question.at:g} mm) {_subset(e)}")
    if result.failed:
        low, high = result.interval
        said += [
            f"{result.failed} walls failed before {1e3 * question.at:g} mm. Above, they count as not having reached "
            "the category",
            f"if all of them had reached it: {_subset(all_damaged)}",
            f"so it is between {low:.3g} and {high:.3g} ({e.confidence:.0%}) for any outcome of these walls",
        ]
    if len(result.programs) > 1:
        said.append(f"caution: samples were solved by several programs, which may differ: {'; '.join(result.programs)}")
    return said


def _subset(e: SubsetEstimate) -> str:
    if not e.reached:
        return f"is below {e.probability:.3g}: after {e.evaluations} walls no level reached it"
    return (
        f"= {e.probability:.3g}, {e.lower:.3g} to {e.upper:.3g} ({e.confidence:.0%}), coefficient of variation "
        f"{e.variation:.2f}, {e.evaluations} walls"
    )


def comparison_lines(comparison: xr.Dataset, category: int, movement: float) -> list[str]:
    """Probabilities of a category at a movement with their differences, the most helpful study first."""
    from damagepred.report.answers import comparison_answer
    from damagepred.uq.comparison import most_helpful

    chosen = comparison.sel(category=category).sel(movement=movement, method="nearest")
    level = f"{float(comparison.attrs['confidence']):.0%}"
    first, reference = chosen.isel(study=0), comparison.attrs["reference"]
    if np.isnan(first["probability"]):
        return [f"{reference}: unknown, no sample was followed as far; there is nothing to compare with"]
    value, lower, upper = (float(first[f"probability{end}"]) for end in ("", "_lower", "_upper"))
    said = [f"{reference}: {value:.3g}, {lower:.3g} to {upper:.3g} ({level})"]
    for name in most_helpful(comparison, category, movement):
        study = chosen.sel(study=name)
        value, lower, upper = (float(study[f"difference{end}"]) for end in ("", "_lower", "_upper"))
        if np.isnan(value):
            said.append(f"{name}: unknown, no sample was followed as far")
            continue
        clear = "less damage" if upper < 0 else "more damage" if lower > 0 else "may be chance"
        pairs = int(study["paired_samples"])
        pairing = f"{pairs} pairs of samples" if pairs else "other samples, so the interval is wide"
        change = f"difference {value:+.3g}, {lower:+.3g} to {upper:+.3g} ({level})"
        said.append(f"{name}: {float(study['probability']):.3g}; {change}: {clear}; {pairing}")
    return [*said, comparison_answer(comparison, category, movement)]


def status_lines(status: StudyStatus) -> list[str]:
    """Walls or houses done, failed and remaining, times, limits, cautions and failures of a study."""
    s, noun = status, counted("wall", status.houses)
    said = [f"{s.title}: {s.done} of {s.total} {noun}s done, {s.failed} failed, {s.remaining} remaining"]
    if np.isfinite(s.wall_seconds):
        rest = f", about {duration(s.wall_seconds * s.remaining)} of work left" if s.remaining else ""
        said.append(f"{duration(s.wall_seconds)} per {noun}{rest}")
    if not s.done:
        said.append(
            f"no {noun} is done yet: a run first compiles its kernels, once per version, and loads its processes"
        )
    if np.isfinite(s.effective_walls):
        said.append(f"importance sampling: {s.effective_walls:.0f} effective {noun}s; shares are weighted")
    if s.limits:
        low, high = 1e3 * min(s.limits), 1e3 * max(s.limits)
        said.append(
            f"{len(s.limits)} {noun}s ended before the full movement, at {low:.3g} to {high:.3g} mm, where the jacks "
            "or supports carry no load any more; fits treat categories not reached there as censored"
        )
    said += [f"caution: {caution}" for caution in s.cautions]
    return [*said, *(f"failed sample {sample}: {reason}: {message}" for sample, reason, message in s.failures)]


def share_rows(report: StudyStatus) -> list[list[str]]:
    """Rows of the table of categories of a status."""
    from damagepred.archive.schema import CATEGORIES

    return [
        [
            f"{c.category} {CATEGORIES[c.category].replace('_', ' ')}",
            *(str(c.walls), f"{c.share:.3f}", f"{c.or_worse:.3f}", f"{c.lower:.3f} - {c.upper:.3f}"),
            f"{c.failed_undamaged:.3f} - {c.failed_damaged:.3f}" if report.failed else "-",
        ]
        for c in report.categories
    ]


def zones_lines(ds: xr.Dataset) -> list[str]:
    """Numbers of deformable blocks, zones and yielding zones; empty if all blocks are rigid."""
    if "zones" not in ds.attrs:
        return []
    shear, tension, before = (ds[f"zones_{how}"].values for how in ("in_shear", "in_tension", "yielded_before"))
    yielding = f"at the end {shear[-1]} yield in shear, {tension[-1]} in tension, {before[-1]} have yielded before"
    if not (shear + tension + before).any():
        yielding = "none of them yields"
    size = f"{ds.attrs['deformable_blocks']} of {ds.sizes['block']} blocks deformable, {ds.attrs['zones']} zones"
    return [f"{size} in plane {ds.attrs['plane']}; {yielding}"]


def surface_lines(surface: xr.Dataset) -> list[str]:
    """Slope, dispersion and information criteria of a fragility surface."""
    from damagepred.results.tables import banded
    from damagepred.uq.fragility.fit import EXTRAPOLATED, WITH_CURVE
    from damagepred.uq.intensity import movement_words

    what = f"category {surface.attrs['category']} against the {movement_words(surface)} and "
    what += str(surface.attrs["second_variable"])
    if (status := str(surface["fit_status"].values)) not in WITH_CURVE:
        return [f"{what}: no surface, {status}"]
    slope, dispersion = banded(surface, "slope", ".3g"), banded(surface, "dispersion")
    power = "its power" if surface.attrs["scale"] == "log" else "exp of it times"
    better = "with" if surface.attrs["aic_with"] < surface.attrs["aic_without"] else "without"
    said = []
    if status == EXTRAPOLATED:
        said.append("the medians lie beyond the largest movement of the samples: lower bounds, the surface ends there")
    if "share_at_start" in surface and (start := float(surface["share_at_start"])) > 0:
        said.append(f"{start:.2g} of the samples reached it before any movement; medians are of the others")
    return [
        *said,
        f"{what}: the median goes with {power} {slope}; dispersion {dispersion}, without it "
        f"{float(surface['dispersion_alone']):.2f}",
        f"Akaike's criterion: {surface.attrs['aic_with']:.1f} with it, {surface.attrs['aic_without']:.1f} without; it "
        f"speaks for the curve {better} it",
    ]
