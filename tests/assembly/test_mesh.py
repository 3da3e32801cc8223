"""Zones of deformable blocks: they fill the block, are connected, and share gridpoints on common edges of bricks."""

import numpy as np
import pytest

from damagepred import Assembly, InputError, Solver
from damagepred.assembly.assembly import rectangle
from damagepred.assembly.mesh import cut_into_zones, mesh_of

BRICK = np.array(rectangle(0.0, 0.0, 0.24, 0.075))


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
