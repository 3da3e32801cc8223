"""Deformable blocks on the command line."""

from pathlib import Path

from damagepred.archive.files import read_dataset
from tests.cli.conftest import Run

SCENE = """
title = "soft foot"
wall = { length = 0.96, height = 0.3 }
dpc = { course = 2 }
movement = { central_deflection = "1 mm", increments = 2 }
solver = { method = "explicit", below_dpc = "deformable", zone_size = 0.08, tolerance = 1e-2 }
"""

WEAK = '[block]\ncohesion = "10 kPa"\nfriction = 0.3\ntensile_strength = "3.3 kPa"\n[loads]\nroof = 2000'


def test_solve_tells_of_zones(command: Run, tmp_path: Path) -> None:
    (tmp_path / "wall.toml").write_text(SCENE)
    result = command("solve", tmp_path / "wall.toml", "-o", tmp_path / "wall.nc")
    assert result.code == 0, result.err
    assert "9 of 18 blocks deformable, 128 zones in plane stress; none of them yields" in result.out
    assert read_dataset(tmp_path / "wall.nc").sizes["zone"] == 128
    (tmp_path / "weak.toml").write_text(SCENE + WEAK)
    result = command("solve", tmp_path / "weak.toml", "-o", tmp_path / "weak.nc", "--no-zones")
    assert result.code == 0, result.err
    assert "128 zones in plane stress; at the end " in result.out
    ds = read_dataset(tmp_path / "weak.nc")
    assert "zone" not in ds.sizes
    assert f"{int(ds['zones_yielded_before'][-1])} have yielded before" in result.out


def test_check_estimates_the_cost_of_zones(command: Run, tmp_path: Path) -> None:
    (tmp_path / "wall.toml").write_text(SCENE)
    result = command("check", tmp_path / "wall.toml", "--full")
    assert result.code == 0, result.err
    assert "9 deformable blocks: 128 zones, " in result.out
    assert "MB of results (none with --no-zones)" in result.out
