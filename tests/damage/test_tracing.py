"""Cracks drawn by hand, with the lengths, widths and courses they were drawn with."""

import dataclasses

import numpy as np
import pytest

from damagepred.damage import HAIRLINE, Growth, Numbered, find_cracks
from damagepred.damage.tracing import (
    BELOW_DPC,
    DIAGONAL,
    DPC_OPENING,
    DPC_SLIP,
    HORIZONTAL,
    STEPPED,
    VERTICAL,
    WALL,
    Links,
    Pieces,
    links_of,
)
from damagepred.enumerations import ContactKind
from tests.damage.pattern import COURSE, HALF, Pattern

MM = 1e-3
STEPS = [("head", 4, 2), ("bed", 4, 3), ("head", 5, 3), ("bed", 5, 4), ("head", 6, 4), ("bed", 6, 5), ("head", 7, 5)]


def cracks(wall: Pattern, links: Links | None = None) -> list[Numbered]:
    return Growth(wall.map).step(0, wall.opening, wall.slip, wall.cracked, links)


def only(wall: Pattern) -> Numbered:
    found = cracks(wall)
    assert len(found) == 1
    return found[0]


def stepped(wall: Pattern, shift: tuple[float, float]) -> None:
    """Move what is right below a stepped crack by a shift (m): perpends open by its x, beds by -y and slide."""
    for line, i, r in STEPS:
        if line == "head":
            wall.open("head", i, r, shift[0])
            wall.slide("head", i, r, -shift[1])  # its tangent points down
        else:
            wall.open("bed", i, r, -shift[1])  # what is above stays
            wall.slide("bed", i, r, -shift[0])


def test_a_stepped_crack_is_one_crack_of_known_length_and_course():
    wall = Pattern()
    stepped(wall, (1 * MM, -2 * MM))
    found = only(wall)
    crack = found.crack
    assert (found.number, found.part, crack.orientation, crack.branches) == (1, WALL, STEPPED, 0)
    assert crack.length == pytest.approx(4 * COURSE + 3 * HALF)
    # from the foot of the lowest perpend to the head of the highest
    np.testing.assert_allclose(crack.path[[0, -1]], [(4 * HALF, 2 * COURSE), (7 * HALF, 6 * COURSE)], atol=1e-12)
    assert (np.diff(crack.path, axis=0) > -1e-12).all()  # up and to the right all the way
    assert len(crack.path_pieces) == 21
    assert crack.inclination == pytest.approx(np.degrees(np.arctan2(COURSE, HALF)), abs=1.0)  # that of its steps


def test_the_mean_line_of_a_bent_crack_is_the_axis_of_its_second_moments():
    """Of a bed of length a that a perpend of height b ends: by hand, about the centroid of the two lines."""
    wall = Pattern()
    wall.open("bed", 3, 4, 1 * MM)
    wall.open("head", 4, 4, 1 * MM)
    a, b, whole = HALF, COURSE, HALF + COURSE
    xx, yy = a**3 / 3 - a**4 / (4 * whole), b**3 / 3 - b**4 / (4 * whole)
    xy = a**2 * b**2 / (4 * whole)
    crack = only(wall).crack
    assert crack.inclination == pytest.approx(np.degrees(0.5 * np.arctan2(2 * xy, xx - yy)))
    # where pieces lie along it: each third of both lines from the centroid
    middle = np.array([3 * HALF + (a * a / 2 + b * a) / whole, 4 * COURSE + b * b / 2 / whole])
    ends = np.concatenate((crack.path[:-1, None], crack.path[1:, None]), axis=1).mean(axis=1)
    angle = np.radians(crack.inclination)
    along = (ends - middle) @ (np.cos(angle), np.sin(angle))
    np.testing.assert_allclose(np.sort(crack.along), np.sort(along), atol=1e-12)


