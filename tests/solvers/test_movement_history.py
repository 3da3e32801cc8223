"""Movement in stages: there and back, and from dishing to doming."""

import dataclasses

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred import Scene
from damagepred.damage import load_table
from damagepred.errors import InputError
from damagepred.plotting import draw_history
from damagepred.results.rejudge import judge_again

WALL = {"wall": {"length": 1.92, "height": 0.6}, "dpc": {"course": 2}}
DRY = {"tensile_strength": 0.0, "cohesion": 0.0}


def stage(kind: str, deflection: float, increments: int) -> dict[str, object]:
    return {"kind": kind, "central_deflection": deflection, "increments": increments}


def solved(*stages: dict[str, object], **tables: object) -> xr.Dataset:
    movement = {"central_deflection": max(s["central_deflection"] for s in stages), "stage": list(stages)}
    return damagepred.solve(Scene.from_dict({**WALL, "movement": movement, **tables}))


def test_the_worst_width_stays_and_the_present_one_remains_after_the_cycle() -> None:
    path = solved(stage("dishing", 4e-3, 4), stage("dishing", 0.0, 4), joint=DRY)
    widths = path["crack_width_max"].values
    assert (path["crack_width_worst"].values == np.maximum.accumulate(widths)).all()
    ax = draw_history(path)
    assert ax.get_xlabel().startswith("increment")
    turns = [
        line.get_xdata()[0] for line in ax.lines if line.get_linestyle() == ":" and len(set(line.get_xdata())) == 1
    ]
    assert turns == [4]


def test_the_worst_category_stays_and_is_judged_anew() -> None:
    movement = {"central_deflection": 8e-3, "stage": [stage("dishing", 8e-3, 4), stage("dishing", 0.0, 4)]}
    path = damagepred.solve(Scene.from_dict({"wall": WALL["wall"], "movement": movement}))
    category = path["damage_category"].values
    assert category.max() == 3
    assert category[-1] == 1
    assert (path["damage_category_worst"].values == np.maximum.accumulate(category)).all()
    assert path["damage_category_worst"].attrs["flag_meanings"] == path["damage_category"].attrs["flag_meanings"]
    finer = dataclasses.replace(load_table("as2870"), limits=(1e-5, 2e-5, 3e-5, 4e-5))
    judged = judge_again(path, table=finer)
    assert judged["damage_category_worst"].values[-1] == 4
    assert (judged["damage_category_worst"].values == np.maximum.accumulate(judged["damage_category"].values)).all()


def test_stages_of_time_alone_leave_the_ground_where_it_is() -> None:
    strain = {"movement": {"stage": [{"time": 1.0, "strain": 1e-4}, {"time": 2.0, "strain": 2e-4}]}}
    assert Scene.from_dict(strain).movement.central_deflection == 0.0
    with pytest.raises(InputError, match="nothing moves; give a movement, a strain or creep"):
        Scene.from_dict({"movement": {"stage": [{"time": 1.0}]}})


def test_a_number_of_increments_beside_stages_is_refused() -> None:
    movement = {"central_deflection": 4e-3, "stage": [stage("dishing", 4e-3, 2)]}
    with pytest.raises(InputError, match="stages of the movement have their own"):
        damagepred.solve(Scene.from_dict({**WALL, "movement": movement}), increments=3)
