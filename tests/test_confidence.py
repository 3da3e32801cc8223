"""Every shipped figure has one of four levels of confidence, and users read no other."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from damagepred import Scene
from damagepred.campaign.settings import StudySettings
from damagepred.damage.limits import load_movement_limits
from damagepred.inputs.data_files import CONFIDENCE, data_folder
from damagepred.report.inputs import input_section

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
