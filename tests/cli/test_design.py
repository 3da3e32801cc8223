"""`damagepred design` finds the cheapest alternative, resumes, values measures, and refuses wrong files."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred import InputError
from damagepred.analyses.design_search import _read, search_design
from damagepred.scene.material_library import material
from tests.cli.conftest import Run

CHOICES = """
study = "small.toml"
[target]
category = 1
probability = 0.6
at = "3 mm"
first = 4
most = 8
[[choice]]
name = "mortar"
[[choice.option]]
name = "weak"
[[choice.option]]
name = "strong"
cost = 100
scene.joint.normal_stiffness = "120 N/mm3"
scene.loads.roof = "1 kN"
[[choice]]
name = "dpc"
option = [{ name = "none" }, { name = "slip", cost = 10, scene.dpc = { course = 1, friction = 0.3 } }]
"""


@pytest.fixture
def choices(small_study_file: Path) -> Path:
    small_study_file.write_text(small_study_file.read_text().replace("increments = 6", "increments = 2"))
    file = small_study_file.parent / "choices.toml"
    file.write_text(CHOICES)
    return file


def test_the_search_prints_keeps_and_resumes(command: Run, choices: Path, tmp_path: Path) -> None:
    kept, picture = tmp_path / "design.nc", tmp_path / "design.png"
    said = command("design", choices, "-o", kept, "--plot", picture)
    assert said.code == 0, said.err
    assert "4 alternatives like the first:" in said.out
    assert "4 samples each to begin with, about" in said.out
    assert "slip" in said.out
    assert "decision" in said.out
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
        ("scene.joint.normal_stiffness", "scene.joint.normal_stifness", "unknown key"),
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


def test_a_material_of_an_option_counts(choices: Path) -> None:
    """The values of the material, not the ones that the study's own scene has by default."""
    old, new = 'scene.joint.normal_stiffness = "120 N/mm3"', 'scene.material = "calcium silicate brick, Dutch"'
    text = choices.read_text().replace(old, new)
    study = choices.parent / "small.toml"
    lines = study.read_text().partition("[correlation]")[0].splitlines()
    study.write_text("\n".join(line for line in lines if not line.startswith('"joint.')))
    choices.write_text(text)
    settings = _read(choices)[3]
    library = material("calcium silicate brick, Dutch").values
    own, of_library = (settings[k].scene.joint.normal_stiffness for k in (0, 2))
    assert of_library == library["joint.normal_stiffness"].mean != own


@pytest.mark.parametrize(
    ("line", "key"),
    [
        ("scene.joint.friction = 0.9", "joint.friction"),
        ('scene.material = "clay brick, Dutch, 1940s"', "joint.cohesion"),
    ],
)
def test_an_option_of_a_number_that_the_study_draws_is_refused(choices: Path, line: str, key: str) -> None:
    choices.write_text(choices.read_text().replace('scene.loads.roof = "1 kN"', line))
    with pytest.raises(InputError, match=f"option strong: .*{key}.*: the study draws this number for each wall"):
        search_design(choices, choices.with_suffix(".design"))
