"""The benchmarks: command, data and summary of each; and the record of their measurements, ``measured.csv``."""

from __future__ import annotations

import importlib
import shlex
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from damagepred.archive.files import write_whole

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
MEASURED = HERE / "measured.csv"
"""A row for each benchmark: version and date of its data, machine, minutes, and how the last call ended."""


class Room(NamedTuple):
    """A benchmark with its folder, whose ``summary.py`` summarises the data.

    Attributes
    ----------
    name : str
        Name on the command line.
    question : str
        What it answers.
    minutes : float
        Expected time of a whole measurement on two cores, from recorded times of its cases.
    command, quick : list of str
        Command, after ``python``, and its small form, which does not change the data.
    folder : Path
        Of its data and its page.
    data : tuple of str
        Files and folders of its data.
    """

    name: str
    question: str
    minutes: float
    command: list[str]
    quick: list[str]
    folder: Path
    data: tuple[str, ...]

    @property
    def shell(self) -> str:
        """Command, as typed in a shell."""
        return shlex.join(["python", *self.command]).replace("'", '"')


def _room(name: str, question: str, minutes: float, data: str = "data.csv") -> Room:
    script = f"studies/benchmarks/{name}/run.py"
    return Room(name, question, minutes, [script], [script, "--quick"], HERE / name, tuple(data.split()))


GATE = ["-m", "pytest", "tests/regressions"]
ROOMS = {
    room.name: room
    for room in (
        _room("work_precision", "error of a wall over computing time", 21),
        _room("probabilities", "seconds to an error of a probability", 7, "data.csv floors.csv costs.csv results"),
        _room("stress", "robustness with extreme input", 10, "cases.csv"),
        _room("scaling", "growth with the size of a wall", 10),
        _room("skips", "time saved by each skipped computation", 4),
        Room(
            "regressions",
            "time of kernels and of a user's commands",
            6,
            [*GATE, "-m", "benchmark or not benchmark", "--renew-baseline"],
            [*GATE, "-k", "archive"],
            ROOT / "tests" / "regressions",
            ("baseline.json",),
        ),
        _room("beside_others", "time relative to other solvers", 12, "runs.csv"),
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


def contents(room: Room) -> dict[Path, bytes]:
    """Return the data of a benchmark."""
    places = [room.folder / name for name in room.data]
    return {file: file.read_bytes() for place in places for file in (place, *place.rglob("*")) if file.is_file()}


def measured() -> pd.DataFrame:
    """Return the record of all measurements."""
    columns = ["room", "version", "date", "machine", "minutes", "end"]
    return pd.read_csv(MEASURED, dtype={"version": str}) if MEASURED.is_file() else pd.DataFrame(columns=columns)


def record(row: dict[str, object], anew: bool) -> None:
    """Record a call: it replaces the earlier row if its data do, or else adds its minutes and version to that row."""
    table = measured()
    known = table[table["room"] == row["room"]].to_dict("records")
    if known and not anew:
        row = row | {name: "; ".join(dict.fromkeys([known[0][name], row[name]])) for name in ("version", "date")}
        row["minutes"] = known[0]["minutes"] + row["minutes"]
    table = pd.DataFrame([*table[table["room"] != row["room"]].to_dict("records"), row])
    write_whole(MEASURED, lambda path: table.to_csv(path, index=False, float_format="%.1f", lineterminator="\n"))
