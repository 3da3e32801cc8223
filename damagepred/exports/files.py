"""Exports as files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import xarray as xr

from damagepred.archive.files import check_output, write_whole
from damagepred.errors import InputError, nearest
from damagepred.exports.openquake import openquake_xml
from damagepred.exports.pelicun import pelicun_config, pelicun_frame
from damagepred.inputs.arguments import checked
from damagepred.inputs.text import csv_safe

if TYPE_CHECKING:
    import pandas as pd

FORMATS = {"pelicun": "_pelicun.csv", "openquake": "_openquake.xml", "openquake-discrete": "_openquake_discrete.xml"}
"""What can be exported, and the end of the file's name."""


def write_csv(frame: pd.DataFrame, path: Path, *, index: bool = True) -> None:
    """Write a table as CSV, whole or not at all.

    Parameters
    ----------
    frame : pandas.DataFrame
        The table.
    path : Path
        File to write.
    index : bool
        Whether the index becomes columns.

    Raises
    ------
    StudyError
        If it cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from damagepred import exports, open_study, walls_frame
    >>> exports.write_csv(walls_frame(open_study("house.dp")), Path("house.csv"))
    >>> len(Path("house.csv").read_text().splitlines())
    25
    """
    check_output(path, ".csv")
    write_whole(path, lambda p: csv_safe(frame).to_csv(p, index=index))


@checked
def export_place(kind: str, beside: str | Path) -> Path:
    """Return where an export goes: to a file of its kind, or beside another file or a study folder, under its name.

    Parameters
    ----------
    kind : str
        One of ``FORMATS``.
    beside : str or Path
        Such as ``curves.nc`` or ``house.dp``, or ``model.xml`` for the file itself.

    Raises
    ------
    InputError
        If the format is not known.

    Examples
    --------
    >>> from damagepred import exports
    >>> str(exports.export_place("pelicun", "house.dp"))
    'house_pelicun.csv'
    """
    if kind not in FORMATS:
        raise InputError(f"format = {kind!r}: exports are {', '.join(FORMATS)}." + nearest(kind, FORMATS))
    place = Path(beside)
    return place if place.suffix == Path(FORMATS[kind]).suffix else place.with_name(place.stem + FORMATS[kind])


@checked
def export_curves(
    curves: xr.Dataset,
    kind: str,
    beside: str | Path,
    categories: Sequence[int] | None = None,
    extrapolated: bool = False,
) -> list[Path]:
    """Write fragility curves for another program.

    Parameters
    ----------
    curves : xarray.Dataset
        As ``damagepred.fit_fragility`` returns it.
    kind : {"pelicun", "openquake", "openquake-discrete"}
        For pelicun a damage model as CSV, and beside it, as JSON, the options an assessment needs to know the demand;
        for OpenQuake a fragility model as NRML 0.5.
    beside : str or Path
        See ``export_place``.
    categories : sequence of int, optional
        By default all.
    extrapolated : bool
        Whether curves are exported whose median lies beyond the largest movement to which a wall was followed.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    InputError
        If the curves cannot be exported so; the message says why.
    StudyError
        If a file cannot be written.

    Examples
    --------
    >>> from damagepred import exports, fit_fragility, open_study
    >>> curves = fit_fragility(open_study("house.dp"), bootstrap=20)
    >>> [path.name for path in exports.export_curves(curves, "pelicun", "house.dp", categories=[2])]
    ['house_pelicun.csv', 'house_pelicun.json']
    """
    place = export_place(kind, beside)
    check_output(place, place.suffix)
    if kind == "pelicun":
        frame, options = (
            pelicun_frame(curves, categories=categories, extrapolated=extrapolated),
            place.with_suffix(".json"),
        )
        config = json.dumps(pelicun_config(curves), indent=2) + "\n"
        write_csv(frame, place)
        write_whole(options, lambda p: p.write_text(config, encoding="utf-8"))
        return [place, options]
    form: Literal["continuous", "discrete"] = "discrete" if kind.endswith("discrete") else "continuous"
    xml = openquake_xml(curves, form, categories=categories, extrapolated=extrapolated)
    write_whole(place, lambda p: p.write_text(xml, encoding="utf-8"))
    return [place]
