"""The discrete system of a wall: degrees of freedom, loads, lever arms and elastic stiffness, each computed once."""

from __future__ import annotations

from functools import cached_property
from typing import ClassVar, NamedTuple
from weakref import WeakValueDictionary

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.model import Interfaces
from damagepred.solvers.system.deformable_blocks import (
    block_resultants,
    facets_of,
    rigid_motion,
    transformation_matrix,
    zone_stiffness,
)

SINGULAR_RESIDUAL = 1e-3
"""Residual of an elastic solution over the largest load, above which the wall counts as singular (1)."""


class DiscreteSystem:
    """Degrees of freedom (3 per block, 3 of the ground, then strains or gridpoints) and arrays that solvers share."""

    _in_use: ClassVar[WeakValueDictionary[int, DiscreteSystem]] = WeakValueDictionary()

    def __init__(self, model: Model) -> None:
        self.model = model

    @classmethod
    def of(cls, model: Model) -> DiscreteSystem:
        """System of a model; one instance while a solver holds it."""
        system = cls._in_use.get(id(model))
        if system is None:
            system = cls._in_use[id(model)] = cls(model)
        return system

    # -- degrees of freedom ---------------------------------------------------------------------------------------

    @cached_property
    def dependent_dofs(self) -> IntArray:
        """Degrees of freedom that follow from others or are unused: the solvers leave them out."""
        mesh = self.model.mesh
        if mesh is None:
            return np.empty(0, dtype=np.int64)
        dependent = np.ones(self.model.size, dtype=np.bool_)
        dependent[: 3 * (self.model.n_blocks + 1)] = False
        dependent[self._mean_dofs] = True
        dependent[mesh.dof_x] = dependent[mesh.dof_y] = False
        return np.flatnonzero(dependent)

    @cached_property
    def constrained_dofs(self) -> IntArray:
        """Prescribed, ground and dependent degrees of freedom."""
        ground = 3 * self.model.n_blocks + np.arange(3)
        return np.concatenate((self.model.supports.prescribed, ground, self.dependent_dofs))

    @cached_property
    def free_dofs(self) -> IntArray:
        """Unknowns of the equations of motion or equilibrium."""
        return np.setdiff1d(np.arange(self.model.size), self.constrained_dofs)

    @cached_property
    def block_of_dof(self) -> IntArray:
        """Block of each degree of freedom (size,); n for ground and facets."""
        n, mesh = self.model.n_blocks, self.model.mesh
        block = np.full(self.model.size, n, dtype=np.int64)
        block[: 3 * n] = np.repeat(np.arange(n), 3)
        if mesh is not None:
            block[mesh.dof_x] = block[mesh.dof_y] = mesh.gridpoint_block
        if self.model.elastic is not None:
            block[self.strain_dofs] = np.repeat(self.model.elastic.block, 2)
        return block

    @cached_property
    def arms(self) -> FloatArray:
        """Arm (size,) that turns each degree of freedom into a displacement (m)."""
        # displacements 1, rotations the radius of gyration, strains and curvatures the displacement of block ends
        arms = np.ones(self.model.size)
        blocks, elastic = self.model.blocks, self.model.elastic
        arms[2 : 3 * self.model.n_blocks : 3] = np.sqrt(blocks.polar / blocks.area)
        if elastic is not None:
            arms[self.strain_dofs] = np.column_stack((elastic.length / 2.0, elastic.length**2 / 12.0)).ravel()
        return arms

    @cached_property
    def residual_scale(self) -> FloatArray:
        """Residual force (size,) (N, N m) of one mean block weight, or its share on an axis of symmetry."""
        scale = self.model.mean_block_weight * self.arms
        scale[: 3 * self.model.n_blocks] *= np.repeat(self.model.block_share, 3)
        if self.model.elastic is not None:
            scale[self.strain_dofs] *= np.repeat(self.model.block_share[self.model.elastic.block], 2)
        return scale

    @property
    def strain_dofs(self) -> slice:
        """Strain and curvature of all elastic blocks; empty for deformable blocks."""
        return slice(3 * (self.model.n_blocks + 1) if self.model.mesh is None else self.model.size, None)

    @cached_property
    def strain_stiffness(self) -> FloatArray:
        """Stiffness of elastic blocks: E b h t of strain (N m) and E b t h^3/12 of curvature (N m3) in turn."""
        model, elastic = self.model, self.model.elastic
        if elastic is None:
            return np.empty(0)
        law, block = model.block_law, elastic.block
        axial = law.elastic_modulus[block] * law.thickness[block] * elastic.length * elastic.height
        axial *= model.block_share[block] * elastic.halves
        return np.column_stack((axial, axial * elastic.height**2 / 12.0)).ravel()

    def strains(self, displacement: FloatArray) -> FloatArray | None:
        """Strain and curvature (1/m) of each block (n, 2), 0 for rigid blocks; None without elastic blocks."""
        if self.model.elastic is None:
            return None
        rigid = np.zeros((1, 2))
        return np.concatenate((displacement[self.strain_dofs].reshape(-1, 2), rigid))[self.model.elastic.number[:-1]]

    # -- loads ----------------------------------------------------------------------------------------------------

    @cached_property
    def dead_load(self) -> FloatArray:
        """Dead load (size,) (N, N m)."""
        return self._load(self.model.supports.load, self.model.edge_load)

    @cached_property
    def live_load(self) -> FloatArray:
        """Live load at full movement (size,) (N, N m)."""
        return self._load(self.model.supports.live_load, self.model.live_edge_load)

    def _load(self, on_blocks: FloatArray, on_gridpoints: FloatArray | None) -> FloatArray:
        """Loads on blocks (3 n,) (N, N m) distributed over gridpoints by mass, and loads on gridpoints (size,) (N)."""
        load = np.zeros(self.model.size)
        load[: on_blocks.size] = on_blocks
        if self.model.mesh is not None:
            load[self._mean_dofs] = 0.0
            load += self.rigid_motion.T @ on_blocks
        return load if on_gridpoints is None else load + on_gridpoints

    # -- deformable blocks ----------------------------------------------------------------------------------------

    @cached_property
    def _mean_dofs(self) -> IntArray:
        """Degrees of freedom (3 d,) of deformable blocks as a whole."""
        block = np.empty(0, dtype=np.int64) if self.model.mesh is None else self.model.mesh.block
        return (3 * block[:, None] + np.arange(3)).ravel()

    @cached_property
    def rigid_motion(self) -> sparse.csr_array:
        """Matrix (3 n, size) from displacements of gridpoints to the mean motion of their blocks."""
        return rigid_motion(self.model)

    @cached_property
    def _transformation(self) -> sparse.csr_array:
        return transformation_matrix(self.model)

    def complete(self, displacement: FloatArray) -> FloatArray:
        """Displacements (size,) with facets and mean motion of deformable blocks computed from gridpoints."""
        if self.model.mesh is None:
            return displacement
        completed = np.asarray(self._transformation @ displacement)
        completed[self._mean_dofs] = (self.rigid_motion @ displacement)[self._mean_dofs]
        return completed

    # -- elastic stiffness ----------------------------------------------------------------------------------------

    @cached_property
    def elastic_stiffness(self) -> sparse.csc_array:
        """Stiffness (size, size) of the intact wall (N/m, N, N m); gaps count as closed, dependent rows are zero."""
        return self._assemble_stiffness(self.model.interfaces.contact_area)

    def _assemble_stiffness(self, area: FloatArray) -> sparse.csc_array:
        joints = _joint_stiffness(self.model, area)
        if self.model.elastic is not None:
            strains = np.arange(self.model.size)[self.strain_dofs]
            size = joints.shape
            return (joints + sparse.coo_array((self.strain_stiffness, (strains, strains)), shape=size)).tocsc()
        if self.model.mesh is None:
            return joints
        transform = self._transformation[: joints.shape[0]]
        return (transform.T @ joints @ transform + zone_stiffness(self.model)).tocsc()

    @cached_property
    def _factorised_stiffness(self) -> tuple[sparse.csc_array, SuperLU] | None:
        """Elastic stiffness of the free dofs without open gaps, and its factors, or None where singular."""
        gap, free = self.model.properties.gap, self.free_dofs
        closed = self.model.interfaces.contact_area * (gap == 0.0)[:, None]
        whole = self._assemble_stiffness(closed) if gap.any() else self.elastic_stiffness
        stiffness = whole[free][:, free].tocsc()
        try:  # symmetric ordering and pivoting: a fifteenth of the time of the default
            factors = splu(
                stiffness, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError:  # singular
            return None
        return stiffness, factors

    def elastic_solutions(self, *loads: FloatArray) -> list[FloatArray] | None:
        """Displacements (size,) of the intact wall under each load without movement, or None where singular."""
        if self._factorised_stiffness is None:
            return None
        (stiffness, factors), free, solutions = self._factorised_stiffness, self.free_dofs, []
        for load in loads:
            displacement = np.zeros(self.model.size)
            displacement[free] = moved = factors.solve(load[free])
            # rounding may hide the singularity of a mechanism, but its huge displacements leave a residual
            residual = np.abs(stiffness @ moved - load[free]).max(initial=0.0)
            if not residual <= SINGULAR_RESIDUAL * np.abs(load[free]).max(initial=0.0):
                return None
            solutions.append(displacement)
        return solutions

    def elastic_displacement(self) -> FloatArray | None:
        """Displacements (size,) of the intact wall under dead load, or None where the wall is singular."""
        solutions = self.elastic_solutions(self.dead_load)
        return None if solutions is None else self.complete(solutions[0])

    @cached_property
    def largest_elastic_displacements(self) -> tuple[float, float]:
        """Largest displacements (m) of a block of the intact wall under dead and under live load; 0 if unknown."""
        model = self.model
        if model.jacks is not None or model.sections is not None or model.footing is not None:
            return 0.0, 0.0  # the limit of detachment covers blocks that move with a footing
        solutions = self.elastic_solutions(self.dead_load, self.live_load)
        if solutions is None:
            return 0.0, 0.0
        blocks = [u[: 3 * model.n_blocks].reshape(-1, 3)[:, :2] for u in solutions]
        dead, live = (float(np.hypot(*u.T).max(initial=0.0)) for u in blocks)
        # displacements beyond the size of the wall: it is nearly a mechanism
        size = float(np.ptp(model.blocks.vertices, axis=0).max())
        return (dead, live) if max(dead, live) < size else (0.0, 0.0)

    # -- reactions ------------------------------------------------------------------------------------------------

    def base_reaction(self, force: FloatArray) -> float:
        """Vertical force of ground and supports on the wall (N, upwards)."""
        ground = -float(force[3 * self.model.n_blocks + 1])
        return ground + float(self.support_force(force)[:, 1].sum())

    def support_force(self, force: FloatArray) -> FloatArray:
        """Force of the supports on each block (n, 3): x, y (N) and moment (N m), 0 where the block is free."""
        model = self.model
        reactions = np.zeros(3 * model.n_blocks)
        prescribed = model.supports.prescribed
        of_blocks = prescribed[prescribed < reactions.size]
        reactions[of_blocks] = -force[of_blocks]
        by_block = reactions.reshape(-1, 3)
        if model.mesh is not None and of_blocks.size < prescribed.size:
            reaction = np.zeros(model.size)
            of_gridpoints = prescribed[prescribed >= reactions.size]
            reaction[of_gridpoints] = -force[of_gridpoints]
            by_block += block_resultants(model, reaction)
        return by_block


def _joint_stiffness(model: Model, area: FloatArray) -> sparse.csc_array:
    """Stiffness of the intact joints with contact areas (m, q) (m2), between bodies and strains."""
    face, law = model.interfaces, model.properties
    size = 3 * model.n_bodies
    if model.elastic is None:
        rows = body_kinematics(face)
        dof = np.concatenate((3 * face.body_a[:, None] + np.arange(3), 3 * face.body_b[:, None] + np.arange(3)), axis=1)
    else:
        (dof, rows), size = interface_kinematics(model), model.size
        dof = np.maximum(dof, 0)  # unused places have no row
    opening = rows[:, None, 0] + face.contact_offset[:, :, None] * rows[:, None, 2]
    shear = np.repeat(rows[:, None, 1], opening.shape[1], axis=1)
    k_n, k_s = law.normal_stiffness[:, None] * area, law.shear_stiffness[:, None] * area
    blocks = np.einsum("mq,mqi,mqj->mij", k_n, opening, opening) + np.einsum("mq,mqi,mqj->mij", k_s, shear, shear)
    rows_of, columns_of = np.broadcast_to(dof[:, :, None], blocks.shape), np.broadcast_to(dof[:, None, :], blocks.shape)
    return sparse.coo_array((blocks.ravel(), (rows_of.ravel(), columns_of.ravel())), shape=(size, size)).tocsc()


class InterfaceKinematics(NamedTuple):
    """Kinematics of m interfaces with w degrees of freedom: 6 for rigid blocks, 8 for deformable, 10 for elastic."""

    # (m, w) side a, then side b: three of a rigid block, strain and curvature of an elastic block, or x and y of the
    # two gridpoints at the ends of a facet; -1 in unused places
    dof: IntArray
    rows: FloatArray  # (m, 3, w) opening and shear at the middle, and relative rotation, per unit displacement


def body_kinematics(face: Interfaces) -> FloatArray:
    """Opening and shear at the middle, and relative rotation, per unit displacement of two bodies (m, 3, 6)."""
    rows = np.zeros((len(face.kind), 3, 2, 3))
    arms = ((face.arm_normal_a, face.arm_shear_a), (face.arm_normal_b, face.arm_shear_b))
    for side, sign, (arm_normal, arm_shear) in zip((0, 1), (-1.0, 1.0), arms):
        rows[:, 0, side] = np.stack((sign * face.normal_x, sign * face.normal_y, sign * arm_normal), axis=-1)
        rows[:, 1, side] = np.stack((sign * face.normal_y, -sign * face.normal_x, sign * arm_shear), axis=-1)
        rows[:, 2, side, 2] = sign
    return rows.reshape(-1, 3, 6)


def interface_kinematics(model: Model) -> InterfaceKinematics:
    """Kinematics of a model's joints, with facets expressed by their gridpoints."""
    face = model.interfaces
    body = np.stack((face.body_a, face.body_b), axis=1)  # (m, 2)
    rows, dof = body_kinematics(face).reshape(-1, 3, 2, 3), 3 * body[:, :, None] + np.arange(3)
    if model.mesh is not None:
        of_bodies, whole = rows, body <= model.n_blocks
        rows, dof = np.pad(rows, ((0, 0), (0, 0), (0, 0), (0, 1))), np.full((*body.shape, 4), -1, dtype=np.int64)
        dof[..., :3][whole] = 3 * body[whole][:, None] + np.arange(3)
        facets = facets_of(model)
        piece = body[~whole] - model.n_blocks - 1
        dof[~whole] = np.stack([dofs[piece] for dofs in facets[:4]], axis=-1)
        follow = np.zeros((len(piece), 3, 4))  # the piece for its gridpoints
        follow[:, 0, 0] = follow[:, 1, 1] = facets.start_share[piece]
        follow[:, 0, 2] = follow[:, 1, 3] = facets.end_share[piece]
        turn_x, turn_y = facets.turn_x[piece], facets.turn_y[piece]
        follow[:, 2] = np.stack((-turn_x, -turn_y, turn_x, turn_y), axis=-1)
        rows.swapaxes(1, 2)[~whole] = of_bodies.swapaxes(1, 2)[~whole] @ follow
    if face.elastic is not None:
        rows = np.concatenate((rows, face.elastic.rows.swapaxes(1, 2)), axis=3)
        strain = face.elastic.dof[:, :, None]
        dof = np.concatenate((dof, strain, np.where(strain < 0, -1, strain + 1)), axis=2)
    count = len(face.kind)
    width = 2 * dof.shape[2]
    return InterfaceKinematics(dof.reshape(count, width), np.ascontiguousarray(rows.reshape(count, 3, width)))
