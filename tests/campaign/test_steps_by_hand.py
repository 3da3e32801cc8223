"""Steps of campaigns by hand: settings, tables of samples, costs, statuses and repairs."""

import math
import tomllib
from concurrent.futures import Future
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from damagepred.analyses.rare_event import kept_sizes
from damagepred.archive.digest import signed_json
from damagepred.archive.folder import StudyFolder
from damagepred.archive.parts import joined, write_part
from damagepred.campaign import cost_estimate
from damagepred.campaign.campaign import Campaign
from damagepred.campaign.cost_estimate import _elsewhere, _errors, _percent, estimate_cost
from damagepred.campaign.dispatch import Batches, Engine, LostSample, _result
from damagepred.campaign.sample import Outcome, already_done
from damagepred.campaign.settings import StudySettings, read_frozen, study_tables
from damagepred.campaign.verify import verify
from damagepred.cli.sentences import cost_lines
from damagepred.errors import InputError
from damagepred.results.tables import Column, Table
from damagepred.scene.accuracy import Measured
from damagepred.scene.keys import differing_keys, key_values, merged
from tests.archive.test_files import row
from tests.conftest import SMALL_STUDY
from tests.synthetic_studies import synthetic_study


def settings(changes: dict[str, Any], **sampling: Any) -> StudySettings:
    tables = tomllib.loads(SMALL_STUDY)
    tables |= {key: {**tables.get(key, {}), **table} for key, table in changes.items()}
    tables["study"] |= sampling
    return StudySettings.from_dict(tables)


def test_tables_of_samples_and_their_weighted_means(tmp_path: Path) -> None:
    """Also with the headers of an older study, which counted from 0."""
    opening = {"x": 0.48, "y": 0.15, "width": 0.24, "height": 0.15}
    text = SMALL_STUDY.replace("seed = 7", 'seed = 7\nsampler = "table"\ntable = "t.csv"').partition("[variables")[0]
    (tmp_path / "t.csv").write_text("joint.friction,opening.1.x [mm],weight\n0.6,480,1\n0.7,480,1\n0.9,500,2\n")
    tables = tomllib.loads(text)
    tables["scene"]["opening"] = [opening]
    new = StudySettings.of_tables(tables, tmp_path, "study.toml")
    assert new.study.table_columns == ("joint.friction", "opening.1.x", "weight")
    assert new.means() == pytest.approx({"joint.friction": 0.775, "opening.1.x": 0.49})
    for header in ("opening.1.x", "opening.0.x"):
        (tmp_path / "t.csv").write_text(f"joint.friction,{header} [mm],weight\n0.6,480,1\n0.7,490,1\n")
        values = new.design().wall_values(2)
        assert {k: v.tolist() for k, v in values.items()} == {"joint.friction": [0.6, 0.7], "opening.1.x": [0.48, 0.49]}
    (tmp_path / "t.csv").write_text("joint.friction\n0.5\n-1\n")
    with pytest.raises(InputError, match=r"t\.csv: a value the scene cannot take"):
        StudySettings.of_tables(tables, tmp_path, "study.toml")


def test_a_frozen_study_of_an_older_version_counts_from_1(tmp_path: Path) -> None:
    tables = settings({}).to_dict()
    tables["scene"]["opening"] = [{"kind": "window", "x": 0.48, "y": 0.15, "width": 0.24, "height": 0.15}]
    width = {"distribution": "uniform", "lower": 0.2, "upper": 0.24}
    tables["variables"] |= {"opening.0.width": width}
    tables["correlation"]["opening.0.width"] = {"joint.friction": 0.3}
    tables["study"]["epistemic"] = {"other": {"opening.0.width": {"upper": 0.23}}}
    import tomli_w

    found = read_frozen(tomli_w.dumps(tables))
    assert "opening.1.width" in found.variables
    assert found.correlation["opening.1.width"] == {"joint.friction": 0.3}
    assert list(found.study.epistemic["other"]) == ["opening.1.width"]
    with pytest.raises(InputError, match=r"opening\.0\.width"):
        read_frozen(tomli_w.dumps({"schema_version": 8, **tables}))


