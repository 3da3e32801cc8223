"""Clay spandrels: predicted peak forces of 27 equal panels, and what each unknown adds to their scatter.

    python studies/validation/spandrels/run.py --samples 48 --workers 2

takes ten minutes, goes on where it was stopped, and writes the tables and the picture of the README.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import xarray as xr

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from judging import case_main, judged, run_study, settings_of  # noqa: E402

from damagepred.arrays import FloatArray  # noqa: E402

PANEL = HERE / "panel.toml"


def _strength(name: str, mean: float, field: bool = True) -> dict[str, Any]:
    """Return the variable of a strength (Pa), from joint to joint, or one for the wall."""
    variable: dict[str, Any] = {"distribution": "lognormal", "mean": mean, "cov": 0.30}
    return {f"joint.{name}": variable | ({"field": {"course_correlation": 0.4}} if field else {})}


VARIANTS: dict[str, dict[str, Any]] = {
    "blind": {},
    "bricks rigid": {"scene__solver": {"blocks": "rigid"}},
    "supports rub, 0.5": {"scene__loading": {"bearing_friction": 0.5}},
    "one strength a wall": {
        "variables": _strength("tensile_strength", 0.16e6, False) | _strength("cohesion", 0.17e6, False)
    },
    "tension halved": {"variables": _strength("tensile_strength", 0.08e6)},
    "cohesion halved": {"variables": _strength("cohesion", 0.085e6)},
    "updated": {
        "variables": _strength("tensile_strength", 0.09e6),
        "scene__joint": {"fracture_energy": 7.53},
        "scene__head_joint": {"factor": {"tensile_strength": 0.05 / 0.09, "fracture_energy": 4.99 / 7.53}},
    },
}
"""Each changes one thing; ``updated`` takes strengths that were calibrated on these very panels."""


def peaks(ds: xr.Dataset) -> tuple[FloatArray, FloatArray]:
    """Return the largest load (kN) of each panel, and the gauge opening there (um)."""
    load, gauge = ds["load_force"].values, ds["gauge_opening"].values
    load = np.where(np.isfinite(load), load, -np.inf)
    at = load.argmax(axis=1)
    rows = np.arange(len(load))
    return load[rows, at] / 1e3, gauge[rows, at] * 1e6


def run(folder: Path, samples: int, workers: int) -> tuple[list[dict[str, Any]], str]:
    """Run all variants; return the rows of the table, and what else the page says."""
    observed = pd.read_csv(HERE / "observed.csv")
    force, opening = (observed.loc[observed.quantity == name, "value"].values for name in ("peak", "opening"))
    found, rows = {}, []
    for name, change in VARIANTS.items():
        ds = run_study(
            settings_of(PANEL, **change), folder / f"{name.replace(',', '').replace(' ', '_')}.dp", samples, workers
        )
        found[name], at = peaks(ds)
        blind = name != "updated"
        if name in ("blind", "updated"):
            rows.append(judged("peak force", "kN", found[name], force, blind))
            rows.append(judged("opening at the peak", "um", at, opening, blind))
    lines = ["| what is changed | mean, kN | COV |", "|---|---|---|"]
    lines += [f"| {name} | {p.mean():.1f} | {p.std(ddof=1) / p.mean():.2f} |" for name, p in found.items()]
    if folder == HERE / "results":
        draw(found, force)
    return rows, "\n".join(lines)


def draw(found: dict[str, FloatArray], observed: FloatArray) -> None:
    """Draw the distributions of predicted and measured peaks."""
    figure, ax = plt.subplots(figsize=(7.0, 3.6), layout="constrained")
    for name, values in {
        "measured": observed,
        **{n: found[n] for n in ("blind", "cohesion halved", "updated")},
    }.items():
        style = {"color": "black", "linewidth": 2.2} if name == "measured" else {"linewidth": 1.4}
        ax.ecdf(values, label=name, **style)
    ax.set_xlabel("peak force (kN)")
    ax.set_ylabel("share of the panels")
    ax.legend(frameon=False)
    figure.savefig(HERE / "peaks.png", dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    case_main(HERE, 48, run)
