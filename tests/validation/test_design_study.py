"""The worked design study: its files are valid, and what it publishes follows from them."""

from pathlib import Path

import pytest

from damagepred.study.analyses.design_search import price_of_search, search_design

ROOT = Path(__file__).resolve().parents[2]
STUDY = ROOT / "studies" / "design"


@pytest.mark.parametrize("site", ["m", "h1"])
def test_files_are_valid_and_the_page_has_their_alternatives(site: str) -> None:
    """Three footings and four layouts of joints, each with its cost on the page."""
    assert price_of_search(STUDY / f"class_{site}.toml", 2).startswith("12 alternatives")
    page = (STUDY / "README.md").read_text(encoding="utf-8")
    for footing, cost in (("300 x 300", 0), ("300 x 500", 900), ("300 x 700", 1900)):
        for joint, more in (("no joint", 0), ("one between the windows", 500), ("two between the windows", 1000)):
            assert page.count(f"| {footing} + {joint} | {cost + more} |") == 2


def test_a_few_walls_of_two_alternatives(tmp_path: Path) -> None:
    """With two walls each nothing is decided, and costs are those said."""
    text = (STUDY / "class_h1.toml").read_text(encoding="utf-8")
    options = text.split("[[choice.option]]")
    head, joints = options[0].replace('name = "footing"', 'name = "joints"'), options[4:6]
    text = "[[choice.option]]".join([head, *(joint.partition("[[choice]]")[0] for joint in joints)])
    (tmp_path / "choices.toml").write_text(text.replace("64", "2").replace("512", "2"), encoding="utf-8")
    house = (STUDY / "house.toml").read_text(encoding="utf-8").replace("increments = 12", "increments = 3")
    (tmp_path / "house.toml").write_text(house, encoding="utf-8")
    found = search_design(tmp_path / "choices.toml", tmp_path / "out")
    assert found["cost"].values.tolist() == [0.0, 500.0]
    assert found["samples"].values.tolist() == [2, 2]
    assert (found["probability_lower"] <= found["probability"]).all()
