from pathlib import Path

import pytest
import xarray as xr

from damagepred.one_wall.solve import solve
from damagepred.scene import Scene
from tests.synthetic_studies import synthetic_study

WALL = {
    "title": "a wall <with> a window & a door",
    "wall": {"length": 2.4, "height": 0.9},
    "dpc": {"course": 2},
    "opening": [
        {"kind": "window", "x": 0.6, "y": 0.45, "width": 0.48, "height": 0.3},
        {"kind": "door", "x": 1.56, "y": 0.0, "width": 0.36, "height": 0.6},
    ],
    "joint": {"tensile_strength": "0.05 MPa"},
    "movement": {"central_deflection": "12 mm", "increments": 4},
    "solver": {"blocks": "rigid"},
}


@pytest.fixture(scope="session")
def wall() -> xr.Dataset:
    """A small wall that cracks, with all its fields."""
    return solve(Scene.from_dict(WALL))


@pytest.fixture
def study_folder(tmp_path: Path) -> Path:
    return synthetic_study(tmp_path / "house.dp", 40)
