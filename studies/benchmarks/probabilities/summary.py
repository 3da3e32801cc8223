"""Summary of this benchmark for RESULTS.md."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from page import COLOURS, QUESTIONS, WALLS, with_gain
from pages import markdown

TITLE = "Error of a median and of a small probability over computing time"
LIMITS = (0.5, 0.1, 0.05)
"""Relative errors, root mean square."""


def text(folder: Path) -> str:
    """Return the seconds to given errors, by wall, question and method."""
    data = with_gain(pd.read_csv(folder / "data.csv"))
    rows = []
    for wall in WALLS:
        for question in (q for q in QUESTIONS if q == "median" or q == "small probability"):
            asked = data[(data["wall"] == wall) & (data["question"] == question)]
            for method in COLOURS:
                own = asked[asked["method"] == method].sort_values("seconds")
                if own.empty:
                    continue
                value = own["truth"].iloc[0]
                rows.append(
                    {
                        "wall": wall,
                        "quantity": f"median, {1e3 * value:.3g} mm"
                        if question == "median"
                        else f"probability of {value:.2g} by {1e3 * own['at'].iloc[0]:.3g} mm",
                        "method": method,
                        **{
                            f"s to {100 * limit:g} %": seconds_to(own["seconds"], own["error"], limit)
                            for limit in LIMITS
                        },
                        "error with most walls": f"{100 * own['error'].iloc[-1]:.2g} % ({own['walls'].iloc[-1]:.0f})",
                        "time of random over this": own["gain"].iloc[-1],
                    }
                )
    said = "Processor time to a relative error, interpolated between numbers of walls; `<`, `>`: reached with the "
    said += "smallest number, or not with the largest."
    return f"{said}\n\n{markdown(pd.DataFrame(rows))}"


def seconds_to(seconds: pd.Series, error: pd.Series, limit: float) -> str:
    """Return the time after which errors stay within a limit, by log-log interpolation."""
    t, e = np.log(seconds.to_numpy(float)), np.log(error.to_numpy(float))
    beyond = np.flatnonzero(~(e <= np.log(limit)))
    if not len(beyond):
        return f"< {seconds.iloc[0]:.2g}"
    last = beyond[-1]
    if last == len(t) - 1:
        return f"> {seconds.iloc[-1]:.2g}"
    if not np.isfinite(e[last]):  # no study of this size had an answer
        return f"< {seconds.iloc[last + 1]:.2g}"
    share = (e[last] - np.log(limit)) / (e[last] - e[last + 1])
    return f"{np.exp(t[last] + share * (t[last + 1] - t[last])):.2g}"


def minutes(folder: Path) -> float:
    """Return the minutes of all sets, from the times of walls; those of subset simulation are measured."""
    from run import curve_plans, rare_plans

    costs = pd.read_csv(folder / "costs.csv").set_index(["wall", "form"])["mean"]
    data = pd.read_csv(folder / "data.csv")
    subset = data[data["method"] == "subset simulation"]
    total = float((subset["seconds"] * subset["runs"]).sum())
    for wall in WALLS:
        for plan in (*curve_plans(wall), *rare_plans(wall)):
            form = plan.variant or ("short path" + ", shifted" * plan.shifted if plan.rare else "path")
            total += plan.walls * plan.replicates * float(costs.get((wall, form), costs[wall, "path"]))
    return total / 60
