"""The guide: Markdown pages that ship with the package, read on the web and in the terminal."""

from __future__ import annotations

import html
import re
from pathlib import Path

from damagepred.errors import InputError, nearest

TOPICS = (
    *("my-house-on-h1-clay", "how-far-to-trust-it", "a-tree-at-one-end", "an-end-that-settles", "a-soil-log"),
    *("files-as-they-come", "reading-a-result", "uncertainty", "judging-again", "other-programs"),
    *("footing-and-ground", "seasons", "control-joints", "a-house", "floors-and-beams", "gables-and-bonds"),
    *("from-cracks-to-causes", "from-probabilities-to-decisions", "a-street", "laboratory-tests", "large-studies"),
    *("accuracy", "theory", "keys", "archive", "glossary", "gallery", "extending", "changing"),
)
"""Pages in the order of reading."""


def page(topic: str) -> str:
    """Text of a page of the guide (Markdown), one of ``TOPICS``."""
    if topic not in TOPICS:
        raise InputError(f"{topic}: the guide has no such topic; it has {', '.join(TOPICS)}.{nearest(topic, TOPICS)}")
    return (Path(__file__).parent / f"{topic}.md").read_text(encoding="utf-8")


def title(topic: str) -> str:
    """Heading of a page."""
    return page(topic).partition("\n")[0].removeprefix("# ")


def with_plain_equations(text: str) -> str:
    """Page with its LaTeX in plain characters, for a terminal."""
    text = re.sub(r"^\$\$\n(.*?)\n\$\$$", lambda m: f"```\n{_plain(m[1])}\n```", text, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"(?<!`)\$([^$\n]+)\$", lambda m: f"`{_plain(m[1])}`", text)


_COMMANDS = {"varphi": "φ", "varepsilon": "ε", "cdot": "·", "infty": "∞", "partial": "∂", "top": "T"}
_COMMANDS |= {"lvert": "|", "rvert": "|", "quad": "  ", "qquad": "    "}


def _plain(latex: str) -> str:
    """Equation in plain characters: fractions with a slash, indices after ``_``."""
    latex = re.sub(
        r"\\(begin|end)\{\w+\}\n?|\\(left|right|mathbf|boldsymbol|text|operatorname)\b|\\[,;]|&|\\\\", "", latex
    )
    before = ""
    while before != latex:
        before = latex
        latex = re.sub(r"\\frac\{([^{}]*)\}\{([^{}]*)\}", lambda m: f"{_factor(m[1])}/{_factor(m[2])}", latex)
        latex = re.sub(r"\\sqrt\{([^{}]*)\}", r"√(\1)", latex)
        latex = re.sub(r"\\dot\{([^{}]*)\}", "\\1\u0307", latex)
        latex = re.sub(r"([_^])\{([^{}]*)\}", lambda m: m[1] + _factor(m[2]), latex)
        latex = re.sub(r"(?<![\w}])\{([^{}]*)\}", r"\1", latex)
    named = re.sub(r"\\([A-Za-z]+)", lambda m: _COMMANDS.get(m[1]) or html.unescape(f"&{m[1]};").strip("&;"), latex)
    return "\n".join(line.rstrip() for line in named.splitlines())


def _factor(text: str) -> str:
    return f"({text})" if re.search(r"[^\s] *[-+/ ]", text) else text
