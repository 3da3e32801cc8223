"""Deformable blocks: any convex polygon cut into constant-strain triangles (zones).

A quadrilateral is divided into cells, a cell by both its diagonals into four zones: no direction is preferred, and
crossed triangles do not lock when the material yields at constant volume (Nagtegaal, Parks and Rice 1974). Any other
polygon is first cut into one quadrilateral for each corner, between the middles of the two edges that meet there and
the centroid. Zones, gridpoints and facets of blocks of the same pattern have the same numbers, so that kernels work on
eight such blocks at once, side by side in memory.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly.geometry import mass_properties
from damagepred.errors import InputError

SHORTEST_CELL = 1e-6
"""Shortest edge of a cell over the longest: gridpoints are joined by their coordinates, which are rounded."""
MOST_ZONES = 2_000_000  # limit of input, in zones: above it, a mistaken unit is likely
LANES = 8  # blocks of one pattern that lie side by side in memory: the float64 lanes of the widest registers


class Pattern(NamedTuple):
    """Connectivity of the zones of a block, by its own numbers of gridpoints."""

    zones: IntArray  # (z, 3): gridpoints, counter-clockwise
    facets: IntArray  # (f, 2): start and end of each piece of the boundary, counter-clockwise
    gridpoints: int  # number of gridpoints


class Mesh(NamedTuple):
    """Zones of all deformable blocks: d blocks, g gridpoints, z zones, f facets, block by block.

    Displacements and forces are vectors over degrees of freedom: 3 per block (n), 3 for the ground, 3 per piece of
    a facet, then the gridpoints, in batches of blocks of one pattern: per gridpoint x of all blocks of the batch,
    then y. The three degrees of freedom of a deformable block are its mean motion; a piece follows the gridpoints
    of its facet. Body n + 1 + i is piece i, which an interface joins. Each side of an interface has its own piece,
    at the middle of the interface, so that two sides with the same strain do not slip where their gridpoints do not
    meet.
    """

    patterns: tuple[Pattern, ...]  # the different patterns
    block: IntArray  # (d,): number of each deformable block, and of its pattern
    pattern: IntArray
    batch: IntArray  # (d,): position in memory
    lane: IntArray
    batch_pattern: IntArray  # (b,): pattern of each batch
    batch_dof: IntArray  # (b + 1,): first degree of freedom of each batch
    first_gridpoint: IntArray  # (d + 1,): first number of each deformable block
    first_zone: IntArray
    first_facet: IntArray
    x: FloatArray  # (g,): gridpoints (m)
    y: FloatArray
    zones: IntArray  # (z, 3): gridpoints, counter-clockwise
    facets: IntArray  # (f, 2): gridpoints at start and end; the outward normal is on the right
    piece_facet: IntArray  # (p,): facet of each piece that an interface joins
    piece_place: FloatArray  # (p,): position of its middle on the facet, 0 at the start, 1 at the end
    dof_x: IntArray  # (g,): degrees of freedom
    dof_y: IntArray
    size: int  # length of the vectors

    @property
    def zone_block(self) -> IntArray:
        """Block of each zone (z,)."""
        return np.repeat(self.block, np.diff(self.first_zone))

    @property
    def gridpoint_block(self) -> IntArray:
        """Block of each gridpoint (g,)."""
        return np.repeat(self.block, np.diff(self.first_gridpoint))

    @property
    def piece_middle(self) -> FloatArray:
        """Middle of each piece (p, 2) (m)."""
        start, end = np.column_stack((self.x, self.y))[self.facets[self.piece_facet].T]
        return (1.0 - self.piece_place[:, None]) * start + self.piece_place[:, None] * end

    def in_pieces(self, facet: IntArray, x: FloatArray, y: FloatArray) -> Mesh:
        """Mesh with these pieces of facets (p,), by their middles (m), and new degrees of freedom."""
        start, end = self.facets[facet].T
        along_x, along_y = self.x[end] - self.x[start], self.y[end] - self.y[start]
        position = ((x - self.x[start]) * along_x + (y - self.y[start]) * along_y) / (along_x**2 + along_y**2)
        more = 3 * (len(facet) - len(self.piece_facet))
        return self._replace(
            piece_facet=facet,
            piece_place=position,
            batch_dof=self.batch_dof + more,
            dof_x=self.dof_x + more,
            dof_y=self.dof_y + more,
            size=self.size + more,
        )

    @property
    def on_boundary(self) -> BoolArray:
        """Whether a gridpoint (g,) lies on its block's boundary."""
        on = np.zeros(self.x.size, dtype=np.bool_)
        on[self.facets] = True
        return on

    @property
    def zone_area(self) -> FloatArray:
        """Area of each zone (z,) (m2)."""
        x, y = self.x[self.zones], self.y[self.zones]
        return 0.5 * ((x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0]))


