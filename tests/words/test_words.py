"""The dictionary of the guide, retired names, and parameters in docstrings of exported functions."""

import csv
import inspect
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import pytest

import damagepred

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


def undocumented(name: str, arguments: list[str], text: str) -> list[str]:
    """Arguments of a function of two or more that its docstring leaves out."""
    arguments = [a for a in arguments if a not in ("self", "cls") and not a.startswith("_")]
    if len(arguments) < 2:
        return []
    section = text.partition("Parameters\n----------\n")[2]
    listed = re.split(r"\n(?:Returns|Raises|Yields|Notes|Examples)\n-", section)[0]
    named = {n.strip(" *`") for line in re.findall(r"(?m)^(\S.*?)(?: :.*)?$", listed) for n in line.split(",")}
    return [f"{name}: {a}" for a in arguments if a not in named]


def exported() -> Iterator[tuple[str, Callable[..., object]]]:
    """Yield the functions that the public modules export, and the public methods of their classes."""
    modules = [m for name in damagepred.__all__ if isinstance(m := getattr(damagepred, name), ModuleType)]
    for home in (damagepred, *modules):
        for name in getattr(home, "__all__", ()):
            value = getattr(home, name)
            if inspect.isfunction(value):
                yield f"{home.__name__}.{name}", value
            elif inspect.isclass(value):
                for key, member in vars(value).items():
                    method = member.__func__ if isinstance(member, classmethod | staticmethod) else member
                    if inspect.isfunction(method) and not key.startswith("_"):
                        yield f"{home.__name__}.{name}.{key}", method


@pytest.mark.parametrize(("name", "function"), [pytest.param(*pair, id=pair[0]) for pair in exported()])
def test_parameters_are_documented(name: str, function: Callable[..., object]) -> None:
    arguments = list(inspect.signature(function).parameters)
    assert not undocumented(name, arguments, inspect.getdoc(function) or "")
