"""Files of the runs, and the section of this benchmark on RESULTS.md."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from studies.benchmarks.beside_others.cases import LEVELS, Case
from studies.benchmarks.beside_others.record import Wall
from studies.pages import markdown

HERE = Path(__file__).resolve().parent

TITLE = "The same dry wall in other public solvers"
KEY = ["case", "size", "solver", "settings"]
NAMES = {
    "quasi_static": "damagepred, quasi-static",
    "explicit": "damagepred, explicit",
    "pymunk": "pymunk",
    "lmgc90": "LMGC90",
}
RUNS_OF = (("settling", "under its own weight"), ("gap", "the ground dropped under the middle"))
"""Cases that are timed to equilibrium, in words."""
COLUMNS = [f"s at {level:g}" for level in LEVELS]


def row_of(case: Case, solver: str, settings: str, found: dict[str, Any]) -> dict[str, Any]:
    """Return the row of one run in ``runs.csv``."""
    row: dict[str, Any] = {"case": case["name"], "size": case["size"], "solver": solver, "settings": settings}
    row |= {"blocks": len(case["blocks"]), "solver version": found.get("version", ""), "note": found.get("note", "")}
    row |= {name: found.get(name, np.nan) for name in ("build", "seconds", "steps", "residual")}
    seconds = found.get("settled") or [None] * len(LEVELS)
    row |= dict(zip(COLUMNS, (np.nan if s is None else s for s in seconds), strict=True))
    if "displacement" not in found:
        return row
    wall, moved, base = Wall(case), np.array(found["displacement"]), np.array(found["base"])
    row["weight on the ground"] = base.sum() / wall.weight.sum()
    row["largest base force"] = base.max() / base.mean()
    drop = max(case["drop"])
    if drop:
        left, right = (f([x for x, _ in case["ground"][case["drop"].index(drop)]]) for f in (min, max))
        x = wall.centre[wall.lowest, 0]
        row["blocks down"] = int((moved[:, 1] < -drop / 2).sum())
        row["weight on what dropped"] = base[(left < x) & (x < right)].sum() / wall.weight.sum()
    return row


def fastest(runs: pd.DataFrame, case: str) -> pd.DataFrame:
    """Return, for each size and solver, the least time at each residual, over all settings tried."""
    part = runs[runs["case"] == case]
    # without the symmetry reduction, which others could use, too
    part = part[part["settings"] != "symmetric_half False"]
    return part.groupby(["blocks", "solver"])[COLUMNS].min()


def ratios(runs: pd.DataFrame, case: str) -> pd.DataFrame:
    """Return the times of the others over ours at each residual, sizes and solvers in order."""
    best = fastest(runs, case)
    own = best.xs("quasi_static", level="solver")
    others = best.drop(["quasi_static", "explicit"], level="solver").div(own, level="blocks")
    others.columns = [c.replace("s at", "times at") for c in COLUMNS]
    return order(others.reset_index())


def order(rows: pd.DataFrame) -> pd.DataFrame:
    """Sort by size, our solvers first."""
    place = {name: i for i, name in enumerate(NAMES)}
    return rows.sort_values(["blocks", "solver"], key=lambda c: c.map(place) if c.name == "solver" else c)


def compared(runs: pd.DataFrame, case: str) -> pd.DataFrame:
    """Return the times of the others over ours, as lower bounds where they did not converge: of their longest run."""
    rows = ratios(runs, case).set_index(["blocks", "solver"])
    longest = runs[runs["case"] == case].groupby(["blocks", "solver"])["seconds"].max()
    least = longest.div(fastest(runs, case).xs("quasi_static", level="solver")[COLUMNS[0]], level="blocks")
    bound = least.map("> {:.2g}".format).reindex(rows.index)
    told = rows.astype(object).apply(lambda column: column.where(column.notna(), bound))
    return told.reset_index().assign(solver=[NAMES[str(s)] for s in rows.index.get_level_values("solver")])


def headline(folder: Path) -> str:
    """Return the least time of other solvers over ours at a residual of 0.001, in a sentence."""
    runs = pd.read_csv(folder / "runs.csv")
    found = pd.concat([ratios(runs, case) for case, _ in RUNS_OF]).query("blocks > 100")
    least = found.groupby("solver")["times at 0.001"].min().dropna()
    told = "; ".join(f"{NAMES[str(name)]} {value:.2g}" for name, value in least.items())
    return f"times as long as quasi-static from 126 blocks on, where a residual of 0.001 is reached: at least {told}"


def text(folder: Path) -> str:
    """Return the time of other solvers to the same residual, over that of the quasi-static solver, by size."""
    runs = pd.read_csv(folder / "runs.csv")
    parts = [
        "How many times as long as the quasi-static solver, to the same largest unbalanced force (mean block "
        "weights); fastest of the settings tried; `>`: not reached within the time limit."
    ]
    for case, words in RUNS_OF:
        own = fastest(runs, case).xs("quasi_static", level="solver")["s at 0.0001"]
        took = ", ".join(f"{1e3 * s:.3g} ms ({n} blocks)" for n, s in own.items())
        parts += [f"*{words[0].upper()}{words[1:]}*; quasi-static to 0.0001 in {took}.", markdown(compared(runs, case))]
    return "\n\n".join(parts)
