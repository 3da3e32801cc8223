"""What repeats of one settlement add to the damage of a facade.

    python studies/seasons/repeats.py

takes some minutes, and writes a table of the README.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import xarray as xr

from damagepred import Movement, Scene, solve
from damagepred.scene import Stage

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "validation"))

from studies.pages import put_in  # noqa: E402

VALIDATION = HERE.parent / "validation"
sys.path.insert(0, str(VALIDATION))

from judging import settings_of  # noqa: E402

REPEATS = 8
LENGTH, HEIGHT = 12.0, 3.0
"""The facade that the validation finds damaged (m)."""
BEGIN, END = "<!-- written by repeats.py -->", "<!-- end of repeats -->"


def facade(kind: str, deflection: float, repeats: int, increments: int) -> Scene:
    """Return the facade under a settlement that comes and goes."""
    holes = [{"x": 1.95 + 3.35 * i, "y": 0.75, "width": 1.4, "height": 1.5} for i in range(3)]
    scene = settings_of(
        VALIDATION / "facades" / "facade.toml",
        scene__wall={"length": LENGTH, "height": HEIGHT},
        scene__loads={"roof": 5e3 * LENGTH},
        scene__opening=holes,
    ).scene
    there = Stage(kind=kind, central_deflection=deflection, increments=increments)
    back = Stage(kind=kind, central_deflection=0.0, increments=increments)
    movement = Movement(
        kind=kind, shape="parabola", central_deflection=deflection, stage=((there, back) * repeats)[:-1]
    )
    return replace(scene, movement=movement)


def at_each_repeat(ds: xr.Dataset, increments: int) -> tuple[list[float], list[float]]:
    """Return Psi, and the widest crack so far (mm), each time the settlement is there."""
    there = slice(increments, None, 2 * increments)
    return ds["psi"].values[there].tolist(), (1e3 * ds["crack_width_worst"].values[there]).tolist()


def main() -> None:
    """Solve both shapes at two sizes, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=REPEATS)
    parser.add_argument("--increments", type=int, default=6)
    parser.add_argument("--no-page", action="store_true", help="print the table alone")
    asked = parser.parse_args()
    lines = [
        f"| shape | deflection, mm | Psi, first | Psi, {asked.repeats}th | widest so far, first, mm | "
        f"widest so far, {asked.repeats}th, mm |",
        "|---|---|---|---|---|---|",
    ]
    for kind, name in (("dishing", "sagging"), ("doming", "hogging")):
        for deflection in (3e-3, 6e-3):
            wall = facade(kind, deflection, asked.repeats, asked.increments)
            ds = solve(wall, on_failure="return")
            psi, width = at_each_repeat(ds, asked.increments)
            lines.append(
                f"| {name} | {1e3 * deflection:g} | {psi[0]:.2f} | {psi[-1]:.2f} | {width[0]:.2f} | {width[-1]:.2f} |"
            )
            print(lines[-1], ds.attrs["status"], flush=True)
    if not asked.no_page:
        put_in(HERE / "README.md", "\n".join(lines), BEGIN, END)


if __name__ == "__main__":
    main()
