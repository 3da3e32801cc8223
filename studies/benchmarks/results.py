"""RESULTS.md: the results of all benchmarks, from their data alone."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import notes
import pandas as pd
from pages import markdown
from rooms import HERE, ROOMS, ROOT, Room, said

from damagepred.archive.files import write_whole

PAGE = HERE / "RESULTS.md"
MACHINE = re.compile(r"\d+ cores of .*?scipy [\d.]*\d")
UNKNOWN = "not noted"
ALL = "python studies/benchmarks/run.py"
CONTENTS = {
    "work_precision": "error over time of a wall, presets, orders",
    "probabilities": "seconds to an error of a probability",
    "stress": "outcomes of runs with extreme input",
    "scaling": "exponents of time and memory",
    "workers": "hours of large studies",
    "skips": "time saved and differences made by each skip",
    "regressions": "nanoseconds per contact, zone and joint; start-up",
    "beside_others": "times relative to other solvers",
}
"""Contents of each section, for the table at the top."""


def machine_of(room: Room, kept: pd.DataFrame) -> list[str]:
    """Return the machine of a benchmark: as recorded, else from its own page."""
    if notes.whole(kept, room.name):
        return list(dict.fromkeys(kept.loc[kept["room"] == room.name, "machine"]))
    found = MACHINE.search((room.folder / "README.md").read_text(encoding="utf-8"))
    return [found.group()] if found else []


def command_of(room: Room) -> str:
    """Return the command of a benchmark, as typed in a shell."""
    return shlex.join(["python", *room.command]).replace("'", '"')


def _cell(values: pd.Series) -> str:
    return "; ".join(dict.fromkeys(map(str, values)))


def measured(kept: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each benchmark: contents, version, date, and minutes."""
    rows = []
    for room in ROOMS.values():
        own = kept[kept["room"] == room.name]
        older = "" if notes.whole(kept, room.name) else "; some earlier, " + UNKNOWN if len(own) else UNKNOWN
        rows.append(
            {
                "": f"[{room.name}](#{anchor(room)})",
                "what": CONTENTS[room.name],
                "version": _cell(own["version"]) + older,
                "date": _cell(own["date"]) + older,
                "minutes": f"{own['minutes'].sum():.1f}" if len(own) else UNKNOWN,
            }
        )
    return pd.DataFrame(rows)


def anchor(room: Room) -> str:
    """Return the anchor of a benchmark's section."""
    return room.name.replace("_", "-")


def whence(kept: pd.DataFrame) -> str:
    """Return machine and version of all measurements, and a caution where they are not of one run."""
    machines = list(dict.fromkeys(m for room in ROOMS.values() for m in machine_of(room, kept)))
    lines = ["On " + (machines[0] if len(machines) == 1 else "machines that differ: " + "; ".join(machines)) + "."]
    noted = [name for name in ROOMS if notes.whole(kept, name)]
    unnoted = [name for name in ROOMS if name not in noted]
    own = kept[kept["room"].isin(noted)]
    versions, days = list(dict.fromkeys(own["version"])), sorted(set(own["date"]))
    if len(noted) == len(ROOMS) and len(versions) == 1 and len(machines) == 1:
        lines.append(f"All with damagepred {versions[0]}, {days[0]}{f' to {days[-1]}' if len(days) > 1 else ''}.")
        return " ".join(lines)
    lines.append("**Not all figures are of one run.**")
    if len(versions) > 1:
        lines.append("Versions differ between benchmarks, or within one.")
    if unnoted:
        lines.append(
            f"Data of {', '.join(unnoted)} are, at least in part, of calls that were not recorded or not complete: the "
            "version of damagepred is not known."
        )
    lines.append(f"`{ALL} --anew` measures all of them with one version.")
    return " ".join(lines)


def section(room: Room, folder: Path | None = None) -> str:
    """Return the section of a benchmark, from its own data or from those in another folder."""
    try:
        title, text = said(room, folder)
    except FileNotFoundError as error:
        title, text = room.name, f"No data: {Path(error.filename).name} is missing."
    page = f"../../{(room.folder / 'README.md').relative_to(ROOT)}"
    page = page.replace("../../studies/benchmarks/", "")
    head = f'<a id="{anchor(room)}"></a>\n\n## {title}\n\n`{command_of(room)}`: [its page]({page}).'
    return f"{head}\n\n{text}"


def text(kept: pd.DataFrame) -> str:
    """Return the page."""
    return (
        "\n\n".join(
            (
                "# Results of the benchmarks",
                f"Written by `{ALL}` from the data of the benchmarks; `{ALL} --from-data` writes it again. Each "
                "heading names "
                "its command, and the page with the method.",
                whence(kept),
                markdown(measured(kept)),
                *map(section, ROOMS.values()),
            )
        )
        + "\n"
    )


def write(page: Path = PAGE) -> None:
    """Write the page from the available data."""
    whole = text(notes.read())
    write_whole(page, lambda path: path.write_text(whole, encoding="utf-8"))
