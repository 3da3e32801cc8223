"""Deformable blocks for the solvers: zones and facets as kernels take them, masses, and what follows from gridpoints."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from damagepred.assembly import Model
from damagepred.assembly.mesh import SIDE_BY_SIDE, Mesh
from damagepred.kernels.zone_law import NO_LIMIT, zone_elasticity, zone_strength
from damagepred.kernels.zones import moduli_type, row_type, work_type
from damagepred.solvers.packed import aligned

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


class Facets(NamedTuple):
    """Facets as ``place_facets`` and ``hand_on`` take them; f of them.

    Attributes
    ----------
    start_x, start_y, end_x, end_y : array of int (f,)
        Degrees of freedom of the gridpoints at both ends.
    turn_x, turn_y : array (f,)
        Rotation for a unit displacement of the end against the start (1/m).
    first_dof : int
        First degree of freedom of the first facet.
    """

    start_x: IntArray
    start_y: IntArray
    end_x: IntArray
    end_y: IntArray
    turn_x: FloatArray
    turn_y: FloatArray
    first_dof: int


class PackedZones(NamedTuple):
    """Zones in batches of blocks of one pattern, one value of each block side by side; see ``damagepred.kernels.zones``.

    Attributes
    ----------
    first_dof : array of int (b + 1,)
        Where the degrees of freedom of each batch begin.
    pattern : array of int (b,)
        Pattern of each batch.
    first_zone : array of int (p + 1,), zone : array of unsigned int (z, 3)
        Where the zones of each pattern begin, and the first degrees of freedom of their gridpoints in a batch.
    first_row : array of int (b + 1,)
        A row is one zone of all blocks of a batch; where the rows of each batch begin.
    rows : array of record (r,), moduli : array of record (b,)
        Zones with their memory, and materials.
    yields : array of bool (b,)
        Whether any block of the batch has a strength.
    work : array of record (1,)
        What a row works with.
    """

    first_dof: NDArray[np.uint64]
    pattern: IntArray
    first_zone: IntArray
    zone: NDArray[np.uint64]
    first_row: IntArray
    rows: NDArray[Any]
    moduli: NDArray[Any]
    yields: BoolArray
    work: NDArray[Any]


def facets_of(model: Model) -> Facets:
    """Return the facets of a model with deformable blocks."""
    mesh = _mesh(model)
    start, end = mesh.facets.T
    along_x, along_y = mesh.x[end] - mesh.x[start], mesh.y[end] - mesh.y[start]
    square = along_x**2 + along_y**2
    return Facets(
        mesh.dof_x[start], mesh.dof_y[start], mesh.dof_x[end], mesh.dof_y[end], -along_y / square, along_x / square,
        3 * (model.n_blocks + 1),
    )  # fmt: skip


def pack_zones(model: Model) -> PackedZones:
    """Return the zones of a model, with no plastic strain yet."""
    mesh = _mesh(model)
    rows_of = np.array([len(p.zones) for p in mesh.patterns])
    first_row = np.concatenate(([0], np.cumsum(rows_of[mesh.batch_pattern])))
    row, lane = zone_places(mesh, first_row)
    records = aligned(int(first_row[-1]), row_type())
    put(records["slopes"], row, lane, zone_slopes(mesh).reshape(-1, 4))
    put(records["volume"], row, lane, mesh.zone_area * model.block_law.thickness[mesh.zone_block])
    moduli = aligned(len(mesh.batch_pattern), moduli_type())
    # empty lanes do not yield
    moduli["strength"][:] = np.array([NO_LIMIT, 1.0, 1.0, NO_LIMIT, NO_LIMIT, 0.0, 1.0])[:, None]
    for name, values in zip(("elasticity", "strength"), block_moduli(model)):
        put(moduli[name], mesh.batch, mesh.lane, values[mesh.block])
    work = aligned(1, work_type())
    work['lanes'] = SIDE_BY_SIDE
    return PackedZones(
        first_dof=mesh.batch_dof.astype(np.uint64),
        pattern=mesh.batch_pattern,
        first_zone=np.concatenate(([0], np.cumsum(rows_of))),
        zone=2 * SIDE_BY_SIDE * np.concatenate([p.zones for p in mesh.patterns]).astype(np.uint64),
        first_row=first_row,
        rows=records,
        moduli=moduli,
        yields=np.bincount(mesh.batch, can_yield(model)[mesh.block], len(mesh.batch_pattern)) > 0,
        work=work,
    )


def put(field: NDArray[Any], row: IntArray, lane: IntArray, values: NDArray[Any]) -> None:
    """Write values, (z,) or (z, k), into a field of rows of eight, (r, 8) or (r, k, 8)."""
    field[row, ..., lane] = values


def zone_places(mesh: Mesh, first_row: IntArray) -> tuple[IntArray, IntArray]:
    """Return row and lane (z,) of each zone in memory."""
    owner = np.repeat(np.arange(len(mesh.block)), np.diff(mesh.first_zone))
    local = np.arange(len(owner)) - mesh.first_zone[owner]
    return first_row[mesh.batch[owner]] + local, mesh.lane[owner]


def zone_slopes(mesh: Mesh) -> FloatArray:
    """Return the slopes (z, 2, 2) of the shape functions of each zone's second and third gridpoint (1/m)."""
    x, y = mesh.x[mesh.zones], mesh.y[mesh.zones]
    twice = 2.0 * mesh.zone_area
    second = np.stack((y[:, 2] - y[:, 0], x[:, 0] - x[:, 2]), axis=1)
    third = np.stack((y[:, 0] - y[:, 1], x[:, 1] - x[:, 0]), axis=1)
    return np.stack((second, third), axis=1) / twice[:, None, None]


