"""Tables of results, made once: the page of a report and the terminal render the same columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from damagepred.archive.cautions import work_done
from damagepred.archive.schema import WORST_CATEGORY, category_label, is_dynamic
from damagepred.arrays import FloatArray, IntArray
from damagepred.diagnostics import Counters, Energies, Residuals, described
from damagepred.enumerations import SOLVED, SampleStatus
from damagepred.formatting import chance, counted, length, named, number, ratio, with_band
from damagepred.results.house import is_house, noun, room_sides, wall_names
from damagepred.results.rejudge import has_dpc, shares, shown_gaps
from damagepred.uq.capacity import highest_category
from damagepred.uq.intensity import OF_SITE, movement_words

if TYPE_CHECKING:
    import pandas as pd

    from damagepred.uq.exceedance import Exceedance


MM = 1e3  # millimetres in a metre


def most_damaged_first(street: xr.Dataset) -> IntArray:
    """Order of the houses of a portfolio, by the worst category first; unknown probabilities last."""
    return np.lexsort(-np.nan_to_num(street["probability"].transpose("category", "house").values, nan=-1.0))


DOUBTFUL = 0.05  # goodness of fit below which a curve is doubtful

_IN_TIME = ("contact_points", "contact points"), ("impacts", "impacts")


@dataclass(frozen=True)
class Column:
    """One column of a table."""

    name: str  # head on the page, without the unit; empty: not on the page
    cells: Sequence[str]  # formatted values
    unit: str = ""  # unit of the values
    short: str = ""  # head on the terminal, in lines; empty: not on the terminal
    short_cells: Sequence[str] | None = None  # briefer cells for the terminal
    words: bool = False  # whether the cells are words, which stand to the left on the page

    @property
    def head(self) -> str:
        """Head on the page, with the unit."""
        return f"{self.name} ({self.unit})" if self.unit else self.name


@dataclass(frozen=True)
class Table:
    """Table of formatted cells, for the terminal and the page of a report."""

    caption: str  # title
    columns: Sequence[str]  # heads
    rows: Sequence[Sequence[str]]  # cells; a line break is one
    words: Sequence[int] = (0,)  # columns of words, which stand to the left on the page; numbers stand to the right
    note: str = ""  # text below the table
    groups: Sequence[str] = ()  # group of each row, if rows come in groups, which then have heads of their own

    kind = "table"

    @classmethod
    def of(cls, caption: str, columns: Sequence[Column], note: str = "") -> Table:
        """Table of the columns that have a head on the page."""
        shown = [column for column in columns if column.name]
        cells = ([c if column.words else c.replace("-", "−") for c in column.cells] for column in shown)
        words = [i for i, column in enumerate(shown) if column.words]
        return cls(caption, [column.head for column in shown], [list(row) for row in zip(*cells)], words, note)

    @classmethod
    def brief(cls, caption: str, columns: Sequence[Column]) -> Table:
        """Table of the columns that have a head on the terminal."""
        shown = [column for column in columns if column.short]
        cells = ([" ".join(cell.split()) for cell in column.short_cells or column.cells] for column in shown)
        return cls(caption, [column.short for column in shown], [list(row) for row in zip(*cells)])


def path_columns(ds: xr.Dataset) -> list[Column]:
    """Movement, cracks, category and gaps of a wall, one row per increment."""

    def shown(name: str, digits: str, factor: float = MM) -> list[str]:
        return [f"{factor * float(v):{digits}}" for v in ds[name].values]

    in_time = is_dynamic(ds)
    columns = []
    if "time" in ds.variables:
        digits, unit = (".3f", "s") if in_time else (".2f", "years")
        columns.append(Column("time", shown("time", digits, 1.0), unit, f"time\n{unit}"))
    if "surface_movement" in ds.variables:
        surface = [number(MM * float(v)) for v in ds["surface_movement"].values]
        words = movement_words(ds, "surface_movement")
        short = "surface" if words == OF_SITE else "ground"
        columns.append(Column(words, surface, "mm", f"{short}\nmovement\nmm"))
    if "settlement" in ds.variables:
        words = movement_words(ds, "settlement")
        short = "heave" if "heave" in words else "settlement"
        columns.append(Column(words, shown("settlement", ".2f"), "mm", f"{short}\nmm"))
    elif "load_force" in ds.variables:
        load = ["-" if cell == "nan" else cell for cell in shown("load_force", ".2f", 1e-3)]
        columns.append(Column("load", load, "kN", "load\nkN"))
        columns.append(Column("displacement of the loads", shown("load_displacement", ".3f"), "mm", "moved\nmm"))
        if "gauge_opening" in ds.variables:
            columns.append(Column("gauge", shown("gauge_opening", ".3f"), "mm", "gauge\nmm"))
    elif "central_deflection" in ds.variables:  # a house has one for each wall
        deflection = shown("central_deflection", ".2f")
        columns.append(Column("deflection", deflection, "mm", "" if in_time else "deflection\nmm"))
    columns.append(Column("widest crack", shown("crack_width_max", ".3f"), "mm", "widest\ncrack\nmm"))
    if "crack_count" in ds.variables:
        columns.append(Column("cracks", shown("crack_count", ".0f", 1.0)))
    if "crack_width_worst" in ds.variables:
        so_far = [str(c) for c in worst_so_far(ds)]
        widest = shown("crack_width_worst", ".3f")
        both = [f"{width} ({category})" for width, category in zip(widest, so_far)]
        columns += [Column("widest so far", widest, "mm"), Column("worst category so far", so_far)]
        columns.append(Column("", both, short="so far, mm\nand worst\ncategory"))
    categories = [category_label(ds, int(c)).replace(" ", "\u00a0") for c in ds["damage_category"].values]
    if has_bands := "crack_band_width_max" in ds.variables:
        bands, by_band = shown("crack_band_width_max", ".3f"), shown("damage_category_band", ".0f", 1.0)
        both = [f"{band} ({category})" for band, category in zip(bands, by_band)]
        columns.append(Column("", both, short="band, mm\nand its\ncategory"))
    columns.append(Column("category", categories, "", "damage\ncategory", words=True))
    if has_bands:
        columns += [Column("crack band", bands, "mm"), Column("category by band", by_band)]
    for part in shown_gaps(ds):
        what, brief = {"dpc": ("dpc", "dpc"), "footing": ("bed on footing", "bed")}[part]
        separation = ds[f"{part}_separation_length"]
        # a gap below a dpc that is nowhere wider than the threshold is for the page
        on_terminal = part == "dpc" or not has_dpc(ds) or bool(separation.values.any())
        threshold = float(separation.attrs.get("opening_threshold", np.nan))
        heads = (f"{brief}\nopening\nmm", f"{brief}\nopen\n> {MM * threshold:g}\nmm, m") if on_terminal else ("", "")
        columns.append(Column(f"{what} opening", shown(f"{part}_opening_max", ".3f"), "mm", heads[0]))
        cells = shown(f"{part}_separation_length", ".2f", 1.0)
        columns.append(Column(f"{what} open by over {length(threshold)}", cells, "m", heads[1]))
    for i in range(ds.sizes.get("opening", 0)):
        wider = [f"{MM * v:+.3f}" for v in ds["opening_width_change"].values[:, i]]
        columns.append(Column(f"opening {i + 1} wider by", wider, "mm", f"opening\n{i + 1} wider\nmm"))
    return columns


def wall_columns(ds: xr.Dataset) -> list[Column]:
    """Cracks, category and deflection of the walls of a house at the end, one row per wall."""
    categories = [category_label(ds, int(c)).replace(" ", "\u00a0") for c in ds["wall_damage_category"].values[-1]]

    def in_mm(name: str, head: str, short: str, digits: str) -> Column:
        return Column(head, [f"{MM * v:{digits}}" for v in ds[f"wall_{name}"].values[-1]], "mm", f"{short}\nmm")

    return [
        Column("wall", wall_names(ds), "", "wall", words=True),
        in_mm("crack_width_max", "widest crack", "widest\ncrack", ".3f"),
        Column("category", categories, "", "damage\ncategory", words=True),
        in_mm("crack_band_width_max", "crack band", "crack\nband", ".3f"),
        in_mm("central_deflection", "deflection of its footing", "deflection\nof footing", ".2f"),
        in_mm("footing_opening_max", "bed on footing open by", "bed\nopening", ".3f"),
    ]


def corner_columns(ds: xr.Dataset) -> list[Column]:
    """Vertical shear and slip where the walls of a house meet, at the end, one row per pair of walls."""
    names = wall_names(ds)
    sides = zip(*(ds[f"corner_{side}_wall"].values for side in ("first", "second")))
    places = zip(ds["corner_x"].values, ds["corner_y"].values)
    in_kn = {part: [f"{1e-3 * v:.2f}" for v in ds[f"corner_{part}_force"].values[-1]] for part in ("shear", "footing")}
    meet = [f"{names[a]}, {names[b]}" for a, b in sides]
    return [
        Column("first and second wall", meet, "", "walls that\nmeet", words=True),
        Column("at x, y", [f"{x:.2f}, {y:.2f}" for x, y in places], "m", "at x, y\nm"),
        Column("upward force on the second wall", in_kn["shear"], "kN", "corner\nshear\nkN"),
        Column("upward force on its footing", in_kn["footing"], "kN", "between\nfootings\nkN"),
        Column("largest slip", [f"{MM * v:.3f}" for v in ds["corner_slip_max"].values[-1]], "mm", "slip\nmm"),
    ]


def room_columns(ds: xr.Dataset) -> list[Column]:
    """Cracks and category on the sides of the rooms of a house at the end, one row per side."""
    sides = room_sides(ds).to_dict("records")
    categories = [category_label(ds, side["damage_category"]).replace(" ", "\u00a0") for side in sides]
    widths = [f"{MM * side['crack_width_max']:.3f}" for side in sides]
    return [
        Column("room", [f"{s['room']} at {s['x']:.1f}, {s['y']:.1f} m" for s in sides], "", "room", words=True),
        Column("wall", [s["wall"] for s in sides], "", "wall", words=True),
        Column("along it", [f"{s['start']:.2f} to {s['end']:.2f}" for s in sides], "m", "along\nm"),
        Column("widest crack", widths, "mm", "crack\nmm"),
        Column("category", categories, "", "damage\ncategory", words=True),
    ]


def crack_columns(frame: pd.DataFrame, in_time: bool = False) -> list[Column]:
    """Table of cracks: number, part, width, length, course and origin of cracks, one row per crack."""
    runs, brief = [], []
    for one in frame.to_dict("records"):
        name = str(one["crack_orientation"])
        slope = f"{one['crack_inclination']:.0f}°" if name in ("stepped", "diagonal") else ""
        through = one["crack_length_through_blocks"] > 0
        runs.append(", ".join(filter(None, (named(name), slope, "through bricks" if through else ""))))
        brief.append(" ".join(filter(None, (name, slope))) + ("*" if through else ""))
    parts = [named(str(part)) for part in frame["crack_part"]]

    def in_mm(head: str, name: str, short: str) -> Column:
        values = [MM * float(v) for v in frame[name]]
        return Column(head, [number(v, 3) for v in values], "mm", short, [f"{v:.2f}" for v in values])

    places = [f"{x:.2f}, {y:.2f}" for x, y in zip(frame["crack_x"], frame["crack_y"])]
    walls = [Column("wall", list(frame["crack_wall"]), "", "wall", words=True)] if "crack_wall" in frame else []
    columns = [
        *walls,
        Column("crack", [str(n) for n in frame["crack"]], short="no"),
        Column("part", parts, short="part", short_cells=[p.replace("opening", "open") for p in parts], words=True),
        in_mm("width", "crack_width", "width\nmm"),
        in_mm("opening and slip", "crack_displacement", "with\nslip"),
        Column("length", [f"{v:.2f}" for v in frame["crack_length"]], "m", "length\nm"),
        Column("how it runs", runs, short="how it\nruns", short_cells=brief, words=True),
        Column("widest at x, y", places, "m", "widest\nat m", short_cells=[place.replace(" ", "") for place in places]),
    ]
    if not in_time:
        drivers = {"load_displacement": "load displacement", "surface_movement": "ground movement"}
        name = next((name for name in drivers if f"first_{name}" in frame), "central_deflection")
        columns.append(in_mm(f"began at a {drivers.get(name, 'deflection')} of", f"first_{name}", "began\nat mm"))
    return columns


def worst_category_columns(judged: Mapping[str, xr.Dataset]) -> list[Column]:
    """Walls of a study by their worst category, and their share, one row per category."""
    counts = {head: shares(ds) for head, ds in judged.items()}
    categories = sorted({c for one in counts.values() for c in one}, key=lambda c: (c < 0, c))
    # a category beyond a judgement's own has the name that another one gives it
    labels = []
    for c in categories:
        named_by = [label for ds in judged.values() if (label := category_label(ds, c)) != f"{c} not known"]
        labels.append(named_by[-1] if named_by else "not known")
    cells = {
        head: [f"{one[c].walls} ({one[c].share:.1%})" if c in one else "0 (0.0%)" for c in categories]
        for head, one in counts.items()
    }
    return [
        Column("category", labels, short="category", words=True),
        *(Column(head, shown, short=head.replace(" or ", "\nor ")) for head, shown in cells.items()),
    ]


def worst_so_far(ds: xr.Dataset) -> IntArray:
    """Worst category up to each increment; older archives hold only the present one."""
    name = WORST_CATEGORY if WORST_CATEGORY in ds else "damage_category"
    return np.asarray(np.maximum.accumulate(ds[name].values, axis=-1))  # -1 where a wall was not followed


# -- how well a wall is solved ---------------------------------------------------------------------------------------


def known(ds: xr.Dataset, name: str) -> bool:
    """Whether a dataset has any value of a variable."""
    return name in ds and bool(np.isfinite(np.asarray(ds[name].values, dtype=np.float64)).any())


def energy_shares(ds: xr.Dataset) -> FloatArray:
    """Energy imbalance over the work done, at each increment, of each sample where present."""
    if not known(ds, "energy_error"):
        return np.empty(0)
    work = work_done(ds)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(work > 0, np.abs(ds["energy_error"].values) / work, np.nan)


def quality_rows(ds: xr.Dataset) -> list[list[str]]:
    """Quality of a wall's solution: name, value and unit in each row."""
    rows = [
        [residual.label, number(float(np.nanmax(ds[name].values)), 2), residual.shown_unit]
        for name, residual in described(Residuals).items()
        if known(ds, name)
    ]
    share = energy_shares(ds)
    if share.size and np.isfinite(share[-1]):
        rows.append(["energy that does not balance, of all work done", number(100 * float(share[-1]), 2), "%"])
    for name, counter in described(Counters).items():
        spent = ds[name].values if name in ds else np.zeros(0)
        if (spent > 0).any() or (name == "events" and (spent == 0).any()):
            rows.append([counter.label, str(int(spent[spent > 0].sum())), ""])
    if "time_step" in ds.attrs:
        rows.append(["time step", number(1e6 * float(ds.attrs["time_step"]), 3), "µs"])
        rows.append(["searches for neighbours", str(int(ds["searches"][-1])), ""])
    rows += [[what, str(ds.attrs[name]), ""] for name, what in _IN_TIME if name in ds.attrs]
    rows.append(["reaction of the ground at the end", number(1e-3 * float(ds["base_reaction"][-1])), "kN"])
    return rows


