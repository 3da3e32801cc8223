"""The contents of a figure in plain lines: axes, artists with their style, and their data in a few numbers."""

import re
from collections.abc import Iterator
from itertools import groupby
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import Collection, LineCollection, PathCollection, QuadMesh
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.table import Table
from matplotlib.text import Annotation, Text

from tests.recorded import data, number


def inventory(figure: Figure) -> list[str]:
    """One line for the figure, one per axes, one per artist or run of artists that differ in their data alone."""
    lines = [f"figure {number(figure.get_size_inches())}"]
    for ax in figure.axes:
        lines += of_axes(ax)
        for inset in ax.child_axes:
            lines += [
                f"inset {number(pixels(ax, *inset.get_axes_locator()(inset, None).get_points()))}",
                *of_axes(inset),
            ]
    return lines


def colours(values: Any) -> str:
    """Different colours in the order of their first use, with their numbers."""
    names = [to_hex(colour, keep_alpha=True) for colour in values]
    runs = {name: names.count(name) for name in names}
    shown = [name if count == 1 else f"{name}*{count}" for name, count in runs.items()]
    if len(shown) > 8:
        shown = [*shown[:4], f"{len(shown)}", *shown[-2:]]
    return " ".join(shown)


def pixels(ax: Axes, *points: Any) -> Any:
    """Points on paper from the lower left corner of axes, in hundredths of an inch."""
    return np.round((np.array(points) - ax.bbox.min) / ax.figure.dpi * 100, 1)


def of_axes(ax: Axes) -> Iterator[str]:
    frame = "".join(name[0] for name, spine in ax.spines.items() if spine.get_visible()) if ax.axison else "off"
    lines = "".join(one.axis_name for one in (ax.xaxis, ax.yaxis) if any(g.get_visible() for g in one.get_gridlines()))
    limits, scales = number([ax.get_xlim(), ax.get_ylim()]), f"{ax.get_xscale()} {ax.get_yscale()} {ax.get_aspect()}"
    yield f"AXES limits {limits} {scales} frame {frame} grid {lines} {'below' * (ax.get_axisbelow() is True)}"
    if words := ax.get_title(loc="left"):
        yield f"title {number(ax._left_title.get_fontsize())} {words!r}"
    for axis in (ax.xaxis, ax.yaxis):
        ticks, size = axis.get_majorticklocs(), [tick.label1.get_fontsize() for tick in axis.get_major_ticks(1)]
        names = [text for text in axis.get_major_formatter().format_ticks(ticks) if text]
        label = f"{axis.axis_name} {axis.get_label_text()!r} {number(axis.get_label().get_fontsize())}"
        yield f"{label} ticks {data(ticks)} {' '.join(names)!r} {number(size)} minor {len(axis.get_minorticklocs())}"
    elsewhere = (ax.patch, ax.xaxis, ax.yaxis, *ax.spines.values(), *ax.child_axes)
    artists = [described(ax, child) for child in ax.get_children() if child not in elsewhere]
    for style, run in groupby(filter(None, artists), key=lambda one: one[0]):
        parts = list(zip(*(values for _, values in run)))
        count = len(parts[0]) if parts else 1
        joined = [data(part[0] if count == 1 else np.concatenate([np.ravel(v) for v in part])) for part in parts]
        yield " ".join([*([f"{count} x"] if count > 1 else []), style, *joined])


