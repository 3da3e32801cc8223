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
    """Zones and facets of a model with deformable blocks, as the explicit solver moves them.

    Parameters
    ----------
    model : Model
        With a mesh.
    """

    def __init__(self, model: Model) -> None:
        assert model.mesh is not None
        self.model, self.mesh = model, model.mesh
        self.zones = pack_zones(model)
        self.packed = (facets_of(model), self.zones)
        cells = np.array([len(p.zones) // 4 for p in self.mesh.patterns])[self.mesh.batch_pattern]
        self._cells, self._place = int(cells.sum()), _zone_places(self.mesh, np.cumsum(cells) - cells)
        # those that can yield, and where their history variables are
        self._yields = np.repeat(self.zones.first_memory[self.mesh.batch] >= 0, np.diff(self.mesh.first_zone))
        cell, number, lane = _zone_places(self.mesh, self.zones.first_memory)
        self._memory = cell[self._yields], number[self._yields], lane[self._yields]
        self._whole = (3 * self.mesh.block[:, None] + np.arange(3)).ravel()
        self._sums = DiscreteSystem.of(model).rigid_motion[self._whole], resultants(model)[self._whole]

    def mean_motion(self, displacement: FloatArray) -> None:
        """Fill in how the deformable blocks (3 of each) have moved as a whole."""
        displacement[self._whole] = self._sums[0] @ displacement

    def add_resultants(self, force: FloatArray) -> None:
        """Fill in the resultants x, y and turning (N) of the forces on the gridpoints of deformable blocks."""
        force[self._whole] = self._sums[1] @ force

    def plastic(self) -> FloatArray:
        """Return the plastic strain e_xx, e_yy, g_xy, e_zz of the zones, array (z, 4)."""
        plastic = np.zeros((len(self._yields), 4))
        plastic[self._yields] = _take(self.zones.memory["plastic"], self._memory)
        return plastic

    def set_plastic_strain(self, plastic: FloatArray) -> None:
        """Set the plastic strain (z, 4) of the zones."""
        _put(self.zones.memory["plastic"], self._memory, plastic[self._yields])

    def stresses(self, displacement: FloatArray) -> FloatArray:
        """Return s_xx, s_yy, s_xy and s_zz of the zones (Pa), array (z, 4), if none yields any further."""
        stress = np.zeros((self._cells, 4, 4, LANES))
        zone_stresses(self.zones, displacement, stress)
        return _take(stress, self._place)

    def stays_elastic(self, displacement: FloatArray) -> bool:
        """Return whether no zone yields at a displacement (size,)."""
        return not exceeds_yield_limit(self.model, self.stresses(displacement)).any()

    def results(self, displacement: FloatArray) -> ZoneResults:
        """Return the results of the zones at a displacement (size,)."""
        stress = self.stresses(displacement)
        return_stresses(stress, *block_moduli(self.model), self.mesh.zone_block)
        yielding = np.zeros(len(self._yields), dtype=np.int8)
        yielding[self._yields] = _take(self.zones.memory["state"], self._memory)
        return zone_results(at_gridpoints(self.model, displacement), stress, self.plastic(), yielding)


def exceeds_yield_limit(model: Model, stress: FloatArray) -> BoolArray:
    """Return which zones (z,) violate their yield criterion by more than rounding.

    Parameters
    ----------
    model : Model
        With a mesh.
    stress : array (z, 4)
        Of the zones (Pa).
    """
    assert model.mesh is not None
    exceeds = np.zeros(len(stress), dtype=np.bool_)
    find_yielding_zones(stress, block_moduli(model)[1], model.mesh.zone_block, exceeds)
    return exceeds


def zone_results(displacement: FloatArray, stress: FloatArray, plastic: FloatArray, yielding: Int8Array) -> ZoneResults:
    """Return the results of the zones, with the state of those that have yielded before.

    Parameters
    ----------
    displacement : array (g, 2)
        Of the gridpoints (m).
    stress, plastic : array (z, 4)
        Stress (Pa) and plastic strain of the zones.
    yielding : array of int8 (z,)
        ``ZoneState`` at present.
    """
    has_yielded = (yielding == ZoneState.ELASTIC) & (plastic != 0.0).any(axis=1)
    return ZoneResults(displacement, stress, np.where(has_yielded, ZoneState.YIELDED, yielding).astype(np.int8))


_Places = tuple[IntArray, IntArray, IntArray]
"""Cell, number within it, and lane of each zone (z,)."""


def _zone_places(mesh: Mesh, first_cell: IntArray) -> _Places:
    """Return the place of each zone in packed arrays, in which the cells of each batch begin at ``first_cell``."""
    owner = np.repeat(np.arange(len(mesh.block)), np.diff(mesh.first_zone))
    local = np.arange(len(owner)) - mesh.first_zone[owner]
    return first_cell[mesh.batch[owner]] + local // 4, local % 4, mesh.lane[owner]


def _put(field: NDArray[Any], place: _Places, values: NDArray[Any]) -> None:
    """Write values of the zones, (z,) or (z, k), into a packed field (c, 4, 8) or (c, 4, k, 8)."""
    cell, number, lane = place
    field[cell, number, ..., lane] = values


def _take(field: NDArray[Any], place: _Places) -> NDArray[Any]:
    """Return the values of the zones from a packed field, as ``_put``."""
    cell, number, lane = place
    return np.ascontiguousarray(field[cell, number, ..., lane])