def energy_rows(ds: xr.Dataset) -> list[list[str]]:
    """Energies of a wall at the end of its path: name and value (J) in each row."""
    shown = {name: energy.label for name, energy in described(Energies).items() if energy.label and known(ds, name)}
    last = {label: float(ds[name].values[-1]) for name, label in shown.items()}
    return [[label, number(value)] for label, value in last.items() if value != 0.0]


# -- probabilities and fragility curves ------------------------------------------------------------------------------


def probability_columns(ds: xr.Dataset, found: Mapping[int, Exceedance]) -> list[Column]:
    """Probability of each category or worse with its Monte Carlo error, one row per category."""
    walls, every = f"{noun(ds)}s", [one.estimate for one in found.values()]
    labels = [category_label(ds, category).replace(" ", "\u00a0") for category in found]
    level = f"({every[0].confidence:.0%} interval)"
    values = [
        f"unknown ({chance(e.lower)} to {chance(e.upper)})"
        if np.isnan(e.value)
        else with_band(chance(e.value), chance(e.lower), chance(e.upper))
        for e in every
    ]
    columns = [
        Column("category", labels, short="category\nor worse", words=True),
        Column(f"probability {level}", values, short=f"probability\n{level}"),
        Column("standard error", [number(e.error or np.nan, 2) for e in every], short="Monte Carlo\nerror"),
        Column(walls, [str(e.samples) for e in every], short=walls),
    ]
    if any(e.effective_samples != e.samples for e in every):
        columns.append(Column(f"effective {walls}", [number(e.effective_samples, 3) for e in every]))
    if any(one.failed for one in found.values()):
        bounds = [f"{chance(one.failed_undamaged)} to {chance(one.failed_damaged)}" for one in found.values()]
        columns.append(Column(f"failed {walls} counted", bounds, short=f"failed {walls}\ncounted"))
    return columns


