"""Deformable blocks: zones and facets for kernels, their stiffness, and motion from the motion of gridpoints."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.mesh import LANES, Mesh
from damagepred.kernels.explicit.tiles import aligned_zeros
from damagepred.kernels.zone.forces import MEMORY, MODULI, SHAPE, WORK, Facets
from damagepred.kernels.zone.law import NO_LIMIT, zone_elasticity, zone_strength


class PackedZones(NamedTuple):
    """Zones in batches of blocks of one pattern, their values side by side; see ``damagepred.kernels.zone.forces``."""

    first_dof: NDArray[np.uint64]  # (b + 1,) where the degrees of freedom of each batch begin
    pattern: IntArray  # (b,) pattern of each batch
    first_corner: IntArray  # (p + 1,) where the cells of each pattern begin
    # (c, 5): where the degrees of freedom of a cell's four corners and of its middle gridpoint begin in a batch
    corners: NDArray[np.uint64]
    first_shape: IntArray  # (b,) where the shapes of each batch's cells begin
    shapes: NDArray[Any]  # records, which batches of equal bricks share
    first_memory: IntArray  # (b,) first history variable of each batch's cells; -1 without strength
    memory: NDArray[Any]  # records
    moduli: NDArray[Any]  # (b,) records of materials; nothing in empty lanes
    work: NDArray[Any]  # (1,) record of work arrays of a cell


def facets_of(model: Model) -> Facets:
    """Return the pieces of facets of a model with deformable blocks."""
    mesh = _mesh(model)
    start, end = mesh.facets[mesh.piece_facet].T
    along_x, along_y = mesh.x[end] - mesh.x[start], mesh.y[end] - mesh.y[start]
    square = along_x**2 + along_y**2
    return Facets(
        mesh.dof_x[start],
        mesh.dof_y[start],
        mesh.dof_x[end],
        mesh.dof_y[end],
        1.0 - mesh.piece_place,
        mesh.piece_place,
        -along_y / square,
        along_x / square,
        3 * (model.n_blocks + 1),
    )


def pack_zones(model: Model) -> PackedZones:
    """Return the zones of a model, with no plastic strain yet."""
    mesh = _mesh(model)
    corners = [cell_gridpoints(p.zones) for p in mesh.patterns]
    cells_of = np.array([len(c) for c in corners])
    first_shape, shapes = _shapes(model, cells_of)
    yields = np.bincount(mesh.batch, can_yield(model)[mesh.block], len(mesh.batch_pattern)) > 0
    in_memory = np.where(yields, cells_of[mesh.batch_pattern], 0)
    moduli = aligned_zeros(len(mesh.batch_pattern), MODULI)
    # empty lanes do not yield
    moduli["strength"][:] = np.array([NO_LIMIT, 1.0, 1.0, NO_LIMIT, NO_LIMIT, 0.0, 1.0])[:, None]
    for name, values in zip(("elasticity", "strength"), block_moduli(model)):
        moduli[name][mesh.batch, :, mesh.lane] = values[mesh.block]
    work = aligned_zeros(1, WORK)
    work["lanes"] = LANES
    return PackedZones(
        first_dof=mesh.batch_dof.astype(np.uint64),
        pattern=mesh.batch_pattern,
        first_corner=np.concatenate(([0], np.cumsum(cells_of))),
        corners=2 * LANES * np.concatenate(corners).astype(np.uint64),
        first_shape=first_shape,
        shapes=shapes,
        first_memory=np.where(yields, np.cumsum(in_memory) - in_memory, -1),
        memory=aligned_zeros(int(in_memory.sum()), MEMORY),
        moduli=moduli,
        work=work,
    )


def _shapes(model: Model, cells_of: IntArray) -> tuple[IntArray, NDArray[Any]]:
    """First shape of each batch, and the shapes: one set for all batches of equal blocks."""
    mesh = _mesh(model)
    thickness = model.block_law.thickness
    slopes, area = zone_slopes(mesh).reshape(-1, 4), mesh.zone_area
    gamma, strain = bending(model)
    first: list[int] = []
    sets: list[NDArray[Any]] = []
    known: dict[bytes, int] = {}
    order = np.lexsort((mesh.lane, mesh.batch))  # within a batch, blocks of one shape stand first
    ends = np.searchsorted(mesh.batch[order], np.arange(len(mesh.batch_pattern) + 1))
    for batch, pattern in enumerate(mesh.batch_pattern):
        cells = aligned_zeros(int(cells_of[pattern]), SHAPE)
        members = order[ends[batch] : ends[batch + 1]]
        zones = [slice(mesh.first_zone[d], mesh.first_zone[d + 1]) for d in members]
        for lane in range(LANES):
            d = min(lane, len(members) - 1)  # empty lanes look like the last block
            cells["slopes"][:, :, :, lane] = slopes[zones[d]].reshape(-1, 4, 4)
            cells["gamma"][:, :, lane] = gamma[zones[d]].reshape(-1, 4)
            cells["bending"][:, :, :, lane] = strain[zones[d]].reshape(-1, 4, 6)
            cells["volume"][:, :, lane] = (area[zones[d]] * thickness[mesh.block[members[d]]]).reshape(-1, 4)
        # alike to nine digits: far from the origin there are no more
        largest = np.abs(cells["slopes"]).max()
        parts = [cells["slopes"] / largest * 1e9, cells["bending"] / largest * 1e9, cells["volume"] * 1e15]
        alike = np.round(np.concatenate([part.ravel() for part in parts]))
        key = (alike + 0.0).tobytes()
        if key not in known:
            known[key] = sum(len(c) for c in sets)
            sets.append(cells)
        first.append(known[key])
    shapes = aligned_zeros(sum(len(c) for c in sets), SHAPE)
    shapes[:] = np.concatenate(sets)
    return np.array(first), shapes


def cell_gridpoints(zones: IntArray) -> IntArray:
    """Return the four corners of each cell and the gridpoint in its middle, (c, 5), of zones (z, 3)."""
    cell = zones.reshape(-1, 4, 3)
    return np.column_stack((cell[:, :, 0], cell[:, 0, 2]))


def zone_slopes(mesh: Mesh) -> FloatArray:
    """Return the slopes (z, 2, 2) of the shape functions of each zone's second and third gridpoint (1/m)."""
    x, y = mesh.x[mesh.zones], mesh.y[mesh.zones]
    twice = 2.0 * mesh.zone_area
    second = np.stack((y[:, 2] - y[:, 0], x[:, 0] - x[:, 2]), axis=1)
    third = np.stack((y[:, 0] - y[:, 1], x[:, 1] - x[:, 0]), axis=1)
    return np.asarray(np.stack((second, third), axis=1) / twice[:, None, None], dtype=np.float64)


