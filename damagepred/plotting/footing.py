"""Along the wall: opening of the damp-proof course and of the bed on the footing; form and forces of the footing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from damagepred.arrays import FloatArray, IntArray
from damagepred.damage.joints import JointMap
from damagepred.enumerations import ContactKind
from damagepred.inputs.arguments import checked
from damagepred.plotting.colours import SOIL_COLOUR, movement_bar
from damagepred.plotting.geometry import footing_blocks, footing_rise, ground_profile, settlement
from damagepred.plotting.sheet import (
    KN,
    MM,
    axes_or_new,
    grid,
    legend_below,
    moved_to,
    plain_number,
    require,
    say_nothing_to_draw,
    set_title,
    several_or_new,
    spread_evenly,
    title_of,
)
from damagepred.uq.intensity import movement_measure, movement_words

MOST_LINES = 10
"""Increments drawn at most."""
SHOWN_SHARE = 0.4
"""Widest opening over the threshold from which the threshold is drawn: a lower one would lie on the axis."""
_NEEDED = (*(f"contact_{name}" for name in ("x", "kind", "interface", "length", "opening")), "central_deflection")


@checked
def draw_dpc_opening(ds: xr.Dataset, ax: Axes | None = None, bed: Literal["dpc", "footing"] = "dpc") -> Axes:
    """Draw the opening of the dpc, or of the bed on the footing, along the wall at some increments.

    The title names the stretches that are open by more than the threshold at the last increment.

    Parameters
    ----------
    ds : xarray.Dataset
        Result of one wall (``damagepred.solve``).
    ax : Axes, optional
        Axes to draw on; by default on a new figure.
    bed : {"dpc", "footing"}
        Damp-proof course, or bed between first course and footing.

    Raises
    ------
    InputError
        If the dataset is not of one wall.

    Examples
    --------
    >>> import damagepred, xarray
    >>> ax = damagepred.plotting.draw_dpc_opening(xarray.open_dataset("mound.nc"))
    >>> ax.get_xlabel()
    'along the wall (m)'
    """
    kind, name = (ContactKind.DPC, "dpc") if bed == "dpc" else (ContactKind.FOOTING_INTERFACE, "bed on the footing")
    require(ds, (*_NEEDED, "vertex_x"), "the result of one wall with all its fields (`damagepred solve`)")
    ax = axes_or_new(ax, 9.0, 5.0)
    left, right = _along(ax, ds, f"opening of the {name} (mm)")
    title = title_of(ds, "wall")
    if not (ds["contact_kind"].values == kind).any():
        say_nothing_to_draw(ax, "no dpc: this wall has no damp-proof course" if bed == "dpc" else f"no {name}")
        set_title(ax, title)
        return ax
    x, opening, pieces = opening_along(ds, kind)
    opening = opening * MM
    movement = ds[movement_measure(ds)].values * MM
    colour = movement_bar([ax], movement, movement_words(ds))
    for step in spread_evenly(len(movement), MOST_LINES):
        for piece in pieces:
            ax.plot(x[piece], opening[step, piece], color=colour(movement[step]), linewidth=1.4)
    threshold = float(ds[f"{bed}_separation_length"].attrs.get("opening_threshold", 1e-3)) * MM
    limit = f"{plain_number(threshold)} mm"
    top = max(float(opening.max()), 1e-3)
    if top > SHOWN_SHARE * threshold:
        ax.axhline(threshold, color="black", linestyle="--", linewidth=1.0, label=f"threshold {limit}")
        top = max(top, threshold)
    ax.set_ylim(min(-0.03 * top, 1.05 * float(opening.min())), 1.25 * top)
    stretches = [span for piece in pieces for span in open_stretches(x[piece], opening[-1, piece], threshold)]
    if ends := [end for stretch in stretches for end in stretch if left < end < right]:
        ax.plot(ends, [threshold] * len(ends), "o", color="black", markersize=5, zorder=5, label="passed at the end")
    legend_below(ax, ax.get_legend_handles_labels()[0])
    widest = plain_number(float(opening[-1].max()))
    set_title(
        ax, title, f"at {moved_to(ds, -1)} the {name} is open by {widest} mm at most, " + _reach(stretches, limit, left)
    )
    return ax


def _along(ax: Axes, ds: xr.Dataset, label: str) -> tuple[float, float]:
    """Set the axis along the wall; its ends (m)."""
    left, right = float(ds["vertex_x"].min()), float(ds["vertex_x"].max())
    ax.set_xlim(left, right)
    ax.set_xlabel("along the wall (m)")
    ax.set_ylabel(label)
    return left, right


def open_stretches(x: FloatArray, opening: FloatArray, threshold: float) -> list[tuple[float, float]]:
    """Start and end of each stretch along which an opening exceeds a threshold, linear between its points."""
    above = opening > threshold
    change = np.flatnonzero(np.diff(above.astype(np.int8)))
    share = (threshold - opening[change]) / (opening[change + 1] - opening[change])
    ends = list(x[change] + share * (x[change + 1] - x[change]))
    if above[0]:
        ends.insert(0, x[0])
    if above[-1]:
        ends.append(x[-1])
    return [(float(a), float(b)) for a, b in zip(ends[::2], ends[1::2])]


def opening_along(ds: xr.Dataset, kind: int = ContactKind.DPC) -> tuple[FloatArray, FloatArray, list[IntArray]]:
    """Profile of a bed's opening up to the ends of its joints: places, openings, points of each piece."""
    joints = JointMap.from_dataset(ds)
    number = np.flatnonzero(joints.kind == kind)
    left, right = np.sort(np.column_stack((joints.start[number, 0], joints.end[number, 0])), axis=1).T
    order = np.argsort(left)
    number, left, right = number[order], left[order], right[order]
    profile, shape = joints.profile(number), joints.contact_x.shape
    opening = np.stack([profile.of(values.reshape(shape)) for values in ds["contact_opening"].values])
    backwards = joints.start[number, 0] > joints.end[number, 0]
    x = np.where(backwards, -1.0, 1.0)[:, None] * profile.way + joints.start[number, :1]
    x[backwards], opening[:, backwards] = x[backwards, ::-1], opening[:, backwards, ::-1]
    interrupted = np.flatnonzero(left[1:] > right[:-1] + 1e-9) + 1
    pieces = np.split(np.arange(x.size), interrupted * x.shape[1])
    return x.ravel(), opening.reshape(len(opening), -1), pieces


