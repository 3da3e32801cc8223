"""Fragility curves and surfaces: probability of a category of damage or worse against the movement."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter

from damagepred.archive.schema import flag_name, require
from damagepred.arrays import IntArray
from damagepred.damage import construction_limits
from damagepred.formatting import counted, ratio
from damagepred.inputs.arguments import checked
from damagepred.plotting import sheet
from damagepred.plotting.colours import CATEGORY_COLOURS, CURVE_STYLES
from damagepred.results.house import is_house, noun
from damagepred.results.tables import DOUBTFUL
from damagepred.scene.site import site_classes
from damagepred.uq.fragility.describe import median_lower_bound
from damagepred.uq.fragility.fit import WITH_CURVE
from damagepred.uq.intensity import OF_SITE, movement_words

EMPIRICAL = "empirical"  # status of a curve without a form
DIMMED = 0.35  # opacity of curves whose fit is doubtful
LEVELS, LINES = np.linspace(0.0, 1.0, 11), (0.1, 0.5, 0.9)
"""Limits of the bands of colour of a surface, and probabilities with a line."""

_POINTS: dict[str, Any] = {"marker": "o", "linestyle": "none", "markersize": 4}
_PALE: dict[str, Any] = {"alpha": 0.7, "zorder": 3}
_SECOND = {"Pa": (1e-6, "MPa"), "m": (1.0, "m"), "Pa m-1": (1e-9, "GPa/m"), "Pa/m": (1e-9, "GPa/m"), "1": (1.0, "")}
_CURVES = ("probability", "probability_lower", "probability_upper", "median", "dispersion", "fit_status", "intensity")
_SURFACE = ("probability", "median", "median_lower", "median_upper", "second", "intensity")


@checked
def draw_fragility(
    curves: xr.Dataset, ax: Axes | None = None, marks: Mapping[str, tuple[float, float]] | None = None
) -> Axes:
    """Draw fragility curves with their confidence bands, or a fragility surface with the band of its median.

    Parameters
    ----------
    curves : xarray.Dataset
        Result of ``damagepred.fit_fragility`` or ``damagepred.fit_surface``. A movement in metres is drawn in mm, one
        without unit as 1/n. On an axis of the ground's surface movement the site classes are marked, on an axis of the
        central deflection the limits of codes for the length of the wall.
    ax : Axes, optional
        Axes to draw on; by default on a new figure.
    marks : mapping of str to (float, float), optional
        Ranges of the movement (SI) to shade, such as a site's, by their name in the legend.

    Returns
    -------
    Axes
        The legend names each category with median and dispersion, or the reason why it has no curve. Curves whose fit
        is doubtful are pale.

    Examples
    --------
    >>> import damagepred
    >>> study = damagepred.open_study("house.dp")
    >>> damagepred.plotting.draw_fragility(damagepred.fit_fragility(study, bootstrap=20)).get_xlabel()
    'central deflection (mm)'
    >>> surface = damagepred.fit_surface(study, 2, "joint.friction", bootstrap=20)
    >>> damagepred.plotting.draw_fragility(surface).get_ylabel()
    'joint, friction'
    """
    if "second" in curves.dims:
        return _draw_surface(curves, ax)
    require(curves, _CURVES, "fragility curves of `damagepred.fit_fragility`")
    ax = sheet.axes_or_new(ax, 9.0, 6.0)
    in_metres = curves["intensity"].attrs.get("units") == "m"
    scale = sheet.MM if in_metres else 1.0
    x = curves["intensity"].values * scale
    handles: list[Artist] = []
    for number, category in enumerate(curves["category"].values):
        curve = curves.isel(category=number)
        colour = CATEGORY_COLOURS[int(category) % len(CATEGORY_COLOURS)]
        style = CURVE_STYLES[number % len(CURVE_STYLES)]
        status = str(curve["fit_status"].item())
        if "empirical" in curve and status != EMPIRICAL:  # shares of walls
            share, pale = curve["empirical"].values, {**_PALE, "color": colour}
            if "movements" in curves.attrs:  # all walls have the same increments
                ax.plot(curves.attrs["movements"] * scale, share[_at_increments(curves)], **pale, **_POINTS)
            else:
                ax.plot(x, share, linewidth=0.9, drawstyle="steps-post", **pale)
        name = f"category {int(category)} ({_name(curves, number)})"
        if status not in (*WITH_CURVE, EMPIRICAL):
            mark: dict[str, Any] = _POINTS if "movements" in curves.attrs else {}
            handles.append(Line2D([], [], color=colour, linewidth=0.9, label=f"{name}: no curve, {status}", **mark))
            continue
        between = status == EMPIRICAL and "movements" in curves.attrs
        steps = status == EMPIRICAL and not between
        # without a form the shares are known at the increments alone: linear between them
        points = _at_increments(curves) if between else slice(None)
        lower, upper = curve["probability_lower"].values[points], curve["probability_upper"].values[points]
        band: dict[str, Any] = {"color": colour, "alpha": 0.18, "linewidth": 0, "step": "post" if steps else None}
        ax.fill_between(x[points], lower, upper, zorder=1, **band)
        if "probability_failed_undamaged" in curve:
            least, most = (curve[f"probability_failed_{end}"].values for end in ("undamaged", "damaged"))
            hatched: dict[str, Any] = {"facecolor": "none", "edgecolor": colour, "hatch": "////", "linewidth": 0}
            ax.fill_between(x, least, most, alpha=0.5, zorder=2, **hatched)
        doubtful = "p_value" in curve and float(curve["p_value"]) < DOUBTFUL
        line: dict[str, Any] = {"color": colour, "linestyle": style, "linewidth": 2.0, "zorder": 4}
        line |= {"alpha": DIMMED if doubtful else 1.0, "drawstyle": "steps-post" if steps else "default"}
        words = f"{_parameters(curve, float(x[-1]), scale, in_metres)}{'; doubtful fit' * doubtful}"
        handles += ax.plot(x[points], curve["probability"].values[points], label=f"{name}: {words}", **line)
    ax.set_xlim(float(x[0]), float(x[-1]))
    ax.set_ylim(0.0, 1.0)
    sheet.grid(ax)
    label_intensity(ax, curves, in_metres)
    ax.set_ylabel("probability of the category or worse")
    for name, (low, high) in (marks or {}).items():
        if high > low:
            handles.append(ax.axvspan(scale * low, scale * high, color="0.5", alpha=0.18, linewidth=0, label=name))
        else:
            handles.append(ax.axvline(scale * low, color="black", linewidth=1.2, zorder=2.5, label=name))
    sheet.legend_below(ax, handles, 1, 0.6, left=True)
    sheet.set_title(ax, *_title(curves))
    return ax


def _at_increments(curves: xr.Dataset) -> IntArray:
    """First points of curves at or beyond the movements of the increments."""
    x = curves["intensity"].values
    return np.minimum(np.searchsorted(x, curves.attrs["movements"] - 1e-9 * x[-1]), len(x) - 1)


def _name(curves: xr.Dataset, number: int) -> str:
    if "category_name" in curves.variables:
        return sheet.verbatim(str(curves["category_name"].values[number]).replace("_", " "))
    return flag_name(curves, int(curves["category"].values[number]))


_LIMIT: dict[str, Any] = {"color": "0.45", "linewidth": 0.8, "linestyle": ":", "zorder": 2}
_OTHER_UNITS = {"m-1": "1/m", "year": "years"}
"""Units of movements that are neither lengths nor ratios."""


def _parameters(curve: xr.Dataset, largest: float, scale: float, in_metres: bool) -> str:
    """Median and dispersion in words; of a median beyond the walls' movements its lower bound."""
    unit = _OTHER_UNITS.get(str(curve["intensity"].attrs.get("units")))

    def shown(value: float) -> str:
        return f"{value:.3g} {unit}" if unit else f"{sheet.plain_number(value)} mm" if in_metres else ratio(value)

    bound, median = median_lower_bound(curve) * scale, float(curve["median"]) * scale
    if np.isfinite(bound) or median > largest:
        return f"median beyond {shown(bound if np.isfinite(bound) else largest)}, to which walls were moved"
    if not np.isfinite(median):
        return "fewer than half of the samples reached it"
    scatter = float(curve["dispersion"])
    return f"median {shown(median)}" + (f", dispersion {scatter:.2f}" if np.isfinite(scatter) else "")


