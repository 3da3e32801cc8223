"""Fragility curves: the probability of a category of damage or worse against the movement."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter

from damagepred.archive.schema import flag_name
from damagepred.arrays import FloatArray, IntArray
from damagepred.formatting import ratio
from damagepred.inputs.arguments import checked
from damagepred.plotting.colours import CATEGORY_COLOURS, CURVE_STYLES
from damagepred.plotting.sheet import (
    MM,
    axes_or_new,
    grid,
    label_movement,
    legend_below,
    plain_number,
    require,
    round_numbers,
    set_title,
    small,
    title_of,
    verbatim,
)
from damagepred.scene.site import site_classes
from damagepred.uq.fragility.describe import median_lower_bound
from damagepred.uq.fragility.fit import EXTRAPOLATED, WITH_CURVE
from damagepred.uq.intensity import OF_SITE, movement_words

EMPIRICAL = "empirical"
"""Status of a curve without a form."""


@checked
def draw_fragility(curves: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw fragility curves with their confidence bands.

    Parameters
    ----------
    curves : xarray.Dataset
        As ``damagepred.fit_fragility`` returns it: ``probability`` with ``_lower`` and ``_upper`` on
        (category, intensity), ``median``, ``dispersion`` and ``fit_status`` on (category,); ``empirical``, if it is
        there, is drawn as steps. An intensity in metres is shown in mm, one without unit as 1/n. On an axis of the
        ground's surface movement the classes of sites are marked.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Returns
    -------
    Axes
        Its legend names each category with median and dispersion, or why it has no curve.

    Raises
    ------
    InputError
        If the dataset holds no fragility curves.

    Examples
    --------
    >>> import damagepred
    >>> curves = damagepred.fit_fragility(damagepred.open_study("house.dp"), bootstrap=20)
    >>> ax = damagepred.plotting.draw_fragility(curves)
    >>> ax.get_xlabel()
    'central deflection (mm)'
    """
    require(
        curves,
        ("probability", "probability_lower", "probability_upper", "median", "dispersion", "fit_status", "intensity"),
        "fragility curves as `damagepred.fit_fragility` returns them",
    )
    ax = axes_or_new(ax, 9.0, 6.0)
    in_metres = curves["intensity"].attrs.get("units") == "m"
    scale = MM if in_metres else 1.0
    x = curves["intensity"].values * scale
    handles: list[Line2D] = []
    for number, category in enumerate(curves["category"].values):
        one = curves.isel(category=number)
        colour = CATEGORY_COLOURS[int(category) % len(CATEGORY_COLOURS)]
        style = CURVE_STYLES[number % len(CURVE_STYLES)]
        status = str(one["fit_status"].item())
        if "empirical" in one and status != EMPIRICAL:
            _draw_shares(ax, curves, one["empirical"].values, scale, colour)
        name = f"category {int(category)} ({_name(curves, number)})"
        if status not in (*WITH_CURVE, EMPIRICAL):
            mark: dict[str, Any] = (
                {"marker": "o", "linestyle": "none", "markersize": 4} if "movements" in curves.attrs else {}
            )
            handles.append(Line2D([], [], color=colour, linewidth=0.9, label=f"{name}: no curve, {status}", **mark))
            continue
        between = status == EMPIRICAL and "movements" in curves.attrs
        steps = status == EMPIRICAL and not between
        # a form is not given, and what is known is known at the increments: straight between them
        at = _at_increments(curves) if between else slice(None)
        lower, upper = one["probability_lower"].values[at], one["probability_upper"].values[at]
        ax.fill_between(
            x[at], lower, upper, color=colour, alpha=0.18, linewidth=0, zorder=1, step="post" if steps else None
        )
        if "probability_failed_undamaged" in one:
            least, most = (one[f"probability_failed_{end}"].values for end in ("undamaged", "damaged"))
            ax.fill_between(
                x, least, most, facecolor="none", edgecolor=colour, hatch="////", linewidth=0, alpha=0.5, zorder=2
            )
        handles += ax.plot(
            x[at],
            one["probability"].values[at],
            color=colour,
            linestyle=style,
            linewidth=2.0,
            zorder=4,
            drawstyle="steps-post" if steps else "default",
            label=f"{name}: {_parameters(one, float(x[-1]), scale, in_metres)}",
        )
    ax.set_xlim(float(x[0]), float(x[-1]))
    ax.set_ylim(0.0, 1.0)
    grid(ax)
    label_intensity(ax, curves, in_metres)
    ax.set_ylabel("probability of the category or worse (1)")
    legend_below(ax, handles, 1, 0.6, left=True)
    set_title(ax, *_title(curves))
    return ax