def described(ax: Axes, artist: Artist) -> tuple[str, list[Any]] | None:
    label = re.sub(r"^_child\d+$", "_", str(artist.get_label()))
    alpha = f" alpha {artist.get_alpha():g}" if isinstance(artist.get_alpha(), float) else ""
    common = f"{label!r} z{artist.get_zorder():g}{alpha}{'' if artist.get_clip_on() else ' unclipped'}"
    if isinstance(artist, Line2D):
        x, y = artist.get_xdata(), artist.get_ydata()
        if artist.get_transform() != ax.transData:
            x, y = pixels(ax, *artist.get_transform().transform(np.column_stack((x, y)))).T
        return f"line {common} {of_handle(artist)} {artist.get_fillstyle()} {artist.get_drawstyle()}", [x, y]
    if isinstance(artist, Table):
        cells = list(artist.get_celld().values())
        sizes = [(c.get_width(), c.get_height(), c.get_linewidth(), c.get_fontsize()) for c in cells]
        return f"table {' | '.join(c.get_text().get_text() for c in cells)!r}", [sizes]
    if isinstance(artist, AxesImage):
        return f"image {common} {artist.cmap.name} {number(artist.get_clim())}", [artist.get_array()]
    if isinstance(artist, Collection):
        return of_collection(artist, common)
    if isinstance(artist, Legend):
        look = f"{artist._loc_real} {artist._ncols} {number([artist._fontsize, artist.borderaxespad])}"
        texts = zip(artist.legend_handles, artist.get_texts())
        place = number(pixels(ax, artist.get_bbox_to_anchor().min))
        return "\n".join([f"legend {look} {place}", *(f"  {of_handle(h)} {t.get_text()!r}" for h, t in texts)]), []
    if isinstance(artist, Text):
        return None if artist in (ax.title, ax._left_title, ax._right_title) else of_text(ax, artist, common)
    shape = artist.get_patch_transform().transform(artist.get_path().vertices)
    return f"{type(artist).__name__} {common} {of_handle(artist)}", [shape[:, 0], shape[:, 1]]


def of_collection(artist: Collection, common: str) -> tuple[str, list[Any]]:
    edge = artist.get_edgecolor()
    paint = [] if isinstance(artist, LineCollection) else artist.get_facecolor()
    style = (
        f"{type(artist).__name__} {common} fill {colours(paint)} edge {colours(edge)} {data(artist.get_linewidth())}"
    )
    style += f" {artist.get_hatch() or ''} {artist.get_capstyle() or ''} {artist.get_snap()}"
    style += "".join(sorted({f" dashes {number(d)}" for _, d in artist.get_linestyle() if d is not None}))
    if isinstance(artist, PathCollection):
        points = np.asarray(artist.get_offsets())
    elif isinstance(artist, QuadMesh):
        points = artist.get_coordinates().reshape(-1, 2)
    else:
        points = np.concatenate([np.empty((0, 2)), *(path.vertices for path in artist.get_paths())])
    values = [] if artist.get_array() is None else [artist.get_array()]
    return f"{len(artist.get_paths())} of {style}", [points[:, 0], points[:, 1], *values]


def of_text(ax: Axes, text: Text, common: str) -> tuple[str, list[Any]]:
    """Style and place of a text, with the box and the arrow of an annotation."""
    style = f"text {text.get_text()!r} {text.get_ha()} {text.get_va()} {text.get_fontsize():.4g}"
    style += f" {to_hex(text.get_color(), True)} {text.get_weight()} {text.get_rotation():g} {common}"
    if (box := text.get_bbox_patch()) is not None:
        style += f" box {of_handle(box)} {box.get_boxstyle().pad:g}"
    if not isinstance(text, Annotation):
        return style, [pixels(ax, text.get_transform().transform(text.get_position()))]
    style += f" {text.xycoords} {text.anncoords} {text.get_annotation_clip()}"
    if text.arrow_patch is not None:
        style += " arrow " + " ".join(f"{key} {value}" for key, value in text.arrowprops.items())
    return style, [text.xy, text.xyann]


def of_handle(handle: Artist) -> str:
    if isinstance(handle, Line2D):
        dashes = number(handle._dash_pattern[1]) if handle.is_dashed() else ""
        ink = [to_hex(c, True) for c in (handle.get_color(), handle.get_mec(), handle.get_mfc())]
        width, size = handle.get_linewidth(), handle.get_markersize()
        return f"{ink[0]} {width:g} {handle.get_linestyle()} {dashes} {handle.get_marker()} {size:g} {ink[1]} {ink[2]}"
    if isinstance(handle, Patch):
        ink = f"{to_hex(handle.get_facecolor(), True)} {to_hex(handle.get_edgecolor(), True)}"
        return f"{ink} {handle.get_linewidth():g} {handle.get_hatch() or ''}"
    return colours(handle.get_edgecolor()) if isinstance(handle, Collection) else type(handle).__name__
