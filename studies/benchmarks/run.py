"""Write RESULTS.md and its picture from the data of the benchmarks.

    python studies/benchmarks/run.py

``python studies/run.py`` measures the benchmarks first; ``studies/runs.csv`` has version, date and machine of each.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import matplotlib.figure
import pandas as pd

from damagepred.archive.files import write_whole
from studies.pages import markdown
from studies.run import runs, studies

HERE = Path(__file__).resolve().parent
NAMES = ("work_precision", "probabilities", "scaling", "beside_others")
PAGE, PICTURE = HERE / "RESULTS.md", HERE / "RESULTS.png"


def summary(name: str) -> Any:
    """Module that summarises the data of a benchmark: ``TITLE``, ``headline(folder)`` and ``text(folder)``."""
    return importlib.import_module(f"studies.benchmarks.{name}.summary")


def in_short(table: pd.DataFrame) -> pd.DataFrame:
    """One row per benchmark: question, result, version, date and minutes."""
    known, rows = studies(), []
    for name in NAMES:
        question = known["question"][f"benchmarks/{name}"]
        row = {"question": f"[{question}](#{name.replace('_', '-')})", "result": summary(name).headline(HERE / name)}
        rows.append(row | table.loc[f"benchmarks/{name}", ["version", "date", "minutes"]].to_dict())
    return pd.DataFrame(rows)


def provenance(table: pd.DataFrame) -> str:
    """Machine of all measurements, and a caution where they are not of one machine and version."""
    own = table.loc[[f"benchmarks/{name}" for name in NAMES]]
    versions, machines = (list(dict.fromkeys(own[name])) for name in ("version", "machine"))
    lines = [f"On {'; '.join(machines)}."]
    if len(machines) > 1 or len(versions) > 1:
        lines.append("**Not all figures are of one machine and version.**")
    else:
        lines.append(f"All with damagepred {versions[0]}, {' to '.join(sorted({*own['date']}))}.")
    if parted := [name for name in own.index if own["end"][name] != "complete"]:
        lines.append(f"Not complete: {', '.join(parted)}.")
    return " ".join(lines)


def section(name: str, folder: Path | None = None) -> str:
    """Section of a benchmark, from its own data or from those in another folder."""
    told, head = summary(name), f'<a id="{name.replace("_", "-")}"></a>'
    command = f"`{studies()['command'][f'benchmarks/{name}']}`: [its page]({name}/README.md)."
    return "\n\n".join((head, f"## {told.TITLE}", command, told.text(folder or HERE / name)))


def draw(path: Path) -> None:
    """Draw the time of a path over the number of blocks, and that of other solvers for a dry wall."""
    figure = matplotlib.figure.Figure((9.0, 5.5), layout="constrained")
    ax = figure.add_subplot(xlabel="blocks", ylabel="processor time of a path (s)", xscale="log", yscale="log")
    walls = pd.read_csv(HERE / "scaling" / "data.csv").query("grows == 'blocks' and end == 'complete'")
    walls = walls.pivot_table(index="blocks", columns="curve", values="seconds", sort=False)
    for curve in walls:
        walls[curve].dropna().sort_index().plot(ax=ax, style="--" if "explicit" in str(curve) else "-", label=curve)
    others = pd.read_csv(HERE / "beside_others" / "runs.csv")
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
        "Written by `python studies/benchmarks/run.py` from the data of the benchmarks. Each heading names its "
        "command, and the page with the method. Kernels: [tests/regressions](../../tests/regressions/README.md).",
        provenance(table),
        f"![Time of a path over the number of blocks]({PICTURE.name})",
        "Solid: quasi-static; dashed: explicit; dotted: a dry wall over ground that drops, to a residual of 0.001.",
        markdown(in_short(table)),
        *map(section, NAMES),
    )
    return "\n\n".join(parts) + "\n"


def main() -> None:
    """Write the page and its picture."""
    draw(PICTURE)
    write_whole(PAGE, lambda path: path.write_text(text(runs()), encoding="utf-8"))


if __name__ == "__main__":
    main()
