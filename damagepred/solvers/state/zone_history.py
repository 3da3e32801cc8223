"""The zones of deformable blocks along a path: history variables, stresses and results."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from damagepred.arrays import BoolArray, FloatArray, Int8Array, IntArray
from damagepred.assembly import Model
from damagepred.assembly.mesh import LANES, Mesh
from damagepred.enumerations import ZoneState
from damagepred.kernels.zone.forces import find_yielding_zones, return_stresses, zone_stresses
from damagepred.solvers.state.increment import ZoneResults
from damagepred.solvers.system.deformable_blocks import (
    at_gridpoints,
    block_moduli,
    facets_of,
    pack_zones,
    resultants,
)
from damagepred.solvers.system.discrete_system import DiscreteSystem


class ZoneField:
    """Zones and facets of a model with deformable blocks, as the explicit solver moves them."""

    def __init__(self, model: Model) -> None:
        assert model.mesh is not None
        self.model, self.mesh = model, model.mesh
        self.zones = pack_zones(model)
        self.packed = (facets_of(model), self.zones)
        cells = np.array([len(p.zones) // 4 for p in self.mesh.patterns])[self.mesh.batch_pattern]
        self._cells, self._position = int(cells.sum()), _zone_positions(self.mesh, np.cumsum(cells) - cells)
        # zones that can yield, and the places of their history variables
        self._yields = np.repeat(self.zones.first_memory[self.mesh.batch] >= 0, np.diff(self.mesh.first_zone))
        cell, number, lane = _zone_positions(self.mesh, self.zones.first_memory)
        self._memory = cell[self._yields], number[self._yields], lane[self._yields]
        self._whole = (3 * self.mesh.block[:, None] + np.arange(3)).ravel()
        # mean motion from displacements, and resultants from forces, on gridpoints
        self._sums = DiscreteSystem.of(model).rigid_motion[self._whole], resultants(model)[self._whole]

    def mean_motion(self, displacement: FloatArray) -> None:
        """Fill in the mean motion of the deformable blocks."""
        displacement[self._whole] = self._sums[0] @ displacement

    def add_resultants(self, force: FloatArray) -> None:
        """Fill in the resultants x, y and turning (N) of the forces on the gridpoints of deformable blocks."""
        force[self._whole] = self._sums[1] @ force

    def plastic(self) -> FloatArray:
        """Plastic strain e_xx, e_yy, g_xy, e_zz of the zones, array (z, 4)."""
        plastic = np.zeros((len(self._yields), 4))
        plastic[self._yields] = _take(self.zones.memory["plastic"], self._memory)
        return plastic

    def set_plastic_strain(self, plastic: FloatArray) -> None:
        """Set the plastic strain (z, 4) of the zones."""
        _put(self.zones.memory["plastic"], self._memory, plastic[self._yields])

    def stresses(self, displacement: FloatArray) -> FloatArray:
        """Stresses xx, yy, xy, zz of the zones (Pa), (z, 4), without further yielding."""
        stress = np.zeros((self._cells, 4, 4, LANES))
        zone_stresses(self.zones, displacement, stress)
        return _take(stress, self._position)

    def stays_elastic(self, displacement: FloatArray) -> bool:
        """Whether no zone yields at a displacement (size,)."""
        return not exceeds_yield_limit(self.model, self.stresses(displacement)).any()

    def results(self, displacement: FloatArray) -> ZoneResults:
        """Results of the zones at a displacement (size,)."""
        stress = self.stresses(displacement)
        return_stresses(stress, *block_moduli(self.model), self.mesh.zone_block)
        yielding = np.zeros(len(self._yields), dtype=np.int8)
        yielding[self._yields] = _take(self.zones.memory["state"], self._memory)
        return zone_results(at_gridpoints(self.model, displacement), stress, self.plastic(), yielding)


def exceeds_yield_limit(model: Model, stress: FloatArray) -> BoolArray:
    """Whether zones (z,) violate their yield criterion by more than rounding."""
    assert model.mesh is not None
    exceeds = np.zeros(len(stress), dtype=np.bool_)
    find_yielding_zones(stress, block_moduli(model)[1], model.mesh.zone_block, exceeds)
    return exceeds


def zone_results(displacement: FloatArray, stress: FloatArray, plastic: FloatArray, yielding: Int8Array) -> ZoneResults:
    """Results of the zones; elastic zones with plastic strain have yielded before."""
    has_yielded = (yielding == ZoneState.ELASTIC) & (plastic != 0.0).any(axis=1)
    return ZoneResults(displacement, stress, np.where(has_yielded, ZoneState.YIELDED, yielding).astype(np.int8))


_Positions = tuple[IntArray, IntArray, IntArray]
"""Cell, number within it, and lane of each zone (z,)."""


def _zone_positions(mesh: Mesh, first_cell: IntArray) -> _Positions:
    """Position of each zone in packed arrays, in which the cells of each batch begin at ``first_cell``."""
    owner = np.repeat(np.arange(len(mesh.block)), np.diff(mesh.first_zone))
    local = np.arange(len(owner)) - mesh.first_zone[owner]
    return first_cell[mesh.batch[owner]] + local // 4, local % 4, mesh.lane[owner]


def _put(field: NDArray[Any], position: _Positions, values: NDArray[Any]) -> None:
    """Write values of the zones, (z,) or (z, k), into a packed field (c, 4, 8) or (c, 4, k, 8)."""
    cell, number, lane = position
    field[cell, number, ..., lane] = values


def _take(field: NDArray[Any], position: _Positions) -> NDArray[Any]:
    """Values of the zones, (z,) or (z, k), from a packed field."""
    cell, number, lane = position
    return np.ascontiguousarray(field[cell, number, ..., lane])
