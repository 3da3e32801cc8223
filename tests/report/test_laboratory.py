"""Cracks, report and pictures of a laboratory test name the loads that move, for one wall and for a study."""

import pytest
import xarray as xr

from damagepred import Load, Loading, Movement, Opening, Scene, Solver, Wall, plotting, solve
from damagepred.report.summary import wall_summary

PIER = Scene(
    wall=Wall(length=1.2, height=0.9, block_length=0.4, block_height=0.15),
    opening=(Opening(x=0.4, y=0.3, width=0.4, height=0.3),),
    movement=Movement(shape="loads", increments=3),
    load=(Load(direction="along"),),
    loading=Loading(control="displacement", displacement="3 mm", beam="free"),
    solver=Solver(blocks="rigid"),
)


@pytest.fixture(scope="module")
def pier() -> xr.Dataset:
    return solve(PIER)


def test_sentences_and_pictures_name_them(pier: xr.Dataset) -> None:
    assert "reached at a load displacement of 1 mm" in wall_summary(pier)[0]
    assert plotting.draw(pier, "opening_width_change").get_xlabel() == "load displacement (mm)"
