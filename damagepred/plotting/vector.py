"""Figures as vector drawings inside a page: nothing they refer to lies outside, and no two of them share a name."""

from __future__ import annotations

import io
import re
from html import escape

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from damagepred.plotting.sheet import figure_of

_LEFT_OUT = re.compile(r"<metadata>.*?</metadata>|<!--.*?-->", re.DOTALL)
_NAME = re.compile(r'(\bid="|href="#|url\(#)')
_COORDINATES = re.compile(r'\s(?:d|x|y|style|points)="[^"]*"')
_NUMBER = re.compile(r"-?\d+\.\d{3,}")


def svg_of(figure: Figure, prefix: str, label: str, along: Axes | None = None) -> str:
    """Figure as an ``<svg>`` element for HTML; ids begin with the prefix; ``along``: axes whose place it states."""
    stream = io.BytesIO()
    nothing = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    with rc_context({"svg.fonttype": "path", "svg.hashsalt": prefix}):
        figure.draw_without_rendering()
        figure.set_layout_engine("none")  # save the layout that was measured
        box = figure.get_tightbbox().padded(0.05)
        figure.savefig(stream, format="svg", bbox_inches=box, metadata=nothing)
    _, size, content = re.split(r"<svg\b([^>]*)>", stream.getvalue().decode("utf-8"), maxsplit=1)
    given = dict(re.findall(r'(\w+)="([^"]*)"', size))
    # as large as it was meant to be, but never wider than the page
    style = f"width:{float(given['width'].removesuffix('pt')):.0f}pt"
    attributes = {"role": "img", "aria-label": label, "class": "drawing", "viewBox": given["viewBox"], "style": style}
    if along is not None:
        frame = along.get_window_extent().transformed(figure_of(along).dpi_scale_trans.inverted())
        low, high = along.get_xlim()
        attributes |= {
            "data-left": f"{(frame.x0 - box.x0) / box.width:.4f}",
            "data-right": f"{(frame.x1 - box.x0) / box.width:.4f}",
            "data-from": f"{low:.6g}",
            "data-to": f"{high:.6g}",
            "data-scale": "log" if along.get_xscale() == "log" else "linear",
        }
    content = re.sub(r">\s+<", "><", _LEFT_OUT.sub("", content).replace("xlink:href", "href").strip())
    content = _NAME.sub(rf"\g<1>{prefix}-", content)
    # a hundredth of a point is finer than any printer
    content = _COORDINATES.sub(lambda match: _NUMBER.sub(lambda n: f"{float(n[0]):.2f}", match[0]), content)
    words = " ".join(f'{key}="{escape(value)}"' for key, value in attributes.items())
    return f"<svg {words}>{content}"