def test_categories_means_and_keys_of_settings(tmp_path: Path) -> None:
    stops = [({}, "path", 4), ({"stop_at_category": 2}, "path", 2), ({"stop_at_category": "none"}, "path", math.inf)]
    stops += [({"stop_at_category": None}, m, math.inf) for m in ("both", "sampled")]
    stops += [({"stop_at_category": None}, "path", 4)]
    for how, movement, last in stops:
        assert settings({}, **{"movement": movement} | how).last_category == last
    assert settings({}).other_means() == [
        "variable movement.central_deflection: mean 7.5 mm, the scene has 6 mm; samples follow the variable"
    ]
    scene, words = settings({}).mean_wall()
    assert scene.movement.central_deflection == pytest.approx(7.5e-3)
    assert scene.title == "small wall that cracks: mean wall"
    assert "with joint.tensile_strength = 0.1 MPa, joint.cohesion = 0.1 MPa, joint.friction = 0.75, " in words
    assert "movement.central_deflection = 7.5 mm (arithmetic means" in words
    tables = {"a": {"b": 1, "c": [1]}, "d": 2}
    for key, value in {"a.c": [3], "a.e.f": 4, "d.g": 5, "h": {}, "a": {}}.items():
        tables = merged(tables, {key: value})
    assert tables == {"a": {"b": 1, "c": [3], "e": {"f": 4}}, "d": {"g": 5}, "h": {}}
    changes = {"joint": {"friction": 0.5, "dilation": 1}, "title": "a", "footing": {"concrete": {}}}
    assert dict(key_values(changes)) == {
        "joint.friction": 0.5,
        "joint.dilation": 1,
        "title": "a",
        "footing.concrete": {},
    }
    assert differing_keys({"a": {"b": 1, "c": 2}, "d": 3}, {"a": {"b": 1, "c": 4}, "e": 5}) == [
        "a.c (was 2, is 4)",
        "d (was 3, is None)",
        "e (was None, is 5)",
    ]
    one = settings({})
    assert one.with_samples(None, None) is one
    assert (one.with_samples(9, None).study.samples, one.with_samples(None, 0).study.seed) == (9, 0)
    for wrong in ((0, None), (None, -1)):
        with pytest.raises(InputError, match="1 or more, and the seed 0 or more"):
            one.with_samples(*wrong)
    with pytest.raises(InputError, match=r"joint\.friction: the study draws this number for each wall"):
        one.require_not_drawn(["joint.dilation", "joint.friction"], {})
    (tmp_path / "scene").mkdir()
    (tmp_path / "scene" / "wall.toml").write_text("[wall]\nlength = 2.0\n")
    (tmp_path / "study.toml").write_text('scene = "scene/wall.toml"\n')
    assert study_tables(tmp_path / "study.toml") == ({"scene": {"wall": {"length": 2.0}}}, tmp_path / "scene")


def test_errors_of_presets() -> None:
    assert [_percent(share) for share in (0.0, 4.9e-6, 5e-6, 0.0123)] == ["0 %", "0 %", "0.0005 %", "1.2 %"]

    def measured(quantity: str, error: float, times: float, floor: float = 0.0) -> Any:
        return SimpleNamespace(quantity=quantity, error=error, times=times, floor=floor, wall=f"wall {times:g}")

    rows = [
        measured("widest crack", 0.02, 2.0, 0.03),
        measured("widest crack", 0.01, 2.5),
        measured("damage category", 1.0, 2.1),
    ]
    assert _errors(rows) == "2-2.5 times the time of standard; widest crack 2 % (known to 3 %), damage category 1"
    assert _errors(rows[::2]).startswith("2 times the time")
    assert _elsewhere("widest crack", rows).startswith(
        "widest crack: error unknown on walls like it; on other walls (wall 2; wall 2.5) "
    )
    assert _elsewhere("rotation", rows) == "rotation: error unknown, on no wall"
    assert Measured.__annotations__.keys() >= {"quantity", "error", "times", "floor", "wall"}


