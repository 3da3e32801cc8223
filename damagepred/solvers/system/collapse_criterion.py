"""Collapse criterion: a block is detached when it is farther from home than movement and elasticity take it.

Displacements are taken as small: elastic walls may go far (a tall stack is shortened by its weight by more than a
brick), and buckling of slender stacks is not modelled.
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
    """Return which blocks (n,) are detached from the wall.

    Parameters
    ----------
    model : Model
        The wall.
    displacement : array (size,)
        Of all degrees of freedom.
    load_factor : float
        Share of the full movement.
    limit : DetachmentLimit, optional
        Of the wall, where it is known.
    """
    moved = displacement[: 3 * model.n_blocks].reshape(-1, 3)
    allowed = (limit or DetachmentLimit.of(model)).at(load_factor)
    far = np.hypot(moved[:, 0], moved[:, 1])
    if not (far > allowed).any():
        return np.zeros(model.n_blocks, dtype=np.bool_)
    return np.asarray(far > allowed + 2.0 * largest_elastic_displacement(model, load_factor))


class DetachmentLimit(NamedTuple):
    """How far blocks may go from home (m) before they are detached, elastic displacement left aside.

    Attributes
    ----------
    always, with_load_factor : float
        At a standing movement, and what the full movement adds (m).
    load_factor_at : callable
        Path coordinate -> load factor of the movement.
    """

    always: float
    with_load_factor: float
    load_factor_at: Callable[[float], float]

    @classmethod
    def of(cls, model: Model) -> DetachmentLimit:
        """Return it for a wall: half the largest block that can move beyond twice what ground and supports move."""
        ground = model.ground.largest_rate()
        supports = float(np.abs(model.supports.prescribed_displacement).max(initial=0.0))
        jacks = 0.0 if model.jacks is None else abs(model.jacks.deflection)
        moves = model.moves if model.moves.any() else ~model.moves
        size = float(np.sqrt(model.blocks.area.max(where=moves, initial=0.0)))
        always = 0.5 * size + 2.0 * (_settlement(model) + model.ground.largest_standing())
        return cls(always, 2.0 * max(ground, supports, jacks), model.ground.load_factor_at)

    def at(self, coordinate: float) -> float:
        """Return it at a path coordinate."""
        return self.always + abs(self.load_factor_at(coordinate)) * self.with_load_factor


def _settlement(model: Model) -> float:
    """Return the settlement of a wall on soft ground under all dead load (m)."""
    here = model.on_ground
    if not here.any():
        return 0.0
    area = model.interfaces.contact_area[here].sum(axis=1)
    stiffness = float((model.properties.normal_stiffness[here] * area).sum())
    return abs(float(model.supports.load.reshape(-1, 3)[:, 1].sum())) / stiffness


def largest_elastic_displacement(model: Model, load_factor: float) -> float:
    """Return the largest displacement of a block of the intact wall under its loads (m); 0 if not known.

    Parameters
    ----------
    model : Model
        The wall.
    load_factor : float
        Share of the live load.
    """
    dead, live = DiscreteSystem.of(model).largest_elastic_displacements
    return dead + abs(load_factor) * live
