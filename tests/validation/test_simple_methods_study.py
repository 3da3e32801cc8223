"""The study of the simple methods: its strain, its elastic walls, its tables, and its quick form."""

import importlib
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import damagepred
from damagepred.damage import beam_strain
from damagepred.scene import Scene

STUDY = Path(__file__).resolve().parents[2] / "studies" / "simple_methods"
NAMES = ("walls", "strain", "compare", "picture", "run")


@pytest.fixture(scope="module")
def study() -> dict[str, ModuleType]:
    sys.path.insert(0, str(STUDY))
    kept = {name: sys.modules.pop(name) for name in NAMES if name in sys.modules}
    try:
        return {name: importlib.import_module(name) for name in NAMES}
    finally:
        sys.path.remove(str(STUDY))
        for name in NAMES:
            sys.modules.pop(name, None)
        sys.modules.update(kept)


def test_strain_of_a_linear_field_is_exact_and_a_turned_wall_has_none(study: dict[str, ModuleType]) -> None:
    place = np.array([(0.12 * (course % 2) + 0.24 * i, 0.075 * course) for course in range(12) for i in range(8)])
    gradient, turn = np.array([[4e-4, 3e-4], [-1e-4, -6e-4]]), np.array([[0.0, -2e-3], [2e-3, 0.0]])
    moved = np.stack([place @ gradient.T + 1e-3, place @ turn.T, 0 * place])
    ds = xr.Dataset(
        {"block_x": ("block", place[:, 0]), "block_y": ("block", place[:, 1])}
        | {f"block_displacement_{axis}": (("increment", "block"), moved[..., k]) for k, axis in enumerate("xy")}
    )
    found = study["strain"].largest_tensile_strain(ds, 0.25)
    exact = np.linalg.eigvalsh((gradient + gradient.T) / 2)[-1]
    np.testing.assert_allclose(found, [exact, 0.0, 0.0], atol=1e-15, rtol=1e-9)


def test_a_tied_elastic_wall_bends_about_the_ground(study: dict[str, ModuleType]) -> None:
    """Slender and doming, its strain is the curvature, 8 D/L^2, times the height above the ground; nothing opens."""
    walls, settings = study["walls"], study["walls"].read_settings()
    case = walls.Case(12.0, 0.6, False, "doming", "none", 1.0)
    scene, fields = walls.elastic(walls.scene_of(case, settings), settings, lifts=False)
    wall = damagepred.solve(scene, fields=fields, increments=2)
    assert (wall["contact_state"].values == 0).all()
    x, y = wall["block_x"].values, wall["block_y"].values
    along_x, _ = study["strain"].gradients(np.column_stack((x, y)), 0.25)
    moved = np.diff(wall["block_displacement_x"].values, axis=0).sum(axis=0)
    middle = np.abs(x - 6.0) < 0.5
    expected = along_x @ (8 / 300 / 12.0 * y * (x - 6.0))
    np.testing.assert_allclose((along_x @ moved)[middle], expected[middle], rtol=0.02)
    strain = np.diff(study["strain"].largest_tensile_strain(wall, 0.25))
    assert strain[1] == pytest.approx(strain[0], rel=0.1)  # self weight apart, it is linear
    assert strain.sum() > expected.max()  # at the ends, where the ground pulls the wall down


def test_a_wall_that_may_lift_off_parts_at_its_base_alone(study: dict[str, ModuleType]) -> None:
    walls, settings = study["walls"], study["walls"].read_settings()
    for dpc, kind in ((False, 3), (True, 2)):
        scene = walls.scene_of(walls.Case(4.0, 2.4, dpc, "dishing", "none", 1.0), settings)
        whole, fields = walls.elastic(scene, settings, lifts=True)
        wall = damagepred.solve(whole, fields=fields, increments=2)
        state = wall["contact_state"].values[-1]
        assert set(wall["contact_kind"].values[state == 1]) == {kind}
        assert float(wall["contact_opening"].values[-1].max()) > 5e-3


def paths() -> pd.DataFrame:
    ratio = np.array([0.0, 1 / 2000, 1 / 800, 1 / 600, 1 / 400, 1 / 300])
    wall = {"length": 6.0, "height": 2.4, "dpc": True, "movement": "dishing", "opening": "none", "bond": 1.0}
    columns = {
        "category": [0, 0, 1, 1, 2, 3],
        "perpend_category": [0, 0, 0, 1, 1, 1],
        "beam_category": [0, 1, 2, 3, 3, 4],
        "tied_category": [0, 0, 1, 1, 2, 3],
        "lifting_category": [0] * 6,
    }
    return pd.DataFrame(wall | {"deflection_ratio": ratio} | columns)


def test_the_readme_has_the_table_of_the_csv(study: dict[str, ModuleType]) -> None:
    levels = pd.read_csv(STUDY / "agreement.csv")
    lines = (STUDY / "README.md").read_text(encoding="utf-8").splitlines()
    reached = pd.read_csv(STUDY / "capacities.csv")
    for line in [*study["compare"].summary(levels), *study["compare"].cracked(reached)]:
        assert line in lines


def test_what_the_wall_of_a_dpc_does_the_simple_methods_do_not_see(study: dict[str, ModuleType]) -> None:
    """The finding of the study on one small wall: the wall rides on its dpc, and the beam is said to break."""
    walls, settings = study["walls"], study["walls"].read_settings() | {"increments": 4}
    path = study["run"].path_of(walls.Case(4.0, 2.4, True, "doming", "none", 1.0), settings)
    last = path.iloc[-1]
    assert last["category"] == 0
    assert last["dpc_opening"] > 5e-3
    assert last["beam_category"] >= 3
    assert last["tied_category"] >= 3
    assert last["lifting_category"] == 0
    expected = beam_strain(1 / 300, 4.0, 2.4, "doming", 2 * (1 + Scene().block.poisson_ratio)).largest
    assert last["beam_strain"] == pytest.approx(float(expected))


@pytest.mark.slow
def test_quick_form(study: dict[str, ModuleType], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = study["run"]
    monkeypatch.setattr(sys, "argv", ["run.py", "--quick", "--output", str(tmp_path), "--at-most", "3"])
    assert run.main() == 0
    first = pd.read_csv(tmp_path / "paths.csv")
    assert not (tmp_path / "agreement.csv").exists()
    monkeypatch.setattr(sys, "argv", ["run.py", "--quick", "--output", str(tmp_path)])
    assert run.main() == 0
    paths = pd.read_csv(tmp_path / "paths.csv")
    pd.testing.assert_frame_equal(paths.iloc[: len(first)], first, check_dtype=False)  # 0 or 0.0 in a file
    assert len(paths) == 8 * 41
    levels = pd.read_csv(tmp_path / "agreement.csv")
    assert len(levels) == 8 * 5 * 3
    riding = levels[levels["dpc"] & (levels["method"] == "beam")]
    assert (riding["difference"] > 0).mean() > 0.8
    for name in ("diagram.png", "agreement.png"):
        assert (tmp_path / name).stat().st_size > 20_000
