"""Reports of a house: plan and walls on the first page, tables of walls, corners and rooms."""

import json
import re
import tomllib
from concurrent.futures import ThreadPoolExecutor

import pytest

import damagepred
from damagepred.archive.files import write_dataset
from damagepred.campaign.settings import StudySettings
from damagepred.report import write_report
from damagepred.scene import Scene
from damagepred.study import Study
from tests.campaign.test_house import HOUSE as STUDY
from tests.report.test_page import HTML, check_page

ENDS = [[0, 0], [2.16, 0], [2.16, 1.2], [0, 1.2], [0, 0]]


@pytest.fixture(scope="module")
def solved():
    names = ("front", "right", "back", "left")
    walls = [{"name": n, "start": ENDS[i], "end": ENDS[i + 1], "height": 0.45} for i, n in enumerate(names)]
    mound = {"shape": "corner", "point": [0, 0], "reach": 1.2, "surface_movement": "60 mm"}
    joint = {"tensile_strength": 1e4, "cohesion": 2e4}
    tables = {"wall": walls, "mound": mound, "joint": joint, "movement": {"kind": "settle", "increments": 3}}
    return damagepred.solve(Scene.from_dict({"title": "a <house>", **tables}))


def test_the_page_of_a_house(solved, tmp_path):
    write_dataset(solved, tmp_path / "house.nc")
    page = write_report(tmp_path / "house.nc").read_text(encoding="utf-8")
    root = check_page(page)
    figures = [e.get("id") for e in root.iter(f"{HTML}figure")]
    assert figures[:3] == ["figure-plan", "figure-unfolded", "figure-history"]
    assert "figure-house" in figures
    shown = " ".join("".join(root.itertext()).split())
    worst = int(solved["damage_category"][-1])
    assert worst >= 1
    assert "of its worst wall, front" in shown or "of its worst wall, left" in shown
    reached = float(solved["surface_movement"][int((solved["damage_category"].values >= worst).argmax())])
    assert f"reached at a settlement of the corner of {1e3 * reached:g} mm" in shown.replace("\u00a0", " ")
    assert f"{int(solved['damaged_walls'][-1])} of 4: " in shown
    assert "Straight walls, each in its own plane" in shown
    assert "1 at 1.1, 0.6 m" in shown  # the room
    (data,) = re.findall(r'class="walls">(.*?)</script>', page)
    (moved,) = json.loads(data)["walls"]
    assert len(moved["movement"]) == 4
    assert [label[0] for label in moved["labels"]] == ["front", "right", "back", "left"]


def test_the_page_of_a_study_of_houses_counts_houses_and_has_each_wall(tmp_path):
    tables = tomllib.loads(STUDY)
    study = Study(StudySettings.from_dict(tables))
    with ThreadPoolExecutor(1) as here:  # worker processes take longer to begin than these walls
        study.run(tmp_path / "house.dp", samples=3, executor=here)
    root = check_page(write_report(tmp_path / "house.dp", bootstrap=20).read_text(encoding="utf-8"))
    figures = [e.get("id") for e in root.iter(f"{HTML}figure")]
    assert figures[:3] == ["figure-plan", "figure-unfolded", "figure-fragility"]
    shown = " ".join("".join(root.itertext()).split())
    assert "damage category of a house?" in shown
    assert "of the houses." in shown
    assert "Probability of damage by wall" in shown
