"""Names that were replaced by the field's own (``retired.csv``: old, new) do not come back."""

import csv
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RETIRED = {row["retired"]: row["now"] for row in csv.DictReader((Path(__file__).parent / "retired.csv").open())}
WORD = re.compile(rf"(?<![\w.-])({'|'.join(map(re.escape, RETIRED))})(?!\w)")


def found_in(text: str) -> list[str]:
    """Return the retired names in a text, each with its successor."""
    return sorted({f"{name}: now {RETIRED[name]}" for name in WORD.findall(text)})


def test_a_retired_name_is_seen() -> None:
    name = next(iter(RETIRED))
    assert found_in(f"x = {name}(y)") == [f"{name}: now {RETIRED[name]}"]
    assert found_in(f"x = {name}s(y)") == []


def test_no_retired_name_is_used() -> None:
    assert len(RETIRED) > 100
    places = [
        f
        for room in ("damagepred", "studies", "tests")
        for kind in ("py", "md")
        for f in (ROOT / room).rglob(f"*.{kind}")
    ]
    found = {str(file.relative_to(ROOT)): found_in(file.read_text(encoding="utf-8")) for file in places}
    assert {name: words for name, words in found.items() if words} == {}
