"""A study in the groups of ArviZ."""

import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.errors import InputError
from damagepred.exports.frames import walls_frame
from damagepred.plotting import draw_comparison
from tests.synthetic_studies import synthetic_study


@pytest.fixture
def arviz(monkeypatch: pytest.MonkeyPatch) -> None:
    """ArviZ 1, which has no class of its own for the groups: xarray's tree is enough."""
    monkeypatch.setitem(sys.modules, "arviz", ModuleType("arviz"))


GROUPS = {"prior": "joint.friction", "prior_predictive": "crack_width_max", "sample_stats_prior": "status"}


@pytest.mark.usefixtures("arviz")
def test_inputs_are_the_prior_and_results_its_predictions(tmp_path: Path) -> None:
    study = damagepred.open_study(synthetic_study(tmp_path / "house.dp", 40, failed=[3]))
    tree = damagepred.to_arviz(study)
    for group, name in GROUPS.items():
        found = tree[group][name]
        assert found.dims[:2] == ("chain", "draw")
        assert (found.values[0] == study[name].values).sum() == study[name].notnull().sum()
    with pytest.raises(InputError, match="the dataset has no variable 'sample'"):
        damagepred.to_arviz(study.isel(sample=0, drop=True))


@pytest.mark.quick_cases
@pytest.mark.usefixtures("arviz")
@pytest.mark.parametrize("movement", ["path", "sampled", "both"])
@pytest.mark.parametrize("weighted", [False, True])
def test_each_variable_is_in_one_group(tmp_path: Path, movement: str, weighted: bool) -> None:
    """Results at the end of a wall's movement have one value per wall, as its status and its inputs have."""
    study = damagepred.open_study(synthetic_study(tmp_path / "house.dp", 5))
    results = ["crack_width_max", "damage_category"]
    ends = {f"end_{name}": study[name].isel(increment=-1, drop=True) for name in results}
    if movement == "both":
        study = study.assign(ends)
    elif movement == "sampled":
        study = study.drop_vars(["increment", "movement"], errors="ignore").isel(increment=-1)
    if weighted:
        study["weight"] = "sample", np.ones(5)
    tree = damagepred.to_arviz(study)
    found = {group: set(map(str, tree[group].data_vars)) for group in GROUPS}
    inputs = {str(name) for name in study.data_vars if "." in str(name)}
    statistics = {"status", "run_time", *(["weight"] if weighted else [])}
    assert found["prior"] == inputs
    assert found["sample_stats_prior"] == statistics
    assert found["prior_predictive"] == set(map(str, study.data_vars)) - inputs - statistics
    assert set(ends if movement == "both" else results) <= found["prior_predictive"]


def test_without_arviz_the_message_is_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = damagepred.open_study(synthetic_study(tmp_path / "house.dp"))
    monkeypatch.setitem(sys.modules, "arviz", None)
    with pytest.raises(
        InputError, match=r"^to_arviz needs ArviZ; install it with `pip install damagepred\[arviz\]`\.$"
    ):
        damagepred.to_arviz(study)


def test_walls_frame_has_a_row_a_wall_with_the_worst_of_its_path() -> None:
    path = ("sample", "increment")
    ds = xr.Dataset(
        {
            "status": ("sample", np.array([0, 1, 2, 3], dtype=np.int8)),
            "joint.friction": ("sample", np.array([0.7, 0.8, 0.9, 0.6])),
            "joint.cohesion": (("sample", "joint"), np.ones((4, 5))),
            "damage_category": (path, np.array([[0, 1, 1], [0, 2, 4], [0, -1, -1], [-1, -1, -1]], dtype=np.int8)),
            "crack_width_max": (path, np.array([[0, 2e-3, 1e-3], [0, 4e-3, 0.1], [0, np.nan, np.nan], [np.nan] * 3])),
        },
        coords={"central_deflection": (path, np.tile([0.0, 4e-3, 8e-3], (4, 1)))},
    )
    frame = walls_frame(ds)
    assert list(frame["status"]) == ["complete", "collapsed", "failed", "missing"]
    assert list(frame["joint.friction"]) == [0.7, 0.8, 0.9, 0.6]
    assert "joint.cohesion" not in frame
    assert list(frame["damage_category"]) == [1, 4, 0, -1]
    assert np.array_equal(frame["crack_width_max"], [2e-3, 0.1, 0.0, np.nan], equal_nan=True)
    assert list(frame["central_deflection_max"]) == [8e-3] * 4


def test_methods_on_datasets_take_categories_by_name(tmp_path: Path) -> None:
    place = synthetic_study(tmp_path / "house.dp", 40, medians=(2e-3, 4e-3), failed=[3], missing=[5])
    study = damagepred.open_study(place)
    assert study.damagepred.category("slight") == 2
    found = study.damagepred.exceedance("very slight", at=3e-3)
    assert found == damagepred.exceedance(study, 1, 3e-3)
    assert found.failed == 1
    curves = damagepred.fit_fragility(study, categories=[1, 2], bootstrap=0, goodness=0)
    for category in (2, "slight"):
        assert curves.damagepred.sel(category=category).identical(curves.sel(category=2))
    assert damagepred.exceedance(study, "very slight", 3e-3) == found
    named = damagepred.fit_fragility(study, categories=["very slight", "slight"], bootstrap=0, goodness=0)
    assert named.identical(curves)
    both = damagepred.compare({"a": study, "b": study}, categories=["slight"], at=[3e-3])
    assert both.identical(damagepred.compare({"a": study, "b": study}, categories=[2], at=[3e-3]))
    assert both.damagepred.sel("slight").identical(both.sel(category=2))
    draw_comparison(both, "slight")
    with pytest.raises(InputError, match=r"category = 'sligt': must be a number from 1, or one of .* mean 'slight'"):
        study.damagepred.category("sligt")