def _reach(stretches: list[tuple[float, float]], limit: str, left: float) -> str:
    if not stretches:
        return f"nowhere by more than {limit}"
    spans = ", ".join(f"{a - left:.2f} to {b - left:.2f} m" for a, b in stretches[:4])
    more = f" and {len(stretches) - 4} more stretches" if len(stretches) > 4 else ""
    return f"by more than {limit} along {spans}{more}"


@checked
def draw_footing(ds: xr.Dataset, axes: Sequence[Axes] | None = None) -> list[Axes]:
    """Draw rise, moment and curvature of a footing one below the other, at some increments.

    Parameters
    ----------
    ds : xarray.Dataset
        Result of one wall on a footing that finds its own form.
    axes : sequence of 3 Axes, optional
        Axes to draw on; by default on a new figure.

    Returns
    -------
    list of Axes
        Axes of rise, moment and curvature.

    Raises
    ------
    InputError
        If the dataset is not of such a wall.

    Examples
    --------
    >>> import damagepred, xarray
    >>> axes = damagepred.plotting.draw_footing(xarray.open_dataset("mound.nc"))
    >>> [ax.get_ylabel() for ax in axes]
    ['rise of the footing (mm)', 'moment, sagging positive (kNm)', 'curvature, sagging positive (1/km)']
    """
    require(
        ds,
        ("section_moment", "section_curvature"),
        "the result of one wall on a footing that finds its own form (`movement.shape = 'jacks'` or 'mound')",
    )
    axes = several_or_new(axes, 3, 1, 9.0, 9.5, sharex=True)
    chosen, datum = footing_blocks(ds), settlement(ds)
    level, x = datum or 0.0, ds["section_x"].values
    rises = [footing_rise(ds, i, chosen) for i in range(ds.sizes["increment"])]
    fields = (
        ("rise of the footing (mm)", [(places, (rise - level) * MM) for places, rise in rises]),
        ("moment, sagging positive (kNm)", [(x, row) for row in ds["section_moment"].values * KN]),
        ("curvature, sagging positive (1/km)", [(x, row) for row in ds["section_curvature"].values * 1e3]),
    )
    movement = ds[movement_measure(ds)].values * MM
    colour = movement_bar(axes, movement, movement_words(ds))
    for ax, (label, curves) in zip(axes, fields):
        _along(ax, ds, label)
        ax.axhline(0.0, color="black", linewidth=0.8)
        for step in spread_evenly(len(movement), MOST_LINES):
            ax.plot(*curves[step], color=colour(movement[step]), linewidth=1.4)
        grid(ax)
    for ax in axes[:-1]:
        ax.set_xlabel("")
    places, _, rise = ground_profile(ds, ds.sizes["increment"] - 1, ContactKind.SOIL)
    dead_load = ""
    if len(places):
        style: dict[str, Any] = {"color": SOIL_COLOUR, "linestyle": "--", "linewidth": 1.4}
        axes[0].plot(places, (rise - level) * MM, label="ground", **style)
        dead_load = f"rise from its level under dead load, settled by {plain_number(-level * MM)} mm"
        dead_load += "; dashed: ground at the end without the footing"
    set_title(axes[0], title_of(ds, "wall"), "rise, moment and curvature of the footing", dead_load)
    return axes
