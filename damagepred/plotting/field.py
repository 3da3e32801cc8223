"""Any variable of a wall: as a field on the deformed wall, along the footing, or over the movement."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, LinearSegmentedColormap, ListedColormap, Normalize, to_rgba_array
from matplotlib.patches import Patch
from matplotlib.tri import Triangulation

from damagepred.archive.schema import is_dynamic
from damagepred.arrays import FloatArray, IntArray
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError, nearest
from damagepred.inputs.arguments import checked
from damagepred.plotting import colours, geometry, sheet
from damagepred.plotting.geometry import Deformed
from damagepred.plotting.stress import STRESSES, check_stress, elastic_stress, one_of, stress_levels, stresses
from damagepred.plotting.study import draw_paths
from damagepred.uq.intensity import movement_measure, movement_words

MOST_LINES = 10  # increments drawn at most along a wall
BEDS = {"dpc": ContactKind.DPC, "footing": ContactKind.FOOTING_INTERFACE}  # beds whose opening along the wall is drawn
SHOWN_SHARE = 0.4
"""Widest opening over the threshold from which the threshold is drawn: a lower one would lie on the axis."""
_PLACES = ("block", "contact", "zone", "gridpoint")


@checked
def draw(
    ds: xr.Dataset,
    variable: str,
    ax: Axes | None = None,
    *,
    increment: int = -1,
    exaggeration: float | None = None,
    levels: Sequence[float] | FloatArray | None = None,
    against: str | None = None,
    label: str | None = None,
) -> Axes:
    """Draw any variable of a wall, or the paths of a study.

    Variables of blocks, contacts, zones and gridpoints are drawn in colours on the deformed wall. Variables of the
    footing's sections, ``footing_rise``, ``dpc_opening`` and ``footing_opening`` (of the bed between first course and
    footing) are drawn along the wall at some increments. All others are drawn over the movement, with years in colours
    where a movement has stages. A variable of a study has one line per wall, with quantiles. Numbers have the units mm,
    kN, MPa.

    A stress (MPa, tension positive and red) is drawn in filled contours: ``stress_xx`` along the wall, ``stress_yy``
    upright, ``stress_xy`` shear, ``stress_largest`` and ``stress_smallest`` for the principal stresses in the wall's
    plane. In deformable blocks it is the stress of their zones; in rigid blocks the mean stress from the forces in
    their joints; in elastic blocks this mean and the stress of their bending. Segments of a footing are grey.

    Parameters
    ----------
    ds : xarray.Dataset
        Result of one wall (``damagepred.solve``), or a study (``damagepred.open_study``).
    variable : str
        Name of the variable, or of a stress.
    ax : Axes, optional
        Axes to draw on; by default on a new figure.
    increment : int
        Position of the increment of a field, -1 for the last.
    exaggeration : float, optional
        Factor on all displacements under a field; by default a round number.
    levels : sequence of float, optional
        Limits of the bands of colour of a stress (MPa), rising; by default round limits that show most of the wall.
    against : str, optional
        Variable of the horizontal axis, in place of the movement.
    label : str, optional
        Name of the line, for several walls on the same axes.

    Examples
    --------
    >>> import damagepred, xarray
    >>> damagepred.plotting.draw(xarray.open_dataset("zones.nc"), "stress_yy").get_xlabel()
    'along the wall (m)'
    >>> damagepred.plotting.draw(xarray.open_dataset("wall.nc"), "base_reaction").get_ylabel()
    'base reaction (kN)'
    >>> damagepred.plotting.draw(damagepred.open_study("house.dp"), "crack_width_max").get_xlabel()
    'central deflection (mm)'
    """
    if variable.removeprefix("zone_") in STRESSES:
        return _draw_stress(ds, variable.removeprefix("zone_"), ax, increment, exaggeration, levels)
    if "sample" in ds.dims:
        return draw_paths(ds, variable, ax)
    kinds: Any = ds["contact_kind"].values if "contact_opening" in ds.variables else ()
    along = [f"{bed}_opening" for bed, kind in BEDS.items() if kind in kinds]
    along += ["footing_rise"] if "section_x" in ds.variables else []
    if variable in along:
        bed = variable.removesuffix("_opening")
        return _draw_bed(ds, bed, ax) if bed in BEDS else _draw_footing_rise(ds, ax)
    drawable = {  # numbers of blocks, contacts, zones or gridpoints, or of each increment
        str(name): ("increment" in values.dims or (len(values.dims) == 1 and values.dims[0] in _PLACES))
        and np.issubdtype(values.dtype, np.number)
        for name, values in ds.variables.items()
    }
    names = [*along, *(name for name, number in drawable.items() if number)]
    if variable not in names:
        problem = "is neither a field on the wall nor a number at each increment"
        if variable not in ds.variables:
            problem = "the dataset has no such variable"
        raise InputError(
            f"variable = '{variable}': {problem}.{nearest(variable, names)} To be drawn: {', '.join(names)}; of every "
            f"wall with all its fields {', '.join(STRESSES)}, too."
        )
    dims = ds[variable].dims
    if any(place in dims for place in _PLACES):
        return _draw_field(ds, variable, ax, increment, exaggeration)
    if "section" in dims:
        factor, unit = sheet.shown_unit(ds, variable)
        name = f"{variable.removeprefix('section_').replace('_', ' ')}{unit}"
        ax = _draw_along(ds, ax, ds["section_x"].values, ds[variable].values * factor, name)
        sheet.set_title(ax, sheet.title_of(ds, "wall"), str(ds[variable].attrs.get("long_name", "")))
        return ax
    return _draw_over_movement(ds, variable, ax, against, label)


def _draw_stress(
    ds: xr.Dataset, variable: str, ax: Axes | None, increment: int, exaggeration: float | None, levels: Any
) -> Axes:
    check_stress(ds)
    component = variable.removeprefix("stress_")
    wall = Deformed.of(ds, increment, exaggeration)
    ax = sheet.axes_or_new(ax, 10.0, sheet.height_to_scale(wall.shape, 2.2))
    rigid, zoned = stresses(wall)
    bent, bent_corners = elastic_stress(wall, rigid)
    limits = np.asarray(stress_levels(ds, variable, [increment]) if levels is None else levels, dtype=np.float64)
    # one colour per band and for values beyond both ends: blue in compression, red in tension
    ends = (0.5 if limits[0] >= -1e-12 else 0.0), (0.5 if limits[-1] <= 1e-12 else 1.0)
    shades = [tuple(colour) for colour in colormaps["RdBu_r"](np.linspace(*ends, len(limits) + 1))]
    palette, norm = ListedColormap(shades), BoundaryNorm(list(limits), len(shades), extend="both")
    wall.draw_rigid(ax, palette(norm(sheet.MPA * one_of(rigid, component))))
    filled: dict[str, Any] = {"levels": limits, "colors": shades, "extend": "both", "zorder": 2}
    if len(bent):
        triangles = np.concatenate((bent_corners[:, [0, 1, 2]], bent_corners[:, [0, 2, 3]]))
        mesh = Triangulation(wall.shape[:, 0], wall.shape[:, 1], triangles)
        ax.tricontourf(mesh, sheet.MPA * one_of(bent, component), **filled).set_label("elastic blocks")
    if len(zoned):
        smooth = np.column_stack([wall.zones.at_gridpoints(s) for s in zoned.T])
        mesh = Triangulation(wall.gridpoints[:, 0], wall.gridpoints[:, 1], wall.zones.corners)
        ax.tricontourf(mesh, sheet.MPA * one_of(smooth, component), **filled).set_label("zones")
    every = sheet.MPA * np.concatenate([one_of(s, component) for s in (rigid, zoned, bent)])
    bar = sheet.bar_below(ax, ScalarMappable(norm, palette), "MPa, tension positive", extend="both", spacing="uniform")
    bar.set_ticks(list(limits[:: 1 + len(limits) // 8]))
    reach = f"{sheet.plain_number(every.min())} to {sheet.plain_number(every.max())} MPa"
    wall.finish(ax, f"{STRESSES[variable]}, at {sheet.moved_to(ds, increment)}: {reach}")
    return ax


def _draw_field(ds: xr.Dataset, variable: str, ax: Axes | None, increment: int, exaggeration: float | None) -> Axes:
    """Draw a variable of blocks, contacts, zones or gridpoints in colours on the deformed wall."""
    wall = Deformed.of(ds, increment, exaggeration)
    ax = sheet.axes_or_new(ax, 10.0, sheet.height_to_scale(wall.shape, 2.4))
    field = ds[variable]
    factor, unit = sheet.shown_unit(ds, variable)
    values = (field.values[increment] if "increment" in field.dims else field.values) * factor
    words = sheet.verbatim(str(field.attrs.get("long_name", variable.replace("_", " "))))
    names = [str(word).replace("_", " ") for word in str(field.attrs.get("flag_meanings", "")).split()]
    if names:
        others = tuple(colour for colour, _ in colours.OPENING_STYLES) * 2
        palette = list((colours.STATE_COLOURS if variable == "contact_state" else others)[: len(names)])
        if variable == "zone_state":
            names, palette = map(list, zip(*colours.ZONE_STATES))
        shades = to_rgba_array(palette)[values.astype(np.int64)]
        counted = zip(names, palette, np.bincount(values.astype(np.int64)))
        edge: dict[str, Any] = {"edgecolor": "0.6", "linewidth": 0.5}
        handles = [Patch(facecolor=shade, label=f"{name}: {count}", **edge) for name, shade, count in counted if count]
        sheet.legend_below(ax, handles, 3, 0.65, left=True)
        reach = ""
    else:
        shown = values[np.isfinite(values)]
        colour_map, norm = colours.field_colours(shown)
        shades = colour_map(norm(np.nan_to_num(values)))
        shades[~np.isfinite(values)] = to_rgba_array("white")
        sheet.bar_below(ax, ScalarMappable(norm, colour_map), f"{variable.replace('_', ' ')}{unit}")
        ends = (sheet.plain_number(end) for end in (shown.min(), shown.max())) if shown.size else ("–", "–")
        reach = f": {' to '.join(ends)}{unit.replace('(', '').replace(')', '')}"
    _fill(ax, wall, next(d for d in field.dims if d in _PLACES), values, shades)
    moved = f" at {sheet.moved_to(ds, increment)}" if "increment" in field.dims else ""
    wall.finish(ax, f"{words}{moved}{reach}")
    return ax


def _fill(ax: Axes, wall: Deformed, place: Any, values: FloatArray, shades: FloatArray) -> None:
    """Fill blocks or zones, or draw points at contacts or gridpoints, in their colours."""
    style: dict[str, Any] = {"facecolors": shades, "edgecolors": shades, "linewidths": 0.1, "zorder": 2, "snap": False}
    if place == "block":
        sheet.add_shapes(ax, wall.outlines, label="blocks", **style)
        return
    wall.draw_rigid(ax, "white")
    if place == "zone":
        sheet.add_shapes(ax, wall.gridpoints[wall.zones.corners], label="zones", **style)
        return
    if place == "gridpoint":
        points = wall.gridpoints
    else:  # contacts midway between the two blocks
        points = np.column_stack([wall.ds[f"contact_{axis}"].values for axis in "xy"])
        _, face = np.unique(wall.ds["contact_interface"].values, return_inverse=True)
        sides = wall.faces.joints.blocks[face].T
        moved = sum(wall.motion.at(np.maximum(side, 0), points) * (side >= 0)[:, None] for side in sides)
        points = points + wall.factor * moved / np.maximum((sides >= 0).sum(axis=0), 1)[:, None]
    finite = np.isfinite(values)
    x, y = points[finite].T
    ax.scatter(x, y, s=9.0, c=shades[finite], linewidths=0.0, zorder=5, label=f"{place}s")


def _draw_along(
    ds: xr.Dataset, ax: Axes | None, x: FloatArray, rows: FloatArray, label: str, pieces: Sequence[IntArray] = ()
) -> Axes:
    """Draw values (increments, places) along the wall (m) at some increments."""
    ax = sheet.axes_or_new(ax, 9.0, 4.0)
    movement = ds[movement_measure(ds)].values * sheet.MM
    # viridis without its yellow, which does not show on white
    shades = LinearSegmentedColormap.from_list("movement", colormaps["viridis"](np.linspace(0.9, 0.0, 21)))
    scale = ScalarMappable(Normalize(0.0, max(float(movement.max()), 1e-9)), shades)
    sheet.figure_of(ax).colorbar(scale, ax=[ax], pad=0.02).set_label(f"{movement_words(ds)} (mm)")
    ax.axhline(0.0, color="black", linewidth=0.8)
    for step in sheet.spread_evenly(len(movement), MOST_LINES):
        for piece in pieces or [np.arange(len(x))]:
            ax.plot(x[piece], rows[step, piece], color=scale.to_rgba(movement[step]), linewidth=1.4)
    ax.set_xlim(float(ds["vertex_x"].min()), float(ds["vertex_x"].max()))
    ax.set_xlabel("along the wall (m)")
    ax.set_ylabel(label)
    sheet.grid(ax)
    return ax


def _draw_footing_rise(ds: xr.Dataset, ax: Axes | None) -> Axes:
    """Draw the rise of a footing from its level under dead load, on soil with the ground as it would be without it."""
    footing, level = geometry.footing_blocks(ds), geometry.settlement(ds) or 0.0
    x = geometry.footing_rise(ds, 0, footing)[0]
    rises = np.array([geometry.footing_rise(ds, step, footing)[1] for step in range(ds.sizes["increment"])])
    ax = _draw_along(ds, ax, x, (rises - level) * sheet.MM, "rise of the footing (mm)")
    x, _, rise = geometry.ground_profile(ds, ds.sizes["increment"] - 1, ContactKind.SOIL)
    words = ""
    if len(x):
        ax.plot(x, (rise - level) * sheet.MM, color=colours.SOIL_COLOUR, linestyle="--", linewidth=1.4, label="ground")
        words = f" from its level under dead load, settled by {sheet.plain_number(-level * sheet.MM)} mm"
        words += "; dashed: ground at the end without the footing"
    sheet.set_title(ax, sheet.title_of(ds, "wall"), f"rise of the footing{words}")
    return ax


def _draw_bed(ds: xr.Dataset, bed: str, ax: Axes | None) -> Axes:
    """Draw the opening of the dpc, or of the bed on the footing, and the stretches open by more than the threshold."""
    name = "dpc" if bed == "dpc" else "bed on the footing"
    x, opening, pieces = geometry.opening_along(ds, BEDS[bed])
    ax = _draw_along(ds, ax, x, opening * sheet.MM, f"opening of the {name} (mm)", pieces)
    threshold = float(ds[f"{bed}_separation_length"].attrs.get("opening_threshold", 1e-3))
    limit = f"{sheet.plain_number(threshold * sheet.MM)} mm"
    if opening.max() > SHOWN_SHARE * threshold:
        ax.axhline(threshold * sheet.MM, color="black", linestyle="--", linewidth=1.0, label=f"threshold {limit}")
    stretches = [span for piece in pieces for span in geometry.open_stretches(x[piece], opening[-1, piece], threshold)]
    sheet.legend_below(ax)
    left = ax.get_xlim()[0]
    spans = ", ".join(f"{a - left:.2f} to {b - left:.2f} m" for a, b in stretches[:4])
    more = f" and {len(stretches) - 4} more stretches" if len(stretches) > 4 else ""
    reach = f"by more than {limit} along {spans}{more}" if stretches else f"nowhere by more than {limit}"
    widest = f"open by {sheet.plain_number(float(opening[-1].max()) * sheet.MM)} mm at most"
    words = f"at {sheet.moved_to(ds, -1)} the {name} is {widest}, {reach}"
    sheet.set_title(ax, sheet.title_of(ds, "wall"), words)
    return ax


def _draw_over_movement(ds: xr.Dataset, variable: str, ax: Axes | None, against: str | None, label: str | None) -> Axes:
    """Draw a variable with one value, or one per opening, jack or support, at each increment."""
    by = against or ("time" if is_dynamic(ds) else movement_measure(ds))
    if by not in ds.variables or ds[by].dims != ("increment",):
        names = [str(name) for name in ds.variables if ds[name].dims == ("increment",)]
        allowed = f"must be a variable with one value at each increment, such as {', '.join(names)}."
        raise InputError(f"against = '{by}': {allowed}{nearest(by, names)}")
    first = ax is None or not ax.lines
    ax = sheet.axes_or_new(ax, 8.0, 5.0)
    (factor, unit), (x_factor, x_unit) = (sheet.shown_unit(ds, name) for name in (variable, by))
    x, y = ds[by].values * x_factor, ds[variable].values * factor
    name = movement_words(ds, by) if by.endswith(("movement", "deflection", "displacement")) else by.replace("_", " ")
    in_stages = against is None and label is None and "stage" in ds.variables and y.ndim == 1
    if in_stages and by != "load_displacement":  # which has a sign of its own
        x, name = np.sign(ds["progress"].values) * x, f"{name}, signed"
    if first:
        ax.axhline(0.0, color="black", linewidth=0.8)
        ax.set_xlabel(f"{name}{x_unit}")
        ax.set_ylabel(f"{variable.replace('_', ' ')}{unit}")
        sheet.grid(ax)
        sheet.set_title(ax, sheet.title_of(ds, "wall"), sheet.verbatim(str(ds[variable].attrs.get("long_name", ""))))
    if in_stages:
        years = "time" in ds.variables
        ax.plot(x, y, color="0.6", linewidth=0.9)
        points = ax.scatter(x, y, c=ds["time" if years else "increment"].values, s=16, zorder=3)
        ax.figure.colorbar(points, ax=ax, label="time (years)" if years else "increment")
        return ax
    lines = _labelled(ds, variable, label)
    for number, text in enumerate(lines):
        row = y[:, number] if y.ndim > 1 else y
        moving = np.isfinite(row)  # a wall in motion has no load
        style: dict[str, Any] = {"marker": ".", "markersize": 4, "linewidth": 1.5, "label": text}
        if y.ndim > 1 and label is None:
            style |= dict(zip(("color", "marker"), colours.OPENING_STYLES[number % len(colours.OPENING_STYLES)]))
        ax.plot(x[moving], row[moving], **style)
        if not moving.any():
            ax.lines[-1].set_label(f"{text}: unknown")
    if "limit_deflection" in ds.attrs and variable == "jack_load" and by == "central_deflection":
        # in a rig that cannot pull, the footing goes no further: jacks or a support carry nothing any more
        limit, style = float(ds.attrs["limit_deflection"]) * sheet.MM, {"markersize": 7, "markerfacecolor": "white"}
        style |= {"markeredgecolor": ax.lines[-1].get_color(), "zorder": 5}
        ax.plot([limit], [0.0], marker="o", linestyle="none", label="_limit", **style)
        earlier = sum(line.get_label() == "_limit" for line in ax.lines) - 1
        words, above = f"no load at {sheet.plain_number(limit)} mm", (0, 10 + 14 * earlier)
        ax.annotate(words, (limit, 0.0), above, textcoords="offset points", ha="right", fontsize=sheet.small(ax))
    if handles := [line for line in ax.lines if not str(line.get_label()).startswith("_")]:
        sheet.legend_below(ax, handles, 3)
    return ax


def _labelled(ds: xr.Dataset, variable: str, label: str | None) -> list[str | None]:
    """Label of each line of a variable."""
    if ds[variable].ndim == 1:
        return [label]
    dim = str(ds[variable].dims[-1])
    names = [f"{dim} {number}" for number in range(1, ds.sizes[dim] + 1)]
    sizes = [ds[f"opening_{side}"].values for side in ("left", "sill", "width", "height")] if dim == "opening" else []
    for k, (left, sill, width, height) in enumerate(zip(*sizes)):
        if np.isfinite([left, sill, width, height]).all():
            kind = "window" if sill > 0 else "door"
            names[k] = f"{kind} {k + 1}: {width:.2f} x {height:.2f} m, at {left:.2f} m"
    return [f"{label}: {name}" if label else name for name in names]
