"""Edges, boundary points and laws of a model, as the kernels of large movement take them.

The contacts of an interface become two points each: one on the face of either block, measured against the face of the
other, with half the area, the same law and a memory of its own. So their elastic stiffness is that of the contacts of
small displacements. Faces and parts of faces without a joint get points too, corners included; their law is that of
the block's longest joint with its bond broken.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.model import JointProperties
from damagepred.kernels.dynamics.contact import BONDED, EDGE, FREE, POINT
from damagepred.kernels.joint.parameters import joint_parameters
from damagepred.solvers.dynamics.options import DynamicsOptions

GAUSS_POINT = 12.0**-0.5
"""Distance of both Gauss points from the middle of a cell of length 1."""
GROUND_REACH = 1e9
"""Length of the ground to either side (m)."""


class BodyArrays(NamedTuple):
    """Outlines of bodies for contact detection.

    Attributes
    ----------
    points : array of record (p,)
        Boundary points; first the 2 m q of the interfaces, (m, 2, q): those of block b, then those of block a.
    edges : array of record (e,)
        Edges of the blocks, then those of the ground, its lowest level first.
    first_edge : array of int (polygons + 1,)
        Where the edges of each polygon begin: the blocks and, if anything rests on it, the ground at its lowest level.
    laws : array of record (l,)
        ``JOINT_PARAMETERS`` of each bond, followed by those without bond, for later contacts.
    radius : array (n,)
        Largest distance of a corner from its block's centroid (m).
    facing_cosine, continuation_cosine : float
        Of ``DynamicsOptions``.
    """

    points: NDArray[Any]
    edges: NDArray[Any]
    first_edge: IntArray
    laws: NDArray[Any]
    radius: FloatArray
    facing_cosine: float
    continuation_cosine: float


def body_arrays(model: Model, origin: FloatArray, options: DynamicsOptions) -> BodyArrays:
    """Edges, points and laws of a model."""
    centre = np.column_stack((np.append(model.blocks.x, origin[0]), np.append(model.blocks.y, origin[1])))
    edges, first_edge = _edges(model, origin, centre)
    home = _bonded_edges(model, edges, first_edge)
    joined = _joint_points(model, edges, home, centre, options)
    points = np.concatenate((joined, _free_points(model, edges, first_edge, home, centre, options)))
    vertices, first = model.blocks.vertices, model.blocks.first_vertex
    owner = np.repeat(np.arange(model.n_blocks), np.diff(first))
    arm = np.hypot(vertices[:, 0] - model.blocks.x[owner], vertices[:, 1] - model.blocks.y[owner])
    return BodyArrays(
        points,
        edges,
        first_edge,
        _laws(model),
        np.maximum.reduceat(arm, first[:-1]),
        options.facing_cosine,
        options.continuation_cosine,
    )


def _edges(model: Model, origin: FloatArray, centre: FloatArray) -> tuple[NDArray[Any], IntArray]:
    blocks, n = model.blocks, model.n_blocks
    sizes = np.diff(blocks.first_vertex)
    owner = np.repeat(np.arange(n), sizes)
    following = np.arange(len(blocks.vertices)) + 1
    following[blocks.first_vertex[1:] - 1] = blocks.first_vertex[:-1]
    end, start = blocks.vertices, blocks.vertices[following]  # clockwise: from the later corner to the earlier
    own = np.zeros(len(start), dtype=EDGE)
    own["body"] = own["polygon"] = owner
    own["x"], own["y"] = (start - centre[owner]).T
    own["length"] = np.hypot(*(end - start).T)
    own["along_x"], own["along_y"] = (end - start).T / own["length"]
    # the ground: a line, whose outward normal points up, its lowest level endless
    levels = _ground_levels(model)
    face = model.interfaces
    ground = np.zeros(len(levels), dtype=EDGE)
    ground["body"] = ground["polygon"] = n
    ground["along_x"] = 1.0
    for i, level in enumerate(levels):
        ground["y"][i] = level - origin[1]
        if i == 0:
            ground["low"][i], ground["length"][i] = -GROUND_REACH, GROUND_REACH
            continue
        on = _on_ground(model) & (face.y == level)
        left, right = (face.x - face.length / 2)[on].min(), (face.x + face.length / 2)[on].max()
        ground["x"][i], ground["length"][i] = left - origin[0], right - left
    first = np.searchsorted(own["polygon"], np.arange(n + 1))
    if len(levels):
        first = np.append(first, len(own) + 1)
    return np.concatenate((own, ground)), first.astype(np.int64)


def _on_ground(model: Model) -> BoolArray:
    return np.asarray(model.interfaces.block_a == model.n_blocks)


def _ground_levels(model: Model) -> list[float]:
    """Levels at which blocks rest on the ground (m), the lowest first."""
    return sorted(set(model.interfaces.y[_on_ground(model)].tolist()))


class _BondedEdges(NamedTuple):
    """Edges of blocks a and b on which each interface lies."""

    a: IntArray
    b: IntArray


def _bonded_edges(model: Model, edges: NDArray[Any], first_edge: IntArray) -> _BondedEdges:
    face, n = model.interfaces, model.n_blocks
    levels = _ground_levels(model)
    first_ground = int(first_edge[n])

    def find(block: int, i: int, sign: float) -> int:
        if block == n:
            return first_ground + levels.index(face.y[i])
        own = edges[first_edge[block] : first_edge[block + 1]]
        across = -own["along_y"] * face.normal_x[i] * sign + own["along_x"] * face.normal_y[i] * sign
        x, y = face.x[i] - model.blocks.x[block] - own["x"], face.y[i] - model.blocks.y[block] - own["y"]
        along = own["along_x"] * x + own["along_y"] * y
        off = np.abs(own["along_x"] * y - own["along_y"] * x)
        outside = np.maximum(-along, along - own["length"]).clip(min=0.0)
        # of the edges with the right normal, the one nearest to the joint's middle
        miss = np.where(across > 1.0 - 1e-6, off + outside, np.inf)
        return int(first_edge[block] + miss.argmin())

    blocks = ((face.block_a, 1.0), (face.block_b, -1.0))
    return _BondedEdges(*(np.array([find(int(n_), i, sign) for i, n_ in enumerate(b)], np.int64) for b, sign in blocks))


def _joint_points(
    model: Model, edges: NDArray[Any], home: _BondedEdges, centre: FloatArray, options: DynamicsOptions
) -> NDArray[Any]:
    face = model.interfaces
    m, q = face.contact_area.shape
    points = np.zeros((m, 2, q), dtype=POINT)
    x = face.x[:, None] + face.normal_y[:, None] * face.contact_offset
    y = face.y[:, None] - face.normal_x[:, None] * face.contact_offset
    body_a, body_b = face.block_a, face.block_b
    for side, (own, other, own_home, other_home) in enumerate(
        ((body_b, body_a, home.b, home.a), (body_a, body_b, home.a, home.b))
    ):
        p = points[:, side]
        p["body"], p["own_edge"], p["target"] = own[:, None], own_home[:, None], other_home[:, None]
        p["x"], p["y"] = x - centre[own, 0][:, None], y - centre[own, 1][:, None]
        at_x, at_y = x - centre[other, 0][:, None], y - centre[other, 1][:, None]
        e = edges[other_home]
        at_x, at_y = at_x - e["x"][:, None], at_y - e["y"][:, None]
        p["anchor"] = e["along_x"][:, None] * at_x + e["along_y"][:, None] * at_y
        p["offset"] = -(e["along_x"][:, None] * at_y - e["along_y"][:, None] * at_x)
    points["area"] = 0.5 * face.contact_area[:, None, :]
    points["law"] = 2 * np.arange(m)[:, None, None]
    length = face.contact_area * (face.length / face.contact_area.sum(axis=1))[:, None]
    points["edge_overrun"], points["release_opening"] = (
        options.edge_overrun * length[:, None, :],
        options.release_opening * length[:, None, :],
    )
    points["status"] = BONDED
    return points.ravel()


def _free_points(
    model: Model,
    edges: NDArray[Any],
    first_edge: IntArray,
    home: _BondedEdges,
    centre: FloatArray,
    options: DynamicsOptions,
) -> NDArray[Any]:
    """Return points on the parts of faces without a joint, corners included."""
    law = _default_law(model)
    own_edges = edges[: first_edge[model.n_blocks]]
    stretches = _free_stretches(model, own_edges, home, centre)
    cell = float(np.sqrt(model.blocks.area.min()))
    on, along, length = [], [], []
    for edge, start, end in stretches:
        whole = float(edges["length"][edge])
        for place, share in _spread(start, end, cell, start == 0.0, end == whole, options.max_cells):
            on.append(edge)
            along.append(place)
            length.append(share)
    own, way, stretch = np.array(on, dtype=np.int64), np.array(along), np.array(length)
    points = np.zeros(len(on), dtype=POINT)
    e = edges[own]
    points["body"], points["own_edge"] = e["body"], own
    points["x"], points["y"] = e["x"] + e["along_x"] * way, e["y"] + e["along_y"] * way
    points["area"] = 0.5 * stretch * model.block_law.thickness[e["polygon"]]
    points["edge_overrun"], points["release_opening"] = (
        options.edge_overrun * stretch,
        options.release_opening * stretch,
    )
    points["law"] = 2 * law[e["polygon"]] + 1
    points["status"] = FREE
    points["cracked"] = 1.0
    return points


def _free_stretches(
    model: Model, edges: NDArray[Any], home: _BondedEdges, centre: FloatArray
) -> list[tuple[int, float, float]]:
    """Return edge, start and end (m along it) of the parts of blocks' faces without a joint."""
    face, n = model.interfaces, model.n_blocks
    covered: dict[int, list[tuple[float, float]]] = {}
    for block, on in ((face.block_a, home.a), (face.block_b, home.b)):
        own = block < n
        e = edges[on[own]]
        start = centre[e["body"]] + np.column_stack((e["x"], e["y"]))
        along = e["along_x"] * (face.x[own] - start[:, 0]) + e["along_y"] * (face.y[own] - start[:, 1])
        for edge, middle, length in zip(on[own].tolist(), along.tolist(), face.length[own].tolist()):
            covered.setdefault(edge, []).append((middle - length / 2, middle + length / 2))
    found: list[tuple[int, float, float]] = []
    for edge in range(len(edges)):
        length, reached = float(edges["length"][edge]), 0.0
        for begin, end in [*sorted(covered.get(edge, [])), (length, length)]:
            if begin - reached > 1e-6 * length:
                found.append((edge, reached, begin))
            reached = max(reached, end)
    return found


