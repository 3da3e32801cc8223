"""Deformable blocks in the quasi-static solver: superelements, and nonlinear condensation of blocks that yield.

The interior of an elastic block is condensed to its boundary once (Guyan 1965); bricks of one shape and material share
the condensation. A block in which a zone would yield becomes active: its interior is brought to equilibrium by Newton
iteration for every displacement of the boundary.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.kernels.interface.residual import largest_block_resultant
from damagepred.kernels.zone.forces import place_facets, scatter_facet_forces
from damagepred.kernels.zone.superelement import commit_plastic_strain, condensed_response
from damagepred.solvers.quasi_static.options import NewtonOptions
from damagepred.solvers.state.increment import ZoneResults
from damagepred.solvers.state.wall_state import State
from damagepred.solvers.state.zone_history import ZoneField, exceeds_yield_limit, zone_results
from damagepred.solvers.system.deformable_blocks import (
    Bending,
    at_gridpoints,
    bending,
    block_moduli,
    can_yield,
    cell_gridpoints,
    cell_matrices,
    facets_of,
    gridpoint_arms,
    strain_rows,
    zone_slopes,
)
from damagepred.solvers.system.discrete_system import DiscreteSystem

DEFAULTS = NewtonOptions()


@dataclass
class BlockShape:
    """Blocks of one shape, material and support.

    Attributes
    ----------
    member : array of int (b,)
        Which of the deformable blocks.
    boundary, interior : array of int (b, r), (b, i)
        Degrees of freedom that are kept, and that are condensed.
    stiffness : array (r, r)
        Schur complement on the boundary (N/m).
    recovery : array (i, r)
        Recovery matrix, in u_interior = particular - recovery u_boundary.
    flexibility : array (i, i)
        Inverse of the interior stiffness (m/N).
    particular : array (2, b, i)
        Interior displacement under dead and under live load, with the boundary held (m).
    """

    member: IntArray
    boundary: IntArray
    interior: IntArray
    stiffness: FloatArray
    recovery: FloatArray
    flexibility: FloatArray
    particular: FloatArray


class Superelements:
    """The deformable blocks of a model.

    Parameters
    ----------
    system : DiscreteSystem
        Of a model with a mesh.
    interior_tolerance : float
        Residual of the interior of a yielding block over the largest force of its zones (1).

    Attributes
    ----------
    condensed_loads : array (2, size)
        Dead and live load (N, N m); that on interior degrees of freedom is condensed to the boundaries.
    """

    def __init__(self, system: DiscreteSystem, interior_tolerance: float = DEFAULTS.interior_tolerance) -> None:
        model, self._tolerance = system.model, interior_tolerance
        assert model.mesh is not None
        self.model, self.mesh = model, model.mesh
        self.block = self.mesh.block
        self.field = ZoneField(model)
        self.facets = facets_of(model)
        self.facet_dofs = slice(self.facets.first_dof, self.facets.first_dof + 3 * len(self.facets.turn_x))
        self._owner = np.repeat(np.arange(len(self.block)), np.diff(self.mesh.first_zone))
        self.yields = can_yield(model)[self.block]
        self._arms, self._on_blocks = gridpoint_arms(model), np.zeros((model.n_blocks, 3))
        self.boundary: list[IntArray] = [np.empty(0, np.int64)] * len(self.block)
        self.elastic: list[FloatArray] = [np.empty((0, 0))] * len(self.block)
        self.tangent: dict[int, FloatArray] = {}
        self._inelastic: dict[int, FloatArray] = {}
        self._loads = np.stack((system.dead_load, system.live_load))
        self._rows = strain_rows(model)
        self.shapes = [self._condense(members) for members in self._group_by_shape()]
        self.interior = np.concatenate([k.interior.ravel() for k in self.shapes])
        self.condensed_loads = self._loads.copy()
        for shape in self.shapes:
            for load in self.condensed_loads:
                load[shape.boundary] -= load[shape.interior] @ shape.recovery
                load[shape.interior] = 0.0
        self._shape_of = {int(d): (shape, at) for shape in self.shapes for at, d in enumerate(shape.member)}
        self._slopes, self._bending = zone_slopes(self.mesh).reshape(-1, 4), bending(model)
        self._volume = self.mesh.zone_area * model.block_law.thickness[self.mesh.zone_block]
        self._elasticity, self._strength = block_moduli(model)

    def _group_by_shape(self) -> list[IntArray]:
        """Return which deformable blocks share a condensation: same shape, material and supports."""
        mesh, model = self.mesh, self.model
        held = np.zeros(model.size, dtype=np.bool_)
        held[model.supports.prescribed] = True
        law = np.column_stack(
            (model.block_law.elastic_modulus, model.block_law.poisson_ratio, model.block_law.thickness)
        )
        shapes: dict[tuple[int, bytes, bytes, bytes], list[int]] = {}
        for d, block in enumerate(mesh.block):
            own = slice(mesh.first_gridpoint[d], mesh.first_gridpoint[d + 1])
            x, y = mesh.x[own] - model.blocks.x[block], mesh.y[own] - model.blocks.y[block]
            size = np.sqrt(model.blocks.area[block])
            shape = np.round(np.concatenate((x, y)) / size * 1e9) + 0.0
            fixed = np.concatenate((held[mesh.dof_x[own]], held[mesh.dof_y[own]]))
            law_and_size = np.append(law[block], round(size, 9))
            key = (int(mesh.pattern[d]), shape.tobytes(), law_and_size.tobytes(), fixed.tobytes())
            shapes.setdefault(key, []).append(d)
        return [np.array(members) for members in shapes.values()]

    def _dofs(self, d: int) -> IntArray:
        """Return the degrees of freedom of a deformable block: x and y of its gridpoints in turn."""
        own = slice(self.mesh.first_gridpoint[d], self.mesh.first_gridpoint[d + 1])
        return np.column_stack((self.mesh.dof_x[own], self.mesh.dof_y[own])).ravel()

    def _condense(self, members: IntArray) -> BlockShape:
        mesh, d = self.mesh, int(members[0])
        cells = (
            cell_gridpoints(mesh.zones)[mesh.first_zone[d] // 4 : mesh.first_zone[d + 1] // 4] - mesh.first_gridpoint[d]
        )
        size = 2 * (mesh.first_gridpoint[d + 1] - mesh.first_gridpoint[d])
        local = (2 * cells[:, :, None] + np.arange(2)).reshape(-1, 10)
        stiffness = np.zeros((size, size))
        matrices = cell_matrices(self.model, self._rows, slice(mesh.first_zone[d], mesh.first_zone[d + 1]))
        np.add.at(stiffness, (local[:, :, None], local[:, None, :]), matrices)
        kept = np.repeat(mesh.on_boundary[mesh.first_gridpoint[d] : mesh.first_gridpoint[d + 1]], 2)
        kept |= np.isin(self._dofs(d), self.model.supports.prescribed)
        boundary, interior = np.flatnonzero(kept), np.flatnonzero(~kept)
        flexibility = np.linalg.inv(stiffness[np.ix_(interior, interior)])
        recovery = flexibility @ stiffness[np.ix_(interior, boundary)]
        condensed = stiffness[np.ix_(boundary, boundary)] - stiffness[np.ix_(boundary, interior)] @ recovery
        condensed = 0.5 * (condensed + condensed.T)
        dofs = np.array([self._dofs(int(m)) for m in members])
        for m, own in zip(members, dofs):
            self.boundary[m], self.elastic[m] = own[boundary], condensed
        particular = self._loads[:, dofs[:, interior]] @ flexibility
        return BlockShape(members, dofs[:, boundary], dofs[:, interior], condensed, recovery, flexibility, particular)

    # -- forces ---------------------------------------------------------------------------------------------------

    def place_facets(self, displacement: FloatArray) -> None:
        """Compute the motion of the facets from their gridpoints."""
        place_facets(self.facets, displacement)

    def scatter_facet_forces(self, force: FloatArray) -> None:
        """Scatter the forces on facets to their gridpoints."""
        scatter_facet_forces(self.facets, force)

    def largest_block_resultant(self, force: FloatArray) -> float:
        """Return the largest resultant (N) on a block: small forces on many gridpoints may add up to a large one."""
        mesh = self.mesh
        return float(
            largest_block_resultant(force, mesh.gridpoint_block, mesh.dof_x, mesh.dof_y, *self._arms, self._on_blocks)
        )

    def add_internal_forces(
        self, load: float, load_factor: float, displacement: FloatArray, plastic: FloatArray, force: FloatArray
    ) -> None:
        """Add the internal forces of the blocks on their boundaries.

        Parameters
        ----------
        load, load_factor : float
            Shares of the dead and of the live load.
        displacement : array (size,)
            Of all degrees of freedom; the interior of active blocks is brought to equilibrium.
        plastic : array (z, 4)
            Plastic strain of the last equilibrium.
        force : array (size,)
            Residual force; updated.
        """
        for shape in self.shapes:
            force[shape.boundary] -= displacement[shape.boundary] @ shape.stiffness
        for d in self.tangent:
            shape, at = self._shape_of[d]
            boundary, load_here = shape.boundary[at], self._interior_load(d, load, load_factor)
            found, tangent = self._response(d, load_here, displacement, plastic)
            # replaces the force of the elastic block, with the condensed load
            force[boundary] += displacement[boundary] @ shape.stiffness + load_here @ shape.recovery - found
            self.tangent[d] = tangent

    def _response(
        self, d: int, load_here: FloatArray, displacement: FloatArray, plastic: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Bring the interior of an active block to equilibrium; return force and tangent on its boundary."""
        mesh, (shape, at) = self.mesh, self._shape_of[d]
        dofs, zones = self._dofs(d), slice(mesh.first_zone[d], mesh.first_zone[d + 1])
        local = np.argsort(dofs)
        place = local[np.searchsorted(dofs, np.concatenate((shape.boundary[at], shape.interior[at])), sorter=local)]
        # start from the elastic interior, shifted by the inelastic part of the last call
        elastic = shape.flexibility @ load_here - shape.recovery @ displacement[shape.boundary[at]]
        u = displacement[dofs]
        count = shape.boundary.shape[1]
        u[place[count:]] = elastic + self._inelastic.get(d, 0.0)
        block = int(mesh.block[d])
        force, tangent = np.zeros(count), np.zeros((count, count))
        condensed_response(
            mesh.zones[zones] - mesh.first_gridpoint[d],
            self._slopes[zones],
            self._volume[zones],
            self._elasticity[block],
            self._strength[block],
            plastic[zones],
            self._bending_of(zones),
            place,
            count,
            shape.flexibility,
            load_here,
            self._tolerance,
            u,
            force,
            tangent,
        )
        if np.isfinite(force).all():
            self._inelastic[d] = u[place[count:]] - elastic
        displacement[shape.interior[at]] = u[place[count:]]
        return force, tangent

    def _bending_of(self, zones: slice) -> Bending:
        return Bending(self._bending.gamma[zones], self._bending.strain[zones])

    # -- recovery and history --------------------------------------------------------------------------------------

    def recover(self, displacement: FloatArray, load: float, load_factor: float, plastic: FloatArray) -> None:
        """Recover the interior of the blocks, the motion of facets and the mean motion of the blocks.

        Parameters
        ----------
        displacement : array (size,)
            Of all degrees of freedom; updated from those on boundaries.
        load, load_factor : float
            Shares of the dead and of the live load.
        plastic : array (z, 4)
            Plastic strain of the last equilibrium.
        """
        for shape in self.shapes:
            particular = load * shape.particular[0] + load_factor * shape.particular[1]
            displacement[shape.interior] = particular - displacement[shape.boundary] @ shape.recovery.T
        for d in self.tangent:
            self._response(d, self._interior_load(d, load, load_factor), displacement, plastic)
        self.place_facets(displacement)
        self.field.mean_motion(displacement)

    def _interior_load(self, d: int, load: float, load_factor: float) -> FloatArray:
        """Return the load on the interior of a block (N)."""
        shape, at = self._shape_of[d]
        dead, live = self._loads[:, shape.interior[at]]
        return np.asarray(load * dead + load_factor * live)

    def activate_yielding(
        self, displacement: FloatArray, load: float, load_factor: float, plastic: FloatArray
    ) -> list[int]:
        """Activate the blocks with a zone outside its yield surface; return those activated now.

        Parameters
        ----------
        displacement : array (size,)
            Of all degrees of freedom (m, rad); the interior is recovered from the boundaries.
        load, load_factor : float
            Shares of the dead and of the live load.
        plastic : array (z, 4)
            Plastic strain of the last equilibrium.
        """
        if not self.yields.any():
            return []
        self.recover(displacement, load, load_factor, plastic)
        self.field.set_plastic_strain(plastic)
        return self._activate(self._owner[exceeds_yield_limit(self.model, self.field.stresses(displacement))])

    def activate_plastic(self, plastic: FloatArray) -> list[int]:
        """Activate the blocks in which any zone has plastic strain (z, 4); return those activated now."""
        return self._activate(self._owner[(plastic != 0.0).any(axis=1)])

    def activate_as_in(self, other: Superelements) -> None:
        """Activate the blocks that are active in another set, of the same wall with other supports."""
        self._activate(np.array(list(other.tangent), dtype=np.int64))

    def _activate(self, blocks: IntArray) -> list[int]:
        new = [d for d in np.unique(blocks).tolist() if d not in self.tangent]
        for d in new:
            self.tangent[d] = self.elastic[d]
        return new

    def commit(self, state: State) -> float:
        """Commit plastic strains and zone states at an equilibrium, after ``recover``; return the plastic work (J)."""
        work = 0.0
        for d in self.tangent:
            zones = slice(self.mesh.first_zone[d], self.mesh.first_zone[d + 1])
            block = int(self.mesh.block[d])
            work += commit_plastic_strain(
                self.mesh.zones[zones] - self.mesh.first_gridpoint[d],
                self._slopes[zones],
                self._volume[zones],
                self._elasticity[block],
                self._strength[block],
                self._bending_of(zones),
                state.displacement[self._dofs(d)],
                state.plastic[zones],
                state.zone_state[zones],
            )
        return work

    def zone_results(self, state: State) -> ZoneResults:
        """Return the zones' stresses and states and the gridpoints' displacements at an equilibrium."""
        gridpoints = at_gridpoints(self.model, state.displacement)
        return zone_results(gridpoints, self._stresses(state), state.plastic, state.zone_state)

    def _stresses(self, state: State) -> FloatArray:
        """Return the stresses of the zones (z, 4) at an equilibrium (Pa)."""
        self.field.set_plastic_strain(state.plastic)
        return self.field.stresses(state.displacement)

    def elastic_energy(self, state: State) -> float:
        """Return the elastic energy of all zones at an equilibrium (J)."""
        inverse = 1.0 / self.model.block_law.elastic_modulus[self.mesh.zone_block]
        nu = self.model.block_law.poisson_ratio[self.mesh.zone_block]
        xx, yy, xy, zz = self._stresses(state).T
        squares = xx**2 + yy**2 + zz**2 - 2 * nu * (xx * yy + yy * zz + zz * xx) + 2 * (1 + nu) * xy**2
        return float(0.5 * (inverse * squares * self._volume).sum())
