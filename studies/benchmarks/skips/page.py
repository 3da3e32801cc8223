"""Tables and picture of the study, from its data."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.ticker import FuncFormatter
from pages import machine, markdown, put_in
from scenes import SCENES
from skips import NOT_TURNED_OFF, SKIPS

from damagepred.archive.files import write_whole
from damagepred.plotting.sheet import DPI, new_figure, small, text_size
from studies import PARTS

SOME = (0.5, 2, 3, 5, 20, 30, 50)
"""Ratios labelled on the axis besides powers of ten."""
COLUMNS = (
    "seconds_on",
    "seconds_off",
    "bytes_on",
    "bytes_off",
    "sideways",
    "upwards",
    "dpc_opening",
    "cracked_on",
    "cracked_off",
    "otherwise",
    "steps_on",
    "steps_off",
    "factorisations_on",
    "factorisations_off",
    "searches_on",
    "searches_off",
    "end_on",
    "end_off",
    "reached_on",
    "reached_off",
)


def told(name: str) -> tuple[str, str]:
    """Return the skipped computation, and how it is turned off."""
    one = SKIPS.get(name) or PARTS[name]
    return one.what, one.how


def medians(rows: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each skip and wall: median times, the ratio with its range, the largest differences."""
    rows = rows.reindex(columns=["skip", "wall", "round", *COLUMNS])
    kept = rows["seconds_on"].isna()
    ratio = np.where(kept, rows["bytes_off"] / rows["bytes_on"], rows["seconds_off"] / rows["seconds_on"])
    lines: list[dict[str, Any]] = []
    for (skip, wall), own in rows.assign(ratio=ratio).groupby(["skip", "wall"], sort=False):
        last = own.iloc[-1]
        line = {
            "skip": skip,
            "wall": wall,
            "rounds": len(own),
            "ratio": own["ratio"].median(),
            "low": own["ratio"].min(),
            "high": own["ratio"].max(),
        }
        line |= {name: own[name].median() for name in ("seconds_on", "seconds_off", "bytes_on", "bytes_off")}
        line |= {name: own[name].max() for name in ("sideways", "upwards", "dpc_opening", "otherwise")}
        lines.append(line | {name: last[name] for name in COLUMNS if name not in line})
    order = {name: k for k, name in enumerate((*SKIPS, *PARTS))}
    return pd.DataFrame(lines).sort_values("skip", key=lambda s: s.map(order), kind="stable")


def overview(found: pd.DataFrame) -> pd.DataFrame:
    """Return one row for each skip: its meaning, and the ratio of the times without and with it."""
    lines: list[dict[str, Any]] = []
    for skip in (*SKIPS, *PARTS):
        own = found[found["skip"] == skip]
        what, how = told(skip)
        times = [f"{r['wall']} {r['ratio']:.3g}" for _, r in own.iterrows()]
        worst = own[["upwards", "sideways"]].max(axis=1).max()
        lines.append(
            {
                "skip": skip,
                "what is skipped": what,
                "turned off by": how,
                "times as fast, or as small": "; ".join(times) or "not measured yet",
                "largest difference of a displacement over the movement": "" if worst != worst else f"{worst:.1e}",
            }
        )
    return pd.DataFrame(lines)


