"""Plan of a house: corners and T-joints, refusals, ground in two directions."""

import tomllib

import numpy as np
import pytest

from damagepred.errors import InputError
from damagepred.scene import House, Scene
from damagepred.scene.plan_ground import drift
from damagepred.scene.what_moves import what_moves


def wall(name, start, end, **more):
    return {"name": name, "start": start, "end": end, **more}


TREE = {"mound": {"shape": "tree", "point": [-1, 0], "reach": 5}, "movement": {"kind": "settle"}}
ELL = [wall("front", [0, 0], [6, 0]), wall("side", [6, 0], [6, 4])]


def house(walls, **tables):
    return Scene.from_dict({"wall": walls, **(tables or TREE)})


def test_a_list_of_walls_is_a_house_and_a_table_a_scene():
    assert isinstance(house(ELL), House)
    assert type(Scene.from_dict({"wall": {"length": 6.0}})) is Scene


def test_corners_and_tees_follow_from_the_plan():
    walls = [*ELL, wall("cross", [2, 0], [2, "4000 mm"])]
    made = house(walls)
    places = {j.walls: (j.x, j.point, j.share) for j in made.junctions}
    assert places == {(0, 1): ((6.0, 0.0), (6.0, 0.0), 1.0), (0, 2): ((2.0, 0.0), (2.0, 0.0), 1.0)}
    star = [
        wall("e", [0, 0], [2, 0]),
        wall("n", [0, 0], [0, 2]),
        wall("w", [-2, 0], [0, 0]),
        wall("s", [0, -2], [0, 0]),
    ]
    assert [j.share for j in house(star).junctions] == [0.5] * 6  # of four walls, each pair has 2 / 4


@pytest.mark.parametrize(
    ("second", "words"),
    [
        (([3, -1], [3, 2]), r"'front' and 'b' cross at \(3, 0\) m, 3 m along 'front'"),
        (([6.08, 0], [6.08, 3]), r"the end of 'front' at \(6, 0\) m leaves a gap of 80 mm .*'b'.*\(6.08, 0\) m"),
        (([9, 0], [9, 3]), "'b' stands 3 m off 'front'"),
        (([3, 0.3], [3, 3]), r"the start of 'b' at \(3, 0.3\) m leaves a gap of 300 mm .*let it end at \(3, 0\) m"),
        (([2, 0], [9, 0]), "'front' and 'b' lie on each other over 4 m"),
        (([0, -0.04], [0, 2]), r"the start of 'b' stands out 40 mm beyond the axis of 'front'; .*\(0, 0\) m"),
        (([0, 0], [6, 0.3]), "'front' and 'b' meet at 2.86 degrees"),
        (([3, 0], [6, 0.3]), "'front' and 'b' meet at 5.71 degrees"),
        (([6, 0], [0, 0]), "'front' and 'b' lie on each other over 6 m"),
        (([6, 0], [6, 0]), "start and end of wall 'b' are 0 mm apart"),
    ],
)
def test_a_wrong_plan_is_refused_with_a_number(second, words):
    with pytest.raises(InputError, match=words):
        house([ELL[0], wall("b", *second)])


