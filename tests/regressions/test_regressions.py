"""No commit makes slow what was fast: times as ratios to fixed work, against a baseline. See README.md here."""

from collections.abc import Callable

import pytest

from tests.regressions.cases import GATE, Case
from tests.regressions.measure import processor


def name(case: Case) -> str:
    return case.name


@pytest.mark.benchmark(group="regressions", timer=processor)
@pytest.mark.parametrize("case", GATE, ids=name)
def test_is_no_slower(case: Case, is_no_slower: Callable[[Case], None]) -> None:
    is_no_slower(case)