def block_moduli(model: Model) -> tuple[FloatArray, FloatArray]:
    """Return elasticity and strength (n, 7) of the blocks as the law of zones takes them."""
    law = model.block_law
    elastic = zone_elasticity(law.elastic_modulus, law.poisson_ratio, model.plane == "strain")
    strength = zone_strength(
        np.minimum(law.cohesion, NO_LIMIT), law.friction, law.dilation, np.minimum(law.tensile_strength, NO_LIMIT)
    )
    return np.column_stack(elastic), np.column_stack(strength)


def block_resultants(model: Model, force: FloatArray) -> FloatArray:
    """Return the resultants (n, 3) (N, N m), moments about the centroids, of forces on gridpoints."""
    mesh = _mesh(model)
    block, x, y = mesh.gridpoint_block, force[mesh.dof_x], force[mesh.dof_y]
    moment = (mesh.x - model.blocks.x[block]) * y - (mesh.y - model.blocks.y[block]) * x
    return np.column_stack([np.bincount(block, values, model.n_blocks) for values in (x, y, moment)])


def can_yield(model: Model) -> BoolArray:
    """Mask (n,) of the blocks with a strength."""
    return np.isfinite(model.block_law.cohesion) | np.isfinite(model.block_law.tensile_strength)


def at_gridpoints(model: Model, values: FloatArray) -> FloatArray:
    """Return the gridpoints' x and y (g, 2) of values on all degrees of freedom (size,)."""
    mesh = _mesh(model)
    return np.column_stack((values[mesh.dof_x], values[mesh.dof_y]))


