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
    edge_overrun : float
        Distance by which a point may pass the end of its edge, over its tributary length (1).
    release_opening : float
        Opening at which a point with a broken bond leaves its first edge, over its tributary length (1).
    facing_cosine : float
        Least cosine of the angle between two faces in contact (1); 0.1 is 84 degrees.
    continuation_cosine : float
        Least cosine of the angle between two edges for which pressure and friction pass to the next edge (1).
    max_cells : int
        Cells of points on a stretch of a face without joint.
    eigenvalue_tolerance : float
        Relative accuracy of the highest eigenvalue, which is added to it (1).
    dense_eigenvalues : int
        Degrees of freedom up to which all eigenvalues are computed.
    point_steps_per_check : int
        Points times steps between two checks for an interruption and for finite displacements.
    outputs_at_rest : int
        Outputs in a row with a speed below ``dynamics.rest_speed`` that end a run.
    divergence_energy_ratio : float
        Energy over initial energy and input from which a run has diverged (1).
    divergence_energy_error : float
        Created energy over the largest energy from which a run has diverged (1); the longest permitted steps create
        some where blocks bounce without damping.
    """

    skin: Pure = Field(default=0.1, gt=0)
    search_distance: Pure = Field(default=0.4, gt=0, lt=0.5)
    wide_block_ratio: Pure = Field(default=4.0, ge=1)
    edge_overrun: Pure = Field(default=0.02, ge=0)
    release_opening: Pure = Field(default=0.1, ge=0)
    facing_cosine: Pure = Field(default=0.1, ge=0, lt=1)
    continuation_cosine: Pure = Field(default=0.7, ge=0, lt=1)
    max_cells: Count = Field(default=100, ge=1)
    eigenvalue_tolerance: Pure = Field(default=1e-3, gt=0)
    dense_eigenvalues: Count = Field(default=60, ge=2)
    point_steps_per_check: Count = Field(default=5_000_000, ge=1)
    outputs_at_rest: Count = Field(default=3, ge=1)
    divergence_energy_ratio: Pure = Field(default=10.0, gt=1)
    divergence_energy_error: Pure = Field(default=0.5, gt=0)


DEFAULTS = DynamicsOptions()