def _mark_limits(ax: Axes, span: float) -> None:
    """Mark the deflections (mm) of AS 2870 Table 4.1: the lesser of a share of the length and an absolute limit."""
    low, high = ax.get_xlim()
    written = -np.inf
    for limit in sorted(construction_limits().values(), key=lambda limit: limit.value(span, span)):
        deflection = span * limit.value(span, span) * sheet.MM  # the limits do not depend on the height
        if not low < deflection < high:
            continue
        ax.axvline(deflection, **_LIMIT)
        if deflection - written > 0.03 * (high - low):
            by_length = np.isclose(deflection, span / limit.one_in[0] * sheet.MM)
            text = f"L/{limit.one_in[0]:.0f}" if by_length else f"{deflection:.0f} mm"
            _write_at_top(ax, deflection, text, ha="right", rotation=90)
            written = deflection


def _write_at_top(ax: Axes, x: float, words: str, **style: Any) -> None:
    """Write below the frame's top, on white above the curves."""
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.0}
    place: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "va": "top", "color": "0.35", "zorder": 4}
    ax.annotate(words, (x, 0.985), fontsize=sheet.small(ax), bbox=box, **place, **style)


def _mark_site_classes(ax: Axes) -> None:
    """Mark the largest surface movement of each class of sites (AS 2870) on an axis of y_s in mm."""
    low, high = ax.get_xlim()
    for site in site_classes():
        left, right = max(site.above * sheet.MM, low), min(site.up_to * sheet.MM, high)
        if left >= right:
            continue
        if right < high:
            ax.axvline(right, **_LIMIT)
        _write_at_top(ax, (left + right) / 2.0, site.name, ha="center")


