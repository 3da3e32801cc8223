"""Tables and pictures of the study, from its data."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from cases import ALIKE, GROWING
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogFormatter
from pages import machine, markdown, put_in

from damagepred.archive.files import write_whole
from damagepred.plotting.sheet import DPI, legend_below, new_figure, set_title, text_size

FINE = ("complete", "collapsed")
FITTED_FROM = {"blocks": 400, "contacts": 0, "zones": 0, "increments": 20, "samples": 256}
"""Sizes from which exponents are fitted: below, fixed costs of a path matter."""
AXIS = {"blocks": "blocks", "contacts": "contacts", "zones": "zones", "increments": "increments", "samples": "samples"}
"""Column of the size."""
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
    fine = rows[rows["end"].isin(FINE)].reindex(columns=_columns(rows))
    keys = ["grows", "curve", "size"]
    numbers = [c for c in fine.columns if c not in (*keys, "end", "message", "round", "limit")]
    found = fine.groupby(keys, sort=False)[numbers].median(numeric_only=True).reset_index()
    found["wall_memory"] = found["memory"] - found["memory_before"]
    found["a_step"] = found["seconds"] / found["iterations"]
    found["ns"] = 1e9 * found["a_step"] / np.where(found["zones"] > 0, found["zones"], found["contacts"])
    found["choleskys"] = found["seconds"] / found["cholesky"]
    found["at"] = [row[AXIS[row["grows"]]] for _, row in found.iterrows()]
    order = {(what, curve): k for k, (what, curve) in enumerate((w, c) for w in GROWING for c in GROWING[w])}
    rank = [order[row["grows"], row["curve"]] for _, row in found.iterrows()]
    return found.assign(rank=rank).sort_values(["rank", "at"], kind="stable").drop(columns="rank")


def _columns(rows: pd.DataFrame) -> list[str]:
    """Return the columns, also those that the quick form leaves empty."""
    wanted = (
        "memory",
        "memory_before",
        "iterations",
        "zones",
        "blocks",
        "contacts",
        "cholesky",
        "increments",
        "samples",
        "message",
        "events",
        "factorisations",
        "cracked",
        "archive",
        "open_seconds",
        "judge_seconds",
        "fit_seconds",
        "parent_seconds",
        "band",
        "files",
    )
    return [*rows.columns, *(c for c in wanted if c not in rows.columns)]


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


# -- tables -----------------------------------------------------------------------------------------------------------


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


def points(found: pd.DataFrame, what: str) -> pd.DataFrame:
    """Return a row for each case of a growing quantity."""
    own = found[found["grows"] == what]
    if what == "samples":
        return pd.DataFrame(
            {
                "walls": own["curve"],
                "samples": _whole(own["samples"]),
                "solved in s": own["seconds"].where(own["curve"] != "walls made up"),
                "parent's own time, s": own["parent_seconds"],
                "memory, MB": own["wall_memory"],
                "archive, MB": own["archive"],
                "opened in s": own["open_seconds"],
                "judged again in s": own["judge_seconds"],
                "curves with bands in s": own["fit_seconds"],
            }
        )
    explicit = own["curve"].str.startswith("explicit")
    table = pd.DataFrame(
        {
            "walls and solver": own["curve"],
            "blocks": _whole(own["blocks"]),
            "contacts": _whole(own["contacts"]),
            "zones": _whole(own["zones"]),
            "increments": _whole(own["increments"]),
            "time, s": own["seconds"],
            "memory, MB": own["wall_memory"],
            "Newton iterations or cycles": _whole(own["iterations"]),
            "events": _whole(own["events"].where(~explicit)),
            "factorisations": _whole(own["factorisations"].where(~explicit)),
            "contacts cracked": _whole(own["cracked"]),
            "ns a contact (zone) and cycle": own["ns"].where(explicit),
            "in banded Choleskys": own["choleskys"],
        }
    )
    return table.dropna(axis=1, how="all").loc[:, lambda t: (t != "").any()]


def _whole(values: pd.Series) -> list[str]:
    return ["" if v != v else f"{v:.0f}" for v in values]


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


def text(rows: pd.DataFrame, found: pd.DataFrame) -> str:
    """Return the text of the page between its marks."""
    parts = [
        f"Machine: {machine()}. Each case ran {int(rows['round'].max())} times at most.",
        "Exponents p: time, steps and memory grow as size^p:",
        markdown(exponents(found)),
    ]
    same = f", {ALIKE} blocks"
    titles = {
        "blocks": "More blocks",
        "contacts": f"More contacts{same}",
        "zones": f"Smaller zones{same}",
        "increments": f"More increments{same}",
        "samples": "More samples",
    }
    for what, title in titles.items():
        if (found["grows"] == what).any():
            parts += [f"### {title}", markdown(points(found, what).fillna(math.nan))]
    missing = left_out(rows)
    if missing:
        parts += ["### Not solved", "\n".join(missing)]
    return "\n\n".join(parts)


# -- pictures ---------------------------------------------------------------------------------------------------------

COLOURS = {"dpc": "tab:blue", "no dpc": "tab:red", "own weight": "tab:green"}


def look(curve: str) -> dict[str, Any]:
    """Return the style of a curve: colour by wall, line by solver, marker by blocks."""
    wall = next((w for w in ("no dpc", "own weight", "dpc") if w in curve), "dpc")
    zoned = "deformable" in curve
    return {
        "color": COLOURS[wall],
        "ls": "--" if curve.startswith("explicit") else "-",
        "marker": "s" if zoned else "o",
        "ms": 4,
        "lw": 1.2,
        "mfc": "white" if zoned else COLOURS[wall],
    }


def lines(ax: Axes, found: pd.DataFrame, what: str, column: str, only: str = "", least: float = 0.0) -> None:
    """Draw a column over the size, with its exponent in the legend."""
    for curve, own in found[(found["grows"] == what) & found["curve"].str.contains(only)].groupby("curve", sort=False):
        own = own[own[column] > least].sort_values("at")
        if own.empty:
            continue
        fitted = power(own, column, least)
        label = f"{curve}: {fitted.exponent:.2f}" if fitted else curve
        ax.loglog(own["at"], own[column], label=label, **look(str(curve)))
    ax.set_xlabel(what)
    plain(ax)
    if ax.get_legend_handles_labels()[0]:
        legend_below(ax, ax.get_legend_handles_labels()[0], 2)


class Few(LogFormatter):
    """Labels between powers of ten, where there are few of these; without exponents."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the label."""
        return f"{x:g}" if super().__call__(x, pos) else ""


