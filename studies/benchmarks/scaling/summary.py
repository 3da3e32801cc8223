"""Section of this benchmark on RESULTS.md."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from studies.benchmarks.pages import markdown
from studies.benchmarks.scaling.cases import GROWING

TITLE = "Growth of time and memory with the size of walls and studies"
FINE = ("complete", "collapsed")
FITTED_FROM = {"blocks": 400, "contacts": 0, "zones": 0, "increments": 20, "samples": 256}
"""Sizes from which exponents are fitted: below, fixed costs of a path matter."""
NOT_MORE = 2.0
"""Memory (MB) below which no exponent is fitted: a process has a reserve."""


class Power(NamedTuple):
    """A straight line through logarithms: exponent, and the range of the points."""

    exponent: float
    low: float
    high: float
    points: int


def medians(rows: pd.DataFrame) -> pd.DataFrame:
    """Return one row for each solved case: medians over rounds, and quantities derived from them."""
    numbers = [*GROWING, "seconds", "iterations", "memory", "memory_before"]
    fine = rows[rows["end"].isin(FINE)].reindex(columns=["curve", "size", "grows", *dict.fromkeys(numbers)])
    found = fine.groupby(["grows", "curve", "size"], sort=False).median(numeric_only=True).reset_index()
    found["wall_memory"] = found["memory"] - found["memory_before"]
    found["a_step"] = found["seconds"] / found["iterations"]
    found["at"] = [row[row["grows"]] for _, row in found.iterrows()]
    order = {(what, curve): k for k, (what, curve) in enumerate((w, c) for w in GROWING for c in GROWING[w])}
    rank = [order[row["grows"], row["curve"]] for _, row in found.iterrows()]
    return found.assign(rank=rank).sort_values(["rank", "at"], kind="stable").drop(columns="rank")


def power(own: pd.DataFrame, column: str, least: float = 0.0) -> Power | None:
    """Return the exponent of a column along a curve; None if it is not known at two sizes."""
    what = own["grows"].iloc[0]
    known = own[own[column] > least]
    part = known[known["at"] >= FITTED_FROM[what]]
    part = part if len(part) >= 3 else known
    if len(part) < 2:
        return None
    slope = np.polyfit(np.log(part["at"].to_numpy(float)), np.log(part[column].to_numpy(float)), 1)[0]
    return Power(float(slope), float(part["at"].min()), float(part["at"].max()), len(part))


def exponents(found: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each curve: the exponents of time and its factors, and of memory."""
    lines: list[dict[str, Any]] = []
    for (what, curve), own in found.groupby(["grows", "curve"], sort=False):
        powers = {
            name: power(own, name, NOT_MORE if name == "wall_memory" else 0.0)
            for name in ("seconds", "iterations", "a_step", "wall_memory")
        }
        largest, fitted = own.loc[own["at"].idxmax()], powers["seconds"]
        lines.append(
            {
                "grows": what,
                "walls and solver": curve,
                "time": _two(powers["seconds"]),
                "steps": _two(powers["iterations"]),
                "time of a step": _two(powers["a_step"]),
                "memory": _two(powers["wall_memory"]),
                "fitted over": "" if fitted is None else f"{fitted.low:.7g} to {fitted.high:.7g}",
                "largest": f"{largest['at']:.7g}",
                "its time, s": largest["seconds"],
                "its memory, MB": largest["wall_memory"],
            }
        )
    return pd.DataFrame(lines)


def _two(power: Power | None) -> str:
    return "" if power is None else f"{power.exponent:.2f}"


def left_out(rows: pd.DataFrame) -> list[str]:
    """Return the cases that did not end regularly, in words."""
    lines = []
    for _, row in rows[~rows["end"].isin(FINE)].drop_duplicates(["grows", "curve", "size"]).iterrows():
        reached = row.get("reached", math.nan)
        so_far = (
            f" in increment {reached + 1:.0f} of {row['increments']:.0f}" if reached == reached and reached >= 0 else ""
        )
        lines.append(f"- {row['grows']}, {row['curve']}, {row['size']:g}: {row['end']}{so_far} ({row['message']})")
    return lines


def text(folder: Path) -> str:
    """Return the exponents of time and memory, and the cases that were not solved."""
    rows = pd.read_csv(folder / "data.csv")
    missing = left_out(rows)
    return "\n\n".join(
        (
            "Exponents p: time, steps and memory grow as size^p:",
            markdown(exponents(medians(rows)).drop(columns=["time of a step"])),
            "Not solved:",
            "\n".join(missing) if missing else "- none of those tried",
        )
    )