def block_moduli(model: Model) -> tuple[FloatArray, FloatArray]:
    """Return elasticity and strength (n, 7) of the blocks as the law of zones takes them."""
    law = model.block_law
    elastic = zone_elasticity(law.elastic_modulus, law.poisson_ratio, model.plane == "strain")
    strength = zone_strength(
        np.minimum(law.cohesion, NO_LIMIT), law.friction, law.dilation, np.minimum(law.tensile_strength, NO_LIMIT)
    )
    return np.column_stack(elastic), np.column_stack(strength)


def can_yield(model: Model) -> BoolArray:
    """Tell which blocks (n,) have a strength."""
    return np.isfinite(model.block_law.cohesion) | np.isfinite(model.block_law.tensile_strength)


def gridpoint_mass(model: Model) -> FloatArray:
    """Return the mass of the gridpoints (g,) (kg): a third of each zone's that meets there (paper, after Eq. 7)."""
    mesh = _mesh(model)
    block = mesh.zone_block
    third = mesh.zone_area * model.block_law.thickness[block] * model.density[block] / 3.0
    return np.bincount(mesh.zones.ravel(), np.repeat(third, 3), mesh.x.size)


def share_of_mass(model: Model) -> FloatArray:
    """Return the share of each gridpoint (g,) in its block: as its mass, also where that is nothing."""
    mesh = _mesh(model)
    third = np.repeat(mesh.zone_area / 3.0, 3)
    area = np.bincount(mesh.zones.ravel(), third, mesh.x.size)
    return area / model.blocks.area[mesh.gridpoint_block]


def spread(model: Model, load: FloatArray) -> FloatArray:
    """Return loads on blocks as loads on all degrees of freedom.

    What acts on a deformable block goes to its gridpoints as if it were accelerated as a rigid one: forces by their
    mass, a moment by mass and arm.

    Parameters
    ----------
    model : Model
        n blocks.
    load : array (3 n,)
        Forces and moments on the blocks (N, N m).

    Returns
    -------
    array (size,)
    """
    out = np.zeros(model.size)
    out[: load.size] = load
    if model.mesh is None:
        return out
    out[3 * model.mesh.block[:, None] + np.arange(3)] = 0.0
    motion = rigid_motion(model)
    out += motion.T @ load
    return out


def rigid_motion(model: Model) -> sparse.csr_array:
    """Return what takes displacements of gridpoints to the mean motion of their blocks, matrix (3 n, size).

    The mean is that of the mass; rotation that of the moment of momentum.
    """
    mesh = _mesh(model)
    block = mesh.gridpoint_block
    share = share_of_mass(model)
    # about the centroid of the lumped masses, which is the block's
    r_x, r_y = mesh.x - model.blocks.x[block], mesh.y - model.blocks.y[block]
    inertia = np.bincount(block, share * (r_x**2 + r_y**2), model.n_blocks)[block]
    rows = np.concatenate((3 * block, 3 * block + 1, 3 * block + 2, 3 * block + 2))
    columns = np.concatenate((mesh.dof_x, mesh.dof_y, mesh.dof_x, mesh.dof_y))
    values = np.concatenate((share, share, -share * r_y / inertia, share * r_x / inertia))
    return sparse.coo_array((values, (rows, columns)), shape=(3 * model.n_blocks, model.size)).tocsr()


