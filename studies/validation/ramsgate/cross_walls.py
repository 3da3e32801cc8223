"""Ramsgate with its party walls: cracks of the front wall alone and in the terrace.

    python studies/validation/ramsgate/cross_walls.py --samples 1

solves each sample of place and stiffness of the ground twice, and writes the table of the README.
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.stats import lognorm, qmc

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[2]))

from damagepred.one_wall.solve import solve  # noqa: E402
from damagepred.scene import Scene  # noqa: E402
from studies.pages import put_in  # noqa: E402

DEPTH, PITCH = 6.3, 4.5
"""Depth of the cottages and distance of their party walls (m), assumed."""
BRICKS = {"block_length": "900 mm", "block_height": "300 mm"}
"""Twice as large as in ``front.toml``, which lets a terrace be solved in minutes."""


def terrace(position: float, stiffness: float, party: bool) -> Scene:
    """Front wall of ``front.toml`` on a trough at a position (m) and soil of a stiffness (Pa/m), in its terrace."""
    tables: dict[str, Any] = tomllib.loads((HERE / "front.toml").read_text(encoding="utf-8"))["scene"]
    wall, roof = tables.pop("wall"), tables.pop("loads")["roof"]
    bricks = {**BRICKS, "height": wall["height"], "thickness": wall["thickness"]}
    front = {"name": "front", "start": [0, 0], "end": [18, 0], **bricks, "opening": tables.pop("opening")}
    walls = [front | {"loads": {"roof": roof}}]
    if party:
        places = np.arange(5) * PITCH
        walls += [{"name": f"party_{k}", "start": [x, 0], "end": [x, DEPTH], **bricks} for k, x in enumerate(places)]
    mound = {key: tables["mound"][key] for key in ("shape", "surface_movement", "reach")}
    soil = dict.fromkeys(("swelling_stiffness", "shrinking_stiffness"), stiffness)
    changed = {"wall": walls, "mound": mound | {"point": [position, 0], "direction": 90}, "soil": soil}
    return Scene.from_dict(tables | changed)


def front_of(ds: xr.Dataset) -> tuple[float, int, float]:
    """Widest crack (mm), category and deflection (mm) of the front wall at the end."""
    width, category, moved = (
        ds[f"wall_{name}"].values[-1, 0] for name in ("crack_width_max", "damage_category", "central_deflection")
    )
    return 1e3 * float(width), int(category), 1e3 * float(moved)


def main() -> None:
    """Solve all samples and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=1)
    share = qmc.Sobol(2, seed=2001).random(parser.parse_args().samples)
    spread = np.sqrt(np.log(1 + 0.5**2))
    stiffness = lognorm(spread, scale=20e6 * np.exp(-0.5 * spread**2)).ppf(share[:, 1])
    heads = ("trough at, m", "soil, kPa/m", "front alone", "with party walls")
    lines = [f"| {' | '.join(heads)} |", "|---|---|---|---|"]
    for position, k in zip(6 + 6 * share[:, 0], stiffness):
        cells = []
        for party in (False, True):
            width, category, moved = front_of(solve(terrace(float(position), float(k), party)))
            cells.append(f"{width:.2f} ({category}), {moved:.1f}")
            print(cells[-1], flush=True)
        lines.append(f"| {position:.1f} | {1e-3 * k:.0f} | {' | '.join(cells)} |")
    put_in(HERE / "README.md", "\n".join(lines), "<!-- written by cross_walls.py -->")


if __name__ == "__main__":
    main()
