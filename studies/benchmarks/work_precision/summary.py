"""Summary of this benchmark for RESULTS.md."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from errors import FINE_ENOUGH, load, with_errors
from page import at_default, observed, percent, preset_errors, summary, unfinished
from pages import markdown
from quantities import QUANTITIES
from run import REPEATS, SHORT

TITLE = "Error of a wall over computing time"
BY_WALL = "wall", "time, s"


def text(folder: Path) -> str:
    """Return the accuracy of the default, the fastest choices within 1 %, presets, and orders."""
    rows = load(folder / "data.csv")
    lines = with_errors(rows)
    left = unfinished(rows)
    return "\n\n".join(
        (
            "*The default, error in %*: against the same equations solved closely / against the finest model "
            "(in brackets "
            "its error, where it is more than 1 %; - where there is none).",
            markdown(both(lines)),
            "*The fastest choice within 1 %* in all quantities whose reference is accurate to 1 %.",
            markdown(soonest(lines)),
            "*Presets*: worst error against the finest model, in % of quantities that are known to 1 %, x time "
            "over that of "
            "`standard`.",
            markdown(presets(lines)),
            "*Observed orders of convergence*, over walls and quantities whose last differences decrease.",
            markdown(orders(rows)),
            f"Paths that did not end regularly: {len(left)} of {len(rows)}"
            + "".join(f"; {r.wall}, {r.axis} {r.value}: {what}" for r, what in zip(left.itertuples(), left.iloc[:, -1]))
            + ".",
        )
    )


def both(lines: pd.DataFrame) -> pd.DataFrame:
    """Return the errors of the default against both references, a row for each wall."""
    same, model = (at_default(lines, error).set_index(list(BY_WALL)) for error in ("solution", "model"))
    found = same.copy().astype(object)
    for name in found.columns:
        pairs = zip(same[name], model[name], strict=True)
        found[name] = ["" if not a and not b else f"{a or '-'} / {b or '-'}" for a, b in pairs]
    return found.reset_index()


def soonest(lines: pd.DataFrame) -> pd.DataFrame:
    """Return, wall by wall, the fastest choice within 1 % of each reference."""
    found = []
    for error, name in (("solution", "same equations"), ("model", "finest model")):
        own = summary(lines, error).set_index(["wall", "default, s"])
        own = own[["within 1 %", "fastest with all within 1 %", "its time, s"]]
        found.append(own.rename(columns=lambda c, name=name: f"{c.replace('with all within 1 %', '')} ({name})"))
    table = pd.concat(found, axis=1).reset_index()
    return table.rename(columns=lambda c: c.replace("within 1 % (", "default within 1 % (").replace("  ", " "))


def presets(lines: pd.DataFrame) -> pd.DataFrame:
    """Return the worst error and the time of each preset, wall by wall."""
    told = preset_errors(lines)
    told = told.assign(**{name: told[name].astype(float) for name in ("error", "floor", "times")})
    told = told[told["floor"] <= FINE_ENOUGH]
    rows = []
    for (method, accuracy), own in told.groupby(["method", "accuracy"], sort=False):
        cells = {
            wall: f"{percent(part['error'].max())} x{part['times'].iloc[0]:.2g}" for wall, part in own.groupby("wall")
        }
        rows.append({"preset": f"{accuracy}, {method.replace('quasi_', 'quasi-')}", **cells})
    return pd.DataFrame(rows).fillna("")


def orders(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the median of the observed orders of each refinement, and their range."""
    table = observed(rows)
    names = [name for name in QUANTITIES.values() if name in table]
    found = []
    for refinement, own in table.groupby("refinement", sort=False) if len(table) else ():
        orders = pd.to_numeric(own[names].stack(), errors="coerce").dropna()
        found.append(
            {
                "refinement": refinement,
                "median": orders.median(),
                "from": orders.min(),
                "to": orders.max(),
                "found in": len(orders),
            }
        )
    return pd.DataFrame(found)


def minutes(folder: Path) -> float:
    """Return the minutes of building and solving, with the repetitions of short paths."""
    rows = pd.read_csv(folder / "data.csv")
    seconds = pd.to_numeric(rows["seconds"], errors="coerce").fillna(0.0)
    short = seconds < SHORT
    return float((seconds * (1 + (REPEATS - 1) * short)).sum() + rows["build_seconds"].sum()) / 60