@pytest.mark.parametrize(("line", "begin", "end"), [("bed", (4, 4), (5, 4)), ("head", (4, 4), (4, 5))])
@pytest.mark.parametrize("width", [(1 * MM, 0.0, 0.0), (0.0, 1 * MM, 0.0), (0.0, 0.0, 1 * MM), (1 * MM,) * 3])
def test_the_path_of_a_short_crack_runs_right_or_up(line: str, begin: tuple, end: tuple, width: tuple):
    wall = Pattern()
    wall.open(line, 4, 4, width)
    path = only(wall).crack.path
    assert (np.diff(path, axis=0) > -1e-12).all()
    if min(width) > 0:
        np.testing.assert_allclose(path[[0, -1]], np.array([begin, end]) * (HALF, COURSE))


@pytest.mark.parametrize("shift", [(1 * MM, -2 * MM), (3 * MM, -0.5 * MM), (1 * MM, -1 * MM)])
def test_width_normal_to_a_stepped_crack_is_the_same_all_along_it(shift: tuple[float, float]):
    """Two halves of a wall that move apart as wholes are as far apart at perpends as at beds."""
    wall = Pattern()
    stepped(wall, shift)
    crack = only(wall).crack
    angle = np.radians(crack.inclination)
    expected = shift[0] * np.sin(angle) - shift[1] * np.cos(angle)
    np.testing.assert_allclose(crack.width, expected)
    np.testing.assert_allclose(crack.displacement, np.hypot(*shift))
    assert crack.opening.max() == pytest.approx(max(shift[0], -shift[1]))


def test_a_crack_along_a_bed_is_horizontal_and_as_long_as_what_is_open():
    wall = Pattern()
    for i in range(3, 9):
        wall.open("bed", i, 4, 0.5 * MM)
    wall.open("bed", 9, 4, (0.5 * MM, 0.2 * MM, -0.1 * MM))  # closed at its far end
    wall.open("bed", 2, 4, (-0.1 * MM, 0.04 * MM, 0.5 * MM))  # open at its near end alone
    crack = only(wall).crack
    assert (crack.orientation, crack.inclination) == (HORIZONTAL, pytest.approx(0.0, abs=1e-9))
    assert crack.length == pytest.approx(6 * HALF + 5 / 6 * HALF + 1 / 6 * HALF)
    np.testing.assert_allclose(crack.path[0], ((3 - 1 / 6) * HALF, 4 * COURSE))


TIES = {
    "widest": ([("open", 3, 1, 2 * MM), ("open", 10, 3, 1 * MM)], [1, 3]),
    "of one width the longest": ([("open", 3, 1, 2 * MM), ("open", 10, 3, 2 * MM)], [3, 1]),
    "of one width and length the lowest": ([("open", 3, 2, 2 * MM), ("open", 10, 2, 2 * MM)], [2, 2]),
    "slid: the longest": ([("slide", 3, 1, 9 * MM), ("slide", 10, 3, 2 * MM), ("slide", 15, 2, 5 * MM)], [3, 2, 1]),
    "slid the other way": ([("slide", 3, 1, -9 * MM), ("slide", 10, 3, 2 * MM)], [3, 1]),
    "open before slid": ([("slide", 3, 5, 9 * MM), ("open", 10, 1, 0.2 * MM)], [1, 5]),
}


@pytest.mark.parametrize("case", TIES)
def test_order_of_cracks_of_one_age(case: str):
    """Widest first, then longest, then lowest; cracks that only slid last, by their length, however far they slid."""
    wall = Pattern()
    drawn, lengths = TIES[case]
    for row, (how, column, count, size) in enumerate(drawn, 3):
        for i in range(count):
            getattr(wall, how)("bed", column + i, row, size)
    found = cracks(wall)
    assert [f.number for f in found] == list(range(1, len(drawn) + 1))
    assert [round(f.crack.length / HALF) for f in found] == lengths
    if len(set(lengths)) == 1:
        assert found[0].crack.path[0, 1] < found[1].crack.path[0, 1]


