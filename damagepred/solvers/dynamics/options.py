"""Tolerances, budgets and factors of runs in physical time."""

from __future__ import annotations

from pydantic import Field

from damagepred.scene.described import described
from damagepred.scene.quantity import Count, Pure


@described
class DynamicsOptions:
    """Contact search, contact geometry, time step and divergence of runs in physical time.

    Attributes
    ----------
    skin : float
        Distance within which blocks are neighbours of a point, over the size of the smallest block (1).
    search_distance : float
        Movement of a point that triggers the next search, over that distance (1). Below one half, two points that
        approach each other have not met before.
    wide_block_ratio : float
        Width over the median from which a block is a candidate for every point (1).
    point_steps_per_check : int
        Points times steps between two checks for an interruption and for finite displacements.
    """

    skin: Pure = Field(default=0.1, gt=0)
    search_distance: Pure = Field(default=0.4, gt=0, lt=0.5)
    wide_block_ratio: Pure = Field(default=4.0, ge=1)
    point_steps_per_check: Count = Field(default=5_000_000, ge=1)


DEFAULTS = DynamicsOptions()