def division(polygon: FloatArray, size: float) -> tuple[list[FloatArray], tuple[int, int]]:
    """Quadrilaterals of a polygon, and the number of cells along the two directions of each."""
    corners = _without_straight_corners(polygon)
    if len(corners) == 4:
        edge = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)
        cells = (_cells_along(max(edge[0], edge[2]), size), _cells_along(max(edge[1], edge[3]), size))
        quads = [corners]
    else:
        # about the centroid, so that far-away coordinates lose no digits
        _, x, y, _ = mass_properties(corners)
        middle = 0.5 * (corners + np.roll(corners, -1, axis=0))
        quads = [np.array([c, m, (x, y), b]) for c, m, b in zip(corners, middle, np.roll(middle, 1, axis=0))]
        longest = max(np.hypot(*(np.roll(q, -1, axis=0) - q).T).max() for q in quads)
        cells = (max(1, int(np.ceil(longest / size * (1 - 1e-9)))),) * 2
        shortest = float(np.hypot(*(middle - corners).T).min())
        if shortest < SHORTEST_CELL * cells[0] * longest:
            raise InputError(
                f"zone_size = {size:g} m: an edge of {2 * shortest:g} m is too short to be cut into zones in a "
                f"block of {2 * longest:g} m; leave out one of its corners, or keep the block rigid (zone_size = 0)."
            )
    if (count := 4 * len(quads) * cells[0] * cells[1]) > MOST_ZONES:
        raise InputError(
            f"zone_size = {size:g} m: would cut one block into {count} zones, and at most {MOST_ZONES} are allowed; "
            f"take a larger size."
        )
    return quads, cells


def _cells_along(length: float, size: float) -> int:
    """Number of cells along an edge (m): 1 or even, so that the gridpoints of bricks in running bond meet."""
    cells = int(np.ceil(length / size * (1 - 1e-9)))
    return 1 if cells <= 1 else cells + cells % 2


def _without_straight_corners(polygon: FloatArray) -> FloatArray:
    """Polygon without the corners at which the outline does not turn."""
    before, after = polygon - np.roll(polygon, 1, axis=0), np.roll(polygon, -1, axis=0) - polygon
    turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    straight = turn <= 1e-9 * np.hypot(*before.T) * np.hypot(*after.T)
    return polygon[~straight]


def joined_quads(quads: list[FloatArray], cells: tuple[int, int]) -> tuple[Pattern, FloatArray]:
    """Quadrilaterals divided into cells, with common gridpoints on common edges."""
    points, zones = zip(*(_quad(quad, *cells) for quad in quads))
    every = np.concatenate(points)
    triangles = np.concatenate([zones_of + k * len(points[0]) for k, zones_of in enumerate(zones)])
    if len(quads) > 1:
        origin = every.mean(axis=0)
        scale = np.ptp(every, axis=0).max()
        key = np.round((every - origin) / scale * 1e7).astype(np.int64)
        first, number = _same_places(key)
        every, triangles = every[first], number[triangles]
    return Pattern(triangles, _outline(triangles), len(every)), every


