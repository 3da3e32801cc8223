"""Text that a user wrote, made safe for where it is read: terminals, pictures, XML, spreadsheets."""

from __future__ import annotations

import datetime as dt
import re
import unicodedata
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

LONGEST_TITLE = 500  # characters of a title
FORMULA = ("=", "+", "-", "@")  # beginnings of a formula in a spreadsheet


def is_control(character: str) -> bool:
    """Whether a character steers a terminal, or may not stand in XML, instead of being read."""
    return unicodedata.category(character) in ("Cc", "Cs")


def without_controls(text: str) -> str:
    """Return text without control characters."""
    return "".join(c for c in text if not is_control(c))


def controls_escaped(text: str) -> str:
    """Return text with control characters, except ends of lines, as escapes."""
    return "".join(ascii(c)[1:-1] if is_control(c) and c != "\n" else c for c in text)


def check_title(text: str) -> str:
    """Return a title as it is."""
    if any(map(is_control, text)):
        raise ValueError(f"{controls_escaped(text)[:80]!r} has control characters; a title is one line of plain text")
    if len(text) > LONGEST_TITLE:
        raise ValueError(f"has {len(text)} characters; at most {LONGEST_TITLE}")
    return text


def written_date(text: str) -> dt.date:
    """Date of a text such as 2026-11-28 or 28.11.2026 (ValueError)."""
    day_first = re.fullmatch(r"(\d{1,2})\.(\d{1,2})\.(\d{4})", text.strip())
    parts = day_first.groups()[::-1] if day_first else text.strip().split("-")
    if len(parts) != 3 or not re.fullmatch(r"\d{4} \d{1,2} \d{1,2}", " ".join(parts)):
        raise ValueError("must be a date such as 2026-11-28 or 28.11.2026")
    try:
        return dt.date(*map(int, parts))
    except ValueError as error:
        raise ValueError(f"is no date ({error}); give one such as 2026-11-28") from None


def category_names(names: Iterable[object]) -> tuple[str, ...]:
    """Names of categories: different words of letters of any script, as the archive's flag meanings take them."""
    normal = [unicodedata.normalize("NFC", str(name)) for name in names]
    kinds = ["".join(c if c in " _-" else unicodedata.category(c)[0] for c in name) for name in normal]
    if bad := [n for n, kind in zip(normal, kinds) if not re.fullmatch(r"[LNM][LNM _-]{0,39}", kind)]:
        raise ValueError(f"category name {bad[0][:40]!r}: must be at most 40 letters, digits, spaces, '_' and '-'")
    flags = [name.replace(" ", "_") for name in normal]
    if twice := [name for name, flag in zip(normal, flags) if flags.count(flag) > 1]:
        raise ValueError(f"category name {twice[0]!r}: two categories have it")
    return tuple(normal)


def csv_safe(frame: pd.DataFrame) -> pd.DataFrame:
    """Return a table whose texts no spreadsheet runs as formulas: an apostrophe stands before them."""
    return frame.map(lambda cell: f"'{cell}" if isinstance(cell, str) and cell.startswith(FORMULA) else cell)
