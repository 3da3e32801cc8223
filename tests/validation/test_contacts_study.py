"""The study of contacts: its closed form, and its rows for a small wall."""

import runpy
from dataclasses import replace
from pathlib import Path

import pytest

RUN = runpy.run_path(str(Path(__file__).resolve().parents[2] / "studies" / "contacts" / "run.py"))


def test_three_contacts_at_two_fifths_by_hand() -> None:
    """The right one (1/6) carries 4.8 N/k, the middle (4/6) 0.3 N/k over b/2: 9 N/(k b) in place of 2 N/(k b 0.3²)."""
    assert RUN["rotation_error"](RUN["RULES"]["3 Lobatto"], 0.4) == pytest.approx(9 / (2 / 0.09) - 1, abs=1e-3)


@pytest.mark.parametrize("share", RUN["SHARES"])
def test_the_default_stays_within_a_tenth(share: float) -> None:
    assert abs(RUN["rotation_error"](RUN["RULES"]["4 x 3 Lobatto (default)"], share)) < 0.1


def test_rows_of_a_small_dry_wall() -> None:
    wall = RUN["dry_wall"]("dishing", 0.72, 0.225)
    walls = {"small": replace(wall, movement=replace(wall.movement, increments=2, central_deflection=1e-3))}
    costs = list(RUN["cost_rows"](walls))
    assert [row[1] for row in costs] == ["1", "2", "4", "8"]
    assert all(int(row[3]) > 0 for row in costs)
    on, off = RUN["step_rows"](walls)
    assert (on[1], off[1]) == ("on", "off")
    assert float(on[3].split()[0]) < 1.0
