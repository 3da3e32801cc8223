"""Serial, parallel, resumed, extended and replayed samples are bit for bit the same."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred.archive.files import read_dataset
from damagepred.archive.folder import StudyFolder
from damagepred.assembly import wall_geometry
from damagepred.campaign.replay import replay
from damagepred.campaign.sample import sampled_wall
from damagepred.campaign.settings import StudySettings
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError, StudyError
from damagepred.one_wall.judged_path import follow_wall
from damagepred.study import Study, open_study
from tests.conftest import SMALL_STUDY


def settings(text: str = SMALL_STUDY) -> StudySettings:
    import tomllib

    tables = tomllib.loads(text)
    tables["scene"].setdefault("solver", {"blocks": "rigid"})
    return StudySettings.from_dict(tables)


def same(first: xr.Dataset, second: xr.Dataset) -> None:
    """All variables except time and place are the same to the last bit."""
    assert set(first.data_vars) == set(second.data_vars)
    for name in set(first.data_vars) - {"run_time", "environment"}:
        np.testing.assert_array_equal(first[name].values, second[name].values, err_msg=str(name))


@pytest.fixture(scope="module")
def serial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("serial") / "study.dp"
    summary = Study(settings()).run(folder, workers=1)
    assert (summary.total, summary.done, summary.failed, summary.interrupted) == (6, 6, 0, False)
    return folder


def test_design_is_written_with_every_input(serial: Path) -> None:
    design = read_dataset(serial / "design.nc")
    study = Study(settings())
    assert set(study.settings.variables) <= set(design.data_vars)
    for sample in (0, 5):
        scene, fields = study.sample(sample)
        assert scene.joint.friction == design["joint.friction"].values[sample]
        assert scene.movement.central_deflection == design["movement.central_deflection"].values[sample]
        for place, values in fields.items():
            np.testing.assert_array_equal(design[place].values[sample], values)
    assert design["joint.tensile_strength"].attrs["units"] == "Pa"


def test_another_study_is_refused_and_the_keys_are_named(serial: Path) -> None:
    other = settings(SMALL_STUDY.replace("mean = 0.75", "mean = 0.7").replace("height = 0.45", "height = 0.375"))
    before = sorted(p.name for p in serial.rglob("*"))
    with pytest.raises(StudyError) as caught:
        Study(other).run(serial)
    assert "variables.joint.friction.mean (was 0.75, is 0.7)" in str(caught.value)
    assert "scene.wall.height" in str(caught.value)
    assert sorted(p.name for p in serial.rglob("*")) == before


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "letters").mkdir()
    (tmp_path / "letters" / "love.txt").write_text("dear")
    with pytest.raises(StudyError, match="no study folder"):
        Study(settings()).run(tmp_path / "letters")
    assert (tmp_path / "letters" / "love.txt").read_text() == "dear"


def test_a_latin_hypercube_cannot_be_extended(tmp_path: Path) -> None:
    text = SMALL_STUDY.replace("seed = 7", 'seed = 7\nsampler = "lhs"')
    with ThreadPoolExecutor(2) as executor:
        Study(settings(text)).run(tmp_path / "lhs.dp", samples=2, executor=executor)
        with pytest.raises(InputError, match="cannot be extended"):
            Study(settings(text)).run(tmp_path / "lhs.dp", samples=4, executor=executor)


def test_a_failed_sample_is_recorded_and_the_others_continue(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from damagepred.campaign import sample as module
    from damagepred.errors import ConvergenceError

    honest, calls = module.follow_scene, []

    def moody(*arguments: object):
        calls.append(1)
        for number, step in enumerate(honest(*arguments)):
            if len(calls) == 2 and number == 3:
                raise ConvergenceError("increment 3 did not settle, block 5", increment=3, block=5)
            yield step

    monkeypatch.setattr(module, "follow_scene", moody)
    with ThreadPoolExecutor(1) as executor:
        summary = Study(settings()).run(tmp_path / "moody.dp", samples=3, executor=executor)
    assert (summary.done, summary.failed) == (3, 1)
    folder = StudyFolder(tmp_path / "moody.dp")
    (number,) = folder.failed_samples()
    record = folder.failure(number)
    assert record["reason"] == "not_converged"
    assert "block 5" in record["message"]
    assert set(record["inputs"]) == {"joint.friction", "movement.central_deflection"}
    ds = folder.results()
    assert ds["status"].values[number] == 2
    # what was reached before it failed is kept, what came after is unknown
    assert np.isfinite(ds["crack_width_max"].values[number, :3]).all()
    assert np.isnan(ds["crack_width_max"].values[number, 3:]).all()
    assert (ds["damage_category"].values[number, 3:] == -1).all()
    monkeypatch.setattr(module, "follow_scene", honest)
    with ThreadPoolExecutor(1) as executor:
        again = Study(settings()).run(folder.path, samples=3, executor=executor)
        assert (again.done, again.failed) == (3, 1), "a failed sample is not run again unless asked"
        again = Study(settings()).run(folder.path, samples=3, executor=executor, retry_failed=True)
    assert (again.done, again.failed) == (3, 0)
    assert (folder.results()["status"].values == 0).all()


def test_strength_and_energy_of_bricks_may_be_uncertain(tmp_path: Path) -> None:
    """Bricks break in the weak wall alone; the draws of its joints are those of the wall with whole bricks."""
    bricks = """
