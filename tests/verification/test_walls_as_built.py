"""Bonds, gables, end openings and basement windows against closed forms, areas and equilibrium."""

from typing import Any

import numba
import numpy as np
import pytest

from damagepred import InputError, Scene, assembly
from damagepred.assembly.bond import lay_bricks
from damagepred.assembly.model import InterfaceRecords
from damagepred.kernels.interface.kinematics import interface_displacement
from damagepred.solvers import solve_path

UNIT_WEIGHT = 9.81 * 2000.0
STILL = {"shape": "parabola", "central_deflection": 0.0, "increments": 1}


def scene(wall: dict[str, Any], **tables: Any) -> Scene:
    return Scene.from_dict({"wall": wall, "movement": STILL, **tables})


def bricks_of(wall: dict[str, Any], **tables: Any) -> np.ndarray:
    return np.array(lay_bricks(scene(wall, **tables)))


def cells_of(bond: str, b: float, h: float, k_n: float, k_s: float, t: float) -> Scene:
    wall = {"length": 9 * b, "height": 6 * h, "thickness": t, "block_length": b, "block_height": h, "bond": bond}
    solver = {"blocks": "rigid", "lump_block_elasticity": False}
    return scene(wall, joint={"normal_stiffness": k_n, "shear_stiffness": k_s}, solver=solver)


@numba.njit
def relative_displacement(records: InterfaceRecords, motion: np.ndarray, i: int) -> tuple[float, float, float]:
    """Opening and shear in the middle of an interface, and its relative rotation."""
    return interface_displacement(records.edge[i], records.elastic, motion, i)


# share of k_nv b, and of k_sb b^2 / h, in the stiffness along the wall; period over a brick
ALONG = {
    "running": (1.0, 0.25, 1.0),
    "stack": (1.0, 0.0, 1.0),
    "header": (0.5, 0.0625, 0.5),
    "english": (0.75, 0.125, 1.0),
    "flemish": (0.75, 0.1875, 1.5),
}


@pytest.mark.parametrize("bond", ALONG)
@pytest.mark.parametrize(("b", "h"), [(0.24, 0.086), (0.4, 0.2)])
def test_stiffness_of_each_bond_is_that_of_its_periodic_cell(bond: str, b: float, h: float) -> None:
    """Under a strain along the wall every brick's middle moves by strain times x: by symmetry nothing else moves.

    A perpend opens by the distance of the two middles; beds slide by it where a brick lies over two. Headers are half
    as far apart. In Flemish bond all middles are 3/4 of a brick apart, in English bond those of headers half.
    """
    (k_n, k_s), t = (82e9, 36e9), 0.23
    model = assembly.wall_model(cells_of(bond, b, h, k_n, k_s, t))
    blocks, faces, (head, bed, period) = model.blocks, model.interfaces, ALONG[bond]
    found = []
    for direction in (0, 1):
        motion = np.zeros((int(max(faces.body_a.max(), faces.body_b.max())) + 1, 3))
        motion[: len(blocks.x), direction] = (blocks.x, blocks.y)[direction]
        start, low = 3.05 * b, 1.55 * h
        end, high = start + 2 * period * b, low + 2 * h
        inside = np.flatnonzero((faces.x > start) & (faces.x < end) & (faces.y > low) & (faces.y < high))
        energy = 0.0
        for i in inside:
            opening, shear, _ = relative_displacement(model.interface_records, motion.ravel(), i)
            stiff = model.properties.normal_stiffness[i] * opening**2 + model.properties.shear_stiffness[i] * shear**2
            energy += 0.5 * float(faces.contact_area[i].sum() * stiff)
        found.append(2.0 * energy / ((end - start) * 2 * h * t))
    assert found[0] == pytest.approx(head * k_n * b + bed * k_s * b**2 / h, rel=1e-9)
    assert found[1] == pytest.approx(k_n * h, rel=1e-9)


# bed joints of a cell: lower and upper brick (0 stretcher, 1 header), distance of their middles, both ends from the
# lower one's middle; and head joints: left and right brick, distance. In bricks; the cell is two courses high.
ROTATING = {
    "header": (0.5, [(1, 1, s * 0.25, 0.0, s * 0.25) for s in (-1, 1)] * 2, [(1, 1, 0.5)] * 2),
    "english": (
        1.0,
        [(0, 1, 0.0, -0.25, 0.25), (0, 1, 0.5, 0.25, 0.5), (0, 1, -0.5, -0.5, -0.25)] * 2,
        [(0, 0, 1.0), (1, 1, 0.5), (1, 1, 0.5)],
    ),
    "flemish": (
        1.5,
        [(0, 1, 0.0, -0.25, 0.25), (1, 0, 0.0, -0.25, 0.25)] * 2
        + [(0, 0, s * 0.75, s * 0.25, s * 0.5) for s in (-1, 1)] * 2,
        [(0, 1, 0.75), (1, 0, 0.75)] * 2,
    ),
}


