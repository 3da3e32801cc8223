"""Section of this benchmark on RESULTS.md."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pandas as pd

from studies.benchmarks.probabilities.walls import WALLS
from studies.pages import markdown

TITLE = "Error of a median and of a small probability over computing time"
METHODS = (
    *("random", "Latin hypercube", "Sobol", "Sobol, 8 scrambles"),
    *("importance", "importance, Sobol", "subset simulation"),
)
LIMITS = (0.5, 0.1, 0.05)
"""Relative errors, root mean square."""


def headline(folder: Path) -> str:
    """Return the time to a median of the window walls, in a sentence."""
    data = pd.read_csv(folder / "data.csv").query("wall == 'window' and question == 'median'")
    own = {name: part.sort_values("seconds") for name, part in data.groupby("method")}
    took = {name: seconds_to(own[name]["seconds"], own[name]["error"], 0.1) for name in ("Sobol", "random")}
    return f"a median to 10 % takes {took['Sobol']} s by Sobol points, {took['random']} s by random walls"


def text(folder: Path) -> str:
    """Return the seconds to given errors, by wall, question and method; costs, and errors that do not decrease."""
    data, rows = with_gain(pd.read_csv(folder / "data.csv")), []
    known = dict(list(data.groupby(["wall", "question", "method"])))
    for wall, question, method in itertools.product(WALLS, ("median", "small probability"), METHODS):
        if (wall, question, method) not in known:
            continue
        own = known[wall, question, method].sort_values("seconds")
        value, last = own["truth"].iloc[0], own.iloc[-1]
        what = f"probability of {value:.2g} by {1e3 * last['at']:.3g} mm"
        row = {"wall": wall, "quantity": f"median, {1e3 * value:.3g} mm" if question == "median" else what}
        row |= {"method": method}
        row |= {f"s to {100 * limit:g} %": seconds_to(own["seconds"], own["error"], limit) for limit in LIMITS}
        row["error with most walls"] = f"{100 * last['error']:.2g} % ({last['walls']:.0f})"
        rows.append(row | {"time of random over this": last["gain"]})
    said = "Processor time to a relative error, interpolated between numbers of walls; `<`, `>`: reached with the "
    said += "smallest number, or not with the largest."
    floors = pd.read_csv(folder / "floors.csv")
    percent = {"difference %": 100 * floors["difference"], "its standard error %": 100 * floors["error"]}
    parts = [said, markdown(pd.DataFrame(rows))]
    parts += ["Errors of the median that do not decrease with the number of walls:"]
    parts += [markdown(floors.assign(**percent)[["wall", "what", *percent]])]
    return "\n\n".join(parts)


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


def with_gain(data: pd.DataFrame) -> pd.DataFrame:
    """Add the time of random walls for the same error over that of a method; their error is O(time^-1/2)."""
    base = {}
    for (wall, question), part in data[data["method"] == "random"].groupby(["wall", "question"]):
        # the largest numbers of walls: fits of few walls are unreliable
        last = part.nlargest(3, "walls")
        base[wall, question] = float((last["error"] ** 2 * last["seconds"]).mean())
    key = zip(data["wall"], data["question"])
    random = np.array([base.get(k, np.nan) for k in key])
    return data.assign(gain=random / (data["error"] ** 2 * data["seconds"]))
