"""studies/benchmarks/skips: what is turned off is off, the answer stays."""

import importlib
from types import ModuleType

import pytest

OURS = ("measuring", "run", "scenes", "skips", "study_skips")


@pytest.fixture(scope="module")
def room() -> dict[str, ModuleType]:
    return {name: importlib.import_module(f"studies.benchmarks.skips.{name}") for name in OURS}


MORE = {"correct": "factorisations", "direct": "steps", "predictor": "steps", "elastic start": "steps"}
"""What there is more of without a skip."""


@pytest.mark.parametrize(
    "name", ["condense", "half", "correct", "restart", "keep", "direct", "predictor", "elastic start"]
)
def test_without_a_skip_there_is_more_to_do_and_the_answer_is_the_same(room: dict[str, ModuleType], name: str) -> None:
    skip = room["skips"].SKIPS[name]
    scene = "no dpc" if "no dpc" in skip.scenes else skip.scenes[0]
    row = room["run"].measure(name, scene, 1, True)
    assert row["end_on"] == row["end_off"] == "complete"
    # by cycles, dead load comes on in another way, which friction in a bare dpc remembers
    assert max(row["upwards"], row["sideways"]) < (2e-2 if name == "elastic start" else 2e-3)
    if name in MORE:
        assert row[f"{MORE[name]}_off"] > row[f"{MORE[name]}_on"]


def test_what_is_put_in_place_is_taken_away_again(room: dict[str, ModuleType]) -> None:
    from damagepred.solvers.dynamics import run
    from damagepred.solvers.explicit import stepper
    from damagepred.solvers.quasi_static import continuation, equilibrium, linear_system, superelements
    from damagepred.solvers.time_stepping import scheme

    modules = (scheme, stepper, run, linear_system, equilibrium, continuation, superelements)

    def picture() -> list[int]:
        paths = (
            linear_system.BlockTridiagonalSystem,
            equilibrium.Equilibrium,
            continuation.Continuation,
            superelements.Superelements,
        )
        classes = (scheme.DampedTimeStepping, *paths, *modules)
        return [id(value) for one in classes for value in vars(one).values()]

    before = picture()
    for name, skip in room["skips"].SKIPS.items():
        with skip.put():
            if skip.how == "patched":
                assert picture() != before, name
        assert picture() == before, name