def _spread(
    start: float, end: float, cell: float, first: bool, last: bool, max_cells: int
) -> list[tuple[float, float]]:
    """Return places (m) and lengths (m) of points on a stretch of a face, cell by cell.

    A cell has a point at its end where that is a corner of the block, and none where the stretch borders on a joint:
    quadrature of Lobatto (3 points), Radau or Gauss (2).
    """
    count = min(max(1, round((end - start) / cell)), max_cells)
    size = (end - start) / count
    found = []
    for k in range(count):
        left, right = first and k == 0, last and k == count - 1
        rule: tuple[tuple[float, float], ...]
        if left and right:
            rule = ((0.0, 1 / 6), (0.5, 4 / 6), (1.0, 1 / 6))
        elif left:
            rule = ((0.0, 1 / 4), (2 / 3, 3 / 4))
        elif right:
            rule = ((1 / 3, 3 / 4), (1.0, 1 / 4))
        else:
            rule = ((0.5 - GAUSS_POINT, 1 / 2), (0.5 + GAUSS_POINT, 1 / 2))
        found += [(start + (k + at) * size, share * size) for at, share in rule]
    return found


def _default_law(model: Model) -> IntArray:
    """Return the law of each block where it has no joint: of its longest joint, or that of blocks without any."""
    face, n = model.interfaces, model.n_blocks
    usual = np.full(n + 1, len(face.kind), dtype=np.int64)  # the law after those of the interfaces
    for i in np.argsort(face.length, kind="stable").tolist():
        usual[face.block_a[i]] = usual[face.block_b[i]] = i
    return usual[:-1]


def _laws(model: Model) -> NDArray[Any]:
    """Return the laws of the interfaces and, last, of blocks without any, each followed by that with a broken bond."""
    own = model.properties
    loose = model.loose_joint or JointProperties._make(values[:1] for values in own)
    properties = JointProperties._make(np.concatenate(pair) for pair in zip(own, loose))
    none = np.zeros_like(properties.friction)
    bare = properties._replace(
        tensile_strength=none,
        cohesion=none,
        friction=properties.residual_friction,
        dilation=none,
        residual_tensile_strength=none,
        residual_cohesion=none,
        brittle_shear=none > 0.0,
        critical_opening=none,
        critical_slip=none,
    )
    return np.stack([joint_parameters(pair) for pair in (properties, bare)], axis=1).ravel()
