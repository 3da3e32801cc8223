"""Measure all benchmarks, one after the other, and write RESULTS.md.

    python studies/benchmarks/run.py [--rooms NAME ...] [--quick] [--from-data]

Each benchmark runs by its own command in a separate process, at most twice as long as expected, and resumes what was
interrupted; delete its data to measure all of it with one version. ``measured.csv`` records version, date and machine.
``--quick`` runs the small form of each benchmark and changes no data; ``--from-data`` only writes RESULTS.md.
"""

from __future__ import annotations

import argparse
import importlib
import os
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import matplotlib.figure
import pandas as pd

from damagepred.archive.files import write_whole
from studies.benchmarks.walls import read
from studies.pages import machine, markdown, version

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
MEASURED, PAGE, PICTURE = HERE / "measured.csv", HERE / "RESULTS.md", HERE / "RESULTS.png"
ALL = "python studies/benchmarks/run.py"
SLACK = 2.0
"""Time that a benchmark may take, over the expected."""


class Room(NamedTuple):
    """A benchmark: question, expected minutes, folder of data and page, command after ``python`` and its small form."""

    name: str
    question: str
    minutes: float
    folder: Path
    command: list[str]
    quick: list[str]

    @property
    def shell(self) -> str:
        """Command, as typed in a shell."""
        return shlex.join(["python", *self.command]).replace("'", '"')

    @property
    def summary(self) -> ModuleType:
        """Module that summarises the data: ``TITLE``, ``headline(folder)`` and ``text(folder)``."""
        return importlib.import_module(".".join((*self.folder.relative_to(ROOT).parts, "summary")))


def _rooms() -> Iterator[Room]:
    for name, table in read(HERE / "rooms.toml").items():
        script = f"studies/benchmarks/{name}/run.py"
        known = {"folder": f"studies/benchmarks/{name}", "command": [script], "quick": [script, "--quick"], **table}
        yield Room(name, **known | {"folder": ROOT / known["folder"]})


ROOMS = {room.name: room for room in _rooms()}
"""All benchmarks of ``rooms.toml``, in the order of the page."""


# -- measuring --------------------------------------------------------------------------------------------------------


def command(arguments: Sequence[str], minutes: float | None = None) -> str:
    """Run a command with its child processes to its end or for some minutes; return how it ended."""
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    child = subprocess.Popen(
        [sys.executable, *arguments], cwd=ROOT, env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    )
    try:
        code = child.wait(None if minutes is None else 60.0 * minutes)
    except subprocess.TimeoutExpired:
        child.terminate()  # its pool of processes ends with it
        child.wait()
        return "stopped"
    return "complete" if code == 0 else f"failed ({code})"


def measure(room: Room) -> str:
    """Run a benchmark and record it; return how it ended."""
    print(f"== {room.name}: {room.shell}; about {room.minutes:.0f} minutes", flush=True)
    began = time.perf_counter()
    end = command(room.command, SLACK * room.minutes)
    row = {"room": room.name, "version": version(), "date": f"{datetime.now(UTC):%Y-%m-%d}", "machine": machine()}
    row |= {"minutes": (time.perf_counter() - began) / 60.0, "end": end}
    table = measured()
    table = pd.DataFrame([*table[table["room"] != room.name].to_dict("records"), row])
    write_whole(MEASURED, lambda path: table.to_csv(path, index=False, float_format="%.1f", lineterminator="\n"))
    print(f"== {room.name}: {end}, {row['minutes']:.1f} min", flush=True)
    return end


def measured() -> pd.DataFrame:
    """Record of the last run of each benchmark: version, date, machine, minutes, and how it ended."""
    columns = ["room", "version", "date", "machine", "minutes", "end"]
    return pd.read_csv(MEASURED, dtype={"version": str}) if MEASURED.is_file() else pd.DataFrame(columns=columns)


def quick(room: Room) -> str:
    """Run the small form of a benchmark, which changes no data, and print the section that it writes."""
    print(f"== {room.name}, small form: python {' '.join(room.quick)}", flush=True)
    if not room.folder.is_relative_to(HERE):
        return command(room.quick)
    with tempfile.TemporaryDirectory() as folder:
        end = command([*room.quick, "--output", folder])
        print(section(room, Path(folder)), flush=True)
    return end


# -- RESULTS.md, from the data alone -----------------------------------------------------------------------------------


def in_short(table: pd.DataFrame) -> pd.DataFrame:
    """One row per benchmark: question, result, version, date and minutes."""
    rows = [
        {"room": name, "question": f"[{room.question}](#{anchor(room)})", "result": room.summary.headline(room.folder)}
        for name, room in ROOMS.items()
    ]
    short = pd.DataFrame(rows).merge(table, on="room", how="left")
    return short.assign(minutes=short["minutes"].map("{:.1f}".format)).drop(columns=["room", "machine", "end"])


