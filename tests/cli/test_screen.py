"""Tables on a screen of 80 columns: nothing wider, no word broken."""

from __future__ import annotations

import re

import numpy as np
import pytest
import xarray as xr
from rich.console import Console

import damagepred
from damagepred.cli import terminal
from damagepred.scene import Damage, Dpc, Movement, Opening, Scene, Wall


@pytest.fixture(scope="module")
def every_column() -> xr.Dataset:
    """A wall with every column that there is, and numbers as long as walls have them."""
    ds = damagepred.solve(
        Scene(
            wall=Wall(length=2.4, height=0.9),
            dpc=Dpc(course=2),
            damage=Damage(table="bre251", footing_threshold=5e-4),
            opening=(
                Opening(kind="window", x=0.48, y=0.45, width=0.48, height=0.3),
                Opening(kind="door", x=1.44, width=0.48, height=0.6),
            ),
            movement=Movement(central_deflection=4e-3, increments=5),
        )
    )
    mm = np.arange(6) * 10.7e-3
    ds["surface_movement"] = ("increment", np.arange(6) * 25e-3)
    for name in ("central_deflection", "crack_width_max", "crack_band_width_max", "footing_opening_max"):
        ds[name] = (ds[name].dims, mm, ds[name].attrs)
    for name in ("damage_category", "damage_category_band"):
        ds[name] = (ds[name].dims, np.arange(6, dtype=np.int8), ds[name].attrs)
    ds["footing_separation_length"] = (("increment",), mm, ds["footing_separation_length"].attrs)
    ds["opening_width_change"] = ds["opening_width_change"].copy(data=np.stack((mm, -mm), axis=1))
    return ds


@pytest.fixture
def on_80_columns(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> pytest.CaptureFixture[str]:
    monkeypatch.setattr(terminal, "_out", Console(soft_wrap=True, highlight=False, width=80))
    return capsys


def cells(text: str) -> list[list[str]]:
    return [[c.strip() for c in re.split("[│┃]", line)[1:-1]] for line in text.splitlines() if line[:1] in ("│", "┃")]


def test_the_table_of_a_wall_with_every_column_fits(
    every_column: xr.Dataset, on_80_columns: pytest.CaptureFixture[str]
):
    terminal.wall_table(every_column)
    text = on_80_columns.readouterr().out
    table = [line for line in text.splitlines() if line[:1] in "┏┡└│┃"]
    assert max(map(len, table)) <= 80
    rows = [row for row in cells(text) if row[0] in ("0", "25", "50", "75", "100", "125")]
    names = ["0 negligible", "1 very slight", "2 slight", "3 moderate", "4 severe", "5 very severe"]
    assert [row[4] for row in rows[:6]] == names
    assert len(rows) == 12  # each increment is a line of two tables, told apart by the movement of the ground
    assert sum(len(row) - 1 for row in rows) == 6 * 10
    assert rows[5][1:4] == ["53.50", "53.500", "53.500 (5)"]
    heads = [" ".join(filter(None, words)) for words in zip(*cells(text)[:3])]
    assert heads == [
        "surface movement mm",
        "deflection mm",
        "widest crack mm",
        "band, mm and its category",
        "damage category",
    ]


def test_a_usual_wall_is_one_table(every_column: xr.Dataset, on_80_columns: pytest.CaptureFixture[str]):
    """One opening and a dpc, categories and widths below 10 mm: no second table."""
    ds = every_column.drop_vars("surface_movement").isel(opening=[0])
    ds["footing_separation_length"] = 0.0 * ds["footing_separation_length"]
    for name in ("crack_width_max", "crack_band_width_max"):
        ds[name] = 0.1 * ds[name]
    ds["footing_separation_length"].attrs = every_column["footing_separation_length"].attrs
    terminal.wall_table(ds)
    text = on_80_columns.readouterr().out
    assert "continued" not in text
    assert [row[3] for row in cells(text)[-6:]][1] == "1 very slight"
    assert {len(row) for row in cells(text)} == {7}
