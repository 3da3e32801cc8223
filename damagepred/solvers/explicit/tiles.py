"""Interfaces and their history, packed into tiles for the explicit solver's cycle, and unpacked again."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.model import Ground, GroundMovement, InterfaceRecords, JointProperties
from damagepred.assembly.section import SectionMemory, Sections
from damagepred.kernels.explicit.tiles import LANES, aligned_zeros, ground_type, tile_type
from damagepred.kernels.joint.parameters import JointParameters
from damagepred.kernels.joint.softening import Softening
from damagepred.solvers.state.joint_history import JointHistory
from damagepred.solvers.system.discrete_system import DiscreteSystem


class PackedStrains(NamedTuple):
    """Blocks with a strain and a curvature, d of them.

    Attributes
    ----------
    block : array of int (d,)
        Number of each.
    stiffness : array (2 d,)
        Of strain (N m) and curvature (N m3) in turn.
    """

    block: IntArray
    stiffness: FloatArray


class PackedJoints(NamedTuple):
    """All interfaces in tiles; those with the ground fill the last ones. Empty lanes have no area and act on no block.

    Attributes
    ----------
    tiles : array of record (t,)
        See ``damagepred.kernels.explicit.tiles``.
    ground : array of record (g,)
        Movement of the ground under the last g tiles, a straight line in the load factor; see ``move_ground``.
    contributions : array of float
        The tiles' buffer as plain numbers.
    first : array of unsigned int (bodies + 1,), position : array of unsigned int (2 m,)
        ``position[first[j]:first[j + 1]]`` is where ``contributions`` holds the forces on body j.
    lane : array of int (m,)
        Place of each interface: tile * LANES + lane.
    elastic : PackedStrains or None
        None if no block is elastic.
    """

    tiles: NDArray[Any]
    ground: NDArray[Any]
    contributions: FloatArray
    first: NDArray[np.uint64]
    position: NDArray[np.uint64]
    lane: IntArray
    elastic: PackedStrains | None


class PackedSections(NamedTuple):
    """Sections of a footing that cracks, whose law takes the place of that of their contacts.

    Attributes
    ----------
    law, memory
        See ``damagepred.assembly.section``.
    interfaces, properties
        Of the whole model.
    stiffness : array (m, 9)
        Room that the forces' kernel fills.
    commit_interval : int
        Cycles from one commit of the history variables to the next; 0: none.
    """

    law: Sections
    memory: SectionMemory
    interfaces: InterfaceRecords
    properties: JointProperties
    stiffness: FloatArray
    commit_interval: int


def pack_sections(model: Model, commit_interval: int) -> PackedSections | None:
    """Return the cracking sections of a model's footing, as they are before any load; None if it has none.

    Parameters
    ----------
    model : Model
        m interfaces.
    commit_interval : int
        Cycles from one commit of their history variables to the next; 0: none.
    """
    if model.sections is None:
        return None
    memory = SectionMemory.at_first(model.sections)
    room = np.zeros((len(model.interfaces.kind), 9))
    return PackedSections(model.sections, memory, model.interface_records, model.properties, room, commit_interval)


def pack_joints(model: Model) -> PackedJoints:
    """Return the joints of a model, unloaded, with their gaps."""
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
    for name in (
        "normal_x",
        "normal_y",
        "arm_normal_a",
        "arm_shear_a",
        "arm_normal_b",
        "arm_shear_b",
        "contact_offset",
        "contact_area",
    ):
        put(tiles[name], lane, getattr(face, name))
    if model.sections is not None:  # these have a law of their own: see ``pack_sections``
        here = model.sections.interface
        put(tiles["contact_area"], lane[here], np.zeros((len(here), points)))
    for name in JointParameters._fields:
        put(tiles[name], lane, model.joint_parameters[name])
    incidence, elastic = _incidence(model, tiles.dtype, lane), _pack_strains(model, tiles, lane)
    packed = PackedJoints(tiles, ground, tiles.view(np.float64), *incidence, lane, elastic)
    move_ground(packed, model.ground, 0.0, 1.0)
    if law.gap.any():
        set_history(packed, JointHistory.fresh(model))
    return packed


def _pack_strains(model: Model, tiles: NDArray[Any], lane: IntArray) -> PackedStrains | None:
    """Fill in the tiles how elastic blocks move the interfaces; return these blocks, None if there are none."""
    sides = model.interfaces.elastic
    if model.elastic is None or sides is None:
        return None
    for number, side in enumerate("ab"):
        put(tiles[f"strain_dof_{side}"], lane, np.maximum(sides.dof[:, number], 0))  # no row belongs to rigid sides
        put(tiles[f"rows_{side}"], lane, np.delete(sides.rows[:, number].reshape(-1, 6), 4, axis=1))
    return PackedStrains(model.elastic.block, DiscreteSystem.of(model).strain_stiffness)


def move_ground(joints: PackedJoints, movement: GroundMovement, start: float, end: float) -> None:
    """Set the linear movement of the ground under the tiles between its states at two load factors.

    Parameters
    ----------
    joints : PackedJoints
        Tiles on the ground.
    movement : GroundMovement
        States of the ground.
    start, end : float
        Load factors; where they are equal, the ground stays.
    """
    here = np.arange(movement.full.normal.shape[0])
    for name in Ground._fields:
        if movement.proportional:
            rate = getattr(movement.full, name)
            first = np.zeros_like(rate)
        else:
            before, after = (getattr(movement.at(factor), name) for factor in (start, end))
            rate = (after - before) / (end - start) if end != start else np.zeros_like(before)
            first = before - start * rate
        put(joints.ground[name], here, rate)
        put(joints.ground[f"{name}_start"], here, first)


def needs_full_law(model: Model) -> bool:
    """Return whether any joint dilates, softens or breaks by slip, has a cap or gap: otherwise the cycle is faster."""
    law = model.properties
    special = law.dilation.any() or law.brittle_shear.any() or law.critical_slip.any()
    special = special or law.gap.any()
    return bool(special or np.isfinite(law.compressive_strength).any())


def softening_of(model: Model) -> Softening | None:
    """Return what softening the joints need; without any the cycle takes two thirds of the time."""
    law = model.properties
    return Softening(True if law.softening_shape.any() else None) if law.critical_opening.any() else None


def history_of(joints: PackedJoints) -> JointHistory:
    """Return a copy of the history variables of the contacts."""
    slip, dilatant_opening, cracked, kappa = (take(joints.tiles[name], joints.lane) for name in JointHistory._fields)
    return JointHistory(slip, dilatant_opening, cracked != 0.0, kappa)


def set_history(joints: PackedJoints, history: JointHistory) -> None:
    """Set the history variables of the contacts.

    Parameters
    ----------
    joints : PackedJoints
        Its tiles are changed.
    history : JointHistory
        Arrays (m, q).
    """
    for name, values in zip(JointHistory._fields, history, strict=True):
        put(joints.tiles[name], joints.lane, values)


def put(field: NDArray[Any], lane: IntArray, values: NDArray[Any]) -> None:
    """Write values of interfaces into a field of tiles.

    Parameters
    ----------
    field : array (t, LANES) or (t, rows, LANES)
        Of t tiles: changed.
    lane : array of int (m,)
        Place of each interface: tile * LANES + lane.
    values : array (m,) or (m, rows)
        To write.
    """
    field[lane // LANES, ..., lane % LANES] = values


def take(field: NDArray[Any], lane: IntArray) -> NDArray[Any]:
    """Return the values of interfaces, (m,) or (m, rows), from a field of tiles.

    Parameters
    ----------
    field : array (t, LANES) or (t, rows, LANES)
        Of t tiles.
    lane : array of int (m,)
        Place of each interface: tile * LANES + lane.
    """
    return np.ascontiguousarray(field[lane // LANES, ..., lane % LANES])


def _incidence(model: Model, record: np.dtype[Any], lane: IntArray) -> tuple[NDArray[np.uint64], NDArray[np.uint64]]:
    """Return the positions of the forces on each body, one body after the other."""
    face, number = model.interfaces, np.dtype(np.float64).itemsize
    tile = lane // LANES * (record.itemsize // number) + lane % LANES
    fields: Any = record.fields
    position = np.concatenate([tile + fields[name][1] // number for name in ("on_a", "on_b")])
    block = np.concatenate((face.body_a, face.body_b))
    order = np.argsort(block, kind="stable")
    first = np.searchsorted(block[order], np.arange(model.n_bodies + 1))
    return first.astype(np.uint64), position[order].astype(np.uint64)