@pytest.mark.parametrize(("size", "count"), [(HAIRLINE, 0), (HAIRLINE * (1 + 1e-9), 1)])
@pytest.mark.parametrize("how", ["opening", "slip", "slip back"])
def test_the_hairline_itself_is_no_crack(size: float, count: int, how: str):
    wall = Pattern()
    if how == "opening":
        wall.open("bed", 4, 4, size)
    else:
        wall.slide("bed", 4, 4, size if how == "slip" else -size)
    assert len(cracks(wall)) == count


def test_branches_are_counted():
    wall = Pattern()
    for i in range(2, 12):
        wall.open("bed", i, 4, 1 * MM)
    wall.open("head", 4, 4, 1 * MM)
    wall.open("head", 8, 4, 1 * MM)
    wall.open("head", 7, 3, 1 * MM)
    crack = only(wall).crack
    assert crack.branches == 3
    assert crack.length == pytest.approx(10 * HALF + 3 * COURSE)
    assert len(crack.path) == 31
    assert crack.path[:, 1] == pytest.approx(4 * COURSE)  # the longest course runs along the bed


@pytest.mark.parametrize("branch", [((7, 5), (8, 4)), ((5, 4), (5, 3))], ids=["leaning left", "leaning right"])
def test_a_perpend_off_the_path_opens_as_one_on_it(branch: tuple[tuple[int, int], tuple[int, int]]):
    """Width normal to the mean line, opening positive, whichever way that line leans."""
    wall = Pattern()
    wall.vertical(6, 2 * MM, (1, 11))
    wall.open("bed", *branch[0], 2 * MM)
    wall.open("head", *branch[1], 2 * MM)
    crack = only(wall).crack
    assert (crack.orientation, crack.branches) == (VERTICAL, 1)
    side = crack.pieces // 3 == wall.place("head", *branch[1])
    assert side.sum() == 3
    np.testing.assert_allclose(crack.width[side], 2 * MM * abs(np.sin(np.radians(crack.inclination))))


def test_a_crack_follows_the_widest_joints_between_its_ends():
    """Straight through a brick's bed, which is narrow, or round the brick, where all is wide."""
    wall = Pattern()
    for i in range(2, 16):
        wall.open("bed", i, 4, 0.2 * MM if i in (8, 9) else 1 * MM)
    for i in (8, 9):
        wall.open("bed", i, 5, 2 * MM)
        wall.open("head", 2 * i - 8, 4, 2 * MM)
    first = cracks(wall)[0].crack
    assert {float(w) for w in first.opening[np.isin(first.pieces, first.path_pieces)]} == {1 * MM, 2 * MM}


def test_a_crack_from_a_window_corner():
    """The opening's joints are not there: a crack from one corner of it does not reach that from another."""
    wall = Pattern(columns=20, rows=14)
    hole = [wall.lines.pop(key) for key in list(wall.lines) if _in_window(key)]
    keep = np.setdiff1d(np.arange(len(wall.map.kind)), hole)
    small = _without(wall, keep)
    for k in range(3):  # from the upper right corner (12, 8), and from the lower left one (8, 4)
        small.open("head", 12 + k, 8 + k, 2 * MM)
        small.open("bed", 12 + k, 9 + k, 2 * MM)
        small.open("bed", 7 - k, 4 - k, 1 * MM)
        small.open("head", 7 - k, 3 - k, 1 * MM)
    found = cracks(small)
    assert len(found) == 2
    upper, lower = (f.crack for f in found)
    np.testing.assert_allclose(upper.path[0], (12 * HALF, 8 * COURSE))
    np.testing.assert_allclose(lower.path[-1], (8 * HALF, 4 * COURSE))
    assert (upper.orientation, lower.orientation) == (STEPPED, STEPPED)
    assert upper.length == pytest.approx(3 * (HALF + COURSE))


def _in_window(key: tuple[str, int, int]) -> bool:
    line, i, r = key
    return (4 < r < 8 and 8 <= i < 12) if line == "bed" else (4 <= r < 8 and 8 < i < 12)


