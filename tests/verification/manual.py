"""The verification manual: closed forms, the cases compared with them, and the page made of both.

A test states its closed form once and hands what was computed to the fixture ``verify``, which asserts the error and
keeps the case for the page::

    closed_form = chapter("Elastic joints")
    STACK = closed_form(
        title="Stack under its own weight",
        formula="u_i = W i (2n - i + 1) / (2 k_n A)",
        source="Derived: the joint below block i carries n - i + 1 blocks; sum over the joints below.",
    )

    def test_a_stack_settles(verify, solver):
        ...
        verify(STACK, "10 bricks", solver.method, "settlement (m)", found, expected, 1e-6)

The page is written by ``COMMAND``.
"""

import itertools
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib.metadata import version
from typing import Any

import numpy as np

from damagepred.arrays import FloatArray
from tests.verification.blocks import table as units

COMMAND = 'python -m pytest tests/verification -m "slow or not slow" --manual tests/verification/README.md'
"""Writes the page."""


ROUNDING = 1e-12
"""Relative errors below this are rounding."""

CHAPTERS = (
    "Elastic joints; Joints that open, break and slide; Limit analysis; Convergence; Vibration and time stepping; "
    "Dynamics; Zones; Footing and ground; Footing and fragility"
)
"""Order of the page; other chapters follow in the order of their tests."""


@dataclass(frozen=True)
class ClosedForm:
    """A result known without the program: formula as plain text, and where it comes from or how it is derived."""

    title: str
    formula: str
    source: str
    chapter: str
    note: str = ""


def chapter(name: str) -> Callable[..., ClosedForm]:
    return partial(ClosedForm, chapter=name)


@dataclass(frozen=True)
class Case:
    """One comparison: a verdict, or of `count` numbers the pair that differs most; the error is over the scale."""

    form: ClosedForm
    test: str
    case: str
    solver: str
    quantity: str
    computed: float | str
    exact: float | str
    count: int
    error: float
    allowed: float
    seconds: float

    @property
    def passed(self) -> bool:
        """Whether the error is allowed; NaN is not."""
        return bool(self.error <= self.allowed)

    def __str__(self) -> str:
        return (
            f"{self.form.title}, {self.case}, {self.solver}: {self.quantity} {_number(self.computed)}, exact "
            f"{_number(self.exact)}; error {self.error:.3g}, allowed {self.allowed:.3g}"
        )


class Verify:
    """What the fixture ``verify`` is: compares, keeps and asserts."""

    def __init__(self, cases: list[Case], test: str) -> None:
        self._cases, self._test = cases, test
        self._since = time.perf_counter()

    def __call__(
        self,
        form: ClosedForm,
        case: str,
        solver: str,
        quantity: str,
        computed: Any,
        exact: Any,
        tolerance: float = 0.0,
        scale: float | FloatArray | None = None,
    ) -> None:
        """Compare numbers, words or truths with the closed form; errors over the scale, or the largest exact value.

        `case` is size and material; `solver` what computed, or empty; `quantity` has its unit in brackets. The time of
        a case runs from the test's start, or from its last comparison, to the call.
        """
        now = time.perf_counter()
        pair = compare(computed, exact, scale)
        kept = Case(form, self._test, case, solver, quantity, *pair, allowed=tolerance, seconds=now - self._since)
        self._cases.append(kept)
        self._since = time.perf_counter()
        assert kept.passed, str(kept)


def compare(computed: Any, exact: Any, scale: float | FloatArray | None) -> tuple[float | str, float | str, int, float]:
    """Return the pair that differs most, the number of pairs, and the error."""
    if isinstance(exact, str | bool | np.bool_):
        words = tuple({True: "yes", False: "no"}[bool(v)] if not isinstance(v, str) else v for v in (computed, exact))
        return words[0], words[1], 1, 0.0 if words[0] == words[1] else np.inf
    found, known = np.broadcast_arrays(np.asarray(computed, dtype=float), np.asarray(exact, dtype=float))
    if found.size == 0:
        raise ValueError("nothing to compare")
    by = np.broadcast_to(np.abs(known).max() if scale is None else np.abs(scale), known.shape)
    if not (by > 0).all():
        raise ValueError("errors are measured by the largest exact value, which is 0: give a scale")
    error = (np.abs(found - known) / by).ravel()
    worst = int(np.where(np.isnan(error), np.inf, error).argmax())
    if error[worst] < ROUNDING:
        worst = int(np.abs(known).argmax())  # where nothing but rounding differs, the largest tells a reader most
    return float(found.ravel()[worst]), float(known.ravel()[worst]), found.size, float(error.max())


