"""Options of the algorithms: set in TOML, refused in one sentence, recorded, replayed, and in use."""

import dataclasses
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import damagepred
from damagepred.campaign.settings import StudySettings
from damagepred.errors import InputError
from damagepred.scene import Scene, Solver
from damagepred.solvers.explicit.stepper import CHECK_INTERVAL, PASSED_CHECKS
from damagepred.solvers.options import DEFAULTS, SolverOptions, option_classes, with_recorded_options
from tests.solvers.walls import small_scene


def advanced(**tables: Any) -> Solver:
    return Solver(advanced=tables)


def test_options_are_set_by_the_scene_file_and_written_back(tmp_path: Path) -> None:
    file = tmp_path / "wall.toml"
    file.write_text("[solver.advanced.newton]\nmax_iterations = 80\n[solver.advanced.creep]\nlongest_step = 0.05\n")
    scene = Scene.from_toml(file)
    options = SolverOptions.of(scene.solver)
    assert (options.newton.max_iterations, options.creep.longest_step) == (80, 0.05)
    assert options.linear_system == DEFAULTS.linear_system
    scene.to_toml(file)
    assert Scene.from_toml(file) == scene
    assert "advanced" not in Scene().to_toml()


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"newtn": {}}, "unknown key [solver.advanced] newtn; .* takes newton, .*Did you mean 'newton'?"),
        ({"newton": {"max_iteration": 8}}, "unknown key [solver.advanced.newton] max_iteration; .*'max_iterations'?"),
        ({"newton": {"max_iterations": 0}}, "[solver.advanced.newton] max_iterations = 0: must be at least 1."),
        ({"newton": {"max_iterations": "many"}}, "[solver.advanced.newton] max_iterations = 'many': .*integer.*"),
        ({"creep": {"longest_step": -0.5}}, "[solver.advanced.creep] longest_step = -0.5: must be greater than 0."),
    ],
)
def test_a_wrong_option_is_refused_in_one_sentence_before_anything_is_solved(tables, said, tmp_path) -> None:
    pattern = ".*".join(re.escape(part) for part in said.split(".*"))
    scene = replace(small_scene(), solver=advanced(**tables))
    with pytest.raises(InputError, match=pattern) as complaint:
        damagepred.solve(scene)
    assert "\n" not in str(complaint.value)
    with pytest.raises(InputError, match=pattern):
        damagepred.Study(StudySettings.from_dict({"scene": scene.to_dict(), "study": {}}))


def test_every_option_is_documented() -> None:
    for table, kind in option_classes().items():
        for field in dataclasses.fields(kind):
            assert re.search(rf"^{field.name} : \w", kind.__doc__ or "", re.M), f"{table}.{field.name}"


def test_all_values_are_recorded_with_a_wall() -> None:
    ds = damagepred.solve(replace(small_scene(), solver=advanced(newton={"max_iterations": 17})))
    recorded = json.loads(ds.attrs["solver_options"])
    assert recorded["newton"]["max_iterations"] == 17
    assert recorded.keys() == option_classes().keys()


def test_options_that_this_version_does_not_know_are_left_out() -> None:
    recorded = json.loads(DEFAULTS.to_json())
    recorded["newton"] |= {"of_old": 3, "max_iterations": 20}
    recorded["older"] = {"key": 1}
    found = with_recorded_options(advanced(creep={"longest_step": 0.05}), json.dumps(recorded | {"creep": {}}))
    assert found.advanced == {"creep": {"longest_step": 0.05}, "newton": {"max_iterations": 20}}
    assert with_recorded_options(Solver(), DEFAULTS.to_json()) == Solver()


def test_an_option_acts() -> None:
    """Without Newton iterations on the Coulomb law all equilibria are found by Tresca fixed-point iteration."""
    scene = small_scene()
    plain, without = (
        damagepred.solve(scene, solver=advanced(newton=limit, newton_with_line_search=limit))
        for limit in ({"max_iterations": 40}, {"max_iterations": 1})
    )
    assert without["newton_iterations"].sum() > plain["newton_iterations"].sum()
    np.testing.assert_allclose(without["contact_opening"], plain["contact_opening"], rtol=0, atol=2e-6)


def test_shortest_increment_of_the_explicit_solver() -> None:
    """With a large tolerance each increment takes its ramp and the smallest number of convergence checks."""
    settings = Solver(method="explicit", tolerance=1e3)
    ds = damagepred.solve(small_scene(), solver=settings)
    assert set(ds["cycles"].values[1:]) == {settings.ramp_cycles + PASSED_CHECKS * CHECK_INTERVAL}


def test_keys_of_older_versions_are_read_with_a_warning() -> None:
    table = {"keep_unchanged_fronts": False, "dissected_size": 60, "max_memory": 3.0}
    settings = Solver(advanced={"linear_system": table, "coulomb": {"max_iterations": 100}})
    with pytest.warns(UserWarning, match="has no effect any more") as warned:
        assert SolverOptions.of(settings).linear_system.max_memory == 3.0
    assert {str(w.message).removesuffix(" has no effect any more; leave it out") for w in warned} == {
        "[solver.advanced.linear_system] keep_unchanged_fronts",
        "[solver.advanced.linear_system] dissected_size",
        "[solver.advanced.coulomb]",
    }


def test_blocks_by_an_estimate_are_read_as_elastic() -> None:
    with pytest.warns(UserWarning, match="blocks = 'auto' is read as 'elastic'"):
        assert Solver(blocks="auto", rigid_error=0.1) == Solver(blocks="elastic")
    with pytest.warns(UserWarning, match="is read as 'elastic'"):
        scene = Scene.from_dict({"solver": {"blocks": "auto", "rigid_error": 0.01}})
    assert scene.solver.blocks == "elastic"
    assert Scene.from_dict({"solver": {"blocks": "rigid", "rigid_error": 0.01}}).solver == Solver(blocks="rigid")
