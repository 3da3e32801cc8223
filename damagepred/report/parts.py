"""Parts of a page: sections, texts, tables, drawings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from damagepred.results.tables import Table

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Text:
    """Paragraphs; with ``items`` a list below the last."""

    paragraphs: Sequence[str] = ()
    items: Sequence[str] = ()

    kind = "text"


@dataclass(frozen=True)
class Drawing:
    """A figure.

    Attributes
    ----------
    name : str
        One word, the prefix of its ids.
    caption : str
        Below it.
    label : str
        What it shows, for those who do not see it.
    svg : str
        The drawing.
    walls : str
        Walls that a reader can move in its place, as ``damagepred.report.explorer`` packs them; empty: none.
    choices : sequence of str
        Names of the walls, if there are several.
    """

    name: str
    caption: str
    label: str
    svg: str
    walls: str = ""
    choices: Sequence[str] = ()

    kind = "drawing"


@dataclass(frozen=True)
class Listing:
    """A file or commands, word for word."""

    caption: str
    text: str

    kind = "listing"


Part = Text | Table | Drawing | Listing


@dataclass
class Section:
    """A chapter of a page.

    Attributes
    ----------
    name : str
        One word, its anchor.
    title : str
        Heading.
    parts : list of Part
        Parts or sections in order.
    """

    name: str
    title: str
    parts: list[Part] = field(default_factory=list)


@dataclass(frozen=True)
class Page:
    """A whole report.

    Attributes
    ----------
    title, subtitle : str
        Of what, and what kind of report.
    warnings : sequence of str
        Unfinished or failed parts, to be read first.
    question : str
        What the answers are for, such as a movement.
    answers : sequence of str
        The results in short sentences.
    facts : sequence of (str, str)
        What they are of, in brief.
    sections : sequence of Section
        Parts or sections in order.
    """

    title: str
    subtitle: str
    warnings: Sequence[str]
    question: str
    answers: Sequence[str]
    facts: Sequence[tuple[str, str]]
    sections: Sequence[Section]


def drawing(
    name: str,
    caption: str,
    label: str,
    ax: Axes,
    *,
    walls: Mapping[str, xr.Dataset] | None = None,
    along: Literal["", "movement"] = "",
) -> Drawing:
    """Make the figure that axes stand on part of a page."""
    from damagepred.plotting.sheet import figure_of
    from damagepred.plotting.vector import svg_of
    from damagepred.report.explorer import explorer

    svg = svg_of(figure_of(ax), name, label, ax if along else None)
    if not walls:
        return Drawing(name, caption, label, svg)
    return Drawing(name, caption, label, svg, explorer(walls), tuple(walls) if len(walls) > 1 else ())
