"""Dry walls of limit analysis, as distributions over the friction of their joints.

    python studies/validation/dry_walls/run.py --samples 32

takes two minutes, goes on where it was stopped, and writes the table of the README.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parents[2])]

from judging import case_main  # noqa: E402

import damagepred  # noqa: E402
from damagepred.arrays import FloatArray  # noqa: E402
from damagepred.uq.samplers import unit_points  # noqa: E402
from tests.verification.dry_walls import DryWall, portal, running_bond  # noqa: E402
from tests.verification.limit_analysis import collapse_factor  # noqa: E402

PUBLISHED = {0.65: np.array([0.640, 0.643])}
"""Friction -> collapse factor of the first wall: joints that do not dilate, and joints that do (reported)."""
COV, SEED = 0.15, 2001
"""Scatter of friction from wall to wall (assumed), and seed of its points."""
WALLS = (
    DryWall("Ferris and Tin-Loi, example 1", running_bond(6, 5, 0.4, 0.175, True), 0.65),
    DryWall("panel 0.8 m x 10 courses", running_bond(10, 2, 0.4, 0.175, True), 0.4),
    DryWall("panel 1.2 m x 12 courses", running_bond(12, 3, 0.4, 0.175, True), 0.3),
    DryWall("portal of two piers and a lintel", portal(5, 1.2, 0.3, 0.3, 0.3), 0.3),
)
BEYOND = 1.5
"""How far a wall is pushed, over the factor of limit analysis."""


def factors(wall: DryWall) -> tuple[float, float]:
    """Return the horizontal force over the weight at which a wall falls: by the solver, and by linear programming."""
    limit = collapse_factor(wall.blocks, set(wall.held), wall.friction, *wall.loads())
    pushed = wall.assembly()
    pushed.push_body(x=BEYOND * limit)
    ds = damagepred.solve(pushed, increments=1, on_failure="return")
    if ds.attrs["status"] != "collapsed":
        return np.nan, limit
    return BEYOND * limit * ds.attrs["collapse_progress"], limit


def sampled(wall: DryWall, samples: int, file: Path) -> FloatArray:
    """Return friction, factor by the solver and factor by linear programming of each sample, array (samples, 3)."""
    log = np.sqrt(np.log1p(COV**2))
    points = unit_points("sobol", 1, samples, SEED)[:, 0]
    friction = stats.lognorm(log, scale=wall.friction / np.sqrt(1.0 + COV**2)).ppf(points)
    known = np.loadtxt(file, ndmin=2) if file.exists() else np.empty((0, 3))
    with file.open("a", encoding="utf-8") as out:
        for value in friction[len(known) :]:
            row = (value, *factors(replace(wall, friction=float(value))))
            out.write(" ".join(map(repr, map(float, row))) + "\n")
            known = np.vstack((known, row))
    return known[:samples]


def run(folder: Path, samples: int, workers: int) -> tuple[list[dict[str, Any]], str]:
    """Sample the walls; return no rows, as nothing was measured, and the table of all."""
    lines = [
        "| wall | friction | factor: mean, 5 to 95 %, COV | over limit analysis: mean, least, most | not solved |",
        "|---|---|---|---|---|",
    ]
    for number, wall in enumerate(WALLS):
        _, found, limit = sampled(wall, samples, folder / f"wall_{number}.txt").T
        known = np.isfinite(found)
        ratio, found = (found / limit)[known], found[known]
        low, high = np.quantile(found, [0.05, 0.95])
        lines.append(
            f"| {wall.name} | {wall.friction:g} | {found.mean():.3f}, {low:.3f} to {high:.3f}, "
            f"{found.std(ddof=1) / found.mean():.2f} | {ratio.mean():.3f}, {ratio.min():.3f}, {ratio.max():.3f} | "
            f"{(~known).sum()} of {len(known)} |"
        )
    mean, _ = factors(WALLS[0])
    lines += ["", f"With the friction of the source the first wall falls at {mean:.3f}; 0.640 and 0.643 are published."]
    return [], "\n".join(lines)


if __name__ == "__main__":
    case_main(HERE, 32, run)
