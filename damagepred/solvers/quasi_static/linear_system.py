"""Tangent equations of a wall: block tridiagonal elimination by levels, with Woodbury corrections for few changes.

Blocks that touch the ground or a support are level 0, their neighbours level 1, and so on; an interface lies within a
level or between neighbouring ones. The stiffness is then block tridiagonal and is eliminated from the farthest level to
the ground. A change in one level leaves the Schur complements of all farther ones as they are, so elimination restarts
there. Levels that stay elastic are statically condensed to a superelement on the boundary level once.

Most Newton iterations change a few interfaces only. Then the last factorisation is corrected by the Woodbury identity.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from damagepred.arrays import FloatArray, IntArray
from damagepred.errors import InputError
from damagepred.kernels.linear.assembly import assemble_couplings, assemble_level, copy_rows, farthest_unsymmetric
from damagepred.kernels.linear.block_tridiagonal import (
    ELIMINATION,
    back_substitution,
    forward_elimination,
    schur_complement,
    solve_columns,
    solve_rows,
)
from damagepred.kernels.linear.graph_distance import joints_away
from damagepred.kernels.linear.woodbury import (
    capacitance_matrix,
    changed_interfaces,
    correction_agrees,
    correction_forces,
    relative_displacements,
    subtract_correction,
    unit_loads,
)
from damagepred.solvers.quasi_static.dense_inverse import invert
from damagepred.solvers.quasi_static.options import LinearSystemOptions
from damagepred.solvers.quasi_static.superelements import Superelements
from damagepred.solvers.system.discrete_system import DiscreteSystem
from damagepred.solvers.system.interface_kinematics import interface_kinematics

DEFAULTS = LinearSystemOptions()


class BlockTridiagonalSystem:
    """Factorised tangent stiffness of a wall.

    Parameters
    ----------
    system : DiscreteSystem
        Of n blocks and m interfaces.
    elastic : array (m, 9)
        Stiffness of the interfaces while nothing is cracked or slides; see ``joint_forces``.
    superelements : Superelements, optional
        The deformable blocks; their inner degrees of freedom are condensed.
    options : LinearSystemOptions, optional
        Tolerances and costs.
    """

    def __init__(
        self,
        system: DiscreteSystem,
        elastic: FloatArray,
        superelements: Superelements | None = None,
        options: LinearSystemOptions = DEFAULTS,
    ) -> None:
        model = self.model = system.model
        self.elastic, self.superelements, self.options = elastic, superelements, options
        self.kinematics = interface_kinematics(model)
        self._first_strain, self._strain_stiffness = system.strain_dofs.start, system.strain_stiffness
        self.level = block_levels(system)
        self.level_of = level_of = self.level[system.block_of_dof]
        dofs = system.free_dofs
        if superelements is not None:
            dofs = np.setdiff1d(dofs, superelements.interior)
        self.dofs = dofs[np.lexsort((dofs, level_of[dofs]))]
        self.levels = int(self.level.max()) + 1
        self.size = np.bincount(level_of[self.dofs], minlength=self.levels).astype(np.int64)
        self.start = np.concatenate(([0], np.cumsum(self.size)))
        self.place = np.full(model.size, -1, dtype=np.int64)
        self.place[self.dofs] = np.arange(len(self.dofs)) - self.start[level_of[self.dofs]]
        self.at_inverse = np.concatenate(([0], np.cumsum(self.size**2)))
        if (needed := 16e-9 * float(self.at_inverse[-1])) > options.max_memory:
            raise InputError(
                f"the quasi-static solver would need {needed:.0f} GB for its matrices, and takes "
                f"{options.max_memory:g} GB at most; take a larger solver.zone_size, cut fewer blocks, or take "
                f"method = 'explicit'."
            )
        self.inverses = np.zeros(self.at_inverse[-1])
        self._list_interfaces()
        self._list_superelements()
        self.stiffness = elastic.copy()  # the factorised one
        self.wanted = elastic.copy()
        side = self.at_far.shape[1]
        self.up = np.zeros((len(self.bridges), side, side))
        self.down = np.zeros((len(self.bridges), side, side))
        self._condensed = [np.zeros((s, s)) for s in self.size]
        own = [self._within(k, elastic).diagonal() for k in range(self.levels)]
        # a block without joints keeps its place
        usual = max((float(values.max(initial=0.0)) for values in own), default=0.0) or 1.0
        self._regularisation = [options.regularisation * np.where(values > 0.0, values, usual) for values in own]
        self.factorisations = self.corrections = 0
        self._factorisation_cost = np.concatenate(([0.0], np.cumsum(factorisation_cost(self.size, options))))
        self.set_active_levels(self.levels)
        self._stale = self.levels - 1

    def _list_interfaces(self) -> None:
        face, n = self.model.interfaces, self.model.n_blocks
        a, b = face.block_a, face.block_b
        level_a, level_b = self.level[a], self.level[b]
        self.interface_level = np.where(a == n, level_b, np.where(b == n, level_a, np.maximum(level_a, level_b)))
        far_is_a = level_a > level_b
        bridging = (level_a != level_b) & (a != n) & (b != n)
        bridges = np.flatnonzero(bridging)
        self.bridges = bridges[np.argsort(self.interface_level[bridges], kind="stable")]
        self.first_bridge = np.searchsorted(self.interface_level[self.bridges], np.arange(self.levels + 1))
        self.far_is_b = ~far_is_a[self.bridges]
        dof = self.kinematics.dof[self.bridges].reshape(len(self.bridges), 2, self.kinematics.dof.shape[1] // 2)
        at = np.where(dof >= 0, self.place[dof], -1)
        each, far = np.arange(len(self.bridges)), self.far_is_b.astype(np.int64)
        self.at_far, self.at_near = np.ascontiguousarray(at[each, far]), np.ascontiguousarray(at[each, 1 - far])
        order = np.argsort(self.interface_level, kind="stable")
        edges = np.searchsorted(self.interface_level[order], np.arange(self.levels + 1))
        self._interfaces_of_level = [order[edges[k] : edges[k + 1]] for k in range(self.levels)]

    def _list_superelements(self) -> None:
        """List the deformable blocks of each level, and where their degrees of freedom are in it."""
        self._superelements_of: list[list[tuple[int, IntArray, IntArray]]] = [[] for _ in range(self.levels)]
        self.superelement_level = np.empty(0, dtype=np.int64)
        if self.superelements is None:
            return
        self.superelement_level = self.level[self.superelements.block]
        for d, k in enumerate(self.superelement_level):
            place = self.place[self.superelements.boundary[d]]
            free = np.flatnonzero(place >= 0)
            self._superelements_of[k].append((d, free, place[free]))
        self.superelement_stiffness = list(self.superelements.elastic)  # as it is factorised

    def _bridges(self, k: int) -> IntArray:
        """Return the interfaces between levels k and k - 1."""
        return self.bridges[self.first_bridge[k] : self.first_bridge[k + 1]]

    def _within(self, k: int, stiffness: FloatArray) -> FloatArray:
        """Return the stiffness within a level, transposed, the displacements of all others held."""
        matrix = np.zeros((self.size[k], self.size[k]))
        joining = self._interfaces_of_level[k]
        if k + 1 < self.levels:
            joining = np.concatenate((joining, self._bridges(k + 1)))
        assemble_level(joining, self.kinematics, stiffness, self.place, self.level_of, k, matrix)
        elastic = stiffness is self.elastic
        if len(self._strain_stiffness):
            own = self.dofs[self.start[k] : self.start[k + 1]] - self._first_strain
            strains = np.flatnonzero(own >= 0)
            matrix[strains, strains] += self._strain_stiffness[own[strains]]
        for d, own, place in self._superelements_of[k]:
            block = self.superelements.elastic[d] if elastic else self.superelement_stiffness[d]  # type: ignore[union-attr]
            matrix[place[:, None], place] += block.T if len(own) == len(block) else block[own[:, None], own].T
        return matrix

    def _levels_up_to(self, levels: int) -> tuple[FloatArray | IntArray, ...]:
        """Return where levels begin, their inverses and their bridges, as the kernels of elimination take them."""
        start = self.start[: levels + 1]
        return start, self.inverses, self.at_inverse, self.first_bridge, self.at_far, self.at_near

    def _inverse(self, k: int) -> FloatArray:
        size = self.size[k]
        return self.inverses[self.at_inverse[k] : self.at_inverse[k + 1]].reshape(size, size)

    # -- static condensation ---------------------------------------------------------------------------------------

    def set_active_levels(self, active_levels: int) -> None:
        """Set the number of active levels; those beyond are condensed, see ``condense``."""
        self.active_levels = active_levels
        self.active = np.flatnonzero(self.interface_level < active_levels)
        self.condensed_interfaces = np.flatnonzero(self.interface_level >= active_levels)
        end = self.start[active_levels]
        self.order = np.full(self.place.size, -1, dtype=np.int64)
        self.order[self.dofs[:end]] = np.arange(end)
        self.active_dofs = self.dofs[:end]
        most = self.options.max_changed_interfaces
        self._listed = np.empty(most, dtype=np.int64)
        self._unit_load_response = np.empty((3 * most, int(end)))
        self._compliance = np.empty((3 * most, 3 * most))
        self._forget_changes()
        self._stale = active_levels - 1

    def condense(self, active_levels: int, load: FloatArray, live_load: FloatArray | None = None) -> bool:
        """Condense all levels from ``active_levels`` on, elastic, to a superelement on the level before.

        Parameters
        ----------
        active_levels : int
            Number of active levels, from the ground on.
        load, live_load : array (size,)
            Dead and live load at load factor 1 (N, N m); None: no live load.

        Returns
        -------
        bool
            Whether the active levels hold the condensed ones; if not, all levels become active.
        """
        was = self.active_levels
        if active_levels >= self.levels:
            self.set_active_levels(self.levels)
            return False
        if active_levels < was:
            # without regularisation, which would hold the condensed levels in space
            condensed = self.interface_level >= active_levels
            self.stiffness[condensed] = self.wanted[condensed] = self.elastic[condensed]
            assemble_couplings(self.bridges, self.far_is_b, self.kinematics, self.elastic, self.up, self.down)
            for k in range(self.levels - 1, active_levels - 1, -1):
                if not self._eliminate(k, regularised=False):
                    self.set_active_levels(self.levels)
                    return False
        self.set_active_levels(active_levels)
        loads = np.stack([load, np.zeros_like(load) if live_load is None else live_load])
        weight = np.ascontiguousarray(loads[:, self.dofs])
        self._particular = np.zeros(weight.shape)
        forward_elimination(*self._levels_up_to(self.levels), self.up, active_levels, weight, self._particular)
        self._load_on_condensed = loads[:, self.dofs[self.start[active_levels] :]]
        edge = slice(self.start[active_levels - 1], self.start[active_levels])
        self.boundary_dofs = self.dofs[edge]
        self._condensed_load = weight[:, edge] - loads[:, self.boundary_dofs]
        bridge = np.zeros((self.size[active_levels - 1], self.size[active_levels - 1]))
        assemble_level(
            self._bridges(active_levels),
            self.kinematics,
            self.elastic,
            self.place,
            self.level_of,
            active_levels - 1,
            bridge,
        )
        self._condensed_stiffness = (bridge - self._condensed[active_levels - 1]).T
        return True

    def condensed_load(self, load: float, live: float) -> FloatArray:
        """Return the condensed load on the boundary degrees of freedom (N, N m).

        Parameters
        ----------
        load, live : float
            Load factors of dead and live load.
        """
        return load * self._condensed_load[0] + live * self._condensed_load[1]

    def condensed_force(self, displacement: FloatArray, load: float, live: float = 0.0) -> FloatArray:
        """Return the force of the superelement on the boundary degrees of freedom (N, N m).

        Parameters
        ----------
        displacement : array (size,)
            Of all degrees of freedom (m).
        load, live : float
            Load factors of dead and live load.
        """
        return self.condensed_load(load, live) - self._condensed_stiffness @ displacement[self.boundary_dofs]

    def condensed_load_work(self, displacement: FloatArray, load: float, live: float) -> float:
        """Return load times displacement on the condensed levels (J).

        Parameters
        ----------
        displacement : array (size,)
            Of all degrees of freedom (m).
        load, live : float
            Load factors of dead and live load.
        """
        moved = displacement[self.dofs[self.start[self.active_levels] :]]
        return load * float(self._load_on_condensed[0] @ moved) + live * float(self._load_on_condensed[1] @ moved)

    def recover(self, displacement: FloatArray, load: float, live: float = 0.0) -> None:
        """Recover the displacements of the condensed levels by back substitution.

        Parameters
        ----------
        displacement : array (size,)
            Of all degrees of freedom (m); updated.
        load, live : float
            Load factors of dead and live load.
        """
        if self.active_levels == self.levels:
            return
        moved = displacement[self.dofs]
        particular = load * self._particular[0] + live * self._particular[1]
        levels = self._levels_up_to(self.levels)
        back_substitution(*levels, self.down, self.active_levels, 1.0, particular[None], moved[None])
        displacement[self.dofs] = moved

    # -- factorising and solving ------------------------------------------------------------------------------------

    def update(self, stiffness: FloatArray) -> None:
        """Set the stiffness of the interfaces for the next ``solve``.

        Parameters
        ----------
        stiffness : array (m, 9)
            See ``joint_forces``; only active interfaces count.
        """
        copy_rows(self.active, stiffness, self.wanted)

    def solve(self, force: FloatArray) -> FloatArray:
        """Solve for the displacements of all degrees of freedom.

        Parameters
        ----------
        force : array (size,) or (r, size)
            Right-hand side, or one in each row.

        Returns
        -------
        array
            Of the same shape; 0 where prescribed or condensed.
        """
        changed, new = changed_interfaces(self.active, self.wanted, self.stiffness, self._slot)
        self._update_superelements()
        if self._stale >= 0 or self._refactorisation_pays(changed, new):
            self._factorise(changed)
            changed = changed[:0]
        right = np.take(np.atleast_2d(force), self.active_dofs, axis=1)
        if len(changed):
            answer = self._solve_woodbury(right.copy(), changed)
            if answer is None:
                self._factorise(changed)
                answer = self._solve_factorised(right)
            else:
                self.corrections += 1
        else:
            answer = self._solve_factorised(right)
        displacement = np.zeros(force.shape)
        displacement[..., self.active_dofs] = answer.reshape(*force.shape[:-1], -1)
        return displacement

    def _update_superelements(self) -> None:
        """Take over the tangents of active deformable blocks; their levels are refactorised."""
        if self.superelements is None:
            return
        for d, tangent in self.superelements.tangent.items():
            if tangent is not self.superelement_stiffness[d]:
                self.superelement_stiffness[d] = tangent
                self._stale = max(self._stale, int(self.superelement_level[d]))

    def _refactorisation_pays(self, changed: IntArray, new: int) -> bool:
        """Whether all corrections since the last factorisation, with this one, cost more than the next factorisation.

        Number and size of later changes are unknown; this rule (ski rental) costs at most twice the best in hindsight.
        """
        if not len(changed):
            return False
        if self._known + new > self.options.max_changed_interfaces:
            return True
        size = int(self.start[self.active_levels])
        self._correction_cost += correction_cost(len(changed), new, size, self._squares, self.options)
        return self._correction_cost > self._factorisation_cost[int(self.interface_level[changed].max()) + 1]

    def _factorise(self, changed: IntArray) -> None:
        farthest = max(int(self.interface_level[changed].max(initial=-1)), self._stale)
        self.stiffness[self.active] = self.wanted[self.active]
        self._forget_changes()
        self._stale = -1
        if farthest < 0:
            return
        self.factorisations += 1
        # a changed interface may be a bridge to the next level
        last = self.first_bridge[farthest + 1]
        assemble_couplings(
            self.bridges[:last], self.far_is_b[:last], self.kinematics, self.stiffness, self.up[:last], self.down[:last]
        )
        # Schur complements inherit symmetry from farther levels
        skew = max(farthest_unsymmetric(self.active, self.interface_level, self.stiffness), self._farthest_yielding())
        for k in range(farthest, -1, -1):
            self._eliminate(k, symmetric=k > skew)

    def _farthest_yielding(self) -> int:
        """Return the farthest level of a deformable block that yields; -1 if none does."""
        if self.superelements is None:
            return -1
        return max((int(self.superelement_level[d]) for d in self.superelements.tangent), default=-1)

    def _eliminate(self, k: int, regularised: bool = True, symmetric: bool = True) -> bool:
        if self.size[k] == 0:
            if k > 0:
                self._condensed[k - 1][:] = 0.0
            return True
        matrix = self._within(k, self.stiffness if regularised else self.elastic)
        if regularised:
            matrix.ravel()[:: len(matrix) + 1] += self._regularisation[k]
        if k + 1 < self.levels:
            matrix -= self._condensed[k]
        smallest = invert(matrix, symmetric, self._inverse(k), self.options.inversion_panel)
        if not regularised and smallest < self.options.singular_pivot_ratio:
            return False
        if k > 0:
            work = np.empty((self.size[k - 1], self.size[k]))
            listed = (self.first_bridge[k], self.first_bridge[k + 1])
            schur_complement(
                listed, self.at_far, self.at_near, self.up, self.down, self._inverse(k), work, self._condensed[k - 1]
            )
        return True

    def _solve_factorised(self, force: FloatArray, farthest: int | None = None) -> FloatArray:
        farthest = self.active_levels - 1 if farthest is None else farthest
        levels = self._levels_up_to(self.active_levels)
        solve_rows(*levels, self.up, self.down, farthest, force, np.zeros_like(force))
        return force

    def _forget_changes(self) -> None:
        self._slot = np.full(len(self.interface_level), -1, dtype=np.int64)
        self._known, self._correction_cost = 0, 0.0
        self._squares = float(self.at_inverse[self.active_levels])

    def _add_unit_load_responses(self, new: IntArray) -> None:
        """Compute the response of the factorised system to unit forces in some interfaces, and its compliance."""
        known, now = self._known, self._known + len(new)
        farthest, reached = int(self.interface_level[new].max()), self._unit_load_response[3 * known : 3 * now]
        force = np.zeros((self._unit_load_response.shape[1], 3 * len(new)))
        unit_loads(new, self.kinematics, self.order, force)
        if 3 * len(new) <= ELIMINATION.max_loop_rows:
            reached[:] = force.T
            self._solve_factorised(reached, farthest)
        else:
            levels = self._levels_up_to(self.active_levels)
            solve_columns(*levels, self.up, self.down, farthest, force, np.empty_like(force))
            reached[:] = force.T
        self._listed[known:now] = new
        self._slot[new] = np.arange(known, now)
        all_known = self._listed[:now]
        right = np.empty((3 * now, 3 * len(new)))
        relative_displacements(
            all_known, self.kinematics, self.order, self._unit_load_response[3 * known : 3 * now], right
        )
        self._compliance[: 3 * now, 3 * known : 3 * now] = right
        if known:
            below = np.empty((3 * len(new), 3 * known))
            relative_displacements(new, self.kinematics, self.order, self._unit_load_response[: 3 * known], below)
            self._compliance[3 * known : 3 * now, : 3 * known] = below
        self._known = now

    def _solve_woodbury(self, force: FloatArray, changed: IntArray) -> FloatArray | None:
        """Solve by the Woodbury identity for changed interfaces; None if the correction is too inaccurate."""
        new = changed[self._slot[changed] < 0]
        if len(new):
            self._add_unit_load_responses(new)
        slots = self._slot[changed]
        change = self.wanted[changed] - self.stiffness[changed]
        rows, matrix = capacitance_matrix(self._compliance, slots, change)
        answer = self._solve_factorised(force)
        moved = np.empty((3 * len(changed), len(force)))
        relative_displacements(changed, self.kinematics, self.order, answer, moved)
        made = np.empty((len(force), len(rows)))
        correction_forces(rows, change, moved, made)
        # LAPACK is column-major: to it the transposed matrix is the matrix
        _, _, forces, singular = lapack.dgesv(matrix.T, made.T, overwrite_a=1, overwrite_b=1)
        if singular:
            return None
        forces = forces.T
        subtract_correction(forces, rows, slots, self._unit_load_response, answer)
        relative_displacements(changed, self.kinematics, self.order, answer, moved)
        accurate = correction_agrees(rows, change, moved, forces, self.options.woodbury_tolerance)
        return answer if accurate else None


def factorisation_cost(size: IntArray, options: LinearSystemOptions = DEFAULTS) -> FloatArray:
    """Return the cost of the elimination of each level (weighted operations).

    An inversion takes n^3 operations, the Schur complement about 25 n^2: a block has two bridges of 9 entries.

    Parameters
    ----------
    size : array of int (levels,)
        Degrees of freedom n of each level.
    options : LinearSystemOptions
        Weights.
    """
    size = size.astype(np.float64)
    dense, sparse = options.inversion_weight * size**3, options.elimination_weight * 25.0 * size**2
    return 2.0 * options.call_overhead + dense + sparse


def correction_cost(
    changed: int, new: int, size: int, squares: float, options: LinearSystemOptions = DEFAULTS
) -> float:
    """Return the cost of a Woodbury correction (weighted operations).

    Parameters
    ----------
    changed, new : int
        Changed interfaces, two correction forces p each, and those of them without unit-load responses: three
        solutions each.
    size : int
        Active degrees of freedom.
    squares : float
        Sum of the squares of the sizes of the active levels: a solution takes 4 operations for each.
    options : LinearSystemOptions
        Weights.
    """
    forces = 2.0 * changed
    responses = options.call_overhead * (new > 0) + options.product_weight * 12.0 * new * squares
    solution = options.solution_weight * 2.0 / 3.0 * forces**3
    return solution + options.vector_weight * (5.0 * forces**2 + 2.0 * forces * size) + responses


def block_levels(system: DiscreteSystem) -> IntArray:
    """Return the level of each block and of the ground (n + 1,): its distance from ground and supports, in joints.

    Blocks without a connection to them are in the farthest level.
    """
    model, n = system.model, system.model.n_blocks
    a, b = model.interfaces.block_a, model.interfaces.block_b
    holds = ~model.guides  # distance from fully supported blocks
    # a footing is one level, wherever it is supported
    footing = np.empty(0, dtype=np.int64) if model.footing is None else model.footing
    start, end = np.append(a[holds], np.full(len(footing), n)), np.append(b[holds], footing)
    # dependent degrees of freedom are not prescribed
    constrained = np.setdiff1d(system.constrained_dofs, system.dependent_dofs)
    blocks, ways = np.unique(system.block_of_dof[constrained], return_counts=True)
    roots = blocks[ways >= 3]
    if len(roots) == 1 and not len(footing) and not ((a == n) | (b == n)).any():
        roots = blocks
    away = joints_away(start, end, n + 1, roots)
    # ground and supports are no level of their own: blocks that touch them are level 0
    levels = np.maximum(away - 1, 0)
    return np.where(away < 0, levels.max(), levels)