def table(found: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each skip and wall: times, counts of work, and the differences."""
    timed = found[found["seconds_on"].notna()]

    def both(name: str) -> list[str]:
        pairs = zip(timed[f"{name}_on"], timed[f"{name}_off"], strict=True)
        return ["" if a != a or (a == 0 and b == 0) else f"{a:.0f}, {b:.0f}" for a, b in pairs]

    def small(values: pd.Series) -> list[str]:
        return ["" if v != v else f"{v:.1e}" if v else "0" for v in values]

    return pd.DataFrame(
        {
            "skip": timed["skip"],
            "wall": timed["wall"],
            "with, s": timed["seconds_on"],
            "without, s": timed["seconds_off"],
            "times as fast (from, to)": [
                f"{r:.2f} ({a:.2f}, {b:.2f})" for r, a, b in timed[["ratio", "low", "high"]].to_numpy()
            ],
            "upwards": small(timed["upwards"]),
            "sideways": small(timed["sideways"]),
            "dpc opening, um": small(1e6 * timed["dpc_opening"]),
            "cracked contacts": both("cracked"),
            "cracked otherwise": ["" if v != v else f"{v:.0f}" for v in timed["otherwise"]],
            "steps": both("steps"),
            "factorisations": both("factorisations"),
            "searches": both("searches"),
        }
    )


def endings(found: pd.DataFrame) -> list[str]:
    """Return the runs that did not reach the end of their movement."""
    return [
        f"- {r['skip']}, {r['wall']}, {way}: {r[f'end_{how}']} (increment {r[f'reached_{how}']:.0f})"
        for _, r in found.iterrows()
        for how, way in (("on", "with"), ("off", "without"))
        if isinstance(r[f"end_{how}"], str) and r[f"end_{how}"] != "complete"
    ]


def text(found: pd.DataFrame) -> str:
    """Return the text of the page between its marks."""
    sizes = found[found["bytes_on"].notna()]
    kept = pd.DataFrame(
        {
            "skip": sizes["skip"],
            "wall": sizes["wall"],
            "with, kB": sizes["bytes_on"] / 1e3,
            "without, kB": sizes["bytes_off"] / 1e3,
            "times as small": sizes["bytes_off"] / sizes["bytes_on"],
        }
    )
    never = pd.DataFrame({"skipped": list(NOT_TURNED_OFF), "why it is not turned off here": NOT_TURNED_OFF.values()})
    parts = [
        f"Machine: {machine()}.",
        f"Runs with and without alternate, {found['rounds'].min()} to {found['rounds'].max()} times each.",
        markdown(overview(found)),
        "### Wall by wall",
        "Differences of displacements, the largest of all increments, are over the movement; pairs are with, without.",
        markdown(table(found)),
        "### Kept in memory or on disk",
        markdown(kept),
    ]
    if lines := endings(found):
        parts += ["### Runs that did not reach the end of the movement", "\n".join(lines)]
    return "\n\n".join([*parts, "### Not turned off", markdown(never)])


def draw(found: pd.DataFrame, file: Path) -> None:
    """Draw the ratio of times without and with each skip."""
    names = list(dict.fromkeys(found["skip"]))
    walls = [w for w in dict.fromkeys((*SCENES, *(p.scene for p in PARTS.values()))) if (found["wall"] == w).any()]
    figure = new_figure(10, 2.8 + 0.46 * len(names))
    ax = figure.add_subplot()
    colours = colormaps["tab20"]
    for k, wall in enumerate(walls):
        own = found[found["wall"] == wall]
        ax.scatter(
            own["ratio"],
            [names.index(s) for s in own["skip"]],
            s=34,
            color=colours(k % 20),
            marker="osD^v"[k % 5],
            label=wall.replace("in time, falls", "dynamic, collapses").replace(
                "in time, rests", "dynamic, comes to rest"
            ),
            edgecolors="0.3",
            linewidths=0.4,
            zorder=3,
        )
    ax.axvline(1.0, color="0.3", lw=0.8)
    ax.set_xscale("log")
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.xaxis.set_minor_formatter(FuncFormatter(lambda value, _: f"{value:g}" if value in SOME else ""))
    told = {name: part.what.split(":")[0].split(",")[0] for name, part in {**SKIPS, **PARTS}.items()}
    told["condense and half"] = "degrees of freedom of elastic courses and the second half"
    ax.set_yticks(range(len(names)), ["\n".join(textwrap.wrap(told[name], 34)) for name in names], fontsize=small(ax))
    ax.invert_yaxis()
    ax.grid(axis="both", which="major", alpha=0.3)
    ax.set_xlabel("processor time (or stored size) without the skip\nover that with it (1), logarithmic")
    figure.suptitle("What the program leaves out, and the time it saves (above 1)", fontsize=text_size(ax))
    figure.legend(
        *ax.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=small(ax), frameon=False
    )
    write_whole(file, lambda p: figure.savefig(p, dpi=DPI, format="png"))


def write(rows: pd.DataFrame, folder: Path) -> None:
    """Write tables into the page, and the picture beside it."""
    found = medians(rows)
    page = folder / "README.md"
    if page.exists():
        put_in(page, text(found))
    draw(found, folder / "skips.png")
