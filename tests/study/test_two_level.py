"""A coarse wall beside each sampled one: the same sample, nearest joints, and used only where it pays."""

import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from damagepred.assembly import wall_geometry
from damagepred.errors import InputError
from damagepred.study import Study, open_study
from damagepred.study.settings import StudySettings
from damagepred.study.two_level import levels, run_two_level
from tests.conftest import SMALL_STUDY

TINY = SMALL_STUDY.replace("length = 1.44", "length = 0.96").replace("increments = 6", "increments = 3")


def settings(coarse: dict[str, dict[str, object]]) -> StudySettings:
    tables = tomllib.loads(TINY)
    tables["study"]["coarse"] = coarse
    return StudySettings.from_dict(tables)


LARGER = {"wall": {"block_length": 0.48, "block_height": 0.15}}


def test_both_walls_are_of_the_same_sample() -> None:
    fine, coarse = (Study(level) for level in levels(settings(LARGER)))
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


def test_a_coarse_wall_that_is_the_same_tells_all(tmp_path: Path) -> None:
    """Without a difference in cost it does not pay, however well it is correlated; fewer increments say as much."""
    with ThreadPoolExecutor(2) as executor:
        found = run_two_level(
            settings({"movement": {"increments": 3}}), 1, 5e-3, tmp_path / "two", pilot=12, executor=executor
        )
        again = run_two_level(
            settings({"movement": {"increments": 3}}), 1, 5e-3, tmp_path / "two", pilot=12, executor=executor
        )
    assert found == again or np.isnan(found.estimate.value)
    assert found.fine == 12
    one, other = (open_study(tmp_path / "two" / name) for name in ("fine.dp", "coarse.dp"))
    np.testing.assert_array_equal(one["crack_width_max"], other["crack_width_max"])


def test_a_study_without_a_coarse_wall_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"study.coarse\]: say in which"):
        levels(settings({}))
    with pytest.raises(InputError, match="block_lenth"):
        levels(settings({"wall": {"block_lenth": 0.48}}))
