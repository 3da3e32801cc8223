"""The comparison with the baseline, ``--renew-baseline``, and the table of ratios at the end of a run."""

import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import pytest

from damagepred.runtime.one_thread import one_blas_thread
from studies.pages import machine, markdown, processor_model, put_in
from tests.regressions.cases import GATE, Case
from tests.regressions.measure import PAUSE, Rounds, slow
from tests.regressions.yardsticks import yardstick

HERE = Path(__file__).parent
BASELINE = HERE / "baseline.json"
PAGE = HERE / "README.md"
COMMAND = "python -m pytest tests/regressions --renew-baseline"
WITH_CARE = 4
"""Times that all is measured again when the baseline is renewed."""

ENOUGH = 8.0
"""Seconds of a case after which it is not measured again for that."""

OTHER_PROCESSOR = 2.0
"""Factor on the bound where the processor has no baseline: between two models, ratios differ that much."""

FASTER = 0.7
"""Share of the baseline's ratio below which a new baseline is due, so that later losses are detected."""


class Found(NamedTuple):
    case: Case
    rounds: Rounds
    count: float


def kept() -> dict[str, dict[str, Any]]:
    """Return the baselines, by model of the processor: the machine, and its cases by name."""
    return json.loads(BASELINE.read_text(encoding="utf-8"))["processors"] if BASELINE.exists() else {}


def reference(processors: dict[str, dict[str, Any]], model: str) -> tuple[dict[str, dict[str, Any]], float]:
    """Cases to compare a processor with, and the factor on their bounds; of others without a baseline."""
    if model in processors:
        return processors[model]["cases"], 1.0
    largest: dict[str, dict[str, Any]] = {}
    for one in processors.values():
        for name, case in one["cases"].items():
            if name not in largest or case["ratio"] > largest[name]["ratio"]:
                largest[name] = case
    return largest, OTHER_PROCESSOR


class Record:
    def __init__(self, renew: bool) -> None:
        self.renew = renew
        self.found: list[Found] = []
        self.baseline, self.factor = reference(kept(), processor_model())

    def table(self) -> pd.DataFrame:
        """Return a row for each case."""
        rows = []
        for case, rounds, count in self.found:
            known = self.baseline.get(case.name, {}).get("ratio", float("nan"))
            rows.append(
                {"case": case.name, "time": min(rounds.case) / count, "unit": case.unit, "ratio": rounds.ratio}
                | {"baseline": known, "over baseline": rounds.ratio / known, "bound": case.bound * self.factor}
                | {"rounds": len(rounds.case)}
            )
        return pd.DataFrame(rows)

    def save(self) -> None:
        """Write the baseline, and the page; cases that were not measured keep their values."""
        measured = {
            case.name: {
                "unit": case.unit,
                "time": float(f"{min(rounds.case) / count:.3g}"),
                "yardstick": " + ".join(f"{n} {kind}" for kind, n in case.beside.items()),
                "ratio": float(f"{rounds.ratio:.3g}"),
            }
            for case, rounds, count in self.found
        }
        processors, model = kept(), processor_model()
        both = processors.get(model, {"cases": {}})["cases"] | measured
        cases = {case.name: both[case.name] for case in GATE if case.name in both}
        processors[model] = {"machine": machine(), "cases": cases}
        text = json.dumps({"renewed by": COMMAND, "processors": processors}, indent=2)
        BASELINE.write_text(text + "\n", encoding="utf-8")
        bounds = {case.name: case.bound for case in GATE}
        parts = []
        for one in processors.values():
            rows = [{"case": name, **known, "bound": bounds[name]} for name, known in one["cases"].items()]
            parts.append(f"{one['machine']}.\n\n{markdown(pd.DataFrame(rows))}")
        put_in(PAGE, "\n\n".join(parts))


RECORD = pytest.StashKey[Record]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--renew-baseline", action="store_true", help="measure repeatedly and write a new baseline")


def pytest_configure(config: pytest.Config) -> None:
    config.stash[RECORD] = Record(config.getoption("--renew-baseline", default=False))


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    """Time one thread, also of the yardsticks: two take more processor time for the same work."""
    with one_blas_thread():
        yield


@pytest.fixture
def is_no_slower(request: pytest.FixtureRequest, benchmark: Any, tmp_path: Path) -> Callable[[Case], None]:
    """Return a function that measures a case, and fails where it takes longer than its bound."""
    record = request.config.stash[RECORD]

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
        bound = case.bound * record.factor
        was_slow = slow(found, work, beside, case.rounds, bound * known)
        benchmark.extra_info.update(ratio=found.ratio, baseline=known, bound=bound)
        assert not was_slow, (
            f"{case.name}: {found.ratio:.3g} times its yardstick, {found.ratio / known:.3g} times the baseline "
            f"({len(found.case)} rounds), of {bound:g} that are allowed. If the change is worth it: {COMMAND}"
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
