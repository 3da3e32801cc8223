"""Results of analyses: comparison of studies, sensitivity, design search, back-analysis, scales of damage."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.path import Path

from damagepred.analyses.posterior_tables import measures, odds_in_words
from damagepred.archive.schema import flag_name, require
from damagepred.assembly.assembly import rectangle
from damagepred.assembly.bond import lay_bricks
from damagepred.inputs.arguments import checked
from damagepred.plotting import sheet
from damagepred.plotting.colours import CATEGORY_COLOURS, CURVE_STYLES, OPENING_STYLES, RANK_COLOURS, SHARE_COLOURS
from damagepred.plotting.rig import draw_bricks
from damagepred.results.house import noun, wall_places
from damagepred.results.tables import most_damaged_first
from damagepred.scene import House
from damagepred.scene.scene import archived_scene
from damagepred.uq.capacity import category_number
from damagepred.uq.intensity import movement_words


@checked
def draw_comparison(
    comparison: xr.Dataset, category: int | str | None = None, axes: Sequence[Axes] | None = None
) -> list[Axes]:
    """Draw the probability of a category in each study, and below the difference to the first, with intervals.

    Parameters
    ----------
    comparison : xarray.Dataset
        Result of ``damagepred.compare``.
    category : int or str, optional
        Category, or worse; by default the first compared.
    axes : sequence of 2 Axes, optional
        Axes to draw on; by default on a new figure.

    Examples
    --------
    >>> import damagepred
    >>> studies = {"as it is": damagepred.open_study("house.dp"), "strong": damagepred.open_study("strong.dp")}
    >>> axes = damagepred.plotting.draw_comparison(damagepred.compare(studies, categories=[2]))
    >>> len(axes)
    2
    """
    require(comparison, ("probability", "difference", "difference_lower"), "a comparison of studies")
    upper, lower = sheet.several_or_new(axes, 2, 8.0, 7.5)
    category = int(comparison["category"][0]) if category is None else category_number(comparison, category)
    chosen = comparison.sel(category=category)
    in_metres = comparison["movement"].attrs.get("units") == "m"
    movement = comparison["movement"].values * (sheet.MM if in_metres else 1.0)
    for k, name in enumerate(str(study) for study in comparison["study"].values):
        curve, (colour, _) = chosen.isel(study=k), OPENING_STYLES[k % len(OPENING_STYLES)]
        style: dict[str, Any] = {"color": colour, "linestyle": CURVE_STYLES[k % len(CURVE_STYLES)], "linewidth": 1.8}
        for ax, of, label, alpha in (
            (upper, "probability", sheet.verbatim(name), 0.12),
            (lower, "difference", None, 0.15),
        ):
            if k or ax is upper:
                ax.plot(movement, curve[of], label=label, **style)
                ends = curve[f"{of}_lower"], curve[f"{of}_upper"]
                ax.fill_between(movement, *ends, color=colour, alpha=alpha, linewidth=0)
    lower.axhline(0.0, color=OPENING_STYLES[0][0], linewidth=1.0)
    upper.set_ylim(0.0, 1.0)
    upper.set_ylabel("probability")
    lower.set_ylabel(f"difference to {sheet.verbatim(str(comparison.attrs['reference']))}")
    reach = float(np.nanmax(np.abs([lower.get_ylim()]), initial=0.05))
    lower.set_ylim(-reach, reach)
    words = movement_words(comparison, str(comparison["movement"].attrs.get("measure", "movement")))
    for ax in (upper, lower):
        ax.set_xlim(0.0, movement.max())
        if in_metres:
            sheet.label_movement(ax, words)
        else:
            ax.set_xlabel(words)
    level = f"{float(comparison.attrs['confidence']):.0%} intervals"
    paired = comparison["paired_samples"].values[1:]
    pairs = f"{int(paired.min())} pairs of samples" if paired.size and paired.min() else "different samples"
    name = sheet.verbatim(flag_name(comparison, category, "category"))
    sheet.set_title(upper, "Probability of damage", f"category {category} ({name}) or worse; {level}")
    sheet.set_title(lower, "Difference to the first study", f"{pairs}; below zero: less damage")
    sheet.legend_below(lower, upper.get_lines(), columns=3)
    return [upper, lower]


@checked
def draw_sensitivity(shares: xr.Dataset, axes: Sequence[Axes] | None = None) -> list[Axes]:
    """Draw rank correlations of the inputs with the capacity, and their shares of its variance.

    Parameters
    ----------
    shares : xarray.Dataset
        Result of ``damagepred.study_sensitivity``.
    axes : sequence of 2 Axes, optional
        Axes to draw on; by default on a new figure.

    Examples
    --------
    >>> import damagepred
    >>> shares = damagepred.study_sensitivity(damagepred.open_study("house.dp"), category=2, resamples=50)
    >>> axes = damagepred.plotting.draw_sensitivity(shares)
    >>> len(axes)
    2
    """
    require(shares, ("spearman", "partial", "first_order"), "the result of study_sensitivity")
    order = np.argsort(np.abs(shares["spearman"].values))
    inputs = shares.isel(variable=order)
    names = [str(n).replace(".", ", ").replace("_", " ") for n in inputs["variable"].values]
    upper, lower = sheet.several_or_new(axes, 2, 9.0, 3.6 + 0.9 * len(names))
    rows = np.arange(len(names), dtype=np.float64)
    _points(upper, inputs, "spearman", rows + 0.12, RANK_COLOURS[0], "rank correlation")
    _points(upper, inputs, "partial", rows - 0.12, RANK_COLOURS[1], "partial: others held fixed")
    upper.set_xlim(-1.0, 1.0)
    upper.set_xticks(np.linspace(-1.0, 1.0, 5))
    _points(lower, inputs, "first_order", rows, SHARE_COLOURS[0], "by itself")
    for ax, bounds, label in ((upper, [0.0], "rank correlation"), (lower, [0.0, 1.0], "share of the variance")):
        for bound in bounds:
            ax.axvline(bound, color="0.4", linewidth=0.8)
        ax.set_xlabel(label)
        ax.set_yticks(rows, names)
        ax.set_ylim(-0.6, len(names) - 0.4)
        sheet.grid(ax, "x")
        sheet.legend_below(ax, columns=2, inches=0.6, left=True)
    lower.set_xlim(min(-0.05, lower.get_xlim()[0]), max(1.05, lower.get_xlim()[1]))
    title = sheet.title_of(shares, "sensitivity")
    censored = float(shares.attrs.get("share_censored", 0.0))
    what = f"{shares.attrs.get('output', '')}; {int(shares.attrs['walls'])} {noun(shares)}s"
    what += f", {censored:.0%} of all had not reached it" if censored >= 0.005 else ""
    bars = f"bars: {float(shares.attrs['confidence']):.0%} intervals"
    sheet.set_title(upper, title[:1].upper() + title[1:], f"{what}; {bars}")
    return [upper, lower]


def _points(ax: Axes, shares: xr.Dataset, name: str, rows: np.ndarray, colour: str, label: str) -> None:
    value, low, high = (shares[f"{name}{end}"].values for end in ("", "_lower", "_upper"))
    reach = np.nan_to_num([value - low, high - value]).clip(0.0)
    ax.errorbar(value, rows, xerr=reach, fmt="o", color=colour, capsize=3, markersize=5, label=label, zorder=3)


_WORDS = {
    "probability": ("dearer or undecided", "meets the target", "does not meet it"),
    "expected_cost": ("undecided", "least expected cost", "dearer"),
}


@checked
def draw_design_search(search: xr.Dataset, axes: Sequence[Axes] | None = None) -> list[Axes]:
    """Draw probability of damage or expected cost of each alternative against its cost, and the value of each measure.

    Parameters
    ----------
    search : xarray.Dataset
        Result of ``damagepred.search_design``.
    axes : sequence of 2 Axes, optional
        Axes to draw on; by default on a new figure.

    Examples
    --------
    >>> import damagepred
    >>> axes = damagepred.plotting.draw_design_search(damagepred.search_design("choices.toml", "choices.design"))
    >>> len(axes)
    2
    """
    quantity = str(search.attrs.get("quantity", "probability"))
    require(search, ("cost", quantity, "decision", "value"), "a design search")
    by_cost = quantity == "expected_cost"
    upper, lower = sheet.several_or_new(axes, 2, 8.0, 7.5)
    for code, word in enumerate(_WORDS[quantity]):
        group = search.isel(alternative=np.flatnonzero(search["decision"].values == code))
        if not group.sizes["alternative"]:
            continue
        middle = group[quantity].values
        bars = np.abs(np.array([group[f"{quantity}_{end}"].values - middle for end in ("lower", "upper")]))
        colour, marker = OPENING_STYLES[code]
        upper.errorbar(group["cost"], middle, yerr=bars, fmt=marker, color=colour, capsize=3, label=word)
    upper.set_ylim(bottom=0.0)
    if not by_cost:
        upper.axhline(float(search.attrs["limit"]), color=OPENING_STYLES[4][0], linewidth=1.0)
        most = max(float(search["probability_upper"].max()), float(search.attrs["limit"]))
        upper.set_ylim(0.0, min(1.3 * most, 1.0))
    upper.set_ylabel("expected cost, repairs included" if by_cost else "probability")
    upper.set_xlabel("cost")
    sheet.legend_below(upper, columns=3)
    chosen = sheet.verbatim(str(search.attrs["chosen"])) or "no alternative meets it for certain"
    sheet.set_title(upper, "Cost with repairs" if by_cost else "Cost and probability of damage", f"chosen: {chosen}")
    rows, errors = np.arange(search.sizes["measure"]), search["value_error"].values
    lower.barh(rows, search["value"].values, 0.5, xerr=errors, color=OPENING_STYLES[0][0], capsize=3)
    lower.set_yticks(rows, [sheet.verbatim(str(name)) for name in search["measure"].values])
    lower.locator_params(axis="x", nbins=5)
    what = "cost of repair" if by_cost else "probability"
    lower.set_xlabel(f"change of the {what}, with standard error")
    return [upper, lower]


@checked
def draw_portfolio(street: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the probability of each category for the houses of a portfolio, the most damaged first.

    Parameters
    ----------
    street : xarray.Dataset
        Result of ``damagepred.assess_portfolio``.
    ax : Axes, optional
        Axes to draw on; by default on a new figure.

    Examples
    --------
    >>> import damagepred
    >>> street = damagepred.assess_portfolio("houses.csv", "house.toml", "street.portfolio")
    >>> axes = damagepred.plotting.draw_portfolio(street)
    """
    require(street, ("probability", "walls"), "a portfolio")
    probability = street["probability"].transpose("house", "category").values
    order = np.array([k for k in most_damaged_first(street) if np.isfinite(probability[k]).all()], dtype=np.int64)
    named = len(order) <= MOST_NAMES
    ax = sheet.axes_or_new(ax, 8.0, 1.8 + 0.3 * len(order) if named else 4.0)
    reached = np.column_stack((probability[order], np.zeros(len(order))))
    ranks = np.arange(len(order))
    for category in street["category"].values.tolist():
        start, share = reached[:, category], reached[:, category - 1] - reached[:, category]
        draw_bars, at_start = (ax.barh, "left") if named else (ax.bar, "bottom")
        style: dict[str, Any] = {"color": CATEGORY_COLOURS[category], "label": f"category {category}", at_start: start}
        draw_bars(ranks, share, 0.8, **style)
    if named:
        ax.set_yticks(ranks, [sheet.verbatim(str(name)) for name in street["house"].values[order]])
        ax.invert_yaxis()
        ax.set_xlim(0.0, 1.0)
        ax.set_xlabel("probability")
    else:
        ax.set_ylim(0.0, 1.0)
        ax.set_ylabel("probability")
        ax.set_xlabel("houses, the most damaged first")
    sheet.legend_below(ax, columns=4)
    unknown = street.sizes["house"] - len(order)
    left = f"; {unknown} with unknown probabilities left out" if unknown else ""
    sheet.set_title(ax, sheet.title_of(street, "houses"), f"{len(order)} houses{left}")
    return ax


