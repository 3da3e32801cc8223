"""Rare categories of a study: independent of the way they are run, and in agreement with random sampling."""

import json
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import special

from damagepred.analyses import limit_state as capacity
from damagepred.analyses import rare_event_samples as rare_walls
from damagepred.analyses.limit_state import NOTHING_KNOWN, Margin, Question, margin, study_for_limit_state
from damagepred.analyses.rare_event import rare_event
from damagepred.analyses.rare_event_samples import normals_to_wall
from damagepred.campaign.settings import StudySettings
from damagepred.cli.sentences import rare_lines
from damagepred.errors import ConvergenceError, InputError, StudyError
from damagepred.one_wall.judged_path import model_of
from damagepred.scene import Scene
from damagepred.study import Study
from tests.conftest import SMALL_STUDY

TINY = SMALL_STUDY.replace("length = 1.44", "length = 0.96").replace("increments = 6", "increments = 3")
ASKED = Question(category=2, at=4e-3)


def settings(text: str = TINY) -> StudySettings:
    return StudySettings.from_dict(tomllib.loads(text))


def test_the_movement_is_the_requested_one() -> None:
    asked = study_for_limit_state(settings(), Question(1, 2e-3, reach=1.5))
    assert "movement.central_deflection" not in asked.variables
    assert asked.scene.movement.central_deflection == pytest.approx(2e-3 * 4 / 3)
    assert asked.scene.movement.increments == 4  # the second last but one is at 2 mm


def test_a_margin_is_negative_where_the_category_is_reached() -> None:
    """Against the categories of the same wall, increment by increment."""
    import damagepred

    asked = study_for_limit_state(settings(), ASKED)
    design = asked.design()
    normals = np.random.default_rng(3).standard_normal((6, len(design.wall) + 2 * _joints(asked)))
    for row in normals:
        scene, fields = normals_to_wall(asked, design, row)
        wall = damagepred.solve(scene, fields=fields)
        reached = wall["central_deflection"].values[wall["damage_category"].values >= 1]
        found = margin(scene, fields, Question(1, 4e-3)).most
        first = reached[0] if reached.size else np.inf
        step = 4e-3 / 3
        if np.isfinite(first):
            assert first - step <= (found + 1) * 4e-3 <= first * (1 + 1e-12)
        else:
            assert found > 1


@pytest.mark.parametrize("measure", ["joint", "band"])
@pytest.mark.parametrize(
    ("widths", "expected"),
    [
        # category 2 begins at 1 mm: half way from 0.4 to 1.6 mm, between 8/3 and 4 mm of 4 mm asked for
        ((0.2, 0.4, 1.6, 3.0, 4.0, 4.5), (10 / 3) / 4 - 1),
        ((0.0, 0.0, 0.1, 0.4, 0.7, 1.3), (20 / 3 + 4 / 6) / 4 - 1),
        ((0.0, 0.1, 0.2, 0.3, 0.4, 0.5), 8 / 4 - 1 + 0.5),  # followed to 8 mm, as wide as half the limit
    ],
)
def test_a_margin_lies_where_the_width_passes_the_limit(widths, expected, measure, monkeypatch) -> None:
    asked = study_for_limit_state(settings(f'{TINY}\n[scene.damage]\nmeasure = "{measure}"\n'), ASKED)
    scene, fields = normals_to_wall(asked, asked.design(), np.zeros(len(asked.design().wall) + 2 * _joints(asked)))

    def made_up(*given: object) -> Iterator[object]:
        for k, width in enumerate((0.0, *widths)):
            joint, band = (width, 9.0) if measure == "joint" else (0.0, width)
            verdict = SimpleNamespace(
                crack_width_max=joint * 1e-3,
                crack_band_width_max=band * 1e-3,
                footing_opening_max=0.02,
                damage_category=2 if width >= 1.0 else 0,
            )
            yield model, SimpleNamespace(increment=SimpleNamespace(load_factor=k / 6, number=k), verdict=verdict)

    model = model_of(scene, fields)
    monkeypatch.setattr(capacity, "follow_scene", made_up)
    assert margin(scene, fields, ASKED).least == pytest.approx(expected)


def _joints(asked: StudySettings) -> int:
    from damagepred.campaign.sample import joint_places

    return len(joint_places(asked.scene).x)


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


