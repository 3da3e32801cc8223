"""Linear equations of a wall, solved level by level, and corrected for the few joints that have changed since.

Blocks that touch the ground or a support are level 0, their neighbours level 1, and so on; a joint lies within a level
or between neighbouring ones. The stiffness is then block tridiagonal and is eliminated from the farthest level down to
the ground. A change of stiffness in one level leaves all that is farther from the ground as it was: elimination
restarts there. For a wall that separates along its damp-proof course, all above it is eliminated once.

Most steps change a few joints only. Then nothing is eliminated anew: the answer of the wall as it was factorised last
is corrected by the forces that the change makes in these joints (Sherman, Morrison and Woodbury).
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.errors import InputError
from damagepred.kernels.linear.block_tridiagonal import (
    FEW,
    assemble_couplings,
    assemble_level,
    back_substitution,
    capacitance_matrix,
    changed_interfaces,
    copy_rows,
    correction_agrees,
    correction_forces,
    farthest_unsymmetric,
    forward_elimination,
    relative_displacements,
    schur_complement,
    solve_columns,
    solve_rows,
    subtract_correction,
    unit_loads,
)
from damagepred.kernels.linear.neighbours import joints_away
from damagepred.solvers.quasi_static.dense_inverse import invert
from damagepred.solvers.quasi_static.interface_kinematics import interface_kinematics
from damagepred.solvers.quasi_static.superelements import Solids
from damagepred.solvers.system.deformable_blocks import idle_dofs
from damagepred.solvers.system.elastic_stiffness import block_of_dof

ANCHOR = 1e-7
"""Share of the elastic stiffness that holds every degree of freedom where it is, so that loose blocks do not vanish."""
NOT_HELD = 1e-12
"""Smallest pivot over the largest below which what is condensed counts as not held."""
SLACK = 1e-12
"""Shear stiffness over normal stiffness up to which a joint guides but does not hold."""
MOST_MEMORY = 6.0
"""For two dense matrices of each level (GB)."""
CHANGED = 100
"""Joints that may have changed since the last factorisation, before it is done again: there is memory for so many."""
FAITHFUL = 1e-6
"""Share to which forces of a correction must agree with the displacements that it ends in."""


class BlockTridiagonalSystem:
    """Stiffness of a wall, factorised.

    Parameters
    ----------
    model : Model
        n blocks, m interfaces.
    held : array of int
        Degrees of freedom that do not move freely.
    elastic : array (m, 9)
        Stiffness of the interfaces while nothing is cracked or slides; see ``joint_forces``.
    solids : Solids, optional
        The deformable blocks; what lies inside them is condensed.
    """

    def __init__(self, model: Model, held: IntArray, elastic: FloatArray, solids: Solids | None = None) -> None:
        self.model, self.elastic, self.solids = model, elastic, solids
        self.kinematics = interface_kinematics(model)
        self.level = block_levels(model, held)
        free = np.ones(model.size, dtype=np.bool_)
        free[held] = False
        level_of = np.repeat(self.level, 3)
        if solids is not None:
            free[solids.inside] = False
            level_of = self.level[solids.block_of_dof]
        self.level_of = level_of
        dofs = np.flatnonzero(free)
        self.dofs = dofs[np.lexsort((dofs, level_of[dofs]))]
        self.levels = int(self.level.max()) + 1
        self.size = np.bincount(level_of[self.dofs], minlength=self.levels).astype(np.int64)
        self.start = np.concatenate(([0], np.cumsum(self.size)))
        self.place = np.full(model.size, -1, dtype=np.int64)
        self.place[self.dofs] = np.arange(len(self.dofs)) - self.start[level_of[self.dofs]]
        self.at_inverse = np.concatenate(([0], np.cumsum(self.size**2)))
        if (needed := 16e-9 * float(self.at_inverse[-1])) > MOST_MEMORY:
            raise InputError(
                f"the quasi-static solver would need {needed:.0f} GB for its matrices, and takes {MOST_MEMORY:g} GB at "
                f"most; take a larger solver.zone_size, cut fewer blocks, or take method = 'explicit'."
            )
        self.inverses = np.zeros(self.at_inverse[-1])
        self._list_interfaces()
        self._list_solids()
        self.stiffness = elastic.copy()  # as it is factorised
        self.wanted = elastic.copy()
        side = self.at_far.shape[1]
        self.up = np.zeros((len(self.bridges), side, side))
        self.down = np.zeros((len(self.bridges), side, side))
        self._condensed = [np.zeros((s, s)) for s in self.size]
        own = [self._within(k, elastic).diagonal() for k in range(self.levels)]
        # a block that nothing joins stays where it is
        usual = max((float(values.max(initial=0.0)) for values in own), default=0.0) or 1.0
        self._regularisation = [ANCHOR * np.where(values > 0.0, values, usual) for values in own]
        self.factorisations = self.corrections = 0
        self._factorisation_cost = np.concatenate(([0.0], np.cumsum(factorisation_cost(self.size))))
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
        self._reaching = [order[edges[k] : edges[k + 1]] for k in range(self.levels)]

    def _list_solids(self) -> None:
        """Sort the deformable blocks by level: where their degrees of freedom are in it."""
        self._solids: list[list[tuple[int, IntArray, IntArray]]] = [[] for _ in range(self.levels)]
        self.solid_level = np.empty(0, dtype=np.int64)
        if self.solids is None:
            return
        self.solid_level = self.level[self.solids.block]
        for d, k in enumerate(self.solid_level):
            place = self.place[self.solids.rim[d]]
            free = np.flatnonzero(place >= 0)
            self._solids[k].append((d, free, place[free]))
        self.solid_stiffness = list(self.solids.elastic)  # as it is factorised

    def _bridges(self, k: int) -> IntArray:
        """Return the interfaces between levels k and k - 1."""
        return self.bridges[self.first_bridge[k] : self.first_bridge[k + 1]]

    def _within(self, k: int, stiffness: FloatArray) -> FloatArray:
        """Return the stiffness within a level, transposed, the displacements of all others held."""
        matrix = np.zeros((self.size[k], self.size[k]))
        listed = self._reaching[k]
        if k + 1 < self.levels:
            listed = np.concatenate((listed, self._bridges(k + 1)))
        assemble_level(listed, self.kinematics, stiffness, self.place, self.level_of, k, matrix)
        elastic = stiffness is self.elastic
        for d, own, place in self._solids[k]:
            solid = self.solids.elastic[d] if elastic else self.solid_stiffness[d]  # type: ignore[union-attr]
            matrix[place[:, None], place] += solid.T if len(own) == len(solid) else solid[own[:, None], own].T
        return matrix

    def _inverse(self, k: int) -> FloatArray:
        size = self.size[k]
        return self.inverses[self.at_inverse[k] : self.at_inverse[k + 1]].reshape(size, size)

    # -- what is in play ------------------------------------------------------------------------------------------

    def set_active_levels(self, active_levels: int) -> None:
        """Look at the levels up to one joint by joint; see ``condense`` for what becomes of those beyond."""
        self.active_levels = active_levels
        self.active = np.flatnonzero(self.interface_level < active_levels)
        self.beyond = np.flatnonzero(self.interface_level >= active_levels)
        end = self.start[active_levels]
        self.order = np.full(self.place.size, -1, dtype=np.int64)
        self.order[self.dofs[:end]] = np.arange(end)
        self.active_dofs = self.dofs[:end]
        self._listed = np.empty(CHANGED, dtype=np.int64)
        self._unit_load_response = np.empty((3 * CHANGED, int(end)))
        self._compliance = np.empty((3 * CHANGED, 3 * CHANGED))
        self._forget_changes()
        self._stale = active_levels - 1

    def condense(self, active_levels: int, load: FloatArray, live_load: FloatArray | None = None) -> bool:
        """Take all levels from ``active_levels`` on as elastic, and replace them by what they do to the level before.

        Parameters
        ----------
        active_levels : int
            Number of levels, from the ground on, that are looked at joint by joint.
        load, live_load : array (3 (n + 1),)
            Dead and live load in full; None: there is no live load.

        Returns
        -------
        bool
            Whether it can be done: what is beyond must be held by the levels in play.
        """
        was = self.active_levels
        if active_levels >= self.levels:
            self.set_active_levels(self.levels)
            return False
        if active_levels < was:
            # without anchors, for these would hold what is condensed in space
            beyond = self.interface_level >= active_levels
            self.stiffness[beyond] = self.wanted[beyond] = self.elastic[beyond]
            assemble_couplings(self.bridges, self.far_is_b, self.kinematics, self.elastic, self.up, self.down)
            for k in range(self.levels - 1, active_levels - 1, -1):
                if not self._eliminate(k, regularised=False):
                    self.set_active_levels(self.levels)
                    return False
        self.set_active_levels(active_levels)
        loads = np.stack([load, np.zeros_like(load) if live_load is None else live_load])
        weight = np.ascontiguousarray(loads[:, self.dofs])
        self._particular = np.zeros(weight.shape)
        forward_elimination(
            self.start,
            self.inverses,
            self.at_inverse,
            self.first_bridge,
            self.at_far,
            self.at_near,
            self.up,
            active_levels,
            weight,
            self._particular,
        )
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
        """Return what comes down from the condensed levels on the last one in play: shares of dead and live load."""
        return load * self._condensed_load[0] + live * self._condensed_load[1]

    def condensed_force(self, displacement: FloatArray, load: float, live: float = 0.0) -> FloatArray:
        """Return the force of the condensed levels on the last level in play, under shares of dead and live load."""
        return self.condensed_load(load, live) - self._condensed_stiffness @ displacement[self.boundary_dofs]

    def condensed_load_work(self, displacement: FloatArray, load: float, live: float) -> float:
        """Return force times displacement (J) of the loads on the condensed levels."""
        moved = displacement[self.dofs[self.start[self.active_levels] :]]
        return load * float(self._load_on_condensed[0] @ moved) + live * float(self._load_on_condensed[1] @ moved)

    def recover(self, displacement: FloatArray, load: float, live: float = 0.0) -> None:
        """Fill in the displacements of the condensed levels, from the last level in play outwards."""
        if self.active_levels == self.levels:
            return
        moved = displacement[self.dofs]
        particular = load * self._particular[0] + live * self._particular[1]
        back_substitution(
            self.start,
            self.inverses,
            self.at_inverse,
            self.first_bridge,
            self.at_far,
            self.at_near,
            self.down,
            self.active_levels,
            1.0,
            particular[None],
            moved[None],
        )
        displacement[self.dofs] = moved

    # -- factorising and solving ------------------------------------------------------------------------------------

    def update(self, stiffness: FloatArray) -> None:
        """Take over the stiffness of the interfaces; ``solve`` then answers for it.

        Parameters
        ----------
        stiffness : array (m, 9)
            See ``joint_forces``; only interfaces in play count.
        """
        copy_rows(self.active, stiffness, self.wanted)

    def solve(self, force: FloatArray) -> FloatArray:
        """Return the displacements of all degrees of freedom under forces.

        Parameters
        ----------
        force : array (size,) or (r, size)
            One, or one in each row.

        Returns
        -------
        array
            Of the same shape; 0 where held or condensed.
        """
        changed, new = changed_interfaces(self.active, self.wanted, self.stiffness, self._slot)
        self._take_solids()
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

    def _take_solids(self) -> None:
        """Take over the stiffness of the deformable blocks that yield: their levels are factorised anew."""
        if self.solids is None:
            return
        for d, tangent in self.solids.tangent.items():
            if tangent is not self.solid_stiffness[d]:
                self.solid_stiffness[d] = tangent
                self._stale = max(self._stale, int(self.solid_level[d]))

    def _refactorisation_pays(self, changed: IntArray, new: int) -> bool:
        """Tell whether all corrections since the last factorisation, with this one, take longer than another one.

        What is to come is not known: to rent until the rent would have paid the price is never worse than twice the
        best that could have been done, whatever comes.
        """
        if not len(changed):
            return False
        if self._known + new > CHANGED:
            return True
        self._correction_cost += correction_cost(len(changed), new, int(self.start[self.active_levels]), self._squares)
        return self._correction_cost > self._factorisation_cost[int(self.interface_level[changed].max()) + 1]

    def _factorise(self, changed: IntArray) -> None:
        farthest = max(int(self.interface_level[changed].max(initial=-1)), self._stale)
        self.stiffness[self.active] = self.wanted[self.active]
        self._forget_changes()
        self._stale = -1
        if farthest < 0:
            return
        self.factorisations += 1
        # an interface that changed may be a bridge to the level before
        last = self.first_bridge[farthest + 1]
        assemble_couplings(
            self.bridges[:last], self.far_is_b[:last], self.kinematics, self.stiffness, self.up[:last], self.down[:last]
        )
        # what is eliminated farther from the ground hands its symmetry on
        skew = max(farthest_unsymmetric(self.active, self.interface_level, self.stiffness), self._farthest_yielding())
        for k in range(farthest, -1, -1):
            self._eliminate(k, symmetric=k > skew)

    def _farthest_yielding(self) -> int:
        """Return the farthest level of a deformable block that yields; -1 if none does."""
        if self.solids is None:
            return -1
        return max((int(self.solid_level[d]) for d in self.solids.tangent), default=-1)

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
        smallest = invert(matrix, symmetric, self._inverse(k))
        if not regularised and smallest < NOT_HELD:
            return False
        if k > 0:
            work = np.empty((self.size[k - 1], self.size[k]))
            listed = (self.first_bridge[k], self.first_bridge[k + 1])
            schur_complement(
                listed, self.at_far, self.at_near, self.up, self.down, self._inverse(k), work, self._condensed[k - 1]
            )
        return True

    def _solve_factorised(self, force: FloatArray, farthest: int | None = None) -> FloatArray:
        solve_rows(
            self.start[: self.active_levels + 1],
            self.inverses,
            self.at_inverse,
            self.first_bridge,
            self.at_far,
            self.at_near,
            self.up,
            self.down,
            self.active_levels - 1 if farthest is None else farthest,
            force,
            np.zeros_like(force),
        )
        return force

    def _forget_changes(self) -> None:
        self._slot = np.full(len(self.interface_level), -1, dtype=np.int64)
        self._known, self._correction_cost = 0, 0.0
        self._squares = float(self.at_inverse[self.active_levels])

    def _add_unit_load_responses(self, new: IntArray) -> None:
        """Find how the wall as factorised answers to unit forces in some joints."""
        known, now = self._known, self._known + len(new)
        farthest, reached = int(self.interface_level[new].max()), self._unit_load_response[3 * known : 3 * now]
        force = np.zeros((self._unit_load_response.shape[1], 3 * len(new)))
        unit_loads(new, self.kinematics, self.order, force)
        if 3 * len(new) <= FEW:
            reached[:] = force.T
            self._solve_factorised(reached, farthest)
        else:
            solve_columns(
                self.start[: self.active_levels + 1],
                self.inverses,
                self.at_inverse,
                self.first_bridge,
                self.at_far,
                self.at_near,
                self.up,
                self.down,
                farthest,
                force,
                np.empty_like(force),
            )
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
        """Solve with some joints other than they were factorised; None if that loses too much precision."""
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
        # LAPACK counts along columns: to it, what stands here transposed is the matrix itself
        _, _, forces, singular = lapack.dgesv(matrix.T, made.T, overwrite_a=1, overwrite_b=1)
        if singular:
            return None
        forces = forces.T
        subtract_correction(forces, rows, slots, self._unit_load_response, answer)
        relative_displacements(changed, self.kinematics, self.order, answer, moved)
        return answer if correction_agrees(rows, change, moved, forces, FAITHFUL) else None


def factorisation_cost(size: IntArray) -> FloatArray:
    """Return about how long it takes to eliminate levels of so many degrees of freedom (ns; only ratios count)."""
    size = size.astype(np.float64)
    return 60_000.0 + 0.5 * size**3 + 50.0 * size**2


def correction_cost(changed: int, new: int, size: int, squares: float) -> float:
    """Return about how long a correction takes.

    Parameters
    ----------
    changed, new : int
        Joints that are not as they were factorised, two forces each; and those of them that are learnt about.
    size : int
        Degrees of freedom.
    squares : float
        Sum over the levels of the squares of theirs.
    """
    forces = 2.0 * changed
    learnt = 30_000.0 * (new > 0) + 3.0 * new * 0.15 * squares
    return 0.08 * forces**3 + forces**2 + 0.4 * forces * size + learnt


def block_levels(model: Model, held: IntArray) -> IntArray:
    """Return how many joints each block (n,) is away from ground and supports; the ground itself is level 0.

    Blocks that no joint connects to them follow the farthest level by themselves.

    Parameters
    ----------
    model : Model
        The wall.
    held : array of int
        Degrees of freedom that do not move freely.
    """
    n = model.n_blocks
    a, b = model.interfaces.block_a, model.interfaces.block_b
    # from what is held altogether; what is only guided, as along an axis of symmetry, is not near the ground
    holds = model.properties.shear_stiffness > SLACK * model.properties.normal_stiffness
    # a footing is one level, whatever carries it, and where
    footing = np.empty(0, dtype=np.int64) if model.footing is None else model.footing
    start, end = np.append(a[holds], np.full(len(footing), n)), np.append(b[holds], footing)
    # what follows from others is not held
    own = np.setdiff1d(held, idle_dofs(model))
    blocks, ways = np.unique([block_of_dof(model, int(dof)) for dof in own], return_counts=True)
    roots = blocks[ways >= 3]
    if len(roots) == 1 and not len(footing) and not ((a == n) | (b == n)).any():
        roots = blocks
    away = joints_away(start, end, n + 1, roots)
    # ground and supports have no free degrees of freedom worth a level: what touches them is level 0
    levels = np.maximum(away - 1, 0)
    return np.where(away < 0, levels.max(), levels)