def rigid_motion(model: Model) -> sparse.csr_array:
    """Matrix (3 n, size) from displacements of gridpoints to the motion of their blocks, by mass and its moment."""
    mesh = _mesh(model)
    block = mesh.gridpoint_block
    area = np.bincount(mesh.zones.ravel(), np.repeat(mesh.zone_area / 3.0, 3), mesh.x.size)
    share = area / model.blocks.area[block]  # in the mass of the block, also where the density is zero
    # about the centroid of the lumped masses, which is the block's
    r_x, r_y = mesh.x - model.blocks.x[block], mesh.y - model.blocks.y[block]
    inertia = np.bincount(block, share * (r_x**2 + r_y**2), model.n_blocks)[block]
    return _sums_by_block(model, share, -share * r_y / inertia, share * r_x / inertia)


def resultants(model: Model) -> sparse.csr_array:
    """Matrix (3 n, size) from forces on gridpoints to resultants, moments over the radius of gyration."""
    mesh = _mesh(model)
    block = mesh.gridpoint_block
    gyration = np.sqrt(model.blocks.polar / model.blocks.area)[block]
    arm_x, arm_y = (mesh.x - model.blocks.x[block]) / gyration, (mesh.y - model.blocks.y[block]) / gyration
    return _sums_by_block(model, np.ones(arm_x.size), -arm_y, arm_x)


def _sums_by_block(model: Model, along: FloatArray, turn_x: FloatArray, turn_y: FloatArray) -> sparse.csr_array:
    """Return the matrix (3 n, size) of sums over gridpoints: x and y weighted alike, and both for the rotation."""
    mesh = _mesh(model)
    block = mesh.gridpoint_block
    rows = np.concatenate((3 * block, 3 * block + 1, 3 * block + 2, 3 * block + 2))
    columns = np.concatenate((mesh.dof_x, mesh.dof_y, mesh.dof_x, mesh.dof_y))
    values = np.concatenate((along, along, turn_x, turn_y))
    return sparse.coo_array((values, (rows, columns)), shape=(3 * model.n_blocks, model.size)).tocsr()


def transformation_matrix(model: Model) -> sparse.csr_array:
    """Matrix T (size, size) from independent displacements to all, u = T u: facets follow their gridpoints."""
    size = model.size
    if model.mesh is None:
        return sparse.eye_array(size, format="csr")
    facets = facets_of(model)
    own = np.ones(size)
    own[3 * model.mesh.block[:, None] + np.arange(3)] = 0.0
    count = len(facets.turn_x)
    body = facets.first_dof + 3 * np.arange(count)
    own[body[:, None] + np.arange(3)] = 0.0
    entries = [
        (np.arange(size), np.arange(size), own),
        (body, facets.start_x, facets.start_share),
        (body, facets.end_x, facets.end_share),
        (body + 1, facets.start_y, facets.start_share),
        (body + 1, facets.end_y, facets.end_share),
        (body + 2, facets.start_x, -facets.turn_x),
        (body + 2, facets.end_x, facets.turn_x),
        (body + 2, facets.start_y, -facets.turn_y),
        (body + 2, facets.end_y, facets.turn_y),
    ]
    rows, columns, values = (np.concatenate(part) for part in zip(*entries))
    return sparse.coo_array((values, (rows, columns)), shape=(size, size)).tocsr()


