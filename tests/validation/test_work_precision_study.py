"""The work-precision diagrams: what is read, measured and told; and what their data say of the defaults."""

import pytest

from studies.benchmarks import cases
from studies.benchmarks.work_precision import errors, run

pytestmark = pytest.mark.thorough


def test_a_wall_is_solved_noted_and_compared(tmp_path, monkeypatch):
    data = tmp_path / "data.csv"
    names = ("default", "same model", "explicit increments")
    todo = [c for c in run.for_scene("stack") if c.axis in names]
    monkeypatch.setattr(run, "for_scene", lambda name: todo)
    run.run(data, ["stack"], (), 60.0)
    assert cases.keys_in(data, run.KEY) == {("stack", c.axis, c.value) for c in todo}
    rows = errors.load(data)
    assert (rows["status"] == "complete").all()
    lines = errors.with_errors(rows).set_index(["axis", "quantity"])["solution"]
    # where nothing breaks, 20 increments are as good as 320, and the other solver comes to the same, less closely
    assert lines["default", "dpc_opening"] < 1e-6 < lines["explicit increments", "block_compression"] < 0.01
    assert lines["explicit increments", "dpc_opening"] < 0.01
    # what a block weighs rests on the one below: the lowest course carries the wall
    assert rows["base_reaction@1"].nunique() <= 2
    assert (rows["block_compression@1"] > rows["base_reaction@1"] / (0.96 * 0.11)).all()


def test_defaults_solve_their_equations_to_one_percent():
    """What the page concludes, of walls with one answer: held against its data."""
    lines = errors.with_errors(errors.load(run.DATA))
    for scene in ("dishing", "doming", "window, strong", "stack", "large"):
        own = lines[(lines["scene"] == scene) & (lines["axis"] == "default") & (lines["solution_floor"] < 0.01)]
        assert len(own) >= 4, scene
        assert own["solution"].max() < 0.01, scene
