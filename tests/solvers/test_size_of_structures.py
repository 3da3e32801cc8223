"""Structures of kernels have at most 20 fields, classes of solvers at most 20 attributes, with those of their bases."""

import ast
from pathlib import Path

import pytest

import damagepred

PACKAGE = Path(damagepred.__file__).parent
MOST = 20


def attributes(node: ast.ClassDef) -> set[str]:
    """Names that a class annotates or assigns in its body, and attributes that its methods set."""
    annotated = (n for n in node.body if isinstance(n, ast.AnnAssign) and "ClassVar" not in ast.dump(n.annotation))
    names = {n.target.id for n in annotated if isinstance(n.target, ast.Name)}
    names |= {t.id for n in node.body if isinstance(n, ast.Assign) for t in n.targets if isinstance(t, ast.Name)}
    stored = (n for n in ast.walk(node) if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store))
    return names | {n.attr for n in stored if isinstance(n.value, ast.Name) and n.value.id == "self"}


def classes(room: str) -> dict[str, ast.ClassDef]:
    """Classes of a room by module and name."""
    return {
        f"{path.relative_to(PACKAGE)}:{node.name}": node
        for path in sorted((PACKAGE / room).rglob("*.py")) or [PACKAGE / room]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ClassDef)
    }


@pytest.mark.parametrize("room", ["kernels", "solvers"])
def test_no_structure_has_more_than_twenty_fields(room: str) -> None:
    found = classes(room)
    bases = {node.name: node for node in (found | classes("diagnostics.py")).values()}

    def all_attributes(node: ast.ClassDef) -> set[str]:
        own = attributes(node)
        for base in node.bases:
            if isinstance(base, ast.Name) and base.id in bases:
                own |= all_attributes(bases[base.id])
        return own

    numbers = {name: len(all_attributes(node)) for name, node in found.items()}
    assert {name: number for name, number in numbers.items() if number > MOST} == {}
    assert max(numbers.values()) > 10
