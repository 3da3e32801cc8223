"""The guide: Markdown pages that ship with the package, read on the web and in the terminal."""

from __future__ import annotations

from pathlib import Path

from damagepred.errors import InputError, nearest

TOPICS = (
    "my-house-on-h1-clay",
    "reading-a-result",
    "uncertainty",
    "how-far-to-trust-it",
    "footing-and-ground",
    "seasons",
    "control-joints",
    "from-cracks-to-causes",
    "from-probabilities-to-decisions",
    "laboratory-tests",
    "large-studies",
    "accuracy",
    "theory",
    "keys",
    "archive",
    "glossary",
    "gallery",
    "extending",
    "changing",
)
"""Pages in the order of reading."""


def page(topic: str) -> str:
    """Return a page of the guide as Markdown.

    Parameters
    ----------
    topic : str
        One of ``TOPICS``.

    Raises
    ------
    InputError
        If there is no such page.

    Examples
    --------
    >>> page("glossary").splitlines()[0]
    '# Glossary'
    """
    if topic not in TOPICS:
        raise InputError(f"{topic}: the guide has no such topic; it has {', '.join(TOPICS)}.{nearest(topic, TOPICS)}")
    return (Path(__file__).parent / f"{topic}.md").read_text(encoding="utf-8")


def title(topic: str) -> str:
    """Return the heading of a page."""
    return page(topic).partition("\n")[0].removeprefix("# ")
