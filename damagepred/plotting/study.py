"""All walls of a study: their paths, shares of the categories, convergence of the estimates."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from damagepred.archive.schema import require
from damagepred.arrays import FloatArray, IntArray
from damagepred.damage.cracks import HAIRLINE
from damagepred.enumerations import SampleStatus
from damagepred.errors import InputError
from damagepred.inputs.arguments import checked
from damagepred.plotting import colours, sheet
from damagepred.plotting.colours import CATEGORY_COLOURS, FOOTING_GAP_COLOUR, highest_of, not_reached
from damagepred.results.house import noun
from damagepred.uq.capacity import sample_weights
from damagepred.uq.intensity import movement_measure, movement_words

NOT_KNOWN = -1  # in place of a category where the wall was not followed as far
BEYOND = 1e300  # in place of an infinite width, to interpolate
FEWEST = 0.8  # share of the walls that must count for quantiles over them to be drawn

_NEEDED = ("damage_category", "status")
_STUDY = "a study of `damagepred.open_study`"


class Paths(NamedTuple):
    """Paths of s walls at d common movements."""

    movement: FloatArray  # (d,): rising (m)
    # (s, d): values of a variable; infinite after an early end in collapse or in the study's last category, NaN where
    # the wall was not followed as far for another reason
    width: FloatArray
    category: IntArray  # (s, d): highest category reached up to there, -1 where the wall was not followed as far


def common_paths(ds: xr.Dataset, points: int = 121, width_name: str = "crack_width_max") -> Paths:
    """Paths of all walls at common movements."""
    if ds["damage_category"].dims == ds[width_name].dims == ("sample",):
        raise InputError(
            "this study stores only the end of each wall's path ([study] movement = 'sampled'): no paths to draw."
        )
    if ds[width_name].dims != ("sample", "increment"):
        raise InputError(f"variable = '{width_name}': must be a number for each wall and increment.")
    movement, width = ds[movement_measure(ds)].values, ds[width_name].values
    category, status = ds["damage_category"].values, ds["status"].values
    if movement.ndim == 1:
        movement = np.broadcast_to(movement, width.shape)
    followed = np.isfinite(movement) & (category >= 0)
    movement = np.fmax.accumulate(movement, axis=1)  # a footing that finds its own form may rise again
    solved = followed & np.isfinite(width)
    if not solved.any():
        raise InputError("the study has no finished sample yet; run `damagepred study` first.")
    shared = np.unique(np.round(movement[followed], 12))
    grid = shared if len(shared) <= movement.shape[1] else np.linspace(0.0, float(movement[followed].max()), points)
    highest = highest_of(ds)
    shape = (len(width), len(grid))
    paths = Paths(grid, np.full(shape, np.nan), np.full(shape, NOT_KNOWN))
    slack = 1e-9 * grid[-1]
    for sample in np.flatnonzero(solved.any(axis=1)):
        x, solved_x = movement[sample, followed[sample]], movement[sample, solved[sample]]
        worst = np.maximum.accumulate(category[sample, followed[sample]].astype(np.int64))
        last = np.searchsorted(x, grid + slack, side="right") - 1
        # a category beyond the last width: the rest was left out on purpose, it is not unknown
        ended = status[sample] == SampleStatus.COLLAPSED or worst[-1] >= highest or len(solved_x) < len(x)
        paths.category[sample] = worst[np.maximum(last, 0)]
        paths.width[sample] = np.interp(grid, solved_x, width[sample, solved[sample]])
        paths.width[sample, grid > solved_x[-1] + slack] = np.inf if ended else np.nan
        final = highest if status[sample] == SampleStatus.COLLAPSED else worst[-1]
        paths.category[sample, grid > x[-1] + slack] = final if ended else NOT_KNOWN
    return paths


def draw_paths(ds: xr.Dataset, variable: str, ax: Axes | None = None) -> Axes:
    """Draw a variable of every wall against the movement, with quantiles as far as four of five walls count."""
    require(ds, (*_NEEDED, variable), _STUDY)
    paths = common_paths(ds, width_name=variable)
    ax = sheet.axes_or_new(ax, 9.0, 5.5)
    table, of_cracks = colours.table_of(ds), variable.startswith("crack_")
    factor, unit = sheet.shown_unit(ds, variable)
    x, values = paths.movement * sheet.MM, paths.width * factor
    shown = np.where(np.isfinite(values), values, np.nan)
    if not variable.endswith(("_max", "_worst", "_width")):  # a number that may fall is unknown beyond the path's end
        values = shown
    weight = sample_weights(ds)
    wall = noun(ds)
    strength = float(np.clip(12.0 / len(values), 0.04, 0.5))
    lines = (np.column_stack((x, row)) for row in shown)
    sheet.add_lines(ax, lines, colors="0.15", linewidths=0.6, alpha=strength, zorder=2, label=f"each {wall}")
    handles = [Line2D([], [], color="0.5", linewidth=0.8, label=f"each {wall}")]
    style: dict[str, Any] = {"color": "#0072b2", "linewidth": 2.0, "zorder": 4}
    for share, dashes in ((0.9, "--"), (0.5, "-"), (0.1, ":")):
        label = "median" if share == 0.5 else f"{share:.0%} of the {wall}s below"
        handles += ax.plot(x, quantile(values, share, weight), dashes, label=label, **style)
    for name, colour, label in (
        ("crack_band_width_max", "#d55e00", "median, widest crack band"),
        ("footing_opening_max", FOOTING_GAP_COLOUR, "median, gap on the footing"),
    ):
        if variable == "crack_width_max" and name in ds.variables and float(ds[name].max()) > HAIRLINE:
            other = common_paths(ds, width_name=name).width * sheet.MM
            style |= {"color": colour, "linewidth": 1.4}
            handles += ax.plot(x, quantile(other, 0.5, weight), "-.", label=label, **style)
    ax.set_xlim(0.0, float(x[-1]) or 1.0)
    sheet.label_movement(ax, movement_words(ds))
    categories = ""
    if of_cracks and unit == " (mm)":
        name = "widest crack" if variable == "crack_width_max" else variable.replace("_", " ")
        colours.width_scale(ax, shown, table, name)
        colours.shade_bands(ax, table)
        by = f"; categories of damage by {table.name}" if table.category_names else ""
        categories = by + not_reached(ds, int(paths.category.max()))
    else:
        ax.autoscale_view(scalex=False)
        ax.set_ylabel(f"{variable.replace('_', ' ')}{unit}")
        sheet.grid(ax)
    sheet.legend_below(ax, handles)
    sheet.set_title(ax, sheet.title_of(ds, "study"), f"{count_walls(ds)}{categories}")
    return ax


def quantile(width: FloatArray, share: float, weight: FloatArray | None = None) -> FloatArray:
    """Quantile over walls, column by column; NaN where too few of them count, or where it is infinite."""
    heavy = np.ones(len(width)) if weight is None else weight
    counts = ~np.isnan(width)
    result = np.full(width.shape[1], np.nan)
    walls = heavy[counts.any(axis=1)].sum()
    for column in np.flatnonzero((heavy[:, None] * counts).sum(axis=0) >= FEWEST * walls * (1 - 1e-9)):
        values, w = width[counts[:, column], column], heavy[counts[:, column]]
        order = np.argsort(values, kind="stable")
        values, w = values[order], w[order]
        # a wall's place is the weight before it and half of its own, from 0 for the first to 1 for the last
        place = np.cumsum(w) - 0.5 * w
        place = (place - place[0]) / (place[-1] - place[0]) if place[-1] > place[0] else np.zeros(len(place))
        result[column] = np.interp(share * (1 - 1e-12), place, np.minimum(values, BEYOND))
    return np.where(result < 1e-100 * BEYOND, result, np.nan)


@checked
def draw_category_shares(ds: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the share of the walls in each category of damage against the movement.

    A wall stays in the highest category it has reached. Walls that failed, are missing, or were not followed as far
    are hatched.

    Parameters
    ----------
    ds : xarray.Dataset
        Study (``damagepred.open_study``).
    ax : Axes, optional
        Axes to draw on; by default on a new figure.

    Examples
    --------
    >>> import damagepred
    >>> ax = damagepred.plotting.draw_category_shares(damagepred.open_study("house.dp"))
    >>> ax.get_xlabel()
    'central deflection (mm)'
    """
    require(ds, (*_NEEDED, "crack_width_max"), _STUDY)
    paths = common_paths(ds)
    ax = sheet.axes_or_new(ax, 9.0, 5.5)
    x, highest = paths.movement * sheet.MM, highest_of(ds)
    weight = sample_weights(ds)
    kinds = [*range(highest + 1), NOT_KNOWN]
    shares = np.array([(weight[:, None] * (paths.category == c)).sum(axis=0) for c in kinds]) / weight.sum()
    bottom = np.zeros_like(x)
    for category in range(highest + 1):
        top, label = bottom + shares[category], f"{category} {colours.name_of(ds, category)}"
        ax.fill_between(x, bottom, top, color=CATEGORY_COLOURS[category], linewidth=0.6, edgecolor="white", label=label)
        bottom = top
    if shares[-1].any():
        hatched: dict[str, Any] = {"facecolor": "white", "edgecolor": "0.5", "hatch": "///", "linewidth": 0.0}
        ax.fill_between(x, bottom, 1.0, label="failed, not run, or not followed as far", **hatched)
    ax.set_xlim(float(x[0]), float(x[-1]) or 1.0)
    ax.set_ylim(0.0, 1.0)
    sheet.label_movement(ax, movement_words(ds))
    ax.set_ylabel(f"share of the {noun(ds)}s")
    sheet.legend_below(ax)
    what = f"highest category reached up to each movement{not_reached(ds, int(paths.category.max()))}"
    sheet.set_title(ax, sheet.title_of(ds, "study"), f"{count_walls(ds)}; {what}")
    return ax


def count_walls(ds: xr.Dataset) -> str:
    """Numbers of walls of a study: all, collapsed, failed, missing."""
    status = ds["status"].values
    words = {SampleStatus.COLLAPSED: "collapsed", SampleStatus.FAILED: "failed", SampleStatus.MISSING: "not run yet"}
    counts = [(int((status == value).sum()), word) for value, word in words.items()]
    said = [f"{len(status)} {noun(ds)}s", *(f"{count} {word}" for count, word in counts if count)]
    return ", ".join(said)
