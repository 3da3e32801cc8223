"""The zones of a wall while a path is followed: their memory, and what is reported of them."""

from __future__ import annotations

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, Int8Array
from damagepred.assembly import Model
from damagepred.assembly.mesh import SIDE_BY_SIDE
from damagepred.enumerations import ZoneState
from damagepred.kernels.zone.forces import find_yielding_zones, return_stresses, zone_stresses
from damagepred.solvers.state.increment import ZonePicture
from damagepred.solvers.system.deformable_blocks import (
    block_moduli,
    facets_of,
    first_cells,
    pack_zones,
    put,
    resultants,
    rigid_motion,
    take,
    zone_places,
)


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
        cells = first_cells(self.mesh)
        self._cells, self._place = int(cells[-1]), zone_places(self.mesh, cells)
        # those that can yield, and where their memory is
        self._yields = np.repeat(self.zones.first_memory[self.mesh.batch] >= 0, np.diff(self.mesh.first_zone))
        cell, number, lane = zone_places(self.mesh, self.zones.first_memory)
        self._memory = cell[self._yields], number[self._yields], lane[self._yields]
        self._whole = (3 * self.mesh.block[:, None] + np.arange(3)).ravel()
        self._motion = rigid_motion(model)[self._whole]
        self._resultant = resultants(model)[self._whole]

    def mean_motion(self, displacement: FloatArray) -> None:
        """Fill in how the deformable blocks (3 of each) have moved as a whole."""
        displacement[self._whole] = self._motion @ displacement

    def add_resultants(self, force: FloatArray) -> None:
        """Fill in the resultants x, y and turning (N) of the forces on the gridpoints of deformable blocks."""
        force[self._whole] = self._resultant @ force

    def plastic(self) -> FloatArray:
        """Return the plastic strain e_xx, e_yy, g_xy, e_zz of the zones, array (z, 4)."""
        plastic = np.zeros((len(self._yields), 4))
        plastic[self._yields] = take(self.zones.memory["plastic"], self._memory)
        return plastic

    def set_plastic_strain(self, plastic: FloatArray) -> None:
        """Set the plastic strain (z, 4) of the zones."""
        put(self.zones.memory["plastic"], self._memory, plastic[self._yields])

    def stresses(self, displacement: FloatArray) -> FloatArray:
        """Return s_xx, s_yy, s_xy and s_zz of the zones (Pa), array (z, 4), if none yields any further."""
        stress = np.zeros((self._cells, 4, 4, SIDE_BY_SIDE))
        zone_stresses(self.zones, displacement, stress)
        return take(stress, self._place)

    def stays_elastic(self, displacement: FloatArray) -> bool:
        """Tell whether no zone yields at a displacement."""
        return not exceeds_yield_limit(self.model, self.stresses(displacement)).any()

    def picture(self, displacement: FloatArray) -> ZonePicture:
        """Return what is reported of the zones at a displacement."""
        stress = self.stresses(displacement)
        return_stresses(stress, *block_moduli(self.model), self.mesh.zone_block)
        now = np.zeros(len(self._yields), dtype=np.int8)
        now[self._yields] = take(self.zones.memory["state"], self._memory)
        return picture(self.model, displacement, stress, self.plastic(), now)


def exceeds_yield_limit(model: Model, stress: FloatArray) -> BoolArray:
    """Whether zones (z,) violate their yield criterion by more than rounding.

    Parameters
    ----------
    model : Model
        With a mesh.
    stress : array (z, 4)
        Of the zones (Pa).
    """
    assert model.mesh is not None
    beyond = np.zeros(len(stress), dtype=np.bool_)
    find_yielding_zones(stress, block_moduli(model)[1], model.mesh.zone_block, beyond)
    return beyond


def picture(
    model: Model, displacement: FloatArray, stress: FloatArray, plastic: FloatArray, now: Int8Array
) -> ZonePicture:
    """Return what is reported of the zones.

    Parameters
    ----------
    model : Model
        With a mesh.
    displacement : array (size,)
        Of all degrees of freedom.
    stress, plastic : array (z, 4)
        Stress (Pa) and plastic strain of the zones.
    now : array of int8 (z,)
        What yields now.
    """
    assert model.mesh is not None
    has_yielded = (now == ZoneState.ELASTIC) & (plastic != 0.0).any(axis=1)
    return ZonePicture(
        np.column_stack((displacement[model.mesh.dof_x], displacement[model.mesh.dof_y])),
        stress,
        np.where(has_yielded, np.int8(ZoneState.YIELDED), now).astype(np.int8),
    )
