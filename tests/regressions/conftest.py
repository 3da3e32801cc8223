"""The comparison with the baseline, ``--renew-baseline``, and the table of ratios at the end of a run."""

import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import pytest

from damagepred.one_thread import one_blas_thread
from studies.benchmarks.pages import machine, markdown, put_in
from tests.regressions.cases import GATE, LONG, Case
from tests.regressions.measure import PAUSE, Rounds, processor, slow
from tests.regressions.yardsticks import yardstick

HERE = Path(__file__).parent
BASELINE = HERE / "baseline.json"
PAGE = HERE / "README.md"
COMMAND = 'python -m pytest tests/regressions -m "benchmark or not benchmark" --renew-baseline'
WITH_CARE = 4
"""Times that all is measured again when the baseline is renewed."""

ENOUGH = 8.0
"""Seconds of a case after which it is not measured again for that."""

FASTER = 0.7
"""Times the baseline's ratio from which a new baseline is due, or what was won may be lost again unseen."""


class Found(NamedTuple):
    """What was measured of a case."""

    case: Case
    rounds: Rounds
    count: float


def kept() -> dict[str, dict[str, Any]]:
    """Return the baseline, by name of the case."""
    return json.loads(BASELINE.read_text(encoding="utf-8"))["cases"] if BASELINE.exists() else {}


class Record:
    """What this run measured, and the baseline it is compared with."""

    def __init__(self, renew: bool) -> None:
        self.renew = renew
        self.found: list[Found] = []
        self.baseline = kept()

    def table(self) -> pd.DataFrame:
        """Return a row for each case."""
        rows = []
        for case, rounds, count in self.found:
            known = self.baseline.get(case.name, {}).get("ratio", float("nan"))
            rows.append(
                {
                    "case": case.name, "time": min(rounds.case) / count, "unit": case.unit, "ratio": rounds.ratio,
                    "baseline": known, "over baseline": rounds.ratio / known, "bound": case.bound,
                    "rounds": len(rounds.case),
                }
            )  # fmt: skip
        return pd.DataFrame(rows)

    def save(self) -> None:
        """Write the baseline, and the page; what was not measured stays."""
        measured = {
            case.name: {
                "unit": case.unit,
                "time": float(f"{min(rounds.case) / count:.3g}"),
                "yardstick": " + ".join(f"{n} {kind}" for kind, n in case.beside.items()),
                "ratio": float(f"{rounds.ratio:.3g}"),
            }
            for case, rounds, count in self.found
        }
        both = kept() | measured
        self.baseline = {case.name: both[case.name] for case in (*GATE, *LONG) if case.name in both}
        text = json.dumps({"machine": machine(), "renewed by": COMMAND, "cases": self.baseline}, indent=2)
        BASELINE.write_text(text + "\n", encoding="utf-8")
        bounds = {case.name: case.bound for case in (*GATE, *LONG)}
        rows = [{"case": name, **known, "bound": bounds[name]} for name, known in self.baseline.items()]
        put_in(PAGE, f"{machine()}.\n\n{markdown(pd.DataFrame(rows))}")


RECORD = pytest.StashKey[Record]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--renew-baseline", action="store_true", help="measure with care and write the baseline anew")


def pytest_configure(config: pytest.Config) -> None:
    config.stash[RECORD] = Record(config.getoption("--renew-baseline", default=False))


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    """Time one thread, of the yardsticks', too: two take more time of processor for the same work."""
    with one_blas_thread():
        yield


@pytest.fixture
def is_no_slower(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[[Case], None]:
    """Return what measures a case, and fails where it takes longer than its bound allows."""
    record = request.config.stash[RECORD]
    # not marked so in the file: there, the mark would take it out of the default run
    request.node.add_marker(pytest.mark.benchmark(group="regressions", timer=processor))
    benchmark: Any = request.getfixturevalue("benchmark")

    def check(case: Case) -> None:
        if not benchmark.enabled:
            pytest.skip("times are not measured beside other tests: python -m pytest tests/regressions")
        work, count = case.prepare(tmp_path)
        beside = yardstick(case.beside)
        found = Rounds()
        work()  # compiles
        benchmark.pedantic(work, setup=found.with_yardstick(beside), rounds=case.rounds)
        found.case += benchmark.stats.stats.data
        record.found.append(Found(case, found, count))
        if record.renew:
            for _ in range(WITH_CARE):
                if sum(found.case) > ENOUGH:
                    break
                time.sleep(PAUSE)
                found.add(work, beside, case.rounds)
            record.save()
            return
        assert case.name in record.baseline, f"{case.name} has no baseline: {COMMAND}"
        known = record.baseline[case.name]["ratio"]
        was_slow = slow(found, work, beside, case.rounds, case.bound * known)
        benchmark.extra_info.update(ratio=found.ratio, baseline=known, bound=case.bound)
        assert not was_slow, (
            f"{case.name}: {found.ratio:.3g} times its yardstick, {found.ratio / known:.3g} times the baseline "
            f"({len(found.case)} rounds), of {case.bound:g} that are allowed. If it is worth its price: {COMMAND}"
        )

    return check


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    record = config.stash[RECORD]
    if record.found:
        terminalreporter.section("ratios to fixed work of the same run")
        table = record.table()
        terminalreporter.write_line(table.to_string(index=False, float_format=lambda value: f"{value:.3g}"))
        faster = table["case"][table["over baseline"] < FASTER].tolist()
        if faster:
            terminalreporter.write_line(f"faster than it was, for a commit to keep: {', '.join(faster)}: {COMMAND}")
