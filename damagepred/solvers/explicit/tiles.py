"""Interfaces and their history, packed into tiles for the explicit solver's cycle, and unpacked again."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.model import Ground, GroundMovement, InterfaceRecords
from damagepred.assembly.section import SectionMemory
from damagepred.kernels.concrete_section.structures import Sections
from damagepred.kernels.explicit.tiles import LANES, aligned_zeros, ground_type, tile_type
from damagepred.kernels.joint.parameters import JointParameters
from damagepred.kernels.joint.softening import Softening
from damagepred.solvers.state.wall_state import JointHistory
from damagepred.solvers.system.discrete_system import DiscreteSystem


class PackedStrains(NamedTuple):
    """Blocks with a strain and a curvature, d of them."""

    block: IntArray  # (d,): the first block, and the block after the last one, that share them
    end: IntArray
    stiffness: FloatArray  # (2 d,) of strain (N m) and curvature (N m3) in turn


class PackedJoints(NamedTuple):
    """All interfaces in tiles, joints with the ground in the last ones; empty lanes have no area and no block."""

    tiles: NDArray[Any]  # (t,) records of ``kernels.explicit.tiles``
    ground: NDArray[Any]  # (g,) ground movement under the last g tiles
    contributions: FloatArray  # the tiles' buffer as plain numbers
    first: NDArray[np.uint64]  # (bodies + 1,) start of each body in ``position``
    position: NDArray[np.uint64]  # (2 m,) of the forces on each body in ``contributions``
    lane: IntArray  # (m,) tile * LANES + lane of each interface
    elastic: PackedStrains | None


class PackedSections(NamedTuple):
    """Cracking sections of a footing, whose law replaces the joint law of their contacts."""

    law: Sections
    memory: SectionMemory
    interfaces: InterfaceRecords
    stiffness: FloatArray  # (m, 9) work space
    values: FloatArray  # (s, 6) work space
    commit_interval: int  # cycles between two commits of the history variables; 0: no commits


def pack_sections(model: Model, commit_interval: int) -> PackedSections | None:
    """Cracking sections of a footing before any load; None without reinforced concrete."""
    if model.sections is None:
        return None
    return PackedSections(
        law=model.sections,
        memory=SectionMemory.at_first(model.sections),
        interfaces=model.interface_records,
        stiffness=np.zeros((len(model.interfaces.kind), 9)),
        values=np.zeros((len(model.sections.interface), 6)),
        commit_interval=commit_interval,
    )


def pack_joints(model: Model) -> PackedJoints:
    """Unloaded joints of a model, with their gaps."""
    face, law = model.interfaces, model.properties
    count, points = face.contact_area.shape
    on_ground = model.ground.full.normal.shape[0]
    inner_tiles, ground_tiles = -(-(count - on_ground) // LANES), -(-on_ground // LANES)
    lane = np.arange(count)
    lane[count - on_ground :] += inner_tiles * LANES - (count - on_ground)
    tiles = aligned_zeros(inner_tiles + ground_tiles, tile_type(points, model.elastic is not None))
    ground = aligned_zeros(ground_tiles, ground_type(points))

    tiles["dof_a"] = tiles["dof_b"] = 3 * model.n_blocks
    put(tiles["dof_a"], lane, 3 * face.body_a)
    put(tiles["dof_b"], lane, 3 * face.body_b)
    arms = ("arm_normal_a", "arm_shear_a", "arm_normal_b", "arm_shear_b")
    for name in ("normal_x", "normal_y", *arms, "contact_offset", "contact_area"):
        put(tiles[name], lane, getattr(face, name))
    if model.sections is not None:  # their own law: ``pack_sections``
        sections = model.sections.interface
        put(tiles["contact_area"], lane[sections], np.zeros((len(sections), points)))
    for name in JointParameters._fields:
        put(tiles[name], lane, model.joint_parameters[name])
    first, position = _incidence(model, tiles.dtype, lane)
    packed = PackedJoints(
        tiles=tiles,
        ground=ground,
        contributions=tiles.view(np.float64),
        first=first,
        position=position,
        lane=lane,
        elastic=_pack_strains(model, tiles, lane),
    )
    move_ground(packed, model.ground, 0.0, 1.0)
    if law.gap.any():
        set_history(packed, JointHistory.fresh(model))
    return packed


def _pack_strains(model: Model, tiles: NDArray[Any], lane: IntArray) -> PackedStrains | None:
    """Fill the kinematics of elastic blocks into the tiles; return these blocks, None for walls without."""
    sides = model.interfaces.elastic
    if model.elastic is None or sides is None:
        return None
    for number, side in enumerate("ab"):
        put(tiles[f"strain_dof_{side}"], lane, np.maximum(sides.dof[:, number], 0))  # rigid sides have no row
        put(tiles[f"rows_{side}"], lane, np.delete(sides.rows[:, number].reshape(-1, 6), 4, axis=1))
    block = model.elastic.block
    return PackedStrains(block, block + model.elastic.halves, DiscreteSystem.of(model).strain_stiffness)


def move_ground(joints: PackedJoints, movement: GroundMovement, start: float, end: float) -> None:
    """Set the ground movement under the tiles to the line between two load factors."""
    lanes = np.arange(movement.full.normal.shape[0])
    for name in Ground._fields:
        if movement.proportional:
            rate = getattr(movement.full, name)
            first = np.zeros_like(rate)
        else:
            before, after = (getattr(movement.at(factor), name) for factor in (start, end))
            rate = (after - before) / (end - start) if end != start else np.zeros_like(before)
            first = before - start * rate
        put(joints.ground[name], lanes, rate)
        put(joints.ground[f"{name}_start"], lanes, first)


def needs_full_law(model: Model) -> bool:
    """Whether any joint dilates, softens or breaks by slip, or has a cap or gap; the cycle without is faster."""
    law = model.properties
    special = law.dilation.any() or law.brittle_shear.any() or law.critical_slip.any()
    special = special or law.gap.any()
    return bool(special or np.isfinite(law.compressive_strength).any())


def softening_of(model: Model) -> Softening | None:
    """Softening law of the joints; without it the cycle takes two thirds of the time."""
    law = model.properties
    return Softening(True if law.softening_shape.any() else None) if law.critical_opening.any() else None


def history_of(joints: PackedJoints) -> JointHistory:
    """Copy of the history variables of the contacts."""
    slip, dilatant_opening, cracked, kappa = (take(joints.tiles[name], joints.lane) for name in JointHistory._fields)
    return JointHistory(slip, dilatant_opening, cracked != 0.0, kappa)


def set_history(joints: PackedJoints, history: JointHistory) -> None:
    """Set the history variables of the contacts."""
    for name, values in zip(JointHistory._fields, history, strict=True):
        put(joints.tiles[name], joints.lane, values)


def put(field: NDArray[Any], lane: IntArray, values: NDArray[Any]) -> None:
    """Write values of interfaces into a field of tiles."""
    field[lane // LANES, ..., lane % LANES] = values


def take(field: NDArray[Any], lane: IntArray) -> NDArray[Any]:
    """Values of interfaces, (m,) or (m, rows), from a field of tiles."""
    return np.ascontiguousarray(field[lane // LANES, ..., lane % LANES])


def _incidence(model: Model, record: np.dtype[Any], lane: IntArray) -> tuple[NDArray[np.uint64], NDArray[np.uint64]]:
    """Positions of the forces on each body, one body after the other."""
    face, number = model.interfaces, np.dtype(np.float64).itemsize
    tile = lane // LANES * (record.itemsize // number) + lane % LANES
    fields: Any = record.fields
    position = np.concatenate([tile + fields[name][1] // number for name in ("on_a", "on_b")])
    block = np.concatenate((face.body_a, face.body_b))
    order = np.argsort(block, kind="stable")
    first = np.searchsorted(block[order], np.arange(model.n_bodies + 1))
    return first.astype(np.uint64), position[order].astype(np.uint64)
