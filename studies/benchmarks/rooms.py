"""List of the benchmarks: command, data and summary of each."""

from __future__ import annotations

import hashlib
import importlib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]


class Room(NamedTuple):
    """A benchmark with its folder, whose ``summary.py`` summarises the data.

    Attributes
    ----------
    name : str
        Name on the command line.
    folder : Path
        Of its data and its page.
    command : list of str
        Command, after ``python``.
    quick : list of str
        Its small form, which does not change the data in the repository; ``{}`` is replaced by a temporary folder.
    data : tuple of str
        Files and folders of its data, which are moved aside before a new run.
    goes_on : str
        The file that exists if a call resumes an earlier one; empty if each call measures all again.
    """

    name: str
    folder: Path
    command: list[str]
    quick: list[str]
    data: tuple[str, ...]
    goes_on: str = "data.csv"


def _room(name: str, quick: str, data: str, goes_on: str = "data.csv") -> Room:
    script = f"studies/benchmarks/{name}/run.py"
    return Room(name, HERE / name, [script], [script, *quick.split()], tuple(data.split()), goes_on)


RENEW = ["-m", "pytest", "tests/regressions", "-m", "benchmark or not benchmark", "--renew-baseline"]
ROOMS = {
    room.name: room
    for room in (
        _room("work_precision", "--quick", "data.csv"),
        _room(
            "probabilities",
            "--quick --wall window --output {} --into {}",
            "data.csv floors.csv costs.csv results",
            "results",
        ),
        _room("stress", "--quick", "cases.csv time_steps.csv cracking.csv", "cases.csv"),
        _room("scaling", "--quick --output {}", "data.csv"),
        _room("workers", "--quick --wall window --into {}", "parts.csv runs.csv", ""),
        _room("skips", "--quick --output {}", "data.csv"),
        # its baseline is not moved aside, because its tests read it; every call measures all of its figures
        Room(
            "regressions",
            ROOT / "tests" / "regressions",
            RENEW,
            ["-m", "pytest", "tests/regressions", "-k", "archive"],
            ("baseline.json",),
            "",
        ),
        _room("beside_others", "--quick --output {}", "runs.csv base.csv moved.csv", "runs.csv"),
    )
}
"""All, in the order of the page."""
SEPARATE = ("regressions",)
"""Benchmarks whose data are never moved aside."""


@contextmanager
def inside(folder: Path) -> Iterator[None]:
    """Import modules of a benchmark by their plain names, and unload them again: benchmarks use the same names."""
    names = {p.stem for at in (folder, HERE) for p in at.glob("*.py")}
    names |= {p.name for p in folder.iterdir() if p.is_dir()}

    def of_a_room(name: str) -> bool:
        file = getattr(sys.modules.get(name), "__file__", None)
        return file is not None and HERE in Path(file).parents

    def taken() -> list[str]:
        roots = {name: name.partition(".")[0] for name in sys.modules}
        return [name for name, root in roots.items() if root in names or of_a_room(root)]

    before, path = {name: sys.modules.pop(name) for name in taken()}, [*sys.path]
    others = [place for place in path if HERE not in Path(place).parents]
    sys.path[:] = [str(folder), str(HERE), str(ROOT), *others]
    try:
        yield
    finally:
        sys.path[:] = path
        for name in taken():
            del sys.modules[name]
        sys.modules.update(before)


def said(room: Room, folder: Path | None = None) -> tuple[str, str]:
    """Return title and text of a benchmark's summary, from the data in its own or another folder."""
    with inside(room.folder):
        summary = importlib.import_module("summary")
        return summary.TITLE, summary.text(folder or room.folder)


def fingerprint(room: Room) -> str:
    """Return a hash of the data of a benchmark."""
    found = hashlib.sha256()
    for name in room.data:
        place = room.folder / name
        if place.is_file():
            found.update(name.encode() + place.read_bytes())
        for file in sorted(place.rglob("*")):  # files of a folder; none if it is a file
            found.update(f"{file}, {file.stat().st_size}, {file.stat().st_mtime_ns}".encode())
    return found.hexdigest()