def _same_places(key: IntArray) -> tuple[IntArray, IntArray]:
    """Merge points that coincide; return the first of each, and the new numbers of all."""
    pairs = cKDTree(key).query_pairs(2.5, output_type="ndarray")
    leader = np.arange(len(key))
    for a, b in pairs[np.argsort(pairs.max(axis=1))]:
        leader[max(a, b)] = min(leader[a], leader[b])
    first = np.flatnonzero(leader == np.arange(len(key)))
    return first, np.searchsorted(first, leader)


def _quad(quad: FloatArray, along: int, up: int) -> tuple[FloatArray, IntArray]:
    """Points and zones of one quadrilateral in along x up cells: gridpoints row by row, then the middles of cells."""
    s, t = np.meshgrid(np.arange(along + 1) / along, np.arange(up + 1) / up)
    s, t = s.ravel()[:, None], t.ravel()[:, None]
    corners = (1 - s) * (1 - t) * quad[0] + s * (1 - t) * quad[1] + s * t * quad[2] + (1 - s) * t * quad[3]
    row = along + 1
    first = (np.arange(up)[:, None] * row + np.arange(along)).ravel()
    cell = np.stack((first, first + 1, first + 1 + row, first + row), axis=1)
    p = corners[cell]
    middle = _crossing(p)
    centre = len(corners) + np.arange(len(cell))
    zones = np.stack([np.stack((cell[:, i], cell[:, (i + 1) % 4], centre), axis=1) for i in range(4)], axis=1)
    return np.concatenate((corners, middle)), zones.reshape(-1, 3)


def _crossing(cell: FloatArray) -> FloatArray:
    """Intersection of the diagonals of convex cells (c, 4, 2): crossed triangles do not lock there."""
    d, e = cell[:, 2] - cell[:, 0], cell[:, 3] - cell[:, 1]
    gap = cell[:, 1] - cell[:, 0]
    share = (gap[:, 0] * e[:, 1] - gap[:, 1] * e[:, 0]) / (d[:, 0] * e[:, 1] - d[:, 1] * e[:, 0])
    crossing: FloatArray = cell[:, 0] + share[:, None] * d
    return crossing


def _outline(zones: IntArray) -> IntArray:
    """Edges that belong to one zone only, in sequence along the outline."""
    edges = np.concatenate((zones[:, [0, 1]], zones[:, [1, 2]], zones[:, [2, 0]]))
    there = {(a, b) for a, b in edges.tolist()}
    following = {a: b for a, b in edges.tolist() if (b, a) not in there}
    start = min(following)
    outline = [start]
    while following[outline[-1]] != start:
        outline.append(following[outline[-1]])
    return np.column_stack((outline, np.roll(outline, -1))).astype(np.int64)


def mesh_of(polygons: list[FloatArray], sizes: dict[int, float]) -> Mesh | None:
    """Zones of the deformable blocks, by number -> largest edge of the cells (m); None if all are rigid."""
    if not sizes:
        return None
    divisions, total, blocks = [], 0, sorted(sizes)
    for block in blocks:  # count first: millions of zones would fill the memory
        origin = polygons[block].mean(axis=0)
        quads, cells = division(polygons[block] - origin, sizes[block])
        divisions.append((origin, quads, cells))
        total += 4 * len(quads) * cells[0] * cells[1]
        if total > MOST_ZONES:
            raise InputError(
                f"zone_size = {sizes[block]:g} m: would make more than {MOST_ZONES} zones in all, the limit; take a "
                f"larger size, or fewer deformable blocks."
            )
    cuts = [(origin, *joined_quads(quads, cells)) for origin, quads, cells in divisions]
    return joined_mesh(len(polygons), blocks, [(pattern, points + origin) for origin, pattern, points in cuts])