def cell_in_shear(bond: str, b: float, h: float, k_n: float, k_s: float) -> float:
    """Shear modulus of a cell whose stretchers rotate alike, and whose headers do; both as the energy is least."""
    period, beds, heads = ROTATING[bond]
    energy, unit = np.zeros((3, 3)), np.eye(3)  # of the shear angle and both rotations
    shear = unit[0]
    for lower, upper, apart, start, end in beds:
        below, above = unit[1 + lower], unit[1 + upper]
        slip = shear * h / 2 + (below + above) * h / 2
        middle, length = 0.5 * (start + end) * b, abs(end - start) * b
        lift = shear * apart * b / 2 + above * (middle - apart * b) - below * middle
        energy += length * (k_s * np.outer(slip, slip) + k_n * np.outer(lift, lift))
        energy += k_n * length**3 / 12 * np.outer(above - below, above - below)
    for left, right, apart in heads:
        one, other = unit[1 + left], unit[1 + right]
        # the head joint lies half of each brick's length from its middle
        arms = [0.5 * b * (1.0 if brick == 0 else 0.5) for brick in (left, right)]
        slip = shear * apart * b / 2 - one * arms[0] - other * arms[1]
        energy += h * k_s * np.outer(slip, slip) + k_n * h**3 / 12 * np.outer(other - one, other - one)
    return least(energy) / (period * b * 2 * h)


def least(energy: np.ndarray) -> float:
    """Stiffness of the first motion where the energy is least in the others."""
    return float(energy[0, 0] - energy[0, 1:] @ np.linalg.pinv(energy[1:, 1:]) @ energy[1:, 0])


@pytest.mark.parametrize("bond", ROTATING)
@pytest.mark.parametrize(("b", "h"), [(0.24, 0.086), (0.4, 0.2)])
def test_shear_stiffness_of_each_bond_is_that_of_its_periodic_cell(bond: str, b: float, h: float) -> None:
    """Each brick is a centre of symmetry, so that its middle moves with the strain; stretchers and headers rotate."""
    (k_n, k_s), t, period = (82e9, 36e9), 0.23, ROTATING[bond][0]
    built = cells_of(bond, b, h, k_n, k_s, t)
    model = assembly.wall_model(built)
    bricks = np.array(lay_bricks(built))
    header = bricks[:, 2] - bricks[:, 0] < 0.75 * b
    blocks, faces = model.blocks, model.interfaces
    motion = np.zeros((3, int(max(faces.body_a.max(), faces.body_b.max())) + 1, 3))
    motion[0, : len(blocks.x), :2] = 0.5 * np.column_stack((blocks.y, blocks.x))
    motion[1, : len(blocks.x), 2], motion[2, : len(blocks.x), 2] = ~header, header
    start, low = 3.05 * b, 1.55 * h
    end, high = start + 2 * period * b, low + 2 * h
    energy = np.zeros((3, 3))
    for i in np.flatnonzero((faces.x > start) & (faces.x < end) & (faces.y > low) & (faces.y < high)):
        jumps = [relative_displacement(model.interface_records, one.ravel(), i) for one in motion]
        opening, slip, turn = np.array(jumps).T
        for place, area in zip(faces.contact_offset[i], faces.contact_area[i]):
            lift = opening + turn * place
            energy += area * model.properties.normal_stiffness[i] * np.outer(lift, lift)
            energy += area * model.properties.shear_stiffness[i] * np.outer(slip, slip)
    found = least(energy) / ((end - start) * 2 * h * t)
    assert found == pytest.approx(cell_in_shear(bond, b, h, k_n, k_s), rel=1e-9)


