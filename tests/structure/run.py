"""Signs of the structure, for one or more versions side by side: `python tests/structure/run.py [REVISION ...]`.

A sign is no limit. It shows where a reader should look: tuned numbers in modules, functions of many branches, classes
of many attributes, imports between the files of the solvers. Without a revision, the files as they stand are measured.
"""

from __future__ import annotations

import ast
import io
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = "damagepred"
BRANCHES = (ast.If, ast.IfExp, ast.For, ast.While, ast.ExceptHandler, ast.BoolOp, ast.comprehension, ast.match_case)


def modules(folder: Path) -> dict[str, str]:
    """Return the text of every Python file below a folder, by its path."""
    return {path.relative_to(folder).as_posix(): path.read_text() for path in sorted(folder.rglob("*.py"))}


def is_number(node: ast.expr | None) -> bool:
    """Return whether an expression consists of numbers alone."""
    match node:
        case ast.Constant():
            return isinstance(node.value, int | float) and not isinstance(node.value, bool)
        case ast.UnaryOp():
            return is_number(node.operand)
        case ast.BinOp():
            return is_number(node.left) and is_number(node.right)
    return False


def numeric_constants(tree: ast.Module) -> int:
    """Count the module-level names that hold a number, documented ones included."""
    return sum(isinstance(n, ast.Assign | ast.AnnAssign) and is_number(n.value) for n in tree.body)


def own_nodes(function: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a function without those of functions inside it."""
    for child in ast.iter_child_nodes(function):
        if not isinstance(child, ast.FunctionDef | ast.Lambda | ast.ClassDef):
            yield child
            yield from own_nodes(child)


def branches(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the number of branches of each function, with its name."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            yield sum(isinstance(n, BRANCHES) for n in own_nodes(node)), node.name


def attributes(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the number of attributes of each class: fields, and what its methods assign to `self`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            fields = {n.target.id for n in node.body if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name)}
            stored = {
                n.attr
                for n in ast.walk(node)
                if isinstance(n, ast.Attribute)
                and isinstance(n.ctx, ast.Store)
                and isinstance(n.value, ast.Name)
                and n.value.id == "self"
            }
            yield len(fields | stored), node.name


def imports(name: str, text: str, known: set[str]) -> set[str]:
    """Return which of the known files one file imports; imports for types alone do not count."""
    found = set()
    tree = ast.parse(text)
    for_types = {
        child
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        for child in ast.walk(node)
    }
    for node in ast.walk(tree):
        if node not in for_types and isinstance(node, ast.ImportFrom) and node.module:
            base = node.module.replace(".", "/").removeprefix(f"{PACKAGE}/")
            for target in [f"{base}.py", *(f"{base}/{alias.name}.py" for alias in node.names)]:
                if target in known and target != name:
                    found.add(target)
    return found


def floors(arrows: dict[str, set[str]]) -> int:
    """Return the length of the longest chain of imports, in files."""

    @cache
    def height(name: str) -> int:
        return 1 + max((height(below) for below in arrows[name]), default=0)

    return max(map(height, arrows), default=0)


def signs(package: Path) -> dict[str, str]:
    """Measure one version of the package.

    Parameters
    ----------
    package : Path
        Folder of the package.

    Returns
    -------
    dict
        The value of each sign, as text.
    """
    files = modules(package)
    trees = {name: ast.parse(text) for name, text in files.items()}
    lines = {name: text.count("\n") for name, text in files.items()}
    mechanics = [n for n in files if n.startswith(("kernels/", "solvers/"))]
    solvers = {n: files[n] for n in files if n.startswith("solvers/") and not n.endswith("__init__.py")}
    solver_lines = sum(lines[n] for n in files if n.startswith("solvers/"))
    arrows = {name: imports(name, text, set(solvers)) for name, text in solvers.items()}

    def largest(count: object) -> str:
        pairs = sorted((pair for tree in trees.values() for pair in count(tree)), reverse=True)[:6]  # type: ignore[operator]
        return ", ".join(f"{name} {number}" for number, name in pairs)

    tuned = sum(numeric_constants(trees[n]) for n in files if n.startswith("solvers/"))
    return {
        "lines of the package": f"{sum(lines.values())}",
        "lines of kernels and solvers": f"{sum(lines[n] for n in mechanics)}",
        "files of more than 500 lines": f"{sum(n > 500 for n in lines.values())}",
        "numeric module constants per 1000 lines of solvers": f"{1000 * tuned / solver_lines:.1f}",
        "lines with `# fmt: skip`": f"{sum(text.count('# fmt: skip') for text in files.values())}",
        "imports between files of the solvers": f"{sum(map(len, arrows.values()))}",
        "floors of the solvers": f"{floors(arrows)}",
        "functions of most branches": largest(branches),
        "classes of most attributes": largest(attributes),
    }


def version(revision: str, folder: Path) -> Path:
    """Unpack one version of the package and return its folder.

    Parameters
    ----------
    revision : str
        What git calls the version.
    folder : Path
        Where to unpack it.
    """
    packed = subprocess.run(["git", "archive", revision, PACKAGE], cwd=ROOT, capture_output=True, check=True).stdout
    with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
        archive.extractall(folder, filter="data")
    return folder / PACKAGE


def main() -> None:
    """Print the signs of each version asked for."""
    for revision in sys.argv[1:] or [""]:
        with tempfile.TemporaryDirectory() as folder:
            found = signs(version(revision, Path(folder)) if revision else ROOT / PACKAGE)
        print(f"\n{revision or 'as it stands'}")
        for name, value in found.items():
            print(f"  {name:52s} {value}")


if __name__ == "__main__":
    main()
