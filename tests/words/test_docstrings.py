"""Every exported function, and every method of an exported class, documents its parameters, as numpydoc has it."""

import inspect
import re
from collections.abc import Callable, Iterator
from types import ModuleType

import pytest

import damagepred


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
