"""No commit makes slow what was fast: times as ratios to fixed work, against a baseline. See README.md here."""

from collections.abc import Callable

import pytest

from tests.regressions.cases import GATE, LONG, Case


def name(case: Case) -> str:
    return case.name


@pytest.mark.parametrize("case", GATE, ids=name)
def test_is_no_slower(case: Case, is_no_slower: Callable[[Case], None]) -> None:
    is_no_slower(case)


@pytest.mark.benchmark
@pytest.mark.parametrize("case", LONG, ids=name)
def test_is_no_slower_at_full_size(case: Case, is_no_slower: Callable[[Case], None]) -> None:
    is_no_slower(case)
