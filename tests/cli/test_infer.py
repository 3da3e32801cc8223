"""`damagepred infer` prints causes, movement and future damage, and answers wrong input by a sentence."""

from __future__ import annotations

import json
from pathlib import Path

import xarray as xr

from tests.cli.conftest import Run
from tests.synthetic_studies import synthetic_study


def test_infer_prints_and_keeps_the_posterior(command: Run, tmp_path: Path) -> None:
    weak = synthetic_study(tmp_path / "weak.dp", 80, medians=(2e-3, 4e-3))
    strong = synthetic_study(tmp_path / "strong.dp", 80, medians=(4e-3, 8e-3))
    survey, kept, picture = (tmp_path / name for name in ("survey.toml", "posterior.nc", "posterior.png"))
    survey.write_text(
        '[[crack]]\nwidth = "2 mm"\nerror = "0.5 mm"\n[prior_odds]\nweak = 2.0\n[discrepancy]\nlevel = "2 mm"\n'
    )
    said = command("infer", weak, strong, survey, "-o", kept, "--plot", picture)
    assert said.code == 0, said.err
    assert "Cause and movement" in said.out
    assert "Damage after further movement" in said.out
    (line,) = [row for row in said.out.splitlines() if row.lstrip("│ ").startswith("width share")]
    assert " to " in line
    assert "derived" in line
    (line,) = [row for row in said.out.splitlines() if row.lstrip("│ ").startswith("level")]
    assert "given" in line
    assert picture.stat().st_size > 10_000
    with xr.open_dataset(kept) as ds:
        assert abs(float(ds["posterior"].sum()) - 1) < 1e-9
        assert ds["cause_prior"].values.tolist() == [0.5, 0.25]
        assert float(ds["another_cause_prior"]) == 0.25
    survey.write_text('[[crack]]\nwidth = "2 mm"\n')
    told = json.loads(command("infer", weak, survey, "--json").out)
    assert told["dims"]["study"] == 1
    # 80 walls of which few agree: the caution comes first, and no odds, neither as such nor as probabilities
    survey.write_text(
        '[[crack]]\nwidth = "12 mm"\nerror = "0.1 mm"\n[discrepancy]\nwidth = 1e-5\nwidth_share = 0.001\n'
    )
    told = json.loads(command("infer", weak, strong, survey, "--json").out)
    assert "cautions" not in told  # sentences go to the error stream
    assert told["data_vars"]["cause_posterior"]["data"] == [None, None]
    assert told["data_vars"]["another_cause_posterior"]["data"] is None
    said = command("infer", weak, strong, survey, "--full")
    assert said.code == 0
    assert said.out.index("caution: ") < said.out.index("Cause and movement")


def test_wrong_input_is_answered_by_a_sentence(command: Run, tmp_path: Path) -> None:
    house = synthetic_study(tmp_path / "house.dp", 20)
    survey = tmp_path / "survey.toml"
    survey.write_text('[[crack]]\nwidth = "2 mm"\n')
    for arguments, sentence in (
        ((house,), "one study folder or more"),
        ((house, house, survey), "a study with a different name"),
        ((tmp_path / "nothing.dp", survey), "no such study folder"),
        ((house, tmp_path / "nothing.toml"), "no such file"),
    ):
        said = command("infer", *arguments)
        assert (said.code, sentence in said.err) == (2, True), said.err
        assert "Traceback" not in said.err
