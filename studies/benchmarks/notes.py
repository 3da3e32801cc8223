"""Date, version and machine of each measurement: ``measured.csv``, a row for each call."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pandas as pd

from damagepred.archive.files import write_whole
from damagepred.version import __version__

HERE = Path(__file__).resolve().parent
NOTES = HERE / "measured.csv"
COLUMNS = ["room", "began", "command", "machine", "version", "date", "minutes", "end"]
"""``began``: "anew", or "on" from data of earlier calls; ``end``: "complete", "stopped", or the code of its failure."""


def version() -> str:
    """Return the version of damagepred and, in a clone, the commit, and whether the package has been changed since."""

    def git(*arguments: str) -> str:
        done = subprocess.run(["git", "-C", str(HERE), *arguments], capture_output=True, text=True, check=True)
        return done.stdout.strip()

    try:
        commit, changed = git("rev-parse", "--short=10", "HEAD"), git("status", "--porcelain", "--", ":/damagepred")
    except (OSError, subprocess.CalledProcessError):
        return __version__
    return f"{__version__}, commit {commit}{' and changes' if changed else ''}"


def read(file: Path = NOTES) -> pd.DataFrame:
    """Return all rows."""
    if not file.is_file():
        return pd.DataFrame(columns=COLUMNS)
    return pd.read_csv(file, keep_default_na=False, dtype={"minutes": float})


def add(row: dict[str, object], file: Path = NOTES) -> None:
    """Add a row; if a benchmark has begun anew, its earlier rows are deleted, as their data are."""
    before = read(file)
    if row["began"] == "anew":
        before = before[before["room"] != row["room"]]
    rows = [*before.to_dict("records"), row]
    table = pd.DataFrame(rows, columns=COLUMNS).round({"minutes": 1})
    write_whole(file, lambda path: table.to_csv(path, index=False, lineterminator="\n"))


def open_end(notes: pd.DataFrame, room: str) -> bool:
    """Return whether the last measurement of a benchmark is incomplete."""
    own = notes[notes["room"] == room]
    return len(own) > 0 and own["end"].iloc[-1] != "complete"


def whole(notes: pd.DataFrame, room: str) -> bool:
    """Return whether all data of a benchmark are recorded and complete."""
    own = notes[notes["room"] == room]
    return len(own) > 0 and own["began"].iloc[0] == "anew" and own["end"].iloc[-1] == "complete"
