"""One self-contained page of HTML from sections."""

from __future__ import annotations

import re
from functools import lru_cache
from importlib.resources import files
from typing import Any

from damagepred.report.parts import Drawing, Page

_CODE = re.compile(r"`([^`]+)`")
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:mm|m|kN|N|GPa|MPa|kPa|Pa|s|min|h|%)\b)")


def page_html(page: Page) -> str:
    """Report as one page of HTML, with styles, drawings and script inside.

    Examples
    --------
    >>> from damagepred.report.parts import Page
    >>> "<h1>a house</h1>" in page_html(Page("a house", "nothing yet", [], "At 8 mm:", [], [], []))
    True
    """
    parts = [*page.first, *(part for section in page.sections for part in section.parts)]
    script = [
        _file("fade.js"),
        _file("explorer.js") if any(isinstance(part, Drawing) and part.walls for part in parts) else "",
    ]
    return str(_template().render(page=page, style=_file("page.css"), script="".join(script))).lstrip()


@lru_cache(maxsize=1)
def _template() -> Any:
    import jinja2
    import markupsafe

    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined, finalize=_together
    )

    def with_code(text: str) -> markupsafe.Markup:
        return markupsafe.Markup(_CODE.sub(r"<code>\1</code>", str(markupsafe.escape(_together(text)))))

    environment.filters["code"] = with_code  # of text between backquotes
    environment.filters["verbatim"] = lambda text: markupsafe.escape(text)
    return environment.from_string(_file("page.html"))


def _together(value: Any) -> Any:
    """Insert non-breaking spaces between numbers and units; leave markup unchanged."""
    return _BEFORE_UNIT.sub("\u00a0", value) if type(value) is str else value


def _file(name: str) -> str:
    return files("damagepred.report").joinpath(name).read_text(encoding="utf-8")
