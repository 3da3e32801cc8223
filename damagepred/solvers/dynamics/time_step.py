"""Critical time step from the highest frequency of the wall, intact or with new contacts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, eigsh

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.kernels.dynamics.contact import BONDED
from damagepred.scene import Dynamics
from damagepred.solvers.dynamics.body_arrays import BodyArrays
from damagepred.solvers.dynamics.body_motion import BlockStrains, along_and_outwards
from damagepred.solvers.system.discrete_system import DiscreteSystem

EIGENVALUE_TOLERANCE = 1e-3
"""Relative accuracy of the highest eigenvalue, which is added to it (1)."""
DENSE_EIGENVALUES = 60
"""Degrees of freedom up to which all eigenvalues are computed."""


class HighestFrequency(NamedTuple):
    """Highest angular frequencies (rad/s)."""

    intact: float  # all joints intact
    touched: float  # upper bound with new contacts


def highest_frequency(
    model: Model, scene: BodyArrays, inverse_mass: FloatArray, strains: BlockStrains | None = None
) -> HighestFrequency:
    """Highest frequency of a model, and a bound with new contacts.

    With S the stiffness of all points on a block against fixed opposite sides, the energy of a contact is at most twice
    the sum for each side alone, so omega^2 <= 2 max eig(M^-1 S) over the blocks. S is the larger of the intact
    stiffness and twice the stiffness of the block's own points (full contact on all faces).
    """
    system = DiscreteSystem.of(model)
    inverse, stiffness = np.zeros(model.size), system.elastic_stiffness
    inverse[: inverse_mass.size] = inverse_mass.ravel()
    if strains is not None:
        inverse[system.strain_dofs] = strains.inverse_mass[:-1].ravel()
    return HighestFrequency(_highest(stiffness, inverse), _touched(model, scene, inverse_mass, strains))


def _highest(stiffness: sparse.sparray, inverse_mass: FloatArray) -> float:
    """Highest angular frequency (rad/s) of a stiffness; prescribed motion has an inverse mass of 0."""
    root = np.sqrt(inverse_mass)
    free = np.flatnonzero(root > 0)
    scale = sparse.diags_array(root[free])
    matrix = (scale @ stiffness.tocsr()[free][:, free] @ scale).tocsr()
    if matrix.nnz == 0:
        return 0.0
    if len(free) <= DENSE_EIGENVALUES:
        return float(np.sqrt(np.linalg.eigvalsh(matrix.toarray())[-1]))
    # Gershgorin's circles of the scaled matrix: an upper bound
    circles = float(abs(matrix).sum(axis=1).max())
    try:
        start = np.random.default_rng(1).standard_normal(len(free))
        eigenvalues = eigsh(matrix, k=1, which="LA", tol=EIGENVALUE_TOLERANCE, v0=start, return_eigenvectors=False)
        largest = min(float(eigenvalues[0]) * (1.0 + EIGENVALUE_TOLERANCE), circles)
    except (ArpackNoConvergence, ArpackError):
        largest = circles
    return float(np.sqrt(largest))


def _touched(model: Model, scene: BodyArrays, inverse_mass: FloatArray, strains: BlockStrains | None = None) -> float:
    """Bound of the highest frequency (rad/s) with contact on all faces; see ``highest_frequency``."""
    n, points, edges = model.n_blocks, scene.points, scene.edges
    centre = np.column_stack((np.append(model.blocks.x, 0.0), np.append(model.blocks.y, 0.0)))
    size = 3 if strains is None else 5
    of_block = np.zeros((n + 1, size, size))
    all_sides = np.zeros((n + 1, size, size))
    joint = scene.laws[points["law"]]
    normal = joint["normal_stiffness"] * points["area"], joint["shear_stiffness"] * points["area"]
    face = edges[points["own_edge"]]
    moved = None if strains is None else along_and_outwards(face) @ strains.own
    rows = _stiffness_rows(points["x"], points["y"], face["along_x"], face["along_y"], *normal, moved)
    np.add.at(of_block, points["body"], rows)
    np.add.at(all_sides, points["body"], rows)
    # points of others that lie on a block at first; the ground has no centroid, and does not move
    joined = points["status"] == BONDED
    other = edges[points["target"][joined]]
    on, body = other["body"], points["body"][joined]
    moves = (on < n) & (body < n)
    arm = np.zeros((len(on), 2))
    arm[moves] = np.column_stack((points["x"], points["y"]))[joined][moves] + (centre[body[moves]] - centre[on[moves]])
    elsewhere = (on < n) & (body >= n)
    along = points["anchor"][joined]
    for axis, key in enumerate("xy"):  # from the start of the edge along it
        arm[elsewhere, axis] = (other[key] + other[f"along_{key}"] * along)[elsewhere]
    moved = None if strains is None else strains.target[joined]
    rows = _stiffness_rows(
        arm[:, 0], arm[:, 1], other["along_x"], other["along_y"], normal[0][joined], normal[1][joined], moved
    )
    np.add.at(all_sides, on, rows)
    if strains is not None:
        inverse_mass = np.hstack((inverse_mass, strains.inverse_mass[strains.number]))
        for k in range(2):
            resisted = 0.5 * strains.stiffness[strains.number, k]
            all_sides[:, 3 + k, 3 + k] += resisted
            of_block[:, 3 + k, 3 + k] += 0.5 * resisted
    root = np.sqrt(inverse_mass)[:-1]
    worst = 0.0
    for stiffness in (all_sides, 2.0 * of_block):
        scaled = root[:, :, None] * stiffness[:-1] * root[:, None, :]
        worst = max(worst, float(np.linalg.eigvalsh(scaled).max(initial=0.0)))
    return float(np.sqrt(2.0 * worst))


def _stiffness_rows(
    x: FloatArray,
    y: FloatArray,
    t_x: FloatArray,
    t_y: FloatArray,
    k_n: FloatArray,
    k_s: FloatArray,
    moved: FloatArray | None,
) -> FloatArray:
    """Stiffness of points at arms (x, y) along normal and direction of an edge, (p, 3, 3) or with strains (p, 5, 5)."""
    across = np.stack((-t_y, t_x, x * t_x + y * t_y), axis=-1)
    along = np.stack((t_x, t_y, x * t_y - y * t_x), axis=-1)
    if moved is not None:
        along, across = np.hstack((along, moved[:, 0])), np.hstack((across, moved[:, 1]))
    return np.asarray(
        k_n[:, None, None] * across[:, :, None] * across[:, None, :]
        + k_s[:, None, None] * along[:, :, None] * along[:, None, :]
    )


def contact_damping(model: Model, settings: Dynamics) -> float:
    """Damping stress of pressed contacts over the rate of their elastic stress (s): 2 zeta / omega."""
    # omega = sqrt(k_n A / m): lowest frequency of a block that bounces on a joint, m the mass of the lighter block
    if settings.contact_damping == 0.0:
        return 0.0
    face = model.interfaces
    mass = np.append(model.mass, np.inf)
    held = model.supports.prescribed
    mass[held[held % 3 == 1] // 3] = np.inf
    lighter = np.minimum(mass[face.block_a], mass[face.block_b])
    moves = np.isfinite(lighter)
    if not moves.any():
        return 0.0
    stiffness = model.properties.normal_stiffness * face.contact_area.sum(axis=1)
    return float(2.0 * settings.contact_damping * np.sqrt((lighter[moves] / stiffness[moves]).max()))


def time_step(frequency: float, settings: Dynamics, unbonded: bool = False, contact_damping: float = 0.0) -> float:
    """Time step (s) as a share of the limit of stability of central differences, 2 / omega.

    Stiffness-proportional damping, from the last half step, lowers the limit to 2 / omega (sqrt(1 + xi^2) - xi) with
    xi = beta omega / 2; local damping alpha adds up to alpha times the unbalanced force and lowers it by
    1 / sqrt(1 + alpha). Mass-proportional damping does not lower it.
    """
    if frequency == 0.0:
        return settings.run_duration / settings.outputs
    xi = 0.5 * (settings.stiffness_damping + contact_damping) * frequency
    limit = 2.0 / frequency / (np.sqrt(1.0 + xi * xi) + xi)
    if settings.damping == "local":
        limit /= np.sqrt(1.0 + settings.local_damping)
    return float(settings.step_share(unbonded) * limit)