@pytest.mark.parametrize(("steps", "known"), [(0, None), (2, None), (3, "not by 4 mm"), (5, "not by 4 mm")])
def test_a_failed_wall_is_known_up_to_its_failure(steps: int, known: str | None, monkeypatch: pytest.MonkeyPatch):
    asked = study_for_limit_state(settings(), Question(4, 4e-3))
    scene, fields = normals_to_wall(asked, asked.design(), np.zeros(len(asked.design().wall) + 2 * _joints(asked)))
    whole = margin(scene, fields, Question(4, 4e-3))
    assert whole.least == whole.most > 0  # category 4 is far off
    follow = capacity.follow_scene

    def breaks_off(*given: object) -> Iterator[object]:
        for k, step in enumerate(follow(*given)):
            if k > steps:
                raise ConvergenceError("no equilibrium")
            yield step

    monkeypatch.setattr(capacity, "follow_scene", breaks_off)
    found = margin(scene, fields, Question(4, 4e-3))
    if known:
        assert found.least == found.most > 0
    else:
        assert found.least == pytest.approx(steps / 3 - 1)  # three increments to 4 mm
        assert found.most == np.inf
        assert "no equilibrium" in found.why


FRICTION_ONLY = (
    TINY[: TINY.index("[variables")]
    + """
[variables]
"joint.friction" = { distribution = "normal", mean = 1.0, std = 0.1 }
"joint.tensile_strength" = { distribution = "normal", mean = 0.1e6, std = 0.01e6 }
"""
)


def injected(scene: Scene, fields: object, question: Question) -> Margin:
    """A known answer: reached if friction is 3 deviations low, unknown if strength is 2 deviations high."""
    z = (scene.joint.friction - 1.0) / 0.1, (scene.joint.tensile_strength - 0.1e6) / 0.01e6
    return NOTHING_KNOWN._replace(why="injected") if z[1] > 2.0 else Margin(z[0] + 3.0, z[0] + 3.0)


@pytest.mark.thorough
def test_failed_walls_bound_the_probability(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rare_walls, "margin", injected)
    lower, upper = special.ndtr(-3.0) * special.ndtr(2.0), special.ndtr(-3.0) * special.ndtr(2.0) + special.ndtr(-2.0)
    low, high, inside = [], [], 0
    with ThreadPoolExecutor(1) as executor:
        for seed in range(5):
            asked = settings(FRICTION_ONLY.replace("seed = 7", f"seed = {seed}"))
            found = rare_event(asked, ASKED, tmp_path / str(seed), samples=200, executor=executor)
            low.append(found.estimate.probability)
            high.append(found.failed_damaged.probability)
            inside += found.interval[0] <= lower and upper <= found.interval[1]
            assert found.failed > 0
            assert "failed before 4 mm" in "\n".join(rare_lines(found, ASKED))
        again = rare_event(asked, ASKED, tmp_path / "4", samples=200, executor=executor)
    for values, exact in ((low, lower), (high, upper)):
        assert abs(np.mean(values) - exact) < 3.5 * np.std(values, ddof=1) / np.sqrt(5)
    assert inside >= 3  # each end holds with 95 %, here of very few walls
    # nothing is solved twice: the first level is shared, and a second call solves nothing
    assert again.solved_now == 0
    assert again.interval == found.interval
    assert found.solved_now <= found.estimate.evaluations + found.failed_damaged.evaluations - 200
    lines = (tmp_path / "4" / "walls.jsonl").read_text()
    old = "".join(json.dumps(json.loads(line)[:4]) + "\n" for line in lines.splitlines())
    (tmp_path / "4" / "walls.jsonl").write_text(old)  # as earlier versions wrote it
    with ThreadPoolExecutor(1) as executor:
        assert rare_event(asked, ASKED, tmp_path / "4", samples=200, executor=executor).interval == found.interval


def test_invalid_requests_are_refused(tmp_path: Path) -> None:
    study = Study(settings())
    for category, at, message in ((9, 4e-3, "category = 9"), (1, 0.0, "greater than 0")):
        with pytest.raises(InputError, match=message):
            study.rare(category, at, tmp_path / "r")
    with pytest.raises(InputError, match="reach"):
        study.rare(1, 4e-3, tmp_path / "r", reach=0.5)
    for given in ({"level_share": 0.3}, {"level_share": np.nan}, {"samples": -5}, {"workers": 0}, {"timeout": -1}):
        with pytest.raises(InputError, match="must be"):
            study.rare(1, 4e-3, tmp_path / "r", **given)
    assert not (tmp_path / "r").exists()  # in a folder made for a wrong question no other could be asked
