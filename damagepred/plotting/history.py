"""Widest crack and dpc opening as the ground moves."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from damagepred.archive.schema import is_dynamic
from damagepred.damage.cracks import HAIRLINE
from damagepred.enumerations import ContactKind
from damagepred.inputs.arguments import checked
from damagepred.plotting.categories import not_reached, shade_bands, table_of, width_scale
from damagepred.plotting.colours import CATEGORY_COLOURS, DPC_COLOUR, FOOTING_GAP_COLOUR
from damagepred.plotting.sheet import (
    KN,
    MM,
    axes_or_new,
    grid,
    label_movement,
    legend_below,
    plain_number,
    require,
    set_title,
    title_of,
)
from damagepred.results.rejudge import shown_gaps
from damagepred.uq.intensity import movement_measure, movement_words


@checked
def draw_history(ds: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw widest crack, crack band, dpc opening and gap on the footing against the movement, over the categories.

    On a mound they are drawn against the movement of the ground's surface, of a run in time against the time,
    of a movement in stages against its time, or else the increment, with the widest crack so far.

    The marks on the crack's line have the colour of the wall's category, which may be higher than the crack's own
    where a group of cracks counts. The axis is linear up to the first category's limit and logarithmic above.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall, as ``damagepred.solve`` returns it.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Raises
    ------
    InputError
        If the dataset is not of one wall.

    Examples
    --------
    >>> import damagepred, xarray
    >>> ax = damagepred.plotting.draw_history(xarray.open_dataset("wall.nc"))
    >>> ax.get_xlabel()
    'central deflection (mm)'
    """
    require(
        ds,
        ("crack_width_max", "dpc_opening_max", "central_deflection", "damage_category"),
        "the result of one wall (`damagepred solve`)",
    )
    ax = axes_or_new(ax, 8.5, 5.0)
    table = table_of(ds)
    in_time = is_dynamic(ds)
    measure = movement_measure(ds)
    x = ds["time"].values if in_time else ds[measure].values * MM
    in_stages = "crack_width_worst" in ds.variables
    if in_stages:
        by = "time" if "time" in ds.variables else "increment"
        x = ds[by].values
    crack, dpc = ds["crack_width_max"].values * MM, ds["dpc_opening_max"].values * MM
    has_dpc = "contact_kind" not in ds.variables or bool((ds["contact_kind"].values == ContactKind.DPC).any())
    band = ds["crack_band_width_max"].values * MM if "crack_band_width_max" in ds.variables else crack
    has_footing = "contact_kind" in ds.variables and "footing" in shown_gaps(ds)
    footing = ds["footing_opening_max"].values * MM if has_footing else np.zeros_like(x)
    base = ds["base_crack_width_max"].values * MM if "base_crack_width_max" in ds.variables else np.zeros_like(x)
    category = ds["damage_category"].values
    colours = [CATEGORY_COLOURS[max(int(c), 0)] for c in category]
    above = " above the dpc" if has_dpc else ""
    ax.plot(x, crack, color="black", linewidth=1.6, zorder=4, label=f"widest crack{above}")
    ax.scatter(x, crack, c=colours, edgecolors="black", s=32, zorder=5, clip_on=False)
    visible = HAIRLINE * MM
    marked: dict[str, Any] = {"linewidth": 1.6, "linestyle": "--", "markersize": 4, "zorder": 4}
    thin: dict[str, Any] = {"linewidth": 1.2, "zorder": 3}
    drawn = [crack]
    if in_stages:
        ax.plot(x, ds["crack_width_worst"].values * MM, label="widest so far", color="0.55", **thin)
        for last in np.flatnonzero(np.diff(ds["progress"].values[:-1]) * np.diff(ds["progress"].values[1:]) < 0) + 1:
            ax.axvline(x[last], color="0.6", linewidth=0.8, linestyle=":")
    for width, shown, style, label in (
        (dpc, has_dpc, marked | {"color": DPC_COLOUR, "marker": "s"}, "widest dpc opening"),
        (band, (band > crack + visible).any(), thin | {"color": "black", "linestyle": "-."}, "widest crack band"),
        (
            footing,
            footing.max(initial=0.0) > visible,
            marked | {"color": FOOTING_GAP_COLOUR, "marker": "^"},
            "widest gap on the footing",
        ),
        (
            base,
            base.max(initial=0.0) > visible,
            thin | {"color": "0.35", "linestyle": ":"},
            "widest crack below the dpc",
        ),
    ):
        if shown:
            ax.plot(x, width, label=label, **style)
            drawn.append(width)
    width_scale(ax, np.concatenate(drawn), table, "width")
    ax.set_xlim(0.0, max(float(x.max()) * 1.02, 1e-6))
    shade_bands(ax, table)
    if in_time:
        ax.set_xlabel("time (s)")
    elif in_stages:
        ax.set_xlabel(f"{'time (years)' if by == 'time' else by}; dotted: the movement turns")
    else:
        label_movement(ax, movement_words(ds))
    legend_below(ax, ax.get_legend_handles_labels()[0])
    set_title(
        ax,
        title_of(ds, "wall"),
        f"bands: crack widths by {table.name}; marks on the black line: the wall's category"
        + not_reached(ds, int(category.max())),
    )
    return ax


