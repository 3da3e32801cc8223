"""Reports as one self-contained page of HTML, and as files."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from datetime import datetime
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from damagepred.archive.files import check_output, read_dataset, write_text
from damagepred.archive.folder import StudyFolder
from damagepred.errors import InputError
from damagepred.inputs.arguments import checked
from damagepred.report.parts import Drawing, Page

if TYPE_CHECKING:
    from damagepred.one_wall.judged_path import Step
    from damagepred.uq.movement_distribution import MovementDistribution


_CODE = re.compile(r"`([^`]+)`")
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:mm|m|kN|N|GPa|MPa|kPa|Pa|s|min|h|%)\b)")


def page_html(page: Page) -> str:
    """Report as one page of HTML, with styles, drawings and script inside."""
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
    environment.filters["verbatim"] = markupsafe.escape
    return environment.from_string(_file("page.html"))


def _together(value: Any) -> Any:
    """Insert non-breaking spaces between numbers and units; leave markup unchanged."""
    return _BEFORE_UNIT.sub("\u00a0", value) if type(value) is str else value


def _file(name: str) -> str:
    return files("damagepred.report").joinpath(name).read_text(encoding="utf-8")


@checked
def write_report(
    path: str | Path,
    output: str | Path | None = None,
    *,
    replay: bool = True,
    confidence: float = 0.9,
    bootstrap: int = 1000,
    at: float | str | MovementDistribution | None = None,
    posterior: str | Path | None = None,
    measures: Sequence[str | Path] = (),
    on_step: Callable[[Step], None] | None = None,
) -> Path:
    """Write the report of a solved wall or a study as one page of HTML.

    Parameters
    ----------
    path : str or Path
        Result of solve or replay (``*.nc``), or study folder (``*.dp``).
    output : str or Path, optional
        File to write; by default ``house_report.html`` beside ``house.dp`` or ``house.nc``.
    replay : bool
        Whether a typical wall of a study is solved again, to draw it.
    confidence : float
        Of bands and intervals of a study.
    bootstrap : int
        Resamples of a study's walls for the bands of its curves.
    at : float, str or MovementDistribution, optional
        Of a study: the movement (m, or a text such as "60 mm"), site class ("H1") or distribution of the movement that
        the summary answers for; by default the study's own movement.
    posterior : str or Path, optional
        Of a study: file of a back-analysis with it, as ``damagepred infer -o`` writes it; it gets a section.
    measures : sequence of str or Path
        Of a study: folders of the same study with a measure each, to compare.
    on_step : callable, optional
        Called with each increment of the wall that is solved again.

    Examples
    --------
    >>> import damagepred
    >>> place = damagepred.report.write_report("house.dp", "page.html", at="3 mm", replay=False, bootstrap=50)
    >>> "Category 2 (slight) or worse: probability" in place.read_text(encoding="utf-8")
    True
    """
    source = Path(path)
    place = source if source.name not in ("", "..") else source.resolve()
    file = place.with_name(f"{place.stem}_report.html") if output is None else Path(output)
    if not source.exists():
        raise InputError(f"{source}: no such file or study folder.")
    check_output(file, ".html", ".htm", inputs=[source])
    written = datetime.now().astimezone().isoformat(sep=" ", timespec="minutes")
    if source.is_dir():
        from damagepred.report.study import study_page

        folder = StudyFolder(source)
        folder.require()
        page = study_page(
            folder,
            written,
            replay=replay,
            confidence=confidence,
            bootstrap=bootstrap,
            at=at,
            posterior=None if posterior is None else Path(posterior),
            measures=[Path(each) for each in measures],
            on_step=on_step,
        )
    else:
        from damagepred.report.wall import wall_page
        from damagepred.uq.movement_distribution import as_distribution

        given = {"posterior": posterior, "measures": ", ".join(map(str, measures)) or None}
        given["at"] = None if at is None else as_distribution(at).name
        if refused := [f"{name} = {value}" for name, value in given.items() if value is not None]:
            raise InputError(f"{refused[0]}: goes with a study; {source} is one wall, whose report has the whole path.")
        page = wall_page(read_dataset(source), source.name, written)
    write_text(file, page_html(page))
    return file
