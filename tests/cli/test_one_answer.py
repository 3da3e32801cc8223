"""One question, one number: commands and pages agree on a study whose walls end at their own movement, some failed."""

import json
from pathlib import Path

import numpy as np
import pytest

from damagepred.analyses.design_search import damaged
from damagepred.archive.folder import open_study
from damagepred.report.summary import answers
from damagepred.uq.exceedance import exceedance
from damagepred.uq.fragility import fit_fragility
from damagepred.uq.fragility.describe import probability_at
from damagepred.uq.stopping import StopWhen
from tests.cli.conftest import Run
from tests.synthetic_studies import synthetic_study


@pytest.fixture(scope="module")
def houses(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    place = tmp_path_factory.mktemp("houses")
    medians = {"weak": (2e-3, 4e-3), "strong": (4e-3, 8e-3)}
    return [synthetic_study(place / f"{name}.dp", 40, medians=m, failed=(3, 17)) for name, m in medians.items()]


def result(command: Run, *arguments: object) -> dict:
    said = command(*arguments, "--json")
    assert said.code == 0, said.err
    return json.loads(said.out)


@pytest.mark.quick_cases
@pytest.mark.parametrize("category", [1, 2])
@pytest.mark.parametrize("at", ["3 mm", "site", None])
def test_commands_and_pages_agree(command: Run, houses: list[Path], category: int, at: str | None) -> None:
    asked = () if at is None else ("--at", at)
    compared = result(command, "compare", *houses, "--category", category, *asked)
    for place, house in enumerate(houses):
        estimated = result(command, "estimate", house, "--category", category, *asked)["alternatives"][0]["found"]
        ds = open_study(house)
        one = exceedance(ds, category, at or "site")
        assert estimated["estimate"]["value"] == pytest.approx(one.estimate.value)
        for name, key in (("probability", "value"), ("probability_lower", "lower"), ("probability_upper", "upper")):
            value = np.array(compared["data_vars"][name]["data"])[place, 0, 0]
            assert value == pytest.approx(estimated["estimate"][key])
        assert estimated["failed_undamaged"] <= estimated["estimate"]["value"] <= estimated["failed_damaged"]
        if at == "3 mm":
            rule = StopWhen(category=category, at="3 mm", half_width=0.1)
            assert rule.estimate(ds, 0.9) == one.estimate
            assert damaged(ds, category, at, 0.0).mean() <= one.estimate.value <= damaged(ds, category, at).mean()
        else:  # the end of each wall's own movement: also the status, and the report by default
            row = result(command, "status", house)["categories"][category]
            said, found = answers(ds)
            assert said.startswith("At the end of each wall's own movement")
            same = found[category].estimate
            assert (row["or_worse"], row["lower"], row["upper"]) == pytest.approx(same[:1] + same[2:4])
            assert same == one.estimate
            assert (row["failed_undamaged"], row["failed_damaged"]) == pytest.approx(one[2:4])
    first, second = np.array(compared["data_vars"]["probability"]["data"])[:, 0, 0]
    assert np.array(compared["data_vars"]["difference"]["data"])[1, 0, 0] == pytest.approx(second - first)


def test_a_curve_is_read_in_one_way(houses: list[Path]) -> None:
    ds = open_study(houses[0])
    alone = ds.isel(increment=-1)
    curves = fit_fragility(alone, categories=[2], bootstrap=500)
    one = exceedance(alone, 2, 5e-3)
    assert probability_at(curves, 2, 5e-3) == pytest.approx(
        (one.estimate.value, one.estimate.lower, one.estimate.upper)
    )


def test_a_study_without_a_ground_of_its_own_asks_for_a_movement(command: Run, tmp_path: Path) -> None:
    own = synthetic_study(tmp_path / "own.dp", 12)
    said = command("estimate", own, "--category", 1)
    assert said.out.startswith("At the end of each wall's own movement, a central deflection of ")
    assert "\nCategory 1 or worse at the end of each wall's own movement: probability " in said.out
    alike = synthetic_study(tmp_path / "alike.dp", 12, own_movements=False)
    for arguments in (("estimate", alike), ("compare", own, alike), ("report", alike, "--no-replay")):
        more = ("--at", "site") if arguments[0] == "report" else ("--category", 1)
        said = command(*arguments, *more)
        assert said.code == (0 if arguments[0] == "compare" else 2)
        assert arguments[0] == "compare" or 'no ground of their own; give a movement, such as "6 mm".' in said.err


def test_before_the_first_wall_commands_say_so(command: Run, tmp_path: Path) -> None:
    empty = synthetic_study(tmp_path / "empty.dp", 4, missing=range(4))
    said = command("status", empty)
    assert said.out.splitlines()[0].endswith(": 0 of 4 walls done, 0 failed, 4 remaining")
    assert "no wall is done yet: a run first compiles its kernels" in said.out
    assert "category" not in said.out
    for arguments in (("estimate", empty), ("sensitivity", empty), ("compare", empty, empty.parent / "other.dp")):
        synthetic_study(tmp_path / "other.dp", 4, missing=range(4)) if arguments[0] == "compare" else None
        said = command(*arguments, *(("--category", 1) if arguments[0] == "compare" else ()))
        assert (said.code, "the study has no finished sample yet; run `damagepred study` first." in said.err) == (
            2,
            True,
        )
