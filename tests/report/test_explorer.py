"""The drawing that a reader moves: what it is packed from, and what a browser makes of it."""

import base64
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from damagepred.archive.files import write_dataset
from damagepred.plotting.geometry import Faces, ground_profile
from damagepred.report import write_report
from damagepred.report.explorer import LEVELS, explorer
from tests.report.test_page import HTML, check_page


def unpacked(packed: dict[str, Any]) -> np.ndarray:
    values = np.frombuffer(zlib.decompress(base64.b64decode(packed["data"])), dtype=np.dtype(packed["type"]))
    return values * (packed["largest"] / LEVELS) if "largest" in packed else values


def test_blocks_joints_and_path_are_those_of_the_wall(wall: xr.Dataset) -> None:
    (packed,) = json.loads(explorer({"wall": wall}))["walls"]
    steps, blocks = wall.sizes["increment"], wall.sizes["block"]
    moved = unpacked(packed["moved"]).reshape(steps, blocks, 2)
    expected = np.stack([wall[f"block_displacement_{axis}"].values for axis in "xy"], axis=-1)
    np.testing.assert_allclose(moved, expected, atol=np.abs(expected).max() / LEVELS)
    turned = unpacked(packed["turned"]).reshape(steps, blocks)
    rotation = wall["block_rotation"].values
    np.testing.assert_allclose(turned, rotation, atol=np.abs(rotation).max() / LEVELS)
    faces = Faces.of(wall, -1)
    gap = unpacked(packed["gap"]).reshape(steps, -1)
    crack = np.where(faces.joints.is_masonry, faces.crack, faces.opening)
    np.testing.assert_allclose(gap[-1], crack, atol=np.abs(crack).max() / LEVELS)
    assert gap[-1].max() == pytest.approx(crack.max(), rel=1e-3)
    rise = unpacked(packed["rise"]).reshape(steps, -1)
    ground = ground_profile(wall, -1)[2]
    np.testing.assert_allclose(rise[-1], ground, atol=np.abs(ground).max() / LEVELS)
    corner, first = unpacked(packed["corner"]).reshape(-1, 2), unpacked(packed["first"])
    np.testing.assert_allclose(corner[:, 0], wall["vertex_x"].values, atol=1e-6)
    assert first[-1] == len(corner)
    assert len(first) == blocks + 1
    assert packed["movement"] == pytest.approx(1e3 * wall["central_deflection"].values)


def test_a_title_cannot_end_the_data(wall: xr.Dataset, tmp_path: Path) -> None:
    text = explorer({"</script><b>": wall})
    assert "</script>" not in text
    assert json.loads(text)["walls"][0]["name"] == "</script><b>"


def test_the_page_has_one_script_of_its_own_and_the_still_drawing(wall: xr.Dataset, tmp_path: Path) -> None:
    write_dataset(wall, tmp_path / "wall.nc")
    root = check_page(write_report(tmp_path / "wall.nc").read_text(encoding="utf-8"))
    kinds = [e.get("type") for e in root.iter(f"{HTML}script")]
    assert kinds == ["application/json", None]
    (moved,) = (e for e in root.iter(f"{HTML}div") if e.get("class") == "explorer")
    assert moved.get("hidden") is not None  # until a script shows it
    linked = [e for e in root.iter("{http://www.w3.org/2000/svg}svg") if e.get("data-from") is not None]
    assert len(linked) == 1
    share = [float(linked[0].get(f"data-{side}")) for side in ("left", "right")]
    assert 0.0 < share[0] < 0.2
    assert 0.75 < share[1] < 1.0
    assert float(linked[0].get("data-to")) == pytest.approx(12.0, rel=0.05)
