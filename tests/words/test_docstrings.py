"""Every public function of two or more arguments documents its parameters, as numpydoc has it."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "damagepred"


def public_functions(tree: ast.Module) -> Iterator[tuple[str, ast.FunctionDef]]:
    """Yield name and definition of the public functions of a module and of its public classes."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            yield node.name, node
        elif isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            for method in node.body:
                if isinstance(method, ast.FunctionDef) and not method.name.startswith("_"):
                    yield f"{node.name}.{method.name}", method


def undocumented(source: str) -> list[str]:
    """Return the public functions of two or more arguments that leave one of them out of their docstring."""
    found = []
    for name, node in public_functions(ast.parse(source)):
        arguments = [a.arg for a in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
        arguments = [a for a in arguments if a not in ("self", "cls") and not a.startswith("_")]
        text = ast.get_docstring(node) or ""
        overloaded = any("overload" in ast.unparse(d) or "setter" in ast.unparse(d) for d in node.decorator_list)
        if len(arguments) < 2 or overloaded:
            continue
        listed = re.split(
            r"\n(?:Returns|Raises|Yields|Notes|Examples)\n-", text.partition("Parameters\n----------\n")[2]
        )[0]
        named = {n.strip(" *`") for line in re.findall(r"(?m)^(\S.*?)(?: :.*)?$", listed) for n in line.split(",")}
        if missing := [a for a in arguments if a not in named]:
            found.append(f"{name}: {', '.join(missing)}")
    return found


def test_a_missing_parameter_is_seen() -> None:
    assert undocumented(
        'def f(a, b):\n    """Add.\n\n    Parameters\n    ----------\n    a : int\n        One.\n    """'
    )


# the arguments of commands are documented where they are declared, as their help
@pytest.mark.parametrize(
    "file", sorted(f for f in PACKAGE.rglob("*.py") if f.name != "cli.py"), ids=lambda f: str(f.relative_to(PACKAGE))
)
def test_parameters_are_documented(file: Path) -> None:
    assert not undocumented(file.read_text(encoding="utf-8"))
