"""Snap-through of walls without a bond to a distant equilibrium is counted and reported."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred import Joint, Movement, Scene, Solver, Wall, solve
from damagepred.archive.cautions import wall_cautions

DATA = Path(__file__).resolve().parents[2] / "data"
DRY = Joint(tensile_strength=0.0, cohesion=0.0)
DEFLECTION = 4e-3


def dry_wall(kind: str, length: float, height: float, increments: int, **solver: float) -> xr.Dataset:
    movement = Movement(kind=kind, central_deflection=DEFLECTION, increments=increments)  # type: ignore[arg-type]
    wall = Wall(length=length, height=height)
    return solve(Scene(wall=wall, joint=DRY, movement=movement, solver=Solver(**solver)))  # type: ignore[arg-type]


def difference(one: xr.Dataset, other: xr.Dataset) -> float:
    """Largest difference of a block's final position, over the movement."""
    x, y = (one[f"block_displacement_{a}"].values[-1] - other[f"block_displacement_{a}"].values[-1] for a in "xy")
    return float(np.hypot(x, y).max()) / DEFLECTION


def said(ds: xr.Dataset) -> bool:
    return any("snap-through" in line for line in wall_cautions(ds))


@pytest.mark.thorough
def test_dependence_on_increments_is_reported() -> None:
    """In one increment the wall snaps through, in 160 it is followed; final positions differ."""
    coarse, fine = (dry_wall("doming", 3.36, 1.5, n) for n in (1, 160))
    assert difference(coarse, fine) > 0.1
    assert said(coarse)
    assert not said(fine)
    share = coarse["snap_through_energy"].values.max() / np.abs(coarse["external_work"].values).max()
    assert coarse.attrs["snap_through_share"] == pytest.approx(share)
    assert (coarse["snap_through_energy"].values <= coarse["released_energy"].values).all()
    assert (np.diff(coarse["snap_through_energy"].values) >= 0.0).all()
    assert f"{share:.2g} of the largest work done" in wall_cautions(coarse)[-1]
    coarse.attrs["snap_through_tolerance"] = 1.0
    assert not said(coarse)


@pytest.mark.parametrize("name", ["dishing", "window_doming"])
def test_bonds_that_break_are_no_snap_through(name: str) -> None:
    """They release energy, and equilibrium is near."""
    ds = solve(Scene.from_toml(DATA / f"bryant_{name}.toml"))
    assert ds["released_energy"].values[-1] > 0.01 * ds["external_work"].values[-1]
    assert ds.attrs["snap_through_share"] < 1e-3
    assert not said(ds)
