"""Figures and axes, and helpers of all drawings: wrapped titles, checks of datasets."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.transforms import ScaledTranslation, Transform

from damagepred.archive.schema import is_dynamic
from damagepred.arrays import FloatArray, IntArray
from damagepred.errors import InputError
from damagepred.inputs.text import without_controls
from damagepred.uq.intensity import OF_SITE, movement_measure, movement_words

DPI = 150
"""Resolution of all pictures (dots per inch)."""

PAGE_WIDTH, LANDSCAPE_WIDTH = 6.3, 9.8
"""Width of a picture on a printed page, 160 mm, and on one in landscape, 250 mm (inches)."""

WIDEST_UPRIGHT = 12.0
"""Width of a sheet (inches) beyond which it is meant for a page in landscape: many panels stand beside each other."""

TEXT, SMALL = 8.0, 0.88
"""Size of labels and titles at that width (points), and that of legends and notes as a share of it: 7 points."""

LETTERS_PER_INCH = 155.0
"""Of a title whose letters have one point, by the width of its axes before the layout has been found: it widens them.
"""

MM = 1e3
"""Millimetres in a metre."""


KN = 1e-3
"""Kilonewtons in a newton."""


class Sheet(Figure):
    """A figure whose letters grow with its width, so that they can be read where it is as wide as a page."""

    def add_subplot(self, *args: Any, **kwargs: Any) -> Any:
        """Add axes, see ``matplotlib.figure.Figure``; labels and ticks have the size of the sheet's text."""
        return self._lettered(super().add_subplot(*args, **kwargs))

    def colorbar(self, *args: Any, **kwargs: Any) -> Any:
        """Add a colour bar, see ``matplotlib.figure.Figure``, lettered as the axes are."""
        bar = super().colorbar(*args, **kwargs)
        self._lettered(bar.ax)
        return bar

    def _lettered(self, ax: Axes) -> Axes:
        width = self.get_figwidth()
        size = TEXT * width / (PAGE_WIDTH if width <= WIDEST_UPRIGHT else LANDSCAPE_WIDTH)
        ax.tick_params(which="both", labelsize=size)
        for label in (ax.xaxis.label, ax.yaxis.label):
            label.set_fontsize(size)
        return ax


def text_size(ax: Axes) -> float:
    """Return the size of the labels of axes (points), which all other text on them follows."""
    return float(ax.xaxis.label.get_fontsize())


def small(ax: Axes) -> float:
    """Return the size of legends and notes on axes (points)."""
    return SMALL * text_size(ax)


def new_figure(width: float = 8.0, height: float = 5.0) -> Figure:
    """Return an empty figure that belongs to no window."""
    figure = Sheet(figsize=(width, height), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def axes_or_new(ax: Axes | None, width: float = 8.0, height: float = 5.0) -> Axes:
    """Return ``ax``, or the axes of a new figure of the given size (inches) if it is None."""
    return new_figure(width, height).add_subplot() if ax is None else ax


def several_or_new(
    axes: Sequence[Axes] | None, rows: int, columns: int, width: float, height: float, sharex: bool = False
) -> list[Axes]:
    """Return the given axes, or those of a new figure."""
    if axes is None:
        return list(new_figure(width, height).subplots(rows, columns, squeeze=False, sharex=sharex).flat)
    found = list(np.asarray(axes, dtype=object).flat)
    if len(found) != rows * columns or not all(isinstance(ax, Axes) for ax in found):
        raise InputError(f"axes = {axes!r}: must be {rows * columns} axes of matplotlib.")
    return found


def figure_of(ax: Axes) -> Figure:
    """Return the whole figure that axes stand on."""
    figure = ax.get_figure(root=True)
    assert figure is not None  # axes made here always have one
    return figure


def require(ds: xr.Dataset, names: Iterable[str], result: str) -> None:
    """Check that a dataset holds what a drawing needs."""
    missing = [name for name in names if name not in ds.variables]
    if missing:
        raise InputError(f"the dataset has no variable '{missing[0]}'; this drawing needs {result}.")


def verbatim(text: str) -> str:
    """Return text of a user as it is drawn: a dollar sign begins no formula, control characters are left out."""
    return without_controls(text).replace("$", r"\$")


def title_of(ds: xr.Dataset, default: str) -> str:
    """Return the title of a dataset, verbatim."""
    return verbatim(str(ds.attrs.get("title", default)))


def height_to_scale(points: FloatArray, room: float, lowest: float = 3.2, width: float = 8.0) -> float:
    """Return the height (inches) of a sheet that shows points to scale."""
    across, upwards = np.ptp(points, axis=0)
    return float(np.clip(width * upwards / across + room, lowest, 9.0))


def elevation(ax: Axes) -> None:
    """Make axes those of a wall seen from its face: to scale, in metres, without a frame."""
    ax.set_aspect("equal")
    ax.set_xlabel("along the wall (m)")
    ax.set_ylabel("height (m)")
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)