@dataclass
class Manual:
    """The cases of a session, its failed tests, and the number of tests left out."""

    cases: list[Case] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)
    left_out: int = 0

    def page(self) -> str:
        sections = self._sections()
        lines = [
            "# Verification manual",
            "",
            "What damagepred computes, beside what is known without it. The tests in this folder write this page:",
            "",
            f"    {COMMAND}",
            "",
            "SI units; tension, opening and anticlockwise rotation are positive, y is up. *Error* is the difference "
            "over the exact value (over the largest one where several values are compared: the pair that differs most "
            "is shown, and their number), or over the scale that the test names. *Time* is the wall time of the case "
            "on one core, kernels compiled before. `quasi-static` and `explicit` are the two solvers, the explicit one "
            "without its elastic start, so that it reaches every state by time stepping; `dynamic` are runs in "
            "physical time; other words in that column say what else computed.",
            "",
            self._totals(len(sections)),
            "",
            "Versions: " + ", ".join(f"{name} {number}" for name, number in _versions()) + ".",
            "",
        ]
        if self.failed:
            lines += ["**Failed:** " + ", ".join(f"`{name}`" for name in self.failed) + ".", ""]
        if self.left_out:
            lines += [f"**Not whole:** {self.left_out} tests were left out of the run that wrote this page.", ""]
        lines += ["Units of masonry that the cases name; every case names others by their size:", "", *units(), ""]
        lines += ["## Contents", ""]
        for chapter, group in itertools.groupby(sections, key=lambda s: s[0].chapter):
            lines += [f"- {chapter}"]
            lines += [f"  - [{form.title}](#{_anchor(form.title)}): {_worst(cases)}" for form, cases in group]
        for chapter, group in itertools.groupby(sections, key=lambda s: s[0].chapter):
            lines += ["", f"## {chapter}"]
            for form, cases in group:
                lines += ["", *_section(form, cases)]
        return "\n".join(lines) + "\n"

    def _sections(self) -> list[tuple[ClosedForm, list[Case]]]:
        by_form: dict[ClosedForm, list[Case]] = {}
        for case in self.cases:
            by_form.setdefault(case.form, []).append(case)
        titles = [form.title for form in by_form]
        twice = {title for title in titles if titles.count(title) > 1}
        if twice:
            raise ValueError(f"two closed forms have the same title: {', '.join(sorted(twice))}")
        chapters = CHAPTERS.split("; ") + [form.chapter for form in by_form]
        return sorted(by_form.items(), key=lambda item: chapters.index(item[0].chapter))

    def _totals(self, sections: int) -> str:
        passed = sum(case.passed for case in self.cases)
        seconds = sum(case.seconds for case in self.cases)
        return f"**{sections} closed forms, {len(self.cases)} cases, {passed} passed; {seconds:.0f} s.**"


def _section(form: ClosedForm, cases: Sequence[Case]) -> list[str]:
    tests = sorted({case.test for case in cases})
    lines = [f"### {form.title}", ""]
    lines += [f"    {line}" for line in form.formula.strip().splitlines()]
    lines += ["", f"Source: {form.source}", ""]
    if form.note:
        lines += [form.note, ""]
    lines += [
        "| solver | case | quantity | computed | exact | error | allowed | time (s) |",
        "|---|---|---|---:|---:|---:|---:|---:|",
    ]
    lines += [_row(case) for case in cases]
    lines += ["", f"{_worst(cases).capitalize()}. Tests: {', '.join(f'`{test}`' for test in tests)}."]
    return lines


def _row(case: Case) -> str:
    quantity = case.quantity
    if case.count > 1:
        quantity += f", worst of {case.count}"
    verdict = isinstance(case.exact, str)
    error = ("-" if case.passed else "differs") if verdict else _error(case.error)
    cells = [
        case.solver.replace("_", "-") or "-",
        case.case,
        quantity,
        _number(case.computed),
        _number(case.exact),
        error if case.passed else f"**{error}**",
        "-" if verdict else _error(case.allowed),
        f"{case.seconds:.2f}",
    ]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _worst(cases: Sequence[Case]) -> str:
    numbers = [case.error for case in cases if not isinstance(case.exact, str)]
    failed = sum(not case.passed for case in cases)
    words = f"{len(cases)} case{'s' if len(cases) > 1 else ''}"
    if numbers:
        words += f", worst error {_error(max(numbers, key=lambda e: np.inf if np.isnan(e) else e))}"
    return words + (f", **{failed} failed**" if failed else "")


def _error(error: float) -> str:
    return f"{error:.1e}" if 0 < error < 1e-4 else f"{100 * error:.2g} %"


def _number(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.6g}"


def _anchor(title: str) -> str:
    return "".join(c for c in title.lower().replace(" ", "-") if c.isalnum() or c in "-_")


def _versions() -> list[tuple[str, str]]:
    libraries = [(name, version(name)) for name in ("numpy", "scipy", "numba")]
    return [("damagepred", version("damagepred")), ("Python", platform.python_version()), *libraries]
