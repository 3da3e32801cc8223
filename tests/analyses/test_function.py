"""A study as a plain function, and its use by OpenTURNS and SALib."""

import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import damagepred
from damagepred.campaign.settings import StudySettings
from damagepred.errors import InputError
from damagepred.study import Study
from studies.hooks import run
from tests.conftest import SMALL_STUDY

INPUTS = ("joint.friction", "movement.central_deflection")


@pytest.fixture(scope="module")
def study() -> Study:
    return Study(StudySettings.from_dict(tomllib.loads(SMALL_STUDY)))


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


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda s: s.function(["crack_width"]), "no such result. Did you mean 'crack_width_max'"),
        (lambda s: s.function(["surface_movement"])([0.75, 0.006]), "this scene has no such result"),
        (lambda s: s.function(movement="end"), "movement = 'end': must be one of path"),
        (lambda s: s.function()([0.75]), "has 2 inputs: joint.friction, movement"),
        (lambda s: s.function()([0.75, np.nan]), "not finite"),
        (lambda s: s.function()([0.75, 0.006], numbers=-1), "numbers: must be 0 or more"),
        (lambda s: s.function()([-0.75, 0.006]), "no sample could be solved; the first: InputError"),
    ],
)
def test_invalid_requests_are_refused(study: Study, ask, words: str) -> None:
    with pytest.raises(InputError) as caught:
        ask(study)
    assert words in str(caught.value)


@pytest.mark.thorough
def test_salib_and_openturns_get_the_same_walls() -> None:
    """Total indices are over n - 1/2 times the variance of A (OpenTURNS), over n times the variance of both (SALib)."""
    size = 4
    salib, theirs = run.with_salib(size), run.with_openturns(size)
    wall = Study.from_toml(run.STUDY).function([run.OUTPUT])
    table = wall(run.vectors(wall, size))[run.OUTPUT].values.reshape(size, -1)
    of_a, of_both = table[:, 0].var(ddof=1) * (size - 0.5), table[:, [0, -1]].var() * size
    jansen = 0.5 * ((table[:, :1] - table[:, 1:-1]) ** 2).sum(axis=0)
    np.testing.assert_allclose(salib["total"], jansen / of_both, rtol=1e-9)
    np.testing.assert_allclose(theirs["total"], jansen / of_a, rtol=1e-9)


def test_a_wall_that_fails_has_no_category(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not category 0: whole numbers of a wall without a result are -1, real ones NaN."""
    import damagepred.campaign.sample as module

    honest, calls = module.follow_scene, []

    def moody(*arguments: object):
        calls.append(1)
        if len(calls) == 2:
            raise damagepred.SolverError("did not settle")
        return honest(*arguments)

    monkeypatch.setattr(module, "follow_scene", moody)
    found = study.function(["damage_category", "crack_width_max"])([[0.75, 0.008], [0.7, 0.008]])
    assert (found["damage_category"].values[1] == -1).all()
    assert np.isnan(found["crack_width_max"].values[1]).all()
    assert (found["damage_category"].values[0] >= 0).all()
