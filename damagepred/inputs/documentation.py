"""Docstrings of classes whose fields have their meaning in a string below, for ``help`` and the guide."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from typing import Any, TypeVar

T = TypeVar("T")


def documented(cls: type[T]) -> type[T]:
    """Class whose docstring, in ``help``, has a section of its fields, each with the string below it."""
    cls.__doc__ = _Documentation(cls.__doc__ or "")  # type: ignore[assignment]
    return cls


class _Documentation:
    """Docstring with a section of fields, read from the source on demand."""

    def __init__(self, text: str) -> None:
        self.text = inspect.cleandoc(text)

    def __get__(self, _: Any, kind: type) -> str:
        if "\nAttributes\n---" in self.text:
            return self.text
        try:
            (body,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
        except (OSError, TypeError):  # a class without a source file
            return self.text
        entries, together, types = [], [], []
        for node in getattr(body, "body", ()):
            if isinstance(node, ast.AnnAssign):
                together.append(ast.unparse(node.target))
                types.append(ast.unparse(node.annotation))
            elif together and isinstance(node, ast.Expr):  # of all fields above it that have none
                meaning = inspect.cleandoc(ast.literal_eval(node.value))
                names = f"{', '.join(together)} : {', '.join(dict.fromkeys(types))}"
                entries.append(f"{names}\n{textwrap.indent(meaning, '    ')}\n")
                together, types = [], []
        summary, *others = re.split(r"\n(?=\w+\n---)", self.text)
        attributes = ["Attributes\n----------\n" + "".join(entries)] if entries else []
        return "\n".join([summary.rstrip() + "\n", *attributes, *others])
