"""Markdown pages as tests see them: blocks of code with the comments before them, and sentences of prose.

Comments before a block say how it is run (CONTRIBUTING.md):

<!-- file: NAME -->          the block is written to that file
<!-- quick: OLD => NEW -->   the tests replace OLD by NEW, such as a number of samples; \\n is a new line
<!-- slow -->                only the test marked slow runs the block
<!-- not run: REASON -->     no test runs it
"""

import re
import runpy
from pathlib import Path
from typing import NamedTuple

from damagepred.guide import TOPICS
from tests.conftest import ROOT

REFERENCE = runpy.run_path(str(ROOT / ".ci" / "reference_pages.py"))
PAGES = REFERENCE["PAGES"]
"""Pages that the code writes: topic -> function."""

GUIDE = ROOT / "damagepred" / "guide"
WRITTEN = {"README": ROOT / "README.md"} | {t: GUIDE / f"{t}.md" for t in TOPICS if t not in PAGES}
"""Pages written by hand, by name."""

ALL = WRITTEN | {t: GUIDE / f"{t}.md" for t in PAGES}

_BLOCK = re.compile(r"((?:^<!-- [^\n]* -->\n)*)^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


class Block(NamedTuple):
    """A block of code: what the comments before it say, its language, its text."""

    comments: dict[str, list[str]]
    language: str
    text: str

    def quick(self) -> str:
        """Return the text with the replacements of the tests."""
        text = self.text
        for pair in self.comments.get("quick", []):
            old, new = pair.split(" => ")
            assert old in text, f"quick: '{old}' is not in the block"
            text = text.replace(old, new.replace("\\n", "\n"))
        return text


def blocks(path: Path) -> list[Block]:
    found = []
    for comments, language, text in _BLOCK.findall(path.read_text(encoding="utf-8")):
        said: dict[str, list[str]] = {}
        for line in re.findall(r"<!-- (.*) -->", comments):
            key, _, value = line.partition(": ")
            said.setdefault(key, []).append(value)
        found.append(Block(said, language, text))
    return found


def sentences(text: str) -> list[str]:
    """Sentences of a page, without code, equations, tables, comments and headings."""
    text = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"^\$\$$.*?^\$\$$", "", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"<!--.*?-->", "", text)
    text = re.sub(r"!\[([^\]]*)\]\([^)]*\)", "", text)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"^> ?", "", text, flags=re.MULTILINE)
    text = re.sub(r"^\| `\w+`[^|]* \|.* \| (.*) \|$", r"- \1", text, flags=re.MULTILINE)  # meaning of a key
    text = re.sub(r"^(\||#).*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"^\*References\.\*.*?(\n\n|\Z)", "\n\n", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"^- `[^`]*` \(.*?\):", "-", text, flags=re.MULTILINE | re.DOTALL)  # facts of a key or variable
    text = re.sub(r"`[^`]*`|\$[^$\n]*\$", "Code", text)
    paragraphs = re.split(r"\n\s*\n|\n(?=[-*] |\d+\. )", text)
    return [s for p in paragraphs for s in re.split(r"(?<=[.?!])\*{0,2}\s+(?=[\"*(A-Z])", " ".join(p.split())) if s]