@pytest.mark.parametrize(
    ("walls", "tables", "words"),
    [
        ([], {}, "empty list"),
        ([ELL[0], {**ELL[1], "name": "front"}], TREE, "two walls have the name 'front'"),
        ([{**ELL[0], "name": "a b"}], TREE, "one word"),
        ([{**ELL[0], "length": 5}], TREE, r"follows from start and end \(6 m\)"),
        ([{**ELL[0], "lenth": 5}], TREE, "Did you mean 'length'"),
        (ELL, {"movement": {"shape": "parabola"}}, "take 'mound'"),
        (ELL, {**TREE, "opening": [{"x": 1, "y": 1, "width": 1, "height": 1}]}, r"\[\[wall.opening\]\]"),
        (ELL, {**TREE, "loads": {"roof": "3 kN/m"}}, r"^scene: loads.roof: .*\[wall.loads\] .*\.$"),
        (ELL, {**TREE, "strain": {"growth": 1e-4}}, "strain"),
        (ELL, {**TREE, "solver": {"blocks": "deformable"}}, "rigid or elastic"),
        (
            [*ELL, wall("back", [6, 4], [0, 4]), wall("tee", [3, 0.3], [3, 4])],
            TREE,
            r"the start of 'tee' at \(3, 0.3\) m leaves a gap of 300 mm to the axis of 'front'; .*\(3, 0\) m",
        ),
        (
            [{**ELL[0], "opening": [{"x": 1, "y": 1, "width": 1.5, "height": 1}]}, wall("tee", [2, 0], [2, 3])],
            TREE,
            "'tee' meets 'front' 2 m along it, at its opening 1 from 1 to 2.5 m; leave 55 mm",
        ),
        (
            [{**ELL[0], "opening": [{"x": 2.05, "y": 1, "width": 1.5, "height": 1}]}, wall("tee", [2, 0], [2, 3])],
            TREE,
            "'tee' meets 'front' 2 m along it, at its opening 1 from 2.05 to 3.55 m; leave 55 mm",
        ),
        (
            [{**ELL[0], "opening": [{"x": 4.5, "y": 1, "width": 1.5, "height": 1}]}, ELL[1]],
            TREE,
            "meets 'front' 6 m along it, at its opening 1 from 4.5 to 6 m; leave 55 mm",
        ),
        (ELL, {"mound": {"shape": "walsh"}}, r"at x = 0 m walls cover 0 of 4 m"),
        (ELL, {"mound": {"shape": "tree"}, "movement": {"kind": "settle"}}, "point: is missing"),
        (ELL, {"mound": TREE["mound"]}, "goes with kind = 'settle' or 'heave'"),
        (ELL, {**TREE, "mound": {**TREE["mound"], "position": 2}}, "in plan take point"),
        (ELL, {**TREE, "mound": {"shape": "corner", "point": [5, 0]}}, "1 m off the nearest corner"),
        (
            [{**ELL[0], "opening": [{"x": 5.5, "y": 1, "width": 1, "height": 1}]}],
            TREE,
            "wall 'front': .*outside the wall",
        ),
    ],
)
def test_a_house_refuses_what_it_does_not_do(walls, tables, words):
    with pytest.raises(InputError, match=words):
        Scene.from_dict({"wall": walls, **tables})


def test_a_breast_may_stand_nearer_to_a_wall_than_a_passage():
    breast = [wall("l", [2, 0], [2, 0.36]), wall("f", [2, 0.36], [3.2, 0.36]), wall("r", [3.2, 0.36], [3.2, 0])]
    tree = {**TREE, "mound": {**TREE["mound"], "surface_movement": 0.01}}
    assert len(house([*ELL, *breast], **tree).junctions) == 5


def test_a_house_is_written_and_read_and_its_numbers_have_keys():
    opening = {"x": 1, "y": 0.9, "width": 1, "height": 1.2}
    made = house([{**ELL[0], "loads": {"roof": "3 kN/m"}, "opening": [opening]}, ELL[1]])
    assert made.scenes[0].loads.roof == 18e3
    assert Scene.from_dict(tomllib.loads(made.to_toml())) == made
    changed = made.with_values({"wall.front.opening.1.width": 0.8, "wall.side.thickness": 0.23, "corner.pressure": 1e4})
    assert [s.wall.thickness for s in changed.scenes] == [0.11, 0.23]
    assert changed.scenes[0].opening[0].width == 0.8
    assert made.unit_of("wall.front.thickness") == "m"


SQUARE = [wall("a", [0, 0], [4, 0]), wall("b", [4, 0], [4, 4]), wall("c", [4, 4], [0, 4]), wall("d", [0, 4], [0, 0])]


def test_mounds_of_clay_span_the_outline_in_both_directions():
    mound = {"shape": "walsh", "edge_distance": 1.0, "surface_movement": "40 mm"}
    both = house(SQUARE, mound=mound, movement={"kind": "doming"})
    nearest = house(SQUARE, mound={**mound, "in_plan": "nearest_edge"}, movement={"kind": "doming"})
    points = np.array([[2.0, 2.0], [2.0, 0.0], [0.0, 0.0], [0.5, 2.0]])
    edge = 0.7 * 0.04
    assert both.surface(points) == pytest.approx([0.0, -edge, -2 * edge, -edge / 4])
    assert nearest.surface(points) == pytest.approx([0.0, -edge, -edge, -edge / 4])


def test_each_wall_reads_the_mound_of_its_direction():
    one = Scene.from_dict({"wall": {"length": 4.0}, "movement": {"shape": "mound", "kind": "doming"}})
    x = np.linspace(0.0, 4.0, 9)
    made = house(SQUARE, movement={"kind": "doming"})
    along = made.surface(made.wall[1].points(x))
    assert along - along[4] == pytest.approx(one.ground_rise(x), abs=1e-15)


