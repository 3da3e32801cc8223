"""A house against its parts, statics, a grillage of finite elements, and symmetry."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import damagepred
from damagepred.assembly import wall_model
from damagepred.assembly.footing_beam import UNLIMITED_STRENGTH
from damagepred.assembly.house import NODE_STIFFNESS, NORMAL_SHARE, house_model
from damagepred.enumerations import ContactKind
from damagepred.results.house import wall_dataset, wall_names
from damagepred.scene import Scene
from damagepred.solvers import solve_path
from tests.verification.beam_on_ground import element

SMALL = {"height": 0.3, "bond": "stack"}
TREE = {"shape": "tree", "point": [-0.5, 0], "reach": 4, "surface_movement": "6 mm"}
SETTLES = {"kind": "settle", "increments": 2}


def wall(name, start, end, **more):
    return {"name": name, "start": start, "end": end, **SMALL, **more}


def house(walls, mound=TREE, movement=SETTLES, **tables):
    return Scene.from_dict({"wall": walls, "mound": mound, "movement": movement, **tables})


def path(model, scene):
    return list(solve_path(model, replace(scene.solver, symmetric_half=False), scene.movement.increments))


def single(length, mound=None, **tables):
    position = {"shape": "tree", "position": -0.5, "reach": 4, "surface_movement": "6 mm"}
    movement = {"shape": "mound", **SETTLES}
    return Scene.from_dict(
        {"wall": {"length": length, **SMALL}, "mound": mound or position, "movement": movement} | tables
    )


CONCRETE = {"footing": {"width": 0.25, "depth": 0.2, "concrete": {"bottom": "3-L8TM", "top": "3-L8TM", "cover": 0.04}}}


@pytest.mark.parametrize("tables", [{}, CONCRETE], ids=["elastic", "reinforced"])
def test_a_house_of_one_wall_is_the_wall(tables):
    one, made = single(2.4, **tables), house([wall("a", [0, 0], [2.4, 0])], **tables)
    for alone, in_house in zip(path(wall_model(one), one), path(house_model(made), made)):
        assert np.array_equal(alone.displacement, in_house.displacement)
        assert np.array_equal(alone.opening, in_house.opening)


@pytest.mark.parametrize("blocks", ["rigid", "elastic"])
def test_two_walls_in_one_line_are_the_wall_whose_middle_passes_vertical_shear_alone(blocks):
    solver = {"solver": {"blocks": blocks}}
    one = single(2.4, **solver)
    whole = wall_model(one)
    face, law = whole.interfaces, whole.properties
    middle = (np.abs(face.x - 1.2) < 1e-9) & np.isin(face.kind, (ContactKind.HEAD_JOINT, ContactKind.FOOTING_SECTION))
    assert middle.sum() == 5  # four courses and the footing
    shear = np.where(face.kind == ContactKind.FOOTING_SECTION, NODE_STIFFNESS, one.joint.shear_stiffness)
    cohesion = np.where(face.kind == ContactKind.FOOTING_SECTION, UNLIMITED_STRENGTH, one.joint.cohesion)
    changes = (
        {"normal_stiffness": NORMAL_SHARE * shear, "shear_stiffness": shear}
        | {"tensile_strength": UNLIMITED_STRENGTH, "cohesion": cohesion, "friction": 0.0}
        | {"residual_friction": 0.0}
    )
    law = law._replace(**{name: np.where(middle, value, getattr(law, name)) for name, value in changes.items()})
    made = house([wall("a", [0, 0], [1.2, 0]), wall("b", [1.2, 0], [2.4, 0])], **solver)
    model = house_model(made)
    x = np.concatenate([m.blocks.x + shift for m, shift in zip(model.walls, (0.0, 1.2))])
    of_whole, of_house = (np.lexsort(np.round(v, 6)) for v in ((whole.blocks.x, whole.blocks.y), (x, model.blocks.y)))
    assert x[of_house] == pytest.approx(whole.blocks.x[of_whole])
    for alone, joined in zip(path(replace(whole, properties=law), one), path(model, made)):
        assert joined.displacement[of_house] == pytest.approx(alone.displacement[of_whole], abs=1e-9)


PIPE = {"shape": "pipe", "point": [0.6, 0.6], "reach": 0.9}
SEASONS = {"kind": "settle", "seasons": {"years": 2, "swing": "6 mm", "increments": 2}}


@pytest.mark.parametrize(
    ("mound", "movement", "tables"),
    [
        (PIPE | {"surface_movement": "8 mm"}, {"kind": "settle", "increments": 3}, {}),
        ({"shape": "walsh", "surface_movement": "20 mm"}, {"kind": "doming", "increments": 3}, {}),
        (PIPE | {"surface_movement": "20 mm"}, {"kind": "settle", "increments": 3}, CONCRETE),
        (PIPE, SEASONS, {}),
    ],
    ids=["pipe", "clay", "reinforced", "seasons"],
)
def test_four_equal_walls_on_ground_of_fourfold_symmetry_do_the_same(mound, movement, tables):
    ends = [[0, 0], [1.2, 0], [1.2, 1.2], [0, 1.2], [0, 0]]
    walls = [wall(name, ends[i], ends[i + 1], bond="running") for i, name in enumerate("abcd")]
    made = house(walls, mound, movement, **tables)
    ds = damagepred.solve(made)
    moved = ds["block_displacement_y"].values.reshape(ds.sizes["increment"], 4, -1)  # increments, walls, blocks
    assert moved == pytest.approx(np.broadcast_to(moved[:, :1], moved.shape), abs=1e-8)
    widths = ds["wall_crack_width_max"].values
    assert widths == pytest.approx(np.broadcast_to(widths[:, :1], widths.shape), abs=1e-8)
    assert ds.attrs["energy_error_share"] < 1e-2
    assert (ds["damage_category"] == ds["wall_damage_category"].max("wall")).all()


def test_seasons_of_a_tilt_bring_a_house_back_unharmed():
    """The ground rises and falls as a plane: the house follows it, up as far as down, and returns."""
    ends = [[0, 0], [1.92, 0], [1.92, 1.2], [0, 1.2], [0, 0]]
    walls = [wall(name, ends[i], ends[i + 1]) for i, name in enumerate("abcd")]
    ds = damagepred.solve(house(walls, {"shape": "tilt", "direction": 30}, SEASONS))
    assert float(ds["crack_width_max"].max()) < 1e-8
    progress, moved = ds["progress"].values, ds["block_displacement_y"].values
    up = (moved - moved[0])[progress == 1.0]
    assert progress.min() == -1.0
    assert np.abs(up).max() > 1e-3
    assert moved - moved[0] == pytest.approx(np.outer(progress, up), abs=1e-7)


def test_tilt_of_the_whole_house_does_no_damage():
    ends = [[0, 0], [1.92, 0], [1.92, 1.2], [0, 1.2], [0, 0]]
    walls = [wall(name, ends[i], ends[i + 1]) for i, name in enumerate("abcd")]
    walls.append(wall("cross", [0.72, 0], [0.72, 1.2]))
    tilt = {"shape": "tilt", "direction": 30, "surface_movement": "10 mm"}
    ds = damagepred.solve(house(walls, tilt, {"kind": "settle", "increments": 2}))
    assert float(ds["crack_width_max"].max()) < 1e-8
    force = ds["corner_shear_force"].values
    assert force[-1] == pytest.approx(force[0], abs=0.5)  # N; the walls weigh 2 kN and more
    assert float(ds["block_displacement_y"][-1].min()) < -9e-3


def test_vertical_shear_at_corners_is_the_reaction_of_a_beam_on_two_supports():
    # the ground settles under a wall with a door at one side, which hangs on two cross walls
    beam = wall(
        "beam", [0, 1], [1.92, 1], height=0.6, opening=[{"kind": "door", "x": 0.24, "width": 0.48, "height": 0.45}]
    )
    walls = [beam, wall("left", [0, 0], [0, 2]), wall("right", [1.92, 0], [1.92, 2])]
    trough = [[x, y, 1.0 if y == 1 else 0.0] for x in (-1, 3) for y in (-1, 0.8, 1, 1.2, 3)]
    mound = {"shape": "levels", "levels": trough, "surface_movement": "4 mm"}
    made = house(walls, mound, SETTLES, corner={"cohesion": "10 MPa"})
    model = house_model(made)
    end = path(model, made)[-1]
    length, n = 1.92, model.walls[0].n_blocks
    weight, x = -model.walls[0].supports.load.reshape(-1, 3)[:, 1], model.walls[0].blocks.x
    soil = model.walls[0].on_ground
    rows, face = model.unfolded.rows[0][soil], model.walls[0].interfaces
    pressure = -end.normal_stress[rows] * face.contact_area[soil]
    at = face.x[soil, None] + face.contact_offset[soil] * face.normal_y[soil, None]
    hanging = weight.sum() - pressure.sum()
    right = ((weight * x).sum() - (pressure * at).sum()) / length
    corner, area = model.unfolded.corner_rows, model.interfaces.contact_area
    force = np.bincount(model.unfolded.corners.junction, (end.shear_stress[corner] * area[corner]).sum(axis=1), 2)
    assert hanging > 0.3 * weight.sum()
    assert n < model.n_blocks
    assert -force == pytest.approx([hanging - right, right], abs=1e-3 * hanging)


def grillage(lengths, joined, h, stiffness, shear, spring, weight, ground):
    """Deflection of beams on springs: Timoshenko elements with nodes h apart that share deflections in pairs."""
    counts = [round(length / h) + 1 for length in lengths]
    first = np.concatenate(([0], np.cumsum(counts)))
    matrix, load = np.zeros((2 * first[-1],) * 2), np.zeros(2 * first[-1])
    k = element(h, stiffness, shear)
    for beam, count in enumerate(counts):
        for i in range(count - 1):
            dofs = 2 * (first[beam] + i) + np.arange(4)
            matrix[np.ix_(dofs, dofs)] += k
        for i in range(count):
            node, share = 2 * (first[beam] + i), h * (0.5 if i in (0, count - 1) else 1.0)
            matrix[node, node] += spring * share
            load[node] += spring * share * ground(beam, i * h) - weight * share
    for (a, x_a), (b, x_b) in joined:
        one, other = (2 * (first[beam] + round(x / h)) for beam, x in ((a, x_a), (b, x_b)))
        pair = np.ix_([one, other], [one, other])
        matrix[pair] += 1e13 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    moved = np.linalg.solve(matrix, load)[::2]
    return [moved[a:b] for a, b in pairwise(first)]


def test_the_result_of_one_wall_is_taken_out_of_a_house(tmp_path):
    from damagepred.archive.files import read_dataset, write_dataset

    window = {"x": 0.48, "y": 0.15, "width": 0.48, "height": 0.15}
    made = house([wall("a", [0, 0], [1.44, 0]), wall("b", [1.44, 0], [1.44, 1.44], opening=[window])])
    ds = damagepred.solve(made)
    write_dataset(ds, tmp_path / "house.nc")
    kept = read_dataset(tmp_path / "house.nc")
    assert wall_names(kept) == ["a", "b"]
    one = wall_dataset(kept, "b")
    alone = damagepred.solve(made.scenes[1])
    assert set(alone.variables) == set(one.variables)
    assert {name: alone[name].dims for name in alone.variables} == {name: one[name].dims for name in one.variables}
    assert one["contact_x"].values == pytest.approx(alone["contact_x"].values)
    assert one["opening_left"].values == pytest.approx([0.48])
    assert float(one["crack_width_max"][-1]) == float(kept["wall_crack_width_max"][-1, 1])
    assert float(kept["wall_base_reaction"][-1].sum()) == pytest.approx(kept.mean_block_weight * kept.sizes["block"])
    with pytest.raises(damagepred.InputError, match="the house has a, b"):
        wall_dataset(kept, "c")


def test_loads_act_on_their_own_wall():
    walls = [wall("a", [0, 0], [1.2, 0]), wall("b", [1.2, 0], [1.2, 0.96])]
    loaded = [{**walls[0], "loads": {"roof": "2 kN/m"}}, {**walls[1], "load": [{"line_load": "3 kN/m", "y": 0.15}]}]
    more = house_model(house(loaded)).supports.load - house_model(house(walls)).supports.load
    first = house_model(house(walls)).unfolded.first_block
    on_walls = np.add.reduceat(more.reshape(-1, 3)[:, 1], first[:-1])
    assert on_walls == pytest.approx([-2.4e3, -2.88e3])


def test_an_opening_at_the_free_end_of_a_wall_has_one_jamb():
    hole = {"x": 1.92, "y": 0.075, "width": 0.48, "height": 0.15}
    model = house_model(house([wall("a", [0, 0], [2.4, 0]), wall("b", [0, 0], [0, 2.4], opening=[hole])]))
    (alone,), (joined,), first = model.walls[1].jambs.block, model.jambs.block, model.unfolded.first_block[1]
    assert joined.tolist() == [alone[0] + first, -1, -1, alone[3] + first]


@pytest.mark.parametrize(
    ("plan", "mound"),
    [
        ([("a", [0, 0], [0.96, 0]), ("b", [0.96, 0], [0.96, 0.96])], TREE),
        (
            [("a", [0, 0], [1.44, 0]), ("tee", [0.72, 0], [0.72, 0.72])],
            {"shape": "pipe", "point": [0, 0], "reach": 1.0, "surface_movement": "4 mm"},
        ),
    ],
)
def test_the_explicit_solver_agrees(plan, mound):
    made = house([wall(*of) for of in plan], mound, solver={"blocks": "rigid"})
    end = path(house_model(made), made)[-1].displacement
    explicit = replace(made, solver=replace(made.solver, method="explicit"))
    slow = path(house_model(explicit), explicit)[-1].displacement
    assert slow == pytest.approx(end, abs=2e-2 * np.abs(end).max())


def test_a_corner_slides_at_its_cohesion_and_loses_it():
    walls = [wall("a", [0, 0], [1.2, 0]), wall("b", [1.2, 0], [1.2, 1.2])]
    mound = {"shape": "levels", "levels": [[x, y, float(y > 0)] for x in (-1, 2) for y in (-1, 0, 0.3, 2)]}
    weak = {"cohesion": 5e3, "friction": 0.5, "pressure": 2e3, "join_footings": False}
    area = 0.11 * 0.3
    for brittle, limit in ((False, 6e3), (True, 1e3)):
        made = house(walls, {**mound, "surface_movement": "8 mm"}, SETTLES, corner={**weak, "brittle": brittle})
        ds = damagepred.solve(made)
        assert abs(float(ds["corner_shear_force"][-1, 0])) == pytest.approx(limit * area, rel=1e-3)
        assert float(ds["corner_slip_max"][-1, 0]) > 1e-3


BEAMS = {"normal_stiffness": 1e7, "shear_stiffness": 1e5, "tensile_strength": 0.0, "cohesion": 0.0, "friction": 0.0}


def footings_alone(walls, mound, segment, depth=0.3):
    """House of one soft course, which gives its footings weight and no stiffness."""
    footing = {"width": 0.3, "depth": depth, "segment_length": segment, "joint": {**BEAMS, "normal_stiffness": 1e12}}
    walls = [{**one, "height": 0.075} for one in walls]
    return house(
        walls, mound, SETTLES, footing=footing, joint=BEAMS, corner={"control_joint": True}, soil={"friction": 0.0}
    )


def test_a_cross_of_beams_shares_its_load_as_hetenyi_has_it():
    # the ground sinks under the long beam alone, which hangs on two beams hinged to its middle
    walls = [wall("long", [0, 0], [3.6, 0]), wall("n", [1.8, 0], [1.8, 1.8]), wall("s", [1.8, -1.8], [1.8, 0])]
    sinks = [[x, y, float(y == 0)] for x in (-1, 5) for y in (-3, -1e-3, 0, 1e-3, 3)]
    made = footings_alone(walls, {"shape": "levels", "levels": sinks, "surface_movement": "2 mm"}, 0.09, depth=0.2)
    ds = damagepred.solve(made)
    k, stiffness = made.soil.stiffness("settle") * 0.3, 7e9 * 0.3 * 0.2**3 / 12
    beta = (k / (4 * stiffness)) ** 0.25
    whole, half = beta * 3.6, beta * 1.8
    middle = beta / (2 * k) * (np.cosh(whole) + np.cos(whole) + 2) / (np.sinh(whole) + np.sin(whole))
    end = (
        2
        * beta
        / k
        * (np.sinh(half) * np.cosh(half) - np.sin(half) * np.cos(half))
        / (np.sinh(half) ** 2 - np.sin(half) ** 2)
    )
    force = 2e-3 / (end + 2 * middle)  # of each short beam
    assert [j.walls for j in made.junctions] == [(0, 1), (0, 2), (1, 2)]
    found = ds["corner_footing_force"].values[-1]
    assert -found[:2] == pytest.approx([force, force], rel=0.03)  # the short beams hold the long one up
    assert abs(found[2]) < 1e-3 * force


FRAME = [[0, 0], [2.4, 0], [2.4, 1.2], [0, 1.2], [0, 0]]


@pytest.mark.parametrize(
    ("ends", "joined", "pipe", "error"),
    [
        ([([0, 0], [2.4, 0]), ([1.2, 0], [1.2, 1.8])], [((0, 1.2), (1, 0.0))], ([1.2, 1.8], 1.8), 3e-3),
        (
            list(pairwise(FRAME)),
            [((0, 2.4), (1, 0.0)), ((1, 1.2), (2, 0.0)), ((2, 2.4), (3, 0.0)), ((3, 1.2), (0, 0.0))],
            ([0, 0], 1.6),
            5e-3,
        ),
    ],
    ids=["tee", "frame"],
)
def test_joined_footings_are_a_grillage(ends, joined, pipe, error):
    walls = [wall("abcd"[i], *of) for i, of in enumerate(ends)]
    mound = {"shape": "pipe", "point": pipe[0], "reach": pipe[1], "surface_movement": "2 mm"}
    made = footings_alone(walls, mound, 0.06)
    model = house_model(made)
    end = path(model, made)[-1]
    fine = grillage(
        [scene.wall.length for scene in made.scenes],
        joined,
        0.015,
        7e9 * 0.3**4 / 12,
        5 / 6 * 7e9 / 2.4 * 0.3**2,
        made.soil.stiffness("settle") * 0.3,
        9.81 * (2130 * 0.3**2 + 2000 * 0.11 * 0.075),
        lambda beam, x: float(made.surface(made.wall[beam].points(np.array(x)))),
    )
    apart = replace(made, corner=replace(made.corner, join_footings=False))
    free = path(house_model(apart), made)[-1]
    bend = max(np.ptp(moved) for moved in fine)
    for number, moved in enumerate(fine):
        blocks = model.walls[number].footing
        own, x = model.unfolded.first_block[number] + blocks, model.walls[number].blocks.x[blocks]
        expected = np.interp(x, 0.015 * np.arange(len(moved)), moved)
        assert end.displacement[own, 1] == pytest.approx(expected, abs=error * bend)
        assert np.abs(free.displacement[own, 1] - expected).max() > 0.015 * bend


@pytest.mark.parametrize("blocks", ["rigid", "elastic"])
def test_work_and_energy_of_a_house_balance_as_corners_break(blocks):
    walls = [wall("a", [0, 0], [1.44, 0], height=0.6), wall("b", [1.44, 0], [1.44, 1.2], height=0.6)]
    walls.append(wall("t", [0.72, 0], [0.72, 0.96], height=0.45))
    mound = {"shape": "corner", "point": [0, 0], "reach": 0.8, "surface_movement": "20 mm"}
    corner = {"cohesion": 3e3, "friction": 0.3, "pressure": 2e3, "brittle": True, "join_footings": False}
    ds = damagepred.solve(house(walls, mound, SETTLES, corner=corner, solver={"blocks": blocks}))
    assert ds["corner_slip_max"].values[-1].max() > 1e-4
    assert ds.attrs["energy_error_share"] < 5e-3


def test_walls_with_joints_at_their_corners_and_footings_apart_are_walls_alone():
    apart = {"control_joint": True, "join_footings": False}
    made = house([wall("a", [0, 0], [1.68, 0]), wall("b", [1.68, 0], [1.68, 0.96])], corner=apart)
    model = house_model(made)
    moved = path(model, made)[-1].displacement
    for number, scene in enumerate(made.scenes):
        own = path(wall_model(scene), scene)[-1].displacement
        first = model.unfolded.first_block[number]
        assert moved[first : first + len(own)] == pytest.approx(own, abs=1e-9)
    joined = damagepred.solve(replace(made, corner=replace(made.corner, join_footings=True)))
    assert not joined["corner_shear_force"].values.any()
    assert np.abs(joined["corner_footing_force"].values[-1]).max() > 20.0


def test_a_control_joint_beside_a_corner_opens_in_its_own_wall():
    long = wall("a", [0, 0], [2.4, 0], height=0.6, control_joint=[{"x": 0.48}])
    made = house([long, wall("b", [0, 0], [0, 1.2], height=0.6)], {**TREE, "surface_movement": "20 mm"})
    ds = damagepred.solve(made)
    moved = ds["wall_control_joint_opening_max"].values[-1] + ds["wall_control_joint_closing_max"].values[-1]
    assert moved[0] > 1e-5
    assert np.isnan(moved[1])


APART = {"corner": {"control_joint": True, "join_footings": False}}


@pytest.mark.parametrize(
    "tables",
    [
        {"movement": {"kind": "settle", "seasons": {"years": 2, "swing": "6 mm", "increments": 2}}},
        CONCRETE,
        {"solver": {"blocks": "rigid"}, "joint": {"tensile_strength": "0.05 MPa", "cohesion": "0.05 MPa"}},
    ],
    ids=["seasons", "reinforced", "weak"],
)
def test_walls_that_nothing_joins_are_walls_alone_in_seasons_and_on_reinforced_footings(tables):
    mound = {"shape": "tree", "reach": 4, "surface_movement": "20 mm"}
    movement = {**SETTLES, "increments": 3} | tables.get("movement", {})
    movement = {k: v for k, v in movement.items() if not ("seasons" in movement and k == "increments")}
    mound = {k: v for k, v in mound.items() if not ("seasons" in movement and k == "surface_movement")}
    others = {k: v for k, v in tables.items() if k != "movement"}
    walls = [wall("a", [0, 0], [2.4, 0]), wall("b", [2.4, 0], [2.4, 1.2])]
    made = damagepred.solve(house(walls, {**mound, "point": [-0.5, 0]}, movement, **others, **APART))
    alone = damagepred.solve(
        single(2.4, {**mound, "position": -0.5}, **others, movement={"shape": "mound", **movement})
    )
    one = wall_dataset(made, "a")
    assert np.abs(alone["block_displacement_y"].values).max() > 1e-3
    for name in ("crack_width_max", "footing_opening_max", "central_deflection", "block_displacement_y"):
        assert one[name].values == pytest.approx(alone[name].values, abs=2e-7), name
    if "crack_width_worst" in alone:
        assert one["crack_width_worst"].values == pytest.approx(alone["crack_width_worst"].values, abs=2e-7)
        assert made["surface_movement"].values == pytest.approx(alone["surface_movement"].values)
    assert one["section_moment"].values == pytest.approx(alone["section_moment"].values, abs=2.0)


def test_two_halves_of_one_source_are_the_source():
    walls = [wall("a", [0, 0], [1.44, 0]), wall("b", [1.44, 0], [1.44, 1.2])]
    half = {**TREE, "surface_movement": "3 mm"}
    whole = path(house_model(made := house(walls)), made)[-1].displacement
    both = house(walls, half, source=[{**half, "kind": "settle"}])
    assert path(house_model(both), both)[-1].displacement == pytest.approx(whole, abs=1e-12)