def zone_stiffness(model: Model) -> sparse.csr_array:
    """Return the elastic stiffness of all zones, (size, size) (N/m)."""
    mesh = _mesh(model)
    size = model.size
    matrix = cell_matrices(model, strain_rows(model))
    points = cell_gridpoints(mesh.zones)
    dof = np.stack((mesh.dof_x[points], mesh.dof_y[points]), axis=2).reshape(-1, 10)
    rows, columns = np.broadcast_to(dof[:, :, None], matrix.shape), np.broadcast_to(dof[:, None, :], matrix.shape)
    return sparse.coo_array((matrix.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size)).tocsr()


class Bending(NamedTuple):
    """Assumed strains of zones in the bending of their cells, in place of the strains of their shape functions.

    One row of crossed constant-strain triangles is 50 % too stiff in bending, and more where they are long: they strain
    as the outermost fibre does, and shear. The strain of a cell follows from its mean displacement gradient, from its
    middle gridpoint, and from the hourglass displacement q of its corners (Flanagan and Belytschko 1981), by which it
    bends. For q an assumed strain is taken (Belytschko and Bindeman 1991, ASQBI): linear across the cell, uniaxial,
    without shear. A zone has the mean of that strain times sqrt(3/2): the energy of four zones is then the energy of
    the linear field, and a rectangle bends as a beam. Constant strains stay constant, and a constant stress does no
    work on q (patch test). The zone law takes the strain of each zone, as without assumed strains.
    """

    # (z,) Share of the displacement of a zone's first gridpoint, a corner of its cell, in q of the cell (1)
    gamma: FloatArray
    # (z, 3, 2) e_xx, e_yy, g_xy added to the strains of the shape functions, for q in x and in y (1/m)
    strain: FloatArray


def bending(model: Model) -> Bending:
    """Return the assumed strains of the zones of a model in bending."""
    mesh = _mesh(model)
    corner = mesh.zones.reshape(-1, 4, 3)[:, :, 0]
    # about a corner of each cell, so that far-away coordinates lose no digits
    far = np.stack((mesh.x[corner[:, :1]], mesh.y[corner[:, :1]]), axis=-1)  # (c, 1, 2)
    x, y = mesh.x[corner] - far[..., 0], mesh.y[corner] - far[..., 1]  # (c, 4)
    sign = np.array([1.0, -1.0, 1.0, -1.0])
    area = mesh.zone_area.reshape(-1, 4)
    twice = 2.0 * area.sum(axis=1, keepdims=True)
    by_x = (np.roll(y, -1, axis=1) - np.roll(y, 1, axis=1)) / twice
    by_y = (np.roll(x, 1, axis=1) - np.roll(x, -1, axis=1)) / twice
    gamma = 0.25 * (sign - (x @ sign)[:, None] * by_x - (y @ sign)[:, None] * by_y)
    # of the shape functions: the corners displaced by +1, -1, +1, -1, the middle not
    slopes = zone_slopes(mesh).reshape(-1, 4, 2, 2)
    after = np.roll(sign, -1)
    own = (after - sign)[:, None] * slopes[:, :, 0] - sign[:, None] * slopes[:, :, 1]  # (c, 4, 2)
    # assumed: the gradient of xi eta at the zones' centroids, in the coordinates of the parallelogram that fits best
    first = 0.25 * np.stack((x @ [-1.0, 1.0, 1.0, -1.0], y @ [-1.0, 1.0, 1.0, -1.0]), axis=-1)
    second = 0.25 * np.stack((x @ [-1.0, -1.0, 1.0, 1.0], y @ [-1.0, -1.0, 1.0, 1.0]), axis=-1)
    dual = np.linalg.inv(np.stack((first, second), axis=-1))  # rows: gradients of xi and of eta
    points = mesh.zones.reshape(-1, 4, 3)
    at = np.stack((mesh.x[points].mean(axis=2), mesh.y[points].mean(axis=2)), axis=-1) - far
    at = at - (area[..., None] * at).sum(axis=1, keepdims=True) / area.sum(axis=1)[:, None, None]
    natural = np.einsum("cij,ckj->cki", dual, at)
    slope = np.sqrt(1.5) * np.einsum("cki,cij->ckj", natural[:, :, ::-1], dual)
    # axes of the cell: rotated by the mean of its two directions
    unit = (
        first / np.hypot(*first.T)[:, None] + np.stack((second[:, 1], -second[:, 0]), -1) / np.hypot(*second.T)[:, None]
    )
    t = unit / np.hypot(*unit.T)[:, None]
    n = np.stack((-t[:, 1], t[:, 0]), axis=-1)
    ratio = model.block_law.poisson_ratio[mesh.zone_block].reshape(-1, 4)
    if model.plane == "strain":
        ratio = ratio / (1.0 - ratio)
    along, across = np.einsum("ckj,cj->ck", slope, t), np.einsum("ckj,cj->ck", slope, n)
    t, n = t[:, None, :], n[:, None, :]
    stretch = along[..., None] * t - (ratio * across)[..., None] * n  # e_tt for q in x and in y, (c, 4, 2)
    swell = across[..., None] * n - (ratio * along)[..., None] * t
    strain = np.stack(
        [
            stretch * t[..., :1] ** 2 + swell * n[..., :1] ** 2,
            stretch * t[..., 1:] ** 2 + swell * n[..., 1:] ** 2,
            2.0 * (stretch * t[..., :1] * t[..., 1:] + swell * n[..., :1] * n[..., 1:]),
        ],
        axis=2,
    )
    strain[:, :, 0, 0] -= own[..., 0]
    strain[:, :, 1, 1] -= own[..., 1]
    strain[:, :, 2, 0] -= own[..., 1]
    strain[:, :, 2, 1] -= own[..., 0]
    return Bending(gamma.ravel(), strain.reshape(-1, 3, 2))