def _without(wall: Pattern, keep: np.ndarray) -> Pattern:
    fields = [f.name for f in dataclasses.fields(wall.map)]
    wall.map = dataclasses.replace(wall.map, **{name: getattr(wall.map, name)[keep] for name in fields})
    wall.opening, wall.slip, wall.cracked = wall.opening[keep], wall.slip[keep], wall.cracked[keep]
    new = {int(old): number for number, old in enumerate(keep)}
    wall.lines = {key: new[old] for key, old in wall.lines.items() if old in new}
    return wall


# -- dpc and base ----------------------------------------------------------------------------------------------------


def test_the_dpc_is_told_apart_open_and_slid():
    wall = Pattern(columns=50, dpc=2)
    for i in range(10, 20):
        wall.open("bed", i, 2, 4 * MM)
    wall.cracked[:] = False  # it never held
    for i in range(20, 25):
        wall.slide("bed", i, 2, 1 * MM)
    wall.open("head", 21, 1, 2 * MM)
    wall.open("head", 20, 4, 1 * MM)
    found = {f.part: f.crack for f in cracks(wall)}
    assert set(found) == {WALL, BELOW_DPC, DPC_OPENING, DPC_SLIP}
    assert found[DPC_OPENING].length == pytest.approx(10 * HALF)
    assert found[DPC_SLIP].length == pytest.approx(5 * HALF)
    assert found[DPC_SLIP].opening.max() == 0.0
    np.testing.assert_allclose(found[DPC_SLIP].displacement, 1 * MM)
    assert found[BELOW_DPC].length == pytest.approx(COURSE)


@pytest.mark.parametrize("slip", [0.0, HAIRLINE, HAIRLINE * (1 + 1e-9), 1 * MM])
@pytest.mark.parametrize("opening", [0.0, HAIRLINE, HAIRLINE * (1 + 1e-9), 1 * MM])
def test_a_piece_of_the_dpc_is_open_or_slid_not_both(opening: float, slip: float):
    wall = Pattern(dpc=2)
    wall.open("bed", 10, 2, opening)
    wall.slide("bed", 10, 2, slip)
    expected = [DPC_OPENING] if opening > HAIRLINE else [DPC_SLIP] if slip > HAIRLINE else []
    assert [f.part for f in cracks(wall)] == expected


# -- through increments ----------------------------------------------------------------------------------------------


