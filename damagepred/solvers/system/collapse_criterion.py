"""Collapse criterion: a block is detached when its displacement exceeds what movement and elasticity explain.

Displacements are small: elastic ones may be large (a tall stack shortens by more than a brick under its weight), and
buckling of slender stacks is not modelled.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray
from damagepred.assembly import Model
from damagepred.solvers.system.discrete_system import DiscreteSystem


def detached_blocks(
    model: Model, displacement: FloatArray, load_factor: float, limit: DetachmentLimit | None = None
) -> BoolArray:
    """Detached blocks (n,)."""
    moved = displacement[: 3 * model.n_blocks].reshape(-1, 3)
    allowed = (limit or DetachmentLimit.of(model)).at(load_factor)
    far = np.hypot(moved[:, 0], moved[:, 1])
    if not (far > allowed).any():
        return np.zeros(model.n_blocks, dtype=np.bool_)
    return np.asarray(far > allowed + 2.0 * largest_elastic_displacement(model, load_factor))


class DetachmentLimit(NamedTuple):
    """Largest displacement of a block that is not detached (m), without elastic displacement."""

    always: float
    with_load_factor: float  # increase at full movement
    load_factor_at: Callable[[float], float]  # path coordinate -> load factor of the movement

    @classmethod
    def of(cls, model: Model) -> DetachmentLimit:
        """Limit of a wall: half the largest free block plus twice the movement of ground and supports."""
        ground = model.ground.largest_rate()
        supports = float(np.abs(model.supports.prescribed_displacement).max(initial=0.0))
        jacks = 0.0 if model.jacks is None else abs(model.jacks.deflection)
        moves = model.moves if model.moves.any() else ~model.moves
        size = float(np.sqrt(model.blocks.area.max(where=moves, initial=0.0)))
        always = 0.5 * size + 2.0 * (_settlement(model) + model.ground.largest_standing())
        return cls(always, 2.0 * max(ground, supports, jacks), model.ground.load_factor_at)

    def at(self, coordinate: float) -> float:
        """Limit at a path coordinate."""
        return self.always + abs(self.load_factor_at(coordinate)) * self.with_load_factor


def _settlement(model: Model) -> float:
    """Settlement of a wall on soft ground under all dead load (m)."""
    on_ground = model.on_ground
    if not on_ground.any():
        return 0.0
    area = model.interfaces.contact_area[on_ground].sum(axis=1)
    stiffness = float((model.properties.normal_stiffness[on_ground] * area).sum())
    return abs(float(model.supports.load.reshape(-1, 3)[:, 1].sum())) / stiffness


def largest_elastic_displacement(model: Model, load_factor: float) -> float:
    """Largest displacement of a block of the intact wall under its loads (m); 0 if unknown."""
    dead, live = DiscreteSystem.of(model).largest_elastic_displacements
    return dead + abs(load_factor) * live