def curve_columns(curves: xr.Dataset) -> list[Column]:
    """Parameters of fragility curves with their bands, one row per category."""
    from damagepred.uq.fragility.describe import median_lower_bound  # slow to import, and not needed for a wall

    units, measure = str(curves["intensity"].attrs["units"]), movement_words(curves)
    unit = {"m": "mm", "m-1": "1/m", "year": "years"}.get(units, "")
    band = f"{curves.attrs['confidence']:.0%} band"
    every = [curves.isel(category=k) for k in range(curves.sizes["category"])]

    def shown(value: float) -> str:
        return ratio(value) if units == "1" else number(MM * value if units == "m" else value, 3)

    def median(one: xr.Dataset) -> str:
        if np.isfinite(bound := median_lower_bound(one)):
            return f"> {shown(bound)}"
        value, low, high = (shown(float(one[f"median{end}"])) for end in ("", "_lower", "_upper"))
        return with_band(value, low, high, "\n")

    labels = [f"{int(one['category'])} {named(str(one['category_name'].item()))}" for one in every]
    counts = [f"{int(one['reached'])} of {int(one['reached']) + int(one['not_reached'])}" for one in every]
    spread = [banded(one, "dispersion", between="\n") for one in every]
    fits = [chance(float(one["p_value"])) for one in every]
    status = [str(one["fit_status"].item()) for one in every]
    head, walls = f"median {unit}".rstrip(), f"{noun(curves)}s"
    columns = [
        Column("category or worse", labels, short="category\nor worse", words=True),
        Column(f"median {measure}, {band}", [median(one) for one in every], unit, f"{head}\n({band})"),
        Column(f"dispersion, {band}", spread, short=f"dispersion\n({band})"),
        Column(f"{walls} that reached it", counts, short=f"{walls} that\nreached it"),
        Column("goodness of fit", fits, short="goodness\nof fit"),
        Column("fit", [counted(why, is_house(curves)) for why in status], short="fit", words=True),
    ]
    if curves.attrs.get("samples_failed"):
        ends = ("median_failed_undamaged", "median_failed_damaged")
        bounds = ["\nor ".join(shown(float(one[end])) for end in ends) for one in every]
        name = f"median if all failed {walls} were undamaged, or damaged"
        columns.append(Column(name, bounds, unit, f"{head} if all\nfailed {walls} were\nundamaged, or damaged"))
    return columns


