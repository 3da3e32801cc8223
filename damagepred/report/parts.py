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
    """Figure: prefix of its ids, caption, label for readers who do not see it, drawing; walls for the slider."""

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
    """Chapter of a page: anchor, heading, parts in order."""

    name: str
    title: str
    parts: list[Part] = field(default_factory=list)


@dataclass(frozen=True)
class Page:
    """Report: head for the file, warnings, answers to a question, facts, first parts, sections, appendix."""

    title: str
    subtitle: str
    warnings: Sequence[str]
    question: str
    answers: Sequence[str]
    facts: Sequence[tuple[str, str]]
    sections: Sequence[Section]
    head: Mapping[str, str] = field(default_factory=dict)
    first: Sequence[Part] = ()
    appendix: Sequence[Section] = ()


def drawing(
    name: str,
    caption: str,
    label: str,
    ax: Axes,
    *,
    walls: Mapping[str, xr.Dataset] | None = None,
    along: Literal["", "movement"] = "",
) -> Drawing:
    """Figure of some axes as part of a page, where the caption replaces the titles."""
    from damagepred.plotting.sheet import figure_of
    from damagepred.plotting.vector import svg_of
    from damagepred.report.explorer import explorer

    for each in figure_of(ax).axes:
        each.set_title("", loc="left")
    svg = svg_of(figure_of(ax), name, label, ax if along else None)
    if not walls:
        return Drawing(name, caption, label, svg)
    return Drawing(name, caption, label, svg, explorer(walls), tuple(walls) if len(walls) > 1 else ())
