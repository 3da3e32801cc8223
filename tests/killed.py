"""Kills a command at each of its writes, in a separate process, before a rename, removal or fsync."""

import os
from collections.abc import Callable
from pathlib import Path

KILLED = 137
WRITES = ("replace", "rename", "unlink", "remove", "fsync", "rmdir", "mkdir")
"""Calls of ``os`` that bring something to the disk or take it away."""


def _armed(action: Callable[[], object], folder: Path, at: int, count: Path) -> int:
    """Run an action that dies before its write number ``at``; return its exit code, and write how often it wrote."""
    writes = 0

    def guarded(name: str) -> Callable[..., object]:
        honest = getattr(os, name)

        def call(*given: object, **more: object) -> object:
            nonlocal writes
            inside = name == "fsync" or str(given[0]).startswith(str(folder))
            if inside:
                if writes == at:
                    os._exit(KILLED)
                writes += 1
            return honest(*given, **more)

        return call

    for name in WRITES:
        setattr(os, name, guarded(name))
    code = 0
    try:
        action()
    except SystemExit as ending:
        code = int(ending.code or 0)
    count.write_text(str(writes), encoding="utf-8")
    return code


def run_killed(action: Callable[[], object], folder: Path, at: int) -> tuple[int, int]:
    """Run an action in a fork of this process, killed before its write number ``at`` below ``folder``."""
    count = folder.parent / "writes.txt"
    count.unlink(missing_ok=True)
    child = os.fork()
    if child == 0:
        code = 99
        try:
            for stream in (1, 2):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
            code = _armed(action, folder, at, count)
        finally:
            os._exit(code)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return code, int(count.read_text(encoding="utf-8")) if count.exists() else -1