def test_points_axes_and_planes_of_ground():
    at = np.array([[0.0, 0.0], [3.0, 4.0], [4.0, 0.0]])

    def rise(**mound):
        return house(SQUARE, mound={"surface_movement": 0.02, **mound}, movement={"kind": "settle"}).surface(at)

    assert rise(shape="tree", point=[0, 0], reach=10) == pytest.approx([-0.02, -0.005, -0.02 * 0.36])
    assert rise(shape="pipe", point=[0, 0], reach=8)[[0, 2]] == pytest.approx([-0.02, -0.01])
    assert rise(shape="corner", point=[4, 0], reach=4) == pytest.approx([0.0, 0.0, -0.02], abs=1e-12)
    assert rise(shape="tilt", direction=0) == pytest.approx([0.0, -0.015, -0.02])
    assert rise(shape="tunnel", point=[0, 4], direction=0, reach=2) == pytest.approx(-0.02 * np.exp([-2.0, 0.0, -2.0]))
    tunnel = house(
        SQUARE,
        mound={"shape": "tunnel", "point": [0, 4], "tunnel_depth": 8, "surface_movement": 0.02},
        movement={"kind": "settle"},
    )
    moved = drift(tunnel.mound, at, tunnel.outline, "settle")
    assert moved[:, 0] == pytest.approx(0.0)
    assert moved[0, 1] == pytest.approx(0.02 * np.exp(-0.5) * 4 / 8)  # towards the axis


def test_levels_of_a_grid_are_read_with_sign_and_size(tmp_path):
    rows = "\n".join(f"{x};{y};{-2 * x - 3 * y}" for x in (0, 4) for y in (-1, 2, 5))
    (tmp_path / "levels.csv").write_text(f"x (m);y (m);level (mm)\n{rows}\n")
    text = house(SQUARE, mound={"shape": "pipe", "point": [0, 0]}, movement={"kind": "settle"}).to_dict()["wall"]
    made = Scene.from_file_tables({"wall": text, "mound": {"shape": "levels", "levels": "levels.csv"}}, tmp_path, "f")
    assert made.movement.kind == "settle"
    assert made.surface(np.array([[1.0, 3.0], [4.0, 0.5]])) == pytest.approx([-0.011, -0.0095])
    (tmp_path / "levels.csv").write_text("x (m);y (m);level (mm)\n0;0;0\n0;4;1\n2;0;2\n2;4;3\n")
    with pytest.raises(InputError, match="go from x = 0 to 2 m, the house from 0 to 4 m"):
        Scene.from_file_tables({"wall": text, "mound": {"shape": "levels", "levels": "levels.csv"}}, tmp_path, "f")


def test_levels_of_a_grid_are_read_by_their_names(tmp_path):
    """In any order, as settlements, and of two visits; a file of three columns in another order was read as x, y."""
    grid = [(x, y) for x in (0, 4) for y in (-1, 2, 5)]
    text = house(SQUARE, mound={"shape": "pipe", "point": [0, 0]}, movement={"kind": "settle"}).to_dict()["wall"]
    head = "settlement (mm),point,y (m),x (m),date\n"
    rows = "".join(f"{5 if day < '2023' else 5 + 2 * x + 3 * y},P,{y},{x},{day}\n" for day in VISITS for x, y in grid)

    def surface(content):
        (tmp_path / "levels.csv").write_text(content)
        made = Scene.from_file_tables(
            {"wall": text, "mound": {"shape": "levels", "levels": "levels.csv"}}, tmp_path, ""
        )
        return made.surface(np.array([[1.0, 3.0], [4.0, 0.5]]))

    assert surface(head + rows) == pytest.approx([-0.011, -0.0095])
    for content, said in (
        ("x (m),y (m),height\n0,0,0\n", "'height' is unknown; the columns may be x"),
        ("x (m),y (m),level\n0,0,0\n4,0,1\n", "its levels have no unit"),
        ("x (m),y (m),date\n0,0,2022-01-01\n", "needs a column level, or a column settlement"),
        (head + rows.replace("5,P,-1,0,2022-01-01\n", "", 1), "the visit of 2022-01-01 has no point at 0, -1 m"),
    ):
        with pytest.raises(InputError, match=said):
            surface(content)


VISITS = "2022-01-01", "2024-01-01"


