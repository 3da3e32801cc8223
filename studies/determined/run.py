"""Outputs of a wall that rounding decides: stiffnesses changed by 1e-12, both solvers.

    python studies/determined/run.py [--quick] [--only NAME ...] [--times 5]

prints the tables of the README. ``--quick``: two walls, two perturbations.
"""

from __future__ import annotations

import argparse
import tempfile
import time
import tomllib
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import tomli_w

from damagepred import Scene, solve
from damagepred.arrays import FloatArray
from damagepred.assembly import wall_geometry
from damagepred.enumerations import ContactState

REFERENCE = Path(__file__).resolve().parents[2] / "tests" / "reference_walls" / "walls.toml"
HAIRLINE = 1e-4
"""Width (m) below which a crack is negligible (AS 2870)."""
CHANGE = 1e-12
"""Largest relative change of a stiffness."""
SECONDS = 230.0
"""Rough time of the whole study on one core, said before it begins."""
SMALL = {"length": 1.2, "height": 0.45}
MOVED = {"kind": "dishing", "central_deflection": 8e-3, "increments": 20}
DOMED = MOVED | {"kind": "doming"}
DPC: dict = {"wall": SMALL, "dpc": {"course": 2}}
MORE: dict[str, dict] = {
    "1.2 x 0.45 m on a dpc, 2 increments": DPC | {"movement": MOVED | {"increments": 2}},
    "1.2 x 0.45 m on a dpc, doming, in full": DPC | {"movement": DOMED, "solver": {"symmetric_half": False}},
    "4.8 x 1.8 m on a dpc, doming": DPC | {"wall": {"length": 4.8, "height": 1.8}, "movement": DOMED},
}
PANEL: dict = {
    "wall": {"length": 4.0, "height": 2.0, "block_length": 0.4, "block_height": 0.2},
    "opening": [{"x": 1.4, "y": 0.6, "width": 1.2, "height": 0.8}],
    "dpc": {"course": 1},
    "joint": {"tensile_strength": 0.2e6, "cohesion": 0.3e6},
}
"""The wall of the notebook of seasons, with brittle bonds."""
ELASTIC = {"solver": {"blocks": "elastic"}}
SOFTENING = {"joint": PANEL["joint"] | {"fracture_energy": 20.0}}
LEAK = {"year": 12, "movement": 6e-3, "end": 14}
SEASONS = {"years": 30, "swing": 8e-3, "swing_cov": 0.3, "trend": 3e-3, "increments": 1, "step": [LEAK]}


def history(*ends: float) -> dict:
    """Table of a movement through these deflections (m), dishing positive."""
    kinds = ("dishing" if end >= 0.0 else "doming" for end in ends)
    stages = [{"kind": k, "central_deflection": abs(end), "increments": 4} for k, end in zip(kinds, ends)]
    return {"movement": {"kind": "dishing", "stage": stages}}


YEARS = {"movement": {"kind": "dishing", "seasons": SEASONS}}
HISTORIES: dict[str, dict] = {
    "30 years": PANEL | YEARS,
    "30 years, elastic blocks": PANEL | YEARS | ELASTIC,
    "30 years, elastic blocks, 20 N/m": PANEL | YEARS | ELASTIC | SOFTENING,
    "30 years, bonds that hold": PANEL | YEARS | {"joint": {"tensile_strength": 5e6, "cohesion": 5e6}},
    "dishing, doming, dishing": PANEL | history(8e-3, -8e-3, 8e-3),
    "dishing and doming, 8 times": PANEL | history(*8 * (8e-3, -8e-3)),
    "dishing to 8 and 4 mm, 10 times": PANEL | history(*10 * (8e-3, 4e-3)),
    "dishing to 8 and 0 mm, 10 times": PANEL | history(*10 * (8e-3, 0.0)),
}
QUICK = ("dry", "1.2 x 0.45 m on a dpc, 2 increments")
WIDTHS = {"dpc_opening_max": "dpc opening", "crack_width_max": "widest joint", "crack_band_width_max": "crack band"}


class Outputs(NamedTuple):
    """Results of one wall at the end of its movement, and what they cost; reaction over the one before it (1)."""

    widths: dict[str, float]
    separation: float
    reaction: float
    cracked: int
    category: int
    work: float
    seconds: float


def scenes(only: Iterable[str] = ()) -> dict[str, Scene]:
    """Return the walls by name: the reference walls that are not dynamic, small walls, and histories."""
    tables = tomllib.loads(REFERENCE.read_text(encoding="utf-8")) | MORE | HISTORIES
    named = {name: table for name, table in tables.items() if "dynamics" not in table}
    return {name: scene_of(table) for name, table in named.items() if not only or name in only}