def test_an_executor_is_counted_by_what_it_tells() -> None:
    def width(**attributes: Any) -> int:
        return Engine("a", SimpleNamespace(**attributes)).width

    client = SimpleNamespace(nthreads=lambda: {"a": 2, "b": 3})
    assert (width(_max_workers=3), width(num_workers=5), width(_client=client, _max_workers=9)) == (3, 5, 5)
    assert width() == width(_max_workers=0) == width(num_workers="2")
    with pytest.raises(InputError, match="its submit returns a int, not a future"):
        Engine("a", SimpleNamespace(submit=lambda *_: 3)).submit([])
    batches = Batches([(0, {}), (1, {}), (3, {}), (4, {})], 4)
    for _ in range(2):
        batches.note(1e-3)
    assert [batches.next() for _ in range(3)] == [[(0, {}), (1, {})], [(3, {}), (4, {})], None]


def test_the_manifest_has_the_head_of_the_report() -> None:
    assert "report" not in Campaign(settings({}))._manifest(6)
    assert Campaign(settings({"report": {"client": "A. Owner"}}))._manifest(6)["report"] == {"client": "A. Owner"}


def test_a_batch_whose_part_is_there_is_not_solved_again(tmp_path: Path) -> None:
    folder = StudyFolder(synthetic_study(tmp_path / "house.dp", 4))
    batch = [(1, {}), (2, {})]
    assert already_done(folder, batch) is None
    lost: Future[list[Outcome]] = Future()
    lost.set_exception(MemoryError("full"))
    assert _result(lost, str(folder.path), batch) == LostSample(1, "error", "MemoryError: full")
    rows = [row(i, increments=7, openings=0) for i in (1, 2)]
    write_part(folder.part_file(1, 2), joined(rows), folder.study_hash)
    seconds = [float(one["run_time"].values[0]) for one in rows]
    solved = [Outcome(1, 1, seconds[0]), Outcome(2, 0, seconds[1])]
    assert already_done(folder, batch) == _result(lost, str(folder.path), batch) == solved
    write_part(folder.part_file(1, 2), joined(rows[:1]), folder.study_hash)
    assert already_done(folder, batch) is None  # it lacks sample 2
    folder.part_file(1, 2).write_bytes(b"CDF")
    assert already_done(folder, batch) is None


