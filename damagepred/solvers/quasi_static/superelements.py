"""Deformable blocks in the quasi-static solver: superelements, and nonlinear condensation of blocks that yield.

The interior of an elastic block is condensed to its boundary once (Guyan 1965); bricks of one shape and material share
the condensation. A block in which a zone would yield becomes active: its interior is brought to equilibrium by Newton
iteration for every displacement of the boundary.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.kernels.interface.residual import largest_block_resultant
from damagepred.kernels.zone.forces import place_facets, scatter_facet_forces
from damagepred.kernels.zone.superelement import (
    ShapeArrays,
    ZoneArrays,
    commit_plastic_strain,
    condensed_forces,
    condensed_tangents,
)
from damagepred.solvers.quasi_static.options import NewtonOptions
from damagepred.solvers.state.increment import ZoneResults
from damagepred.solvers.state.wall_state import State
from damagepred.solvers.state.zone_history import ZoneField, exceeds_yield_limit, zone_results
from damagepred.solvers.system.deformable_blocks import (
    at_gridpoints,
    block_moduli,
    can_yield,
    cell_gridpoints,
    cell_matrices,
    facets_of,
    gridpoint_arms,
    strain_rows,
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
    particular : array (2, b, i)
        Interior displacement under dead and under live load, with the boundary held (m).
    arrays : ShapeArrays
        The same, as kernels of yielding blocks take them.
    """

    member: IntArray
    boundary: IntArray
    interior: IntArray
    stiffness: FloatArray
    recovery: FloatArray
    particular: FloatArray
    arrays: ShapeArrays


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
    active : array of int
        Blocks of which a zone yields, or has yielded.
    tangents, first_entry : array, array of int (d + 1,)
        Tangent of each block on its boundary, row by row (N/m), and where it begins; see ``update_tangents``.
    yielding : array of bool (d,)
        Whether a zone of the block yields in these tangents, which then need not be symmetric.
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
        self._loads = np.stack((system.dead_load, system.live_load))
        self._elasticity, self._strength = block_moduli(model)
        count = len(self.mesh.zones)
        self._volume = self.mesh.zone_area * model.block_law.thickness[self.mesh.zone_block]
        self._zones = ZoneArrays(strain_rows(model), self._volume, np.zeros((count, 4)))
        self.shapes = [self._condense(members) for members in self._group_by_shape()]
        self.interior = np.concatenate([k.interior.ravel() for k in self.shapes])
        self.condensed_loads = self._loads.copy()
        for shape in self.shapes:
            for load in self.condensed_loads:
                load[shape.boundary] -= load[shape.interior] @ shape.recovery
                load[shape.interior] = 0.0
        self.active, self._in_shape = np.empty(0, dtype=np.int64), [np.empty(0, dtype=np.int64)] * len(self.shapes)
        self.yielding, self._outdated = np.zeros(len(self.block), dtype=np.bool_), False
        self.set_condensed(self.yielding)
        self.first_entry = np.concatenate(([0], np.cumsum([k.size for k in self.elastic])))
        self.tangents = np.concatenate([k.ravel() for k in self.elastic])

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
        zones = slice(mesh.first_zone[d], mesh.first_zone[d + 1])
        cells = cell_gridpoints(mesh.zones)[zones.start // 4 : zones.stop // 4] - mesh.first_gridpoint[d]
        kept = np.repeat(mesh.on_boundary[mesh.first_gridpoint[d] : mesh.first_gridpoint[d + 1]], 2)
        kept |= np.isin(self._dofs(d), self.model.supports.prescribed)
        order, r = np.argsort(~kept, kind="stable"), int(kept.sum())
        place = np.argsort(order)
        local = place[(2 * cells[:, :, None] + np.arange(2)).reshape(-1, 10)]
        stiffness = np.zeros((len(kept), len(kept)))
        np.add.at(stiffness, (local[:, :, None], local[:, None, :]), cell_matrices(self.model, self._zones.rows, zones))
        flexibility = np.asarray(np.linalg.inv(stiffness[r:, r:]), dtype=np.float64)
        recovery = flexibility @ stiffness[r:, :r]
        condensed = stiffness[:r, :r] - stiffness[:r, r:] @ recovery
        condensed = 0.5 * (condensed + condensed.T)
        dofs = np.array([self._dofs(int(m)) for m in members])[:, order]
        boundary, interior = dofs[:, :r], dofs[:, r:]
        for m, own in zip(members, boundary):
            self.boundary[m], self.elastic[m] = own, condensed
        loads = self._loads[:, interior]
        arrays = ShapeArrays(
            dof=dofs,
            first_zone=mesh.first_zone[members],
            cells=local,
            stiffness=stiffness,
            flexibility=flexibility,
            recovery=recovery,
            condensed=condensed,
            elasticity=self._elasticity[mesh.block[d]],
            strength=self._strength[mesh.block[members]],
            loads=loads,
            inelastic=np.zeros(interior.shape),
        )
        return BlockShape(members, boundary, interior, condensed, recovery, loads @ flexibility, arrays)

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

    def set_condensed(self, condensed: BoolArray) -> None:
        """Set which blocks (d,) belong to condensed parts of the wall."""
        self._uncondensed = [shape.boundary[~condensed[shape.member]] for shape in self.shapes]

    def add_internal_forces(
        self,
        load: float,
        load_factor: float,
        displacement: FloatArray,
        plastic: FloatArray,
        force: FloatArray,
        condensed_too: bool = True,
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
        condensed_too : bool, optional
            Whether blocks of condensed parts count.
        """
        for shape, uncondensed in zip(self.shapes, self._uncondensed):
            boundary = shape.boundary if condensed_too else uncondensed
            force[boundary] -= displacement[boundary] @ shape.stiffness
        self._correct_active(self._zones.trial, load, load_factor, displacement, plastic, force)
        self._outdated = True

    def _correct_active(
        self,
        trial: FloatArray,
        load: float,
        load_factor: float,
        displacement: FloatArray,
        plastic: FloatArray,
        force: FloatArray,
    ) -> None:
        """Bring the interior of active blocks to equilibrium, and correct the elastic forces on their boundaries."""
        shares = float(load), float(load_factor)
        for shape, listed in zip(self.shapes, self._in_shape):
            if len(listed):
                condensed_forces(
                    shape.arrays, self._zones, listed, plastic, shares, self._tolerance, trial, displacement, force
                )

    def update_tangents(self) -> IntArray:
        """Condense the tangents of active blocks as of the last residual; return the blocks whose tangent changed."""
        if not self._outdated or not len(self.active):
            return self.active[:0]
        changed = self.yielding.copy()
        for shape, listed in zip(self.shapes, self._in_shape):
            if len(listed):
                yields = self.yielding[shape.member]
                first = self.first_entry[shape.member]
                condensed_tangents(shape.arrays, self._zones, listed, first, self.tangents, yields)
                self.yielding[shape.member] = yields
        self._outdated = False
        return np.flatnonzero(changed | self.yielding)

    def tangent(self, d: int) -> FloatArray:
        """Return the tangent of a block on its boundary (r, r) (N/m)."""
        return self.tangents[self.first_entry[d] : self.first_entry[d + 1]].reshape(self.elastic[d].shape)

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
        if len(self.active):  # the tangents stay those of the last residual
            trial, force = np.empty_like(self._zones.trial), np.zeros_like(displacement)
            self._correct_active(trial, load, load_factor, displacement, plastic, force)
        self.place_facets(displacement)
        self.field.mean_motion(displacement)

    def activate_yielding(
        self, displacement: FloatArray, load: float, load_factor: float, plastic: FloatArray
    ) -> IntArray:
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
            return self.active[:0]
        self.recover(displacement, load, load_factor, plastic)
        self.field.set_plastic_strain(plastic)
        return self._activate(self._owner[exceeds_yield_limit(self.model, self.field.stresses(displacement))])

    def activate_plastic(self, plastic: FloatArray) -> IntArray:
        """Activate the blocks in which any zone has plastic strain (z, 4); return those activated now."""
        return self._activate(self._owner[(plastic != 0.0).any(axis=1)])

    def activate_as_in(self, other: Superelements) -> None:
        """Activate the blocks that are active in another set, of the same wall with other supports."""
        self._activate(other.active)

    def _activate(self, blocks: IntArray) -> IntArray:
        new = np.setdiff1d(blocks, self.active)
        if len(new):
            self.active = np.union1d(self.active, new)
            self._in_shape = [np.flatnonzero(np.isin(shape.member, self.active)) for shape in self.shapes]
        return new

    def commit(self, state: State) -> float:
        """Commit plastic strains and zone states at an equilibrium, after ``recover``; return the plastic work (J)."""
        return sum(
            commit_plastic_strain(
                shape.arrays, self._zones, listed, state.displacement, state.plastic, state.zone_state
            )
            for shape, listed in zip(self.shapes, self._in_shape)
            if len(listed)
        )

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
