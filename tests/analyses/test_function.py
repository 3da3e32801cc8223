"""A study as a plain function, and its use by OpenTURNS and SALib."""

import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import damagepred
from damagepred.analyses.function import JOINTS, StudyFunction
from damagepred.campaign.settings import StudySettings
from damagepred.errors import InputError
from damagepred.study import Study
from studies.hooks import run
from tests.conftest import SMALL_STUDY

INPUTS = ("joint.friction", "movement.central_deflection")


@pytest.fixture(scope="module")
def study() -> Study:
    return Study(StudySettings.from_dict(tomllib.loads(SMALL_STUDY)))


@pytest.fixture(scope="module")
def hooks() -> StudyFunction:
    return Study.from_toml(run.STUDY).function([run.OUTPUT])


def test_it_is_the_study_s_own_sample(study: Study, tmp_path: Path) -> None:
    with ThreadPoolExecutor(1) as executor:
        study.run(tmp_path / "study.dp", samples=3, executor=executor)
    archived = damagepred.open_study(tmp_path / "study.dp")
    wall = study.function()
    assert wall.inputs == INPUTS
    assert wall.units == ("1", "m")
    vectors = np.column_stack([archived[place].values for place in wall.inputs])
    found = wall(vectors, numbers=[0, 1, 2])
    for name in ("damage_category", "crack_width_max", "dpc_opening_max", "status"):
        assert found[name].dims == archived[name].dims
        np.testing.assert_array_equal(found[name].values, archived[name].values)
    alone = wall(vectors[2], numbers=2)
    assert alone["crack_width_max"].dims == ("increment",)
    np.testing.assert_array_equal(alone["crack_width_max"].values, archived["crack_width_max"].values[2])


def test_by_default_all_walls_have_the_same_joints(study: Study) -> None:
    wall = study.function(["crack_width_max"], movement="sampled")
    twice = wall([[0.75, 0.008], [0.75, 0.008]])["crack_width_max"]
    assert twice.dims == ("sample",)
    assert twice[0] == twice[1] == wall([0.75, 0.008])["crack_width_max"]
    assert wall([0.75, 0.008], numbers=1)["crack_width_max"] != twice[0]


def test_a_wall_that_fails_is_nan_and_sobol_s_indices_refuse_it(
    hooks: StudyFunction, monkeypatch: pytest.MonkeyPatch
) -> None:
    import damagepred.campaign.sample as module

    honest, calls = module.follow_wall, []

    def moody(*arguments: object):
        calls.append(1)
        if len(calls) == 4:
            raise damagepred.SolverError("did not settle")
        return honest(*arguments)

    monkeypatch.setattr(module, "follow_wall", moody)
    with pytest.raises(InputError, match="1 of 40 values are not finite, the first in row 3"):
        hooks.sobol(run.OUTPUT, 8)


def test_values_of_joints_count_as_one_input(study: Study) -> None:
    wall = study.function()
    rows, numbers, names = wall.sobol_rows(4, seed=1)
    assert names == [*INPUTS, JOINTS]
    assert numbers.reshape(4, 5).tolist() == [[i, i, i, 4 + i, 4 + i] for i in range(4)]
    by_point = rows.reshape(4, 5, 2)
    np.testing.assert_array_equal(by_point[:, 3], by_point[:, 0])  # A's values, B's joints


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda s: s.function(["crack_width"]), "no such result. Did you mean 'crack_width_max'"),
        (lambda s: s.function(["surface_movement"])([0.75, 0.006]), "this scene has no such result"),
        (lambda s: s.function(movement="end"), "movement = 'end': must be one of path"),
        (lambda s: s.function()([0.75]), "has 2 inputs: joint.friction, movement"),
        (lambda s: s.function()([0.75, np.nan]), "not finite"),
        (lambda s: s.function()([0.75, 0.006], numbers=-1), "numbers: must be 0 or more"),
        (lambda s: s.function()([-0.75, 0.006]), "no wall could be solved; the first: InputError"),
    ],
)
def test_invalid_requests_are_refused(study: Study, ask, words: str) -> None:
    with pytest.raises(InputError) as caught:
        ask(study)
    assert words in str(caught.value)


def test_correlated_variables_have_no_sobol_indices() -> None:
    tables = tomllib.loads(SMALL_STUDY)
    tables["correlation"]["joint.friction"] = {"movement.central_deflection": 0.5}
    with pytest.raises(InputError, match="independent inputs"):
        Study(StudySettings.from_dict(tables)).function().sobol("crack_width_max", 8)


@pytest.mark.thorough
def test_salib_and_openturns_get_the_same_indices(hooks: StudyFunction) -> None:
    size = 8
    ours = hooks.sobol(run.OUTPUT, size, seed=1, resamples=0)
    salib = run.with_salib(size)
    np.testing.assert_allclose(salib["first"], ours["first_order"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(salib["total"], ours["total"], rtol=0, atol=1e-12)
    theirs = run.with_openturns(size)
    rows, _, _ = hooks.sobol_rows(size, seed=1)
    table = hooks(rows)[run.OUTPUT].values.reshape(size, -1)
    # OpenTURNS divides by (n - 1/2) times the variance of A, here by n times that of A and B together; its first order
    # is Jansen's, from B instead of from A
    of_a, of_both = table[:, 0].var(ddof=1) * (size - 0.5), table[:, [0, -1]].var() * size
    np.testing.assert_allclose(theirs["total"] * of_a / of_both, ours["total"], rtol=1e-9)
    jansen = 1 - 0.5 * ((table[:, -1:] - table[:, 1:-1]) ** 2).sum(axis=0) / of_a
    np.testing.assert_allclose(theirs["first"], jansen, atol=1e-9)


def test_a_wall_that_fails_has_no_category(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not category 0: whole numbers of a wall without a result are -1, real ones NaN."""
    import damagepred.campaign.sample as module

    honest, calls = module.follow_wall, []

    def moody(*arguments: object):
        calls.append(1)
        if len(calls) == 2:
            raise damagepred.SolverError("did not settle")
        return honest(*arguments)

    monkeypatch.setattr(module, "follow_wall", moody)
    found = study.function(["damage_category", "crack_width_max"])([[0.75, 0.008], [0.7, 0.008]])
    assert (found["damage_category"].values[1] == -1).all()
    assert np.isnan(found["crack_width_max"].values[1]).all()
    assert (found["damage_category"].values[0] >= 0).all()
