"""`damagepred portfolio` assesses each house of a table as a study of its own, resumes, and refuses wrong rows."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from damagepred import InputError, Study, assess_portfolio, exceedance, open_study
from damagepred.analyses.portfolio import portfolio_frame
from damagepred.results.tables import most_damaged_first
from tests.cli.conftest import Run, command

__all__ = ["command"]

STUDY = """
[study]
samples = 4
[scene]
wall = { length = 1.92, height = 0.6 }
opening = [{ x = 0.72, y = 0.15, width = 0.48, height = 0.3 }]
[scene.movement]
central_deflection = "4 mm"
increments = 4
[variables]
"joint.strength_factor" = { distribution = "lognormal", mean = 1.0, cov = 0.3 }
"""

HOUSES = "name;length (m);opening.1.width (mm);joint.cohesion (MPa);at\na b;1,92;480;0,05;\nc;2,4;;;2 mm\n"


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("street")
    (folder / "house.toml").write_text(STUDY)
    (folder / "houses.csv").write_text(HOUSES)
    return folder


def test_a_house_is_the_study_with_its_row(files: Path) -> None:
    """The studies of the houses are the ones a user would write by hand; a new row leaves the others as they are."""
    street = assess_portfolio(files / "houses.csv", files / "house.toml", files / "out")
    assert street["at"].values.tolist() == ["4 mm", "2 mm"]
    first, second = (open_study(files / "out" / name) for name in ("a_b.dp", "c.dp"))
    by_hand = STUDY.replace("samples = 4", f"samples = 4\nseed = {first.attrs['seed']}").replace(
        "[scene.movement]", '[scene.joint]\ncohesion = "0.05 MPa"\n[scene.movement]'
    )
    (files / "hand.toml").write_text(by_hand)
    same = Study.from_toml(files / "hand.toml").run(files / "hand.dp").folder
    assert (open_study(same)["crack_width_max"].values == first["crack_width_max"].values).all()
    for name, ds, at in (("a b", first, "4 mm"), ("c", second, "2 mm")):
        for category in (1, 2):
            value = exceedance(ds, category, at).estimate.value
            assert float(street["probability"].sel(house=name, category=category)) == pytest.approx(value)
    (files / "more.csv").write_text(HOUSES + "d;1,92;;;\n")
    more = assess_portfolio(files / "more.csv", files / "house.toml", files / "more")
    assert more.isel(house=[0, 1]).drop_vars("category").equals(street.drop_vars("category"))


def test_the_command_writes_a_table_and_a_picture_and_resumes(files: Path, command: Run) -> None:
    given = ("portfolio", files / "houses.csv", files / "house.toml", "--folder", files / "out")
    said = command(*given, "--table", files / "damage.csv", "--plot", files / "street.png").out
    assert "category 1 or worse" in said
    assert (files / "street.png").stat().st_size > 5000
    table = pd.read_csv(files / "damage.csv")
    street = assess_portfolio(files / "houses.csv", files / "house.toml", files / "out")
    pd.testing.assert_frame_equal(table, portfolio_frame(street), check_dtype=False)
    total = street["probability"].sel(category=1).sum()
    assert f"category 1 or worse: {float(total):.3g} houses to be expected of 2" in said


def test_a_movement_beyond_the_walls_of_a_house_gives_bounds(files: Path, command: Run) -> None:
    """Half of the distribution lies beyond the walls of the second house; the street goes on."""
    uniform = 'distribution = ""uniform"", lower = ""1 mm"", upper = ""7 mm""'
    (files / "far.csv").write_text(f'name,at,central_deflection (mm)\na,2 mm,\nb,"{uniform}",\nc,90 mm,\nd,,3\n')
    said = command("portfolio", files / "far.csv", files / "house.toml", "--table", files / "far_damage.csv")
    assert said.code == 0, said.err
    table = pd.read_csv(files / "far_damage.csv")
    assert table["p_category_4"].isna().tolist() == [False, True, True, False]
    assert (table["p_category_4_lower"].iloc[1:3] <= 0.1).all()
    assert (table["p_category_4_upper"].iloc[1:3] == 1.0).all()
    assert table["at"].iloc[3] == "3 mm"
    assert "unknown for 2, whose samples were not followed as far" in said.out


@pytest.mark.parametrize(
    ("rows", "sentence"),
    [
        ("name,footing.dept\na,3\n", "line 2: .*unknown key .footing. dept"),
        ("name\na\na\n", "line 2, name = 'a': is the name of another house"),
        ("name,length (m)\na,3x\n", "line 2: .*length = '3x'"),
        ("length (m)\n3\n", "has no column 'name'"),
        ("name,at\na,8\n", "line 2: at 8: give the unit"),
        ("name,at,site_class\na,8 mm,H1\n", "columns 'at' and 'site_class'"),
        ("name,opening.2.x\na,1\n", "opening.2.x = '1': opening.2: there is no such opening; the study has 1"),
        ("name,soil_layer.1.thickness\na,1\n", r"soil_layer: the study has none"),
        (
            "name,joint.strength_factor\na,2\n",
            "line 2: joint.strength_factor: the study draws this number for each wall",
        ),
        ("name,length (m)\na,3000\n", "line 2: .*at most 1000 m"),
    ],
)
def test_a_wrong_row_is_answered_by_a_sentence(files: Path, rows: str, sentence: str) -> None:
    (files / "wrong.csv").write_text(rows)
    with pytest.raises(InputError, match=sentence):
        assess_portfolio(files / "wrong.csv", files / "house.toml", files / "wrong")
    assert not (files / "wrong").exists()


def test_a_map_needs_coordinates_before_any_wall_is_solved(files: Path, command: Run) -> None:
    given = ("portfolio", files / "houses.csv", files / "house.toml", "--folder", files / "no")
    assert "longitude and latitude" in command(*given, "--table", files / "o.gpkg").err
    assert not (files / "no").exists()


def test_the_worst_category_orders_houses_first() -> None:
    """The third house has the most of category 2; two with equal ones are in the order of category 1, unknown last."""
    probability = np.array([[0.5, 0.1], [0.9, 0.1], [0.4, 0.3], [np.nan, np.nan]])
    street = xr.Dataset({"probability": (("house", "category"), probability)})
    assert most_damaged_first(street).tolist() == [2, 1, 0, 3]
