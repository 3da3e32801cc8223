"""Static condensation (Guyan 1965) of subtrees that stay elastic, to superelements on their boundaries."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.kernels.linear.condensation import Condensation, condense_forces, elastic_energy

if TYPE_CHECKING:
    from damagepred.solvers.quasi_static.linear_system import MultifrontalSystem


class StaticCondensation:
    """Superelements of the condensed subtrees; they act on ``boundary_dofs`` of active fronts."""

    def __init__(self, equations: MultifrontalSystem, load: FloatArray, live_load: FloatArray | None) -> None:
        tree, active, substitution = equations.tree, equations.active.fronts, equations.condensed_substitution()
        # dead and live load, eliminated from the condensed fronts up to their boundaries
        loads = np.stack([load, np.zeros_like(load) if live_load is None else live_load])
        reduced, particular = np.ascontiguousarray(loads[:, tree.dofs]), np.empty((2, len(tree.dofs)))
        equations.reached[:] = True
        condense_forces(substitution, reduced, particular)
        condensed = tree.dofs[np.repeat(~active, tree.size)]
        # a superelement for each condensed front with an active parent; places in the order of the fronts
        roots = np.flatnonzero(~active & np.append(active, False)[tree.parent])
        places = tree.boundary[np.repeat(np.isin(np.arange(tree.count), roots), tree.boundary_size)]
        boundary = np.unique(places)
        self.boundary_dofs = tree.dofs[boundary]
        self._load = reduced[:, boundary] - loads[:, self.boundary_dofs]
        ends, complements = np.cumsum(tree.boundary_size**2), equations.elastic_complements
        squares = [complements[ends[k] - tree.boundary_size[k] ** 2 : ends[k]] for k in roots]
        self.structure = Condensation(
            substitution=substitution,
            boundary_dofs=tree.dofs[places],
            first_boundary=np.concatenate(([0], np.cumsum(tree.boundary_size[roots]))),
            stiffness=np.concatenate([np.empty(0), *squares]),
            boundary=np.empty((2, len(places))),
            dofs=tree.dofs,
            particular=particular,
            particular_in_state=np.empty((1, len(tree.dofs))),
            current=np.empty((1, len(tree.dofs))),
            loaded_dofs=np.concatenate((condensed, self.boundary_dofs)),
            loads=np.ascontiguousarray(np.concatenate((loads[:, condensed], -self._load), axis=1)),
        )

    def load(self, load: float, live: float) -> FloatArray:
        """Load on ``boundary_dofs`` from condensed subtrees (N, N m), at factors of dead and live load."""
        return load * self._load[0] + live * self._load[1]

    def elastic_energy(self, displacement: FloatArray, load: float, live: float) -> float:
        """Energy stored in the condensed subtrees (J)."""
        return float(elastic_energy(self.structure, displacement, float(load), float(live)))
