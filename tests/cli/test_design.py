"""`damagepred design` finds the cheapest alternative, resumes, values measures, and refuses wrong files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred import InputError
from damagepred.analyses.design_search import search_design
from tests.cli.conftest import Run

CHOICES = """
study = "small.toml"
[target]
category = 1
probability = 0.6
at = "3 mm"
first = 4
most = 16

[[choice]]
name = "mortar"
[[choice.option]]
name = "weak"
[[choice.option]]
name = "strong"
cost = 100
scene.joint.friction = 0.9
scene.loads.roof = "1 kN"

[[choice]]
name = "dpc"
[[choice.option]]
name = "none"
[[choice.option]]
name = "slip"
cost = 10
scene.dpc = { course = 1, friction = 0.3 }
"""


@pytest.fixture
def choices(small_study_file: Path) -> Path:
    file = small_study_file.parent / "choices.toml"
    file.write_text(CHOICES)
    return file


def test_the_search_prints_keeps_and_resumes(command: Run, choices: Path, tmp_path: Path) -> None:
    kept, picture = tmp_path / "design.nc", tmp_path / "design.png"
    said = command("design", choices, "-o", kept, "--plot", picture)
    assert said.code == 0, said.err
    assert "4 alternatives of walls like the first:" in said.out
    assert said.out.index("to begin with, about") < said.out.index("samples each")
    assert "slip" in said.out
    assert picture.stat().st_size > 10_000
    with xr.open_dataset(kept) as ds:
        assert ds.sizes == {"alternative": 4, "measure": 2}
        assert ds["cost"].values.tolist() == [0.0, 10.0, 100.0, 110.0]
        assert (ds["probability_lower"].fillna(0) <= ds["probability_upper"]).all()
        chosen = str(ds.attrs["chosen"])
        again = search_design(choices, choices.with_suffix(".design"))
        assert np.array_equal(again["samples"].values, ds["samples"].values)
        assert again.attrs["chosen"] == chosen
        assert np.isfinite(again["value"].sel(measure="dpc: slip"))


@pytest.mark.quick_cases
@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('study = "small.toml"', 'study = "none.toml"', "no such file"),
        ("probability = 0.6", "probability = 1.6", "must be less than 1"),
        ('at = "3 mm"', 'at = "H1"', "is of the surface movement"),
        ('at = "3 mm"', 'at = "300 mm"', "give the study a larger movement"),
        ("scene.joint.friction", "scene.joint.frction", "unknown key"),
        ('name = "strong"', 'name = "weak"', "have the same name"),
        ("category = 1", "category = 9", "categories 1 to"),
        ("category = 1\n", "category = 1\ntolerance = 5\n", "it needs repair_costs"),
        ("category = 1\n", "", "give category and probability, or repair_costs"),
        ("category = 1\n", "category = 1\nrepair_costs = [1]\n", "give category and probability, or repair_costs"),
        ("category = 1\nprobability = 0.6", "repair_costs = [5, 3]", "nor fall from category to category"),
        ("category = 1\nprobability = 0.6", "repair_costs = [1, 2, 3, 4, 5, 6, 7, 8, 9]", "categories 1 to"),
    ],
)
def test_wrong_files_are_answered_by_a_sentence(choices: Path, old: str, new: str, sentence: str) -> None:
    choices.write_text(CHOICES.replace(old, new))
    with pytest.raises(InputError) as error:
        search_design(choices, choices.with_suffix(".design"))
    assert sentence in str(error.value)