def joined_mesh(count: int, blocks: list[int], cuts: list[tuple[Pattern, FloatArray]]) -> Mesh:
    """Mesh of the deformable blocks among ``count`` blocks, from pattern and gridpoints of each, without pieces."""
    number_of_pattern: dict[tuple[int, bytes], int] = {}
    patterns: list[Pattern] = []
    for pattern, _ in cuts:
        if (key := (pattern.gridpoints, pattern.zones.tobytes())) not in number_of_pattern:
            number_of_pattern[key] = len(patterns)
            patterns.append(pattern)
    number = np.array([number_of_pattern[pattern.gridpoints, pattern.zones.tobytes()] for pattern, _ in cuts])
    batch, lane, batch_pattern = _batches(number, [points - points.mean(axis=0) for _, points in cuts])
    count_g = np.array([patterns[p].gridpoints for p in number])
    first_gridpoint = np.cumsum([0, *count_g])
    batch_dof = 3 * (count + 1) + np.cumsum([0, *(2 * LANES * patterns[p].gridpoints for p in batch_pattern)])
    owner = np.repeat(np.arange(len(blocks)), count_g)
    local = np.arange(len(owner)) - first_gridpoint[owner]
    dof_x = batch_dof[batch[owner]] + 2 * LANES * local + lane[owner]
    xy = np.concatenate([points for _, points in cuts])
    return Mesh(
        patterns=tuple(patterns),
        block=np.array(blocks),
        pattern=number,
        batch=batch,
        lane=lane,
        batch_pattern=batch_pattern,
        batch_dof=batch_dof,
        first_gridpoint=first_gridpoint,
        first_zone=np.cumsum([0, *(len(patterns[p].zones) for p in number)]),
        first_facet=np.cumsum([0, *(len(patterns[p].facets) for p in number)]),
        x=xy[:, 0].copy(),
        y=xy[:, 1].copy(),
        zones=np.concatenate([patterns[p].zones + first for p, first in zip(number, first_gridpoint)]),
        facets=np.concatenate([patterns[p].facets + first for p, first in zip(number, first_gridpoint)]),
        piece_facet=np.empty(0, dtype=np.int64),
        piece_place=np.empty(0),
        dof_x=dof_x,
        dof_y=dof_x + LANES,
        size=int(batch_dof[-1]),
    )


Points = tuple[FloatArray, FloatArray, IntArray]  # x, y (m) and block of each point


class HalfMesh(NamedTuple):
    """Right half of a mesh that is its own mirror image; g gridpoints and z zones of the whole."""

    mesh: Mesh
    facet: IntArray  # number in the half of each facet of the whole, -1 on the left
    axis_gridpoints: IntArray  # gridpoints of the half on the axis, in blocks that it cuts
    gridpoint: IntArray  # (g,), (z,): number in the half with the same values
    zone: IntArray
    mirrored_gridpoint: BoolArray  # (g,), (z,): whether it is the mirror image
    mirrored_zone: BoolArray
    outline: dict[int, FloatArray]  # corners of the right half of each block on the axis, by its number in the half (m)


def half_mesh(mesh: Mesh, axis: float, image: IntArray, number: IntArray, near: float) -> HalfMesh | None:
    """Right half of a mesh, by the image and the number in the half (-1) of each block; None if it has no such half."""
    middle = mesh.x[mesh.zones].mean(axis=1)
    zone_block = mesh.zone_block
    right = (number[zone_block] >= 0) & ((image[zone_block] != zone_block) | (middle > axis))
    blocks, cuts, outline = [], [], {}
    for d in np.flatnonzero(number[mesh.block] >= 0):
        block, pattern, first = int(mesh.block[d]), mesh.patterns[mesh.pattern[d]], mesh.first_gridpoint[d]
        zones = mesh.zones[mesh.first_zone[d] : mesh.first_zone[d + 1]]
        points = np.arange(first, mesh.first_gridpoint[d + 1])
        if image[block] == block:
            kept = zones[right[mesh.first_zone[d] : mesh.first_zone[d + 1]]]
            points, places = np.unique(kept, return_inverse=True)
            if 2 * len(kept) != len(zones) or mesh.x[points].min() < axis - near:
                return None
            pattern = Pattern(places.reshape(-1, 3), _outline(places.reshape(-1, 3)), len(points))
        positions = np.column_stack((mesh.x[points], mesh.y[points]))
        if image[block] == block:
            outline[int(number[block])] = _without_straight_corners(positions[pattern.facets[:, 0]])
        blocks.append(int(number[block]))
        cuts.append((pattern, positions))
    half = joined_mesh(int(number.max()) + 1, blocks, cuts)
    mirror = axis, image, number, near

    spots, half_spots = ((m.x, m.y, m.gridpoint_block) for m in (mesh, half))
    gridpoint, mirrored = _matches(spots, half_spots, *mirror)
    centres, half_centres = ((m.x[m.zones].mean(axis=1), m.y[m.zones].mean(axis=1), m.zone_block) for m in (mesh, half))
    zone, mirrored_zone = _matches(centres, half_centres, *mirror)
    if (gridpoint == len(half.x)).any() or (zone == len(half.zones)).any():
        return None
    numbers = {(a, b): f for f, (a, b) in enumerate(half.facets.tolist())}
    ends = np.where(mirrored[mesh.facets], -1, gridpoint[mesh.facets])
    facet = np.array([numbers.get((a, b), -1) for a, b in ends.tolist()])
    on_axis = np.isin(half.gridpoint_block, list(outline)) & (half.x < axis + near)
    return HalfMesh(half, facet, np.flatnonzero(on_axis), gridpoint, zone, mirrored, mirrored_zone, outline)