def test_flemish_and_english_courses_have_their_headers_and_closers() -> None:
    """Stretchers and headers, after 110 mm headers at the ends a closer of 60 mm; headers lie mid on stretchers."""
    wall = {"length": 2.16, "height": 0.15, "thickness": 0.23}
    for bond, even, odd in (
        ("flemish", [4, 2] * 6, [2, 1, 4, 2, 4, 2, 4, 2, 4, 2, 4, 2, 2]),
        ("english", [4] * 9, [2, 1, *[2] * 15, 1, 2]),
        ("header", [2] * 18, [3, *[2] * 15, 3]),
    ):
        found = bricks_of({**wall, "bond": bond})
        quarters = np.rint((found[:, 2] - found[:, 0]) / 0.06).astype(int)
        courses = [quarters[found[:, 4] == course].tolist() for course in (0, 1)]
        assert courses[0] == even
        assert courses[1][: len(odd) - 2] == odd[:-2]
        assert sum(courses[1]) == 36


@pytest.mark.parametrize("bond", ["header", "english", "flemish"])
def test_perpends_of_a_bond_with_headers_never_stand_on_each_other(bond: str) -> None:
    """Openings included; no brick is shorter than a closer."""
    found = bricks_of(
        {"length": 3.6, "height": 1.2, "thickness": 0.23, "bond": bond},
        opening=[{"x": 1.2, "y": 0.3, "width": 0.96, "height": 0.45}],
    )
    assert (found[:, 2] - found[:, 0]).min() > 0.0599
    for course in range(15):
        ends = [set(found[found[:, 4] == c, 2].round(6)) - {1.2, 3.6, 1.08, 2.28, 2.16} for c in (course, course + 1)]
        assert not ends[0] & ends[1]
    area = ((found[:, 2] - found[:, 0]) * (found[:, 3] - found[:, 1])).sum()
    assert area == pytest.approx(3.6 * 1.2 - 0.96 * 0.45)


@pytest.mark.parametrize("bond", ["header", "english", "flemish"])
def test_a_wall_of_230_mm_stands_with_its_weight(bond: str) -> None:
    thick = scene({"length": 1.44, "height": 0.45, "thickness": "230 mm", "bond": bond})
    step = list(solve_path(assembly.wall_model(thick), thick.solver, 1))[-1]
    assert step.base_reaction == pytest.approx(UNIT_WEIGHT * 1.44 * 0.45 * 0.23, rel=1e-9)


GABLE = {"length": 4.8, "height": 3.0, "thickness": 0.11, "top": [[0, 1.5], [2.4, 3.0], [4.8, 1.5]]}


def test_a_gable_has_the_bricks_below_its_line() -> None:
    """The staircase of half bricks follows the line; its area is the gable's within half a course of bricks."""
    found = bricks_of(GABLE)
    area = ((found[:, 2] - found[:, 0]) * (found[:, 3] - found[:, 1])).sum()
    exact = 4.8 * 1.5 + 0.5 * 4.8 * 1.5
    assert abs(area - exact) < 0.5 * 0.075 * 4.8
    for left, _, right, top, _ in found[found[:, 3] > 1.5 + 1e-9]:
        for x in (left + 0.06, right - 0.06):
            assert top - 0.0375 <= 1.5 + 1.5 * (1 - abs(x - 2.4) / 2.4) + 1e-9


def test_the_roof_and_the_weight_of_a_gable_reach_the_ground() -> None:
    """The roof is uniform along the wall: half of it on either side, 1/8 on an eighth of the length."""
    gable = scene(GABLE, loads={"roof": 9600.0}, load=[{"line_load": 500.0}])
    bricks = np.array(lay_bricks(gable))
    area = ((bricks[:, 2] - bricks[:, 0]) * (bricks[:, 3] - bricks[:, 1])).sum()
    model = assembly.wall_model(gable)
    load = model.supports.load.reshape(-1, 3)
    total = UNIT_WEIGHT * 0.11 * area + 9600.0 + 2400.0
    assert -load[:, 1].sum() == pytest.approx(total, rel=1e-12)
    weight = UNIT_WEIGHT * 0.11 * model.blocks.area
    roof = -load[:, 1] - weight
    x = model.blocks.x
    assert (roof * x - load[:, 2]).sum() == pytest.approx(12000.0 * 2.4, rel=1e-12)
    assert roof[(x < 2.4 - 0.3)].sum() == pytest.approx(12000.0 * 2.1 / 4.8, rel=0.05)
    step = list(solve_path(model, gable.solver, 1))[-1]
    assert step.base_reaction == pytest.approx(total, rel=1e-8)


