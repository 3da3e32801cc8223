"""The study of the deep beam: its tables, one wall, and its quick form."""

import importlib
import sys
from pathlib import Path
from types import ModuleType

import pandas as pd
import pytest

from damagepred.damage import beam_strain
from damagepred.scene import Scene

STUDY = Path(__file__).resolve().parents[2] / "studies" / "simple_methods"
NAMES = ("walls", "compare", "picture", "run")


@pytest.fixture(scope="module")
def study() -> dict[str, ModuleType]:
    sys.path.insert(0, str(STUDY))
    kept = {name: sys.modules.pop(name) for name in NAMES if name in sys.modules}
    try:
        return {name: importlib.import_module(name) for name in NAMES}
    finally:
        sys.path.remove(str(STUDY))
        for name in NAMES:
            sys.modules.pop(name, None)
        sys.modules.update(kept)


def test_the_readme_has_the_table_of_the_csv(study: dict[str, ModuleType]) -> None:
    levels = pd.read_csv(STUDY / "agreement.csv")
    lines = (STUDY / "README.md").read_text(encoding="utf-8").splitlines()
    reached = pd.read_csv(STUDY / "capacities.csv")
    for line in [*study["compare"].summary(levels), *study["compare"].cracked(reached)]:
        assert line in lines


def test_what_the_wall_of_a_dpc_does_the_simple_methods_do_not_see(study: dict[str, ModuleType]) -> None:
    """The finding of the study on one small wall: the wall rides on its dpc, and the beam is said to break."""
    walls, settings = study["walls"], study["walls"].read_settings() | {"increments": 4}
    path = study["run"].path_of(walls.Case(4.0, 2.4, True, "doming", "none", 1.0), settings)
    last = path.iloc[-1]
    assert last["category"] == 0
    assert last["dpc_opening"] > 5e-3
    assert last["beam_category"] >= 3
    expected = beam_strain(1 / 300, 4.0, 2.4, "doming", 2 * (1 + Scene().block.poisson_ratio)).largest
    assert last["beam_strain"] == pytest.approx(float(expected))


@pytest.mark.slow
def test_quick_form(study: dict[str, ModuleType], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = study["run"]
    monkeypatch.setattr(sys, "argv", ["run.py", "--quick", "--output", str(tmp_path), "--at-most", "3"])
    assert run.main() == 0
    first = pd.read_csv(tmp_path / "results" / "paths.csv")
    assert not (tmp_path / "agreement.csv").exists()
    monkeypatch.setattr(sys, "argv", ["run.py", "--quick", "--output", str(tmp_path)])
    assert run.main() == 0
    paths = pd.read_csv(tmp_path / "results" / "paths.csv")
    pd.testing.assert_frame_equal(paths.iloc[: len(first)], first, check_dtype=False)  # 0 or 0.0 in a file
    assert len(paths) == 8 * 41
    levels = pd.read_csv(tmp_path / "agreement.csv")
    assert len(levels) == 8 * 5
    riding = levels[levels["dpc"]]
    assert (riding["difference"] > 0).mean() > 0.8
    assert (tmp_path / "diagram.png").stat().st_size > 20_000
