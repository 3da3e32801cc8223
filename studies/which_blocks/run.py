"""Which blocks of a wall need zones? The wall of the test with more and more of its bricks deformable.

    python studies/which_blocks/run.py

prints the table of the README. ``--scene`` takes another scene file, ``--increments`` another number of steps.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from damagepred import Scene
from damagepred.enumerations import ContactKind
from damagepred.one_wall.judged_path import model_of
from damagepred.solvers import solve_path

DATA = Path(__file__).resolve().parents[2] / "data"
CASES: dict[str, dict[str, Any]] = {
    "all rigid": {"blocks": "rigid"},
    "two courses below the dpc cut": {"below_dpc": "deformable"},
    "cut where it matters, 10 % left out": {"blocks": "auto", "rigid_error": 0.1},
    "cut where it matters, 3 % left out": {"blocks": "auto", "rigid_error": 0.03},
    "cut where it matters, 1 % left out": {"blocks": "auto", "rigid_error": 0.01},
    "all cut": {"blocks": "deformable"},
    "all cut, cells of 60 mm": {"blocks": "deformable", "zone_size": 0.06},
    "all cut, on a footing of zones": {"blocks": "deformable", "footing": "deformable"},
}


def solved(scene: Scene, settings: dict[str, Any]) -> list[str]:
    """Solve a wall and return the row of the table."""
    solver = replace(scene.solver, method="quasi_static", symmetric_half=False, **settings)
    scene = replace(scene, solver=solver)
    start = time.process_time()
    model = model_of(scene)
    chosen = time.process_time()
    last = list(solve_path(model, solver, scene.movement.increments))[-1]
    done = time.process_time()
    dpc = model.interfaces.kind == ContactKind.DPC
    mesh = model.mesh
    openings = [1e3 * float(last.opening[which].max(initial=0.0)) for which in (dpc, ~dpc)]
    return [
        "0" if mesh is None else str(len(mesh.block)),
        "0" if mesh is None else f"{len(mesh.zones):,}".replace(",", " "),
        f"{chosen - start:.2f} s",
        f"{done - chosen:.2f} s",
        f"{openings[0]:.3f} mm",
        f"{openings[1]:.3f} mm",
        f"{last.energy.elastic_energy:.2f} J",
    ]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", type=Path, default=DATA / "bryant_dishing.toml")
    parser.add_argument("--increments", type=int, default=None)
    asked = parser.parse_args()
    scene = Scene.from_toml(asked.scene)
    if asked.increments:
        scene = replace(scene, movement=replace(scene.movement, increments=asked.increments))
    # compile before timing
    small = replace(scene, movement=replace(scene.movement, increments=1))
    for name in ("all rigid", "cut where it matters, 10 % left out"):
        solved(small, CASES[name])
    head = ("bricks", "cut", "zones", "choose", "solve", "dpc opens", "other joints open", "energy in the end")
    print("| " + " | ".join(head) + " |")
    print("|" + "---|" * len(head))
    for name, settings in CASES.items():
        print(f"| {name} | " + " | ".join(solved(scene, settings)) + " |", flush=True)


if __name__ == "__main__":
    np.seterr(all="raise", under="ignore")
    main()