def test_a_crack_keeps_its_number_as_it_grows_and_the_older_one_wins():
    wall = Pattern()
    growth = Growth(wall.map)

    def step(number: int) -> list[Numbered]:
        return growth.step(number, wall.opening, wall.slip, wall.cracked)

    wall.open("bed", 10, 4, 0.2 * MM)
    assert [f.number for f in step(0)] == [1]
    wall.open("bed", 4, 4, 3 * MM)
    wall.open("bed", 3, 4, 3 * MM)
    first, second = step(1)
    assert (first.number, first.crack.pieces.size) == (1, 3)
    assert (second.number, second.crack.pieces.size) == (2, 6)
    for i in (5, 6, 7, 8, 9):  # they meet: the older, though smaller, keeps its number
        wall.open("bed", i, 4, 1 * MM)
    (merged,) = step(2)
    assert merged.number == 1
    assert growth.merged == {2: 1}
    assert (merged.first_increment, merged.first_piece // 3) == (0, wall.place("bed", 10, 4))
    wall.open("head", 6, 8, 1 * MM)  # numbers are not used twice
    assert [f.number for f in step(3)] == [1, 3]


def test_a_crack_that_parts_keeps_its_number_in_the_longer_piece():
    wall = Pattern()
    growth = Growth(wall.map)
    for i in range(3, 12):
        wall.open("bed", i, 4, 1 * MM)
    growth.step(0, wall.opening, wall.slip, wall.cracked)
    wall.open("bed", 5, 4, 0.0)
    first, second = growth.step(1, wall.opening, wall.slip, wall.cracked)
    assert (first.number, second.number) == (1, 2)
    assert first.crack.length == pytest.approx(6 * HALF)
    assert second.crack.length == pytest.approx(2 * HALF)
    assert second.first_increment == 0  # what it is made of broke then


def test_where_a_crack_begins():
    """Its bonds broke in increment 1, before any eye could see it, at the right end first."""
    wall = Pattern()
    growth = Growth(wall.map)
    growth.step(0, wall.opening, wall.slip, wall.cracked)
    wall.open("bed", 4, 4, (0.01 * MM, 0.02 * MM, 0.03 * MM))
    assert growth.step(1, wall.opening, wall.slip, wall.cracked) == []
    wall.open("bed", 4, 4, 1 * MM)
    wall.open("bed", 3, 4, 2 * MM)
    (found,) = growth.step(2, wall.opening, wall.slip, wall.cracked)
    assert (found.first_increment, found.first_piece) == (1, 3 * wall.place("bed", 4, 4) + 2)


# -- through bricks --------------------------------------------------------------------------------------------------


def test_yielded_zones_join_cracks_across_a_brick():
    """Perpends in every other course, in one line; in the brick between, a row of zones has yielded."""
    wall = Pattern()
    for r in (2, 4):
        wall.open("head", 4, r, 1 * MM)
    assert len(cracks(wall)) == 2
    # the brick over the lower perpend, from 3 to 5 half bricks, cut into cells of two zones
    columns, x0 = np.linspace(3, 5, 9) * HALF, 3 * COURSE
    x, y = (v.ravel() for v in np.meshgrid(columns, (x0, x0 + COURSE)))
    zones = np.array([z for i in range(8) for z in ((i, i + 1, i + 10), (i, i + 10, i + 9))])
    yields = np.zeros(len(zones), dtype=bool)
    links = links_of(Pieces(wall.map), wall.cracked.ravel(), x, y, zones, yields)
    assert len(cracks(wall, links)) == 2
    yields[[6, 7, 8, 9]] = True  # those of the two cells in the middle
    links = links_of(Pieces(wall.map), wall.cracked.ravel(), x, y, zones, yields)
    (found,) = cracks(wall, links)
    crack = found.crack
    assert crack.orientation == VERTICAL
    assert crack.length == pytest.approx(2 * COURSE)
    assert COURSE <= crack.length_through_blocks < 1.5 * COURSE
    assert (crack.path_pieces < 0).sum() >= 2
    assert crack.branches == 0
    np.testing.assert_allclose(crack.path[[0, -1]], [(4 * HALF, 2 * COURSE), (4 * HALF, 5 * COURSE)])


def test_orientation_of_a_slope_through_bricks_is_diagonal():
    from damagepred.damage.tracing import _orientation

    assert [_orientation(a, t) for a, t in ((15, False), (15.1, False), (15.1, True), (74.9, True), (75, True))] == [
        HORIZONTAL,
        STEPPED,
        DIAGONAL,
        DIAGONAL,
        VERTICAL,
    ]


@pytest.mark.parametrize("kind", [ContactKind.HEAD_JOINT, ContactKind.CONTROL_JOINT])
def test_a_control_joint_parts_cracks(kind: int):
    """Beds cracked on either side of a perpend meet at its foot; where it is a control joint, the leaf ends there."""
    wall = Pattern()
    for i in range(2, 10):
        wall.open("bed", i, 4, 1 * MM)
    kinds = wall.map.kind.copy()
    for r in (3, 4):  # a line of perpends up the wall is what a control joint makes of it
        if ("head", 6, r) in wall.lines:
            kinds[wall.place("head", 6, r)] = kind
    wall.map = dataclasses.replace(wall.map, kind=kinds)
    expected = 1 if kind == ContactKind.HEAD_JOINT else 2
    assert len(cracks(wall)) == expected
    assert wall.judge().crack_count == expected
    assert len(find_cracks(wall.map, wall.opening, wall.slip, wall.cracked).width) == expected
    if expected == 2:
        assert [round(f.crack.length / HALF) for f in cracks(wall)] == [4, 4]
