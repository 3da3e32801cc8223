"""Cracks drawn by hand, with the lengths, widths and courses they were drawn with."""

import dataclasses

import numpy as np
import pytest

from damagepred.damage import HAIRLINE, tracing
from damagepred.damage.cracks import Cracks, find_cracks
from damagepred.damage.tracing import DIAGONAL, DPC_SLIP, HORIZONTAL, STEPPED, VERTICAL, WALL, Links, Pieces, links_of
from damagepred.enumerations import ContactKind
from tests.damage.pattern import COURSE, HALF, Pattern

MM = 1e-3
STEPS = [("head", 4, 2), ("bed", 4, 3), ("head", 5, 3), ("bed", 5, 4), ("head", 6, 4), ("bed", 6, 5), ("head", 7, 5)]


def cracks(wall: Pattern, links: Links = tracing.NO_LINKS) -> list[tracing.Numbered]:
    return tracing.Growth(wall.map).step(0, wall.opening, wall.slip, wall.cracked, links)


def only(wall: Pattern) -> tracing.Numbered:
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


@pytest.mark.parametrize(("line", "begin", "end"), [("bed", (4, 4), (5, 4)), ("head", (4, 4), (4, 5))])
@pytest.mark.parametrize("width", [(1 * MM, 0.0, 0.0), (0.0, 1 * MM, 0.0), (0.0, 0.0, 1 * MM), (1 * MM,) * 3])
def test_the_path_of_a_short_crack_runs_right_or_up(line: str, begin: tuple, end: tuple, width: tuple):
    wall = Pattern()
    wall.open(line, 4, 4, width)
    path = only(wall).crack.path
    assert (np.diff(path, axis=0) > -1e-12).all()
    if min(width) > 0:
        np.testing.assert_allclose(path[[0, -1]], np.array([begin, end]) * (HALF, COURSE))


@pytest.mark.parametrize(("size", "count"), [(HAIRLINE, 0), (HAIRLINE * (1 + 1e-9), 1)])
@pytest.mark.parametrize("how", ["opening", "slip", "slip back"])
def test_the_hairline_itself_is_no_crack(size: float, count: int, how: str):
    wall = Pattern()
    if how == "opening":
        wall.open("bed", 4, 4, size)
    else:
        wall.slide("bed", 4, 4, size if how == "slip" else -size)
    assert len(cracks(wall)) == count


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


@pytest.mark.parametrize("slip", [0.0, HAIRLINE, HAIRLINE * (1 + 1e-9), 1 * MM])
@pytest.mark.parametrize("opening", [0.0, HAIRLINE, HAIRLINE * (1 + 1e-9), 1 * MM])
def test_a_piece_of_the_dpc_is_open_or_slid_not_both(opening: float, slip: float):
    wall = Pattern(dpc=2)
    wall.open("bed", 10, 2, opening)
    wall.slide("bed", 10, 2, slip)
    expected = [tracing.DPC_OPENING] if opening > HAIRLINE else [DPC_SLIP] if slip > HAIRLINE else []
    assert [f.part for f in cracks(wall)] == expected


def test_a_crack_keeps_its_number_as_it_grows_and_the_older_one_wins():
    wall = Pattern()
    growth = tracing.Growth(wall.map)

    def step(number: int) -> list[tracing.Numbered]:
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
    # a zone around the middle of a cracked piece touches it, though neither end
    pieces, cracked = Pieces(wall.map), wall.cracked.ravel()
    x, y = (pieces.place[cracked][0].mean(axis=0) + 0.1 * MM * np.array([(-1, -1), (1, -1), (0, 1)])).T
    assert len(links_of(pieces, cracked, x, y, np.array([[0, 1, 2]]), np.array([True])).ends) == 1


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


def first_cracks(wall: Pattern) -> Cracks:
    return find_cracks(wall.map, wall.opening, wall.slip, wall.cracked)


def test_psi_of_one_crack_of_a_tenth_of_a_millimetre_is_one():
    wall = Pattern()
    assert wall.judge().psi == 0.0
    wall.open("head", 4, 2, 0.1 * MM)
    assert wall.judge().psi == pytest.approx(2 * 0.1**0.3)
    assert wall.judge().psi == pytest.approx(1.0, abs=0.003)


def test_psi_weighs_cracks_by_displacement_and_length_and_counts_those_that_slid():
    wall = Pattern()
    wall.vertical(4, 2 * MM)  # six head joints and the five beds between, of half a brick
    wall.slide("bed", 10, 3, 3 * MM)
    long, short = found = first_cracks(wall).length
    assert found.tolist() == [max(found), min(found)]
    assert first_cracks(wall).joints.tolist() == [11]
    mean = (2.0**2 * long + 3.0**2 * short) / (2.0 * long + 3.0 * short)
    assert wall.judge().psi == pytest.approx(2 * 2**0.15 * mean**0.3)
    wall.slide("head", 4, 2, 1.5 * MM)
    assert first_cracks(wall).displacement[0] == pytest.approx(np.hypot(2, 1.5) * MM)


def test_a_closed_crack_is_none():
    wall = Pattern()
    wall.open("head", 4, 2, -1 * MM)
    assert len(first_cracks(wall).width) == 0


def test_partly_cracked_joint_counts_where_it_is_cracked():
    wall = Pattern()
    wall.open("bed", 4, 3, (2 * MM, 1 * MM, 0.5 * MM))
    wall.cracked[wall.place("bed", 4, 3), 0] = False
    assert first_cracks(wall).width.tolist() == [1 * MM]
