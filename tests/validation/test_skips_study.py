"""studies/benchmarks/skips: the answer stays."""

import pytest

from studies.benchmarks.skips import run

pytestmark = pytest.mark.thorough


@pytest.mark.parametrize("name", ["condense", "half", "correct", "elastic start"])
def test_the_answer_is_the_same_without_a_skip(name: str) -> None:
    walls = run.SKIPS[name]["walls"]
    row = run.measure(name, "no dpc" if "no dpc" in walls else walls[0], 1, True)
    assert row["end_on"] == row["end_off"] == "complete"
    # by cycles, dead load comes on in another way, which friction in a bare dpc remembers
    assert max(row["upwards"], row["sideways"]) < (2e-2 if name == "elastic start" else 2e-3)
    assert name != "elastic start" or row["steps_off"] > row["steps_on"]


def test_a_study_that_stops_or_shares_takes_less_time() -> None:
    stopped, shared = (run.measure(name, "sampled window walls", 1, True) for name in ("stop", "shared"))
    assert stopped["steps_on"] <= stopped["steps_off"]
    assert stopped["upwards"] == 0.0
    assert shared["seconds_on"] < shared["seconds_off"]