def label_intensity(ax: Axes, curves: xr.Dataset, in_metres: bool) -> None:
    """Label the horizontal axis with the intensity of curves or a surface; deflection ratios have marks 1/n."""
    attributes = curves["intensity"].attrs
    name = str(attributes.get("long_name", "movement of the ground"))
    if "intensity_measure" in curves.attrs:
        name = movement_words(curves)
    if unit := _OTHER_UNITS.get(str(attributes.get("units"))):
        ax.set_xlabel(f"{name} ({unit})")
        return
    if in_metres:
        sheet.label_movement(ax, name)
        if name == OF_SITE:
            _mark_site_classes(ax)
        if curves.attrs.get("intensity_measure") == "central_deflection" and "span" in curves.attrs:
            _mark_limits(ax, float(curves.attrs["span"]))
        return
    ax.set_xlabel(name)
    largest = ax.get_xlim()[1]
    marks = [0.0]
    for mark in 1.0 / np.outer(10.0 ** np.arange(6), sheet.ROUND).ravel()[::-1]:
        if mark <= largest * (1 + 1e-9) and mark - marks[-1] >= 0.1 * largest:
            marks.append(mark)
    ax.xaxis.set_major_locator(FixedLocator(marks))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: ratio(value)))


def _title(curves: xr.Dataset) -> tuple[str, str]:
    title = sheet.title_of(curves, "fragility curves")
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
    return title[:1].upper() + title[1:], counted("; ".join(parts), is_house(curves))


def _draw_surface(surface: xr.Dataset, ax: Axes | None) -> Axes:
    """Draw a surface: movement across, second variable upwards, probability in colours."""
    require(surface, _SURFACE, "a fragility surface of `damagepred.fit_surface`")
    ax = sheet.axes_or_new(ax, 8.5, 6.0)
    in_metres = surface["intensity"].attrs.get("units") == "m"
    scale = sheet.MM if in_metres else 1.0
    units = str(surface["second"].attrs.get("units", "1"))
    factor, unit = _SECOND.get(units, (1.0, units))
    x, y = scale * surface["intensity"].values, factor * surface["second"].values
    name = sheet.verbatim(str(surface.attrs["category_name"]).replace("_", " "))
    category = f"category {int(surface.attrs['category'])} ({name})"
    second, said = str(surface.attrs["second_variable"]).replace("_", " ").replace(".", ", "), ""
    if str(surface["fit_status"].item()) not in WITH_CURVE:
        ax.set_xticks([])
        ax.set_yticks([])
        words: dict[str, Any] = {"transform": ax.transAxes, "ha": "center", "va": "center", "wrap": True}
        ax.text(0.5, 0.5, f"no surface: {surface['fit_status'].item()}", fontsize=1.2 * sheet.text_size(ax), **words)
    else:
        filled = ax.contourf(x, y, surface["probability"].values, LEVELS, cmap="YlOrRd", zorder=1)
        ax.contour(x, y, surface["probability"].values, LINES, colors="black", linewidths=[0.8, 1.6, 0.8], zorder=3)
        bar = sheet.figure_of(ax).colorbar(filled, ax=ax, ticks=LEVELS)
        bar.set_label("probability of the category or worse")
        handles = [
            Line2D([], [], color="black", linewidth=1.6, label="probability 0.5"),
            Line2D([], [], color="black", linewidth=0.8, label="0.1 and 0.9"),
        ]
        if np.isfinite(surface["median_lower"].values).all():
            dashed: dict[str, Any] = {"color": "black", "linestyle": "--", "linewidth": 1.0}
            for end in ("lower", "upper"):
                ax.plot(scale * surface[f"median_{end}"].values, y, zorder=3, **dashed)
            label = f"{float(surface.attrs['confidence']):.0%} band of the median"
            handles.append(Line2D([], [], label=label, **dashed))
        ax.set_xlim(x[0], x[-1])
        ax.set_ylim(y[0], y[-1])
        label_intensity(ax, surface, in_metres)
        ax.set_ylabel(f"{second} ({unit})" if unit else second)
        sheet.legend_below(ax, handles, 3, 0.6, left=True)
        slope, low, high = (float(surface[f"slope{end}"]) for end in ("", "_lower", "_upper"))
        band = f" ({low:.2f} to {high:.2f})" if np.isfinite(low) else ""
        said = f"; median goes with its power {slope:.2f}{band}; dispersion "
        if surface.attrs.get("scale") != "log":
            said = f"; ln(median) changes by {slope:.3g} per unit; dispersion "
        said += f"{float(surface['dispersion']):.2f}, {float(surface['dispersion_alone']):.2f} without it"
    title = sheet.title_of(surface, "fragility surface")
    failed = int(surface.attrs.get("samples_failed", 0))
    walls = f"{int(surface.attrs['samples'])} {noun(surface)}s" + (f", {failed} of them failed" if failed else "")
    sheet.set_title(ax, title[:1].upper() + title[1:], f"{category} or worse; {walls}{said}")
    return ax