def strain_rows(model: Model) -> FloatArray:
    """Return e_xx, e_yy, g_xy of each zone for unit displacements x, y of its cell's gridpoints, (z, 3, 10) (1/m)."""
    mesh = _mesh(model)
    second_third = zone_slopes(mesh)
    slopes = np.concatenate((-second_third.sum(axis=1, keepdims=True), second_third), axis=1)
    number = np.arange(len(slopes)) % 4
    rows = np.zeros((len(slopes), 3, 5, 2))
    every = np.arange(len(slopes))
    for i, point in enumerate((number, (number + 1) % 4, np.full(len(slopes), 4))):
        rows[every, 0, point, 0] = rows[every, 2, point, 1] = slopes[:, i, 0]
        rows[every, 1, point, 1] = rows[every, 2, point, 0] = slopes[:, i, 1]
    gamma, strain = bending(model)
    rows[:, :, :4] += strain[:, :, None, :] * np.repeat(gamma.reshape(-1, 4), 4, axis=0)[:, None, :, None]
    return rows.reshape(-1, 3, 10)


def cell_matrices(model: Model, rows: FloatArray, which: slice = slice(None)) -> FloatArray:
    """Return the elastic stiffness of cells between x, y of their gridpoints in turn, (c, 10, 10) (N/m)."""
    mesh = _mesh(model)
    block = mesh.zone_block[which]
    c11, c12, c33 = block_moduli(model)[0][block, :3].T
    moduli = np.zeros((len(block), 3, 3))
    moduli[:, 0, 0] = moduli[:, 1, 1] = c11
    moduli[:, 0, 1] = moduli[:, 1, 0] = c12
    moduli[:, 2, 2] = c33
    moduli *= (mesh.zone_area[which] * model.block_law.thickness[block])[:, None, None]
    rows = rows[which]
    found = np.einsum("zki,zkl,zlj->zij", rows, moduli, rows, optimize=True)
    return np.asarray(found.reshape(-1, 4, 10, 10).sum(axis=1))


def _mesh(model: Model) -> Mesh:
    assert model.mesh is not None
    return model.mesh
