"""The window wall of the full-scale test: both solvers give the same crack band."""

from pathlib import Path

import pytest

import damagepred
from damagepred.scene import Scene, Solver


@pytest.mark.thorough
def test_solvers_agree_on_a_crack_band_of_several_joints(data_folder: Path) -> None:
    scene = Scene.from_toml(data_folder / "bryant_window_dishing.toml")
    found = [
        damagepred.solve(scene, solver=Solver(method=method, blocks="rigid")) for method in ("quasi_static", "explicit")
    ]
    joint, band = ([1e3 * float(ds[f"crack_{name}max"][-1]) for ds in found] for name in ("width_", "band_width_"))
    assert abs(band[0] / band[1] - 1) < 0.01
    assert min(b / j for b, j in zip(band, joint)) > 2
    assert found[0]["damage_category_band"][-1] == found[1]["damage_category_band"][-1]
