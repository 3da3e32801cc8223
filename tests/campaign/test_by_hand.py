"""Reported values of a study, compared with hand calculation."""

import math
import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import tomli_w

from damagepred.archive.folder import StudyFolder
from damagepred.archive.schema import Column
from damagepred.assembly import Limits
from damagepred.campaign import sample
from damagepred.campaign.campaign import _Stop
from damagepred.campaign.cost_estimate import require_affordable
from damagepred.campaign.dispatch import sample_timeout
from damagepred.campaign.sample import _kept_of_movement
from damagepred.campaign.settings import StudySettings, read_frozen
from damagepred.campaign.status import study_status
from damagepred.cli.sentences import share_rows, status_lines
from damagepred.enumerations import SampleStatus
from damagepred.errors import ConvergenceError, DivergenceError, InputError, StudyError
from damagepred.study import Study
from damagepred.uq import estimate
from tests.conftest import SMALL_STUDY
from tests.synthetic_studies import synthetic_study


def settings(changes: dict[str, Any] | None = None, **sampling: Any) -> StudySettings:
    tables = tomllib.loads(SMALL_STUDY)
    tables["study"] |= sampling
    return StudySettings.from_dict(tables | (changes or {}))


@pytest.mark.parametrize("replicates", [1, 4])
def test_every_number_of_a_standing(tmp_path: Path, replicates: int, monkeypatch: pytest.MonkeyPatch) -> None:
    failed, missing = (3, 11, 17), (20, 21, 22, 23, 24)
    folder = StudyFolder(synthetic_study(tmp_path / "house.dp", 40, (5e-3, 9e-3), failed=failed, missing=missing))
    ds = folder.results()
    ds["run_time"].values[:] = np.arange(40) * 0.5  # of 0 to 19.5 s: 9.75 s on average
    if replicates > 1:
        ds.attrs["replicates"] = replicates
    monkeypatch.setattr(StudyFolder, "results", lambda *given: ds)
    found = study_status(folder.path)
    assert (found.total, found.done, found.failed, found.remaining) == (40, 35, 3, 5)
    assert status_lines(found)[:2] == [
        "small wall that cracks: 35 of 40 walls done, 3 failed, 5 remaining",
        "9.8 s per wall, about 49 s of work left",
    ]
    said = [line for line in status_lines(found) if line.startswith("failed sample")]
    assert said == [f"failed sample {i}: not_converged: no equilibrium in increment 1" for i in failed]
    good = np.setdiff1d(np.arange(40), (*failed, *missing))
    worst = ds["damage_category"].values[good].max(axis=1)
    assert len(set(worst.tolist())) == 3
    label = good % replicates if replicates > 1 else None
    for category, row in enumerate(share_rows(found)):
        number, worse = int((worst == category).sum()), int((worst >= category).sum())
        interval = estimate.probability(worst >= category, replicate=label)
        assert row[1:4] == [str(number), f"{number / 32:.3f}", f"{interval.value:.3f}"]
        if category == 0:  # every wall is in it or worse, whatever became of it
            assert row[4] == row[5] == "1.000 - 1.000"
            continue
        assert row[4] == f"{interval.lower:.3f} - {interval.upper:.3f}"
        assert row[5] == f"{worse / 35:.3f} - {(worse + 3) / 35:.3f}"
        if replicates == 1:
            share, z = worse / 32, 1.6448536
            middle, reach = share + z**2 / 64, z * math.sqrt(share * (1 - share) / 32 + z**2 / 64**2)
            ends = [float(end) for end in row[4].split(" - ")]
            assert ends == pytest.approx([(middle + way * reach) / (1 + z**2 / 32) for way in (-1, 1)], abs=6e-4)
    assert "; ".join(r[0] for r in share_rows(found)) == "0 negligible; 1 very slight; 2 slight; 3 moderate; 4 severe"


