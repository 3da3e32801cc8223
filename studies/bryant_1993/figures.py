"""Pictures of one wall of the test, numbered as in the paper."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from measures import AROUND, at, width_against_separation
from solving import LABELS, Solved

from damagepred.plotting import draw, draw_wall
from damagepred.plotting.sheet import new_figure, small
from damagepred.plotting.stress import stress_levels

MM, KN = 1e3, 1e-3
COLOURS = {"prescribed": "black", "elastic": "#d55e00", "cracked": "#0072b2", "bent": "#009e73"}
TEST = {"color": "0.35", "linestyle": (0, (5, 3)), "linewidth": 1.1}


def development(solved: Solved, way: str = "elastic") -> Figure:
    """Draw a wall at some deflections as its dpc opens and slips (the paper's Figures 7 and 9)."""
    ds = solved.whole[way]
    figure = new_figure(17.0, 13.0)
    axes = figure.subplots(2, 2).ravel()
    for ax, deflection in zip(axes, solved.case.shown, strict=True):
        draw_wall(ds, ax, at(ds, deflection), slips=True)
        _shorten(ax, ds, at(ds, deflection))
    figure.suptitle(f"{solved.case.scene.title}; {LABELS[way]}; pink: has slipped and is closed", x=0.01, ha="left")
    return figure


def _shorten(ax: Axes, ds: xr.Dataset, increment: int) -> None:
    """Remove labels that are the same in neighbouring drawings."""
    scale = re.search(r"displacements (exaggerated [\d.]+ times|to scale)", ax.get_title(loc="left").replace("\n", " "))
    parts = [f"{MM * float(ds['central_deflection'][increment]):.2g} mm"]
    if "jack_load" in ds:
        parts.append(f"jacks {KN * float(ds['jack_load'][increment]):.1f} kN each")
    gap = MM * float(ds["dpc_opening_max"][increment])
    parts += [f"dpc open by {gap:.2f} mm at most", *([scale[1]] if scale else [])]
    ax.set_title("; ".join(parts), loc="left", fontsize=small(ax))


def jack_load(solved: Solved) -> Figure:
    """Draw the load of the jacks, and in doming of the supports, against the deflection, and the test's limit."""
    figure = new_figure(9.0, 5.6)
    ax = figure.add_subplot()
    dishing = "dishing" in solved.case.name
    for way in ("elastic", "cracked", "bent"):
        # the path that ends at the limit gives it most accurately
        exact = {k: v for k, v in solved.limit[way].attrs.items() if k == "limit_deflection"}
        ds, label = solved.whole[way].assign_attrs(exact), LABELS[way].removeprefix("jacks, ")
        draw(ds, "jack_load", ax, label=f"{label}: each jack")
        if not dishing:
            least = ds.assign(support_load=ds["support_load"].min("support"))
            draw(least, "support_load", ax, label=f"{label}: least loaded support")
        for line in ax.lines:
            if str(line.get_label()).startswith(label):
                line.set(color=COLOURS[way], linestyle="--" if "support" in str(line.get_label()) else "-")
    handles = ax.get_legend_handles_labels()[0]
    ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2, frameon=False)
    limit = solved.case.test.get("central_deflection")
    if limit is not None:
        ax.axvline(MM * limit, **TEST)
        who = "jacks" if dishing else "supports"
        ax.annotate(
            f"test: {who} carry nothing at {MM * limit:g} mm",
            (MM * limit, 0.98),
            (-4, 0),
            va="top",
            xycoords=ax.get_xaxis_transform(),
            textcoords="offset points",
            ha="right",
            fontsize=small(ax),
            color="0.35",
        )
    return figure


def window_width(solved: Solved, whole_wall: xr.Dataset) -> Figure:
    """Draw the change of the window's width against the opening of the dpc, with straight lines (Figure 11)."""
    figure = new_figure(9.0, 6.0)
    ax = figure.add_subplot()
    for way, ds in solved.whole.items():
        x, y = MM * ds["dpc_opening_max"].values, MM * ds["opening_width_change"].values[:, 0]
        line = width_against_separation(ds)
        ax.plot(
            x,
            y,
            color=COLOURS[way],
            marker=".",
            markersize=4,
            linewidth=1.2,
            label=f"{LABELS[way]}: straight line {line.slope:.2g} mm/mm, r2 = {line.r2:.3f}",
        )
        ends = np.array([0.0, x.max()])
        ax.plot(ends, MM * line.start + line.slope * ends, color=COLOURS[way], linewidth=0.8, linestyle=":")
    x, y = MM * whole_wall["dpc_opening_max"].values, MM * whole_wall["opening_width_change"].values[:, 0]
    ax.plot(
        x,
        y,
        color="#cc79a7",
        marker="x",
        markersize=4,
        linewidth=1.2,
        label="jacks, elastic footing, joints of the wall that do not break",
    )
    seen = solved.case.test.get("opening_width_change")
    if seen is not None:
        ax.axhline(MM * seen, **TEST)
        ax.annotate(
            f"test: {MM * seen:g} mm at the largest deflection; the dpc's opening there is not reported",
            (0.99, MM * seen),
            (0, 3),
            xycoords=ax.get_yaxis_transform(),
            textcoords="offset points",
            ha="right",
            fontsize=small(ax),
            color="0.35",
        )
    ax.axhline(0.0, color="black", linewidth=0.8)
    ax.set_xlabel("widest opening of the dpc (mm)")
    ax.set_ylabel("change of the window's width at the top (mm)")
    ax.grid(color="0.9")
    ax.legend(fontsize=small(ax))
    ax.set_title(solved.case.scene.title, loc="left", fontsize=small(ax))
    return figure


def window_stress(ds: xr.Dataset, increments: tuple[int, int]) -> Figure:
    """Draw horizontal and largest principal stress around the window at two increments (Figure 10)."""
    figure = new_figure(13.0, 12.5)
    left, width = float(ds["opening_left"][0]), float(ds["opening_width"][0])
    components = ("stress_xx", "stress_largest")
    levels = {c: stress_levels(ds, c, increments) for c in components}
    grid = figure.subplots(2, 2)
    for row, increment in zip(grid, increments, strict=True):
        for ax, component in zip(row, components, strict=True):
            draw(ds, component, ax, increment=increment, levels=levels[component])
            ax.set_xlim(left - 1.5 * AROUND, left + width + 1.5 * AROUND)
            title = "horizontal stress" if component == "stress_xx" else "largest principal stress"
            ax.set_title(
                f"{title} at {MM * float(ds['central_deflection'][increment]):.1f} mm", loc="left", fontsize=small(ax)
            )
            for text in list(ax.texts):
                text.remove()
            for line in list(ax.lines):
                line.remove()
    return figure


def save(figure: Figure, file: Path, dpi: int = 75) -> None:
    """Write a picture."""
    figure.savefig(file, dpi=dpi, bbox_inches="tight", pad_inches=0.1)
    print(f"drew {file}")


def draw_case(solved: Solved, folder: Path, extra: dict[str, Callable[[], Figure]] | None = None) -> None:
    """Draw the pictures of a wall into its folder."""
    sheets: dict[str, Callable[[], Figure]] = {
        "development.png": lambda: development(solved),
        "jack_load.png": lambda: jack_load(solved),
        **(extra or {}),
    }
    for name, sheet in sheets.items():
        save(sheet(), folder / name)
