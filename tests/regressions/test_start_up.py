"""The command line answers as soon as one like it can."""

from pathlib import Path

from tests.regressions.cases import HELP, command
from tests.regressions.measure import Rounds, slow

LIBRARIES = "import typer, rich.console, rich.panel, rich.table, rich.markdown, importlib.metadata"


def test_help_starts_fast(tmp_path: Path) -> None:
    """Beside the libraries that any command line like it loads."""
    asked, libraries = HELP(tmp_path).work, command("-c", LIBRARIES)(tmp_path).work
    asked()
    found = Rounds()
    found.add(asked, libraries, 5)
    assert not slow(found, asked, libraries, 5, most=1.5), found
