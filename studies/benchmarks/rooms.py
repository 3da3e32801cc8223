"""The benchmarks: command, data and summary of each; and the record of their measurements, ``measured.csv``."""

from __future__ import annotations

import hashlib
import importlib
import shlex
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from damagepred.archive.files import write_whole

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
MEASURED = HERE / "measured.csv"
"""A row for each benchmark and version: date, machine, minutes of its calls, and how the last ended."""


class Room(NamedTuple):
    """A benchmark with its folder, whose ``summary.py`` summarises the data.

    Attributes
    ----------
    name : str
        Name on the command line.
    folder : Path
        Of its data and its page.
    question : str
        What it answers.
    command : list of str
        Command, after ``python``; the same command resumes an interrupted call.
    quick : list of str
        Its small form, which does not change the data in the repository; ``{}`` is replaced by a temporary folder.
    data : tuple of str
        Files and folders of its data.
    """

    name: str
    folder: Path
    question: str
    command: list[str]
    quick: list[str]
    data: tuple[str, ...] = ("data.csv",)

    @property
    def shell(self) -> str:
        """Command, as typed in a shell."""
        return shlex.join(["python", *self.command]).replace("'", '"')


def _room(name: str, question: str, quick: str, data: str = "data.csv") -> Room:
    script = f"studies/benchmarks/{name}/run.py"
    return Room(name, HERE / name, question, [script], [script, *quick.split()], tuple(data.split()))


RENEW = ["-m", "pytest", "tests/regressions", "-m", "benchmark or not benchmark", "--renew-baseline"]
ROOMS = {
    room.name: room
    for room in (
        _room("work_precision", "error of a wall over computing time", "--quick"),
        _room(
            "probabilities",
            "seconds to an error of a probability",
            "--quick --wall window --output {} --into {}",
            "data.csv floors.csv costs.csv results",
        ),
        _room("stress", "robustness with extreme input", "--quick", "cases.csv time_steps.csv cracking.csv"),
        _room("scaling", "growth with the size of a wall", "--quick --output {}"),
        _room("skips", "time saved by each skipped computation", "--quick --output {}"),
        Room(
            "regressions",
            ROOT / "tests" / "regressions",
            "time of kernels and of a user's commands",
            RENEW,
            ["-m", "pytest", "tests/regressions", "-k", "archive"],
            ("baseline.json",),
        ),
        _room("beside_others", "time relative to other solvers", "--quick --output {}", "runs.csv"),
    )
}
"""All, in the order of the page."""
SEPARATE = ("regressions",)
"""Benchmarks whose data are never moved aside: every call measures all of its figures, and tests read them."""


def said(room: Room, folder: Path | None = None) -> tuple[str, str, str]:
    """Return title, headline and text of a benchmark, from the data in its own or another folder."""
    summary = importlib.import_module(".".join((*room.folder.relative_to(ROOT).parts, "summary")))
    place = folder or room.folder
    return summary.TITLE, summary.headline(place), summary.text(place)


def fingerprint(room: Room) -> str:
    """Return a hash of the data of a benchmark."""
    found = hashlib.sha256()
    for name in room.data:
        place = room.folder / name
        for file in sorted(place.rglob("*")) if place.is_dir() else [place] * place.is_file():
            found.update(f"{file}, {file.stat().st_size}".encode() + file.read_bytes())
    return found.hexdigest()


def measured(file: Path = MEASURED) -> pd.DataFrame:
    """Return the record of all measurements."""
    columns = ["room", "version", "date", "machine", "minutes", "end"]
    return pd.read_csv(file, dtype={"version": str}) if file.is_file() else pd.DataFrame(columns=columns)


def record(room: Room, version: str, date: str, machine: str, minutes: float, end: str, anew: bool) -> None:
    """Record a call: it replaces earlier ones if its data do, or adds to that of the same version."""
    table = measured()
    if anew:
        table = table[table["room"] != room.name]
    same = (table["room"] == room.name) & (table["version"] == version)
    minutes += float(table.loc[same, "minutes"].sum())
    row = {"room": room.name, "version": version, "date": date, "machine": machine, "minutes": minutes, "end": end}
    table = pd.DataFrame([*table[~same].to_dict("records"), row])
    write_whole(MEASURED, lambda path: table.to_csv(path, index=False, float_format="%.1f", lineterminator="\n"))
