"""Shipped data, where they are and how sure: materials, statistics, damage tables, reference scenes."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

from damagepred.errors import InputError, nearest

CONFIDENCE = {
    "reported": "in the paper or test report named",
    "secondary": "read in another source",
    "derived": "derived from other figures",
    "assumed": "general knowledge, not checked against a source",
}
"""Levels of confidence of a figure, and their meaning."""

_PACKAGE = Path(__file__).resolve().parents[1]


def data_folder() -> Path:
    """Return the folder of shipped data, in an installed package or in a checkout."""
    installed = _PACKAGE / "data"
    return installed if installed.is_dir() else _PACKAGE.parent / "data"


def data_file(*parts: str) -> Path:
    """Return the path of one shipped file."""
    path = data_folder().joinpath(*parts)
    if not path.is_file():
        siblings = sorted(p.name for p in path.parent.glob("*")) if path.parent.is_dir() else []
        raise InputError(
            f"no shipped data file '{'/'.join(parts)}'; available there: {', '.join(siblings) or 'nothing'}."
            + nearest(path.name, siblings)
        )
    return path


@cache
def data_tables(*parts: str) -> dict[str, Any]:
    """Content of one shipped TOML file."""
    return tomllib.loads(data_file(*parts).read_text(encoding="utf-8"))
