"""Figures as vector drawings inside a page: nothing they refer to lies outside, and no two of them share a name."""

from __future__ import annotations

import io
import re
from xml.etree import ElementTree as Tree

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from damagepred.plotting.sheet import figure_of

_SVG = "{http://www.w3.org/2000/svg}"
_LINK = "{http://www.w3.org/1999/xlink}href"
_REFERENCE = re.compile(r"url\(#([^)]+)\)")
_NUMBER = re.compile(r"-?\d+\.\d{3,}")

_UNIT = 2
"""Decimals of a coordinate: a hundredth of a point is finer than any printer."""


def svg_of(figure: Figure, prefix: str, label: str, along: Axes | None = None) -> str:
    """Figure as an ``<svg>`` element for a page of HTML, with letters as outlines; all ids begin with the prefix."""
    stream = io.BytesIO()
    nothing = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    with rc_context({"svg.fonttype": "path", "svg.hashsalt": prefix}):
        figure.draw_without_rendering()
        figure.set_layout_engine("none")  # save the layout that was measured
        box = figure.get_tightbbox().padded(0.05)
        figure.savefig(stream, format="svg", bbox_inches=box, metadata=nothing)
    root = Tree.fromstring(stream.getvalue())
    _own_names(root, prefix)
    # as large as it was meant to be, but never wider than the page
    width = float(root.get("width", "0").removesuffix("pt"))
    kept = {"viewBox": root.get("viewBox", ""), "style": f"width:{width:.0f}pt"}
    root.attrib.clear()
    root.attrib.update({"role": "img", "aria-label": label, "class": "drawing", **kept})
    if along is not None:
        root.attrib.update(_axes_data(along, box))
    return Tree.tostring(root, encoding="unicode", method="html")


def _axes_data(ax: Axes, box: Bbox) -> dict[str, str]:
    """Attributes of a drawing: place of the axes as shares of its width, and scale of the horizontal axis."""
    frame = ax.get_window_extent().transformed(figure_of(ax).dpi_scale_trans.inverted())
    low, high = ax.get_xlim()
    return {
        "data-left": f"{(frame.x0 - box.x0) / box.width:.4f}",
        "data-right": f"{(frame.x1 - box.x0) / box.width:.4f}",
        "data-from": f"{low:.6g}",
        "data-to": f"{high:.6g}",
        "data-scale": "log" if ax.get_xscale() == "log" else "linear",
    }


def _own_names(root: Tree.Element, prefix: str) -> None:
    """Give ids a prefix, take namespaces off names, round coordinates, drop what only files need."""
    used = {name for e in root.iter() for value in e.attrib.values() for name in _names_in(value)}
    for element in root.iter():
        for child in [c for c in element if c.tag in (f"{_SVG}metadata", f"{_SVG}title")]:
            element.remove(child)
        element.tag = element.tag.removeprefix(_SVG)
        element.tail = None
        if not (element.text or "").strip():
            element.text = None
        for key, value in list(element.attrib.items()):
            if key == "id":
                del element.attrib[key]
                if value in used:
                    element.set("id", f"{prefix}-{value}")
            elif key == _LINK:
                del element.attrib[key]
                # the gradient of a colour bar is a picture, inside the drawing
                element.set("href", f"#{prefix}-{value[1:]}" if value.startswith("#") else value)
            else:
                text = _REFERENCE.sub(lambda match: f"url(#{prefix}-{match[1]})", value)
                element.set(key, _NUMBER.sub(_shorter, text) if key in ("d", "x", "y", "style", "points") else text)


def _names_in(value: str) -> list[str]:
    return [value[1:]] if value.startswith("#") and " " not in value else _REFERENCE.findall(value)


def _shorter(match: re.Match[str]) -> str:
    return f"{float(match[0]):.{_UNIT}f}".rstrip("0").rstrip(".")
