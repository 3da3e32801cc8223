"""The benchmarks: command, data and summary of each; the record of measurements; and the page of the results."""

from __future__ import annotations

import importlib
import shlex
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import matplotlib.figure
import pandas as pd

from damagepred.archive.files import write_whole
from studies.benchmarks.pages import markdown
from studies.benchmarks.walls import read

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
MEASURED = HERE / "measured.csv"
"""A row for each benchmark: version and date of its data, machine, minutes, and how the last call ended."""


class Room(NamedTuple):
    """A benchmark with its folder, whose ``summary.py`` summarises the data; ``rooms.toml`` has them all.

    Attributes
    ----------
    name : str
        Name on the command line.
    question : str
        What it answers.
    minutes : float
        Expected time of a whole measurement.
    data : list of str
        Files and folders of its data.
    folder : Path
        Of its data and its page.
    command, quick : list of str
        Command, after ``python``, and its small form, which does not change the data.
    """

    name: str
    question: str
    minutes: float
    data: list[str]
    folder: Path
    command: list[str]
    quick: list[str]

    @property
    def shell(self) -> str:
        """Command, as typed in a shell."""
        return shlex.join(["python", *self.command]).replace("'", '"')


def _rooms() -> Iterator[Room]:
    for name, table in read(HERE / "rooms.toml").items():
        script = f"studies/benchmarks/{name}/run.py"
        known = {"folder": f"studies/benchmarks/{name}", "command": [script], "quick": [script, "--quick"], **table}
        yield Room(name, **known | {"folder": ROOT / known["folder"]})


ROOMS = {room.name: room for room in _rooms()}
"""All, in the order of the page."""
SEPARATE = ("regressions",)
"""Benchmarks whose data are never moved aside: every call measures all of its figures, and tests read them."""


def summary(room: Room) -> ModuleType:
    """Return the module that summarises a benchmark: ``TITLE``, ``headline(folder)`` and ``text(folder)``."""
    return importlib.import_module(".".join((*room.folder.relative_to(ROOT).parts, "summary")))


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


# -- RESULTS.md, from the data alone -----------------------------------------------------------------------------------

PAGE, PICTURE = HERE / "RESULTS.md", HERE / "RESULTS.png"
ALL = "python studies/benchmarks/run.py"


def in_short(table: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each benchmark: question, result, version, date and minutes."""
    questions = {name: f"[{room.question}](#{anchor(room)})" for name, room in ROOMS.items()}
    results = {name: summary(room).headline(room.folder) for name, room in ROOMS.items()}
    found = pd.DataFrame({"room": [*ROOMS], "question": questions.values(), "result": results.values()})
    found = found.merge(table, on="room", how="left")
    return found.assign(minutes=found["minutes"].map("{:.1f}".format)).drop(columns=["room", "machine", "end"])


def anchor(room: Room) -> str:
    """Return the anchor of a benchmark's section."""
    return room.name.replace("_", "-")


def whence(table: pd.DataFrame) -> str:
    """Return machine and version of all measurements, and a caution where they are not of one run."""
    versions, machines, days = (list(dict.fromkeys(table[name])) for name in ("version", "machine", "date"))
    last = table.set_index("room")["end"].reindex([*ROOMS])
    parted = last.index[last != "complete"]
    where = "On " + (machines[0] if len(machines) == 1 else "machines that differ: " + "; ".join(machines)) + "."
    if not len(parted) and len(versions) == len(machines) == 1:
        return f"{where} All with damagepred {versions[0]}, {' to '.join(sorted({min(days), max(days)}))}."
    lines = [where, "**Not all figures are of one run.**"]
    if len(versions) > 1:
        lines.append("Versions differ between benchmarks, or within one.")
    if len(parted):
        lines.append(f"Data of {', '.join(parted)} are of calls that were not complete.")
    return " ".join([*lines, f"`{ALL} --anew` measures all of them with one version."])


def section(room: Room, folder: Path | None = None) -> str:
    """Return the section of a benchmark, from its own data or from those in another folder."""
    try:
        text = summary(room).text(folder or room.folder)
    except FileNotFoundError as error:
        text = f"No data: {Path(error.filename).name} is missing."
    page = f"../../{(room.folder / 'README.md').relative_to(ROOT)}".replace("../../studies/benchmarks/", "")
    return f'<a id="{anchor(room)}"></a>\n\n## {summary(room).TITLE}\n\n`{room.shell}`: [its page]({page}).\n\n{text}'


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
    """Return the page."""
    parts = (
        "# Results of the benchmarks",
        f"Written by `{ALL}` from the data of the benchmarks; `{ALL} --from-data` writes it again. Each heading names "
        "its command, and the page with the method.",
        whence(table),
        f"![Time of a path over the number of blocks]({PICTURE.name})",
        "Solid: quasi-static; dashed: explicit; dotted: a dry wall over ground that drops, to a residual of 0.001.",
        markdown(in_short(table)),
        *map(section, ROOMS.values()),
    )
    return "\n\n".join(parts) + "\n"


def write() -> None:
    """Write the page and its picture from the available data."""
    whole = text(measured())
    draw(PICTURE)
    write_whole(PAGE, lambda path: path.write_text(whole, encoding="utf-8"))
