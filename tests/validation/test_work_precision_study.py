"""The work-precision diagrams: what is read, measured and told; and what their data say of the defaults."""

import os
import time
from dataclasses import replace

from damagepred.scene import Solver
from studies.benchmarks import cases
from studies.benchmarks.work_precision import choices, errors, run


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


def test_what_takes_too_long_or_dies_is_listed(tmp_path, monkeypatch):
    monkeypatch.setattr(run, "one", _hangs_or_dies)
    monkeypatch.setattr(run, "for_scene", lambda name: [c for c in choices.choices() if c.axis == "tolerance"][:2])
    run.run(tmp_path / "data.csv", ["stack"], (), 0.5)
    rows = errors.load(tmp_path / "data.csv")
    assert rows["status"][0] == "over 0.5 s"
    assert "died" in rows["status"][1]
    assert rows["version"].str.startswith("0.").all()


def _hangs_or_dies(scene, axis, value):
    if value == "0.1":
        time.sleep(60)
    os._exit(3)


def test_defaults_solve_their_equations_to_one_percent():
    """What the page concludes, of walls with one answer: held against its data."""
    lines = errors.with_errors(errors.load(run.DATA))
    for scene in ("dishing", "doming", "window, strong", "stack", "large"):
        own = lines[(lines["scene"] == scene) & (lines["axis"] == "default") & (lines["solution_floor"] < 0.01)]
        assert len(own) >= 4, scene
        assert own["solution"].max() < 0.01, scene


def test_presets_are_the_choices_they_are_said_to_be():
    known = {(c.axis, c.value): c for c in choices.choices()}
    for accuracy, which in choices.PRESET.items():
        assert Solver(**known[which].solver) == replace(Solver(accuracy=accuracy), accuracy="standard")
