"""RESULTS.md: the results of all benchmarks, from their data alone."""

from __future__ import annotations

import shlex
from pathlib import Path

import pandas as pd

from damagepred.archive.files import write_whole
from damagepred.plotting.sheet import DPI, new_figure, small
from studies.benchmarks import notes
from studies.benchmarks.pages import markdown
from studies.benchmarks.rooms import HERE, ROOMS, ROOT, Room, said

PAGE, PICTURE = HERE / "RESULTS.md", HERE / "RESULTS.png"
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


def command_of(room: Room) -> str:
    """Return the command of a benchmark, as typed in a shell."""
    return shlex.join(["python", *room.command]).replace("'", '"')


def measured(kept: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each benchmark: contents, version, date, and minutes."""
    rows = []
    for room in ROOMS.values():
        own = kept[kept["room"] == room.name]
        row = {"": f"[{room.name}](#{anchor(room)})", "what": CONTENTS[room.name]}
        row |= {name: "; ".join(dict.fromkeys(own[name])) for name in ("version", "date")}
        rows.append(row | {"minutes": f"{own['minutes'].sum():.1f}"})
    return pd.DataFrame(rows)


def anchor(room: Room) -> str:
    """Return the anchor of a benchmark's section."""
    return room.name.replace("_", "-")


def whence(kept: pd.DataFrame) -> str:
    """Return machine and version of all measurements, and a caution where they are not of one run."""
    machines, versions = (list(dict.fromkeys(kept[name])) for name in ("machine", "version"))
    days, parted = sorted(set(kept["date"])), [name for name in ROOMS if not notes.whole(kept, name)]
    lines = ["On " + (machines[0] if len(machines) == 1 else "machines that differ: " + "; ".join(machines)) + "."]
    if not parted and len(versions) == 1 and len(machines) == 1:
        lines.append(f"All with damagepred {versions[0]}, {days[0]}{f' to {days[-1]}' if len(days) > 1 else ''}.")
        return " ".join(lines)
    lines.append("**Not all figures are of one run.**")
    if len(versions) > 1:
        lines.append("Versions differ between benchmarks, or within one.")
    if parted:
        lines.append(
            f"Data of {', '.join(parted)} are, at least in part, of calls that were not recorded or not complete."
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


def draw(path: Path) -> None:
    """Draw the time of a path over the number of blocks, and that of other solvers for a dry wall."""
    figure = new_figure(9.0, 5.5)
    ax = figure.add_subplot()
    grown = pd.read_csv(ROOMS["scaling"].folder / "data.csv").query("grows == 'blocks' and end == 'complete'")
    for curve, own in grown.groupby("curve", sort=False):
        own = own.groupby("blocks")["seconds"].median()
        ax.loglog(own.index, own, "--" if "explicit" in str(curve) else "-", label=curve)
    others = pd.read_csv(ROOMS["beside_others"].folder / "runs.csv").query(
        "case == 'gap' and settings != 'increments 1'"
    )
    for k, (solver, own) in enumerate(others.groupby("solver", sort=False)):
        own = own.groupby("blocks")["s at 0.001"].min().dropna()
        if len(own):
            ax.loglog(own.index, own, ":", marker="os^vDP"[k % 6], label=f"dry wall: {str(solver).replace('_', '-')}")
    ax.set_xlabel("blocks")
    ax.set_ylabel("processor time of a path (s)")
    ax.grid(alpha=0.3)
    figure.legend(*ax.get_legend_handles_labels(), loc="outside right upper", frameon=False, fontsize=small(ax))
    write_whole(path, lambda p: figure.savefig(p, dpi=DPI, format="png"))


def text(kept: pd.DataFrame) -> str:
    """Return the page."""
    parts = (
        "# Results of the benchmarks",
        f"Written by `{ALL}` from the data of the benchmarks; `{ALL} --from-data` writes it again. Each heading names "
        "its command, and the page with the method.",
        whence(kept),
        f"![Time of a path over the number of blocks]({PICTURE.name})",
        "Solid: quasi-static; dashed: explicit; dotted: a dry wall over ground that drops, to a residual of 0.001.",
        markdown(measured(kept)),
        *map(section, ROOMS.values()),
    )
    return "\n\n".join(parts) + "\n"


def write() -> None:
    """Write the page and its picture from the available data."""
    whole = text(notes.read())
    draw(PICTURE)
    write_whole(PAGE, lambda path: path.write_text(whole, encoding="utf-8"))
