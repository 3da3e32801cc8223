"""Supports, movements and loads of single gridpoints and edges of deformable blocks."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray
from damagepred.assembly.mesh import Mesh
from damagepred.assembly.model import Supports
from damagepred.errors import InputError

Where = Callable[[FloatArray, FloatArray], BoolArray]  # points x, y (m) -> mask of the chosen points
Amount = float | Callable[[FloatArray, FloatArray], FloatArray]  # a number, or a function of x, y (m)
GAUSS = (0.5 - np.sqrt(1 / 12), 0.5 + np.sqrt(1 / 12))
"""Gauss points of a traction along a facet: exact up to the third degree."""


class Hold(NamedTuple):
    """Gridpoints of a block that are held or moved, by amounts (m) in x and y; None leaves them free."""

    block: int
    where: Where
    x: Amount | None
    y: Amount | None


class Traction(NamedTuple):
    """Load on the chosen facets of a block, in x and y (Pa); ``live`` if it grows with the movement."""

    block: int
    where: Where
    x: Amount
    y: Amount
    live: bool


def held_too(supports: Supports, holds: list[Hold], mesh: Mesh | None) -> Supports:
    """Supports with the held or moved gridpoints added; of two holds of one gridpoint the later counts."""
    if not holds:
        return supports
    displacements: dict[int, float] = {}
    for hold in holds:
        mesh_, gridpoints = _gridpoints(mesh, hold.block)
        x, y = mesh_.x[gridpoints], mesh_.y[gridpoints]
        meant = np.flatnonzero(hold.where(x, y))
        if not meant.size:
            raise InputError(f"block {hold.block}: none of its {len(x)} gridpoints is where it is to be held.")
        for amount, dof in ((hold.x, mesh_.dof_x[gridpoints]), (hold.y, mesh_.dof_y[gridpoints])):
            if amount is not None:
                values = _values(amount, x[meant], y[meant], f"block {hold.block}: the displacement of its gridpoints")
                displacements.update(zip(dof[meant].tolist(), values.tolist()))
    dofs = np.array(sorted(displacements), dtype=np.int64)
    none = np.zeros(len(dofs))
    added = {"prescribed": dofs, "prescribed_displacement": np.array([displacements[dof] for dof in dofs.tolist()])}
    added |= {"start": none, "after_load": none.astype(np.bool_)}
    columns = {name: np.concatenate((getattr(supports, name), values)) for name, values in added.items()}
    return supports._replace(**columns)


def edge_loads(
    tractions: list[Traction], mesh: Mesh | None, thickness: FloatArray
) -> tuple[FloatArray | None, FloatArray | None]:
    """Dead and live load on gridpoints, arrays (size,) (N); None without loads."""
    loads: list[FloatArray | None] = [None, None]
    for traction in tractions:
        mesh_, _ = _gridpoints(mesh, traction.block)
        d = int(np.flatnonzero(mesh_.block == traction.block)[0])
        facets = mesh_.facets[mesh_.first_facet[d] : mesh_.first_facet[d + 1]]
        x, y = mesh_.x[facets], mesh_.y[facets]
        meant = np.flatnonzero(traction.where(x.mean(axis=1), y.mean(axis=1)))
        if not meant.size:
            raise InputError(f"block {traction.block}: no edge of it is where the traction is to act.")
        load = loads[traction.live]
        total = np.zeros(mesh_.size) if load is None else load
        facets, x, y = facets[meant], x[meant], y[meant]
        half = 0.5 * np.hypot(x[:, 1] - x[:, 0], y[:, 1] - y[:, 0]) * thickness[traction.block]
        for share in GAUSS:
            point_x, point_y = (1 - share) * x[:, 0] + share * x[:, 1], (1 - share) * y[:, 0] + share * y[:, 1]
            for amount, dof in ((traction.x, mesh_.dof_x), (traction.y, mesh_.dof_y)):
                force = half * _values(amount, point_x, point_y, f"block {traction.block}: the traction")
                np.add.at(total, dof[facets[:, 0]], (1 - share) * force)
                np.add.at(total, dof[facets[:, 1]], share * force)
        loads[traction.live] = total
    return loads[0], loads[1]


def _gridpoints(mesh: Mesh | None, block: int) -> tuple[Mesh, slice]:
    index = np.empty(0) if mesh is None else np.flatnonzero(mesh.block == block)
    if mesh is None or not index.size:
        raise InputError(f"block {block}: is rigid, it has no gridpoints; give it a zone_size.")
    d = int(index[0])
    return mesh, slice(int(mesh.first_gridpoint[d]), int(mesh.first_gridpoint[d + 1]))


def _values(amount: Amount, x: FloatArray, y: FloatArray, name: str) -> FloatArray:
    values = np.asarray(amount(x, y) if callable(amount) else np.full(x.shape, amount), dtype=np.float64)
    values = np.broadcast_to(values, x.shape)
    if not np.isfinite(values).all():
        raise InputError(f"{name} must be finite.")
    return values
