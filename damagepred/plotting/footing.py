"""The footing as a structure: load of the jacks, form, moment and curvature along it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from damagepred.arrays import FloatArray
from damagepred.enumerations import ContactKind
from damagepred.inputs.arguments import checked
from damagepred.plotting.colours import JACK_COLOUR, SOIL_COLOUR, SUPPORT_COLOUR, movement_bar
from damagepred.plotting.geometry import footing_blocks, footing_rise, ground_profile, settlement
from damagepred.plotting.sheet import (
    KN,
    MM,
    axes_or_new,
    grid,
    legend_below,
    plain_number,
    require,
    set_title,
    several_or_new,
    small,
    spread_evenly,
    title_of,
)
from damagepred.uq.intensity import movement_measure, movement_words

MOST_LINES = 8
"""Increments drawn at most."""
_ON_JACKS = "the result of one wall whose footing is on jacks (`movement.shape = 'jacks'`)"
_ON_A_FOOTING = "the result of one wall on a footing that finds its own form (`movement.shape = 'jacks'` or 'mound')"


def has_footing(ds: xr.Dataset) -> bool:
    """Whether the sections of a footing are stored."""
    return "section_moment" in ds.variables


@checked
def draw_jack_load(
    ds: xr.Dataset, ax: Axes | None = None, label: str | None = None, colour: str = JACK_COLOUR, supports: bool = True
) -> Axes:
    """Draw the load of each jack, and of the supports, against the central deflection.

    Where the jacks (dishing) or the least loaded support (doming) carry nothing any more, the curve is marked: in a
    rig that cannot pull, the footing cannot be taken further.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall on jacks, as ``damagepred.solve`` returns it.
    ax : Axes, optional
        Where to draw; by default on a new figure.
    label : str, optional
        Of the curve, to tell several walls on the same axes apart.
    colour : str
        Of the jacks' curve.
    supports : bool
        Whether the least loaded support is drawn, too.

    Raises
    ------
    InputError
        If the dataset is not of a wall on jacks.

    Examples
    --------
    >>> import damagepred, xarray
    >>> ax = damagepred.plotting.draw_jack_load(xarray.open_dataset("jacks.nc"))
    >>> ax.get_xlabel()
    'central deflection (mm)'
    """
    require(ds, ("jack_load", "support_load", "central_deflection"), _ON_JACKS)
    first = ax is None or not ax.lines
    ax = axes_or_new(ax, 8.0, 5.0)
    if first:
        ax.axhline(0.0, color="black", linewidth=0.8)
        ax.set_xlabel("central deflection (mm)")
        ax.set_ylabel("load, upwards positive (kN)")
        grid(ax)
    x = ds["central_deflection"].values * MM
    curves = [(ds["jack_load"].values, "each jack", "-", colour)]
    if supports:
        least = ds["support_load"].values.min(axis=1)
        curves.append((least, "least loaded support", "--", colour if label else SUPPORT_COLOUR))
    for load, what, dashes, shade in curves:
        name = f"{label}: {what}" if label else what
        ax.plot(x, load * KN, color=shade, linestyle=dashes, linewidth=1.5, marker=".", markersize=4, label=name)
    limit = idle_at(ds)
    if limit is not None:
        style: dict[str, Any] = {"markersize": 7, "markerfacecolor": "white", "markeredgecolor": colour, "zorder": 5}
        ax.plot([limit * MM], [0.0], marker="o", linestyle="none", label="_limit", **style)
        marks = np.array([np.asarray(line.get_xdata())[0] for line in ax.lines if line.get_label() == "_limit"])
        above = 11 * int((np.abs(marks - limit * MM) < 0.08 * x.max()).sum()) - 6  # its own among them
        at = limit * MM, 0.0
        words: dict[str, Any] = {"textcoords": "offset points", "fontsize": small(ax), "color": colour}
        ax.annotate(f"{plain_number(limit * MM)} mm", at, (4, above), **words)
    if first:
        set_title(ax, title_of(ds, "wall"), "circle: jacks or a support carry nothing any more")
    ax.set_xlim(0.0, max(1.1 * float(x.max()), 1e-6, 0.0 if first else ax.get_xlim()[1]))
    legend_below(ax, ax.get_legend_handles_labels()[0], 3)
    return ax


def idle_at(ds: xr.Dataset) -> float | None:
    """Return the deflection (m) at which the jacks, or a support, first carry nothing; None if they always do.

    Straight between increments.
    """
    if "limit_deflection" in ds.attrs:
        return float(ds.attrs["limit_deflection"])
    x = ds["central_deflection"].values
    found = [first_zero(x, load) for load in (ds["jack_load"].values, ds["support_load"].values.min(axis=1))]
    return min((at for at in found if at is not None), default=None)


def first_zero(x: FloatArray, y: FloatArray) -> float | None:
    """Return where y, positive to begin with and straight between, first falls to zero; None if it does not."""
    below = np.flatnonzero(y <= 1e-9 * np.abs(y).max(initial=0.0))
    if not below.size or below[0] == 0:
        return None
    after = int(below[0])
    share = y[after - 1] / (y[after - 1] - y[after])
    return float(x[after - 1] + share * (x[after] - x[after - 1]))


@checked
def draw_footing_form(ds: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw how far the footing has gone up along the wall, increment by increment, and the ground's surface at the end.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall whose footing finds its own form.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Raises
    ------
    InputError
        If the dataset is not of such a wall.

    Examples
    --------
    >>> import damagepred, xarray
    >>> ax = damagepred.plotting.draw_footing_form(xarray.open_dataset("mound.nc"))
    >>> " ".join(ax.get_ylabel().split())
    'footing gone up from its level under dead load (mm)'
    """
    require(ds, ("section_moment",), _ON_A_FOOTING)
    chosen, datum = footing_blocks(ds), settlement(ds)
    level = datum or 0.0

    def form(increment: int) -> tuple[FloatArray, FloatArray]:
        x, rise = footing_rise(ds, increment, chosen)
        return x, (rise - level) * MM

    what = "footing gone up (mm)" if datum is None else "footing gone up from its\nlevel under dead load (mm)"
    ax = _along(ds, ax, what, form)
    x, _, rise = ground_profile(ds, ds.sizes["increment"] - 1, ContactKind.SOIL)
    if len(x):
        label = (
            f"ground at the end without the footing, which settled by {plain_number(-level * MM)} mm under dead load"
        )
        ax.plot(x, (rise - level) * MM, color=SOIL_COLOUR, linestyle="--", linewidth=1.4, label=label)
        ax.legend(fontsize=small(ax), frameon=False)
    return ax


