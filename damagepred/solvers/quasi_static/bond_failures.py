"""Failure of bonds: which fail together, what their failure changes, and where on the path each has failed.

Whether a bond is overloaded: ``Continuation._end_step`` and ``_redistribute_failures``, with ``bond_loads``
(kernels/interface/checks).
"""

from __future__ import annotations

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.kernels.equilibrium.predictor import EVENT_TOLERANCE, OVERLOAD_TOLERANCE, WEAK_BOND_OVERLOAD
from damagepred.kernels.interface.commit import break_in_shear
from damagepred.solvers.state.wall_state import JointHistory, State

SIMULTANEOUS_FAILURES = 1e-4
"""Bonds whose load is within this share of the largest fail together (1)."""
WEAK_BOND_GROUP = 0.5
"""Share of the largest overload from which weak bonds fail with the most overloaded one (1)."""


class BondFailures:
    """Bonds of one wall, and the load factor at which each has failed."""

    def __init__(self, model: Model, history: JointHistory) -> None:
        law = model.properties
        weak = self.weak = (law.tensile_strength < model.block_stress) & ~law.brittle_shear
        # contacts (m, q) that began with a bond; contacts that began without one and have stayed closed
        self.bonded, self.never_opened = ~history.cracked, history.cracked.copy()
        self.broken_at = np.full(history.cracked.shape, np.nan)  # load factor at failure, NaN for bonds that hold
        has_bond = self.bonded.any(axis=1)
        self.any_weak, self.all_weak = bool(weak.any()), bool(has_bond.any() and weak[has_bond].all())
        self.event_overload = np.where(weak[:, None], WEAK_BOND_OVERLOAD, EVENT_TOLERANCE)
        self._residual_strength, self._normal_stiffness = law.residual_tensile_strength, law.normal_stiffness
        self._recloses = ((law.residual_tensile_strength > 0) & (law.critical_opening == 0))[:, None]
        plain = (law.residual_tensile_strength == 0) & (law.critical_opening == 0)
        self._dilates = ((law.dilation > 0) & plain)[:, None]
        self._fails_in_shear = (law.brittle_shear & (law.critical_opening > 0))[:, None]
        softens, kappa_0 = law.critical_opening > 0, law.tensile_strength / law.normal_stiffness
        area = model.interfaces.contact_area[softens]
        self._softens, self._kappa_0 = softens, kappa_0[softens, None]
        self._share_per_opening = area / (area.sum(axis=1) * (law.critical_opening - kappa_0)[softens])[:, None]
        self._longest = (law.critical_opening - kappa_0)[softens, None]
        self.can_reclose = bool(self._recloses.any())
        self.fail_in_shear = bool(self._fails_in_shear.any())
        self.depend_on_stress = self.fail_in_shear or bool(self._dilates.any())

    def __copy__(self) -> BondFailures:
        """Copy with its own ``never_opened``; ``broken_at`` is replaced as a whole when bonds fail."""
        other = object.__new__(BondFailures)
        other.__dict__.update(self.__dict__, never_opened=self.never_opened.copy())
        return other

    def fail_together(self, load: FloatArray, heaviest: float, cracked: BoolArray) -> BoolArray:
        """Mask (m, q) of the bonds that fail with the most loaded one: as loaded, or weak and overloaded."""
        broken = load >= heaviest * (1.0 - SIMULTANEOUS_FAILURES)
        if self.any_weak:
            group = WEAK_BOND_GROUP * (heaviest - 1.0)
            weak = np.flatnonzero((load > 1.0 + OVERLOAD_TOLERANCE) & (load >= 1.0 + group))
            weak = weak[self.weak[weak // load.shape[1]] & ~cracked[weak]]
            broken.ravel()[weak] = True
        return broken

    def wear(self, model: Model, broken: BoolArray, sigma: FloatArray, history: JointHistory) -> float:
        """End dilatancy of broken bonds that open, and the integrity of bonds broken by slip; dissipated work (J)."""
        history.kappa[broken & self._dilates & (sigma > 0.0)] = np.inf  # open: no more dilatancy
        sheared = broken & self._fails_in_shear
        return float(break_in_shear(sheared, model.interface_records, history))

    def damage(self, history: JointHistory) -> float:
        """Softened joints (1): sum of the shares of the critical opening that they have reached."""
        if not self._kappa_0.size:
            return 0.0
        beyond = np.clip(history.kappa[self._softens] - self._kappa_0, 0.0, self._longest)
        return float((beyond * self._share_per_opening).sum())

    def record(self, state: State, bonds: IntArray | None = None) -> None:
        """Record the load factor at which bonds (flat indices; by default all) failed since the last call."""
        listed = np.flatnonzero(state.history.cracked) if bonds is None else bonds
        self.broken_at = self.broken_at.copy()  # who keeps an earlier point of the path keeps the array
        broken_at = self.broken_at.ravel()
        broken_at[listed[self.bonded.ravel()[listed] & np.isnan(broken_at[listed])]] = state.load_factor

    def reclose(self, history: JointHistory, opening: FloatArray, except_for: BoolArray) -> bool:
        """Re-close cracked joints whose trial stress is within their residual strength; whether any does."""
        stress = self._normal_stiffness[:, None] * (opening - history.dilatant_opening)
        recloses = self._recloses & (history.kappa > 0) & (stress <= self._residual_strength[:, None])
        recloses &= ~except_for
        history.kappa[recloses] = 0.0  # a brittle bond that touches, see ``normal_law``
        return bool(recloses.any())
