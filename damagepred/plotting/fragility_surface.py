"""A fragility surface: probability of a category against the movement and a second variable."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from damagepred.inputs.arguments import checked
from damagepred.plotting.fragility import label_intensity
from damagepred.plotting.sheet import (
    MM,
    axes_or_new,
    figure_of,
    legend_below,
    require,
    say_nothing_to_draw,
    set_title,
    title_of,
    verbatim,
)
from damagepred.uq.fragility.fit import WITH_CURVE

LEVELS = np.linspace(0.0, 1.0, 11)
"""Limits of the bands of colour."""

LINES = (0.1, 0.5, 0.9)
"""Probabilities that have a line."""

_SHOWN = {"Pa": (1e-6, "MPa"), "m": (1.0, "m"), "Pa m-1": (1e-9, "GPa/m"), "Pa/m": (1e-9, "GPa/m")}


@checked
def draw_fragility_surface(surface: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw a fragility surface with the band of its median.

    Parameters
    ----------
    surface : xarray.Dataset
        As ``damagepred.uq.fragility.fit_surface`` returns it.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Returns
    -------
    Axes
        Movement across, the second variable upwards, the probability in colours.

    Raises
    ------
    InputError
        If the dataset holds no surface.

    Examples
    --------
    >>> import damagepred
    >>> surface = damagepred.fit_surface(damagepred.open_study("house.dp"), 2, "joint.friction", bootstrap=20)
    >>> ax = damagepred.plotting.draw_fragility_surface(surface)
    >>> ax.get_ylabel()
    'joint, friction (1)'
    """
    require(
        surface,
        ("probability", "median", "median_lower", "median_upper", "second", "intensity"),
        "a fragility surface as `damagepred.uq.fragility.fit_surface` returns it",
    )
    ax = axes_or_new(ax, 8.5, 6.0)
    in_metres = surface["intensity"].attrs.get("units") == "m"
    scale = MM if in_metres else 1.0
    factor, unit = _SHOWN.get(str(surface["second"].attrs.get("units", "1")), (1.0, ""))
    unit = unit or str(surface["second"].attrs.get("units", "1"))
    x, y = scale * surface["intensity"].values, factor * surface["second"].values
    category = (
        f"category {int(surface.attrs['category'])} ({verbatim(str(surface.attrs['category_name']).replace('_', ' '))})"
    )
    second = str(surface.attrs["second_variable"]).replace("_", " ").replace(".", ", ")
    if str(surface["fit_status"].item()) not in WITH_CURVE:
        say_nothing_to_draw(ax, f"no surface: {surface['fit_status'].item()}")
    else:
        filled = ax.contourf(x, y, surface["probability"].values, LEVELS, cmap="YlOrRd", zorder=1)
        ax.contour(x, y, surface["probability"].values, LINES, colors="black", linewidths=[0.8, 1.6, 0.8], zorder=3)
        bar = figure_of(ax).colorbar(filled, ax=ax, ticks=LEVELS)
        bar.set_label("probability of the category or worse (1)")
        handles = [
            Line2D([], [], color="black", linewidth=1.6, label="probability 0.5"),
            Line2D([], [], color="black", linewidth=0.8, label="0.1 and 0.9"),
        ]
        if np.isfinite(surface["median_lower"].values).all():
            dashed: dict[str, Any] = {"color": "black", "linestyle": "--", "linewidth": 1.0}
            for end in ("lower", "upper"):
                ax.plot(scale * surface[f"median_{end}"].values, y, zorder=3, **dashed)
            handles.append(
                Line2D([], [], label=f"{float(surface.attrs['confidence']):.0%} band of the median", **dashed)
            )
        ax.set_xlim(x[0], x[-1])
        ax.set_ylim(y[0], y[-1])
        label_intensity(ax, surface, in_metres)
        ax.set_ylabel(f"{second} ({unit})")
        legend_below(ax, handles, 3, 0.6, left=True)
    title = title_of(surface, "fragility surface")
    failed = int(surface.attrs.get("samples_failed", 0))
    walls = f"{int(surface.attrs['samples'])} walls" + (f", {failed} of them failed" if failed else "")
    set_title(ax, title[:1].upper() + title[1:], f"{category} or worse; {walls}{_explained(surface)}")
    return ax


def _explained(surface: xr.Dataset) -> str:
    """Slope of the median with the second variable, and the remaining dispersion, in words."""
    if str(surface["fit_status"].item()) not in WITH_CURVE:
        return ""
    slope, low, high = (float(surface[f"slope{end}"]) for end in ("", "_lower", "_upper"))
    band = f" ({low:.2f} to {high:.2f})" if np.isfinite(low) else ""
    scatter = f"dispersion {float(surface['dispersion']):.2f}, {float(surface['dispersion_alone']):.2f} without it"
    if surface.attrs.get("scale") == "log":
        return f"; median goes with its power {slope:.2f}{band}; {scatter}"
    return f"; ln(median) changes by {slope:.3g} a unit; {scatter}"
