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
