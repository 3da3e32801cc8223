"""The worked design study: its files are valid, and what it publishes follows from its search."""

from pathlib import Path

import pytest

from damagepred.study.analyses.design_search import search_design

ROOT = Path(__file__).resolve().parents[2]
STUDY = ROOT / "studies" / "design"


@pytest.mark.parametrize("site", ["m", "h1"])
def test_a_few_walls_of_each_alternative(site: str, tmp_path: Path) -> None:
    """Three footings and four layouts of joints: with two walls each nothing is decided, and costs are those said."""
    text = (STUDY / f"class_{site}.toml").read_text(encoding="utf-8")
    text = text.replace("first = 64", "first = 2").replace("most = 512", "most = 2")
    house = (STUDY / "house.toml").read_text(encoding="utf-8").replace("increments = 12", "increments = 3")
    (tmp_path / "choices.toml").write_text(text, encoding="utf-8")
    (tmp_path / "house.toml").write_text(house, encoding="utf-8")
    found = search_design(tmp_path / "choices.toml", tmp_path / "out")
    assert found.sizes == {"alternative": 12, "measure": 5}
    assert found["cost"].values.tolist() == [c + j for c in (0.0, 900.0, 1900.0) for j in (0.0, 500.0, 600.0, 1000.0)]
    assert (found["probability_lower"] <= found["probability"]).all()
    page = (STUDY / "README.md").read_text(encoding="utf-8")
    for name, cost in zip(found["alternative"].values, found["cost"].values):
        assert f"| {name} | {cost:.0f} |" in page
