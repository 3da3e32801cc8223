"""Choice of deformable blocks by an error estimate of rigid ones.

The wall is solved with rigid blocks, whose elasticity is lumped into the joints. The joint forces then load each block
alone, cut into zones. Its strain energy less the energy of the lumped springs is the error of a rigid block. Blocks get
zones in the order of their errors until the rest is a small share of the energy of the wall, and in any case where the
stress approaches the strength.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.kernels.zone.forces import find_yielding_zones
from damagepred.scene import Solver
from damagepred.solvers.options import SolverOptions
from damagepred.solvers.state.increment import Increment
from damagepred.solvers.system.deformable_blocks import (
    block_moduli,
    block_resultants,
    can_yield,
    cell_gridpoints,
    elastic_stress,
    strain_rows,
    zone_stiffness,
)
from damagepred.solvers.system.discrete_system import DiscreteSystem

Build = Callable[[Solver, frozenset[int] | None], Model]
"""Model of settings and a set of deformable blocks."""


def blocks_needing_zones(build: Build, settings: Solver, increments: int) -> frozenset[int]:
    """Blocks to be cut into zones, by the error estimate."""
    from damagepred.solvers import solve_path

    rigid = replace(settings, blocks="rigid", above_dpc=None, below_dpc=None, method="quasi_static", tolerance=None)
    whole = build(rigid, None)
    cut = build(replace(settings, method="quasi_static"), frozenset(range(whole.n_blocks)) - _held(whole))
    loads = BlockLoads(whole, cut, SolverOptions.of(settings).zone_selection.strength_share)
    error, energy = np.zeros(whole.n_blocks), 0.0
    yielding = np.zeros(whole.n_blocks, dtype=np.bool_)
    for increment in solve_path(whole, rigid, increments):
        if increment.collapsed:
            break
        errors, near_yield = loads.errors(increment)
        error, yielding = np.maximum(error, errors), yielding | near_yield
        energy = max(energy, joint_energy(whole, increment))
    order = np.argsort(error)
    left_out = np.cumsum(error[order]) <= settings.rigid_error * energy
    chosen = np.ones(whole.n_blocks, dtype=np.bool_)
    chosen[order[left_out]] = False
    chosen |= yielding
    return frozenset(np.flatnonzero(chosen).tolist()) - _held(whole)


def _held(model: Model) -> frozenset[int]:
    prescribed = model.supports.prescribed
    return frozenset((prescribed[prescribed < 3 * model.n_blocks] // 3).tolist())


def joint_energy(model: Model, increment: Increment) -> float:
    """Elastic energy of the joints, lumped blocks included (J)."""
    law, area = model.properties, model.interfaces.contact_area
    squares = (
        increment.normal_stress**2 / law.normal_stiffness[:, None]
        + increment.shear_stress**2 / law.shear_stiffness[:, None]
    )
    return float(0.5 * (squares * area).sum())


class BlockLoads:
    """Single blocks of a wall under the forces of their joints."""

    def __init__(self, whole: Model, cut: Model, strength_share: float) -> None:
        assert cut.mesh is not None
        self.whole, self.cut, self.mesh = whole, cut, cut.mesh
        self._groups = self._flexibilities(zone_stiffness(cut))
        self._system = DiscreteSystem.of(cut)
        self._rows = strain_rows(cut)
        self._moduli, strength = block_moduli(cut)
        # the share applies to the strengths, which scale with the stress
        self._strength = strength.copy()
        self._strength[:, [0, 3, 4]] *= strength_share
        self._yields = can_yield(cut)
        self._sides = [self._gridpoints_at(side) for side in (whole.interfaces.block_a, whole.interfaces.block_b)]

    def _gridpoints_at(self, block: IntArray) -> tuple[IntArray, FloatArray]:
        """Two gridpoints of a block next to each contact (m, q, 2), and their shares."""
        face, mesh = self.whole.interfaces, self.mesh
        x = face.x[:, None] + face.normal_y[:, None] * face.contact_offset
        y = face.y[:, None] - face.normal_x[:, None] * face.contact_offset
        number = np.full(self.whole.n_blocks + 1, -1)
        number[mesh.block] = np.arange(len(mesh.block))
        points, shares = np.full((*x.shape, 2), -1), np.zeros((*x.shape, 2))
        counts = np.diff(mesh.first_facet)
        for count in np.unique(counts):
            alike = np.flatnonzero((number[block] >= 0) & (counts[number[block]] == count))
            facets = mesh.facets[mesh.first_facet[number[block[alike]], None] + np.arange(count)]  # (i, f, 2)
            contacts = np.stack((x[alike], y[alike]), axis=-1)[:, :, None]  # (i, q, 1, 2)
            start, end = (np.stack((mesh.x[facets[..., e]], mesh.y[facets[..., e]]), axis=-1)[:, None] for e in (0, 1))
            along = end - start
            share = np.clip(((contacts - start) * along).sum(axis=-1) / (along**2).sum(axis=-1), 0.0, 1.0)
            away = start + share[..., None] * along - contacts
            nearest = (away**2).sum(axis=-1).argmin(axis=-1)  # (i, q)
            end_share = np.take_along_axis(share, nearest[..., None], axis=-1)[..., 0]
            points[alike] = facets[np.arange(len(alike))[:, None], nearest]
            shares[alike] = np.stack((1.0 - end_share, end_share), axis=-1)
        return points, shares

    def errors(self, increment: Increment) -> tuple[FloatArray, BoolArray]:
        """Energy error of each rigid block (n,) (J), and whether it approaches yielding."""
        whole, mesh, face = self.whole, self.mesh, self.whole.interfaces
        area = face.contact_area
        sigma, tau = area * increment.normal_stress, area * increment.shear_stress
        n_x, n_y = face.normal_x[:, None], face.normal_y[:, None]
        force = np.stack((sigma * n_x + tau * n_y, sigma * n_y - tau * n_x), axis=-1)
        load = self._system.distribute(whole.supports.load + increment.load_factor * whole.supports.live_load)
        for (points, shares), sign in zip(self._sides, (1.0, -1.0)):
            cut = points[..., 0] >= 0
            for end in range(2):
                gridpoint, pull = points[cut][:, end], sign * shares[cut][:, end, None] * force[cut]
                np.add.at(load, mesh.dof_x[gridpoint], pull[:, 0])
                np.add.at(load, mesh.dof_y[gridpoint], pull[:, 1])
        # remove the resultant, from rounding or supports, as inertia of a rigid body
        load -= self._system.rigid_motion.T @ block_resultants(self.cut, load).ravel()
        energy, yielding = np.zeros(whole.n_blocks), np.zeros(whole.n_blocks, dtype=np.bool_)
        displacement = np.zeros(self.cut.size)
        for block, dofs, flexibility in self._groups:
            moved = load[dofs] @ flexibility
            displacement[dofs] = moved
            energy[block] = 0.5 * (load[dofs] * moved).sum(axis=1)
        if self._yields.any():
            yielding[self._near_yield(displacement)] = True
        error = np.abs(energy - self._lumped(increment))
        error[np.setdiff1d(np.arange(whole.n_blocks), mesh.block)] = 0.0
        return error, yielding

    def _dofs(self, d: int) -> IntArray:
        gridpoints = slice(self.mesh.first_gridpoint[d], self.mesh.first_gridpoint[d + 1])
        return np.concatenate((self.mesh.dof_x[gridpoints], self.mesh.dof_y[gridpoints]))

    def _flexibilities(self, stiffness: csr_array) -> list[tuple[IntArray, IntArray, FloatArray]]:
        """Groups of equal blocks (b,), their degrees of freedom (b, k) and flexibility (pseudo-inverse)."""
        alike: dict[bytes, list[int]] = {}
        matrices: dict[bytes, FloatArray] = {}
        for d in range(len(self.mesh.block)):
            dofs = self._dofs(d)
            matrix = stiffness[dofs][:, dofs].toarray()
            scale = np.abs(matrix).max()
            key = (np.round(matrix / scale * 1e9) + 0.0).tobytes() + np.float64(f"{scale:.9e}").tobytes()
            alike.setdefault(key, []).append(d)
            matrices.setdefault(key, matrix)
        return [
            (
                self.mesh.block[members],
                np.array([self._dofs(d) for d in members]),
                np.asarray(np.linalg.pinv(matrices[key], rcond=1e-10, hermitian=True), dtype=np.float64),
            )
            for key, members in alike.items()
        ]

    def _near_yield(self, displacement: FloatArray) -> IntArray:
        mesh = self.mesh
        points = cell_gridpoints(mesh.zones)
        u = np.stack((displacement[mesh.dof_x[points]], displacement[mesh.dof_y[points]]), axis=2).reshape(-1, 10)
        strain = np.pad(np.einsum("zij,zj->zi", self._rows, np.repeat(u, 4, axis=0)), ((0, 0), (0, 1)))
        stress = elastic_stress(self._moduli[mesh.zone_block], strain)
        beyond = np.zeros(len(stress), dtype=np.bool_)
        find_yielding_zones(np.ascontiguousarray(stress), self._strength, mesh.zone_block, beyond)
        return np.unique(mesh.zone_block[beyond])

    def _lumped(self, increment: Increment) -> FloatArray:
        """Energy of each block lumped into springs of the joints (n,) (J)."""
        whole, face, law = self.whole, self.whole.interfaces, self.whole.block_law
        total = np.zeros(whole.n_blocks)
        shear_modulus = law.elastic_modulus / (2.0 * (1.0 + law.poisson_ratio))
        for block in (face.block_a, face.block_b):
            faces = np.flatnonzero(block < whole.n_blocks)
            of = block[faces]
            depth = np.abs(
                face.normal_x[faces] * (face.x[faces] - whole.blocks.x[of])
                + face.normal_y[faces] * (face.y[faces] - whole.blocks.y[of])
            )
            area = face.contact_area[faces]
            normal = (area * increment.normal_stress[faces] ** 2).sum(axis=1) / law.elastic_modulus[of]
            shear = (area * increment.shear_stress[faces] ** 2).sum(axis=1) / shear_modulus[of]
            np.add.at(total, of, 0.5 * depth * (normal + shear))
        return total