def test_rows_of_a_batch_that_follow_each_other_share_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    """A failed sample is alone, one without results parts its neighbours, and so does another shape."""
    written: list[tuple[Any, ...]] = []
    monkeypatch.setattr(
        sample, "write_part", lambda file, rows, name: written.append((*file, name, *rows["a"].values.ravel().tolist()))
    )
    folder: Any = SimpleNamespace(part_file=lambda first, last: (first, last), study_hash="h")

    def row(value: int, size: int = 1) -> dict[str, Column]:
        return {"a": Column(("sample", "b"), np.full((1, size), value), {})}

    rows = [
        (4, SampleStatus.COMPLETE, row(4)),
        (5, SampleStatus.COLLAPSED, row(5)),
        (6, SampleStatus.FAILED, row(6)),
        (7, SampleStatus.COMPLETE, row(7)),
        (9, SampleStatus.COMPLETE, row(9)),
        (11, SampleStatus.COMPLETE, row(11)),
        (12, SampleStatus.COMPLETE, row(12, 2)),
    ]
    sample._write_parts(folder, rows)
    assert written == [
        (4, 5, "h", 4, 5),
        (6, 6, "h", 6),
        (7, 7, "h", 7),
        (9, 9, "h", 9),
        (11, 11, "h", 11),
        (12, 12, "h", 12, 12),
    ]


def test_stored_part_of_a_path() -> None:
    values = np.array([[0.0, 1.5, 2.5, 4.0]])
    columns = {
        "crack_width_max": Column(("sample", "increment"), values, {"units": "m", "long_name": "widest crack"}),
        "opening_width_change": Column(("sample", "increment", "opening"), np.stack((values, -values), 2), {}),
        "status": Column(("sample",), np.array([1]), {}),
        "increment": Column(("increment",), np.arange(4), {}),
    }
    assert _kept_of_movement(columns, "path", 2) is columns
    end = _kept_of_movement(columns, "sampled", 2)
    assert set(end) == {"crack_width_max", "opening_width_change", "status"}
    assert (end["crack_width_max"].dims, end["crack_width_max"].values.tolist()) == (("sample",), [2.5])
    assert (end["opening_width_change"].dims, end["opening_width_change"].values.tolist()) == (
        ("sample", "opening"),
        [[2.5, -2.5]],
    )
    both = _kept_of_movement(columns, "both", 3)
    assert both["crack_width_max"] is columns["crack_width_max"]
    assert both["end_crack_width_max"].values.tolist() == [4.0]
    assert both["end_crack_width_max"].attributes["units"] == "m"
    assert both["end_crack_width_max"].attributes["long_name"] != "widest crack"


def test_reasons_of_failures() -> None:
    errors = (DivergenceError("a"), ConvergenceError("b"), InputError("c"), ValueError("d"))
    assert [sample._reason(e) for e in errors] == ["diverged", "not_converged", "bad_input", "error"]


FIELD = {"distribution": "lognormal", "mean": 1e5, "cov": 0.3, "field": {"course_correlation": 0.4}}


