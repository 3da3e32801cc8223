"""Tables of results on the terminal."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from damagepred.archive.cautions import wall_cautions
from damagepred.archive.schema import category_label, flag_name
from damagepred.cli import terminal
from damagepred.cli.sentences import zones_lines
from damagepred.formatting import counted
from damagepred.results import tables
from damagepred.results.house import is_house, noun
from damagepred.results.rejudge import footing_gap_note, measure_in_words
from damagepred.results.tables import Column, Table, most_damaged_first, path_columns
from damagepred.uq.capacity import sample_weights
from damagepred.uq.intensity import movement_measure, movement_words

if TYPE_CHECKING:
    import pandas as pd


def back_analysis(posterior: xr.Dataset) -> None:
    """Print the posterior of causes, movement and future damage, and the discrepancy of the model."""
    from damagepred.analyses.posterior_tables import posterior_tables
    from damagepred.report.answers import posterior_answer

    terminal.show(*posterior_tables(posterior))
    terminal.say(posterior_answer(posterior))


def design_search(search: xr.Dataset) -> None:
    """Print the alternatives of a design search, the cheapest first, the value of each measure, and the choice."""
    quantity = str(search.attrs["quantity"])
    by_cost = quantity == "expected_cost"
    words = ("undecided", "best", "dearer") if by_cost else ("dearer or undecided", "meets", "does not meet")
    what, digits = ("cost of repair", ".0f") if by_cost else ("probability", ".3f")
    order = np.argsort(search["cost"].values, kind="stable")
    interval = (quantity, f"{quantity}_lower", f"{quantity}_upper")
    names: tuple[str, ...] = ("alternative", "cost", *interval, "samples", "decision")
    rows = [
        [str(name), f"{cost:g}", *(f"{v:{digits}}" for v in values), str(int(samples)), words[int(decision)]]
        for name, cost, *values, samples, decision in zip(*(search[name].values[order] for name in names))
    ]
    columns = ("alternative", "cost", quantity.replace("_", " "), "lower", "upper", "samples", "decision")
    terminal.table(search.attrs["title"], columns, rows)
    names = ("measure", "value", "value_error", "extra_cost")
    rows = [
        [str(name), f"{value:+{digits}}", f"{error:{digits}}", f"{cost:g}"]
        for name, value, error, cost in zip(*(search[name].values for name in names))
    ]
    heads = ("measure", f"change of the {what}", "standard error", "extra cost")
    terminal.table("Value of each measure", heads, rows)
    doubt = search[f"{quantity}_unfollowed"].values
    if np.nanmax(doubt) > 0:
        most = f"{np.nanmax(doubt):{digits}} of '{search['alternative'].values[np.nanargmax(doubt)]}' at most"
        count_as = "need the dearest repair" if by_cost else "be damaged"
        terminal.say(f"samples that failed, or were not followed as far, are taken to {count_as}: {most}")
    chosen = search.attrs["chosen"]
    terminal.say(f"chosen: {chosen}" if chosen else "no alternative is known to meet the target")
    if by_cost:
        terminal.say(f"its expected cost exceeds the least by {search.attrs['regret']:.0f} at most")
    better, keys = ("better", "target.most or target.tolerance") if by_cost else ("cheaper", "target.most")
    undecided = f"a {better} alternative is undecided; a larger {keys} decides it"
    sure = f"this selection is right with a probability of {search.attrs['confidence']:.0%} or more"
    terminal.say(sure if search.attrs["sure"] else undecided)


def portfolio(street: xr.Dataset, most: int = 20) -> None:
    """Print the houses with the most likely damage, and the expected number of damaged houses."""
    probability = street["probability"].transpose("house", "category").values
    order = most_damaged_first(street)
    shown = order if terminal.FORM.full else order[:most]
    categories = street["category"].values.tolist()
    rows = [
        [str(one["house"].values), str(one["at"].values), str(int(one["walls"])), str(int(one["failed"]))]
        + [_chance_with_interval(one.sel(category=c)) for c in categories]
        for one in (street.isel(house=int(k)) for k in shown)
    ]
    heads = ("house", str(street.attrs["measure"]), "samples", "failed", *(f"P(>= {c})" for c in categories))
    terminal.table(f"{street.attrs['title']}: {len(order)} houses", heads, rows)
    if len(shown) < len(order):
        terminal.say(f"{len(order) - len(shown)} houses with less likely damage are not shown; --full shows them")
    for c, column in zip(categories, probability.T):
        unknown = int(np.isnan(column).sum())
        also = f"; unknown for {unknown}, whose samples were not followed as far" if unknown else ""
        expected = f"{np.nansum(column):.3g} houses to be expected of {len(order) - unknown}"
        terminal.say(f"category {c} or worse: {expected}{also}")


def _chance_with_interval(one: xr.Dataset) -> str:
    value, lower, upper = (float(one[f"probability{end}"]) for end in ("", "_lower", "_upper"))
    return f"{value:.2f} ({lower:.2f} - {upper:.2f})" if value == value else f"{lower:.2f} to {upper:.2f}"


def wall_table(ds: xr.Dataset) -> None:
    """Print the path of a wall, one line per increment."""
    terminal.show(Table.brief(ds.attrs["title"], path_columns(ds)))
    if is_house(ds):
        house_tables(ds)
    terminal.lines(zones_lines(ds))
    terminal.say("; ".join(" ".join(filter(None, row)) for row in tables.quality_rows(ds)))
    if energy := tables.energy_rows(ds):
        terminal.say("energy (J): " + "; ".join(f"{what} {value}" for what, value in energy))
    terminal.cautions([*wall_cautions(ds), *filter(None, [footing_gap_note(ds)])])


def house_tables(ds: xr.Dataset) -> None:
    """Print the walls of a house, where they meet, and the sides of its rooms."""
    category, damaged = category_label(ds, int(ds["damage_category"][-1])), int(ds["damaged_walls"][-1])
    title = f"walls at the end; house, by its worst wall: {category}; damaged: {damaged}"
    corners = "corners at the end: upward force of the first wall on the second"
    terminal.show(Table.brief(title, tables.wall_columns(ds)), Table.brief(corners, tables.corner_columns(ds)))
    if (rooms := tables.room_columns(ds))[0].cells and terminal.FORM.full:
        terminal.show(Table.brief("sides of the rooms at the end", rooms))
    elif rooms[0].cells:
        terminal.say("--full shows the sides of the rooms")


def crack_table(cracks: xr.Dataset, frame: pd.DataFrame, most: int = 12) -> None:
    """Print cracks by part of the wall, the widest first; a summary has only the widest."""
    measure = movement_measure(cracks)
    at = f"a {movement_words(cracks)} of {1e3 * float(cracks[measure][-1]):.3g} mm"
    if frame.empty:
        hairline = f"{1e3 * cracks.attrs['hairline']:g} mm"
        terminal.say(f"{cracks.attrs['title']}: nothing has opened or slid by more than {hairline} at {at}")
        return
    widest = frame.nlargest(most, "crack_width", keep="first").index
    shown = frame if terminal.FORM.full else frame.loc[sorted(widest)]
    terminal.show(Table.brief(f"{cracks.attrs['title']}: cracks at {at}", tables.crack_columns(shown)))
    if (shown["crack_length_through_blocks"] > 0).any():
        terminal.say("* runs through bricks, too")
    if len(frame) > len(shown):
        terminal.say(f"and {len(frame) - len(shown)} narrower ones; --full shows them, --csv writes them all")


def judged_again(before: xr.Dataset, after: xr.Dataset) -> None:
    """Print categories before and after another judgement: of a study's walls at worst, or of a wall's increments."""
    title = str(before.attrs.get("title", ""))
    if "sample" in before["damage_category"].dims:
        columns = tables.worst_category_columns({"before": before, "after": after})
        terminal.show(Table.brief(f"{title}: {noun(before)}s by the worst category of their path", columns))
    else:
        was = [category_label(before, int(c)) for c in before["damage_category"].values]
        columns = path_columns(after)
        at = [column.name for column in columns].index("category")
        columns[at : at + 1] = Column("", was, short="category\nbefore"), replace(columns[at], short="category\nafter")
        terminal.show(Table.brief(f"{title}: judged again", columns))
    if is_house(before) and "contact" in before.dims:
        was = [category_label(before, int(c)) for c in before["wall_damage_category"].values[-1]]
        name, width, category, *_ = tables.wall_columns(after)
        columns = [name, width, Column("", was, short="category\nbefore"), replace(category, short="category\nafter")]
        terminal.show(Table.brief("walls at the end", columns))
    terminal.lines([*str(after.attrs["judgement"]).split("; "), *_levels(after)])


def scales(agreement: xr.Dataset) -> None:
    """Print each scale, the share of states beyond its first limit, and its agreement with each other scale."""
    names = [str(name) for name in agreement["scale"].values]
    heads = ["scale", "beyond\nits first\nlimit", *(f"as {k + 1}" for k in range(len(names))), "confidence"]
    rows = []
    for k, name in enumerate(names):
        one = agreement.isel(scale=k)
        shares = (f"{share:.2f}" for share in (float(one["share_reached"]), *one["agreement"].values))
        rows.append([f"{k + 1} {name}", *shares, str(one["confidence"].values)])
    terminal.table(f"{agreement.attrs['title']}: share of states that two scales judge alike", heads, rows)
    if agreement.attrs["left_out"]:
        terminal.say(f"left out: {agreement.attrs['left_out']}")


def _levels(ds: xr.Dataset) -> list[str]:
    """Shares of walls, or the worst increment, out of level or plumb or with sticking openings, in words."""
    said = []
    for name, what in (("deviation_level", "out of level or plumb"), ("opening_sticking", "doors and windows")):
        if name not in ds or not ds[name].size:
            continue
        many = "sample" in ds[name].dims
        worst = ds[name].values.reshape(ds.sizes["sample"] if many else 1, -1).max(axis=1)
        weight = sample_weights(ds) if many else np.ones(1)
        shares = {flag_name(ds, level, name): np.average(worst == level, weights=weight) for level in np.unique(worst)}
        words = (f"{share:.1%} {level}" if many else level for level, share in shares.items())
        said.append(f"{what}, at worst: {', '.join(words)}")
    return said


def fragility_table(curves: xr.Dataset) -> None:
    """Print medians and dispersions of fragility curves with their bands, and how well they fit."""
    from damagepred.uq.fragility.fit import WITH_CURVE

    title = f"{curves.attrs['title']}, against the {movement_words(curves)}"
    terminal.show(Table.brief(title, tables.curve_columns(curves)))
    if not terminal.FORM.full:
        for category, why in zip(curves["category"].values, curves["fit_status"].values):
            if why not in WITH_CURVE:
                terminal.say(counted(f"category {category}: {why}", is_house(curves)))
    terminal.say(f"categories by the {measure_in_words(curves)}")
    terminal.lines(tables.curve_notes(curves))


def year_table(ds: xr.Dataset, confidence: float) -> None:
    """Print the probability of each category by year, of the worst category up to then and of the present one."""
    terminal.show(
        Table.brief(f"{ds.attrs['title']}: share of {noun(ds)}s by year", tables.year_columns(ds, confidence))
    )


def sensitivity_tables(indices: xr.Dataset) -> None:
    """Print the sensitivity of a study's damage to its inputs."""
    title = f"{indices.attrs['title']}: {indices.attrs['output']}, {indices.attrs['walls']} {noun(indices)}s"
    terminal.show(Table.brief(title, tables.sensitivity_columns(indices)))
    if not tables.standing_out(indices):
        terminal.say("no input stands out: the interval of each partial correlation contains 0")
    if share := indices.attrs["share_censored"]:
        terminal.say(f"{share:.0%} of the {noun(indices)}s had not reached it: they share the highest ranks")
    if indices.attrs["samples_failed"]:
        terminal.say(f"{indices.attrs['samples_failed']} failed {noun(indices)}s count as far as they were followed")