def test_a_stepped_top_has_its_levels_and_its_open_window() -> None:
    """A step is a joint; a window up to the lower top has no lintel, and the area is exact."""
    wall = {"length": 4.8, "height": 2.4, "top": [[0, 1.2], [2.4, 1.2], [2.4, 2.4], [4.8, 2.4]]}
    found = bricks_of(wall, opening=[{"x": 0.96, "y": 0.6, "width": 0.48, "height": 0.6}])
    area = ((found[:, 2] - found[:, 0]) * (found[:, 3] - found[:, 1])).sum()
    assert area == pytest.approx(2.4 * 3.6 - 0.48 * 0.6)
    assert found[found[:, 0] < 2.4 - 1e-9][:, 3].max() == pytest.approx(1.2)
    roof = assembly.wall_model(
        scene(wall, loads={"roof": 4320.0}, opening=[{"x": 0.96, "y": 0.6, "width": 0.48, "height": 0.6}])
    )
    on_top = -roof.supports.load.reshape(-1, 3)[:, 1] - UNIT_WEIGHT * 0.11 * roof.blocks.area
    assert on_top[roof.blocks.x < 2.4 + 1e-9].sum() == pytest.approx(1000.0 * 1.92, rel=1e-9)
    assert (on_top[np.isclose(roof.blocks.y, 0.5625)] < 1e-6).all()  # the sill carries none


@pytest.mark.parametrize(
    ("wall", "tables", "words"),
    [
        ({"top": [[0, 1.5], [4.8, 3.2]]}, {}, r"highest point is at 3\.2 m, and height = 3 m"),
        ({"top": [[0, 1.5], [4.0, 3.0]]}, {}, r"go from 0 to the wall's length \(4\.8 m\)"),
        ({"top": [[0, 3.0], [3, 1], [2, 1], [4.8, 1]]}, {}, "from left to right"),
        (
            {},
            {"opening": [{"x": 0.24, "y": 0.6, "width": 0.48, "height": 1.5}]},
            r"above the top of the wall there, 1\.65",
        ),
        ({"bond": "dutch"}, {}, "'english'"),
    ],
)
def test_tops_that_no_wall_has_are_refused(wall: dict[str, Any], tables: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        scene({**GABLE, **wall}, **tables)


def test_a_lintel_above_the_rake_is_refused() -> None:
    low = scene(GABLE, opening=[{"x": 0.24, "y": 0.6, "width": 0.48, "height": 0.95, "lintel_bearing": 0.24}])
    with pytest.raises(InputError, match=r"its lintel, .* reaches above the top of the wall"):
        lay_bricks(low)


def test_a_basement_window_lies_below_the_dpc() -> None:
    window = {"x": 1.2, "y": 0.15, "width": 0.48, "height": 0.45}
    wall = scene({"length": 2.4, "height": 1.2}, opening=[window], dpc={"course": 10})
    model = assembly.wall_model(wall)
    step = list(solve_path(model, wall.solver, 1))[-1]
    area = 2.4 * 1.2 - 0.48 * 0.45
    assert step.base_reaction == pytest.approx(UNIT_WEIGHT * 0.11 * area, rel=1e-8)
    with pytest.raises(
        InputError, match=r"dpc\.course = 5: .* take 2, below the window, or 8, above a basement window"
    ):
        scene({"length": 2.4, "height": 1.2}, opening=[window], dpc={"course": 5})


@pytest.mark.parametrize(
    ("hole", "words"),
    [
        (
            {"x": 0.05},
            r"pier to its left is 0\.05 m, thinner than half a brick \(0\.12 m\); the nearest x that works is 0\.12 m",
        ),
        ({"x": 3.04}, r"pier to its right is 0\.08 m, .* the nearest x that works is 3 m"),
        ({"height": 1.47}, r"strip above it is 0\.03 m, .* the nearest height that works is 1\.425 m"),
    ],
)
def test_thin_piers_are_refused_with_the_nearest_that_works(hole: dict[str, float], words: str) -> None:
    window = {"x": 0.96, "y": 0.9, "width": 0.48, "height": 0.6}
    with pytest.raises(InputError, match=words):
        scene({"length": 3.6, "height": 2.4}, opening=[window | hole])


def test_the_wall_over_a_door_at_its_end_stands_on_its_lintel() -> None:
    """A cantilever of bonded brickwork carries itself: the ground has the whole weight."""
    door = {"kind": "door", "x": 0.0, "width": 0.48, "height": 0.6, "lintel_bearing": 0.48}
    wall = scene({"length": 2.4, "height": 1.2}, opening=[door])
    model = assembly.wall_model(wall)
    step = list(solve_path(model, wall.solver, 1))[-1]
    assert step.base_reaction == pytest.approx(UNIT_WEIGHT * 0.11 * (2.4 * 1.2 - 0.48 * 0.6), rel=1e-7)
