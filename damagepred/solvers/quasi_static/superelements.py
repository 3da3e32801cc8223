"""Deformable blocks in the quasi-static solver: superelements, and nonlinear condensation of blocks that yield.

The interior of an elastic block is condensed to its boundary once (Guyan 1965); bricks of one shape and material share
the condensation. A block in which a zone would yield becomes active: its interior is brought to equilibrium by Newton
iteration for every displacement of the boundary.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.kernels.linear.solver import Solver
from damagepred.kernels.zone.structures import (
    BlockLaw,
    BlockShapes,
    BlockSums,
    DeformableBlocks,
    YieldLaw,
)
from damagepred.kernels.zone.superelement import (
    add_block_forces,
    commit_plastic_strain,
    correct_active_blocks,
    largest_block_resultant,
    place_block_facets,
    recover_blocks,
    trial_stresses,
    update_block_tangents,
    update_from_python,
)
from damagepred.solvers.state.increment import ZoneResults
from damagepred.solvers.state.wall_state import State
from damagepred.solvers.state.zone_history import exceeds_yield_limit, zone_results
from damagepred.solvers.system.deformable_blocks import (
    at_gridpoints,
    block_moduli,
    can_yield,
    cell_gridpoints,
    cell_matrices,
    facets_of,
    resultants,
    strain_rows,
)
from damagepred.solvers.system.discrete_system import DiscreteSystem


class BlockShape(NamedTuple):
    """Blocks of one shape, material and support, r degrees of freedom of the boundary first, then the interior."""

    member: IntArray  # (b,) Which of the deformable blocks
    dof: IntArray  # (b, n) Degrees of freedom of each
    cells: IntArray  # (c, 10) Places, among the n, of x and y of the five gridpoints of each cell
    # (n, n), (r, r), (i, r), (i, i) Elastic stiffness, its Schur complement on the boundary (N/m), recovery matrix,
    # and inverse of the interior's stiffness (m/N)
    stiffness: FloatArray
    condensed: FloatArray
    recovery: FloatArray
    flexibility: FloatArray


class Superelements:
    """Deformable blocks of a model: degrees of freedom of each ``boundary``, ``elastic`` stiffness there (N/m)."""

    def __init__(self, system: DiscreteSystem) -> None:
        model = system.model
        assert model.mesh is not None
        self.model, self.mesh, self.block = model, model.mesh, model.mesh.block
        self.yields = can_yield(model)[self.block]
        loads = np.stack((system.dead_load, system.live_load))
        rows = strain_rows(model)
        shapes = [self._condense(members, rows) for members in self._group_by_shape()]
        self.boundary: list[IntArray] = [np.empty(0, np.int64)] * len(self.block)
        self.elastic: list[FloatArray] = [np.empty((0, 0))] * len(self.block)
        self.condensed_loads, particular = loads.copy(), np.zeros_like(loads)
        interiors = []
        for shape in shapes:
            r = len(shape.condensed)
            boundary, interior = shape.dof[:, :r], shape.dof[:, r:]
            interiors.append(interior.ravel())
            for m, dof in zip(shape.member, boundary):
                self.boundary[m], self.elastic[m] = dof, shape.condensed
            particular[:, interior] = loads[:, interior] @ shape.flexibility
            for load in self.condensed_loads:
                load[boundary] -= load[interior] @ shape.recovery
                load[interior] = 0.0
        self.interior = np.concatenate(interiors)
        self.first_entry = np.concatenate(([0], np.cumsum([k.size for k in self.elastic])))
        self.tangents = np.concatenate([k.ravel() for k in self.elastic])
        self.law = BlockLaw(
            present=True,
            blocks=self._structure(shapes, rows, loads, particular),
            place_facets=place_block_facets,
            add_forces=add_block_forces,
            largest_resultant=largest_block_resultant,
            recover=recover_blocks,
            yielding=YieldLaw(present=True, correct_active=correct_active_blocks, update_tangents=update_block_tangents)
            if self.yields.any()
            else YieldLaw.empty(),
        )

    def _structure(
        self, shapes: list[BlockShape], rows: FloatArray, loads: FloatArray, particular: FloatArray
    ) -> DeformableBlocks:
        """All blocks as one structure for kernels: matrices once per shape, other arrays once per block."""
        model, mesh, count = self.model, self.mesh, len(self.block)
        elasticity, strength = block_moduli(model)
        size, boundary, cells = np.array([(len(k.stiffness), len(k.condensed), len(k.cells)) for k in shapes]).T
        condensed = [np.block([[k.condensed, k.recovery.T], [k.recovery, k.flexibility]]) for k in shapes]
        shape, dofs = np.empty(count, dtype=np.int64), [np.empty(0, dtype=np.int64)] * count
        for number, k in enumerate(shapes):  # shape and degrees of freedom of each block
            shape[k.member] = number
            for m, dof in zip(k.member, k.dof):
                dofs[m] = dof
        whole = (3 * self.block[:, None] + np.arange(3)).ravel()
        motion, resultant = DiscreteSystem.of(model).rigid_motion[whole], resultants(model)[whole]
        return DeformableBlocks(
            shapes=BlockShapes(
                size=np.ascontiguousarray(size),
                boundary=np.ascontiguousarray(boundary),
                first_entry=np.cumsum(size**2) - size**2,
                stiffness=np.concatenate([k.stiffness.ravel() for k in shapes]),
                condensed=np.concatenate([k.ravel() for k in condensed]),
                first_cell=np.concatenate(([0], np.cumsum(cells))),
                cells=np.concatenate([k.cells for k in shapes]),
                elasticity=elasticity[[self.block[k.member[0]] for k in shapes]],
            ),
            facets=facets_of(model),
            sums=BlockSums(
                dof=whole,
                first=motion.indptr.astype(np.int64),
                column=motion.indices.astype(np.int64),
                motion=motion.data,
                resultant=resultant.data / model.mean_block_weight,
            ),
            shape=shape,
            first_zone=mesh.first_zone[:-1].copy(),
            first_dof=np.concatenate(([0], np.cumsum([len(dof) for dof in dofs]))),
            dof=np.concatenate(dofs),
            strength=strength[self.block],
            loads=loads,
            particular=particular,
            inelastic=np.zeros(model.size),
            rows=rows,
            volume=mesh.zone_area * model.block_law.thickness[mesh.zone_block],
            trial=np.zeros((len(mesh.zones), 4)),
            spare_trial=np.zeros((len(mesh.zones), 4)),
            active=np.zeros(count, dtype=np.bool_),
            condensed=np.zeros(count, dtype=np.bool_),
            yielding=np.zeros(count, dtype=np.bool_),
            outdated=np.zeros(1, dtype=np.bool_),
        )

    def _group_by_shape(self) -> list[IntArray]:
        """Deformable blocks that share a condensation: same shape, material and supports."""
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

    def _condense(self, members: IntArray, rows: FloatArray) -> BlockShape:
        """Condensed stiffness of blocks of one shape (Guyan 1965); degrees of freedom kept come first."""
        mesh, d = self.mesh, int(members[0])
        zones = slice(mesh.first_zone[d], mesh.first_zone[d + 1])
        cells = cell_gridpoints(mesh.zones)[zones.start // 4 : zones.stop // 4] - mesh.first_gridpoint[d]
        kept = np.repeat(mesh.on_boundary[mesh.first_gridpoint[d] : mesh.first_gridpoint[d + 1]], 2)
        kept |= np.isin(self._dofs(d), self.model.supports.prescribed)
        order, r = np.argsort(~kept, kind="stable"), int(kept.sum())
        place = np.argsort(order)  # of each degree of freedom in that order
        local = place[(2 * cells[:, :, None] + np.arange(2)).reshape(-1, 10)]
        stiffness = np.zeros((len(kept), len(kept)))
        np.add.at(stiffness, (local[:, :, None], local[:, None, :]), cell_matrices(self.model, rows, zones))
        flexibility = np.asarray(np.linalg.inv(stiffness[r:, r:]), dtype=np.float64)
        recovery = flexibility @ stiffness[r:, :r]
        condensed = stiffness[:r, :r] - stiffness[:r, r:] @ recovery
        condensed = 0.5 * (condensed + condensed.T)
        dofs = np.array([self._dofs(int(m)) for m in members])[:, order]
        return BlockShape(members, dofs, local, stiffness, condensed, recovery, flexibility)

    @property
    def active(self) -> IntArray:
        """Blocks of which a zone yields, or has yielded."""
        return np.flatnonzero(self.law.blocks.active)

    def update_tangents(self, solver: Solver) -> None:
        """Condense the tangents of active blocks as of the last residual, for the next solution."""
        if self.yields.any():
            update_from_python(self.law, solver)

    # -- history ----------------------------------------------------------------------------------------------------

    def activate_yielding(self, displacement: FloatArray, plastic: FloatArray) -> IntArray:
        """Activate the blocks with a zone outside its yield surface in an equilibrium; return those activated now."""
        if not self.yields.any():
            return np.empty(0, dtype=np.int64)
        return self._activate(exceeds_yield_limit(self.model, self._stresses(displacement, plastic)))

    def activate_plastic(self, plastic: FloatArray) -> IntArray:
        """Activate the blocks in which any zone has plastic strain (z, 4); return those activated now."""
        return self._activate((plastic != 0.0).any(axis=1))

    def _activate(self, zones: BoolArray) -> IntArray:
        """Activate the blocks of some zones (z,); return those activated now."""
        active = self.law.blocks.active
        owner = np.repeat(np.arange(len(self.block)), np.diff(self.mesh.first_zone))
        new = np.setdiff1d(owner[zones], np.flatnonzero(active))
        active[new] = True
        return new

    def commit(self, state: State) -> float:
        """Commit plastic strains and zone states at an equilibrium just completed; return the plastic work (J)."""
        if not self.yields.any():
            return 0.0
        return float(commit_plastic_strain(self.law.blocks, state.displacement, state.plastic, state.zone_state))

    def zone_results(self, state: State) -> ZoneResults:
        """Return the zones' stresses and states and the gridpoints' displacements at an equilibrium."""
        gridpoints = at_gridpoints(self.model, state.displacement)
        return zone_results(
            gridpoints, self._stresses(state.displacement, state.plastic), state.plastic, state.zone_state
        )

    def _stresses(self, displacement: FloatArray, plastic: FloatArray) -> FloatArray:
        """Return the stresses of the zones (z, 4), if none yields any further (Pa)."""
        stress = np.empty_like(plastic)
        trial_stresses(self.law.blocks, plastic, displacement, stress)
        return stress

    def elastic_energy(self, state: State) -> float:
        """Return the elastic energy of all zones at an equilibrium (J)."""
        inverse = 1.0 / self.model.block_law.elastic_modulus[self.mesh.zone_block]
        nu = self.model.block_law.poisson_ratio[self.mesh.zone_block]
        xx, yy, xy, zz = self._stresses(state.displacement, state.plastic).T
        squares = xx**2 + yy**2 + zz**2 - 2 * nu * (xx * yy + yy * zz + zz * xx) + 2 * (1 + nu) * xy**2
        return float(0.5 * (inverse * squares * self.law.blocks.volume).sum())
