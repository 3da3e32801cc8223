"""Section of this benchmark on RESULTS.md."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from studies.benchmarks.scaling.cases import GROWING
from studies.benchmarks.scaling.run import FINE
from studies.pages import markdown

TITLE = "Growth of time and memory with the size of walls"
FITTED_FROM = {"blocks": 400, "contacts": 0, "zones": 0, "increments": 20}
"""Sizes from which exponents are fitted: below, fixed costs of a path matter."""
NOT_MORE = 2.0
"""Memory (MB) below which no exponent is fitted: a process has a reserve."""


def solved(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the solved cases, curve by curve, with the size that grows and the memory of the wall alone."""
    fine = rows[rows["end"].isin(FINE)]
    fine = fine.assign(at=[row[row["grows"]] for _, row in fine.iterrows()])
    fine = fine.assign(wall_memory=(fine["memory"] - fine["memory_before"]).where(lambda m: m > NOT_MORE))
    order = [(what, curve) for what, curves in GROWING.items() for curve in curves]
    rank = [order.index(name) for name in zip(fine["grows"], fine["curve"])]
    return fine.assign(rank=rank).sort_values(["rank", "at"], kind="stable")


def power(own: pd.DataFrame, column: str) -> tuple[str, str]:
    """Return the exponent of a column along a curve, and the sizes it is fitted over; '' if two are not known."""
    known = own[own[column] > 0]
    part = known[known["at"] >= FITTED_FROM[own["grows"].iloc[0]]]
    part = part if len(part) >= 3 else known
    if len(part) < 2:
        return "", ""
    slope = np.polyfit(np.log(part["at"].to_numpy(float)), np.log(part[column].to_numpy(float)), 1)[0]
    return f"{slope:.2f}", f"{part['at'].min():.7g} to {part['at'].max():.7g}"


def exponents(rows: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each curve: the exponents of time, steps and memory, and its largest case."""
    lines = []
    for (what, curve), own in solved(rows).groupby(["grows", "curve"], sort=False):
        time, over = power(own, "seconds")
        largest = own.loc[own["at"].idxmax()]
        line = {"grows": what, "walls and solver": curve, "time": time, "steps": power(own, "iterations")[0]}
        line |= {"memory": power(own, "wall_memory")[0], "fitted over": over, "largest": f"{largest['at']:.7g}"}
        line |= {"its time, s": largest["seconds"], "its memory, MB": largest["wall_memory"]}
        lines.append(
            line | {"its time in Cholesky factorisations": largest["seconds"] / largest.get("cholesky", np.nan)}
        )
    return pd.DataFrame(lines)


def left_out(rows: pd.DataFrame) -> list[str]:
    """Return the cases that did not end regularly, in words."""
    bad = rows[~rows["end"].isin(FINE)]
    return [f"- {r.grows}, {r.curve}, {r.size:g}: {r.end} ({r.message})" for r in bad.itertuples(index=False)]


def headline(folder: Path) -> str:
    """Return the exponents over the number of blocks, in a sentence."""
    told = exponents(pd.read_csv(folder / "data.csv")).query("grows == 'blocks'").set_index("walls and solver")["time"]
    names = ("quasi-static, dpc", "quasi-static, no dpc", "quasi-static, deformable, dpc", "explicit, dpc")
    return "time grows with blocks to the power of " + "; ".join(f"{told[name]} ({name})" for name in names)


def text(folder: Path) -> str:
    """Return the exponents of time and memory, and the cases that were not solved."""
    rows = pd.read_csv(folder / "data.csv")
    missing = left_out(rows) or ["- none of those tried"]
    said = "Exponents p: time, steps and memory grow as size^p. The last column has one banded Cholesky factorisation "
    said += "of the wall's elastic stiffness, by LAPACK, as the unit:"
    return "\n\n".join((said, markdown(exponents(rows)), "Not solved:", "\n".join(missing)))