def kinematics(model: Model) -> sparse.csr_array:
    """Return what makes displacements of bodies and gridpoints from those that are free to choose, (size, size).

    Facets follow from gridpoints, all else from itself; deformable blocks as a whole do not count.
    """
    size = model.size
    if model.mesh is None:
        return sparse.eye_array(size, format="csr")
    facets = facets_of(model)
    own = np.ones(size)
    own[3 * model.mesh.block[:, None] + np.arange(3)] = 0.0
    count = len(facets.turn_x)
    body = facets.first_dof + 3 * np.arange(count)
    own[body[:, None] + np.arange(3)] = 0.0
    half = np.full(count, 0.5)
    entries = [
        (np.arange(size), np.arange(size), own),
        (body, facets.start_x, half), (body, facets.end_x, half),
        (body + 1, facets.start_y, half), (body + 1, facets.end_y, half),
        (body + 2, facets.start_x, -facets.turn_x), (body + 2, facets.end_x, facets.turn_x),
        (body + 2, facets.start_y, -facets.turn_y), (body + 2, facets.end_y, facets.turn_y),
    ]  # fmt: skip
    rows, columns, values = (np.concatenate(part) for part in zip(*entries))
    return sparse.coo_array((values, (rows, columns)), shape=(size, size)).tocsr()


def zone_stiffness(model: Model) -> sparse.csr_array:
    """Return the elastic stiffness of all zones, (size, size) (N/m)."""
    mesh = _mesh(model)
    size = model.size
    matrix = zone_matrices(model)
    dof = np.stack((mesh.dof_x[mesh.zones], mesh.dof_y[mesh.zones]), axis=2).reshape(-1, 6)
    rows, columns = np.broadcast_to(dof[:, :, None], matrix.shape), np.broadcast_to(dof[:, None, :], matrix.shape)
    return sparse.coo_array((matrix.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size)).tocsr()


def strain_rows(mesh: Mesh) -> FloatArray:
    """Return e_xx, e_yy and g_xy of each zone for unit displacements x, y of its gridpoints in turn, (z, 3, 6) (1/m)."""
    second_third = zone_slopes(mesh)
    slopes = np.concatenate((-second_third.sum(axis=1, keepdims=True), second_third), axis=1)
    rows = np.zeros((len(slopes), 3, 6))
    rows[:, 0, 0::2] = rows[:, 2, 1::2] = slopes[:, :, 0]
    rows[:, 1, 1::2] = rows[:, 2, 0::2] = slopes[:, :, 1]
    return rows


def zone_matrices(model: Model) -> FloatArray:
    """Return the elastic stiffness of each zone between x, y of its gridpoints in turn, (z, 6, 6) (N/m)."""
    mesh = _mesh(model)
    block = mesh.zone_block
    c11, c12, c33 = block_moduli(model)[0][block, :3].T
    moduli = np.zeros((len(block), 3, 3))
    moduli[:, 0, 0] = moduli[:, 1, 1] = c11
    moduli[:, 0, 1] = moduli[:, 1, 0] = c12
    moduli[:, 2, 2] = c33
    moduli *= (mesh.zone_area * model.block_law.thickness[block])[:, None, None]
    rows = strain_rows(mesh)
    return np.einsum("zki,zkl,zlj->zij", rows, moduli, rows, optimize=True)


def idle_dofs(model: Model) -> IntArray:
    """Return the degrees of freedom that follow from others, or belong to nothing: they are not solved for."""
    if model.mesh is None:
        return np.empty(0, dtype=np.int64)
    idle = np.ones(model.size, dtype=np.bool_)
    idle[: 3 * (model.n_blocks + 1)] = False
    idle[3 * model.mesh.block[:, None] + np.arange(3)] = True
    idle[model.mesh.dof_x] = idle[model.mesh.dof_y] = False
    return np.flatnonzero(idle)


def _mesh(model: Model) -> Mesh:
    assert model.mesh is not None
    return model.mesh


def of_zones(model: Model, zones: PackedZones, values: NDArray[Any]) -> NDArray[Any]:
    """Return values by rows and lanes, (r, 8) or (r, k, 8), zone by zone, (z,) or (z, k)."""
    row, lane = zone_places(_mesh(model), zones.first_row)
    return np.ascontiguousarray(values[row, ..., lane])
