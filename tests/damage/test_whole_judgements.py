"""Whole judgements of drawn walls, and all tables of damage, number by number, against the lists in ``judgements/``."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from damagepred.assembly import wall_model
from damagepred.damage import (
    Growth,
    beam_strain,
    construction_limits,
    deflection_over_strain,
    deviation_limits,
    find_cracks,
    load_movement_limits,
    load_strain_table,
    load_table,
    sticking_limits,
)
from damagepred.damage.crack_bands import BandGauges
from damagepred.damage.cracks import psi
from damagepred.damage.limits import load_scale
from damagepred.one_wall.judged_path import gauges
from damagepred.scene import Damage, Scene
from tests.damage.pattern import Pattern
from tests.recorded import check_parts, parts_of

LISTS = Path(__file__).parent / "judgements"


def broken_wall(dpc: int | None, growth: float) -> Pattern:
    """Wall with cracks of many forms: wider, longer and slid the more it has grown."""
    wall = Pattern(rows=8, columns=12, dpc=dpc)
    number = np.arange(wall.opening.size).reshape(wall.opening.shape)
    wall.opening[:] = 4e-3 * growth * np.sin(0.9 * number) ** 2 * np.cos(0.1 * number)
    wall.slip[:] = 2e-3 * growth * np.sin(1.7 * number)
    wall.cracked[:] = (np.sin(0.37 * number[:, :1]) > 0.75 - 0.5 * growth) & (wall.opening > 1e-4)
    return wall


@pytest.mark.parametrize("dpc", [None, 2])
def test_a_judgement_is_its_list(dpc: int | None) -> None:
    parts: dict[str, str] = {}
    growth = Growth(broken_wall(dpc, 0.0).map)
    for number, grown in enumerate((0.0, 0.5, 1.0)):
        wall = broken_wall(dpc, grown)
        found = find_cracks(wall.map, wall.opening, wall.slip, wall.cracked)
        parts |= parts_of([found, psi(found)], f"cracks {grown}")
        parts |= parts_of(growth.step(number, wall.opening, wall.slip, wall.cracked), f"traced {grown}")
        for settings in (Damage(), Damage(measure="band", plasterboard=True, count_rule=False, dpc_threshold=5e-4)):
            parts |= parts_of(wall.judge(settings), f"verdict {settings.measure} {grown}")
        for gauge, least in ((0.3, 0.0), (0.6, 1e-3)):
            width = BandGauges.of_joints(wall.map, gauge).width(wall.opening, wall.cracked, least)
            parts |= parts_of(width, f"band {gauge} {grown}")
        parts |= parts_of(wall.map.widest(wall.opening), f"widest {grown}")
    for name in (
        "is_dpc",
        "is_wall",
        "is_base",
        "is_footing",
        "length",
        "dpc_level",
        "wall_neighbours",
        "corner_numbers",
    ):
        parts |= parts_of(getattr(wall.map, name), f"map.{name}")
    check_parts(LISTS / f"dpc_{dpc}.txt", parts)


def test_tables_and_limits_are_their_list() -> None:
    tables: dict[str, Any] = {name: load_table(name) for name in ("as2870", "bre251")}
    tables |= {"plasterboard": load_table("as2870", plasterboard=True), "strain": load_strain_table()}
    tables |= {"movement": load_movement_limits(), "construction": construction_limits()}
    tables |= {"deviation": deviation_limits(), "sticking": sticking_limits()}
    parts = dict(parts_of(tables, "table"))
    parts |= parts_of([limit.value(6.0, 2.4) for limit in load_movement_limits()], "values")
    parts |= parts_of([load_scale(name) for name in ("psi", "tilt")], "scale")
    length, ground = np.array([2.0, 6.0, 18.0]), np.array([-2e-4, 0.0, 3e-4])
    for kind in ("sagging", "hogging"):
        parts |= parts_of(beam_strain(4e-4, length, 2.4, kind, ground_strain=ground), kind)
        parts |= parts_of(deflection_over_strain(length, 2.4, kind, 2.4), f"{kind} ratio")
    check_parts(LISTS / "tables.txt", parts)


def test_slopes_and_distortions_are_their_list() -> None:
    opening = [
        {"kind": "window", "x": 0.5, "y": 0.45, "width": 0.48, "height": 0.3},
        {"kind": "door", "x": 1.6, "width": 0.36, "height": 0.6},
    ]
    wall = {"length": 2.4, "height": 1.05}
    model = wall_model(
        Scene.from_dict({"wall": wall, "opening": opening, "dpc": {"course": 1}, "solver": {"blocks": "rigid"}})
    )
    gauge, blocks = gauges(model), model.n_blocks
    number = np.arange(blocks)
    state = 1e-2 * np.column_stack((np.sin(number), np.cos(2 * number), 0.1 * np.sin(3 * number)))
    parts = dict(parts_of([gauge.lines.deviation(state), gauge.frames.distortion(state), gauge], "gauge"))
    change = np.linspace(-0.03, 0.03, 9)
    parts |= parts_of(sticking_limits().level(np.abs(change) / 3, change, change / 2), "sticking")
    parts |= parts_of(deviation_limits().level(np.abs(change) / 2, np.abs(change) / 4), "deviation")
    check_parts(LISTS / "shape.txt", parts)
