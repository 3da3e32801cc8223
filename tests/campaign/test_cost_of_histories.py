"""Price of a study: one wall is timed and scaled, of histories several, as samples move differently."""

from pathlib import Path

import numpy as np
import pytest

from damagepred.campaign import cost_estimate
from damagepred.campaign.cost_estimate import estimate_cost
from damagepred.cli.sentences import cost_lines

WALL = "[study]\nsamples = 3\n[scene.wall]\nlength = 1.44\nheight = 0.6\n"
SEASONS = "[scene.movement.seasons]\nyears = 1\nswing = '6 mm'\nincrements = 1\n"
SCATTER = "[variables.'joint.friction']\ndistribution = 'uniform'\nlower = 0.6\nupper = 0.8\n"


def test_walls_of_histories_are_timed_one_after_the_other(tmp_path: Path) -> None:
    (tmp_path / "years.toml").write_text(WALL + SEASONS + SCATTER)
    seen = []
    found = estimate_cost(tmp_path / "years.toml", on_step=lambda step: seen.append(step.increment.number))
    assert seen == [0, 1, 2] * 3  # as many as the study has
    assert found.wall_seconds == pytest.approx(np.mean(found.timed))
    assert "on average of 3 walls, " in cost_lines(found)[3]
    assert "3 walls with 1 uncertain numbers" in "".join(cost_lines(found))
    assert len(estimate_cost(tmp_path / "years.toml", history_walls=2).timed) == 2


def test_timing_ends_with_its_limit_and_other_movements_take_one_wall(tmp_path: Path) -> None:
    (tmp_path / "years.toml").write_text(WALL + SEASONS + SCATTER)
    assert len(estimate_cost(tmp_path / "years.toml", timing_limit=0.0).timed) == 1
    (tmp_path / "once.toml").write_text(WALL + SCATTER)
    found = estimate_cost(tmp_path / "once.toml")
    assert len(found.timed) == 1
    assert "on average" not in cost_lines(found)[3]


@pytest.mark.parametrize(("timed", "expected"), [((1.4, 0.2), 0.2), ((6.0, 1.5), 1.5), ((25.0,), 25.0)])
def test_libraries_loaded_by_the_first_wall_do_not_count(
    timed: tuple[float, ...], expected: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A short wall is timed twice, a long one once."""
    times = iter(timed)
    monkeypatch.setattr(cost_estimate, "_timed", lambda *_: (next(times), "complete", ()))
    (tmp_path / "once.toml").write_text(WALL + SCATTER)
    assert estimate_cost(tmp_path / "once.toml").wall_seconds == expected
    assert not list(times)
