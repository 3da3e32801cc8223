"""Small walls and studies that many tests share."""

import math
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from damagepred.analyses import design_search, portfolio, rare_event, rare_event_samples, stored_walls
from damagepred.campaign import campaign
from damagepred.cli import terminal

ROOT = Path(__file__).resolve().parents[1]

SMALL_STUDY = """
[study]
title = "small wall that cracks"
samples = 6
seed = 7
stop_at_category = 4
[scene]
joint = { tensile_strength = "0.1 MPa", cohesion = "0.1 MPa" }
loads = { roof = "2 kN" }
[scene.wall]
length = 1.44
height = 0.45
[scene.movement]
kind = "doming"
central_deflection = "6 mm"
increments = 6
[variables]
"joint.tensile_strength" = { distribution = "lognormal", mean = "0.1 MPa", cov = 0.3, field.course_correlation = 0.4 }
"joint.cohesion" = { distribution = "lognormal", mean = "0.1 MPa", cov = 0.35, field.course_correlation = 0.4 }
"joint.friction" = { distribution = "lognormal", mean = 0.75, cov = 0.15 }
[variables."movement.central_deflection"]
distribution = "uniform"
lower = "6 mm"
upper = "9 mm"
[correlation]
"joint.tensile_strength" = { "joint.cohesion" = 0.7 }
"""


SOLVED_IN_EXAMPLES = (
    *("assess_portfolio", "frame", "draw_back_analysis", "draw_design_search", "draw_portfolio"),
    *("save_animation", "save_wall_pictures", "search_design", "study.Study"),
)
"""Examples of docstrings that run a study for a second or more."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark as thorough the cases that `quick_cases` leaves out: each argument has its first value, or a named one."""
    for item in items:
        mark, case = item.get_closest_marker("quick_cases"), getattr(item, "callspec", None)
        if mark is not None and case is not None:
            for name, number in case.indices.items():
                quick = number == 0 if name not in mark.kwargs else case.params[name] in mark.kwargs[name]
                if not quick and name not in mark.args:
                    item.add_marker("thorough")
        elif isinstance(item, pytest.DoctestItem) and item.name.endswith(SOLVED_IN_EXAMPLES):
            item.add_marker("thorough")


@pytest.fixture(scope="session")
def data_folder() -> Path:
    return ROOT / "data"


@pytest.fixture
def small_study_file(tmp_path: Path) -> Path:
    file = tmp_path / "small.toml"
    file.write_text(SMALL_STUDY)
    return file


@pytest.fixture(autouse=True)
def _form_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give each test the form of the output that a new process has, and no words on silence, which take time alone."""
    monkeypatch.setattr(terminal, "FORM", terminal.Form())
    monkeypatch.setattr(terminal.Wait, "FIRST", math.inf)


class OneThread(ThreadPoolExecutor):
    """Pool of one thread of this process, in place of worker processes, which take seconds to start."""

    processes = ()

    def __init__(self, *_: Any, **__: Any) -> None:
        super().__init__(1)

    def terminate(self) -> None:
        self.shutdown(cancel_futures=True)


def _no_compilation(*_: Any, **__: Any) -> None:
    """Nothing is compiled for workers in a thread."""


IN_A_THREAD = [
    (module, "LocalPool", OneThread) for module in (campaign, design_search, portfolio, rare_event, stored_walls)
]
IN_A_THREAD += [(module, "warm_up", _no_compilation) for module in (campaign, rare_event_samples)]
IN_PROCESSES = [(module, name, getattr(module, name)) for module, name, _ in IN_A_THREAD]


@pytest.fixture(scope="session", autouse=True)
def _walls_in_this_process() -> Iterator[None]:
    """Solve the walls of studies in a thread; fixtures of modules do so, too."""
    with pytest.MonkeyPatch.context() as patch:
        for module, name, value in IN_A_THREAD:
            patch.setattr(module, name, value)
        yield


@pytest.fixture(autouse=True)
def _worker_processes(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Start worker processes in the tests that are marked."""
    if request.node.get_closest_marker("worker_processes"):
        for module, name, value in IN_PROCESSES:
            monkeypatch.setattr(module, name, value)
