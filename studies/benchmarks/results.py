"""RESULTS.md: the results of all benchmarks, from their data alone."""

from __future__ import annotations

from pathlib import Path

import matplotlib.figure
import pandas as pd

from damagepred.archive.files import write_whole
from studies.benchmarks.pages import markdown
from studies.benchmarks.rooms import HERE, ROOMS, ROOT, Room, measured, said

PAGE, PICTURE = HERE / "RESULTS.md", HERE / "RESULTS.png"
ALL = "python studies/benchmarks/run.py"


def in_short(table: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each benchmark: question, result, version, date and minutes."""
    rows = [{"room": r.name, "question": f"[{r.question}](#{anchor(r)})", "result": said(r)[1]} for r in ROOMS.values()]
    found = pd.DataFrame(rows).merge(table, on="room", how="left")
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
        title, _, text = said(room, folder)
    except FileNotFoundError as error:
        title, text = room.name, f"No data: {Path(error.filename).name} is missing."
    page = f"../../{(room.folder / 'README.md').relative_to(ROOT)}".replace("../../studies/benchmarks/", "")
    return f'<a id="{anchor(room)}"></a>\n\n## {title}\n\n`{room.shell}`: [its page]({page}).\n\n{text}'


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