MOST_NAMES = 40  # houses whose names still fit below the axis

_LABEL: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}
"""Background of the labels of observed cracks."""


@checked
def draw_back_analysis(posterior: xr.Dataset, axes: Sequence[Axes] | None = None) -> list[Axes]:
    """Draw the posterior of the movement for each cause, and the crack map of the most probable cause.

    Of observations with dates, draw the movement over time under the most probable cause, with its forecast, and the
    movement that each visit alone would give.

    Parameters
    ----------
    posterior : xarray.Dataset
        Result of ``damagepred.infer``.
    axes : sequence of Axes, optional
        Axes to draw on: one, or two where cracks with a place were observed; by default on a new figure.

    Examples
    --------
    >>> import damagepred
    >>> from damagepred.uq.observations import CrackObservation, Observations
    >>> seen = Observations(crack=(CrackObservation(width="2 mm"),))
    >>> len(damagepred.plotting.draw_back_analysis(damagepred.infer("house.dp", seen)))
    1
    """
    require(posterior, ("posterior", "movement", "movement_measure", "posterior_odds"), "a back-analysis")
    axes = sheet.several_or_new(axes, 2 if "crack_probability" in posterior else 1, 8.0, 7.5)
    shown, largest = measures(posterior), posterior["movement_largest"].values
    warning = "" if posterior["resembles"].values.any() else "NO STORED SAMPLE RESEMBLES THE OBSERVATIONS"
    if "until" in posterior:
        _draw_history(posterior, axes[0], warning)
        return [*axes[:1], *(_draw_map(posterior, ax) for ax in axes[1:])]
    alike = len(set(shown)) == 1
    for k, name in enumerate(str(study) for study in posterior["study"].values):
        of_study = (posterior["study_of_sample"] == k).values
        weight, movement = (posterior[n].values[of_study].ravel() for n in ("posterior", "movement"))
        used = weight > 0
        order = np.argsort(movement[used])
        total = np.cumsum(weight[used][order]) / max(weight.sum(), 1e-300)
        colour, style = OPENING_STYLES[k % len(OPENING_STYLES)][0], CURVE_STYLES[k % len(CURVE_STYLES)]
        odds = odds_in_words(float(posterior["posterior_odds"][k]))
        label, factor = f"{sheet.verbatim(name)}: odds {odds}", shown[k].factor if alike else 1.0 / largest[k]
        if not alike:
            label += f"; {shown[k].words} up to {shown[k].factor * largest[k]:.3g} {shown[k].unit}"
        axes[0].step(movement[used][order] * factor, total, where="post", color=colour, linestyle=style, label=label)
    axes[0].set_ylim(0.0, 1.0)
    axes[0].set_xlabel(f"{shown[0].words} ({shown[0].unit})" if alike else "movement over the largest of the study")
    axes[0].set_ylabel("posterior probability\nof a smaller movement")
    sheet.set_title(axes[0], "Movement, given the observations", warning)
    sheet.legend_below(axes[0])
    if len(axes) > 1:
        _draw_map(posterior, axes[1])
    return axes


