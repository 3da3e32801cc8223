"""Opening of the damp-proof course, and of the bed on the footing, along the wall."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from damagepred.arrays import FloatArray, IntArray
from damagepred.damage.joints import JointMap
from damagepred.enumerations import ContactKind
from damagepred.inputs.arguments import checked
from damagepred.plotting.colours import movement_bar
from damagepred.plotting.sheet import (
    MM,
    axes_or_new,
    legend_below,
    moved_to,
    plain_number,
    require,
    say_nothing_to_draw,
    set_title,
    small,
    spread_evenly,
    title_of,
)
from damagepred.uq.intensity import movement_measure, movement_words

MOST_LINES = 10
"""Increments drawn at most."""
_NEEDED = (
    "contact_x",
    "contact_kind",
    "contact_interface",
    "contact_length",
    "contact_opening",
    "central_deflection",
    "vertex_x",
)


@checked
def draw_dpc_opening(ds: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw how far the dpc has opened along the wall, increment by increment; see ``draw_footing_opening``.

    The stretches that are open by more than the threshold at the last increment are marked with their distance from
    the nearer end of the wall.

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
    >>> ax = damagepred.plotting.draw_dpc_opening(xarray.open_dataset("mound.nc"))
    >>> ax.get_xlabel()
    'along the wall (m)'
    """
    return _draw_opening(ds, ax, ContactKind.DPC)


@checked
def draw_footing_opening(ds: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw how far the bed between first course and footing has opened along the wall, increment by increment.

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
    >>> ax = damagepred.plotting.draw_footing_opening(xarray.open_dataset("wall.nc"))
    >>> ax.get_xlabel()
    'along the wall (m)'
    """
    return _draw_opening(ds, ax, ContactKind.FOOTING_INTERFACE)


def _draw_opening(ds: xr.Dataset, ax: Axes | None, kind: int) -> Axes:
    part, name = ("dpc", "dpc") if kind == ContactKind.DPC else ("footing", "bed on the footing")
    require(ds, _NEEDED, "the result of one wall with all its fields (`damagepred solve`)")
    ax = axes_or_new(ax, 9.0, 5.0)
    ax.set_xlabel("along the wall (m)")
    ax.set_ylabel(f"opening of the {name} (mm)")
    left, right = float(ds["vertex_x"].min()), float(ds["vertex_x"].max())
    ax.set_xlim(left, right)
    title = title_of(ds, "wall")
    if not (ds["contact_kind"].values == kind).any():
        say_nothing_to_draw(
            ax, "no dpc: this wall has no damp-proof course" if kind == ContactKind.DPC else f"no {name}"
        )
        set_title(ax, title)
        return ax
    place, opening, pieces = opening_along(ds, kind)
    opening = opening * MM
    deflection = ds[movement_measure(ds)].values * MM
    colour = movement_bar(ax, deflection, movement_words(ds))
    for step in spread_evenly(len(deflection), MOST_LINES):
        for piece in pieces:
            ax.plot(place[piece], opening[step, piece], color=colour(deflection[step]), linewidth=1.4)
    threshold = float(ds[f"{part}_separation_length"].attrs.get("opening_threshold", 1e-3)) * MM
    limit = f"{plain_number(threshold)} mm"
    ax.axhline(threshold, color="black", linestyle="--", linewidth=1.0, label=f"threshold {limit}")
    top = max(float(opening.max()), threshold)
    ax.set_ylim(min(-0.03 * top, 1.05 * float(opening.min())), 1.25 * top)
    stretches = [found for piece in pieces for found in open_stretches(place[piece], opening[-1, piece], threshold)]
    _mark(ax, stretches, threshold, left, right)
    legend_below(ax, ax.get_legend_handles_labels()[0])
    widest = plain_number(float(opening[-1].max()))
    set_title(
        ax,
        title,
        f"at {moved_to(ds, -1)} the {name} is open by {widest} mm at most, " + _reach(stretches, limit, left),
    )
    return ax


def open_stretches(place: FloatArray, opening: FloatArray, threshold: float) -> list[tuple[float, float]]:
    """Return from where to where an opening is more than a threshold."""
    above = opening > threshold
    change = np.flatnonzero(np.diff(above.astype(np.int8)))
    share = (threshold - opening[change]) / (opening[change + 1] - opening[change])
    ends = list(place[change] + share * (place[change + 1] - place[change]))
    if above[0]:
        ends.insert(0, place[0])
    if above[-1]:
        ends.append(place[-1])
    return [(float(a), float(b)) for a, b in zip(ends[::2], ends[1::2])]


def opening_along(ds: xr.Dataset, kind: int = ContactKind.DPC) -> tuple[FloatArray, FloatArray, list[IntArray]]:
    """Return the opening of the dpc, or of another bed, from left to right, up to the ends of its joints."""
    joints = JointMap.from_dataset(ds)
    number = np.flatnonzero(joints.kind == kind)
    left, right = np.sort(np.column_stack((joints.start[number, 0], joints.end[number, 0])), axis=1).T
    order = np.argsort(left)
    number, left, right = number[order], left[order], right[order]
    profile, shape = joints.profile(number), joints.contact_x.shape
    opening = np.stack([profile.of(values.reshape(shape)) for values in ds["contact_opening"].values])
    backwards = joints.start[number, 0] > joints.end[number, 0]
    place = np.where(backwards, -1.0, 1.0)[:, None] * profile.way + joints.start[number, :1]
    place[backwards], opening[:, backwards] = place[backwards, ::-1], opening[:, backwards, ::-1]
    interrupted = np.flatnonzero(left[1:] > right[:-1] + 1e-9) + 1
    pieces = np.split(np.arange(place.size), interrupted * place.shape[1])
    return place.ravel(), opening.reshape(len(opening), -1), pieces


def _mark(ax: Axes, stretches: list[tuple[float, float]], threshold: float, left: float, right: float) -> None:
    """Mark where the threshold is passed, and say for the outermost places how far they are from the nearer end."""
    ends = sorted(end for stretch in stretches for end in stretch)
    inner = [end for end in ends if min(end - left, right - end) > 1e-6 * (right - left)]
    style: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 5, "color": "black", "zorder": 5}
    ax.plot(inner, [threshold] * len(inner), label="passed at the last increment", **style)
    for row, place in enumerate(sorted({*inner[:1], *inner[-1:]})):
        near_left = place - left < right - place
        distance = place - left if near_left else right - place
        height = 0.95 - 0.06 * row
        upright = ax.get_xaxis_transform()
        ax.plot([place] * 2, [0.0, height], color="black", linewidth=0.8, linestyle=":", zorder=1, transform=upright)
        ax.annotate(
            f"{distance:.2f} m from the {'left' if near_left else 'right'} end",
            (place, height),
            xycoords=upright,
            xytext=(5 if near_left else -5, 0),
            textcoords="offset points",
            ha="left" if near_left else "right",
            va="center",
            fontsize=small(ax),
        )


def _reach(stretches: list[tuple[float, float]], limit: str, left: float) -> str:
    if not stretches:
        return f"nowhere by more than {limit}"
    spans = ", ".join(f"{a - left:.2f} to {b - left:.2f} m" for a, b in stretches[:4])
    more = f" and {len(stretches) - 4} more stretches" if len(stretches) > 4 else ""
    return f"by more than {limit} along {spans}{more}"
