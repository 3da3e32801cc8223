"""Edges, boundary points and laws of a model for the kernels of large displacements.

A contact of an interface becomes two points, one on the face of either block against the face of the other, each with
half the area, the same law and its own history: the elastic stiffness of small displacements. Free parts of faces and
corners also have points, with the law of the block's longest joint without bond.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.model import JointProperties
from damagepred.kernels.dynamics.contact import BONDED, EDGE, FREE, POINT
from damagepred.kernels.joint.parameters import joint_parameters

EDGE_OVERRUN = 0.02
"""Length by which a point may pass the end of the edge it faces, over the length it stands for (1)."""
RELEASE_OPENING = 0.1
"""Opening at which a point with a broken bond leaves its first edge, over the length it stands for (1)."""
MAX_CELLS = 100
"""Cells of points on a stretch of a face without joint."""

GAUSS_POINT = 12.0**-0.5
"""Distance of both Gauss points from the middle of a cell of length 1."""
GROUND_REACH = 1e9
"""Length of the ground to either side (m)."""


BondedEdges = tuple[IntArray, IntArray]


class BodyArrays(NamedTuple):
    """Outlines of bodies for contact detection."""

    points: NDArray[Any]  # (p,) first the points of the interfaces (m, 2, q), block b before block a
    edges: NDArray[Any]  # (e,) of the blocks, then of the ground, its lowest level first
    first_edge: IntArray  # (polygons + 1,) start of the blocks' edges and, under a wall on ground, of its lowest level
    laws: NDArray[Any]  # (l,) ``JOINT_PARAMETERS`` of each bond, each followed by the law without bond
    radius: FloatArray  # (n,) largest distance of a corner from the centroid of its block (m)


def body_arrays(model: Model, origin: FloatArray) -> BodyArrays:
    """Edges, points and laws of a model."""
    centre = np.column_stack((np.append(model.blocks.x, origin[0]), np.append(model.blocks.y, origin[1])))
    edges, first_edge = _edges(model, origin, centre)
    home = _bonded_edges(model, edges, first_edge)
    joined = _joint_points(model, edges, home, centre)
    points = np.concatenate((joined, _free_points(model, edges, first_edge, home, centre)))
    vertices, first = model.blocks.vertices, model.blocks.first_vertex
    owner = np.repeat(np.arange(model.n_blocks), np.diff(first))
    arm = np.hypot(vertices[:, 0] - model.blocks.x[owner], vertices[:, 1] - model.blocks.y[owner])
    return BodyArrays(
        points=points,
        edges=edges,
        first_edge=first_edge,
        laws=_laws(model),
        radius=np.maximum.reduceat(arm, first[:-1]),
    )


def _edges(model: Model, origin: FloatArray, centre: FloatArray) -> tuple[NDArray[Any], IntArray]:
    blocks, n = model.blocks, model.n_blocks
    sizes = np.diff(blocks.first_vertex)
    owner = np.repeat(np.arange(n), sizes)
    following = np.arange(len(blocks.vertices)) + 1
    following[blocks.first_vertex[1:] - 1] = blocks.first_vertex[:-1]
    end, start = blocks.vertices, blocks.vertices[following]  # clockwise: from the later corner to the earlier
    of_blocks = np.zeros(len(start), dtype=EDGE)
    of_blocks["body"] = of_blocks["polygon"] = owner
    of_blocks["x"], of_blocks["y"] = (start - centre[owner]).T
    of_blocks["length"] = np.hypot(*(end - start).T)
    of_blocks["along_x"], of_blocks["along_y"] = (end - start).T / of_blocks["length"]
    # the ground: lines with an upward normal, the lowest endless
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
        on = model.on_ground & (face.y == level)
        x_low, x_high = (face.x - face.length / 2)[on].min(), (face.x + face.length / 2)[on].max()
        ground["x"][i], ground["length"][i] = x_low - origin[0], x_high - x_low
    first = np.searchsorted(of_blocks["polygon"], np.arange(n + 1))
    if len(levels):
        first = np.append(first, len(of_blocks) + 1)
    return np.concatenate((of_blocks, ground)), first.astype(np.int64)


def _ground_levels(model: Model) -> list[float]:
    """Levels at which blocks rest on the ground (m), the lowest first."""
    return sorted(set(model.interfaces.y[model.on_ground].tolist()))


def _bonded_edges(model: Model, edges: NDArray[Any], first_edge: IntArray) -> BondedEdges:
    """Edges of block a and of block b on which each interface lies."""
    face, n = model.interfaces, model.n_blocks
    levels = _ground_levels(model)
    first_ground = int(first_edge[n])

    def find(block: int, i: int, sign: float) -> int:
        if block == n:
            return first_ground + levels.index(face.y[i])
        candidates = edges[first_edge[block] : first_edge[block + 1]]
        across = -candidates["along_y"] * face.normal_x[i] * sign + candidates["along_x"] * face.normal_y[i] * sign
        x, y = face.x[i] - model.blocks.x[block] - candidates["x"], face.y[i] - model.blocks.y[block] - candidates["y"]
        along = candidates["along_x"] * x + candidates["along_y"] * y
        off = np.abs(candidates["along_x"] * y - candidates["along_y"] * x)
        outside = np.maximum(-along, along - candidates["length"]).clip(min=0.0)
        # the nearest to the middle of the joint among the edges with its normal
        miss = np.where(across > 1.0 - 1e-6, off + outside, np.inf)
        return int(first_edge[block] + miss.argmin())

    blocks = ((face.block_a, 1.0), (face.block_b, -1.0))
    on_a, on_b = (np.array([find(int(n_), i, sign) for i, n_ in enumerate(b)], np.int64) for b, sign in blocks)
    return on_a, on_b


def _joint_points(model: Model, edges: NDArray[Any], home: BondedEdges, centre: FloatArray) -> NDArray[Any]:
    face = model.interfaces
    m, q = face.contact_area.shape
    points = np.zeros((m, 2, q), dtype=POINT)
    x = face.x[:, None] + face.normal_y[:, None] * face.contact_offset
    y = face.y[:, None] - face.normal_x[:, None] * face.contact_offset
    body_a, body_b = face.block_a, face.block_b
    for side, (body, other, edge, target) in enumerate(
        ((body_b, body_a, home[1], home[0]), (body_a, body_b, home[0], home[1]))
    ):
        p = points[:, side]
        p["body"], p["own_edge"], p["target"] = body[:, None], edge[:, None], target[:, None]
        p["x"], p["y"] = x - centre[body, 0][:, None], y - centre[body, 1][:, None]
        at_x, at_y = x - centre[other, 0][:, None], y - centre[other, 1][:, None]
        e = edges[target]
        at_x, at_y = at_x - e["x"][:, None], at_y - e["y"][:, None]
        p["anchor"] = e["along_x"][:, None] * at_x + e["along_y"][:, None] * at_y
        p["offset"] = -(e["along_x"][:, None] * at_y - e["along_y"][:, None] * at_x)
    points["area"] = 0.5 * face.contact_area[:, None, :]
    points["law"] = 2 * np.arange(m)[:, None, None]
    length = face.contact_area * (face.length / face.contact_area.sum(axis=1))[:, None]
    points["edge_overrun"] = EDGE_OVERRUN * length[:, None, :]
    points["release_opening"] = RELEASE_OPENING * length[:, None, :]
    points["status"] = BONDED
    return points.ravel()


def _free_points(
    model: Model, edges: NDArray[Any], first_edge: IntArray, home: BondedEdges, centre: FloatArray
) -> NDArray[Any]:
    """Points on the parts of faces without a joint, corners included."""
    law = _default_law(model)
    own_edges = edges[: first_edge[model.n_blocks]]
    stretches = _free_stretches(model, own_edges, home, centre)
    cell = float(np.sqrt(model.blocks.area.min()))
    on, along, length = [], [], []
    for edge, start, end in stretches:
        whole = float(edges["length"][edge])
        for position, share in _spread(start, end, cell, start == 0.0, end == whole):
            on.append(edge)
            along.append(position)
            length.append(share)
    edge_index, way, stretch = np.array(on, dtype=np.int64), np.array(along), np.array(length)
    points = np.zeros(len(on), dtype=POINT)
    e = edges[edge_index]
    points["body"], points["own_edge"] = e["body"], edge_index
    points["x"], points["y"] = e["x"] + e["along_x"] * way, e["y"] + e["along_y"] * way
    points["area"] = 0.5 * stretch * model.block_law.thickness[e["polygon"]]
    points["edge_overrun"] = EDGE_OVERRUN * stretch
    points["release_opening"] = RELEASE_OPENING * stretch
    points["law"] = 2 * law[e["polygon"]] + 1
    points["status"] = FREE
    points["cracked"] = 1.0
    return points


def _free_stretches(
    model: Model, edges: NDArray[Any], home: BondedEdges, centre: FloatArray
) -> list[tuple[int, float, float]]:
    """Edge, start and end (m along it) of the parts of faces without a joint."""
    face, n = model.interfaces, model.n_blocks
    covered: dict[int, list[tuple[float, float]]] = {}
    for block, on in ((face.block_a, home[0]), (face.block_b, home[1])):
        is_block = block < n
        e = edges[on[is_block]]
        start = centre[e["body"]] + np.column_stack((e["x"], e["y"]))
        along = e["along_x"] * (face.x[is_block] - start[:, 0]) + e["along_y"] * (face.y[is_block] - start[:, 1])
        for edge, middle, length in zip(on[is_block].tolist(), along.tolist(), face.length[is_block].tolist()):
            covered.setdefault(edge, []).append((middle - length / 2, middle + length / 2))
    stretches: list[tuple[int, float, float]] = []
    for edge in range(len(edges)):
        length, reached = float(edges["length"][edge]), 0.0
        for begin, end in [*sorted(covered.get(edge, [])), (length, length)]:
            if begin - reached > 1e-6 * length:
                stretches.append((edge, reached, begin))
            reached = max(reached, end)
    return stretches


def _spread(start: float, end: float, cell: float, first: bool, last: bool) -> list[tuple[float, float]]:
    """Gauss, Radau (one corner) or Lobatto points (both corners) of cells of a face, and their lengths (m)."""
    count = min(max(1, round((end - start) / cell)), MAX_CELLS)
    size = (end - start) / count
    points = []
    for k in range(count):
        corner_first, corner_last = first and k == 0, last and k == count - 1
        rule: tuple[tuple[float, float], ...]
        if corner_first and corner_last:
            rule = ((0.0, 1 / 6), (0.5, 4 / 6), (1.0, 1 / 6))
        elif corner_first:
            rule = ((0.0, 1 / 4), (2 / 3, 3 / 4))
        elif corner_last:
            rule = ((1 / 3, 3 / 4), (1.0, 1 / 4))
        else:
            rule = ((0.5 - GAUSS_POINT, 1 / 2), (0.5 + GAUSS_POINT, 1 / 2))
        points += [(start + (k + position) * size, share * size) for position, share in rule]
    return points


def _default_law(model: Model) -> IntArray:
    """Law of each block on its free faces: of its longest joint, or the law of blocks without joints."""
    face, n = model.interfaces, model.n_blocks
    usual = np.full(n + 1, len(face.kind), dtype=np.int64)  # the law after the interfaces'
    for i in np.argsort(face.length, kind="stable").tolist():
        usual[face.block_a[i]] = usual[face.block_b[i]] = i
    return usual[:-1]


def _laws(model: Model) -> NDArray[Any]:
    """Laws of the interfaces and, last, of blocks without joints, each followed by the law without bond."""
    joints = model.properties
    loose = model.loose_joint or JointProperties._make(values[:1] for values in joints)
    properties = JointProperties._make(np.concatenate(pair) for pair in zip(joints, loose))
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