def _at_increments(curves: xr.Dataset) -> IntArray:
    """Return the first points of curves at or beyond the movements of the increments."""
    x = curves["intensity"].values
    return np.minimum(np.searchsorted(x, curves.attrs["movements"] - 1e-9 * x[-1]), len(x) - 1)


def _draw_shares(ax: Axes, curves: xr.Dataset, share: FloatArray, scale: float, colour: str) -> None:
    """Draw shares of walls: as points at the increments, where all walls have the same, otherwise as steps."""
    x = curves["intensity"].values * scale
    if "movements" not in curves.attrs:
        ax.plot(x, share, color=colour, linewidth=0.9, alpha=0.7, drawstyle="steps-post", zorder=3)
        return
    shown = share[_at_increments(curves)]
    style: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 4, "zorder": 3}
    ax.plot(curves.attrs["movements"] * scale, shown, color=colour, alpha=0.7, **style)


def _name(curves: xr.Dataset, number: int) -> str:
    if "category_name" in curves.variables:
        return verbatim(str(curves["category_name"].values[number]).replace("_", " "))
    return flag_name(curves, int(curves["category"].values[number]))


_OTHER_UNITS = {"m-1": "1/m", "year": "years"}
"""Units of movements that are neither lengths nor ratios, as they are shown."""


def _parameters(one: xr.Dataset, largest: float, scale: float, in_metres: bool) -> str:
    beyond = str(one["fit_status"].item()) == EXTRAPOLATED
    median = (median_lower_bound(one) if beyond else float(one["median"])) * scale
    if not np.isfinite(median):
        return "fewer than half of the walls reached it"
    unit = _OTHER_UNITS.get(str(one["intensity"].attrs.get("units")))
    shown = f"{median:.3g} {unit}" if unit else f"{plain_number(median)} mm" if in_metres else ratio(median)
    if beyond or median > largest:
        return f"median beyond {plain_number(largest) + ' mm' if in_metres else shown}, to which walls were moved"
    scatter = float(one["dispersion"])
    return f"median {shown}" + (f", dispersion {scatter:.2f}" if np.isfinite(scatter) else "")


def mark_site_classes(ax: Axes) -> None:
    """Mark the largest surface movement of each class of sites (AS 2870) on an axis of y_s in mm."""
    low, high = ax.get_xlim()
    for site in site_classes():
        left, right = max(site.above * MM, low), min(site.up_to * MM, high)
        if left >= right:
            continue
        if right < high:
            ax.axvline(right, color="0.45", linewidth=0.8, linestyle=":", zorder=2)
        # below the frame's top, where curves that matter seldom are
        ax.annotate(
            site.name,
            ((left + right) / 2.0, 0.985),
            xycoords=("data", "axes fraction"),
            ha="center",
            va="top",
            fontsize=small(ax),
            color="0.35",
        )


def label_intensity(ax: Axes, curves: xr.Dataset, in_metres: bool) -> None:
    """Name the horizontal axis after the intensity of curves or a surface, with marks 1/n on one of ratios."""
    of = curves["intensity"].attrs
    known = "intensity_measure" in curves.attrs
    name = movement_words(curves) if known else str(of.get("long_name", "movement of the ground"))
    if unit := _OTHER_UNITS.get(str(curves["intensity"].attrs.get("units"))):
        ax.set_xlabel(f"{name} ({unit})")
        return
    if in_metres:
        label_movement(ax, name)
        if name == OF_SITE:
            mark_site_classes(ax)
        return
    ax.set_xlabel(f"{name} (1)")
    largest = ax.get_xlim()[1]
    marks = [0.0]
    for mark in 1.0 / round_numbers(6)[::-1]:
        if mark <= largest * (1 + 1e-9) and mark - marks[-1] >= 0.1 * largest:
            marks.append(mark)
    ax.xaxis.set_major_locator(FixedLocator(marks))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: ratio(value)))


def _title(curves: xr.Dataset) -> tuple[str, str]:
    title = title_of(curves, "fragility curves")
    parts = []
    if "samples" in curves.attrs:
        failed = int(curves.attrs.get("samples_failed", 0))
        parts.append(f"{int(curves.attrs['samples'])} walls" + (f", {failed} of them failed" if failed else ""))
    if np.isfinite(curves["probability_lower"].values).any():
        confidence = curves.attrs.get("confidence")
        parts.append("band: " + (f"{float(confidence):.0%} confidence" if confidence else "confidence"))
    if curves.attrs.get("model") == "common":
        parts.append("one dispersion for all categories")
    if "probability_failed_undamaged" in curves:
        parts.append("hatched: all failed walls undamaged, or damaged")
    if "empirical" in curves:
        what = "points" if "movements" in curves.attrs else "steps"
        parts.append(f"{what}: shares of the walls, no form given")
    return title[:1].upper() + title[1:], "; ".join(parts)