def grid(ax: Axes, axis: Literal["both", "x"] = "both") -> None:
    """Draw a pale grid below all else."""
    ax.grid(axis=axis, color="0.9")
    ax.set_axisbelow(True)


def moved_to(ds: xr.Dataset, increment: int) -> str:
    """Return in words how far a wall has moved at an increment, or the time of a run in time."""
    if is_dynamic(ds):
        return f"{plain_number(float(ds['time'].values[increment]))} s"
    moved = float(ds[movement_measure(ds)].values[increment])
    return f"a {movement_words(ds)} of {plain_number(moved * MM)} mm"


def set_title(ax: Axes, *lines: str) -> None:
    """Write a title: the first line is the name of the wall or study, the others say what is drawn."""
    inches = ax.bbox.width / figure_of(ax).dpi
    letters = max(20, int(LETTERS_PER_INCH * inches / text_size(ax)))
    rows = [row for line in lines if line for row in textwrap.wrap(line, letters)]
    ax.set_title("\n".join(rows), fontsize=text_size(ax), loc="left")


def below(ax: Axes, inches: float, transform: Transform | None = None) -> Transform:
    """Return where to draw so far under the axes: fractions of them, or another transform's places."""
    return (transform or ax.transAxes) + ScaledTranslation(0.0, -inches, figure_of(ax).dpi_scale_trans)


def legend_below(
    ax: Axes, handles: Sequence[Artist], columns: int = 6, inches: float = 0.5, left: bool = False
) -> None:
    """Put a legend in rows under the axes, where it covers nothing."""
    # a legend wider than the axes would take room from them on both sides
    for count in range(min(columns, len(handles)), 0, -1):
        legend = ax.legend(
            handles=handles,
            loc="upper left" if left else "upper center",
            bbox_to_anchor=(0.0 if left else 0.5, 0.0),
            bbox_transform=below(ax, inches * text_size(ax) / 10.0),
            ncols=count,
            frameon=False,
            fontsize=small(ax),
            borderaxespad=0.0,
        )
        if legend.get_window_extent().width <= ax.bbox.width:
            break


def label_movement(ax: Axes, words: str) -> None:
    """Name the horizontal axis after a movement in words, in mm."""
    ax.set_xlabel(f"{words}{' $y_s$' if words == OF_SITE else ''} (mm)")


def say_nothing_to_draw(ax: Axes, reason: str) -> None:
    """Write into empty axes why they are empty."""
    ax.set_xticks([])
    ax.set_yticks([])
    ax.text(0.5, 0.5, reason, transform=ax.transAxes, ha="center", va="center", fontsize=1.2 * text_size(ax), wrap=True)


def plain_number(value: float) -> str:
    """Return a number to three figures, without an exponent."""
    return f"{float(f'{value:.3g}'):.10f}".rstrip("0").rstrip(".")


def round_numbers(decades: int) -> FloatArray:
    """Return round numbers from 1 up to 10**decades, ten a decade, rising."""
    return np.outer(10.0 ** np.arange(decades), [1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0]).ravel()


def spread_evenly(count: int, most: int) -> IntArray:
    """Return at most ``most`` of the numbers 0 to count - 1, at equal distances, the last among them."""
    return np.arange(count - 1, -1, -max(1, -(-count // most)))[::-1]
