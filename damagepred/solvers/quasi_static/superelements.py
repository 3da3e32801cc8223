"""Deformable blocks in the quasi-static solver: condensed to their rim, and opened where a zone would yield.

While a block is elastic, what lies inside it follows from its rim, once and for all: bricks of one shape and material
share one condensation. A block one of whose zones would yield is opened: its zones are looked at one by one, and what
lies inside is brought to equilibrium for every position of the rim.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.kernels.interface.residual import largest_block_resultant
from damagepred.kernels.zone.forces import hand_on, place_facets, zones_beyond
from damagepred.kernels.zone.superelement import solid_response, yield_work
from damagepred.solvers.state.increment import ZonePicture
from damagepred.solvers.state.zone_history import ZoneField, picture
from damagepred.solvers.system.deformable_blocks import (
    Bending,
    bending,
    block_moduli,
    can_yield,
    cell_gridpoints,
    cell_matrices,
    facets_of,
    gridpoint_arms,
    zone_slopes,
)

INNER = 1e-10
"""Unbalanced force inside a block that yields, over the largest force of its zones."""


@dataclass
class Kin:
    """Blocks of one shape, material and support.

    Attributes
    ----------
    member : array of int (b,)
        Which of the deformable blocks.
    rim, inside : array of int (b, r), (b, i)
        Degrees of freedom that are kept, and that are condensed.
    stiffness : array (r, r)
        Of the rim, what lies inside condensed (N/m).
    follow : array (i, r)
        How what lies inside does *not* follow the rim: u_inside = hang - follow u_rim.
    flexibility : array (i, i)
        Displacement inside for forces there, with the rim held (m/N).
    hang : array (2, b, i)
        Displacement inside under dead and under live load, with the rim held (m).
    """

    member: IntArray
    rim: IntArray
    inside: IntArray
    stiffness: FloatArray
    follow: FloatArray
    flexibility: FloatArray
    hang: FloatArray


class Solids:
    """The deformable blocks of a model.

    Parameters
    ----------
    model : Model
        With a mesh.
    dead_load, live_load : array (size,)
        On all degrees of freedom (N); what acts inside the blocks is moved to their rims.
    """

    def __init__(self, model: Model, dead_load: FloatArray, live_load: FloatArray) -> None:
        assert model.mesh is not None
        self.model, self.mesh = model, model.mesh
        self.block = self.mesh.block
        self.field = ZoneField(model)
        self.facets = facets_of(model)
        self.facet_dofs = slice(self.facets.first_dof, self.facets.first_dof + 3 * len(self.facets.turn_x))
        self.state = np.zeros(len(self.mesh.zones), dtype=np.int8)
        self.yields = can_yield(model)[self.block]
        self.block_of_dof = self._blocks_of_dofs()
        self._arms, self._on_blocks = gridpoint_arms(model), np.zeros((model.n_blocks, 3))
        self.rim: list[IntArray] = [np.empty(0, np.int64)] * len(self.block)
        self.elastic: list[FloatArray] = [np.empty((0, 0))] * len(self.block)
        self.tangent: dict[int, FloatArray] = {}
        self._apart: dict[int, FloatArray] = {}
        self.load_inside = np.stack((dead_load, live_load))
        self.kin = [self._condense(members) for members in self._alike()]
        self.inside = np.concatenate([k.inside.ravel() for k in self.kin])
        for kin in self.kin:
            for load in (dead_load, live_load):
                load[kin.rim] -= load[kin.inside] @ kin.follow
                load[kin.inside] = 0.0
        self._kin_of = {int(d): (kin, at) for kin in self.kin for at, d in enumerate(kin.member)}
        self._slopes, self._bending = zone_slopes(self.mesh).reshape(-1, 4), bending(model)
        self._volume = self.mesh.zone_area * model.block_law.thickness[self.mesh.zone_block]
        self._elasticity, self._strength = block_moduli(model)

    def _blocks_of_dofs(self) -> IntArray:
        """Return the block of each degree of freedom (size,); the ground's number where it is none's."""
        n, block = self.model.n_blocks, np.full(self.model.size, self.model.n_blocks, dtype=np.int64)
        block[: 3 * n] = np.repeat(np.arange(n), 3)
        block[self.mesh.dof_x] = block[self.mesh.dof_y] = self.mesh.gridpoint_block
        return block

    def _alike(self) -> list[IntArray]:
        """Return which deformable blocks share a condensation: same shape, material and supports."""
        mesh, model = self.mesh, self.model
        held = np.zeros(model.size, dtype=np.bool_)
        held[model.supports.prescribed] = True
        law = np.column_stack(
            (model.block_law.elastic_modulus, model.block_law.poisson_ratio, model.block_law.thickness)
        )
        kinds: dict[tuple[int, bytes, bytes, bytes], list[int]] = {}
        for d, block in enumerate(mesh.block):
            own = slice(mesh.first_gridpoint[d], mesh.first_gridpoint[d + 1])
            x, y = mesh.x[own] - model.blocks.x[block], mesh.y[own] - model.blocks.y[block]
            shape = np.round(np.concatenate((x, y)) / np.sqrt(model.blocks.area[block]) * 1e9) + 0.0
            fixed = np.concatenate((held[mesh.dof_x[own]], held[mesh.dof_y[own]]))
            size = np.sqrt(model.blocks.area[block])
            key = (
                int(mesh.pattern[d]),
                shape.tobytes(),
                np.append(law[block], round(size, 9)).tobytes(),
                fixed.tobytes(),
            )
            kinds.setdefault(key, []).append(d)
        return [np.array(members) for members in kinds.values()]

    def _dofs(self, d: int) -> IntArray:
        """Return the degrees of freedom of a deformable block: x and y of its gridpoints in turn."""
        own = slice(self.mesh.first_gridpoint[d], self.mesh.first_gridpoint[d + 1])
        return np.column_stack((self.mesh.dof_x[own], self.mesh.dof_y[own])).ravel()

    def _condense(self, members: IntArray) -> Kin:
        mesh, d = self.mesh, int(members[0])
        cells = (
            cell_gridpoints(mesh.zones)[mesh.first_zone[d] // 4 : mesh.first_zone[d + 1] // 4] - mesh.first_gridpoint[d]
        )
        size = 2 * (mesh.first_gridpoint[d + 1] - mesh.first_gridpoint[d])
        local = (2 * cells[:, :, None] + np.arange(2)).reshape(-1, 10)
        stiffness = np.zeros((size, size))
        matrices = cell_matrices(self.model, slice(mesh.first_zone[d], mesh.first_zone[d + 1]))
        np.add.at(stiffness, (local[:, :, None], local[:, None, :]), matrices)
        kept = np.repeat(mesh.on_boundary[mesh.first_gridpoint[d] : mesh.first_gridpoint[d + 1]], 2)
        kept |= np.isin(self._dofs(d), self.model.supports.prescribed)
        rim, inside = np.flatnonzero(kept), np.flatnonzero(~kept)
        flexibility = np.linalg.inv(stiffness[np.ix_(inside, inside)])
        follow = flexibility @ stiffness[np.ix_(inside, rim)]
        condensed = stiffness[np.ix_(rim, rim)] - stiffness[np.ix_(rim, inside)] @ follow
        condensed = 0.5 * (condensed + condensed.T)
        dofs = np.array([self._dofs(int(m)) for m in members])
        for m, own in zip(members, dofs):
            self.rim[m], self.elastic[m] = own[rim], condensed
        hang = self.load_inside[:, dofs[:, inside]] @ flexibility
        return Kin(members, dofs[:, rim], dofs[:, inside], condensed, follow, flexibility, hang)

    # -- forces ---------------------------------------------------------------------------------------------------

    def place_facets(self, displacement: FloatArray) -> None:
        """Let the facets follow their gridpoints."""
        place_facets(self.facets, displacement)

    def hand_on(self, force: FloatArray) -> None:
        """Give the forces on facets to their gridpoints."""
        hand_on(self.facets, force)

    def largest_block_resultant(self, force: FloatArray) -> float:
        """Return the largest resultant (N) on a block: a little on each of many gridpoints is much together."""
        mesh = self.mesh
        return float(
            largest_block_resultant(force, mesh.gridpoint_block, mesh.dof_x, mesh.dof_y, *self._arms, self._on_blocks)
        )

    def push_back(
        self, load: float, load_factor: float, displacement: FloatArray, plastic: FloatArray, force: FloatArray
    ) -> None:
        """Add the forces of the blocks on their rims.

        Parameters
        ----------
        load, load_factor : float
            Shares of the dead and of the live load.
        displacement : array (size,)
            Of all degrees of freedom; what lies inside blocks that yield is brought to equilibrium.
        plastic : array (z, 4)
            Plastic strain of the last equilibrium.
        force : array (size,)
            Added to.
        """
        for kin in self.kin:
            force[kin.rim] -= displacement[kin.rim] @ kin.stiffness
        for d in self.tangent:
            kin, at = self._kin_of[d]
            rim, acting = kin.rim[at], self._acting(d, load, load_factor)
            found, tangent = self._response(d, acting, displacement, plastic)
            # in place of the elastic block, with its share of the loads inside
            force[rim] += displacement[rim] @ kin.stiffness + acting @ kin.follow - found
            self.tangent[d] = tangent

    def _response(
        self, d: int, acting: FloatArray, displacement: FloatArray, plastic: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Bring the inside of a block that yields to equilibrium; return the force its rim needs, and its slope."""
        mesh, (kin, at) = self.mesh, self._kin_of[d]
        dofs, zones = self._dofs(d), slice(mesh.first_zone[d], mesh.first_zone[d + 1])
        local = np.argsort(dofs)
        place = local[np.searchsorted(dofs, np.concatenate((kin.rim[at], kin.inside[at])), sorter=local)]
        # begin where the inside would follow elastically, and as far apart from that as it was last
        elastic = kin.flexibility @ acting - kin.follow @ displacement[kin.rim[at]]
        u = displacement[dofs]
        count = kin.rim.shape[1]
        u[place[count:]] = elastic + self._apart.get(d, 0.0)
        block = int(mesh.block[d])
        force, tangent = np.zeros(count), np.zeros((count, count))
        solid_response(
            mesh.zones[zones] - mesh.first_gridpoint[d],
            self._slopes[zones],
            self._volume[zones],
            self._elasticity[block],
            self._strength[block],
            plastic[zones],
            self._bent(zones),
            place,
            count,
            kin.flexibility,
            acting,
            INNER,
            u,
            force,
            tangent,
        )
        if np.isfinite(force).all():
            self._apart[d] = u[place[count:]] - elastic
        displacement[kin.inside[at]] = u[place[count:]]
        return force, tangent

    def _bent(self, zones: slice) -> Bending:
        return Bending(self._bending.gamma[zones], self._bending.strain[zones])

    # -- what lies inside -----------------------------------------------------------------------------------------

    def recover(self, displacement: FloatArray, load: float, load_factor: float, plastic: FloatArray) -> None:
        """Fill in what lies inside the blocks, the facets and the blocks' mean motion.

        Parameters
        ----------
        displacement : array (size,)
            Of all degrees of freedom; right at the rims.
        load, load_factor : float
            Shares of the dead and of the live load.
        plastic : array (z, 4)
            Plastic strain of the last equilibrium.
        """
        for kin in self.kin:
            hang = load * kin.hang[0] + load_factor * kin.hang[1]
            displacement[kin.inside] = hang - displacement[kin.rim] @ kin.follow.T
        for d in self.tangent:
            self._response(d, self._acting(d, load, load_factor), displacement, plastic)
        self.place_facets(displacement)
        self.field.mean_motion(displacement)

    def _acting(self, d: int, load: float, load_factor: float) -> FloatArray:
        """Return the load inside a block (N)."""
        kin, at = self._kin_of[d]
        return np.asarray(
            load * self.load_inside[0][kin.inside[at]] + load_factor * self.load_inside[1][kin.inside[at]]
        )

    def open_where_yielding(
        self, displacement: FloatArray, load: float, load_factor: float, plastic: FloatArray
    ) -> list[int]:
        """Open the blocks one of whose zones is beyond what it bears; return those that were not open yet."""
        if not self.yields.any():
            return []
        self.recover(displacement, load, load_factor, plastic)
        self.field.set_plastic_strain(plastic)
        stress = self.field.stresses(displacement)
        beyond = np.zeros(len(stress), dtype=np.bool_)
        zones_beyond(stress, self._strength, self.mesh.zone_block, beyond)
        owner = np.repeat(np.arange(len(self.block)), np.diff(self.mesh.first_zone))
        return self._open(owner[beyond])

    def open_where_plastic(self, plastic: FloatArray) -> list[int]:
        """Open the blocks in which any zone has plastic strain (z, 4); return those that were not open yet."""
        owner = np.repeat(np.arange(len(self.block)), np.diff(self.mesh.first_zone))
        return self._open(owner[(plastic != 0.0).any(axis=1)])

    def open_as(self, other: Solids) -> None:
        """Open the blocks that are open in another, of the same wall held otherwise."""
        self._open(np.array(list(other.tangent), dtype=np.int64))
        self.state[:] = other.state

    def _open(self, listed: IntArray) -> list[int]:
        new = [d for d in np.unique(listed).tolist() if d not in self.tangent]
        for d in new:
            self.tangent[d] = self.elastic[d]
        return new

    def settle(self, displacement: FloatArray, plastic: FloatArray) -> float:
        """Bring plastic strains (z, 4) up to date with an equilibrium; return the work that yielding took (J)."""
        work = 0.0
        for d in self.tangent:
            zones = slice(self.mesh.first_zone[d], self.mesh.first_zone[d + 1])
            block = int(self.mesh.block[d])
            work += yield_work(
                self.mesh.zones[zones] - self.mesh.first_gridpoint[d],
                self._slopes[zones],
                self._volume[zones],
                self._elasticity[block],
                self._strength[block],
                self._bent(zones),
                displacement[self._dofs(d)],
                plastic[zones],
                self.state[zones],
            )
        return work

    def picture(self, displacement: FloatArray, plastic: FloatArray) -> ZonePicture:
        """Return what is reported of the zones at an equilibrium; see ``recover``."""
        self.field.set_plastic_strain(plastic)
        return picture(self.model, displacement, self.field.stresses(displacement), plastic, self.state)

    def stored(self, displacement: FloatArray, plastic: FloatArray) -> float:
        """Return the elastic energy of all zones (J); see ``recover``."""
        self.field.set_plastic_strain(plastic)
        stress = self.field.stresses(displacement)
        inverse = 1.0 / self.model.block_law.elastic_modulus[self.mesh.zone_block]
        nu = self.model.block_law.poisson_ratio[self.mesh.zone_block]
        xx, yy, xy, zz = stress.T
        squares = xx**2 + yy**2 + zz**2 - 2 * nu * (xx * yy + yy * zz + zz * xx) + 2 * (1 + nu) * xy**2
        return float(0.5 * (inverse * squares * self._volume).sum())
