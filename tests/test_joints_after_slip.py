"""Table of what joints keep after slip: levels, units and derived values; the page that tells it."""

import re

import pandas as pd
import pytest

from damagepred.inputs.data_files import CONFIDENCE, data_file
from damagepred.scene import masonry_library

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