def _draw_history(posterior: xr.Dataset, ax: Axes, warning: str) -> None:
    """Draw the movement over time under the most probable cause, and the movement that each visit alone gives."""
    best = int(posterior["cause_posterior"].values.argmax())
    cause, measure, colour = posterior.isel(study=best), measures(posterior)[best], OPENING_STYLES[0][0]
    low, lower, middle, upper, high = measure.factor * cause["history_quantile"].values.T
    date, visit = cause["date"].values, cause["visit"].values
    bands: list[Any] = [
        ax.fill_between(date, *ends, color=colour, alpha=alpha, linewidth=0.0, label=label)
        for *ends, alpha, label in ((low, high, 0.2, "90 %"), (lower, upper, 0.3, "50 %"))
    ]
    later = date >= visit[-1]
    for some, style, label in ((~later | (date == visit[-1]), "-", "median"), (later, "--", "forecast")):
        bands += ax.plot(date[some], middle[some], style, color=colour, label=label)
    least, *_, each, _, most = measure.factor * cause["visit_quantile"].values.T
    alone: dict[str, Any] = {"fmt": "o", "color": "black", "markersize": 4, "capsize": 3}
    bands.append(ax.errorbar(visit, each, (each - least, most - each), label="one visit alone, 90 %", **alone))
    bands += ax.plot(visit, np.zeros(len(visit)), "|", color="black", label="visits", clip_on=False)
    end = measure.factor * float(cause["movement_largest"])
    if np.nanmax(high) > end:
        bands.append(ax.axhline(end, color="grey", linestyle=":", label="end of the stored paths"))
    ax.set_ylim(bottom=0.0)
    ax.set_ylabel(f"{measure.words} ({measure.unit})")
    rates = measure.factor * cause["rate_quantile"].values
    slow, *_, rate, _, fast = (sheet.plain_number(float(f"{v:.2g}")) for v in rates)
    words = f"{sheet.verbatim(str(cause['study'].values))}: {rate} {measure.unit} a year, {slow} to {fast}"
    sheet.set_title(ax, "Movement over time, given the observations", words, warning)
    sheet.legend_below(ax, bands)