def banded(one: xr.Dataset, name: str, form: str = ".2f", between: str = " ") -> str:
    """Value with its confidence interval."""
    values = (float(one[f"{name}{end}"]) for end in ("", "_lower", "_upper"))
    value, low, high = (f"{v:{form}}" if np.isfinite(v) else number(v) for v in values)
    return with_band(value, low, high, between)


def curve_notes(curves: xr.Dataset) -> list[str]:
    """Remarks on the fit of fragility curves."""
    said = []
    if failed := int(curves.attrs.get("samples_failed", 0)):
        said.append(
            f"{failed} failed walls count in the curves as far as they were followed, which is right if walls do not "
            "fail because they are weak or strong."
        )
    columns = (curves[name].values for name in ("category", "fit_note", "p_value", "distance"))
    for category, note, fit, distance in zip(*columns):
        if fit < DOUBTFUL:
            said.append(
                f"The curve of category {category} is doubtful: of walls that follow such a curve, a "
                f"share of {chance(float(fit))} lies as far from it as these do (distance {distance:.2f})."
            )
        if note:
            said.append(f"Category {category}: {note}.")
    separate, common = (curves.attrs.get(f"aic_{word}", np.nan) for word in ("separate", "common"))
    if np.isfinite(separate + common):
        better = "one dispersion for all" if common <= separate else "a dispersion for each"
        said.append(
            f"Akaike's criterion: {separate:.1f} with a dispersion for each category, {common:.1f} with one for all. "
            f"The smaller is better: {better}."
        )
    if curves.attrs.get("crossed"):
        said.append("Walls come in fours that share a wall or a field (study.crossed): the bands are too narrow.")
    if curves.attrs.get("curves_cross"):
        said.append(
            "The curves of two categories, fitted apart, cross; where they do, neither is to be trusted. "
            "`damagepred fragility --model common` fits curves that do not."
        )
    return [counted(note, is_house(curves)) for note in said]


