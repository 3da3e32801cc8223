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
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colorbar import Colorbar
from matplotlib.figure import Figure
from matplotlib.transforms import ScaledTranslation, Transform, blended_transform_factory

from damagepred.archive.schema import VARIABLES, is_dynamic
from damagepred.arrays import FloatArray, IntArray
from damagepred.errors import InputError
from damagepred.inputs.text import without_controls
from damagepred.uq.intensity import OF_SITE, movement_measure, movement_words

DPI = 150  # resolution of all pictures (dots per inch)

PAGE_WIDTH, LANDSCAPE_WIDTH = 6.3, 9.8
"""Width of a picture on a printed page, 160 mm, and on one in landscape, 250 mm (inches)."""

WIDEST_UPRIGHT = 12.0
"""Width of a sheet (inches) beyond which it is meant for a page in landscape: many panels stand beside each other."""

TEXT, SMALL = 8.0, 0.88
"""Size of labels and titles at that width (points), and size of legends and notes as a share of it: 7 points."""

LETTERS_PER_INCH = 155.0
"""Letters of one point per inch of a title, by the width of its axes before the layout, which widens them."""

MM, KN, MPA = 1e3, 1e-3, 1e-6
"""Millimetres in a metre, kilonewtons in a newton, megapascals in a pascal."""


_UNITS = {
    "m": (MM, "mm"),
    "Pa": (MPA, "MPa"),
    "N": (KN, "kN"),
    "N m": (KN, "kNm"),
    "m-1": (1e3, "1/km"),
    "rad": (1e3, "mrad"),
    "1": (1.0, ""),
}


class Sheet(Figure):
    """Figure whose letters grow with its width, so that they can be read where it is as wide as a page."""

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
    """Size of the labels of axes (points), which all other text on them follows."""
    return float(ax.xaxis.label.get_fontsize())


def small(ax: Axes) -> float:
    """Size of legends and notes on axes (points)."""
    return SMALL * text_size(ax)


def new_figure(width: float = 8.0, height: float = 5.0) -> Figure:
    """Empty figure that belongs to no window."""
    figure = Sheet(figsize=(width, height), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def axes_or_new(ax: Axes | None, width: float = 8.0, height: float = 5.0) -> Axes:
    """Given axes, or the axes of a new figure of a size (inches)."""
    return new_figure(width, height).add_subplot() if ax is None else ax


def several_or_new(axes: Sequence[Axes] | None, count: int, width: float, height: float) -> list[Axes]:
    """Given axes, or the axes of a new figure, one below the other."""
    if axes is None:
        return list(new_figure(width, height).subplots(count, squeeze=False).flat)
    given = list(np.asarray(axes, dtype=object).flat)
    if len(given) != count or not all(isinstance(ax, Axes) for ax in given):
        raise InputError(f"axes = {axes!r}: must be {count} axes of matplotlib.")
    return given


def add_shapes(ax: Axes, shapes: Iterable[Any], **style: Any) -> None:
    """Draw polygons, each by its corners (k, 2)."""
    ax.add_collection(PolyCollection(list(shapes), **style))


def add_lines(ax: Axes, lines: Iterable[Any], **style: Any) -> None:
    """Draw lines, each by its points (k, 2)."""
    ax.add_collection(LineCollection(list(lines), **style))


def figure_of(ax: Axes) -> Figure:
    """Whole figure of some axes."""
    figure = ax.get_figure(root=True)
    assert figure is not None  # axes made here always have one
    return figure


def shown_unit(ds: xr.Dataset, name: str) -> tuple[float, str]:
    """Factor from the SI unit of a variable to the unit of a picture, and the latter in brackets, empty without one."""
    stored = VARIABLES[name].units if name in VARIABLES else None
    units = str(ds[name].attrs.get("units", stored or "1"))
    factor, unit = _UNITS.get(units, (1.0, units))
    return factor, f" ({unit})" if unit else ""


def verbatim(text: str) -> str:
    """Text of a user as it is drawn: a dollar sign begins no formula, control characters are left out."""
    return without_controls(text).replace("$", r"\$")


def title_of(ds: xr.Dataset, default: str) -> str:
    """Title of a dataset, verbatim."""
    return verbatim(str(ds.attrs.get("title", default)))


def height_to_scale(points: FloatArray, room: float, width: float = 9.2) -> float:
    """Height (inches) of a sheet that shows points to scale, with room for title, axis, colour bar and legend."""
    across, upwards = np.ptp(points, axis=0)
    return float(min(width * upwards / across, 6.0) + room)


def elevation(ax: Axes) -> None:
    """Set axes for a wall seen from its face: to scale, in metres, without a frame."""
    ax.set_aspect("equal")
    ax.set_xlabel("along the wall (m)")
    ax.set_ylabel("height (m)")
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)