def plain(ax: Axes) -> None:
    """Write numbers without powers of ten where there are few, and draw a grid."""
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(Few(minor_thresholds=(1, 0.4)))
    ax.grid(which="major", alpha=0.35)
    ax.grid(which="minor", alpha=0.12)


def draw_blocks(found: pd.DataFrame, file: Path) -> None:
    """Draw time, memory, steps, and time of a step over the number of blocks."""
    figure = new_figure(13, 15)
    (time, memory), (newton, cycles) = figure.subplots(2, 2)
    lines(time, found, "blocks", "seconds")
    own = found[(found["curve"] == "quasi-static, dpc") & (found["grows"] == "blocks") & (found["cholesky"] > 0)]
    time.loglog(own["at"], own["cholesky"], color="0.5", lw=1, label="one banded Cholesky, to compare")
    legend_below(time, time.get_legend_handles_labels()[0], 2)
    lines(memory, found, "blocks", "wall_memory", least=NOT_MORE)
    lines(newton, found, "blocks", "iterations")
    lines(cycles, found, "blocks", "ns", only="explicit")
    set_title(time, "Processor time of a path (s)")
    set_title(memory, "Peak memory, less that before the wall (MB)")
    set_title(newton, "Newton iterations (quasi-static) or cycles (explicit) of a path")
    set_title(cycles, "Explicit: time of a cycle over contacts, or over zones (ns)")
    time.set_ylabel("s")
    memory.set_ylabel("MB")
    newton.set_ylabel("steps")
    cycles.set_ylabel("ns")
    figure.suptitle(
        "The cost of a larger wall: axes logarithmic; numbers are exponents of fitted powers", fontsize=text_size(time)
    )
    write_whole(file, lambda p: figure.savefig(p, dpi=DPI, format="png"))


def draw_others(found: pd.DataFrame, file: Path) -> None:
    """Draw the time over contacts, zones, increments and samples."""
    figure = new_figure(13, 15)
    panels = figure.subplots(2, 2)
    for ax, what in zip(panels.ravel(), ("contacts", "zones", "increments"), strict=False):
        lines(ax, found, what, "seconds")
        ax.set_ylabel("s")
        set_title(ax, f"Processor time of a path over {what}", f"{ALIKE} blocks")
    ax = panels[1][1]
    own = found[found["grows"] == "samples"]
    solved, made_up = {"curve": "small walls solved", "marker": "o"}, {"curve": "walls made up", "marker": "s"}
    for style, column, label in (
        (solved | {"color": "tab:blue"}, "seconds", "walls solved (s)"),
        (solved | {"color": "tab:blue", "ls": ":"}, "parent_seconds", "parent's own time (s)"),
        (solved | {"color": "tab:orange", "ls": "--"}, "archive", "archive (MB)"),
        (made_up | {"color": "tab:green"}, "judge_seconds", "judged again (s)"),
        (made_up | {"color": "tab:red"}, "fit_seconds", "curves fitted, with bands (s)"),
        (made_up | {"color": "tab:purple", "ls": "--"}, "wall_memory", "memory to judge and fit (MB)"),
    ):
        curve = style.pop("curve")
        part = own[(own["curve"] == curve) & (own[column] > 0)].sort_values("at")
        if part.empty:
            continue
        fitted = power(part, column)
        ax.loglog(part["at"], part[column], ms=4, label=f"{label}: {fitted.exponent:.2f}" if fitted else label, **style)
    ax.set_xlabel("samples")
    ax.set_ylabel("s, MB")
    plain(ax)
    legend_below(ax, ax.get_legend_handles_labels()[0], 2)
    set_title(ax, "A study of more samples", "solved: walls of 24 blocks; judged and fitted: made up")
    figure.suptitle(
        "More contacts, zones, increments and samples: axes logarithmic; numbers are exponents of fitted powers",
        fontsize=text_size(ax),
    )
    write_whole(file, lambda p: figure.savefig(p, dpi=DPI, format="png"))


def write(rows: pd.DataFrame, folder: Path) -> None:
    """Write tables into the page, and the pictures beside it."""
    found = medians(rows)
    page = folder / "README.md"
    if page.exists():
        put_in(page, text(rows, found))
    draw_blocks(found, folder / "blocks.png")
    draw_others(found, folder / "others.png")


__all__ = ["GROWING", "exponents", "left_out", "medians", "points", "power", "text", "write"]