[scene.block]
tensile_strength = "3 MPa"
fracture_energy = 50.0
[scene.solver]
blocks = "elastic"
[variables."block.tensile_strength"]
distribution = "uniform"
lower = "5 kPa"
upper = "5 MPa"
[variables."block.fracture_energy"]
distribution = "uniform"
lower = 20
upper = 80
"""
    study = settings(SMALL_STUDY.replace("[correlation]", f"{bricks}\n[correlation]"))
    design, weak = study.design(), {"block.tensile_strength": 5e3, "block.fracture_energy": 20.0}
    values = {place: float(column[0]) for place, column in design.wall_values(4).items()}
    kinds = []
    for strength in (weak, {**weak, "block.tensile_strength": 5e6}):
        scene, fields = sampled_wall(study, design, 0, values | strength)
        paths = list(follow_wall(scene, fields, 4))
        kinds.append(ContactKind.BRICK_JOINT in paths[-1][0].interfaces.kind)
        assert [step.increment.number for _, step in paths[-5:]] == [0, 1, 2, 3, 4]
        assert all(len(v) == len(wall_geometry(scene).mortar.kind) for v in fields.values())
    assert kinds == [True, False]
    Study(study).run(tmp_path / "bricks.dp", samples=3, workers=1)
    for sample in range(3):
        assert replay(tmp_path / "bricks.dp", sample)[1].startswith("bit for bit equal")


@pytest.mark.parametrize("stop", [2, '"none"'])
def test_a_path_ends_at_the_category_of_the_study(serial: Path, tmp_path: Path, stop: int | str) -> None:
    """The table's highest, which no wall of this study reaches, category 2, or nowhere."""
    study = settings(SMALL_STUDY.replace("stop_at_category = 4", f"stop_at_category = {stop}"))
    with ThreadPoolExecutor(2) as executor:
        Study(study).run(tmp_path / "study.dp", executor=executor)
    ds, whole = open_study(tmp_path / "study.dp"), open_study(serial)
    passed = whole["damage_category"].values >= 2
    assert (passed[:, -1] & ~passed[:, 0]).sum() > 2
    reached = np.where(passed.any(axis=1), passed.argmax(axis=1), 6)
    for sample in range(6):
        end = reached[sample] if stop == 2 else 6
        known = ds["crack_width_max"].values[sample]
        np.testing.assert_array_equal(known[: end + 1], whole["crack_width_max"].values[sample, : end + 1])
        assert np.isnan(known[end + 1 :]).all()
    assert StudySettings.from_dict(study.to_dict()) == study