def anchor(room: Room) -> str:
    """Anchor of a benchmark's section."""
    return room.name.replace("_", "-")


def whence(table: pd.DataFrame) -> str:
    """Machine of all measurements, and a caution where they are not of one machine and version."""
    versions, machines = (list(dict.fromkeys(table[name])) for name in ("version", "machine"))
    parted = sorted({*ROOMS} - {*table["room"][table["end"] == "complete"]})
    lines = [f"On {'; '.join(machines)}."]
    if len(machines) > 1 or len(versions) > 1 or parted:
        lines.append("**Not all figures are of one machine and version.**")
    else:
        lines.append(f"All with damagepred {versions[0]}, {' to '.join(sorted({*table['date']}))}.")
    if parted:
        lines.append(f"Not complete: {', '.join(parted)}.")
    return " ".join(lines)


def section(room: Room, folder: Path | None = None) -> str:
    """Section of a benchmark, from its own data or from those in another folder."""
    try:
        text = room.summary.text(folder or room.folder)
    except FileNotFoundError as error:
        text = f"No data: {Path(error.filename).name} is missing."
    page = f"../../{(room.folder / 'README.md').relative_to(ROOT)}".replace("../../studies/benchmarks/", "")
    return f'<a id="{anchor(room)}"></a>\n\n## {room.summary.TITLE}\n\n`{room.shell}`: [its page]({page}).\n\n{text}'


def draw(path: Path) -> None:
    """Draw the time of a path over the number of blocks, and that of other solvers for a dry wall."""
    figure = matplotlib.figure.Figure((9.0, 5.5), layout="constrained")
    ax = figure.add_subplot(xlabel="blocks", ylabel="processor time of a path (s)", xscale="log", yscale="log")
    walls = pd.read_csv(ROOMS["scaling"].folder / "data.csv").query("grows == 'blocks' and end == 'complete'")
    walls = walls.pivot_table(index="blocks", columns="curve", values="seconds", sort=False)
    for curve in walls:
        walls[curve].dropna().sort_index().plot(ax=ax, style="--" if "explicit" in str(curve) else "-", label=curve)
    others = pd.read_csv(ROOMS["beside_others"].folder / "runs.csv")
    others = others.query("case == 'gap' and settings != 'increments 1'").groupby(["blocks", "solver"])["s at 0.001"]
    for (solver, own), sign in zip(others.min().unstack().dropna(axis=1, how="all").items(), "os^vDP"):
        own.dropna().plot(ax=ax, style=f":{sign}", label=f"dry wall: {str(solver).replace('_', '-')}")
    ax.set_xlabel("blocks")
    ax.grid(alpha=0.3)
    figure.legend(*ax.get_legend_handles_labels(), loc="outside right upper", frameon=False, fontsize="small")
    write_whole(path, lambda p: figure.savefig(p, dpi=150, format="png"))


def text(table: pd.DataFrame) -> str:
    """Text of the page."""
    parts = (
        "# What do the benchmarks measure?",
        "Times, errors and growth of a wall and of a probability; the first table has one result per benchmark.",
        f"Written by `{ALL}` from the data of the benchmarks; `{ALL} --from-data` writes it again. Each heading names "
        "its command, and the page with the method.",
        whence(table),
        f"![Time of a path over the number of blocks]({PICTURE.name})",
        "Solid: quasi-static; dashed: explicit; dotted: a dry wall over ground that drops, to a residual of 0.001.",
        markdown(in_short(table)),
        *map(section, ROOMS.values()),
    )
    return "\n\n".join(parts) + "\n"


def main(arguments: Sequence[str] | None = None) -> int:
    """Read the command line, measure, write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    of = f"of {', '.join(ROOMS)} (all)"
    parser.add_argument("--rooms", nargs="+", choices=list(ROOMS), default=list(ROOMS), metavar="NAME", help=of)
    how = parser.add_mutually_exclusive_group()
    how.add_argument("--quick", action="store_true", help="the small form of each benchmark; does not change data")
    how.add_argument("--from-data", action="store_true", help="measure nothing; only write RESULTS.md")
    given = parser.parse_args(arguments)
    ends = {}
    if not given.from_data:
        ends = {name: (quick if given.quick else measure)(ROOMS[name]) for name in ROOMS if name in given.rooms}
    if not given.quick:
        whole = text(measured())
        draw(PICTURE)
        write_whole(PAGE, lambda path: path.write_text(whole, encoding="utf-8"))
    bad = [f"{name}: {end}" for name, end in ends.items() if end != "complete"]
    print("; ".join(bad) or "complete", flush=True)
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main())