def grid(ax: Axes, axis: Literal["both", "x"] = "both") -> None:
    """Draw a pale grid below everything."""
    ax.grid(axis=axis, color="0.9")
    ax.set_axisbelow(True)


def moved_to(ds: xr.Dataset, increment: int) -> str:
    """Movement of a wall at an increment in words, or the time of a dynamic run."""
    if is_dynamic(ds):
        return f"{plain_number(float(ds['time'].values[increment]))} s"
    moved = float(ds[movement_measure(ds)].values[increment])
    if moved == 0.0 and "progress" in ds.variables and (progress := float(ds["progress"].values[increment])):
        return f"{plain_number(100 * progress)} % of the movement"  # such as a growth of the bricks
    return f"a {movement_words(ds)} of {plain_number(moved * MM)} mm"


def letters_across(ax: Axes) -> float:
    """Number of letters that fit in a line across the axes."""
    return LETTERS_PER_INCH * ax.bbox.width / figure_of(ax).dpi / text_size(ax)


def set_title(ax: Axes, *lines: str) -> None:
    """Write a title: first the name of the wall or study, then the lines that describe the drawing."""
    letters = max(20, int(letters_across(ax)))
    rows = [row for line in lines if line for row in textwrap.wrap(line, letters)]
    ax.set_title("\n".join(rows), fontsize=text_size(ax), loc="left")


def below(ax: Axes, inches: float, transform: Transform | None = None) -> Transform:
    """Transform to a distance under the axes: in fractions of the axes, or from another transform."""
    return (transform or ax.transAxes) + ScaledTranslation(0.0, -inches, figure_of(ax).dpi_scale_trans)


def bar_below(ax: Axes, colours: ScalarMappable, label: str, **settings: Any) -> Colorbar:
    """Draw a colour bar under the axes, its label to the left: as long as the axes, however flat they are."""
    size = text_size(ax)
    lower_left = ScaledTranslation(0.0, 0.0, ax.transAxes)  # type: ignore[arg-type]
    place = blended_transform_factory(ax.transAxes, figure_of(ax).dpi_scale_trans + lower_left)
    bar_ax = ax.inset_axes((0.4, -0.066 * size, 0.6, 0.011 * size), transform=place)
    bar = figure_of(ax).colorbar(colours, cax=bar_ax, orientation="horizontal", **settings)
    bar_ax.tick_params(labelsize=small(ax))
    bar_ax.text(-0.07, 0.5, label, transform=bar_ax.transAxes, ha="right", va="center", fontsize=small(ax))
    return bar


BELOW_BAR = 0.95  # distance of a legend below axes with a colour bar between (inches at 10 points)


def legend_below(
    ax: Axes, handles: Sequence[Artist] | None = None, columns: int = 6, inches: float = 0.5, left: bool = False
) -> None:
    """Put a legend in rows under the axes, where it covers no data; by default of all that has a label."""
    if handles is None:
        handles = ax.get_legend_handles_labels()[0]
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
    """Label the horizontal axis with a movement in words, in mm."""
    ax.set_xlabel(f"{words}{' $y_s$' if words == OF_SITE else ''} (mm)")


def plain_number(value: float) -> str:
    """Text of a number to three figures, without an exponent."""
    return f"{float(f'{value:.3g}'):z.10f}".rstrip("0").rstrip(".")


ROUND = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0)  # digits of round numbers


def nearest_round(value: float, digits: Sequence[float] = ROUND) -> float:
    """Nearest number of these digits, times a power of ten, to a positive value on a logarithmic scale."""
    numbers = np.outer(10.0 ** (np.floor(np.log10(value)) + np.arange(2)), digits).ravel()
    return float(numbers[np.argmin(np.abs(np.log(numbers / value)))])


def spread_evenly(count: int, most: int) -> IntArray:
    """At most ``most`` of the numbers 0 to count - 1, at equal distances, the last among them."""
    return np.arange(count - 1, -1, -max(1, -(-count // most)))[::-1]
