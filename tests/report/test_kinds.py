"""Every kind of wall and study gets a page: solvers, footings, zones, runs in time, ends of the movement alone."""

import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from damagepred.archive.files import write_dataset
from damagepred.campaign.settings import StudySettings
from damagepred.one_wall.solve import solve
from damagepred.report import write_report
from damagepred.scene import Scene
from damagepred.study import Study
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


def _run(study: Study, folder: Path, samples: int) -> None:
    with ThreadPoolExecutor(1) as here:  # worker processes take longer to begin than these walls
        study.run(folder, samples=samples, executor=here)


@pytest.mark.thorough
def test_a_study_on_mounds_has_curves_against_the_ground_and_limits_of_the_footing(tmp_path: Path) -> None:
    text = SMALL_STUDY.replace(
        '[scene.movement]\nkind = "doming"\ncentral_deflection = "6 mm"\nincrements = 6',
        '[scene.movement]\nkind = "doming"\nshape = "mound"\nincrements = 3\n[scene.mound]\nsurface_movement = "0.1 m"',
    ).replace('[variables."movement.central_deflection"]', '[variables."mound.surface_movement"]')
    text = text.replace('lower = "6 mm"\nupper = "9 mm"', 'lower = "100 mm"\nupper = "120 mm"')
    text = text.replace("length = 1.44", "length = 9.6")  # so that footings deflect by the least limit, 4.8 mm
    study = Study(StudySettings.from_dict(tomllib.loads(text)))
    _run(study, tmp_path / "mound.dp", 4)
    root = check_page(write_report(tmp_path / "mound.dp", bootstrap=20).read_text(encoding="utf-8"))
    shown = "".join(root.itertext())
    assert "median surface movement" in shown
    assert "Counted among the walls" in shown
    assert "agrees bit for bit with the study" in shown
