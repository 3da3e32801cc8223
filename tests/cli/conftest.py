import math
import sys
from collections.abc import Callable
from typing import NamedTuple

import pytest

from damagepred.cli import main, terminal


class Result(NamedTuple):
    code: int
    out: str
    err: str


Run = Callable[..., Result]


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Run:
    """Run a command in this process and return its exit code and what it printed."""

    def run(*arguments: object) -> Result:
        monkeypatch.setattr(sys, "argv", ["damagepred", *map(str, arguments)])
        monkeypatch.setattr(terminal, "FORM", terminal.Form())
        for silence in ("FIRST", "DOT"):  # nothing that a slow machine alone would print
            monkeypatch.setattr(terminal.Wait, silence, math.inf)
        capfd.readouterr()
        try:
            main()
            code = 0
        except SystemExit as stop:
            code = int(stop.code or 0)
        out, err = capfd.readouterr()
        return Result(code, out, err)

    return run