@checked
def draw_hysteresis(ds: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the dpc opening, or without a dpc the widest crack, over a movement that goes there and back.

    Negative movements are on the other side than ``kind``. Years go from dark to light.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall whose movement has stages.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Raises
    ------
    InputError
        If the dataset is not of one wall with stages.

    Examples
    --------
    >>> import damagepred
    >>> from damagepred import Movement, Scene, Wall, scene
    >>> seasons = scene.Seasons(years=1, swing="4 mm", increments=1)
    >>> wall = Scene(wall=Wall(length=1.44, height=0.6), movement=Movement(seasons=seasons))
    >>> damagepred.plotting.draw_hysteresis(damagepred.solve(wall)).get_xlabel()
    'central deflection, signed (mm)'
    """
    require(ds, ("stage", "crack_width_worst"), "the result of one wall whose movement has stages")
    ax = axes_or_new(ax, 7.0, 5.0)
    measure = movement_measure(ds)
    in_test = measure == "load_displacement"  # has a sign of its own
    x = (1.0 if in_test else np.sign(ds["progress"].values)) * ds[measure].values * MM
    has_dpc = "contact_kind" in ds.variables and bool((ds["contact_kind"].values == ContactKind.DPC).any())
    name, said = ("dpc_opening_max", "widest dpc opening") if has_dpc else ("crack_width_max", "widest crack")
    y = ds[name].values * MM
    ax.plot(x, y, color="0.6", linewidth=0.9)
    by = "time" if "time" in ds.variables else "increment"
    points = ax.scatter(x, y, c=ds[by].values, s=16, zorder=3)
    ax.figure.colorbar(points, ax=ax, label="time (years)" if by == "time" else by)
    ax.axvline(0.0, color="0.5", linewidth=0.8, linestyle=":")
    ax.set_xlabel(f"{movement_words(ds)}, signed (mm)")
    ax.set_ylabel(f"{said} (mm)")
    set_title(ax, title_of(ds, "wall"), f"dotted: {'no displacement' if in_test else 'level ground'}")
    return ax


@checked
def draw_load(ds: xr.Dataset, ax: Axes | None = None, against: str | None = None, label: str | None = None) -> Axes:
    """Draw the load of a laboratory test against its displacement, or the opening of the gauge.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall under ``[[load]]``, as ``damagepred.solve`` returns it.
    ax : Axes, optional
        Where to draw; by default on a new figure.
    against : {"load_displacement", "gauge_opening"}, optional
        What the horizontal axis is; by default the gauge, where there is one.
    label : str, optional
        Of the curve, to tell several walls on the same axes apart.

    Raises
    ------
    InputError
        If the dataset is not of a laboratory test, or has no gauge that is asked for.

    Examples
    --------
    >>> import damagepred
    >>> from damagepred import Movement, Scene, Wall, scene
    >>> pier = Scene(
    ...     wall=Wall(length=0.48, height=0.6),
    ...     movement=Movement(shape="loads", increments=2),
    ...     load=(scene.Load(direction="along"),),
    ...     loading=scene.Loading(control="force", force="1 kN"),
    ... )
    >>> damagepred.plotting.draw_load(damagepred.solve(pier)).get_xlabel()
    'load displacement (mm)'
    """
    by = against or ("gauge_opening" if "gauge_opening" in ds.variables else "load_displacement")
    require(ds, ("load_force", by), "the result of one laboratory test (`[[load]]`)")
    first = ax is None or not ax.lines
    ax = axes_or_new(ax, 7.0, 4.5)
    load, x = ds["load_force"].values * KN, ds[by].values * MM
    still = np.isfinite(load)  # a wall in motion has no load
    ax.plot(x[still], load[still], linewidth=1.5, marker=".", markersize=4, label=label)
    if first:
        label_movement(ax, movement_words(ds, by))
        ax.set_ylabel("load (kN)")
        grid(ax)
        peak = "" if label else f"largest load {plain_number(float(load[still].max()))} kN"
        set_title(ax, title_of(ds, "wall"), peak)
    if label:
        legend_below(ax, ax.get_legend_handles_labels()[0], 3)
    return ax
