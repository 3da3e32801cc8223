"""Every shipped figure has one of four levels of confidence; the table of what joints keep after slip."""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from damagepred import Scene
from damagepred.campaign.settings import StudySettings
from damagepred.damage.limits import load_movement_limits
from damagepred.inputs.data_files import CONFIDENCE, data_file, data_folder
from damagepred.report.inputs import input_section
from damagepred.scene import masonry_library

PACKAGE = Path(__file__).resolve().parent.parent / "damagepred"
RETIRED = re.compile(r"from memory|remembered from|(?<!\w)\((seed|read|memory|inferred)\)|\b(not looked up)\b")
FILES = sorted(
    p.relative_to(data_folder()).as_posix() for p in data_folder().rglob("*.toml") if p.parent.name != "data"
)


def levels(table: Any, place: str = "") -> Iterator[tuple[str, str]]:
    """Yield each level of confidence in a table, with its place."""
    for key, value in table.items() if isinstance(table, dict) else enumerate(table):
        if str(key) == "confidence" or str(key).endswith("_confidence"):
            yield f"{place}.{key}", value
        elif isinstance(value, dict | list):
            yield from levels(value, f"{place}.{key}")


def test_the_levels_are_four() -> None:
    assert tuple(CONFIDENCE) == ("reported", "secondary", "derived", "assumed")


@pytest.mark.parametrize("name", FILES)
def test_data_files_use_the_levels(name: str) -> None:
    text = (data_folder() / name).read_text(encoding="utf-8")
    found = dict(levels(tomllib.loads(text)))
    assert found, name
    assert set(found.values()) <= set(CONFIDENCE), found
    assert not RETIRED.search(text)
    assert not re.search(r"memory|inferred|remembered", text)


def test_limits_of_movement_have_a_level() -> None:
    assert {limit.confidence for limit in load_movement_limits()} <= set(CONFIDENCE)


def test_the_package_speaks_of_no_other_level() -> None:
    assert [p.name for p in PACKAGE.rglob("*.py") if RETIRED.search(p.read_text(encoding="utf-8"))] == []


def test_the_report_names_and_explains_the_levels_it_uses() -> None:
    settings = StudySettings.from_toml(data_folder() / "bryant_study.toml")
    scene = Scene.from_toml(data_folder() / "bryant_window_dishing_40mm.toml")
    text = repr(input_section(scene, settings))
    assert not RETIRED.search(text)
    for name in ("reported", "assumed"):
        assert f"({name}): {CONFIDENCE[name]}" in text


TABLE = pd.read_csv(data_file("statistics", "joints_after_slip.csv"))
UNITS = {"MPa", "N/m", "mm", "1"}


def values(quantity: str, **where: str) -> list[float]:
    rows = TABLE[TABLE.quantity == quantity]
    for column, text in where.items():
        rows = rows[rows[column].str.contains(text, regex=False, na=False)]
    return rows["value"].dropna().tolist()


def test_each_row_has_a_level_a_unit_a_source_and_a_value() -> None:
    assert set(TABLE.confidence) <= set(CONFIDENCE)
    assert set(TABLE.unit) <= UNITS
    assert TABLE[["quantity", "joint", "test", "source"]].notna().all(axis=None)
    numbers = TABLE[["value", "lower", "upper", "cov"]]
    assert numbers.notna().any(axis=1).all()
    assert (TABLE.lower.isna() == TABLE.upper.isna()).all()
    assert (TABLE.lower.dropna() <= TABLE.upper.dropna()).all()
    assert not (TABLE.source.str.contains("van der Pluijm") & (TABLE.confidence == "reported")).any()


def test_derived_ratios_follow_from_the_rows_they_are_of() -> None:
    shear, flexural = values("shear_over_flexural_bond", source="Gooch"), values("flexural_over_direct_bond")
    assert values("cohesion_over_tensile_strength", source="Gooch") == pytest.approx([shear[0] * flexural[0]], rel=2e-3)
    for source in ("Zhuge", "panel J4D"):
        ratio = values("cohesion", source=source)[0] / values("tensile_strength", source=source)[0]
        assert values("cohesion_over_tensile_strength", source=source) == pytest.approx([ratio], rel=5e-3)
    (energy,) = values("shear_fracture_energy", masonry="1940s")
    assert values("slip_to_lose_cohesion", joint="masonry") == pytest.approx([2e-3 * energy / 0.17], rel=2e-3)


def test_the_library_has_the_values_of_the_table() -> None:
    library = masonry_library()
    for name, key, rows in (
        (
            "clay brick, Dutch, 1940s, joints",
            "tensile_strength",
            values("tensile_strength", test="spandrels", joint="bed"),
        ),
        ("clay brick, Dutch, shear panels", "cohesion", values("cohesion", source="panel J4D")),
        ("calcium silicate brick, Dutch", "cohesion", values("cohesion", masonry="calcium silicate brick, Dutch")),
        ("clay brick, Australian, 1990s", "cohesion", values("cohesion", source="Zhuge")),
    ):
        assert [1e-6 * library[name].values[f"joint.{key}"].mean] == pytest.approx(rows)


def test_sets_that_belong_together_soften() -> None:
    for name, material in masonry_library().items():
        together = not material.calibrated_on.startswith("nothing")
        assert {"joint.fracture_energy", "joint.shear_fracture_energy"} <= set(material.values) or not together, name


def test_the_page_has_the_ranges_of_the_table() -> None:
    page = data_file("README.md").read_text(encoding="utf-8")
    rows = TABLE[(TABLE.quantity == "cohesion_over_tensile_strength") & (TABLE.joint == "bed")].value
    assert f"{rows.min():g} to {rows.max():g}" in page
    assert re.search(r"cohesion left after slip, MPa \| 0 \|", page)
    assert TABLE[TABLE.quantity == "residual_cohesion"].value.eq(0.0).all()
