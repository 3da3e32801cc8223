"""Every kind of wall and study gets a page: solvers, footings, zones, runs in time, ends of the movement alone."""

import json
import re
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

import damagepred
from damagepred.archive.files import write_dataset
from damagepred.archive.provenance import GIVEN, UNITS
from damagepred.campaign.settings import StudySettings
from damagepred.one_wall.solve import solve
from damagepred.report import write_report
from damagepred.report.inputs import input_section
from damagepred.results.tables import Table
from damagepred.scene import Scene
from damagepred.study import Study
from tests.campaign.test_house import HOUSE as STUDY
from tests.conftest import SMALL_STUDY
from tests.report.test_page import HTML, check_page

SMALL: dict[str, Any] = {
    "wall": {"length": 1.2, "height": 0.3},
    "joint": {"tensile_strength": "0.05 MPa"},
    "movement": {"central_deflection": "4 mm", "increments": 2},
}
KINDS: dict[str, dict[str, Any]] = {
    "without_dpc": {},
    "explicit": {"solver": {"method": "explicit", "ramp_cycles": 200}},
    "deformable": {"solver": {"blocks": "deformable"}},
    "doming_on_jacks": {
        "dpc": {"course": 1},
        "movement": {"kind": "doming", "shape": "jacks", "central_deflection": "1 mm", "increments": 2},
    },
    "cracked_footing_on_mound": {
        "footing": {"concrete": {"grade": "N25", "bottom": "3-L11TM"}},
        "movement": {"shape": "mound", "increments": 2},
        "mound": {"surface_movement": "10 mm"},
    },
    "softening": {"joint": {"fracture_energy": "10 N/m", "tensile_strength": "0.2 MPa"}},
    "no_movement": {"movement": {"central_deflection": 0.0, "increments": 1}},
    "in_time": {"dynamics": {"duration": 0.02, "outputs": 3}},
}


@pytest.mark.quick_cases
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_wall_has_a_page(kind: str, tmp_path: Path) -> None:
    tables = {name: {**SMALL.get(name, {}), **KINDS[kind].get(name, {})} for name in {**SMALL, **KINDS[kind]}}
    write_dataset(solve(Scene.from_dict({"title": kind, **tables}), on_failure="return"), tmp_path / "wall.nc")
    root = check_page(write_report(tmp_path / "wall.nc").read_text(encoding="utf-8"))
    figures = [e.get("id") for e in root.iter(f"{HTML}figure")]
    assert figures[0] == "figure-wall"
    assert "figure-history" in figures
    assert ("figure-dpc" in figures) == ("dpc" in KINDS[kind])
    assert ("figure-footing" in figures) == (KINDS[kind].get("movement", {}).get("shape") in ("jacks", "mound"))
    shown = "".join(root.itertext())
    assert ("Mound" in shown) == ("mound" in KINDS[kind])


@pytest.mark.thorough
def test_a_study_on_mounds_has_curves_against_the_ground_and_limits_of_the_footing(tmp_path: Path) -> None:
    text = SMALL_STUDY.replace(
        '[scene.movement]\nkind = "doming"\ncentral_deflection = "6 mm"\nincrements = 6',
        '[scene.movement]\nkind = "doming"\nshape = "mound"\nincrements = 3\n[scene.mound]\nsurface_movement = "0.1 m"',
    ).replace('[variables."movement.central_deflection"]', '[variables."mound.surface_movement"]')
    text = text.replace('lower = "6 mm"\nupper = "9 mm"', 'lower = "100 mm"\nupper = "120 mm"')
    text = text.replace("length = 1.44", "length = 9.6")  # so that footings deflect by the least limit, 4.8 mm
    study = Study(StudySettings.from_dict(tomllib.loads(text)))
    with ThreadPoolExecutor(1) as here:
        study.run(tmp_path / "mound.dp", samples=4, executor=here)
    root = check_page(write_report(tmp_path / "mound.dp", bootstrap=20).read_text(encoding="utf-8"))
    shown = "".join(root.itertext())
    assert "median surface movement" in shown
    assert "Counted among the walls" in shown
    assert "agrees bit for bit with the study" in shown


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


def test_the_inputs_of_a_house_name_given_openings_and_lengths_by_their_ends():
    wall = {"name": "front", "start": [0, 0], "end": [1.92, 0], "height": 0.45}
    door = {"kind": "door", "x": 0.48, "width": 0.96, "height": 0.3}
    walls = [{**wall, "opening": [door]}, {**wall, "name": "side", "start": [1.92, 0], "end": [1.92, 0.96]}]
    mound = {"shape": "tilt", "surface_movement": 0.01}
    house = Scene.from_dict({"wall": walls, "mound": mound, "movement": {"kind": "settle"}})
    given = "wall.front.opening.1.width wall.front.opening.1.x wall.front.height"
    section = input_section(house, attributes={GIVEN: given, UNITS: '{"wall.front.opening.1.width": "mm"}'})
    table = next(part for part in section.parts if isinstance(part, Table))
    rows = {(group, row[0]): row[1:] for group, row in zip(table.groups, table.rows)}
    assert table.caption == "The house"
    assert rows["Wall front", "length"] == ["1.92", "m", "from start to end"]
    assert rows["Wall front", "opening 1: width"] == ["960", "mm", "as given"]
    assert rows["Wall front", "opening 1: y"][2] == "default"
    assert rows["Wall side", "length"][2] == "from start to end"