def _draw_map(posterior: xr.Dataset, ax: Axes) -> Axes:
    """Draw the probability of cracks over the bricks of the most probable cause, observed cracks and levels."""
    cause = posterior.isel(study=int(posterior["cause_posterior"].values.argmax()))
    cracked, size = cause["crack_probability"], sheet.small(ax)
    scene = archived_scene({"scene": cause["study_scene"].item()}) if "study_scene" in cause else None  # older results
    walls = [] if scene is None else list(zip(wall_places(scene), scene.scenes))
    if walls:
        draw_bricks(ax, [np.array(rectangle(*brick[:4])) + at for at, one in walls for brick in lay_bricks(one)])
    # transparent at probability 0, over the bricks
    shades = LinearSegmentedColormap.from_list("cracks", ["#b3152b00", "#b3152bff"])
    looks: dict[str, Any] = {"vmin": 0.0, "vmax": 1.0, "cmap": shades, "shading": "nearest", "zorder": 2}
    mesh = ax.pcolormesh(cause["map_x"], cause["map_y"], cracked, **looks)
    ax.figure.colorbar(mesh, ax=ax, label="probability of a crack", shrink=0.7)
    if walls:  # cells of the map reach beyond the walls
        faces = np.array([rectangle(*at, *np.add(at, (one.wall.length, one.wall.height))) for at, one in walls])
        outlines = (Path([*face, face[0]], closed=True) for face in faces)
        mesh.set_clip_path(Path.make_compound_path(*outlines), ax.transData)
        (left, low), (right, top) = faces.min(axis=(0, 1)), faces.max(axis=(0, 1))
        ax.axis((left, right, low, top))
    for name, face in zip(scene.names, faces) if isinstance(scene, House) else ():
        ax.annotate(name, face[0], (0, -3), va="top", textcoords="offset points", fontsize=size)
    middle = np.mean(ax.get_ylim())
    style: dict[str, Any] = {"ha": "center", "va": "center", "bbox": _LABEL, "fontsize": size, "zorder": 6}
    names = ("observed_x", "observed_y", "observed_width", "observed_limit")
    marks = sorted(zip(*(posterior[name].values.tolist() for name in names if name in posterior)))
    for k, (x, y, width, limit) in enumerate(marks):
        ax.plot(x, y, marker="o" if width else "x", color="black", fillstyle="none", markersize=9, zorder=5)
        words = f"{limit} {sheet.plain_number(width * sheet.MM)} mm".strip() if width else "no crack"
        # neighbours at different heights, all inside the wall
        place = (0, (1 if y < middle else -1) * (16, 32)[k % 2])
        ax.annotate(words, (x, y), place, textcoords="offset points", **style)
    ends = ("x", "y", "to_x", "to_y", "difference") if "level_x" in posterior else ()
    levels = [posterior[f"level_{end}"].values.tolist() for end in ends]
    for x, y, to_x, to_y, difference in zip(*levels):
        ax.plot([x, to_x], [y, to_y], color=OPENING_STYLES[0][0], marker="|", linestyle="--", linewidth=1.2, zorder=4)
        # above its line, so inside the wall
        at_end = {**style, "ha": "left" if to_x < x else "right", "color": OPENING_STYLES[0][0]}
        words = f"{difference * sheet.MM:+.3g} mm"
        ax.annotate(words, (to_x, to_y), (0, 8), textcoords="offset points", **at_end)
    sheet.elevation(ax)
    if isinstance(scene, House):
        ax.set_axis_off()
    limit = float(cracked.attrs["wider_than"]) * sheet.MM
    observed = "; circles: observed widths, crosses: no crack" if marks else ""
    observed += "; dashed: observed difference of levels" if levels else ""
    name = sheet.verbatim(str(cause["study"].values))
    sheet.set_title(ax, "Crack map", f"{name}: cracks wider than {limit:g} mm{observed}")
    return ax


def draw_scales(scales: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the share of states that each pair of scales judges alike: both beyond their first limits, or both below."""
    require(scales, ("agreement", "share_reached"), "a comparison of scales")
    ax = sheet.axes_or_new(ax, 10.0, 8.0)
    shares = scales["agreement"].values
    ax.imshow(shares, vmin=0.0, vmax=1.0, cmap="Greys", aspect="auto")
    for (row, column), share in np.ndenumerate(shares):
        text = "-" if np.isnan(share) else f"{share:.2f}"
        colour = "white" if share > 0.5 else "black"
        ax.text(column, row, text, ha="center", va="center", color=colour, fontsize=sheet.small(ax))
    names = [f"{sheet.verbatim(str(name))}  {number}" for number, name in enumerate(scales["scale"].values, 1)]
    ax.set_xticks(range(len(names)), [str(number) for number in range(1, len(names) + 1)])
    ax.set_yticks(range(len(names)), names, fontsize=sheet.small(ax))
    title = sheet.title_of(scales, "") or "Agreement of scales"
    sheet.set_title(ax, title, "share of states that two scales judge alike")
    return ax