def test_files_and_plans_of_a_verification(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Samples spread over the solved ones, the time that they take, and files with each kind of remark."""
    from damagepred.campaign import verify as module

    folder = StudyFolder(synthetic_study(tmp_path / "house.dp", 6, failed=(2,), missing=(5,)))
    rows = [row(i, increments=7, openings=0) for i in range(5)]
    for i, one in enumerate(rows):
        one["status"].values[:] = 2 if i == 2 else 0
        one["run_time"].values[:] = 45.0
        one["crack_width_max"].values[:] = 0.0
    write_part(folder.part_file(0, 4), joined(rows), folder.study_hash)
    folder.results_file.unlink()
    asked, said = [], []
    monkeypatch.setattr(module, "replay", lambda _, i: asked.append(i) or (None, "differs" if i else "bit for bit"))
    found = verify(folder.path, 3, said.append)
    assert (asked, said) == ([0, 1, 4], ["solving 3 samples again, 2 min"])
    assert found.differing == ["sample 1 solved again differs", "sample 4 solved again differs"]
    assert (found.files, found.damaged) == (5, [])
    assert found.notes == ["1 of 6 samples have no result; `damagepred study` runs them."]
    verify(folder.path, 1, said.append)
    assert said[1] == "solving 1 sample again, 45 s"
    with pytest.raises(InputError, match="can be solved again in study folders only"):
        verify(folder.design_file, 1)
    assert verify(folder.design_file).files == 1


def test_sizes_of_a_question_that_was_asked_before(tmp_path: Path) -> None:
    file = tmp_path / "question.json"
    assert kept_sizes(tmp_path) == {}
    file.write_text(signed_json({"samples": 50, "category": 2}, "0" * 16))
    assert kept_sizes(tmp_path) == {"samples": 50, "runs": 1}
    file.write_text(signed_json({"samples": 50, "runs": 3}, "0" * 16).replace("50", "51"))
    assert kept_sizes(tmp_path) == {}


def test_cells_of_tables_on_the_page_and_on_the_terminal() -> None:
    columns = [
        Column("name", ["a-b", "c"], words=True, short="name"),
        Column("value", ["-1", "2-3"], "mm", "value\nmm", ["-1 (a\nb)", "2"]),
        Column("", ["x", "y"], short="both"),
        Column("page", ["-", "1"]),
    ]
    page, brief = Table.of("caption", columns, "note"), Table.brief("caption", columns)
    assert (page.columns, page.words, page.note) == (["name", "value (mm)", "page"], [0], "note")
    assert page.rows == [["a-b", "−1", "−"], ["c", "2−3", "1"]]
    assert (brief.columns, brief.rows) == (["name", "value\nmm", "both"], [["a-b", "-1 (a b)", "x"], ["c", "2", "y"]])


WALL = "[study]\nsamples = 3\n[scene.wall]\nlength = 1.44\nheight = 0.6\n"
SEASONS = "[scene.movement.seasons]\nyears = 1\nswing = '6 mm'\nincrements = 1\n"
SCATTER = "[variables.'joint.friction']\ndistribution = 'uniform'\nlower = 0.6\nupper = 0.8\n"


def test_walls_of_histories_are_timed_one_after_the_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "years.toml").write_text(WALL + SEASONS + SCATTER)
    seen = []
    found = estimate_cost(tmp_path / "years.toml", on_step=lambda step: seen.append(step.increment.number))
    assert seen == [0, 1, 2] * 3  # as many as the study has
    assert found.wall_seconds == pytest.approx(np.mean(found.timed))
    assert "on average of 3 walls, " in cost_lines(found)[3]
    assert "3 walls with 1 uncertain numbers" in "".join(cost_lines(found))
    monkeypatch.setattr(cost_estimate, "HISTORY_WALLS", 2)
    assert len(estimate_cost(tmp_path / "years.toml").timed) == 2


def test_timing_ends_with_its_limit_and_other_movements_take_one_wall(tmp_path, monkeypatch) -> None:
    (tmp_path / "years.toml").write_text(WALL + SEASONS + SCATTER)
    with monkeypatch.context() as patch:
        patch.setattr(cost_estimate, "TIMING_LIMIT", 0.0)
        assert len(estimate_cost(tmp_path / "years.toml").timed) == 1
    (tmp_path / "once.toml").write_text(WALL + SCATTER)
    found = estimate_cost(tmp_path / "once.toml")
    assert len(found.timed) == 1
    assert "on average" not in cost_lines(found)[3]


@pytest.mark.parametrize(("timed", "expected"), [((1.4, 0.2), 0.2), ((6.0, 1.5), 1.5), ((25.0,), 25.0)])
def test_libraries_loaded_by_the_first_wall_do_not_count(timed, expected, tmp_path, monkeypatch) -> None:
    """A short wall is timed twice, a long one once."""
    times = iter(timed)
    monkeypatch.setattr(cost_estimate, "_timed", lambda *_: (next(times), "complete", ()))
    (tmp_path / "once.toml").write_text(WALL + SCATTER)
    assert estimate_cost(tmp_path / "once.toml").wall_seconds == expected
    assert not list(times)
