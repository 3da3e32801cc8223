"""A study in the groups of ArviZ."""

import sys
from pathlib import Path

import pytest

import damagepred
from damagepred.errors import InputError
from tests.synthetic_studies import synthetic_study


def test_inputs_are_the_prior_and_results_its_predictions(tmp_path: Path) -> None:
    pytest.importorskip("arviz")
    study = damagepred.open_study(synthetic_study(tmp_path / "house.dp", 40, failed=[3]))
    tree = damagepred.to_arviz(study)
    for group, name in (
        ("prior", "joint.friction"),
        ("prior_predictive", "crack_width_max"),
        ("sample_stats_prior", "status"),
    ):
        found = tree[group][name]
        assert found.dims[:2] == ("chain", "draw")
        assert (found.values[0] == study[name].values).sum() == study[name].notnull().sum()
    with pytest.raises(InputError, match="the dataset has no sample"):
        damagepred.to_arviz(study.isel(sample=0, drop=True))


def test_without_arviz_the_message_is_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = damagepred.open_study(synthetic_study(tmp_path / "house.dp"))
    monkeypatch.setitem(sys.modules, "arviz", None)
    with pytest.raises(
        InputError, match=r"^to_arviz needs ArviZ; install it with `pip install damagepred\[arviz\]`\.$"
    ):
        damagepred.to_arviz(study)
