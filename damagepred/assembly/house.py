"""Model of a house: the models of its walls side by side, and corners that pass vertical shear between them.

A corner is an interface of blocks of two walls. Its normal lies along the walls, with next to no stiffness, and its
tangent is upright: the slip is the difference of the vertical displacements of the two blocks at the corner. The law of
joints then gives vertical shear with cohesion. Footings that meet are joined by the same interfaces, stiff and
unbreakable: a grillage whose beams share vertical displacements at its nodes, but no rotations and no torsion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly.brick_cracks import bricks_break
from damagepred.assembly.elastic_blocks import ElasticBlocks, elastic_sides
from damagepred.assembly.footing_beam import UNBREAKABLE, UNLIMITED_STRENGTH
from damagepred.assembly.interfaces import quadrature
from damagepred.assembly.model import (
    BlockLaw,
    Blocks,
    Ground,
    GroundMovement,
    Interfaces,
    Jambs,
    JointProperties,
    Joints,
    Model,
    Supports,
)
from damagepred.assembly.properties import joint_properties
from damagepred.assembly.wall import wall_geometry, wall_model
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.kernels.concrete_section.structures import Sections, Wires
from damagepred.kernels.interface.kinematics import ElasticSides
from damagepred.scene import House, Joint
from damagepred.scene.plan import Junction

NODE_STIFFNESS = 1e13
"""Shear stiffness between footings that meet (Pa/m): some hundred times stiffer than a segment of a strip footing."""
NORMAL_SHARE = 1e-12  # normal over shear stiffness of a corner: next to none, but the joint laws divide by it (1)
SPACING = 1.0  # distance between neighbouring walls in the unfolded elevation (m)
TOUCHING = 1e-6  # overlap of blocks that counts (m)


class CornerPairs(NamedTuple):
    """Pairs of blocks that meet at corners, c of them; blocks are numbered in the house."""

    block: IntArray  # (c, 2)
    x: FloatArray  # (c, 2): position of the corner in each wall, in the unfolded elevation (m)
    y: FloatArray  # (c,): middle and length of the common height (m)
    height: FloatArray
    share: FloatArray  # (c,): of the area
    junction: IntArray  # (c,)
    on_footing: BoolArray  # (c,)


class Unfolded(NamedTuple):
    """Geometry of a house, its walls side by side; all samples share it."""

    blocks: Blocks
    interfaces: Interfaces
    joints: Joints
    elastic: ElasticBlocks | None
    first_block: IntArray  # (w + 1,): first block of each wall
    order: IntArray  # interfaces wall by wall, the corners last -> inner ones, corners, ground
    rows: tuple[IntArray, ...]  # interfaces of each wall, in its own order
    corner_rows: IntArray  # (c,): interfaces of the corners
    corners: CornerPairs
    plan: FloatArray  # (2, n): position of each block in plan (m)


@dataclass(frozen=True, kw_only=True)
class HouseModel(Model):
    """Model of all walls side by side, with the model of each wall."""

    walls: tuple[Model, ...]
    unfolded: Unfolded


_RECENT: list[tuple[tuple[object, ...], tuple[object, ...], Unfolded]] = []
"""Geometries of the last houses: identities of their parts, and the plan."""


def house_model(house: House, fields: Mapping[str, FloatArray] | None = None) -> HouseModel:
    """Model of a house; ``fields`` hold values that vary from joint to joint, wall by wall, as in ``wall_model``."""
    if any(bricks_break(scene) for scene in house.scenes):
        raise InputError("block.fracture_energy: bricks of a house do not break; take solver.brick_cracks = 'none'")
    walls = _walls(house, fields or {})
    plan = _unfolded(house, walls)
    law = JointProperties(*_joined([*(m.properties for m in walls), _corner_law(house, plan.corners)], plan.order))
    first = walls[0]
    jambs = [np.where(m.jambs.block < 0, -1, m.jambs.block + n) for m, n in zip(walls, plan.first_block)]

    def all_of(value: Callable[[Model], Any]) -> Any:
        return np.concatenate([value(m) for m in walls])

    return HouseModel(
        blocks=plan.blocks,
        interfaces=plan.interfaces,
        properties=law,
        ground=_ground(house, walls),
        supports=Supports.none(all_of(lambda m: m.supports.load)),
        jambs=Jambs(np.concatenate(jambs), all_of(lambda m: m.jambs.arm)),
        joints=plan.joints,
        density=all_of(lambda m: m.density),
        thickness=first.thickness,
        span=max(m.span for m in walls),
        central_deflection=0.0,
        apex_limited=sum(m.apex_limited for m in walls),
        snap_back_limited=sum(m.snap_back_limited for m in walls),
        block_law=BlockLaw(*_joined([m.block_law for m in walls])),
        elastic=plan.elastic,
        plane=first.plane,
        footing=np.concatenate([m.footing + n for m, n in zip(walls, plan.first_block) if m.footing is not None]),
        sections=_sections(walls, plan.rows),
        surface_movement=house.mound.surface_movement,
        history=first.history,
        walls=walls,
        unfolded=plan,
    )


def _walls(house: House, fields: Mapping[str, FloatArray]) -> tuple[Model, ...]:
    """Models of the walls; each takes its part of the joint fields of its material."""
    if not fields:
        return tuple(wall_model(scene) for scene in house.scenes)
    ends = np.cumsum([len(wall_geometry(scene).mortar.kind) for scene in house.scenes])
    parts: list[dict[str, FloatArray]] = [{} for _ in house.wall]
    for key, values in fields.items():
        if np.shape(values) != (ends[-1],):
            raise InputError(f"'{key}': needs one value for each of the {ends[-1]} joints, got {np.shape(values)}.")
        *name, table, quantity = key.split(".")  # wall.front.joint.cohesion, or joint.cohesion of all other walls
        for wall, part, own in zip(house.wall, parts, np.split(values, ends[:-1])):
            shared = table == "dpc" or (wall.joint is None and (table == "joint" or wall.head_joint is None))
            if name[1:] == [wall.name] or (not name and shared):
                part[f"{table}.{quantity}"] = own
    return tuple(map(wall_model, house.scenes, parts))


def _joined(parts: Sequence[Sequence[np.ndarray]], order: IntArray | slice = slice(None)) -> list[np.ndarray]:
    """Arrays of several records, one after the other, in an order."""
    return [np.concatenate(columns)[order] for columns in zip(*parts)]


def _unfolded(house: House, walls: tuple[Model, ...]) -> Unfolded:
    """Geometry of the walls side by side, made once for samples of the same geometry."""
    parts = tuple(part for m in walls for part in (m.blocks, m.interfaces))
    plan = house.junctions, house.corner.control_joint, house.corner.join_footings, house.solver
    for others, other_plan, geometry in _RECENT:
        if len(others) == len(parts) and all(a is b for a, b in zip(parts, others)) and other_plan == plan:
            return geometry
    geometry = _unfold(house, walls)
    _RECENT[:] = [(parts, plan, geometry), *_RECENT[:3]]
    return geometry


def _starts(counts: Iterable[float]) -> Any:
    return np.cumsum([0, *counts])


def unfolded_starts(house: House) -> FloatArray:
    """Start of each wall in the unfolded elevation (m)."""
    return np.asarray(_starts(wall.length + SPACING for wall in house.wall)[:-1])


def _unfold(house: House, walls: Sequence[Model]) -> Unfolded:
    shift, of_joints = _starts(m.n_blocks for m in walls), _starts(len(m.joints.kind) for m in walls)
    left = unfolded_starts(house)
    blocks, elastic = _blocks(walls, left), _elastic(walls)
    pairs = _corner_pairs(house, walls, shift, left)
    face = _corner_faces(house, pairs, blocks, int(of_joints[-1]))
    faces = []
    for m, n, j, x in zip(walls, shift, of_joints, left):
        sides = {name: getattr(m.interfaces, name) for name in ("block_a", "block_b", "body_a", "body_b")}
        sides = {name: np.where(side == m.n_blocks, shift[-1], side + n) for name, side in sides.items()}
        faces.append(m.interfaces._replace(**sides, joint=m.interfaces.joint + j, x=m.interfaces.x + x))
    ground = [m.on_ground for m in walls]
    order = np.argsort(np.concatenate([2 * g for g in ground] + [np.ones(len(pairs.y))]), kind="stable")
    place, starts = np.argsort(order), _starts(len(g) for g in ground)
    elastic_sides = None if elastic is None else ElasticSides(*_elastic_sides(walls, elastic, pairs, blocks, order))
    joints = [m.joints._replace(x=m.joints.x + x) for m, x in zip(walls, left)]
    corner_joints = Joints(face.kind, blocks.course[pairs.block[:, 0]], face.x, face.y)
    columns = _joined([*(f[:-1] for f in faces), face[:-1]], order)
    interfaces = Interfaces(*columns, elastic_sides)  # type: ignore[call-arg, arg-type]
    all_joints, rows = Joints(*_joined([*joints, corner_joints])), tuple(place[a:b] for a, b in pairwise(starts))
    plan = np.concatenate([wall.points(m.blocks.x) for wall, m in zip(house.wall, walls)]).T.copy()
    return Unfolded(blocks, interfaces, all_joints, elastic, shift, order, rows, place[starts[-1] :], pairs, plan)


def _corner_faces(house: House, pairs: CornerPairs, blocks: Blocks, first_joint: int) -> Interfaces:
    """Interfaces of the corners."""
    count = len(pairs.y)
    points, weights = quadrature(house.solver.quadrature, house.solver.contacts_per_interface)
    thickness = [min(house.wall[w].thickness for w in junction.walls) for junction in house.junctions]
    depth = np.where(pairs.on_footing, house.footing.width, np.array(thickness)[pairs.junction])
    arm, flat = blocks.x[pairs.block] - pairs.x, np.zeros(count)  # the tangent points down
    a, b = pairs.block.T.copy()
    return Interfaces(
        block_a=a,
        block_b=b,
        body_a=a,
        body_b=b,
        kind=np.full(count, ContactKind.HEAD_JOINT, dtype=np.int8),
        joint=first_joint + np.arange(count),
        x=pairs.x[:, 0].copy(),
        y=pairs.y,
        length=pairs.height,
        normal_x=flat + 1.0,
        normal_y=flat,
        arm_normal_a=flat,
        arm_shear_a=arm[:, 0].copy(),
        arm_normal_b=flat,
        arm_shear_b=arm[:, 1].copy(),
        contact_offset=np.zeros((count, len(points))),
        contact_area=(depth * pairs.height * pairs.share)[:, None] * weights,
    )


def _blocks(walls: Sequence[Model], left: FloatArray) -> Blocks:
    """Blocks of all walls, side by side."""
    corners = _starts(len(m.blocks.vertices) for m in walls)
    parts = [
        m.blocks._replace(
            x=m.blocks.x + x,
            vertices=m.blocks.vertices + np.array([x, 0.0]),
            first_vertex=m.blocks.first_vertex[:-1] + n,
        )
        for m, x, n in zip(walls, left, corners)
    ]
    blocks = Blocks(*_joined(parts))
    return blocks._replace(first_vertex=np.append(blocks.first_vertex, corners[-1]))


def _elastic(walls: Sequence[Model]) -> ElasticBlocks | None:
    """Elastic blocks of all walls."""
    parts = [m.elastic for m in walls if m.elastic is not None]
    if not parts:
        return None
    starts, shift = _starts(len(e.block) for e in parts), _starts(m.n_blocks for m in walls)
    numbers = [np.where(e.number < 0, -1, e.number + first)[:-1] for e, first in zip(parts, starts)]
    numbered = [e._replace(block=e.block + n, number=number) for e, n, number in zip(parts, shift, numbers)]
    elastic = ElasticBlocks(*_joined(numbered))
    return elastic._replace(number=np.append(elastic.number, -1))


def _elastic_sides(
    walls: Sequence[Model], elastic: ElasticBlocks, pairs: CornerPairs, blocks: Blocks, order: IntArray
) -> list[np.ndarray]:
    """Degrees of freedom and rows of the sides of all interfaces; each side of a corner has its own position."""
    centre, normal = np.column_stack((blocks.x, blocks.y)), np.tile([1.0, 0.0], (len(pairs.y), 1))
    places = [np.column_stack((x, pairs.y)) for x in pairs.x.T]
    blocks_of = tuple(pairs.block.T)
    a, b = (elastic_sides(elastic, blocks_of, place, normal, pairs.height, centre) for place in places)
    parts, first, start = [], 3 * len(elastic.number), 0
    for m in walls:
        sides = m.interfaces.elastic
        assert sides is not None
        assert m.elastic is not None
        parts.append((np.where(sides.dof < 0, -1, sides.dof - 3 * (m.n_blocks + 1) + first + start), sides.rows))
        start += 2 * len(m.elastic.block)
    return _joined([*parts, (a.dof, np.stack((a.rows[:, 0], b.rows[:, 1]), axis=1))], order)


def _corner_pairs(house: House, walls: Sequence[Model], shift: IntArray, left: FloatArray) -> CornerPairs:
    """Pairs of blocks of different walls at the same height of a corner, footings with footings."""
    found = []
    for number, junction in enumerate(house.junctions):
        i, j = junction.walls
        x = [float(left[w]) + x for w, x in zip(junction.walls, junction.x)]
        for a in _at_corner(walls[i], junction.x[0]):
            for b in _at_corner(walls[j], junction.x[1]):
                bottom, top = max(a.bottom, b.bottom), min(a.top, b.top)
                joined = house.corner.join_footings if a.footing else not house.corner.control_joint
                if a.footing == b.footing and joined and top - bottom > TOUCHING:
                    share = a.share * b.share * (1.0 if a.footing else junction.share)
                    middle, height = 0.5 * (bottom + top), top - bottom
                    found.append((a.block + shift[i], b.block + shift[j], *x, middle, height, share, number, a.footing))
    table = np.array(found, dtype=np.float64).reshape(-1, 9).T.copy()
    block, junctions = table[:2].T.astype(np.int64), table[7].astype(np.int64)
    return CornerPairs(block, table[2:4].T.copy(), table[4], table[5], table[6], junctions, table[8] > 0.0)


class _AtCorner(NamedTuple):
    """Block of a wall at a corner."""

    block: int
    bottom: float
    top: float
    share: float  # where a perpend, or the end of a segment, lies in the corner, each block has half of it
    footing: bool


def _at_corner(model: Model, x: float) -> list[_AtCorner]:
    """Blocks at a position of a wall (m)."""
    blocks, footing = model.blocks, set() if model.footing is None else set(model.footing.tolist())
    low, high = (f.reduceat(blocks.vertices, blocks.first_vertex[:-1]) for f in (np.minimum, np.maximum))
    here = np.flatnonzero((low[:, 0] <= x + TOUCHING) & (high[:, 0] >= x - TOUCHING))
    beside = ((low[here, 1] < blocks.y[here, None]) & (high[here, 1] > blocks.y[here, None])).sum(axis=1)
    shares = zip(here.tolist(), (1.0 / beside).tolist())
    return [_AtCorner(b, float(low[b, 1]), float(high[b, 1]), share, b in footing) for b, share in shares]


def _corner_law(house: House, pairs: CornerPairs) -> JointProperties:
    """Law of the corners: vertical shear with cohesion, no opening; footings that meet never part."""
    node = replace(UNBREAKABLE, normal_stiffness=NORMAL_SHARE * NODE_STIFFNESS, shear_stiffness=NODE_STIFFNESS)
    materials = [node, *(_toothing(house, junction) for junction in house.junctions)]
    material = np.where(pairs.on_footing, 0, 1 + pairs.junction)
    return joint_properties(materials, material, np.arange(len(material)), {})[0]


def _toothing(house: House, junction: Junction) -> Joint:
    """Joint between the bricks of two walls; a corner whose bond has broken still does not open."""
    corner, heads = house.corner, [house.scenes[w].heads for w in junction.walls]

    def of(value: float | None, name: str, factor: str = "") -> float:
        own = min(getattr(joint, name) * (getattr(joint, factor) if factor else 1.0) for joint in heads)
        return own if value is None else value

    rubbing = of(corner.friction, "friction") * corner.pressure
    stiffness = of(corner.stiffness, "shear_stiffness")
    brittle = all(joint.brittle_shear for joint in heads) if corner.brittle is None else corner.brittle
    return Joint(
        normal_stiffness=max(NORMAL_SHARE * stiffness, 1e-3),
        shear_stiffness=stiffness,
        tensile_strength=UNLIMITED_STRENGTH,
        cohesion=of(corner.cohesion, "cohesion", "strength_factor") + rubbing,
        friction=0.0,
        brittle_shear=brittle,
        residual_tensile_strength=UNLIMITED_STRENGTH if brittle else 0.0,
        residual_cohesion=rubbing if brittle else 0.0,
    )


def _sections(walls: Sequence[Model], rows: Sequence[IntArray]) -> Sections | None:
    """Sections of all reinforced footings."""
    parts = [m.sections._replace(interface=row[m.sections.interface]) for m, row in zip(walls, rows) if m.sections]
    if not parts:
        return None
    wires = Wires(*_joined([s.wires for s in parts]))
    names = [name for name in Sections._fields if name != "wires"]
    return Sections(**{name: np.concatenate([getattr(s, name) for s in parts]) for name in names}, wires=wires)


def _ground(house: House, walls: Sequence[Model]) -> GroundMovement:
    """Movement of the ground under all footings: the surface along the axis of each wall."""
    plan, axes, normals = [], [], []
    for wall, m in zip(house.wall, walls):
        face = m.interfaces.taken(np.flatnonzero(m.on_ground))
        plan.append(wall.points(face.x[:, None] + face.normal_y[:, None] * face.contact_offset))
        axes.append(np.broadcast_to(wall.direction, plan[-1].shape))
        normals.append((face.normal_x[:, None], face.normal_y[:, None]))
    points, axis = np.concatenate(plan), np.concatenate(axes)
    n_x, n_y = _joined(normals)

    def state(factor: float) -> Ground:
        rise, drift = house.surface(points, factor), (house._drift(points, factor) * axis).sum(axis=-1)
        return Ground(np.ascontiguousarray(n_y * rise + n_x * drift), np.ascontiguousarray(n_y * drift - n_x * rise))

    reverses = house.movement.reverses
    return GroundMovement.through(state, house.ground_is_proportional and not reverses, reverses)
