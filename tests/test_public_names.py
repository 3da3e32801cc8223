"""What the README and the notebooks use is public: of ``damagepred`` itself or of its public subpackages."""

import ast
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

import damagepred

ROOT = Path(__file__).resolve().parent.parent

WITH_EXAMPLES = ("assembly", "exports", "plotting", "report", "scene", "study")
"""Public modules whose names all have an example."""


def sources() -> Iterator[tuple[str, str]]:
    """Yield the Python code of the README and of each notebook, with its name."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    yield "README.md", "\n".join(re.findall(r"```python\n(.*?)```", readme, re.DOTALL))
    for path in sorted((ROOT / "studies" / "notebooks").glob("*.ipynb")):
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        code = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
        yield path.name, code.replace("%matplotlib inline", "")


@pytest.mark.parametrize(("name", "code"), [pytest.param(*s, id=s[0]) for s in sources()])
def test_examples_need_public_names_only(name: str, code: str) -> None:
    tree = ast.parse(code)
    used = {ast.unparse(n) for n in ast.walk(tree) if isinstance(n, ast.Attribute)}
    for text in (u for u in used if re.fullmatch(r"damagepred(\.\w+)+", u)):
        parts = text.split(".")
        assert parts[1] in damagepred.__all__, text
        assert not any(part.startswith("_") for part in parts), text
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "damagepred":
            assert node.module == "damagepred" or node.module.split(".")[1] in damagepred.__all__, node.module
            home = import_module(node.module)
            for alias in node.names:
                public = getattr(home, "__all__", None)
                assert alias.name in public if public else not alias.name.startswith("_"), alias.name


def test_every_public_name_is_there() -> None:
    for name in damagepred.__all__:
        assert getattr(damagepred, name) is not None
    assert dir(damagepred) == sorted(damagepred.__all__)
    with pytest.raises(AttributeError, match="no attribute 'walls'"):
        _ = damagepred.walls


def test_the_package_is_imported_without_what_it_stands_on() -> None:
    code = "import sys, damagepred; print(*{'numpy', 'pydantic', 'matplotlib', 'xarray', 'numba'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == ""


def test_every_public_function_and_class_has_an_example() -> None:
    """The examples themselves run as doctests."""
    homes = (damagepred, *(import_module(f"damagepred.{name}") for name in WITH_EXAMPLES))
    without = [
        f"{home.__name__}.{name}"
        for home in homes
        for name, value in ((name, getattr(home, name)) for name in home.__all__)
        if callable(value) and ">>> " not in (value.__doc__ or "")
    ]
    assert without == []
