"""The answer in short, held against counts and curves made beforehand."""

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred import Load, Loading, Movement, Opening, Scene, Solver, Wall, plotting, solve
from damagepred.archive.folder import StudyFolder, open_study
from damagepred.campaign.settings import StudySettings, read_frozen
from damagepred.errors import InputError
from damagepred.report import write_report
from damagepred.report.summary import answers, influences, wall_summary
from damagepred.uq.movement_distribution import MOUND, movement_distribution
from tests.synthetic_studies import synthetic_study


@pytest.fixture
def study(tmp_path: Path) -> tuple[xr.Dataset, StudySettings]:
    folder = synthetic_study(tmp_path / "house.dp", 200)
    return open_study(folder), read_frozen(StudyFolder(folder).study_text())


def test_a_site_class_and_a_single_surface_movement_are_named(study: tuple[xr.Dataset, StudySettings]) -> None:
    ds, _ = study
    moved = ds.assign({MOUND: 20 * ds["central_deflection"]})
    moved[MOUND].attrs.update(ds["central_deflection"].attrs)
    moved.attrs["movement_measure"] = MOUND
    question, _ = answers(moved, movement_distribution("H1"))
    assert question == "For site class H1 (y_s is taken as evenly distributed from 40 to 60 mm):"
    question, _ = answers(moved, "55 mm")
    assert question == "At a surface movement of 55 mm, site class H1:"


def test_the_input_that_decides_is_named_and_others_are_not(study: tuple[xr.Dataset, StudySettings]) -> None:
    ds, _ = study
    _, found = answers(ds, "3 mm")
    random = np.random.default_rng(3)
    reached = (ds["damage_category"].values >= 1).argmax(axis=1)
    capacity = np.where((ds["damage_category"].values >= 1).any(axis=1), reached, 99) + 0.1 * random.random(200)
    inputs = [name for name, v in ds.data_vars.items() if v.attrs.get("role") == "input" and v.dims == ("sample",)]
    others = [str(name) for name in inputs if not str(name).startswith("movement.")]
    ds[others[0]].values[:] = -capacity
    said, section = influences(ds, found)
    assert "more of it harms" in said
    assert said.count("more of it") == 1 + said.count("more of it protects")
    assert section.parts[0].rows[0][0] == others[0]
    assert not any(row[0].startswith("movement.") for row in section.parts[0].rows)


def test_an_input_that_moves_the_ground_harms_at_its_own_ground_and_protects_nowhere(
    study: tuple[xr.Dataset, StudySettings],
) -> None:
    """Capacities are made independent of the end of each wall's movement, which a suction sets here."""
    ds, _ = study
    _, found = answers(ds)
    end = ds["movement.central_deflection"].values
    ds = ds.drop_vars("movement.central_deflection").assign({"suction.change": ("sample", end, {"role": "input"})})
    said, section = influences(ds, found, own_ground=True)
    assert re.match(r"What changes the answer most: suction: change \(0.\d+, more of it harms\)", said)
    assert "with damage of category" in said
    (shown,) = section.parts
    assert shown.caption.startswith("Inputs and damage of category")
    assert any(row[0] == "suction.change" for row in shown.rows)


def test_a_movement_for_one_wall_is_refused(tmp_path: Path, wall: xr.Dataset) -> None:
    from damagepred.archive.files import write_dataset

    write_dataset(wall, tmp_path / "wall.nc")
    with pytest.raises(InputError, match="class H1: goes with a study"):
        write_report(tmp_path / "wall.nc", at=movement_distribution("H1"))


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
