"""Zones of deformable blocks: they fill the block, are connected, and share gridpoints on common edges of bricks."""

import numpy as np
import pytest

from damagepred import Assembly
from damagepred.assembly.assembly import rectangle
from damagepred.assembly.geometry import mass_properties
from damagepred.assembly.mesh import LANES, cut_into_zones, mesh_of
from damagepred.errors import InputError
from damagepred.scene import Solver
from tests.assembly import reference

BRICK = np.array(rectangle(0.0, 0.0, 0.24, 0.075))
POLYGONS = {
    "brick": BRICK,
    "triangle": np.array([(0.0, 0.0), (1.0, 0.0), (0.3, 0.8)]),
    "hexagon": reference.hexagons(1, 1)[0],
    "trapezium": np.array([(0.0, 0.0), (1.0, 0.1), (0.8, 0.7), (0.1, 0.5)]),
    "straight corner": np.array([(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]),
    "sliver": np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 0.002), (0.0, 0.001)]),
}


@pytest.mark.parametrize("shift", [0.0, 1e4])
@pytest.mark.parametrize("name", POLYGONS)
def test_zones_fill_the_block_and_hang_together(name: str, shift: float) -> None:
    polygon = POLYGONS[name] + shift
    size = 0.4 * np.ptp(polygon, axis=0).max()
    mesh = mesh_of([polygon], {0: size})
    assert mesh is not None
    assert (mesh.zone_area > 0).all()
    assert mesh.zone_area.sum() == pytest.approx(mass_properties(polygon)[0], rel=1e-9)
    # each inner edge belongs to two zones, each outer one is a facet (Euler: one piece, no hole)
    edges = np.sort(mesh.zones[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    kinds, uses = np.unique(edges, axis=0, return_counts=True)
    assert uses.max() <= 2
    assert (uses == 1).sum() == len(mesh.facets)
    assert mesh.x.size - len(kinds) + len(mesh.zones) == 1
    # facets go round counter-clockwise, and no edge is longer than asked
    x, y = mesh.x[mesh.facets] - shift, mesh.y[mesh.facets] - shift
    assert 0.5 * (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]).sum() == pytest.approx(mesh.zone_area.sum(), rel=1e-7)
    assert np.hypot(np.diff(x), np.diff(y)).max() <= size * (1 + 1e-9)


def test_zones_of_a_brick_are_their_own_mirror_image() -> None:
    _, points = cut_into_zones(BRICK, 0.04)
    mirrored = points * [-1, 1] + [0.24, 0.0]
    assert {tuple(p) for p in np.round(points, 9)} == {tuple(p) for p in np.round(mirrored, 9)}


def test_blocks_of_one_pattern_stand_side_by_side() -> None:
    bricks = [BRICK + np.array([0.24 * i, 0.0]) for i in range(11)] + [np.array(rectangle(0, 1, 0.12, 1.075))]
    mesh = mesh_of(bricks, dict.fromkeys(range(12), 0.03))
    assert mesh is not None
    assert len(mesh.patterns) == 2
    assert np.bincount(mesh.batch).tolist() == [LANES, 3, 1]
    every = np.concatenate((mesh.dof_x, mesh.dof_y))
    assert len(np.unique(every)) == len(every)  # nobody shares a place
    assert every.max() < mesh.size
    assert every.min() == 3 * (12 + 1)


def test_interfaces_of_deformable_blocks_join_pieces_of_facets() -> None:
    assembly = Assembly()
    assembly.add_block(rectangle(0.0, 0.0, 0.24, 0.075), zone_size=0.06)
    assembly.add_block(rectangle(0.12, 0.075, 0.36, 0.15), zone_size=0.04)
    assembly.add_block(rectangle(0.0, 0.15, 0.36, 0.2))
    model = assembly.build(Solver(lump_block_elasticity=False))
    face, mesh = model.interfaces, model.mesh
    assert mesh is not None
    lower = (face.block_a == 0) & (face.block_b == 1)
    assert face.length[lower].sum() == pytest.approx(0.12)
    assert lower.sum() == 4  # gridpoints of either side part the bed, at 0, 20 (twice: 0, 40, 60, 80), ... mm
    owner = mesh.facet_block[mesh.piece_facet]
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
    np.testing.assert_allclose(mesh.piece_x[piece[inner]], face.x[inner], atol=1e-12)
    np.testing.assert_allclose(mesh.piece_y[piece[inner]], face.y[inner], atol=1e-12)
    assert (face.x - face.length / 2 >= ends.min(axis=1) - 1e-9)[inner].all()
    assert (face.x + face.length / 2 <= ends.max(axis=1) + 1e-9)[inner].all()


@pytest.mark.parametrize("bad", [-1.0, float("nan"), float("inf")])
def test_a_size_that_is_no_length_is_refused(bad: float) -> None:
    with pytest.raises(InputError, match="zone_size"):
        Assembly().add_block(BRICK, zone_size=bad)


def test_a_slip_of_the_unit_is_refused_before_it_fills_the_memory() -> None:
    with pytest.raises(InputError, match=r"zone_size = 1e-06 m: would cut one block into \d+ zones"):
        cut_into_zones(BRICK, 1e-6)
    bricks = [BRICK + np.array([0.24 * i, 0.0]) for i in range(9)]
    with pytest.raises(InputError, match="in all"):
        mesh_of(bricks, dict.fromkeys(range(9), 0.00055))


@pytest.mark.parametrize(("cut", "stands"), [(1e-3, True), (1e-6, True), (1e-8, False)])
def test_an_edge_that_zones_cannot_tell_from_a_point_is_refused(cut: float, stands: bool) -> None:
    corners = np.array([(cut, 0.0), (0.24, 0.0), (0.24, 0.075), (0.0, 0.075), (0.0, cut)])
    if stands:
        pattern, _ = cut_into_zones(corners, 0.075)
        assert len(pattern.zones) == 4 * 5 * 4
    else:
        with pytest.raises(InputError, match=r"an edge of 1.41421e-08 m is too short"):
            cut_into_zones(corners, 0.075)
