"""Clay spandrels: predicted peak forces of 27 equal panels, and the share of each cause in their scatter.

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

from crossing import JOINTS, STUDIES, table, variance_shares  # noqa: E402
from judging import case_main, judged, run_study, settings_of  # noqa: E402

from damagepred.arrays import FloatArray  # noqa: E402
from damagepred.campaign.settings import StudySettings  # noqa: E402

PANEL = HERE / "panel.toml"
VARIANT_WALLS = 8
"""Walls of each variant, at most."""
BASE_POINTS = 32
"""Base points of the crossed walls."""


def _strength(name: str, mean: float) -> dict[str, Any]:
    """Return the variable of a strength (Pa) that varies from joint to joint."""
    field = {"course_correlation": 0.4}
    return {f"joint.{name}": {"distribution": "lognormal", "mean": mean, "cov": 0.16, "field": field}}


VARIANTS: dict[str, dict[str, Any]] = {
    "bricks rigid": {"scene__solver": {"blocks": "rigid"}},
    "self-weight balanced by counterweights": {"scene__block": {"density": 0.0}},
    "tension halved": {"variables": _strength("tensile_strength", 0.08e6)},
    "cohesion halved": {"variables": _strength("cohesion", 0.085e6)},
    "cohesion kept after slip": {"scene__joint": {"shear_fracture_energy": "none"}},
    "shear fracture energy 10 G_I": {"scene__joint": {"shear_fracture_energy": 113.0}},
    "shear fracture energy G_I": {"scene__joint": {"shear_fracture_energy": 11.3}},
    "cohesion lost at first slip": {"scene__joint": {"brittle_shear": True, "shear_fracture_energy": "none"}},
}
"""Each changes one thing of the blind prediction."""

UPDATED: dict[str, Any] = {
    "scene__material": "clay brick, Dutch, 1940s, joints",
    "variables": _strength("tensile_strength", 0.09e6) | _strength("cohesion", 0.09e6),
}
"""Joints of the micro-model that was calibrated on these very panels."""

CAUSES = {
    "strength of all joints of a panel (batch)": ("joint.strength_factor",),
    "strength of single joints": (JOINTS,),
    "correlation along a course (0, 0.4 or 0.8)": (STUDIES,),
    "friction and stiffness of the mortar": ("joint.friction", "joint.normal_stiffness"),
    "brick": ("block.elastic_modulus",),
    "supports and places of the loads": ("loading.bearing_friction", "load.1.at", "load.2.at"),
}
CORRELATIONS = (0.0, 0.4, 0.8)

WEIGHT = 1708.0 * 9.81 * 1.31 * 0.53 * 0.1 * 1e-3
"""Of a panel (kN)."""
ARM, MODULUS = 0.5 * (0.803 - 0.388), 0.1 * 0.53**2 / 6.0
"""Lever arm of half the load (m), and elastic section modulus of a panel (m3)."""


def peaks(ds: xr.Dataset) -> tuple[FloatArray, FloatArray]:
    """Return the largest load (kN) of each panel, and the gauge opening there (um)."""
    load, gauge = ds["load_force"].values, ds["gauge_opening"].values
    load = np.where(np.isfinite(load), load, -np.inf)
    at = load.argmax(axis=1)
    rows = np.arange(len(load))
    return load[rows, at] / 1e3, gauge[rows, at] * 1e6


def correlated(correlation: float) -> StudySettings:
    """Return the blind study with another correlation of neighbours along a course."""
    field = {"field": {"course_correlation": correlation}}
    variables = settings_of(PANEL).to_dict()["variables"]
    strengths = {name: variables[name] | field for name in ("joint.tensile_strength", "joint.cohesion")}
    return settings_of(PANEL, variables=strengths)


def bending_strength(force: float) -> float:
    """Return the bending strength (MPa) of a panel by elastic theory, from the load of both jacks (kN)."""
    return 1e-3 * 0.5 * force * ARM / MODULUS


def toothed_strength() -> float:
    """Return the tension (MPa) along the courses of a crack through head joints and along beds, all at their strength.

    Beds shear over the overlap of the bricks in every course; head joints are torn in every other one.
    """
    scene = settings_of(PANEL).scene
    overlap = 0.5 * scene.wall.block_length / scene.wall.block_height
    return 1e-6 * (scene.joint.cohesion * overlap + 0.5 * scene.joint.tensile_strength)


def run(folder: Path, samples: int, workers: int) -> tuple[list[dict[str, Any]], str]:
    """Run all variants and the crossed walls; return the rows of the table, and what else the page says."""
    observed = pd.read_csv(HERE / "observed.csv")
    force, opening = (observed.loc[observed.quantity == name, "value"].values for name in ("peak", "opening"))
    found, rows = {}, []
    for name, change in {"blind": {}, "updated": UPDATED, **VARIANTS}.items():
        judged_too = name in ("blind", "updated")
        walls = samples if judged_too else min(samples, VARIANT_WALLS)
        place = folder / f"{name.replace(' ', '_')}.dp"
        found[name], at = peaks(run_study(settings_of(PANEL, **change), place, walls, workers))
        if judged_too:
            rows.append(judged("peak force", "kN", found[name], force, name == "blind"))
            rows.append(judged("opening at the peak", "um", at, opening, name == "blind"))
    studies = [correlated(value) for value in CORRELATIONS]
    shares = variance_shares(studies, CAUSES, ("load_force",), BASE_POINTS if samples >= 48 else 2, folder, workers)
    first = found["blind"][:VARIANT_WALLS].mean()
    lines = ["| change | mean, relative to the same blind panels |", "|---|---|"]
    lines += [f"| {name} | {found[name].mean() / first:.2f} |" for name in VARIANTS]
    companion = pd.read_csv(HERE / "companion.csv").set_index("quantity").loc["bending strength in plane"]
    lines += [
        "",
        f"A panel weighs {WEIGHT:.1f} kN. Counterweights balanced it in the test; here it bends the panel, too, "
        "so the forces are those of the jacks alone. If the force of the source is gross of the counterweights, "
        f"{force.mean() - WEIGHT:.1f} kN is the force to predict.",
        "",
        f"Bending strength by elastic theory: predicted {bending_strength(found['blind'].mean()):.2f} MPa, panels "
        f"{bending_strength(force.mean()):.2f} MPa, or {bending_strength(2 * force.mean()):.2f} MPa if the force is "
        f"that of one jack; other specimens of this masonry {companion['mean']} MPa with a COV of "
        f"{companion.deviation / companion['mean']:.2f}.",
        "",
        f"A toothed crack through head joints and beds carries {toothed_strength():.2f} MPa in tension by hand. In "
        f"bending a section carries {toothed_strength():.2f} MPa if it is brittle, and "
        f"{3 * toothed_strength():.2f} MPa if beds keep their strength as they slide.",
        "",
        f"Shares of the variance of the peak force, of {shares.attrs['walls']} crossed walls (mean "
        f"{1e-3 * shares.attrs['mean']:.1f} kN, COV {shares.attrs['cov']:.2f}), with 90 % intervals:",
        "",
        table(shares),
    ]
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
