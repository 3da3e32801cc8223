"""Exports as files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import xarray as xr

from damagepred.archive.files import check_output, write_text, write_whole
from damagepred.errors import InputError, nearest
from damagepred.exports.openquake import openquake_xml
from damagepred.exports.pelicun import pelicun_config, pelicun_frame
from damagepred.inputs.arguments import checked
from damagepred.inputs.text import csv_safe

if TYPE_CHECKING:
    import pandas as pd

FORMATS = {"pelicun": "_pelicun.csv", "openquake": "_openquake.xml", "openquake-discrete": "_openquake_discrete.xml"}
"""Export formats, and the endings of their file names."""


def write_csv(frame: pd.DataFrame, path: Path, *, index: bool = True) -> None:
    """Write a table as CSV."""
    check_output(path, ".csv")
    write_whole(path, lambda p: csv_safe(frame).to_csv(p, index=index))


def export_place(kind: str, beside: str | Path) -> Path:
    """Path of an export: a file of its kind, or beside another file or a study folder, under its name."""
    if kind not in FORMATS:
        raise InputError(f"format = {kind!r}: exports are {', '.join(FORMATS)}." + nearest(kind, FORMATS))
    path = Path(beside)
    return path if path.suffix == Path(FORMATS[kind]).suffix else path.with_name(path.stem + FORMATS[kind])


@checked
def export_curves(
    curves: xr.Dataset,
    kind: str,
    beside: str | Path,
    categories: Sequence[int | str] | None = None,
    extrapolated: bool = False,
) -> list[Path]:
    """Write fragility curves for another program.

    Parameters
    ----------
    curves : xarray.Dataset
        Curves from ``damagepred.fit_fragility``.
    kind : {"pelicun", "openquake", "openquake-discrete"}
        For pelicun a damage model as CSV, with the options that define the demand as JSON; for OpenQuake a fragility
        model as NRML 0.5.
    beside : str or Path
        File to write, or file or study folder beside which the export gets its name: ``house.dp`` makes
        ``house_pelicun.csv``.
    categories : sequence of int or str, optional
        Categories to export; by default all.
    extrapolated : bool
        Whether to export curves whose median lies beyond the largest movement of the walls.

    Examples
    --------
    >>> from damagepred import exports, fit_fragility, open_study
    >>> curves = fit_fragility(open_study("house.dp"), bootstrap=20)
    >>> [path.name for path in exports.export_curves(curves, "pelicun", "house.dp", categories=[2])]
    ['house_pelicun.csv', 'house_pelicun.json']
    """
    path = export_place(kind, beside)
    check_output(path, path.suffix)
    if kind == "pelicun":
        frame = pelicun_frame(curves, categories=categories, extrapolated=extrapolated)
        write_csv(frame, path)
        options = path.with_suffix(".json")
        write_text(options, json.dumps(pelicun_config(curves), indent=2) + "\n")
        return [path, options]
    form: Literal["continuous", "discrete"] = "discrete" if kind.endswith("discrete") else "continuous"
    write_text(path, openquake_xml(curves, form, categories=categories, extrapolated=extrapolated))
    return [path]
