"""A coarse wall beside each sampled one: the same sample, nearest joints, and used only where it pays."""

import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from damagepred.analyses.two_level import _pilot_of, levels, run_two_level
from damagepred.assembly import wall_geometry
from damagepred.campaign import sample
from damagepred.campaign.campaign import Campaign, RunSummary
from damagepred.campaign.sample import Outcome, Solved
from damagepred.campaign.settings import StudySettings
from damagepred.enumerations import SampleStatus
from damagepred.errors import InputError
from damagepred.study import Study, open_study
from damagepred.uq.control_variate import PilotReport
from damagepred.uq.design import Design
from tests.conftest import SMALL_STUDY

TINY = SMALL_STUDY.replace("length = 1.44", "length = 0.96").replace("increments = 6", "increments = 3")


def settings(coarse: dict[str, dict[str, object]], text: str = TINY) -> StudySettings:
    tables = tomllib.loads(text)
    tables["study"]["coarse"] = coarse
    return StudySettings.from_dict(tables)


LARGER = {"wall": {"block_length": 0.48, "block_height": 0.15}}


FIELDS = ("course_correlation = 0.4", 'correlation_length = "0.5 m"', 'correlation_length = 0.5, over = "course"')


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("pilot", [False, True])
def test_both_walls_are_of_the_same_sample(field: str, pilot: bool) -> None:
    both = levels(settings(LARGER, TINY.replace("course_correlation = 0.4", field)))
    assert both[0].study.sampler == "sobol"
    fine, coarse = (Study(_pilot_of(level) if pilot else level) for level in both)
    for number in (0, 3):
        (wall, strong), (large, shared) = fine.sample(number), coarse.sample(number)
        assert wall.joint == large.joint
        assert wall.movement == large.movement
        assert large.wall.block_length == 0.48
        ours, theirs = wall_geometry(large).joints, wall_geometry(wall).joints
        for j in range(len(ours.kind)):
            same = np.flatnonzero(theirs.kind == ours.kind[j])
            away = np.hypot(theirs.x[same] - ours.x[j], theirs.y[same] - ours.y[j])
            nearest = same[np.isclose(away, away.min())]
            assert shared["joint.cohesion"][j] in strong["joint.cohesion"][nearest]


def test_a_wall_of_varying_length_has_the_fields_of_its_own_joints() -> None:
    varying = """
[variables."wall.length"]
distribution = "discrete"
values = [0.96, 1.44]
"""
    fine, coarse = (Study(level) for level in levels(settings(LARGER, TINY + varying)))
    lengths = set()
    for number in range(8):
        (wall, strong), (large, shared) = fine.sample(number), coarse.sample(number)
        lengths.add(wall.wall.length)
        assert large.wall.length == wall.wall.length
        assert set(shared["joint.cohesion"]) <= set(strong["joint.cohesion"])
    assert len(lengths) == 2


def test_the_pilot_is_of_other_samples_that_do_not_count() -> None:
    both = levels(settings(LARGER))
    pilots = [_pilot_of(level) for level in both]
    assert pilots[0].study.seed == pilots[1].study.seed != both[0].study.seed
    assert pilots[0].study.sampler == pilots[1].study.sampler == "random"


def test_an_identical_coarse_wall_is_perfectly_correlated(tmp_path: Path) -> None:
    """Without a difference in cost it may pay by chance of the clock; it stays within the budget."""
    said: list[PilotReport] = []
    with ThreadPoolExecutor(2) as executor:
        found, again = (
            run_two_level(
                settings({"movement": {"increments": 3}}),
                1,
                5e-3,
                tmp_path / "two",
                pilot=12,
                budget=16,
                executor=executor,
                on_pilot=said.append,
            )
            for _ in range(2)
        )
    assert found == again
    assert said[0] == said[1] == found.pilot
    assert found.fine + found.coarse * found.pilot.cost_ratio < 16 + 2 * 8 + 8
    one, other = (open_study(tmp_path / "two" / name) for name in ("pilot_fine.dp", "pilot_coarse.dp"))
    np.testing.assert_array_equal(one["crack_width_max"], other["crack_width_max"])
    counted = open_study(tmp_path / "two" / "fine.dp")
    assert not set(counted["joint.friction"].values) & set(one["joint.friction"].values)


def test_failed_walls_bound_the_probability(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def every_fourth_fails(settings: StudySettings, design: Design, sample: int, values: dict[str, float]) -> Solved:
        found = solve(settings, design, sample, values)
        if sample % 4 or settings.study.fields_from is not None:
            return found
        return Solved(Outcome(sample, SampleStatus.FAILED, 0.01, "injected"), "error", None)

    solve = sample.solve_sample
    monkeypatch.setattr(sample, "solve_sample", every_fourth_fails)
    with ThreadPoolExecutor(1) as executor:
        found = run_two_level(
            settings({"movement": {"increments": 2}}), 1, 5e-3, tmp_path / "two", pilot=12, budget=16, executor=executor
        )
    assert found.failed == found.fine / 4
    assert found.failed_damaged.value == pytest.approx(
        found.failed_undamaged.value + 0.25, abs=0.15 if found.coarse else 1e-9
    )


def test_an_interrupted_run_is_resumed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Campaign, "run", lambda *given, **more: RunSummary(tmp_path, 12, 3, 0, True, 1.0))
    with pytest.raises(KeyboardInterrupt):
        run_two_level(settings(LARGER), 1, 5e-3, tmp_path / "two", pilot=12)


def test_invalid_requests_are_refused(tmp_path: Path) -> None:
    for given, message in (
        ({"category": 7}, "category = 7"),
        ({"at": -1.0}, "greater than 0"),
        ({"pilot": 3}, "pilot = 3"),
        ({"budget": -5.0}, "budget = -5"),
        ({"budget": np.nan}, "budget = nan"),
    ):
        with pytest.raises(InputError, match=message):
            run_two_level(settings(LARGER), **{"category": 1, "at": 5e-3, "out": tmp_path / "two", **given})  # type: ignore[arg-type]


def test_a_study_without_a_coarse_wall_is_refused_with_advice(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"study.coarse\]: say in which"):
        levels(settings({}))
    # said when the study is read, whatever it is read for
    with pytest.raises(InputError, match="block_lenth"):
        settings({"wall": {"block_lenth": 0.48}})
    with pytest.raises(InputError, match=r"block_length = -0.48: must be at least 0.001 m"):
        settings({"wall": {"block_length": -0.48}})
