"""Polygons and what they share, contacts of interfaces and zones, against slow and simple computations."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from damagepred import Assembly
from damagepred.assembly.assembly import rectangle
from damagepred.assembly.geometry import convex_polygon, mass_properties, refuse_overlaps, shared_edges
from damagepred.assembly.interfaces import quadrature
from damagepred.assembly.mesh import division, joined_quads, mesh_of
from damagepred.errors import InputError
from damagepred.scene import Joint, Solver
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


def overlaps(polygons: list[np.ndarray]) -> bool:
    vertices, first, tolerance = flat(polygons)
    try:
        refuse_overlaps(vertices, first, tolerance)
    except InputError:
        return True
    return False


def test_overlaps_of_every_sort_are_refused():
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)
    for name, other in (
        {"the same again": square, "half": moved(square, 0.5, 0.0), "a corner": moved(square, 0.5, 0.5)}
        | {"inside": moved(0.2 * square, 0.3, 0.3), "a cross": moved(square * (3.0, 0.2), -1.0, 0.4)}
        | {"a sliver": moved(square, 1 - 1e-4, 0.0), "turned": reference.turned([square], 0.7, (0.9, 0.2))[0]}
    ).items():
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


# Abramowitz and Stegun, table 25.6: abscissas on [-1, 1] and weights that sum to 2
LOBATTO = {
    2: ([-1, 1], [1, 1]),
    3: ([-1, 0, 1], [1 / 3, 4 / 3, 1 / 3]),
    4: ([-1, -(5**-0.5), 5**-0.5, 1], [1 / 6, 5 / 6, 5 / 6, 1 / 6]),
    5: ([-1, -((3 / 7) ** 0.5), 0, (3 / 7) ** 0.5, 1], [1 / 10, 49 / 90, 32 / 45, 49 / 90, 1 / 10]),
    6: (
        [-1, -0.765055323929, -0.285231516480, 0.285231516480, 0.765055323929, 1],
        [1 / 15, 0.378474956297, 0.554858377035, 0.554858377035, 0.378474956297, 1 / 15],
    ),
}


@pytest.mark.parametrize("count", LOBATTO)
def test_lobatto_as_tabulated(count: int):
    points, weights = quadrature("lobatto", count)
    np.testing.assert_allclose(2 * points, LOBATTO[count][0], atol=1e-11)
    np.testing.assert_allclose(2 * weights, LOBATTO[count][1], atol=1e-11)


def test_lobatto_of_one_is_refused():
    with pytest.raises(ValueError, match="at least 2"):
        quadrature("lobatto", 1)


def rotational_stiffness(contacts: int, rule: str, width: float, thickness: float) -> tuple[float, float]:
    """Of the joint between two stacked blocks, from the contacts the model really has; and its normal stiffness."""
    wall = Assembly(thickness=thickness, joint=Joint(normal_stiffness=5e9))
    wall.add_block([(0, 0), (width, 0), (width, 0.1), (0, 0.1)])
    wall.add_block([(0, 0.1), (width, 0.1), (width, 0.2), (0, 0.2)])
    solver = Solver(contacts_per_interface=contacts, quadrature=rule, lump_block_elasticity=False)
    model = wall.build(solver)
    face, k = model.interfaces, model.properties.normal_stiffness
    return (
        float((k[:, None] * face.contact_area * face.contact_offset**2).sum()),
        float((k[:, None] * face.contact_area).sum()),
    )


@pytest.mark.parametrize("contacts", [3, 4, 7])
def test_elastic_joint_is_exact_from_three_points_on(contacts: int):
    b, t = 0.24, 0.11
    rotational, normal = rotational_stiffness(contacts, "lobatto", b, t)
    assert rotational == pytest.approx(5e9 * t * b**3 / 12, rel=1e-13)
    assert normal == pytest.approx(5e9 * t * b, rel=1e-13)


BRICK = np.array(rectangle(0.0, 0.0, 0.24, 0.075))


def test_interfaces_of_deformable_blocks_join_pieces_of_facets() -> None:
    assembly = Assembly()
    assembly.add_block(rectangle(0.0, 0.0, 0.24, 0.075), zone_size=0.06)
    assembly.add_block(rectangle(0.12, 0.075, 0.36, 0.15), zone_size=0.04)
    assembly.add_block(rectangle(0.0, 0.15, 0.36, 0.2))
    model = assembly.build(Solver(lump_block_elasticity=False))
    face, mesh = model.interfaces, model.mesh
    lower = (face.block_a == 0) & (face.block_b == 1)
    assert face.length[lower].sum() == pytest.approx(0.12)
    assert lower.sum() == 4  # gridpoints of either side part the bed, at 0, 20 (twice: 0, 40, 60, 80), ... mm
    owner = np.repeat(mesh.block, np.diff(mesh.first_facet))[mesh.piece_facet]
    assert len(owner) == (face.body_a > model.n_blocks).sum() + (face.body_b > model.n_blocks).sum()
    for body, block in ((face.body_a, face.block_a), (face.body_b, face.block_b)):
        facet = body > model.n_blocks
        np.testing.assert_array_equal(owner[body[facet] - model.n_blocks - 1], block[facet])
        np.testing.assert_array_equal(body[~facet], block[~facet])
        assert (block[~facet] == 2).all()
    every = np.concatenate((mesh.dof_x, mesh.dof_y))
    assert every.min() == 3 * model.n_bodies
    assert every.max() < model.size
    # each interface lies within its facets, its piece in its middle
    piece = face.body_a - model.n_blocks - 1
    inner = piece >= 0
    ends = mesh.x[mesh.facets[mesh.piece_facet[np.where(inner, piece, 0)]]]
    middle = np.column_stack((face.x, face.y))
    np.testing.assert_allclose(mesh.piece_middle[piece[inner]], middle[inner], atol=1e-12)
    assert (face.x - face.length / 2 >= ends.min(axis=1) - 1e-9)[inner].all()
    assert (face.x + face.length / 2 <= ends.max(axis=1) + 1e-9)[inner].all()


@pytest.mark.parametrize("bad", [-1.0, float("nan"), float("inf")])
def test_a_size_that_is_no_length_is_refused(bad: float) -> None:
    with pytest.raises(InputError, match="zone_size"):
        Assembly().add_block(BRICK, zone_size=bad)


def test_a_slip_of_the_unit_is_refused_before_it_fills_the_memory() -> None:
    with pytest.raises(InputError, match=r"zone_size = 1e-06 m: would cut one block into \d+ zones"):
        joined_quads(*division(BRICK, 1e-6))
    bricks = [BRICK + np.array([0.24 * i, 0.0]) for i in range(9)]
    with pytest.raises(InputError, match="in all"):
        mesh_of(bricks, dict.fromkeys(range(9), 0.00055))


@pytest.mark.parametrize(("cut", "stands"), [(1e-3, True), (1e-6, True), (1e-8, False)])
def test_an_edge_that_zones_cannot_tell_from_a_point_is_refused(cut: float, stands: bool) -> None:
    corners = np.array([(cut, 0.0), (0.24, 0.0), (0.24, 0.075), (0.0, 0.075), (0.0, cut)])
    if stands:
        pattern, _ = joined_quads(*division(corners, 0.075))
        assert len(pattern.zones) == 4 * 5 * 4
    else:
        with pytest.raises(InputError, match=r"an edge of 1.41421e-08 m is too short"):
            joined_quads(*division(corners, 0.075))