def scene_of(table: dict) -> Scene:
    """Return the scene of a table in TOML; blocks are rigid unless it says otherwise."""
    table = table | {"solver": {"blocks": "rigid"} | table.get("solver", {})}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "wall.toml"
        file.write_text(tomli_w.dumps(table), encoding="utf-8")
        return Scene.from_toml(file)


def changed_stiffness(scene: Scene, number: int) -> dict[str, FloatArray]:
    """Return the stiffnesses of every joint, changed at random by up to ``CHANGE``; number 0 leaves them."""
    random = np.random.default_rng([50, number])
    joints = len(wall_geometry(scene).joints.kind)
    names = [f"{table}.{k}_stiffness" for table in ("joint", *["dpc"] * bool(scene.dpc)) for k in ("normal", "shear")]
    factors = 1.0 + CHANGE * bool(number) * random.uniform(-1.0, 1.0, (len(names), joints))
    return {name: factor * getattr(scene.joint, name.partition(".")[2]) for name, factor in zip(names, factors)}


def outputs(scene: Scene, method: str, number: int) -> Outputs:
    """Solve a wall with changed stiffnesses."""
    begun = time.process_time()
    solver = replace(scene.solver, method=method)  # type: ignore[arg-type]
    ds = solve(scene, solver=solver, fields=changed_stiffness(scene, number), on_failure="return", store_zones=False)
    last = ds.isel(increment=-1)
    work = ds["cycles" if method == "explicit" else "newton_iterations"].values.sum()
    return Outputs(
        {name: float(last[name]) for name in WIDTHS},
        float(last["dpc_separation_length"]),
        float(last["base_reaction"] / ds["base_reaction"][0]),
        int((last["contact_state"] == ContactState.CRACKED).sum()),
        int(last["damage_category"]),
        float(work),
        time.process_time() - begun,
    )


def spread(values: Iterable[float], least: float) -> float:
    """Return the range of values over the largest of them, or over ``least`` if that is larger (1)."""
    found = np.asarray(list(values), dtype=np.float64)
    return float(np.ptp(found) / max(np.abs(found).max(), least)) if np.isfinite(found).all() else np.nan


def percent(share: float) -> str:
    """Return a share in percent, in words where it is next to none."""
    if not share > 0.0:
        return "0" if share == 0.0 else "-"
    return f"{float(f'{100 * share:.2g}'):g} %" if share >= 1e-6 else "< 1e-4 %"


def row(name: str, method: str, found: list[Outputs]) -> list[str]:
    """Return the spread of every output as text; widths below 0.1 mm and lengths below 0.1 m count as these."""
    shares = [spread((f.widths[width] for f in found), HAIRLINE) for width in WIDTHS]
    shares += [spread((f.separation for f in found), 0.1), spread((f.reaction for f in found), 1.0)]
    ranges = [sorted({value(f) for f in found}) for value in (lambda f: f.cracked, lambda f: f.category)]
    counts = [f"{r[0]}" if r[0] == r[-1] else f"{r[0]} to {r[-1]}" for r in ranges]
    effort = f"{np.mean([f.work for f in found]):.0f}", f"{np.mean([f.seconds for f in found[1:] or found]):.2f} s"
    return [name, method, *map(percent, shares), *counts, *effort]


HEAD = [
    *("wall", "solver", *WIDTHS.values(), "dpc open over 0.5 mm", "base reaction", "cracked contacts", "category"),
    *("cycles or iterations", "time"),
]


def main(arguments: list[str] | None = None) -> None:
    """Print one row per wall and solver."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="two walls, two perturbations")
    parser.add_argument("--only", nargs="+", default=[], help="names of walls")
    parser.add_argument("--times", type=int, default=5, help="perturbations of each wall (5)")
    given = parser.parse_args(arguments)
    chosen, times = scenes(QUICK if given.quick else given.only), 2 if given.quick else given.times
    print(f"{len(chosen)} walls, {times + 1} times by two solvers: about {SECONDS / 60:.0f} minutes for all walls\n")
    print("| " + " | ".join(HEAD) + " |\n|" + "---|" * len(HEAD))
    for name, scene in chosen.items():
        for method in ("explicit", "quasi_static"):
            found = [outputs(scene, method, number) for number in range(times + 1)]
            print("| " + " | ".join(row(name, method, found)) + " |", flush=True)


if __name__ == "__main__":
    main()
