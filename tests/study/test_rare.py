"""Rare categories of a study: the same however they are run, and what random sampling finds where it can."""

import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from damagepred.errors import InputError, StudyError
from damagepred.study import Study
from damagepred.study.capacity import Question, asked_of, margin
from damagepred.study.rare import normals_to_wall, rare_event
from damagepred.study.settings import StudySettings
from tests.conftest import SMALL_STUDY

TINY = SMALL_STUDY.replace("length = 1.44", "length = 0.96").replace("increments = 6", "increments = 3")
ASKED = Question(category=2, at=4e-3)


def settings(text: str = TINY) -> StudySettings:
    return StudySettings.from_dict(tomllib.loads(text))


def test_the_movement_is_the_one_asked_for() -> None:
    asked = asked_of(settings(), Question(1, 2e-3, reach=1.5))
    assert "movement.central_deflection" not in asked.variables
    assert asked.scene.movement.central_deflection == pytest.approx(2e-3 * 4 / 3)
    assert asked.scene.movement.increments == 4  # the second last but one is at 2 mm


def test_a_margin_is_negative_where_the_category_is_reached() -> None:
    """Against the categories of the same wall, increment by increment."""
    import damagepred

    asked = asked_of(settings(), ASKED)
    design = asked.design()
    normals = np.random.default_rng(3).standard_normal((6, len(design.wall) + 2 * _joints(asked)))
    for row in normals:
        scene, fields = normals_to_wall(asked, design, row)
        wall = damagepred.solve(scene, fields=fields)
        reached = wall["central_deflection"].values[wall["damage_category"].values >= 1]
        found = margin(scene, fields, Question(1, 4e-3))
        first = reached[0] if reached.size else np.inf
        step = 4e-3 / 3
        if np.isfinite(first):
            assert first - step <= (found + 1) * 4e-3 <= first * (1 + 1e-12)
        else:
            assert found > 1


def _joints(asked: StudySettings) -> int:
    from damagepred.study.sample import joint_sequence

    return len(joint_sequence(asked.scene))


def test_interrupted_and_run_by_others_it_is_the_same(tmp_path: Path) -> None:
    with ThreadPoolExecutor(2) as executor:
        whole = rare_event(settings(), ASKED, tmp_path / "a", samples=50, executor=executor)
        log = tmp_path / "a" / "walls.jsonl"
        lines = log.read_text().splitlines(keepends=True)
        assert len(lines) == whole.solved_now == whole.estimate.evaluations
        log.write_text("".join(lines[:20]) + lines[20][:9])  # killed in the middle of a line
        again = rare_event(settings(), ASKED, tmp_path / "a", samples=50, executor=executor)
        assert again.solved_now == whole.solved_now - 20
        with pytest.raises(StudyError, match=r"category \(was 2, is 3\)"):
            rare_event(settings(), Question(3, 4e-3), tmp_path / "a", samples=50, executor=executor)
        with pytest.raises(StudyError, match="the study"):
            rare_event(settings(TINY.replace("0.75", "0.7")), ASKED, tmp_path / "a", samples=50, executor=executor)
    assert again.estimate.probability == whole.estimate.probability
    np.testing.assert_array_equal(again.estimate.samples, whole.estimate.samples)
    assert log.read_text().splitlines(keepends=True)[:20] == lines[:20]


@pytest.mark.slow
def test_worker_processes_give_the_same(tmp_path: Path) -> None:
    with ThreadPoolExecutor(1) as executor:
        one = rare_event(settings(), ASKED, tmp_path / "a", samples=50, executor=executor)
    two = rare_event(settings(), ASKED, tmp_path / "b", samples=50, workers=2)
    np.testing.assert_array_equal(one.estimate.samples, two.estimate.samples)


def test_what_cannot_be_asked(tmp_path: Path) -> None:
    study = Study(settings())
    for category, at, message in ((9, 4e-3, "category = 9"), (1, 0.0, "greater than 0")):
        with pytest.raises(InputError, match=message):
            study.rare(category, at, tmp_path / "r")
    with pytest.raises(InputError, match="reach"):
        study.rare(1, 4e-3, tmp_path / "r", reach=0.5)
