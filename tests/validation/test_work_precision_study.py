"""The work-precision diagrams: what is read, measured and told; and what their data say of the defaults."""

import pytest

from studies.benchmarks.work_precision import errors, run

pytestmark = pytest.mark.thorough


def test_defaults_solve_their_equations_to_one_percent():
    """What the page concludes, of walls with one answer: held against its data."""
    lines = errors.with_errors(errors.load(run.DATA))
    for scene in ("dishing", "doming", "window, strong", "stack", "large"):
        own = lines[(lines["scene"] == scene) & (lines["axis"] == "default") & (lines["solution_floor"] < 0.01)]
        assert len(own) >= 4, scene
        assert own["solution"].max() < 0.01, scene
