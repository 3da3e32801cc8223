"""Phrases that make a sentence hard to read: each room's number of them may only fall.

`python tests/words/test_sentences.py` prints the places; with `--record` it writes the numbers as the new limits.
"""

import ast
import csv
import io
import re
import sys
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "damagepred"
LIMITS = Path(__file__).with_name("sentences.csv")

NOUNS = "row|value|number|sentence|line|file|class|column|part|name|word|page|task|array|matrix|wall"
THINGS = "wall|study|table|file|joint|block|archive|scene|kernel|curve|test|page|array|path|step|folder"
AFTER_WHAT = "is|was|are|has|have|it|they|holds?|gives?|a|an|the|can|of|follows|each|that|this|does?|users?|keeps?"
PHRASES = {
    "a description without a noun": r"^(?:Of|As|By|In|With|Its|Their|See|For|On)\b(?:\s+\S+){0,5}\.$",
    "'what' for a noun": rf"\bwhat (?:{AFTER_WHAT})\b",
    "'Return whether' for the result": r"^(?:Return|Tell|Say|Give) (?:what|how|whether|where|which|if)\b",
    "a pronoun for a noun": r"\b(?:that of|those (?:of|that|which|in|on|at)|the ones)\b",
    "a condition left out": r"\b(?:None|nothing|none|nowhere) (?:if|of|where|is)\b|, (?:none|nothing)\b",
    "a rate without 'per'": rf"\b(?:a|one) (?:{NOUNS}) an? [a-z]+",
    "an old word": r"\b(?:anew|besides|but for|anyhow|sooner|hardly|else)\b",
    "a thing that acts": rf"\b(?:{THINGS})s? (?:knows?|says?|asks?|bears?|stands?|goes|tells?|wants?|takes?|gives?)\b",
    "a quantity without its name": r"\b(?:so|how) (?:many|much|far|large|long|likely|surely)\b",
}
READY = {name: re.compile(pattern) for name, pattern in PHRASES.items()}


def written(source: str) -> Iterator[str]:
    """Yield the lines of docstrings, of messages of five words or more, and of comments."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and len(node.value.split()) > 1:
            yield from node.value.splitlines()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT and not re.match(r"#\s*(?:type|noqa|---)", token.string):
            yield token.string.lstrip("# ")


def hits(line: str) -> list[str]:
    line = line.strip()
    return [] if line.startswith((">>>", "...", "[")) else [n for n, p in READY.items() for _ in p.findall(line)]


def counted(show: bool = False) -> Counter[str]:
    number: Counter[str] = Counter()
    for path in sorted(PACKAGE.rglob("*.py")):
        room = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
        for line in written(path.read_text(encoding="utf-8")):
            names = hits(line)
            number[room] += len(names)
            if names and show:
                print(f"{path.relative_to(PACKAGE.parent)}: {', '.join(names)}: {line.strip()}")
    return number


def test_hard_phrases_are_seen() -> None:
    assert hits("Of the table.") == ["a description without a noun"]
    assert hits("Return whether a bond holds, none of them elsewhere.") == [
        "'Return whether' for the result",
        "a condition left out",
    ]
    assert hits("one row per crack, the stiffness of the joint") == []


def test_no_room_has_more_hard_phrases_than_before() -> None:
    with LIMITS.open(newline="") as file:
        limits = {row["room"]: int(row["phrases"]) for row in csv.DictReader(file)}
    more = {room: (number, limits.get(room, 0)) for room, number in counted().items() if number > limits.get(room, 0)}
    assert not more, f"(now, allowed): {more}; python {Path(__file__).name} shows the places"


if __name__ == "__main__":
    numbers = counted(show="--record" not in sys.argv)
    if "--record" in sys.argv:
        rows = "".join(f"{room},{number}\n" for room, number in sorted(numbers.items()) if number)
        LIMITS.write_text("room,phrases\n" + rows, encoding="utf-8")
    print(sum(numbers.values()))
