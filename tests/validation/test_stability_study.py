"""The study of what the solvers bear: a few of its stresses, each right or refused with words."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

FOLDER = Path(__file__).parents[2] / "studies" / "stability"


@pytest.fixture(scope="module")
def study() -> ModuleType:
    spec = importlib.util.spec_from_file_location("stability_run", FOLDER / "run.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    "way", ["quasi-static, rigid", "quasi-static, deformable", "explicit, rigid", "explicit, deformable"]
)
@pytest.mark.parametrize(
    ("stress", "size"),
    [
        ("soft joints among stiff ones", "1 : 1e6"), ("light blocks on heavy ones", "1 : 1e4"), ("slivers", "50 : 1"),
        ("slender blocks", "1 : 50"), ("flat blocks", "50 : 1"), ("far coordinates", "10 km"),
    ],
)  # fmt: skip
def test_what_is_out_of_proportion_is_solved(study: ModuleType, way: str, stress: str, size: str) -> None:
    case = next(c for c in study.cases() if (c.stress, c.size) == (stress, size))
    found = study.WAYS[way](case)
    assert found.verdict == "right", str(found)


@pytest.mark.parametrize(("share", "verdicts"), [(0.1, {"right"}), (1.0, {"right"}), (2.0, {"refused"})])
def test_a_time_step_holds_or_is_refused(study: ModuleType, share: float, verdicts: set[str]) -> None:
    found = study.longer_steps(share)
    assert {o.verdict for o in found.values()} == verdicts, found
    assert all("time_step_safety" in o.message for o in found.values() if o.message)


def test_a_far_away_wall_cracks_alike(study: ModuleType) -> None:
    own = study.Solver(method="explicit", tolerance=1e-4, symmetric_half=False)
    near, far = (study.cracked(study.cracking_wall(False, at).build(own), own) for at in (0.0, 1e4))
    assert abs(near[0] - far[0]) <= 2
    assert far[1] == pytest.approx(near[1], rel=2e-3)
