"""Results of a house by wall, by room and at its corners, against each wall taken out and judged alone."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import damagepred
from damagepred.damage import load_table
from damagepred.results.house import house_of, room_bays, room_sides, wall_dataset, wall_names
from damagepred.results.tables import Table, corner_columns, room_columns, wall_columns
from damagepred.scene import Scene

WALL = {"height": 0.6, "bond": "stack"}
ENDS = {"front": ([0, 0], [2.16, 0]), "right": ([2.16, 0], [2.16, 1.2]), "back": ([2.16, 1.2], [0, 1.2])}
PLAN = {**ENDS, "left": ([0, 1.2], [0, 0]), "cross": ([0.96, 0], [0.96, 1.2])}


def plan(ends, **tables):
    walls = [{"name": name, "start": a, "end": b, **WALL, **tables.pop(name, {})} for name, (a, b) in ends.items()]
    mound = {"shape": "corner", "point": [0, 0], "reach": 1.2, "surface_movement": "60 mm"}
    return Scene.from_dict(
        {"wall": walls, "mound": mound, "movement": {"kind": "settle", "increments": 3}, "corner": {"brittle": True}}
        | tables
    )


@pytest.fixture(scope="module")
def solved():
    door = [{"kind": "door", "x": 1.2, "width": 0.48, "height": 0.45}]
    weak = {"tensile_strength": 2e4, "cohesion": 4e4}
    return damagepred.solve(plan(PLAN, front={"opening": door}, joint=weak))


def test_another_table_judges_each_wall_and_the_house_is_its_worst(solved):
    strict = load_table("as2870")
    strict = replace(strict, name="strict", limits=tuple(limit / 20 for limit in strict.limits))
    assert int(solved["damage_category"][-1]) >= 1
    again = damagepred.judge_again(solved, table=strict)
    alone = [damagepred.judge_again(wall_dataset(solved, name), table=strict) for name in wall_names(solved)]
    expected = np.stack([one["damage_category"].values for one in alone], axis=-1)
    assert (again["wall_damage_category"].values == expected).all()
    assert (again["damage_category"].values == expected.max(axis=-1)).all()
    assert (again["damaged_walls"].values == (expected >= 1).sum(axis=-1)).all()
    assert again["damaged_walls"][-1] > solved["damaged_walls"][-1]
    assert again["damage_category"].attrs["flag_meanings"] == again["wall_damage_category"].attrs["flag_meanings"]
    back = damagepred.judge_again(again, table="as2870")
    assert (back["wall_damage_category"] == solved["wall_damage_category"]).all()
    assert np.array_equal(wall_dataset(again, "front")["deviation_level"], alone[0]["deviation_level"])


def test_cracks_are_numbered_on_from_wall_to_wall(solved):
    found = damagepred.cracks(solved)
    alone = [damagepred.cracks(wall_dataset(solved, name)) for name in wall_names(solved)]
    counts = [one.sizes["crack"] for one in alone]
    assert found["crack"].values.tolist() == list(range(1, sum(counts) + 1))
    assert np.bincount(found["crack_wall"].values, minlength=5).tolist() == counts
    assert found["crack_width"].values == pytest.approx(np.hstack([w["crack_width"] for w in alone]), nan_ok=True)
    frame = damagepred.crack_frame(found)
    widest = frame.groupby("crack_wall")["crack_width"].max()
    assert widest.max() == pytest.approx(float(solved["crack_width_max"][-1]), abs=2e-5)
    pieces = damagepred.crack_profile(solved)
    assert set(pieces["piece_crack"].values) <= set(found["crack"].values)
    assert (found["crack_wall"].values[pieces["piece_crack"].values - 1] == pieces["piece_wall"].values).all()


def test_a_table_has_the_increments_of_each_wall(solved):
    frame = damagepred.frame(solved)
    assert frame.index.names == ["wall", "increment"]
    assert frame.loc["front", "crack_width_max"].values == pytest.approx(solved["wall_crack_width_max"].values[:, 0])


def test_scales_count_the_states_of_all_walls(solved):
    scales = damagepred.compare_scales(solved)
    assert scales["level"].dims == ("scale", "increment", "wall")
    one = damagepred.compare_scales(wall_dataset(solved, "front"))
    assert (scales["level"].sel(scale=one["scale"])[..., 0] == one["level"]).all()


def test_rooms_have_the_sides_of_their_walls(solved):
    house = house_of(solved)
    rooms = room_bays(house)
    named = [{(house.names[w], round(a, 2), round(b, 2)) for w, a, b in room} for room in rooms]
    assert named == [
        {("front", 0.0, 0.96), ("cross", 0.0, 1.2), ("back", 1.2, 2.16), ("left", 0.0, 1.2)},
        {("front", 0.96, 2.16), ("right", 0.0, 1.2), ("back", 0.0, 1.2), ("cross", 0.0, 1.2)},
    ]
    sides = room_sides(solved)
    of_front = sides[sides["wall"] == "front"]
    assert of_front["crack_width_max"].max() == float(solved["wall_crack_width_max"][-1, 0])
    assert sides["damage_category"].max() == int(solved["damage_category"][-1])
    assert sides.groupby("room")["x"].first().to_list() == pytest.approx([0.48, 1.56])
    assert room_sides(solved, 0)["crack_width_max"].max() == float(solved["crack_width_max"][0])


def test_a_nib_in_a_room_is_one_of_its_sides_and_open_plans_have_no_room():
    open_plan = {**{name: ENDS[name] for name in ("front", "right")}, "nib": ([1.2, 0], [1.2, 0.6])}
    assert room_bays(plan(open_plan)) == []
    nib = plan({**ENDS, "left": ([0, 1.2], [0, 0]), "nib": ([1.2, 0], [1.2, 0.6])})
    assert [(4, 0.0, 0.6) in room for room in room_bays(nib)] == [True]


def test_tables_of_a_house_have_walls_corners_and_sides_of_rooms(solved):
    walls, corners, rooms = (make(solved) for make in (wall_columns, corner_columns, room_columns))
    assert walls[0].cells == list(PLAN)
    assert [*map(float, walls[1].cells)] == pytest.approx(1e3 * solved["wall_crack_width_max"].values[-1], abs=1e-3)
    assert len(corners[0].cells) == 6
    assert [*map(float, corners[-1].cells)] == pytest.approx(1e3 * solved["corner_slip_max"].values[-1], abs=1e-3)
    assert len(rooms[0].cells) == 8
    for make in (partial(Table.of, ""), partial(Table.brief, "")):
        assert all(make(columns).rows for columns in (walls, corners, rooms))


def test_one_wall_by_its_name(solved):
    assert solved.damagepred.wall("cross").attrs["title"].endswith("cross")
    with pytest.raises(damagepred.InputError, match="Did you mean 'cross'"):
        solved.damagepred.wall("crosss")


def test_a_study_of_houses_gives_the_study_of_one_wall(solved):
    numbers = ["damage_category", "crack_width_max", "surface_movement", "wall_damage_category", "wall_crack_width_max"]
    study = solved[[*numbers, "wall_central_deflection", "wall"]].expand_dims(sample=[0, 1]).copy(deep=True)
    study["status"] = ("sample", np.zeros(2, np.int8))
    study["wall"] = solved["wall"]
    study["wall_crack_width_max"].values[1] *= 3
    front = wall_dataset(study.assign_attrs(scene=solved.attrs["scene"]), "front")
    assert front["crack_width_max"].dims == ("sample", "increment")
    assert front["crack_width_max"].values[1] == pytest.approx(3 * solved["wall_crack_width_max"].values[:, 0])
    again = damagepred.judge_again(study.assign_attrs(solved.attrs), table="bre251")
    assert again["wall_damage_category"].dims == ("sample", "increment", "wall")