# -- sensitivity -----------------------------------------------------------------------------------------------------


def sensitivity_columns(indices: xr.Dataset) -> list[Column]:
    """Dependence of damage on each input, one row per input."""
    inputs = [str(v) for v in indices["variable"].values]
    columns = [Column("input", inputs, short="input", words=True)]
    level = f"({indices.attrs['confidence']:.0%} interval)"
    for name, head in (("spearman", "rank correlation"), ("partial", "partial"), ("first_order", "share of variance")):
        # the estimate of a small share may be below 0
        known = indices.clip(0.0, 1.0) if name == "first_order" else indices
        cells = [banded(known.sel(variable=v), name) for v in inputs]
        columns.append(Column(head, cells, short=f"{head}\n{level}"))
    return columns


def standing_out(indices: xr.Dataset) -> list[int]:
    """Inputs whose partial rank correlation has a sure sign, the largest first."""
    ends = (np.sign(indices[f"partial_{end}"].values) for end in ("lower", "upper"))
    sure = np.equal(*ends)
    return [int(i) for i in np.argsort(-np.abs(indices["partial"].values)) if sure[i]]


YEARS = (1, 2, 5, 10, 20, 30, 50, 100)  # years of a history that have a row, in addition to its last


def year_frame(ds: xr.Dataset, confidence: float = 0.9) -> pd.DataFrame:
    """Probability of each category by the worst up to a year, and by the present one (NaN where some are unknown)."""
    import pandas as pd

    from damagepred.uq.estimate import probability

    ds = ds.isel(sample=np.isin(ds["status"].values, SOLVED))
    time, category = np.atleast_2d(ds["time"].values), ds["damage_category"].values
    unknown = (category < 0) | np.isnan(ds["crack_width_max"].values)
    unknown &= (ds["status"].values != SampleStatus.COLLAPSED)[:, None]
    weight = ds["weight"].values if "weight" in ds else None
    so_far, last = worst_so_far(ds), float(time.max())
    walls, rows = np.arange(len(category)), []
    for least in range(1, min(max(int(so_far.max(initial=1)), 1), highest_category(ds)) + 1):
        for year in sorted({year for year in YEARS if year < last} | {last}):
            at = (time <= year + 1e-9).sum(axis=1) - 1
            row = {"category": least, "year": float(year)}
            for name, values in (("so_far", so_far), ("now", category)):
                estimate = probability(values[walls, at] >= least, weight=weight, confidence=confidence)
                complete = name == "so_far" or not unknown[walls, at].any()
                for end, value in (("", estimate.value), ("_lower", estimate.lower), ("_upper", estimate.upper)):
                    row[name + end] = value if complete else np.nan
            rows.append(row)
    return pd.DataFrame(rows).set_index(["category", "year"])


def year_columns(ds: xr.Dataset, confidence: float = 0.9) -> list[Column]:
    """Table of ``year_frame`` as columns of text, one row per year."""
    frame = year_frame(ds, confidence)
    years = frame.index.unique("year")
    columns = [Column("year", [f"{year:g}" for year in years], short="year")]
    for least, rows in frame.groupby(level="category"):
        for key, name in (("so_far", "so far"), ("now", "now")):
            values = rows[[key, f"{key}_lower", f"{key}_upper"]].to_numpy()
            cells = ["–" if np.isnan(row[0]) else with_band(*map(chance, row)) for row in values]
            brief = [cell.replace(" to ", "-") if key == "so_far" else cell.split()[0] for cell in cells]
            head, short = f"category {least} or worse {name}", f"{least} or worse\n{name}"
            columns.append(Column(head, cells, short=short, short_cells=brief))
    return columns