def test_the_ground_that_does_not_move_is_at_0() -> None:
    plan = {"front": (0.0, 0.0), "right": (6.0, 0.0), "back": (6.0, 4.0), "left": (0.0, 4.0)}
    ends = [*plan.values(), (0.0, 0.0)]
    walls = [{"name": name, "start": ends[k], "end": ends[k + 1]} for k, name in enumerate(plan)]
    mound = {"shape": "tree", "point": (-1.0, 0.0), "reach": 4.0, "surface_movement": 0.04}
    moved = what_moves(House.from_dict({"wall": walls, "mound": mound, "movement": {"kind": "settle"}}))
    assert moved.startswith("The ground (tree) ends lowest under 'front', at -")
    assert ", at 0 mm (up is positive)" in moved


def test_sources_of_ground_movement_are_added():
    tree = {"name": "oak", "shape": "tree", "point": [0, 0], "reach": 10, "surface_movement": "20 mm"}
    leak = {"shape": "pipe", "point": [4, 4], "reach": 8, "kind": "heave", "surface_movement": "10 mm"}
    clay = {"shape": "walsh", "edge_distance": 1.0, "surface_movement": "40 mm"}
    at = np.array([[0.0, 0.0], [3.0, 4.0], [2.0, 2.0]])
    made = house(SQUARE, mound=clay, source=[tree, leak], movement={"kind": "doming"})
    alone = [
        house(SQUARE, mound=clay, movement={"kind": "doming"}),
        house(SQUARE, mound={k: v for k, v in tree.items() if k != "name"}, movement={"kind": "settle"}),
        house(SQUARE, mound={k: v for k, v in leak.items() if k != "kind"}, movement={"kind": "heave"}),
    ]
    for factor in (1.0, 0.5, -1.0):
        parts = [each.surface(at, factor) for each in alone]
        assert made.surface(at, factor) == pytest.approx(sum(parts), abs=1e-15)
    assert made.with_values({"source.oak.surface_movement": 0.0}).surface(at) == pytest.approx(
        alone[0].surface(at) + alone[2].surface(at), abs=1e-15
    )
    front = made.scenes[0].mound
    x = np.array([0.0, 1.0, 4.0])
    moved = front.profile(x, 4.0, "doming")
    assert moved == pytest.approx(made.surface(made.wall[0].points(x)), abs=1e-4)
    assert made.unit_of("source.oak.reach") == "m"
    assert Scene.from_dict(tomllib.loads(made.to_toml())) == made


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ({"shape": "tree", "point": [0, 0], "kind": "doming"}, "source 1: kind = 'doming': shape = 'tree' goes with"),
        ({"shape": "corner", "point": [3, 0]}, "source 1: point: lies 1 m off the nearest corner"),
        ({"shape": "tree", "point": [0, 0], "name": "reach"}, "must be one word"),
        ({"shape": "tree"}, "point: is missing"),
    ],
)
def test_wrong_sources_are_refused(source, words):
    with pytest.raises(InputError, match=words):
        house(SQUARE, movement={"kind": "doming"}, source=[source])


def test_the_sum_of_both_directions_is_the_only_surface_with_the_mound_of_each_direction_in_every_wall():
    """A surface whose sections along x, and along y, all have one form relative to their ends is f(x) + g(y)."""
    plan = [wall("a", [0, 0], [6, 0]), wall("b", [6, 0], [6, 4]), wall("c", [6, 4], [0, 4]), wall("d", [0, 4], [0, 0])]
    inner = [wall("e", [2, 0], [2, 4]), wall("f", [0, 1], [6, 1])]
    ends = [{"length": 6.0}, {"length": 4.0}]
    standard = [Scene.from_dict({"wall": {**size}, "movement": {"shape": "mound", "kind": "doming"}}) for size in ends]
    made = house(plan, movement={"kind": "doming"})
    for scene, walls in zip(standard, (("a", "c", "f"), ("b", "d", "e"))):
        x = np.linspace(0.0, scene.wall.length, 7)
        for each in (Scene.from_dict({"wall": [w], **TREE}).wall[0] for w in plan + inner if w["name"] in walls):
            moved = made.surface(each.points(x))
            assert moved - moved[0] == pytest.approx(scene.ground_rise(x) - scene.ground_rise(x)[0], abs=1e-12)
    nearest = house(plan, mound={"in_plan": "nearest_edge"}, movement={"kind": "doming"})
    assert np.ptp(nearest.surface(nearest.wall[0].points(np.linspace(0, 6, 7)))) == pytest.approx(0.0, abs=1e-15)
