"""A study in the groups of ArviZ."""

import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import damagepred
from damagepred.errors import InputError
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
    with pytest.raises(InputError, match="the dataset has no sample"):
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