@checked
def draw_footing_moment(ds: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the moment along the footing, sagging positive, increment by increment; see ``draw_footing_form``.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall whose footing finds its own form.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Examples
    --------
    >>> import damagepred, xarray
    >>> ax = damagepred.plotting.draw_footing_moment(xarray.open_dataset("mound.nc"))
    >>> ax.get_ylabel()
    'moment, sagging positive (kNm)'
    """
    require(ds, ("section_moment",), _ON_A_FOOTING)
    values = ds["section_moment"].values * KN
    return _along(ds, ax, "moment, sagging positive (kNm)", lambda i: (ds["section_x"].values, values[i]))


@checked
def draw_footing_curvature(ds: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the curvature along the footing, sagging positive, increment by increment; see ``draw_footing_form``.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall whose footing finds its own form.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Examples
    --------
    >>> import damagepred, xarray
    >>> ax = damagepred.plotting.draw_footing_curvature(xarray.open_dataset("mound.nc"))
    >>> ax.get_ylabel()
    'curvature, sagging positive (1/km)'
    """
    require(ds, ("section_curvature",), _ON_A_FOOTING)
    values = ds["section_curvature"].values * 1e3
    return _along(ds, ax, "curvature, sagging positive (1/km)", lambda i: (ds["section_x"].values, values[i]))


@checked
def draw_footing(ds: xr.Dataset, axes: Sequence[Axes] | None = None) -> list[Axes]:
    """Draw form, moment and curvature of a footing one under the other.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall whose footing finds its own form.
    axes : sequence of 3 Axes, optional
        Where to draw; by default on a new figure.

    Returns
    -------
    list of Axes
        Of form, moment and curvature.

    Raises
    ------
    InputError
        If the dataset is not of such a wall.

    Examples
    --------
    >>> import damagepred, xarray
    >>> axes = damagepred.plotting.draw_footing(xarray.open_dataset("mound.nc"))
    >>> len(axes)
    3
    """
    axes = several_or_new(axes, 3, 1, 9.0, 9.5, sharex=True)
    for ax, draw in zip(axes, (draw_footing_form, draw_footing_moment, draw_footing_curvature)):
        draw(ds, ax)
        ax.set_title("", loc="left")
    for ax in axes[:-1]:
        ax.set_xlabel("")
    set_title(axes[0], title_of(ds, "wall"), "form, moment and curvature of the footing")
    return axes


def _along(ds: xr.Dataset, ax: Axes | None, what: str, curve: Callable[[int], tuple[FloatArray, FloatArray]]) -> Axes:
    """Draw curves along the wall, some increments in the colour of their movement."""
    ax = axes_or_new(ax, 9.0, 4.0)
    values = ds[movement_measure(ds)].values * MM
    colour = movement_bar(ax, values, movement_words(ds))
    ax.axhline(0.0, color="black", linewidth=0.8)
    for step in spread_evenly(len(values), MOST_LINES):
        x, y = curve(int(step))
        ax.plot(x, y, color=colour(values[step]), linewidth=1.4)
    ax.set_xlim(float(ds["vertex_x"].min()), float(ds["vertex_x"].max()))
    ax.set_xlabel("along the wall (m)")
    ax.set_ylabel(what)
    grid(ax)
    set_title(ax, title_of(ds, "wall"))
    return ax
