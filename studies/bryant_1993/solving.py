"""The paths of one wall of the test: with a prescribed profile, and on jacks with three footings."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from cases import Case, bent_before, further, on_jacks, virgin

import damagepred
from damagepred.scene import Scene
from damagepred.scene.concrete import ReinforcedConcrete

LABELS = {
    "prescribed": "prescribed profile",
    "elastic": "jacks, elastic footing",
    "cracked": "jacks, reinforced footing, new",
    "bent": "jacks, reinforced footing, bent before",
}
"""Names of the ways to load a wall, in tables and pictures."""


@dataclass(frozen=True)
class Solved:
    """Paths of one wall by way: on jacks to the limit, and on to the test's deflection; earlier moment (Nm)."""

    case: Case
    limit: dict[str, xr.Dataset]
    whole: dict[str, xr.Dataset]
    earlier_moment: float


def solve(scene: Scene, what: str) -> xr.Dataset:
    """Solve one path, and report its time."""
    began = time.perf_counter()
    ds = damagepred.solve(scene, on_failure="return")
    reached = 1e3 * float(ds["central_deflection"][-1])
    print(f"  {what}: to {reached:.2f} mm, {time.perf_counter() - began:.1f} s", file=sys.stderr, flush=True)
    if ds.attrs["status"] == "failed":
        raise SystemExit(f"{what}: {ds.attrs['status_message']}")
    return ds


def earlier_moment(case: Case) -> float:
    """Return the largest moment (Nm) in a new footing at the test's deflection in the opposite direction."""
    kind = "doming" if case.scene.movement.kind == "dishing" else "dishing"
    movement = replace(case.scene.movement, kind=kind, central_deflection=case.other_way)
    scene = further(on_jacks(replace(case.scene, movement=movement), virgin()))
    ds = solve(scene, f"{case.name}: the other way, to bend the footing")
    return float(np.abs(ds["section_moment"].values).max())


def solve_case(case: Case) -> Solved:
    """Solve a wall in all ways."""
    moment = earlier_moment(case)
    footings: dict[str, ReinforcedConcrete | None] = {
        "elastic": None,
        "cracked": virgin(),
        "bent": bent_before(moment),
    }
    limit, whole = {}, {"prescribed": solve(case.scene, f"{case.name}, prescribed")}
    for way, concrete in footings.items():
        scene = on_jacks(case.scene, concrete)
        limit[way] = solve(scene, f"{case.name}, {LABELS[way]}")
        whole[way] = solve(further(scene), f"{case.name}, {LABELS[way]}, further")
    return Solved(case, limit, whole, moment)
