"""The manual: its comparisons, refusals, and page."""

import importlib
import re
import shlex
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.verification.manual import COMMAND, Case, ClosedForm, Manual, Verify

HERE = Path(__file__).parent

FORM = ClosedForm(title="Two and two", formula="2 + 2 = 4", source="Derived.", chapter="Elastic joints")
OTHER = ClosedForm(title="Three and | three", formula="3 + 3 = 6", source="Derived.", chapter="Dynamics", note="Odd.")


@pytest.fixture
def cases() -> list[Case]:
    return []


def test_the_page_has_chapters_in_order_and_all_cases(cases):
    verify = Verify(cases, "test_sums.py::test_sum")
    verify(OTHER, "apples", "quasi_static", "sum", 6.0, 6, 0.01)
    verify(FORM, "|x| < 1", "", "sum (m)", [4.0, 4.01], 4, 0.01)
    verify(FORM, "pears", "", "", True, True)
    page = Manual(cases, left_out=2).page()
    assert page.index("## Elastic joints") < page.index("### Two and two") < page.index("## Dynamics")
    assert "2 closed forms, 3 cases, 3 passed" in page
    assert "| - | \\|x\\| < 1 | sum (m), worst of 2 | 4.01 | 4 | 0.25 % | 1 % |" in page
    assert "| quasi-static | apples | sum | 6 | 6 | 0 % | 1 % |" in page
    assert "| pears |  | yes | yes | - | - |" in page
    assert "2 tests were left out" in page
    assert "(#three-and--three): 1 case, worst error 0 %" in page
    assert page == Manual(cases, left_out=2).page()


class Collected:
    def pytest_collection_finish(self, session: pytest.Session) -> None:
        self.count = len(session.items)


@pytest.mark.thorough
def test_the_readme_states_the_number_of_tests_and_of_closed_forms() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (row,) = re.findall(r"\*\*(\d+) tests\*\* of (\d+) closed forms .*\| `python -m pytest (.*)` \|", text)
    collected = Collected()
    pytest.main([*shlex.split(row[2]), "--collect-only", "-p", "no:xdist"], plugins=[collected])
    assert int(row[0]) == collected.count
    assert f"**{row[1]} closed forms, " in (HERE / "README.md").read_text(encoding="utf-8")


def test_the_page_in_the_repository_has_every_closed_form(request: pytest.FixtureRequest) -> None:
    if request.config.getoption("--manual", default=None) is not None:
        pytest.skip("the page is being written")
    titles = set()
    for file in HERE.glob("test_*.py"):
        module = importlib.import_module(f"tests.verification.{file.stem}")
        titles |= {v.title for v in vars(module).values() if isinstance(v, ClosedForm)}
    titles -= {FORM.title, OTHER.title}
    page = (HERE / "README.md").read_text(encoding="utf-8")
    there = {line.removeprefix("### ") for line in page.splitlines() if line.startswith("### ")}
    assert there == titles, f"write the page anew: {COMMAND}"
    assert "**Failed:**" not in page
    assert "**Not whole:**" not in page