@pytest.mark.parametrize(
    ("changes", "sampling", "words"),
    [
        ({}, {"stop_at_category": 5}, "stop_at_category = 5: .* goes up to category 4"),
        ({}, {"stop_at_category": 0}, "must be the number of a category, 1 or more"),
        ({}, {"stop_at_category": True}, "must be the number of a category"),
        (
            {"correlation": {"joint.friction": {"joint.friction": 0.5}}},
            {},
            "= 0.5: a variable has correlation 1 with itself",
        ),
        ({"correlation": {"joint.friction": {"joint.cohesion": 1.01}}}, {}, "= 1.01: must be a number from -1 to 1"),
        ({"correlation": {"joint.friction": {"joint.cohesio": 0.1}}}, {}, "Did you mean 'joint.cohesion'"),
        ({"variables": {"loads.roof": FIELD}, "correlation": {}}, {}, "only numbers of joint, head_joint and dpc"),
        (
            {"variables": {"joint.friction": {"distribution": "normal", "mean": 0.1, "std": 0.05}}, "correlation": {}},
            {},
            "one wall in 1000000 gets a value",
        ),
        (
            {"variables": {"joint.friction": {"distribution": "uniform", "lower": -2, "upper": 1}}, "correlation": {}},
            {},
            "one wall in 1000000 gets",
        ),
        ({}, {"movement": "sampled", "stop_when": {"category": 1, "at": 0.006, "half_width": 0.1}}, "each wall has a"),
        ({}, {"stop_when": {"category": 5, "at": 0.006, "half_width": 0.1}}, "category: must be at most 4"),
        ({}, {"replicates": 3, "stop_when": {"category": 4, "at": 0.006, "half_width": 0.1}}, "first = 64: must be a"),
        ({}, {"sampler": "lhs", "replicates": 2}, "replicates = 2: is for sampler"),
        ({}, {"sampler": "random", "replicates": 2}, "replicates"),
        ({}, {"nominal_share": 0.1}, "nominal_share = 0.1: goes with"),
        ({}, {"importance": {"joint.fricton": {"shift": -1}}}, "Did you mean 'joint.friction'"),
        ({}, {"importance": {"joint.cohesion": {"shift": -1}}}, "no variable with one value per sample"),
        ({}, {"sampler": "table"}, "needs it"),
    ],
)
def test_incompatible_settings(changes: dict[str, Any], sampling: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        settings(changes, **sampling)


@pytest.mark.parametrize(
    ("key", "value"), [("coarse", {"wall": {"block_length": "480 mm"}}), ("crossed", True), ("time_budget", "4 s")]
)
def test_a_key_that_has_been_removed_is_named_and_has_no_effect(key: str, value: object) -> None:
    with pytest.warns(UserWarning, match=rf"\[study\] {key} has no effect: .*removed; .*leave it out"):
        assert settings(**{key: value}) == settings()


@pytest.mark.filterwarnings("error")
def test_frozen_studies_with_removed_keys_are_read_as_before() -> None:
    tables = tomllib.loads(settings().to_toml())
    tables["study"] |= {"crossed": True, "coarse": {"wall": {"block_length": 0.48}}, "time_budget": 4.0}
    tables["study"]["stop_when"] = {"category": 1, "quantity": "median", "half_width": 0.001}
    frozen = read_frozen(tomli_w.dumps(tables))
    assert frozen == replace(settings(), study=replace(settings().study, crossed=True))
    friction = frozen.design().wall_values(8)["joint.friction"].reshape(2, 2, 2)
    np.testing.assert_array_equal(friction[:, :, 0], friction[:, :, 1])
    assert len(np.unique(friction)) == 4


def test_memory_of_a_design_and_time_of_a_sample() -> None:
    """Four variables and the sample's number, eight copies of eight bytes: 320 bytes a sample."""
    study = settings()
    enough = Limits(memory=320.0 * 10**7, time=math.inf)
    require_affordable(study, enough, 10**7)
    with pytest.raises(InputError, match=r"samples = 10000001: the design alone .* 3\.2 GB"):
        require_affordable(study, enough, 10**7 + 1)
    limits = Limits(time=1800.0)
    assert sample_timeout(None, limits, None) == 1800.0
    assert sample_timeout(7.0, limits, None) == 7.0
    assert sample_timeout(math.inf, limits, None) is None
    executor = ThreadPoolExecutor(1)  # has no thread before it is used
    assert sample_timeout(None, limits, executor) is None
    for seconds, engine in ((7.0, executor), (0.0, None), (-1.0, None), (math.nan, None)):
        with pytest.raises(InputError, match="timeout"):
            sample_timeout(seconds, limits, engine)


def test_interrupts_are_counted() -> None:
    done: list[str] = []
    stop = _Stop()
    stop.at_first, stop.at_once = (lambda word=word: done.append(word) for word in ("first", "at once"))
    stop(2, None)
    assert (stop.count, done) == (1, ["first"])
    stop(2, None)
    assert (stop.count, done) == (2, ["first", "at once"])
    with pytest.raises(KeyboardInterrupt):
        stop(2, None)


def test_a_design_by_its_columns() -> None:
    study = Study(settings(samples=5, seed=3, importance={"joint.friction": {"shift": -1.0}}))
    ds = study.design_dataset(5)
    assert ds["sample"].values.tolist() == [0, 1, 2, 3, 4]
    np.testing.assert_array_equal(ds["weight"], study.design.weights(5))
    assert ds["joint.cohesion"].dims == ("sample", "joint")
    np.testing.assert_array_equal(ds["joint.cohesion"].values[3], study.sample(3)[1]["joint.cohesion"])
    assert (ds.attrs["seed"], ds.attrs["span"], ds.attrs["highest_category"]) == (3, 1.44, 4)
    assert (ds.attrs["sampler"], ds.attrs["replicates"], ds.attrs["damage_measure"]) == ("sobol", 1, "joint")
    assert ds["joint.friction"].attrs["distribution"] == "lognormal"
    assert (ds["movement.central_deflection"].attrs["units"], ds["joint.cohesion"].attrs["units"]) == ("m", "Pa")
    manifest = study._manifest(5)
    assert [manifest[k] for k in ("title", "samples", "seed", "sampler")] == ["small wall that cracks", 5, 3, "sobol"]
    with pytest.raises(StudyError, match=r"no study folder|holds"):
        study._prepare(StudyFolder(Path(__file__).parent), 5)
