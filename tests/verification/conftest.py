"""The fixture ``verify``, and the option ``--manual PATH`` that writes the page; see ``manual``."""

from collections.abc import Iterator
from pathlib import Path

import pytest

import damagepred
from damagepred import Assembly, Solver
from damagepred.assembly.assembly import rectangle
from damagepred.solvers.explicit.scheme import DampedTimeStepping
from tests.verification.manual import Manual, Verify

MANUAL = pytest.StashKey[Manual]()
HERE = Path(__file__).parent

SOLVERS = {m: Solver(method=m, lump_block_elasticity=False, tolerance=1e-6) for m in ("explicit", "quasi_static")}
"""Rigid blocks on joints that alone are elastic."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--manual", metavar="PATH", default=None, help="write the verification manual to this file")


def pytest_configure(config: pytest.Config) -> None:
    config.stash[MANUAL] = Manual()


@pytest.hookimpl(trylast=True)
def pytest_deselected(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.is_relative_to(HERE):
            item.config.stash[MANUAL].left_out += 1


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    report = yield
    if report.failed and item.path.is_relative_to(HERE):
        item.config.stash[MANUAL].failed.append(_name(item))
    return report


def pytest_sessionfinish(session: pytest.Session) -> None:
    path = session.config.getoption("--manual", default=None)
    if path is not None:
        Path(path).write_text(session.config.stash[MANUAL].page(), encoding="utf-8")


def _name(item: pytest.Item) -> str:
    return f"{item.path.name}::{getattr(item, 'originalname', item.name)}"


@pytest.fixture(scope="session")
def compiled() -> None:
    """Compile or load what the solvers need, so that no case pays for it."""
    for solver in SOLVERS.values():
        pair = Assembly()
        pair.rest_on_ground([pair.add_block(rectangle(0.0, 0.0, 0.24, 0.1))])
        damagepred.solve(pair, solver=solver, increments=1)


@pytest.fixture
def verify(request: pytest.FixtureRequest, compiled: None) -> Verify:
    """Compare with a closed form, assert, and keep the case for the manual; see ``manual.Verify``."""
    return Verify(request.config.stash[MANUAL].cases, _name(request.node))


@pytest.fixture(params=SOLVERS)
def solver(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Solver:
    """Each solver in turn; the explicit one without its elastic start, which would spare it all time stepping."""
    monkeypatch.setattr(DampedTimeStepping, "start_from_elastic_solution", lambda self: False)
    return SOLVERS[request.param]
