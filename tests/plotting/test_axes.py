"""Drawings compose: each draws on the axes it is given, in a figure of the user's own, and returns them."""

from __future__ import annotations

from xml.etree import ElementTree

import matplotlib.pyplot as plt
import pytest
import xarray as xr
from matplotlib.figure import Figure

from damagepred import plotting
from damagepred.damage import load_table
from damagepred.plotting.colours import CATEGORY_COLOURS, width_colours
from damagepred.plotting.fragility import _mark_limits
from damagepred.plotting.vector import svg_of

OF_WALLS = ["draw_wall", "draw_cracks", "draw_history"]


def test_one_figure_takes_drawings_side_by_side(on_dpc: xr.Dataset) -> None:
    plt.close("all")
    figure, axes = plt.subplots(2, 4, figsize=(30, 14), layout="constrained")
    for variable, ax in zip(("stress_xx", "contact_opening", "opening_width_change", "dpc_opening"), axes[1]):
        assert plotting.draw(on_dpc, variable, ax) is ax
    for name, ax in zip(OF_WALLS, axes.flat):
        assert getattr(plotting, name)(on_dpc, ax) is ax
    figure.canvas.draw()
    assert plt.get_fignums() == [figure.number]  # nothing else was opened
    plt.close(figure)


@pytest.mark.parametrize(("scale", "limits"), [("log", (0.1, 10.0)), ("linear", (-2.0, 30.0))])
def test_a_drawing_tells_the_page_where_its_axes_are(scale: str, limits: tuple[float, float]) -> None:
    figure, ax = plt.subplots(figsize=(4.0, 3.0))
    ax.set(xscale=scale, xlim=limits)
    root = ElementTree.fromstring(svg_of(figure, "a", "axes", ax))
    assert root.get("data-scale") == scale
    assert (float(root.attrib["data-from"]), float(root.attrib["data-to"])) == limits
    width = float(root.attrib["viewBox"].split()[2]) / 72.0  # inches
    shares = float(root.attrib["data-right"]) - float(root.attrib["data-left"])
    assert shares * width == pytest.approx(ax.get_position().width * 4.0, rel=1e-3)
    plt.close(figure)


def test_limits_of_a_long_wall_are_labelled_by_what_governs() -> None:
    """AS 2870 Table 4.1 at 15 m: 1/2000 of the length is 7.5 mm; 15, 20, 30 and 40 mm are below their shares."""
    ax = Figure().add_subplot()
    ax.set_xlim(0.0, 60.0)
    _mark_limits(ax, 15.0)
    assert [text.get_text() for text in ax.texts] == ["L/2000", "15 mm", "20 mm", "30 mm", "40 mm"]


def test_colours_of_widths_change_at_the_limits():
    colours, norm = width_colours(load_table("bre251"))
    limits = [0.1, 1.0, 5.0, 15.0, 25.0]
    assert norm.boundaries[:-1].tolist() == pytest.approx([0.0, *limits])
    assert [norm(w) for w in (0.05, 0.1, 0.99, 1.0, 14.0, 24.9, 25.0, 90.0)] == [0, 1, 1, 2, 3, 4, 5, 5]
    assert [c.lower() for c in colours.colors] == list(CATEGORY_COLOURS)
