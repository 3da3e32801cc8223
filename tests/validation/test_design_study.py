"""The worked design study: its files are valid, and what it publishes follows from them."""

import sys
from pathlib import Path
from types import ModuleType

import pytest

from damagepred.analyses.design_search import Choices, price_of_search, search_design
from damagepred.inputs.input_files import read_toml
from damagepred.scene.reading import build
from tests.validation.test_validation_cases import module

ROOT = Path(__file__).resolve().parents[2]
STUDY = ROOT / "studies" / "design"


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.delitem(sys.modules, "judging", raising=False)
    return module("design_run", STUDY / "run.py")


def test_files_are_valid_and_the_page_has_their_alternatives(run: ModuleType, tmp_path: Path) -> None:
    """Three footings and four layouts of joints, each with its cost on the page, for two classes and two targets."""
    assert price_of_search(STUDY / "choices.toml", 2).startswith("12 alternatives")
    asked, file = set(), tmp_path / "choices.toml"
    for site in run.CLASSES:
        for target in run.TARGETS.values():
            file.write_text(run.choices(site, target), encoding="utf-8")
            choices = build(Choices, read_toml(file), str(file))
            asked.add(str(choices.target))
            assert len(choices.alternatives()) == 12
    assert asked == {
        *(f"P(category >= 2 at {site}) <= 0.05" for site in ("M", "H1")),
        *(f"expected cost with repairs at {site}" for site in ("M", "H1")),
    }
    page = (STUDY / "README.md").read_text(encoding="utf-8")
    for footing, cost in (("300 x 300", 0), ("300 x 500", 900), ("300 x 700", 1900)):
        for joint, more in (("no joint", 0), ("one between the windows", 500), ("two between the windows", 1000)):
            shown = 4 if cost + more <= 1400 else 0  # the six cheapest
            assert page.count(f"| {footing} + {joint} | {cost + more} |") == shown


@pytest.mark.thorough
def test_a_few_walls_of_two_alternatives(run: ModuleType, tmp_path: Path) -> None:
    """With two walls each nothing is decided, and costs are those said; the same walls answer for both targets."""
    text = (STUDY / "choices.toml").read_text(encoding="utf-8")
    options = text.split("[[choice.option]]")
    head, joints = options[0].replace('name = "footing"', 'name = "joints"'), options[4:6]
    text = "[[choice.option]]".join([head, *(joint.partition("[[choice]]")[0] for joint in joints)])
    (tmp_path / "choices.toml").write_text(text.replace("64", "2").replace("128", "2"), encoding="utf-8")
    house = (STUDY / "house.toml").read_text(encoding="utf-8").replace("increments = 12", "increments = 3")
    (tmp_path / "house.toml").write_text(house, encoding="utf-8")
    found = search_design(tmp_path / "choices.toml", tmp_path / "out")
    assert found["cost"].values.tolist() == [0.0, 500.0]
    assert found["samples"].values.tolist() == [2, 2]
    assert (found["probability_lower"] <= found["probability"]).all()
    assert "| no joint | 0 | " in run.table(found)
    text = (tmp_path / "choices.toml").read_text(encoding="utf-8").replace(run.ASKED, run.REPAIRS)
    (tmp_path / "choices.toml").write_text(text, encoding="utf-8")
    by_cost = search_design(tmp_path / "choices.toml", tmp_path / "out")
    assert by_cost["cost"].values.tolist() == [0.0, 500.0]
    assert (by_cost["expected_cost"] >= by_cost["cost"]).all()
    assert "| joints: one between the windows | " in run.table(by_cost)
