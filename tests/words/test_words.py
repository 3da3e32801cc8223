"""The dictionary of the guide: one row a term, and each file that it names is there."""

from __future__ import annotations

import re
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "damagepred"
ROWS = [
    re.split(r"(?<!\\)\|", line)[1:-1]
    for line in (PACKAGE / "guide" / "words.md").read_text(encoding="utf-8").splitlines()
    if line.startswith("| ") and not line.startswith("| term")
]


def test_a_term_stands_once_with_its_meaning() -> None:
    terms = [row[0].strip() for row in ROWS]
    assert len(terms) == len(set(terms)) > 60
    assert [row[0] for row in ROWS if not re.search(r"[.]\s*$", row[1])] == []


def test_every_file_named_is_there() -> None:
    missing = [row[-1] for row in ROWS for name in re.findall(r"`([^`]+)`", row[-1]) if not (PACKAGE / name).is_file()]
    assert missing == []
