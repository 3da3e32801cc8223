"""Cracks, report and pictures of a laboratory test name the loads that move, for one wall and for a study."""

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred import Movement, Opening, Scene, Study, Wall, crack_frame, cracks, plotting, solve
from damagepred.campaign.settings import StudySettings
from damagepred.cli import terminal
from damagepred.report import write_report
from damagepred.report.summary import wall_summary
from damagepred.results.tables import crack_columns
from damagepred.scene import Load, Loading

PIER = Scene(
    wall=Wall(length=1.2, height=0.9, block_length=0.4, block_height=0.15),
    opening=(Opening(x=0.4, y=0.3, width=0.4, height=0.3),),
    movement=Movement(shape="loads", increments=3),
    load=(Load(direction="along"),),
    loading=Loading(control="displacement", displacement="3 mm", beam="free"),
)


@pytest.fixture(scope="module")
def pier() -> xr.Dataset:
    return solve(PIER)


def text_of(page: Path) -> str:
    """Return the words of a report without its pictures, its code and its scene file."""
    text = re.sub(r"<(svg|script|style|pre).*?</\1>", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    return re.sub(r"<[^>]+>", " ", text)


def test_cracks_begin_at_a_displacement_of_the_loads(pier: xr.Dataset) -> None:
    found = cracks(pier)
    assert found["load_displacement"].values == pytest.approx([0.0, 1e-3, 2e-3, 3e-3])
    first = found["first_load_displacement"].values
    assert len(first)
    assert np.isin(first, found["load_displacement"].values[1:]).all()
    assert crack_frame(found)["load_displacement"].unique() == pytest.approx([3e-3])


def test_tables_name_them(pier: xr.Dataset, capsys: pytest.CaptureFixture[str]) -> None:
    found = cracks(pier)
    heads = [column.name for column in crack_columns(crack_frame(found))]
    assert "began at a load displacement of" in heads
    terminal.crack_table(found, crack_frame(found))
    said = capsys.readouterr().out
    assert "cracks at a load displacement of 3 mm" in said
    assert "deflection" not in said


def test_sentences_and_pictures_name_them(pier: xr.Dataset) -> None:
    assert "reached at a load displacement of 1 mm" in wall_summary(pier)[0]
    assert plotting.draw(pier, "opening_width_change").get_xlabel() == "load displacement (mm)"


def test_reports_have_no_deflection_of_a_footing(pier: xr.Dataset, tmp_path: Path) -> None:
    pier.to_netcdf(tmp_path / "pier.nc")
    settings = StudySettings.from_dict(
        {
            "scene": PIER.to_dict(),
            "study": {"samples": 3, "stop_at_category": "none"},
            "variables": {"joint.friction": {"distribution": "lognormal", "mean": 0.75, "cov": 0.2}},
        }
    )
    Study(settings).run(tmp_path / "piers.dp")
    for page in (write_report(tmp_path / "pier.nc"), write_report(tmp_path / "piers.dp", replay=False)):
        words = text_of(page)
        assert "load displacement" in words
        assert "deflection" not in words
