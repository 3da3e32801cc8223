"""Contacts of joints without a bond, and steps of the movement: time and error of each.

    python studies/contacts/run.py

prints the tables of the README. ``--quick`` leaves out the dry walls of the second and third.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

from damagepred import Assembly, Scene, solve
from damagepred.assembly.assembly import rectangle
from damagepred.scene import Joint, Loads, Movement, Solver, Wall

DATA = Path(__file__).resolve().parents[2] / "data"
DRY = Joint(tensile_strength=0.0, cohesion=0.0)
RULES = {
    "3 Lobatto": Solver(no_tension_subdivisions=1),
    "9 Lobatto": Solver(contacts_per_interface=9),
    "9 midpoints": Solver(quadrature="midpoint", contacts_per_interface=9),
    "2 x 3 Lobatto": Solver(no_tension_subdivisions=2),
    "4 x 3 Lobatto (default)": Solver(),
    "8 x 3 Lobatto": Solver(no_tension_subdivisions=8),
}
SHARES = (0.2, 0.25, 0.3, 0.34, 0.38, 0.4)
"""Eccentricities over the length of the block."""


def rotation_error(solver: Solver, share: float, length: float = 0.24, thickness: float = 0.11) -> float:
    """Return the error of the rotation of a block on a joint without tension, over the closed form.

    theta = 2 N / (k_n t a^2) with the contact length a = 3 (b / 2 - e).
    """
    wall = Assembly(thickness=thickness, gravity=(0.0, 0.0), joint=DRY)
    block = wall.add_block(rectangle(-length / 2, 0.0, length / 2, 0.075))
    wall.support(wall.add_block(rectangle(-length / 2, -0.1, length / 2, 0.0)))
    force = 1e5 * length * thickness
    wall.load(block, y=-force, at=(share * length, 0.075))
    solver = replace(solver, lump_block_elasticity=False)
    turned = -float(solve(wall, solver=solver, increments=1)["block_rotation"].values[-1, block])
    pressed = 3 * (0.5 - share) * length
    return turned * DRY.normal_stiffness * thickness * pressed**2 / (2 * force) - 1.0


def dry_wall(kind: str, length: float = 2.4, height: float = 0.9, roof: float = 0.0) -> Scene:
    """Return a wall without mortar and dpc whose ground moves by 4 mm."""
    return Scene(
        wall=Wall(length=length, height=height),
        joint=DRY,
        loads=Loads(roof=roof),
        movement=Movement(kind=kind, central_deflection=4e-3, increments=20),  # type: ignore[arg-type]
    )


WALLS = {
    "solid wall on a dpc, dishing": Scene.from_toml(DATA / "bryant_dishing.toml"),
    "window on a dpc, doming": Scene.from_toml(DATA / "bryant_window_doming.toml"),
    "dry, 1.7 x 0.6 m, dishing": dry_wall("dishing", 1.68, 0.6),
    "dry, 1.7 x 0.6 m, doming": dry_wall("doming", 1.68, 0.6),
    "dry, 2.4 x 0.9 m, dishing": dry_wall("dishing"),
    "dry, 2.4 x 0.9 m, dishing, roof 3 kN": dry_wall("dishing", roof=3e3),
    "dry, 2.4 x 0.9 m, doming, roof 3 kN": dry_wall("doming", roof=3e3),
    "dry, 2.4 x 0.9 m, doming": dry_wall("doming"),
}
FEW = 2
"""Walls of ``--quick``."""


def timed(scene: Scene) -> tuple[xr.Dataset, float]:
    """Solve a wall; return it and the processor time (s)."""
    start = time.process_time()
    ds = solve(scene)
    return ds, time.process_time() - start


def farthest(one: xr.Dataset, other: xr.Dataset) -> float:
    """Return the largest difference of a block's final position (m)."""
    x, y = (one[f"block_displacement_{a}"].values[-1] - other[f"block_displacement_{a}"].values[-1] for a in "xy")
    return float(np.hypot(x, y).max())


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> None:
    """Print a table in Markdown, row by row as they come."""
    cells = list(head)
    print("\n| " + " | ".join(cells) + " |")
    print("|" + "---|" * len(cells))
    for row in rows:
        print("| " + " | ".join(row) + " |", flush=True)


def rotation_rows() -> Iterable[list[str]]:
    """Return the error of the rotation by rule and eccentricity."""
    for name, solver in RULES.items():
        yield [name, *(f"{100 * rotation_error(solver, share):+.1f} %" for share in SHARES)]


def cost_rows(walls: dict[str, Scene]) -> Iterable[list[str]]:
    """Return time and results by number of parts of an interface."""
    for name, scene in walls.items():
        for parts in (1, 2, 4, 8):
            ds, seconds = timed(replace(scene, solver=replace(scene.solver, no_tension_subdivisions=parts)))
            widths = (f"{1e3 * float(ds[n][-1]):.3f} mm" for n in ("dpc_opening_max", "crack_band_width_max"))
            yield [name, str(parts), f"{seconds:.2f} s", str(int(ds["newton_iterations"].sum())), *widths]


def step_rows(walls: dict[str, Scene]) -> Iterable[list[str]]:
    """Return time and results with and without step control, against many increments."""
    for name, scene in walls.items():
        fine, _ = timed(replace(scene, movement=replace(scene.movement, increments=160)))
        for control in (0.01, 1e9):
            ds, seconds = timed(replace(scene, solver=replace(scene.solver, step_energy_tolerance=control)))
            band, band_fine = (1e3 * float(d["crack_band_width_max"][-1]) for d in (ds, fine))
            yield [
                name,
                "on" if control < 1 else "off",
                f"{seconds:.2f} s",
                f"{100 * ds.attrs['energy_error_share']:.2g} %",
                f"{100 * ds.attrs['snap_through_share']:.2g} %",
                f"{1e3 * farthest(ds, fine):.3f} mm",
                f"{band:.3f} / {band_fine:.3f} mm",
            ]


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="two walls only")
    names = list(WALLS)[: FEW if parser.parse_args().quick else None]
    walls = {name: WALLS[name] for name in names}
    for scene in walls.values():  # compile before the clock runs
        solve(replace(scene, movement=replace(scene.movement, increments=1)))
    table(["contacts", *(f"e = {share:g} b" for share in SHARES)], rotation_rows())
    some = {name: walls[name] for name in names if name in list(WALLS)[:2] + list(WALLS)[5:6]}
    table(["wall", "parts", "time", "Newton iterations", "dpc opens", "crack band"], cost_rows(some))
    head = ["wall", "step control", "time", "energy error", "snap-through", "farthest block", "crack band, 20 / 160"]
    table(head, step_rows(walls))


if __name__ == "__main__":
    main()
