"""Interfaces between blocks, the mortar joints they belong to, and the contacts on them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, Int8Array, IntArray
from damagepred.assembly.elastic_blocks import ElasticBlocks, elastic_sides
from damagepred.assembly.geometry import SharedEdges
from damagepred.assembly.mesh import Mesh
from damagepred.assembly.model import Blocks, Ground, GroundMovement, Interfaces, Joints
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.scene import Solver

BEARING_WIDTH = 1e-4  # width of a bearing (m): a knife edge, on which a block turns almost freely


@dataclass(frozen=True, eq=False)  # geometries are compared by identity
class Geometry:
    """Geometry shared by all samples of a wall."""

    blocks: Blocks
    interfaces: Interfaces
    joints: Joints
    joint_material: IntArray  # (m,): joint material of each interface
    ground_x: FloatArray  # (g, q): x of the contacts with the ground (m)
    mesh: Mesh | None  # zones of the deformable blocks
    elastic: ElasticBlocks | None = None  # blocks that stretch and bend

    @property
    def mortar(self) -> Joints:
        """Joints without the cracks of bricks: as many as with bricks that do not break."""
        return Joints(*(values[self.joints.kind != ContactKind.BRICK_JOINT] for values in self.joints))


def outlines(blocks: Blocks, mesh: Mesh | None) -> tuple[FloatArray, IntArray, IntArray]:
    """Outlines of all blocks, of deformable blocks facet by facet, and the facet of each edge, or -1."""
    none = np.full(len(blocks.vertices), -1, dtype=np.int64)
    if mesh is None:
        return blocks.vertices, blocks.first_vertex, none
    pieces, facets = np.split(blocks.vertices, blocks.first_vertex[1:-1]), np.split(none, blocks.first_vertex[1:-1])
    for d, block in enumerate(mesh.block):
        facets_of_block = slice(mesh.first_facet[d], mesh.first_facet[d + 1])
        start = mesh.facets[facets_of_block, 0]
        pieces[block] = np.column_stack((mesh.x[start], mesh.y[start]))
        facets[block] = np.arange(facets_of_block.start, facets_of_block.stop)
    first = np.concatenate(([0], np.cumsum([len(p) for p in pieces])))
    return np.concatenate(pieces), first, np.concatenate(facets)


class Grounded(NamedTuple):
    """A block that rests on the ground: with its whole underside, or bearing in one point x (m) of it."""

    block: int
    x: float | None
    material: int
    kind: ContactKind
    width: float = BEARING_WIDTH


def ground_edges(
    outline: FloatArray, first_vertex: IntArray, grounded: Sequence[Grounded]
) -> tuple[SharedEdges, list[Grounded]]:
    """Lowest edges of the blocks that rest on the ground, and the ground contact of each edge."""
    edges: list[tuple[int, int, float, float, float]] = []
    contacts: list[Grounded] = []
    for resting in grounded:
        first, last = first_vertex[resting.block], first_vertex[resting.block + 1]
        corners = outline[first:last]
        low, reach = corners[:, 1].min(), 1e-9 * np.ptp(corners[:, 1])
        after = np.roll(corners, -1, axis=0)
        level = np.flatnonzero((corners[:, 1] <= low + reach) & (after[:, 1] <= low + reach))
        if not level.size:
            raise InputError(f"block {resting.block}: cannot rest on the ground, its underside is a corner.")
        start, end = corners[level, 0], after[level, 0]
        if resting.x is not None:  # a bearing on one edge
            near = int(np.argmin(np.maximum(start - resting.x, resting.x - end)))
            level, half = level[near : near + 1], resting.width / 2
            start, end = np.array([resting.x - half]), np.array([resting.x + half])
        edges += [(resting.block, first + i, x0, x1, low) for i, x0, x1 in zip(level, start, end)]
        contacts += [resting] * len(level)
    block, edge, start, end, level_y = np.array(edges, dtype=np.float64).reshape(-1, 5).T
    return SharedEdges(
        a=np.full(len(edges), len(first_vertex) - 1),
        b=block.astype(np.int64),
        start=np.column_stack((start, level_y)),
        end=np.column_stack((end, level_y)),
        normal=np.tile([0.0, 1.0], (len(edges), 1)),
        edge_a=np.full(len(edges), -1),
        edge_b=edge.astype(np.int64),
    ), contacts


def classified(
    edges: SharedEdges,
    blocks: Blocks,
    grounded: Sequence[Grounded],
    levels: Mapping[int, tuple[int, ContactKind]],
    pairs: Mapping[tuple[int, int], tuple[int, ContactKind | None]],
) -> tuple[Int8Array, IntArray]:
    """Kind and material of each interface: by direction, then by course below, then by pair of blocks."""
    level = np.abs(edges.normal[:, 1]) >= np.abs(edges.normal[:, 0])
    kind = np.where(level, ContactKind.BED_JOINT, ContactKind.HEAD_JOINT).astype(np.int8)
    material = np.zeros(len(kind), dtype=np.int64)
    first_ground = len(kind) - len(grounded)
    inner = np.arange(len(kind)) < first_ground
    course = np.append(blocks.course, -1)
    for below, (number, special) in levels.items():
        bed = inner & level & (course[edges.a] == below) & (course[edges.b] == below + 1)
        kind[bed], material[bed] = special, number
    if pairs:
        # a vertex on an edge splits it: then a pair of blocks has two interfaces
        between: dict[tuple[int, int], list[int]] = {}
        for i in np.flatnonzero(inner).tolist():
            pair = sorted((int(edges.a[i]), int(edges.b[i])))
            between.setdefault((pair[0], pair[1]), []).append(i)
        for (a, b), (number, given) in pairs.items():
            if (a, b) not in between:
                raise InputError(f"blocks {a} and {b} share no edge, so there is no joint to set between them.")
            material[between[a, b]] = number
            kind[between[a, b]] = kind[between[a, b]] if given is None else given
    kind[first_ground:] = [resting.kind for resting in grounded]
    material[first_ground:] = [resting.material for resting in grounded]
    return kind, material


def joined(first: SharedEdges, second: SharedEdges) -> SharedEdges:
    """Concatenated lists of common edges."""
    return SharedEdges(*(np.concatenate(pair) for pair in zip(first, second)))


def cut(edges: SharedEdges, parts: IntArray) -> tuple[SharedEdges, IntArray]:
    """Common edges cut into a number of equal parts (m,), and for each part the index of the whole edge."""
    whole = np.repeat(np.arange(len(parts)), parts)
    of = SharedEdges(*(column[whole] for column in edges))  # type: ignore[arg-type]
    before = np.arange(len(whole)) - (np.cumsum(parts) - parts)[whole]
    first, last = ((before + more)[:, None] / parts[whole, None] for more in (0, 1))
    # interpolate from both ends of the edge, so that neighbouring parts meet in the same point
    start, end = (of.start * (1.0 - share) + of.end * share for share in (first, last))
    return of._replace(start=start, end=end), whole


def in_order(edges: SharedEdges, kind: Int8Array, blocks: Blocks, grounded: int) -> IntArray:
    """Order of the interfaces: course by course, left to right, the ground last: neighbours are near in memory."""
    middle = (edges.start + edges.end) / 2
    is_ground = np.arange(len(kind)) >= len(kind) - grounded
    course = np.append(blocks.course, -1)[edges.b]
    return np.lexsort((middle[:, 0], middle[:, 1], kind, course, is_ground))


def bodies_of(
    edges: SharedEdges, facet: IntArray, ground: int, mesh: Mesh | None
) -> tuple[Mesh | None, IntArray, IntArray]:
    """Bodies on both sides of each interface: blocks, the ground, or one piece of a facet per interface."""
    if mesh is None:
        return None, edges.a, edges.b
    middle = (edges.start + edges.end) / 2
    on_a = np.where(edges.a == ground, -1, facet[edges.edge_a])
    on = np.stack((on_a, facet[edges.edge_b]), axis=1)
    side = on >= 0
    body = np.stack((edges.a, edges.b), axis=1)
    body[side] = ground + 1 + np.arange(int(side.sum()))
    x, y = (np.repeat(middle[:, axis, None], 2, axis=1)[side] for axis in range(2))
    return mesh.in_pieces(on[side], x, y), body[:, 0].copy(), body[:, 1].copy()


def whole_bricks(a: IntArray, b: IntArray, kind: Int8Array, count: int) -> IntArray:
    """Brick of each of ``count`` blocks: of two halves the number of the first, of others their own."""
    brick, cracks = np.arange(count), kind == ContactKind.BRICK_JOINT
    brick[np.maximum(a, b)[cracks]] = np.minimum(a, b)[cracks]
    return brick


def number_joints(edges: SharedEdges, kind: Int8Array, blocks: Blocks) -> tuple[IntArray, Joints]:
    """Joint of mortar of each interface, and the joints: the bed under a unit is one joint, perpends are single."""
    course = np.append(blocks.course, -1)[edges.b]
    upright = (ContactKind.HEAD_JOINT, ContactKind.CONTROL_JOINT, ContactKind.BRICK_JOINT)
    is_bed = ~np.isin(kind, upright) & (course >= 0)
    count = len(blocks.x) + 1
    brick = whole_bricks(edges.a, edges.b, kind, count)
    key = np.where(is_bed, brick[edges.b], count * (1 + brick[edges.a]) + brick[edges.b])
    _, first, joint = np.unique(key, return_index=True, return_inverse=True)
    # number joints in the order of the interfaces, cracks of bricks last: joints have the numbers of whole bricks
    rank = np.argsort(np.lexsort((first, kind[first] == ContactKind.BRICK_JOINT)))
    joint = rank[joint].astype(np.int64)
    count = len(first)
    length = np.hypot(*(edges.end - edges.start).T)
    middle = (edges.start + edges.end) / 2
    weight = np.bincount(joint, length, count)
    leader = first[np.argsort(rank)]
    x, y = (np.bincount(joint, length * middle[:, axis], count) / weight for axis in (0, 1))
    return joint, Joints(kind[leader], course[leader], x, y)


def quadrature(rule: str, count: int) -> tuple[FloatArray, FloatArray]:
    """Points in [-1/2, 1/2] and weights that sum to 1: equal parts ("midpoint"), or Gauss-Lobatto with both ends."""
    if rule == "midpoint":
        return (np.arange(count) + 0.5) / count - 0.5, np.full(count, 1.0 / count)
    if count < 2:
        raise ValueError("Lobatto quadrature needs at least 2 points")
    legendre = np.polynomial.legendre.Legendre.basis(count - 1)
    inner = np.sort(np.real(legendre.deriv().roots())) if count > 2 else np.empty(0)
    inner = 0.5 * (inner - inner[::-1])  # symmetric to the last digit
    points = np.concatenate(([-1.0], inner, [1.0]))
    weights = 1.0 / (count * (count - 1) * legendre(points) ** 2)
    return points / 2.0, weights / weights.sum()


def place_contacts(
    edges: SharedEdges,
    kind: Int8Array,
    joint: IntArray,
    bodies: tuple[IntArray, IntArray],
    blocks: Blocks,
    mesh: Mesh | None,
    elastic: ElasticBlocks | None,
    solver: Solver,
    thickness: FloatArray,
) -> Interfaces:
    """Interfaces with their contacts; a contact has the thickness of the thinner block."""
    points, weights = quadrature(solver.quadrature, solver.contacts_per_interface)
    middle = (edges.start + edges.end) / 2
    length = np.hypot(*(edges.end - edges.start).T)
    n_x, n_y = edges.normal.T
    centre = np.column_stack((blocks.x, blocks.y))
    # the ground does not turn: any centre serves, but a distant one costs digits, and weighs in the explicit solver
    centre = np.vstack((centre, blocks.vertices.min(axis=0)))
    if mesh is not None:
        centre = np.vstack((centre, mesh.piece_middle))
    body_a, body_b = bodies
    depth = np.minimum(np.append(thickness, np.inf)[edges.a], thickness[edges.b])

    def arms(block: IntArray) -> tuple[FloatArray, FloatArray]:
        r_x, r_y = (middle - centre[block]).T
        return -n_x * r_y + n_y * r_x, -n_y * r_y - n_x * r_x

    (normal_a, shear_a), (normal_b, shear_b) = arms(body_a), arms(body_b)
    return Interfaces(
        block_a=edges.a,
        block_b=edges.b,
        body_a=body_a,
        body_b=body_b,
        kind=kind,
        joint=joint,
        x=middle[:, 0].copy(),
        y=middle[:, 1].copy(),
        length=length,
        normal_x=n_x.copy(),
        normal_y=n_y.copy(),
        arm_normal_a=normal_a,
        arm_shear_a=shear_a,
        arm_normal_b=normal_b,
        arm_shear_b=shear_b,
        contact_offset=length[:, None] * points,
        contact_area=(depth * length)[:, None] * weights,
        elastic=elastic and elastic_sides(elastic, (edges.a, edges.b), middle, edges.normal, length, centre),
    )


Rise = Callable[[FloatArray, float], FloatArray]
"""Displacement of the ground: x (m), load factor -> m."""


def ground_movement(
    geometry: Geometry, rise: Rise | None, along: Rise | None = None, proportional: bool = True, reverses: bool = False
) -> GroundMovement:
    """Movement of the ground upwards and along the wall; its form may change as it grows."""
    x, first = geometry.ground_x, len(geometry.interfaces.kind) - len(geometry.ground_x)
    n_x, n_y = geometry.interfaces.normal_x[first:, None], geometry.interfaces.normal_y[first:, None]

    def state(factor: float) -> Ground:
        up, drift = (np.zeros_like(x) if moved is None else moved(x, factor) for moved in (rise, along))
        return Ground(np.ascontiguousarray(n_y * up + n_x * drift), np.ascontiguousarray(n_y * drift - n_x * up))

    return GroundMovement.through(state, proportional, reverses)


def displacement_by_strain(geometry: Geometry, strain: FloatArray) -> Ground:
    """Displacement of all interfaces by a strain of each block (n,) about its centroid, as if the ground moved."""
    face, blocks = geometry.interfaces, geometry.blocks
    e, x, y = (np.append(values, 0.0) for values in (strain, blocks.x, blocks.y))
    tangent = face.normal_y[:, None], -face.normal_x[:, None]
    position_x, position_y = (m[:, None] + t * face.contact_offset for m, t in zip((face.x, face.y), tangent))
    a, b = face.block_a[:, None], face.block_b[:, None]
    sides = (position_x, x), (position_y, y)
    apart_x, apart_y = (e[b] * (position - c[b]) - e[a] * (position - c[a]) for position, c in sides)
    normal = apart_x * face.normal_x[:, None] + apart_y * face.normal_y[:, None]
    return Ground(-normal, -(apart_x * tangent[0] + apart_y * tangent[1]))


def with_strain(movement: GroundMovement, by_strain: Ground) -> GroundMovement:
    """Movement of the ground with the strain of blocks added; it has one row per interface."""
    first = len(by_strain.normal) - len(movement.full.normal)

    def state(factor: float) -> Ground:
        ground, both = movement.at(factor), (factor * by_strain.normal, factor * by_strain.shear)
        for values, ground_values in zip(both, ground):
            values[first:] += ground_values
        return Ground(*both)

    return GroundMovement.through(state, movement.proportional, movement.reverses)
