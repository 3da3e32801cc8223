"""Picture and tables of this benchmark, from data.csv, floors.csv and costs.csv."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.ticker import FuncFormatter
from pages import machine, markdown, put_in

from damagepred.archive.files import write_whole
from damagepred.plotting.sheet import DPI, new_figure, set_title, small

HERE = Path(__file__).resolve().parent
WALLS = {
    "window": "window wall: one strength for each wall",
    "joints": "solid wall: strength from joint to joint",
}
QUESTIONS = ("median", "probability near 0.1", "small probability")
COLOURS = {
    "random": "black",
    "Latin hypercube": "tab:orange",
    "Sobol": "tab:blue",
    "Sobol, 8 scrambles": "tab:cyan",
    "importance": "tab:green",
    "importance, Sobol": "tab:olive",
    "subset simulation": "tab:red",
    "two-level, larger blocks": "tab:purple",
    "two-level, two contacts": "tab:pink",
    "two-level, half the increments": "tab:brown",
}
IN_PICTURE = {"larger blocks", "two contacts", "half the increments", "lognormal form"}


def write(folder: Path) -> None:
    """Write picture and tables beside the data of a folder; the page only if it exists."""
    data, floors, costs = (pd.read_csv(folder / name) for name in ("data.csv", "floors.csv", "costs.csv"))
    data = with_gain(data)
    draw(data, floors, folder / "errors.png")
    page = folder / "README.md"
    if page.is_file():
        put_in(page, "\n\n".join(tables(data, floors, costs)))


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


def order(part: pd.DataFrame) -> tuple[float, float]:
    """Return the observed order of the error in the number of walls, and its standard error."""
    known = part[np.isfinite(part["error"]) & (part["error"] > 0)]
    if len(known) < 3:
        return np.nan, np.nan
    x, y = np.log(known["walls"]), np.log(known["error"])
    centred = x - x.mean()
    slope = float((centred * y).sum() / (centred**2).sum())
    scatter = 1 / np.sqrt(2 * max(float(known["runs"].min()), 1))
    return slope, float(scatter / np.sqrt((centred**2).sum())) if known["runs"].min() else 0.0


def tables(data: pd.DataFrame, floors: pd.DataFrame, costs: pd.DataFrame) -> list[str]:
    """Return the text of the page between its marks."""
    parts = [f"Measured on {machine()}; processor time, kernels compiled before."]
    spent = costs.assign(mean=1e3 * costs["mean"], median=1e3 * costs["median"])
    spent = spent.pivot_table(index="form", columns="wall", values="mean", sort=False).reset_index()
    parts += ["### Time of a wall (ms, mean of 60 walls, forms alternating)", markdown(spent)]
    for question in QUESTIONS:
        asked = data[data["question"] == question]
        for wall in WALLS:
            part = asked[asked["wall"] == wall]
            if part.empty:
                continue
            at = "" if np.isnan(part["at"].iloc[0]) else f" at {1e3 * part['at'].iloc[0]:g} mm"
            value, own = part["truth"].iloc[0], part["truth error"].iloc[0]
            unit, factor = (" mm", 1e3) if question == "median" else ("", 1.0)
            parts.append(
                f"### {question.capitalize()}{at}, {wall}\n\n"
                f"Reference: {factor * value:.4g}{unit}, relative standard error {own:.2%}."
            )
            parts.append(markdown(_summary(part)))
    if not floors.empty:
        told = floors.assign(
            **{
                "difference %": 100 * floors["difference"],
                "its standard error %": 100 * floors["error"],
                "random walls": [_walls_until(data, row, "random") for row in floors.itertuples()],
            }
        )
        names = ["wall", "question", "what", "difference %", "its standard error %", "random walls"]
        parts += ["### Errors that do not decrease with the number of walls", markdown(told[names])]
    return parts


def _summary(part: pd.DataFrame) -> pd.DataFrame:
    rows = []
    for method in COLOURS:
        own = part[part["method"] == method].sort_values("walls")
        if own.empty:
            continue
        slope, spread = order(own)
        shown = own if len(own) <= 3 else own.iloc[[0, len(own) // 2, len(own) - 1]]
        for k, row in enumerate(shown.itertuples()):
            rows.append(
                {
                    "method": method if k == 0 else "",
                    "walls": round(row.walls),
                    "seconds": row.seconds,
                    "error %": 100 * row.error,
                    "90 %": "" if np.isnan(row.lower) else f"{100 * row.lower:.2g}-{100 * row.upper:.2g}",
                    "bias %": 100 * row.bias if row.runs else np.nan,
                    "time of random over this": row.gain,
                    "order": f"{slope:.2f} ± {spread:.2f}" if k == 0 and slope == slope else "",
                }
            )
    return pd.DataFrame(rows)


def _walls_until(data: pd.DataFrame, row: object, method: str) -> float:
    """Return the number of walls at which the sampling error equals a difference of the model."""
    part = data[(data["wall"] == row.wall) & (data["question"] == row.question) & (data["method"] == method)]  # type: ignore[attr-defined]
    last = part.nlargest(3, "walls")
    away = abs(row.difference)  # type: ignore[attr-defined]
    if away < 2 * row.error:
        return np.nan
    return float((last["error"] ** 2 * last["walls"]).mean()) / away**2 if away else float("inf")


def draw(data: pd.DataFrame, floors: pd.DataFrame, path: Path) -> None:
    """Draw errors over time: a row of panels for each wall, a panel for each question."""
    kinds = [w for w in WALLS if (data["wall"] == w).any()]
    asked = [q for q in QUESTIONS if (data["question"] == q).any()]
    figure = new_figure(1.5 + 4.3 * len(asked), 1.6 + 3.7 * len(kinds))
    panels = figure.subplots(len(kinds), len(asked), squeeze=False)
    handles = {}
    for i, wall in enumerate(kinds):
        for j, question in enumerate(asked):
            ax = panels[i][j]
            part = data[(data["wall"] == wall) & (data["question"] == question)]
            if part.empty:
                ax.set_axis_off()
                continue
            for method, colour in COLOURS.items():
                own = part[part["method"] == method].sort_values("seconds")
                if own.empty:
                    continue
                apart = [(own["error"] - own["lower"]).fillna(0), (own["upper"] - own["error"]).fillna(0)]
                style = "-" if method == "random" else "o-"
                handles[method] = ax.errorbar(
                    own["seconds"], own["error"], yerr=apart, fmt=style, ms=3.5, lw=1.2, elinewidth=0.7, color=colour
                )
            _floors(ax, floors, wall, question)
            ax.axhspan(1e-9, part["truth error"].iloc[0], color="0.9", zorder=0)
            ax.set_xscale("log")
            ax.set_yscale("log")
            ax.set_ylim(min(0.8 * part["truth error"].min(), 0.7 * part["error"].min()), 1.5 * part["error"].max())
            ax.yaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{100 * v:g} %"))
            ax.xaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
            value = part["truth"].iloc[0]
            said = (
                f"{1e3 * value:.3g} mm" if question == "median" else f"{value:.2g} by {1e3 * part['at'].iloc[0]:.3g} mm"
            )
            set_title(ax, WALLS[wall], f"{question}: {said}")
            ax.set_xlabel("processor time of all walls (s)")
            if j == 0:
                ax.set_ylabel("relative error, root mean square")
            ax.grid(True, which="major", color="0.9")
    figure.legend(
        list(handles.values()),
        list(handles),
        loc="outside lower center",
        ncols=5,
        frameon=False,
        title="bars: 90 % confidence; grey: error of the reference; dashed: difference of a form of the model; "
        "axes logarithmic",
        fontsize=small(panels[0][0]),
        title_fontsize=small(panels[0][0]),
    )
    write_whole(path, lambda p: figure.savefig(p, dpi=DPI, format="png"))


def _floors(ax, floors: pd.DataFrame, wall: str, question: str) -> None:  # type: ignore[no-untyped-def]
    if floors.empty:
        return
    for row in floors[(floors["wall"] == wall) & (floors["question"] == question)].itertuples():
        if row.what in IN_PICTURE and abs(row.difference) > 2 * row.error:
            ax.axhline(abs(row.difference), ls="--", lw=0.8, color="0.4")
            ax.annotate(
                row.what,
                (0.995, abs(row.difference)),
                xycoords=("axes fraction", "data"),
                annotation_clip=True,
                ha="right",
                va="bottom",
                fontsize=small(ax),
                color="0.3",
            )
