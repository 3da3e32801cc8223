"""Whole pages of invented results, text by text and cell by cell, against the lists in ``pages/``."""

import re
from pathlib import Path

import numpy as np
import pytest

from damagepred.archive.folder import StudyFolder
from damagepred.plotting import vector
from damagepred.report import explorer
from damagepred.report.parts import Page
from damagepred.report.study import study_page
from damagepred.report.wall import wall_page
from tests.plotting.test_whole_pictures import solved
from tests.recorded import check_parts, parts_of
from tests.synthetic_studies import synthetic_study

LISTS = Path(__file__).parent / "pages"
WRITTEN = "2026-02-03 10:00"


@pytest.fixture(autouse=True)
def _drawings_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vector, "svg_of", lambda *_: "drawing")
    monkeypatch.setattr(explorer, "explorer", lambda walls: ", ".join(walls))


def check_page(name: str, page: Page) -> None:
    parts = dict(parts_of(page, "page"))
    dated = re.compile(r"damagepred \d|20\d\d-\d\d-\d\dT")
    check_parts(LISTS / f"{name}.txt", {k: v for k, v in parts.items() if not dated.search(v)})


@pytest.mark.parametrize("name", ["door", "pier", "broken", "history"])
def test_a_page_of_a_wall_is_its_list(name: str) -> None:
    check_page(name, wall_page(solved(name), f"{name}.nc", WRITTEN))


def test_pages_of_paths_that_ended_otherwise_are_their_list() -> None:
    wall = solved("door")
    ends = {"failed": {"status_message": "no equilibrium"}, "interrupted": {}, "collapsed": {}, "complete": {}}
    parts: dict[str, str] = {}
    for status, more in ends.items():
        ds = wall.assign_attrs(status=status, sample=5, seed=9, **more)
        if status == "complete":  # of many increments and of settling ground, with a gap on the footing
            ds = ds.isel(increment=np.arange(130) * ds.sizes["increment"] // 130)
            ds["settlement"] = "increment", np.linspace(0.0, 2e-2, 130)
            ds["surface_movement"] = "increment", np.linspace(0.0, 4e-2, 130)
        page = wall_page(ds, "wall.nc", WRITTEN)
        parts |= parts_of([page.warnings, page.facts, page.subtitle, page.answers], status)
        parts |= parts_of([part for part in page.appendix[2].parts if status == "complete"], f"{status} path")
        parts |= parts_of(page.appendix[1].parts[0].rows[3:], f"{status} run")
    check_parts(LISTS / "endings.txt", parts)


@pytest.mark.parametrize(
    ("name", "at", "more"),
    [
        ("study", None, {"failed": (3, 7), "missing": (20, 21), "medians": (1e-3, 2e-3, 6e-3)}),
        ("study_at", "4 mm", {"own_movements": False, "changes": '[report]\nclient = "A & B"\n'}),
    ],
)
def test_a_page_of_a_study_is_its_list(name: str, at: str | None, more: dict, tmp_path: Path) -> None:
    folder = StudyFolder(synthetic_study(tmp_path / "house.dp", 24, **more))
    check_page(name, study_page(folder, WRITTEN, replay=False, confidence=0.8, bootstrap=30, at=at))
