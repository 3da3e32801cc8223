"""The signs of the structure are counted right, and no line is exempted from the formatter."""

import ast
from pathlib import Path

import pytest

from tests.structure.run import PACKAGE, ROOT, attributes, branches, floors, imports, numeric_constants, signs

SOURCE = '''
"""A module."""
LIMIT = 1e-6
RATIO: float = 5 / 6
WORDS = ("a", "b")

class Step:
    size: float

    def halve(self, often):
        self.size, self.rejected = self.size / 2, True
        return [i for i in range(often) if i and often]

def outer(a):
    def inner(b):
        return b if b else a
    return inner
'''


def test_constants_branches_and_attributes() -> None:
    tree = ast.parse(SOURCE)
    assert numeric_constants(tree) == 2
    assert sorted(branches(tree)) == [(0, "outer"), (1, "inner"), (2, "halve")]
    assert list(attributes(tree)) == [(2, "Step")]


def test_floors_follow_imports_that_run() -> None:
    text = "from damagepred.a.b import c\nif TYPE_CHECKING:\n    from damagepred.d import e"
    assert imports("here.py", text, {"a/b.py", "d.py", "here.py"}) == {"a/b.py"}
    assert floors({"top": {"middle", "ground"}, "middle": {"ground"}, "ground": set()}) == 3


@pytest.fixture(scope="module")
def measured() -> dict[str, str]:
    return signs(Path(ROOT) / PACKAGE)


def test_no_line_is_exempted_from_the_formatter(measured: dict[str, str]) -> None:
    assert measured["lines with `# fmt: skip`"] == "0"
