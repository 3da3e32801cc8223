"""List of the benchmarks: command, data and summary of each."""

from __future__ import annotations

import hashlib
import importlib
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


def said(room: Room, folder: Path | None = None) -> tuple[str, str]:
    """Return title and text of a benchmark's summary, from the data in its own or another folder."""
    summary = importlib.import_module(".".join((*room.folder.relative_to(ROOT).parts, "summary")))
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
