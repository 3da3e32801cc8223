"""Polygons and what they share, against slow and simple computations."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from damagepred.assembly.geometry import convex_polygon, mass_properties, refuse_overlaps, shared_edges
from damagepred.errors import InputError
from tests.assembly import reference

FAR = (1e4, -1e4)  # coordinates of a survey grid


def flat(polygons: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray, float]:
    first = np.concatenate(([0], np.cumsum([len(p) for p in polygons])))
    smallest = min(reference.polygon_area(p) for p in polygons)
    return np.concatenate(polygons), first.astype(np.int64), 1e-6 * np.sqrt(smallest)


def moved(corners: np.ndarray, x: float, y: float) -> np.ndarray:
    return corners + np.array((x, y))


def check_against_reference(polygons: list[np.ndarray], accuracy: float = 1e-12) -> None:
    vertices, first, tolerance = flat(polygons)
    refuse_overlaps(vertices, first, tolerance)
    found = shared_edges(vertices, first, tolerance)
    expected = reference.shared_lengths(polygons, tolerance)
    pairs: dict[tuple[int, int], float] = {}
    for a, b, start, end, normal, _, _ in zip(*found):
        pair = (min(a, b), max(a, b))
        length = float(np.hypot(*(end - start)))
        pairs[pair] = pairs.get(pair, 0.0) + length
        assert np.hypot(*normal) == pytest.approx(1.0, rel=1e-12)
        # the normal points from a to b
        middle = (start + end) / 2
        assert normal @ (polygons[b].mean(axis=0) - middle) > 0
        assert normal @ (polygons[a].mean(axis=0) - middle) < 0
        # start to end runs along the tangent (normal_y, -normal_x)
        np.testing.assert_allclose((end - start) / length, [normal[1], -normal[0]], atol=max(1e-7, accuracy / length))
        # and both ends lie on the rim of both polygons
        for block in (a, b):
            for point in (start, end):
                assert _distance_to_rim(polygons[block], point) < tolerance
    assert pairs.keys() == expected.keys()
    for pair, length in expected.items():
        assert pairs[pair] == pytest.approx(length, abs=max(accuracy, tolerance * 1e-3)), pair


def _distance_to_rim(corners: np.ndarray, point: np.ndarray) -> float:
    nearest = np.inf
    for p, q in zip(corners, np.roll(corners, -1, axis=0)):
        share = np.clip((point - p) @ (q - p) / ((q - p) @ (q - p)), 0, 1)
        nearest = min(nearest, np.hypot(*(point - p - share * (q - p))))
    return nearest


# 1e-9 and its like: where "is it level?" is decided by rounding, for some choice of threshold
ANGLES = [0.0, 1e-9, -1e-9, 1e-12, 0.3, np.pi / 4, np.pi / 2, np.pi / 2 + 1e-9, 2.0, np.pi, -np.pi / 2, 5.1]


@pytest.mark.quick_cases
@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("seed", [1, 2])
def test_rectangles_turned_by_any_angle(angle: float, seed: int):
    polygons = reference.random_rectangles(np.random.default_rng(seed))
    check_against_reference(reference.turned(polygons, angle), 1e-11)


@pytest.mark.parametrize("shift", [(0.0, 0.0), FAR])
@pytest.mark.parametrize("angle", [0.0, 0.2, np.pi / 6])
def test_hexagons(angle: float, shift: tuple[float, float]):
    polygons = reference.turned(reference.hexagons(), angle, shift)
    check_against_reference(polygons, 1e-9)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("shift", [(0.0, 0.0), FAR])
def test_voronoi_cells(seed: int, shift: tuple[float, float]):
    cells = reference.turned(reference.voronoi(np.random.default_rng(seed)), 0.0, shift)
    assert sum(reference.polygon_area(c) for c in cells) == pytest.approx(1.0, rel=1e-6)
    check_against_reference(cells, 1e-9)


def test_a_vertex_on_an_edge_makes_two_interfaces_of_the_right_length():
    below = np.array([(0, 0), (1, 0), (1, 1), (0.3, 1), (0, 1)], dtype=float)
    above = np.array([(0, 1), (1, 1), (1, 2), (0, 2)], dtype=float)
    found = shared_edges(*flat([below, above]))
    assert sorted(np.hypot(*(found.end - found.start).T)) == pytest.approx([0.3, 0.7])


def test_blocks_that_meet_at_a_corner_or_not_at_all_share_nothing():
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)
    for shift in ((1.0, 1.0), (2.0, 0.0), (1.0, 1.5), (0.0, 1.001)):
        assert len(shared_edges(*flat([square, moved(square, *shift)])).a) == 0


# -- overlaps ---------------------------------------------------------------------------------------------------------


def overlaps(polygons: list[np.ndarray]) -> bool:
    vertices, first, tolerance = flat(polygons)
    try:
        refuse_overlaps(vertices, first, tolerance)
    except InputError:
        return True
    return False


def test_overlaps_of_every_sort_are_refused():
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)
    for name, other in {
        "the same again": square,
        "half": moved(square, 0.5, 0.0),
        "a corner": moved(square, 0.5, 0.5),
        "inside": moved(0.2 * square, 0.3, 0.3),
        "a cross": moved(square * (3.0, 0.2), -1.0, 0.4),
        "a sliver": moved(square, 1 - 1e-4, 0.0),
        "turned": reference.turned([square], 0.7, (0.9, 0.2))[0],
    }.items():
        assert overlaps([square, other]), name
        assert overlaps([other, square]), name
        far = reference.turned([square, other], 0.4, FAR)
        assert overlaps(far), name


def test_one_moved_cell_is_found_and_named():
    cells = reference.voronoi(np.random.default_rng(6))
    cells[7] = moved(cells[7], 0.01, 0.0)
    vertices, first, tolerance = flat(cells)
    with pytest.raises(InputError, match=r"blocks \d+ and \d+ overlap") as caught:
        refuse_overlaps(vertices, first, tolerance)
    assert " 7 " in str(caught.value)


# -- single polygons --------------------------------------------------------------------------------------------------


@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.integers(0, 10**6), st.floats(-1e4, 1e4), st.floats(-1e4, 1e4))
def test_mass_properties_of_triangles(seed: int, x: float, y: float):
    """Area, centroid and polar moment from the corners (closed form), anywhere on the plane."""
    random = np.random.default_rng(seed)
    a, b, c = random.uniform(-1, 1, (3, 2))
    double = (b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0]
    if abs(double) < 0.05:
        return
    corners = np.array([a, b, c] if double > 0 else [a, c, b])
    area, cx, cy, polar = mass_properties(moved(corners, x, y))
    sides = [((p - q) ** 2).sum() for p, q in itertools.combinations((a, b, c), 2)]
    assert area == pytest.approx(abs(double) / 2, rel=1e-9)
    np.testing.assert_allclose((cx, cy), (a + b + c) / 3 + np.array((x, y)), rtol=1e-12, atol=1e-11)
    assert polar == pytest.approx(abs(double) / 2 * sum(sides) / 36, rel=1e-7)


@pytest.mark.parametrize("corners", [4, 5, 6, 12, 100])
def test_regular_polygons_either_way_round(corners: int):
    angle = np.arange(corners) * 2 * np.pi / corners
    ring = np.column_stack((np.cos(angle), np.sin(angle)))
    for given_corners in (ring, ring[::-1], np.roll(ring, 3, axis=0)):
        checked = convex_polygon(given_corners, "block")
        area, x, y, polar = mass_properties(checked)
        assert area == pytest.approx(corners / 2 * np.sin(2 * np.pi / corners))  # positive: counter-clockwise
        assert polar == pytest.approx(area / 6 * (2 + np.cos(2 * np.pi / corners)))
        assert (x, y) == pytest.approx((0.0, 0.0), abs=1e-14)


@pytest.mark.parametrize("shift", [(0.0, 0.0), FAR, (5e5, 6e6)])
@pytest.mark.parametrize("angle", [0.0, 0.3, 1.0])
def test_vertices_on_a_straight_edge_are_fine_anywhere(angle: float, shift: tuple[float, float]):
    brick = np.array([(0, 0), (0.07, 0), (0.12, 0), (0.24, 0), (0.24, 0.03), (0.24, 0.075), (0.1, 0.075), (0, 0.075)])
    (turned,) = reference.turned([brick], angle, shift)
    assert mass_properties(convex_polygon(turned, "block"))[0] == pytest.approx(0.24 * 0.075, rel=1e-6)


@pytest.mark.parametrize(
    ("vertices", "words"),
    [
        ([(0, 0), (2, 0), (1, 0.5), (1, 2)], "not convex"),  # a dent
        ([(0, 0), (1, 1), (1, 0), (0, 1)], "not convex"),  # a bow tie
        ([(np.cos(a), np.sin(a)) for a in np.arange(5) * 4 * np.pi / 5], "not convex"),  # a pentagram
        ([(0, 0), (1, 0), (1, 1), (0, 1)] * 2, "not convex"),  # twice round
        ([(0, 0), (2, 0), (1, 0), (1, 1)], "not convex"),  # there and back
        ([(3, 1), (3, 2), (1, 3), (3, 2), (1, 3)], "not convex"),  # along one edge twice
        ([(0, 0), (1, 0), (2, 0)], "one line"),
        ([(0, 0), (1, 1), (2, 2), (3, 3)], "one line"),
        ([(0, 0), (2, 0), (1, 1e-12)], "one line"),
        ([(0, 0), (1, 0), (1, 0), (0, 1)], "coincide"),
        ([(0, 0), (1, 0), (0, 1), (0, 0)], "coincide"),  # closed by hand
        ([(0, 0), (0, 0), (0, 0)], "coincide"),
        ([(0, 0), (1, 0)], "3 or more"),
        ([], "3 or more"),
        ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], "3 or more"),
        ([(0, 0), (1, np.nan), (0, 1)], "finite"),
        ([(0, 0), (np.inf, 0), (0, 1)], "finite"),
        ("square", "points"),
        ([(0, 0), (1,), (0, 1)], "points"),
        ([(0, 0), (1, None), (0, 1)], "finite|points"),
    ],
)
def test_what_is_no_convex_polygon(vertices: object, words: str):
    with pytest.raises(InputError, match=words) as caught:
        convex_polygon(vertices, "block 7")
    assert "block 7" in str(caught.value)