def _matches(
    whole: Points, half: Points, axis: float, image: IntArray, number: IntArray, near: float
) -> tuple[IntArray, BoolArray]:
    """Number in the half of each point of the whole (their count if there is none), and whether it is mirrored."""
    (x, y, block), (half_x, half_y, half_block) = whole, half
    apart = 10.0 * float(np.ptp(x) + np.ptp(y))  # a third coordinate separates blocks that touch
    mirrored = (number[block] < 0) | ((image[block] == block) & (x < axis - near))
    kept = np.where(number < 0, number[image], number)[block]
    points = np.column_stack((np.where(mirrored, 2.0 * axis - x, x), y, apart * kept))
    tree = cKDTree(np.column_stack((half_x, half_y, apart * half_block)))
    return tree.query(points, distance_upper_bound=near)[1], mirrored


def _batches(pattern: IntArray, outlines: list[FloatArray]) -> tuple[IntArray, IntArray, IntArray]:
    """Batches of blocks of one pattern, equal shapes first: batch and lane of each block, pattern of each batch."""
    scale = max(np.abs(o).max() for o in outlines)
    rounded = [(np.round(outline / scale * 1e9) + 0.0).tobytes() for outline in outlines]
    shapes: dict[tuple[int, bytes], int] = {}
    shape = np.array([shapes.setdefault(key, len(shapes)) for key in zip(pattern.tolist(), rounded)])
    batch, lane = np.zeros(len(pattern), np.int64), np.zeros(len(pattern), np.int64)
    batch_pattern: list[int] = []
    for p in range(int(pattern.max()) + 1):
        members = np.flatnonzero(pattern == p)
        members = members[np.argsort(shape[members], kind="stable")]
        rank = np.arange(len(members))
        batch[members], lane[members] = len(batch_pattern) + rank // LANES, rank % LANES
        batch_pattern += [p] * (-(-len(members) // LANES))
    return batch, lane, np.array(batch_pattern)


def default_zone_size(polygon: FloatArray, method: str) -> float:
    """Default size of cells (m) of a block: its width, half of it for the explicit solver.

    A brick of 240 x 75 mm gets 8 x 2 cells for the explicit solver, as in the paper, and 4 x 1 for the quasi-static
    solver, whose work grows with the cube of the gridpoints along a course; one facet has no bending.
    """
    corners = polygon - polygon.mean(axis=0)
    edge = np.roll(corners, -1, axis=0) - corners
    outward = np.column_stack((edge[:, 1], -edge[:, 0])) / np.hypot(*edge.T)[:, None]
    width = float(np.ptp(corners @ outward.T, axis=0).min())
    longest = float(np.hypot(*edge.T).max())
    return min(width, 0.5 * longest) if method == "quasi_static" else 0.5 * width
