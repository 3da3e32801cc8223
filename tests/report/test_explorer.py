"""The drawing that a reader moves: what it is packed from, and what a browser makes of it."""

from pathlib import Path

import pytest
import xarray as xr

from damagepred.archive.files import write_dataset
from damagepred.report import write_report
from tests.report.test_page import HTML, check_page


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
