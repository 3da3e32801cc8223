"""Fragility curves of all variants of a study: fitted, tabulated at the limits of AS 2870, and drawn side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.lines import Line2D
from tables import CATEGORIES, Case

from damagepred import fit_fragility
from damagepred.archive.files import write_whole
from damagepred.damage.limits import MovementLimit
from damagepred.plotting.sheet import DPI, new_figure, set_title, small, text_size

BEGIN = "<!-- curves: written by run.py -->"
NAMES = {1: "very slight (1) or worse", 2: "slight (2) or worse", 3: "moderate (3) or worse"}
PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#7f7f7f")


def fits_of(cases: Sequence[Case]) -> list[tuple[Case, xr.Dataset]]:
    """Fit each case's curves: a lognormal for each category, or one dispersion for all where those would cross."""
    fitted = []
    for case in cases:
        curves = fit_fragility(case.walls, categories=CATEGORIES, bootstrap=500)
        if curves.attrs["curves_cross"]:
            curves = fit_fragility(case.walls, categories=CATEGORIES, bootstrap=500, model="common")
        fitted.append((case, curves))
    return fitted


def rows_of_curves(fitted: Sequence[tuple[Case, xr.Dataset]], limits: Mapping[str, MovementLimit]) -> pd.DataFrame:
    """Return a row for each variant, way of movement, category and limit of AS 2870 Table 4.1: probability and band.

    Empty where no curve could be fitted; ``fit`` says why.
    """
    rows: list[dict[str, Any]] = []
    for case, curves in fitted:
        length = float(case.walls["central_deflection"][0, -1] / case.walls["deflection_ratio"][0, -1])
        grid = curves["intensity"].values
        for limit in sorted(limits.values(), key=lambda one: one.value(length, 1.0)):
            ratio = limit.value(length, 1.0)
            if ratio * length > grid[-1] * (1 + 1e-9):
                continue
            for k, category in enumerate(CATEGORIES):
                own = curves.isel(category=k)
                at = {
                    name: float(np.interp(ratio * length, grid, own[f"probability{which}"].values))
                    for name, which in (("probability", ""), ("lower", "_lower"), ("upper", "_upper"))
                }
                rows.append(
                    {
                        "variant": case.variant,
                        "movement": case.kind,
                        "limit of": limit.about,
                        "limit": f"L/{1.0 / ratio:.0f}",
                        "category": category,
                        **at,
                        "median (mm)": 1e3 * float(np.fmax(own["median"], own["median_lower_bound"])),
                        "median lower (mm)": 1e3 * float(own["median_lower"]),
                        "median upper (mm)": 1e3 * float(own["median_upper"]),
                        "dispersion": float(own["dispersion"]),
                        "fit": str(own["fit_status"].values),
                    }
                )
    return pd.DataFrame(rows)


def markdown_of_curves(rows: pd.DataFrame) -> str:
    """Return a table for a README: probabilities (%) of category 1, 2 and 3 or worse at each limit, with 90 % bands."""
    limits = rows.drop_duplicates("limit of")
    lines = [
        "| wall | movement | category | "
        + " | ".join(f"{a}, {b}" for a, b in zip(limits["limit"], limits["limit of"]))
        + " | median (mm) |",
        "|" + "---|" * (4 + len(limits)),
    ]
    for (variant, kind, category), own in rows.groupby(["variant", "movement", "category"], sort=False):
        first = own.iloc[0]
        if np.isnan(first["median (mm)"]):
            lines.append(f"| {variant} | {kind} | {category} |" + " |" * len(own) + f" {first['fit']} |")
            continue
        cells = [
            f"{100 * row.probability:.0f} ({100 * row.lower:.0f}-{100 * row.upper:.0f})" for row in own.itertuples()
        ]
        median = f"{first['median (mm)']:.3g} ({first['median lower (mm)']:.3g}-{first['median upper (mm)']:.3g})"
        if first["fit"] == "extrapolated":
            median = f"> {first['median (mm)']:.3g}"
        lines.append(f"| {variant} | {kind} | {category} | " + " | ".join(cells) + f" | {median} |")
    return "\n".join(lines)


def draw_curves(title: str, fitted: Sequence[tuple[Case, xr.Dataset]], path: Path) -> None:
    """Draw curves with bands: a row of panels for each way of movement, a panel for each category."""
    kinds = list(dict.fromkeys(case.kind for case, _ in fitted))
    variants = list(dict.fromkeys(case.variant for case, _ in fitted))
    figure = new_figure(13.0, 1.6 + 3.4 * len(kinds) + 0.22 * len(variants))
    panels = figure.subplots(len(kinds), len(CATEGORIES), squeeze=False, sharex=True, sharey=True)
    for case, curves in fitted:
        number = variants.index(case.variant)
        colour = PALETTE[number % len(PALETTE)]
        deflection = 1e3 * curves["intensity"].values
        for k, ax in enumerate(panels[kinds.index(case.kind)]):
            own = curves.isel(category=k)
            # without a curve, the counted shares
            fitted_here = bool(np.isfinite(own["dispersion"]))
            values = own["probability"] if fitted_here else own["empirical"]
            style, width = ("-", 1.6) if fitted_here else (":", 1.1)
            ax.plot(deflection, values, style, color=colour, linewidth=width)
            ax.fill_between(deflection, own["probability_lower"], own["probability_upper"], color=colour, alpha=0.12)
    for row, kind in zip(panels, kinds):
        for k, ax in enumerate(row):
            set_title(ax, kind, NAMES[CATEGORIES[k]])
            ax.set_ylim(0, 1)
        row[0].set_ylabel("probability (1)")
    for ax in panels[-1]:
        ax.set_xlabel("central deflection (mm)")
        ax.set_xlim(left=0)
    labels = list(variants)
    handles = [Line2D([], [], color=PALETTE[i % len(PALETTE)], linewidth=1.6) for i in range(len(labels))]
    walls = max(case.walls.sizes["sample"] for case, _ in fitted)
    figure.legend(
        handles,
        labels,
        loc="outside lower center",
        ncols=2,
        frameon=False,
        fontsize=small(panels[0][0]),
        title_fontsize=small(panels[0][0]),
        title=f"up to {walls} walls a curve; bands: 90 % confidence; dotted: shares as counted, where no curve fits",
    )
    figure.suptitle(title, fontsize=text_size(panels[0][0]))
    write_whole(path, lambda p: figure.savefig(p, dpi=DPI, format="png"))
