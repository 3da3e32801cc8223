"""Tangent equations of a wall: block tridiagonal factorisation, with Woodbury corrections for few changes.

Most Newton iterations change a few interfaces only. Then the last factorisation is corrected by the Woodbury identity.
Levels that stay elastic are statically condensed to a superelement on the boundary level once.
"""

from __future__ import annotations

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.kernels.linear.assembly import copy_rows
from damagepred.kernels.linear.woodbury import changed_interfaces
from damagepred.solvers.quasi_static.block_tridiagonal import BlockTridiagonalFactors
from damagepred.solvers.quasi_static.level_layout import LevelLayout
from damagepred.solvers.quasi_static.options import LinearSystemOptions
from damagepred.solvers.quasi_static.refactorisation import RefactorisationRule
from damagepred.solvers.quasi_static.static_condensation import StaticCondensation
from damagepred.solvers.quasi_static.superelements import Superelements
from damagepred.solvers.quasi_static.woodbury_correction import WoodburyCorrection
from damagepred.solvers.system.discrete_system import DiscreteSystem

DEFAULTS = LinearSystemOptions()


class BlockTridiagonalSystem:
    """Tangent stiffness of a wall, factorised or corrected.

    Parameters
    ----------
    system : DiscreteSystem
        Of n blocks and m interfaces.
    elastic : array (m, 9)
        Stiffness of the interfaces while nothing is cracked or slides; see ``joint_forces``.
    superelements : Superelements, optional
        The deformable blocks; their interior degrees of freedom are condensed.
    options : LinearSystemOptions, optional
        Tolerances and costs.

    Attributes
    ----------
    condensation : StaticCondensation or None
        Superelement of the condensed levels; None if all levels are active.
    active, condensed_interfaces : array of int
        Interfaces of active and of condensed levels.
    active_dofs : array of int
        Free degrees of freedom of active levels, in the order of the levels.
    """

    def __init__(
        self,
        system: DiscreteSystem,
        elastic: FloatArray,
        superelements: Superelements | None = None,
        options: LinearSystemOptions = DEFAULTS,
    ) -> None:
        self.model, self.options = system.model, options
        self.layout = LevelLayout(system, superelements)
        self.factors = BlockTridiagonalFactors(system, self.layout, elastic, superelements, options)
        self.refactorisation = RefactorisationRule(self.layout.size, options)
        self.target_stiffness = elastic.copy()
        self.factorisations = self.corrections = 0
        self._changed = np.empty(len(elastic), dtype=np.int64)  # scratch
        self.set_active_levels(self.layout.levels)

    def set_active_levels(self, active_levels: int) -> None:
        """Set the number of active levels; see ``condense`` for those beyond."""
        at = self.layout
        self.active_levels = active_levels
        self.condensation: StaticCondensation | None = None
        self.active = np.flatnonzero(at.interface_level < active_levels)
        self.condensed_interfaces = np.flatnonzero(at.interface_level >= active_levels)
        self.active_dofs = at.dofs[: at.start[active_levels]]
        self.woodbury = WoodburyCorrection(self.factors, active_levels)
        self.refactorisation.spent = 0.0
        self._farthest_changed_level = active_levels - 1

    def condense(
        self, active_levels: int, load: FloatArray, live_load: FloatArray | None = None
    ) -> StaticCondensation | None:
        """Condense all levels from ``active_levels`` on, elastic; make all active if these do not hold them.

        Parameters
        ----------
        active_levels : int
            Number of active levels, from the ground on.
        load, live_load : array (size,)
            Dead and live load at load factor 1 (N, N m); None: no live load.
        """
        active_levels, levels = int(self.layout.whole_blocks[active_levels]), self.layout.levels
        factors, held = self.factors, active_levels < levels
        if active_levels < self.active_levels:
            condensed = self.layout.interface_level >= active_levels
            self.target_stiffness[condensed] = factors.elastic[condensed]
            held = factors.eliminate_elastic(active_levels)
        self.set_active_levels(active_levels if held else levels)
        if held:
            self.condensation = StaticCondensation(factors, active_levels, load, live_load)
        return self.condensation

    def update(self, stiffness: FloatArray) -> None:
        """Set the stiffness of the interfaces for the next ``solve``.

        Parameters
        ----------
        stiffness : array (m, 9)
            See ``joint_forces``; only active interfaces count.
        """
        copy_rows(self.active, stiffness, self.target_stiffness)

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
        factors, woodbury = self.factors, self.woodbury
        count, new, farthest = changed_interfaces(
            self.active,
            self.target_stiffness,
            factors.stiffness,
            woodbury.slot,
            self.layout.interface_level,
            self._changed,
        )
        changed = self._changed[:count]
        self._farthest_changed_level = max(self._farthest_changed_level, factors.update_superelements())
        if self._farthest_changed_level >= 0 or self._refactorisation_pays(count, new, farthest):
            self._factorise(changed)
            count = 0
        right = np.take(force.reshape(-1, force.shape[-1]), self.active_dofs, axis=1)
        u = woodbury.solve(right.copy(), changed, self.target_stiffness) if count else None
        if u is not None:
            self.corrections += 1
        else:
            if count:
                self._factorise(changed)
            u = factors.solve(right, self.active_levels, self.active_levels - 1)
        displacement = np.zeros(force.shape)
        displacement[..., self.active_dofs] = u.reshape(*force.shape[:-1], -1)
        return displacement

    def _refactorisation_pays(self, changed: int, new: int, farthest: int) -> bool:
        """Return whether the changes exceed the memory for them, or all corrections cost more than a factorisation."""
        if not changed:
            return False
        if self.woodbury.occupied + new > self.options.max_changed_interfaces:
            return True
        rule = self.refactorisation
        rule.spent += rule.correction_cost(changed, new, self.active_levels)
        return bool(rule.spent > rule.factorisation_cost[farthest + 1])

    def _factorise(self, changed: IntArray) -> None:
        farthest = max(int(self.layout.interface_level[changed].max(initial=-1)), self._farthest_changed_level)
        self.factors.set_stiffness(changed, self.target_stiffness)
        self.woodbury.discard_responses()
        self.refactorisation.spent = 0.0
        self._farthest_changed_level = -1
        if farthest < 0:
            return
        self.factorisations += 1
        self.factors.refactorise(farthest, self.active)
