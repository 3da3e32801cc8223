"""The time step: from the highest frequency of the wall, and of what it may become."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, eigsh

from damagepred.assembly import Model
from damagepred.kernels.large_contact import HOME
from damagepred.scene import Dynamics
from damagepred.solvers.dynamic.scenery import Scenery
from damagepred.solvers.stiffness import elastic_stiffness

FloatArray = NDArray[np.float64]

SLACK = 1e-3
"""Relative accuracy asked of the highest eigenvalue, and added to it."""
SMALL = 60
"""Up to that many degrees of freedom all eigenvalues are found directly."""


class HighestFrequency(NamedTuple):
    """Highest angular frequencies (rad/s).

    Attributes
    ----------
    intact : float
        Of the wall with all joints intact: an eigenvalue.
    touched : float
        Bound for whatever the wall may become when blocks meet what they did not touch at first.
    """

    intact: float
    touched: float


def highest_frequency(model: Model, scene: Scenery, inverse_mass: FloatArray) -> HighestFrequency:
    """Return the highest frequency of a model, and a bound for it once blocks meet others.

    The bound: with S the stiffness of all points that act on a block while the other side is held, the energy of each
    contact is at most twice that of both sides' own movement, so omega^2 <= 2 max eig(M^-1 S) over the blocks. S is
    that of the intact wall, or twice that of the block's own points if this is more: all of its faces in full
    contact, as many points of others on them as there are of its own.

    Parameters
    ----------
    model : Model
        n rigid blocks.
    scene : Scenery
        Its points.
    inverse_mass : array (n + 1, 3)
        0 where it is held.
    """
    return HighestFrequency(_intact(model, inverse_mass), _touched(model, scene, inverse_mass))


def _intact(model: Model, inverse_mass: FloatArray) -> float:
    root = np.sqrt(inverse_mass).ravel()
    free = np.flatnonzero(root > 0)
    scale = sparse.diags_array(root[free])
    matrix = (scale @ elastic_stiffness(model)[free][:, free] @ scale).tocsc()
    if matrix.nnz == 0:
        return 0.0
    if len(free) <= SMALL:
        return float(np.sqrt(np.linalg.eigvalsh(matrix.toarray())[-1]))
    # Gershgorin's circles, rotations made comparable by the scaling itself: never below the true one
    circles = float(abs(matrix).sum(axis=1).max())
    try:
        start = np.random.default_rng(1).standard_normal(len(free))
        found = eigsh(matrix, k=1, which="LA", tol=SLACK, v0=start, return_eigenvectors=False)
        largest = min(float(found[0]) * (1.0 + SLACK), circles)
    except (ArpackNoConvergence, ArpackError):
        largest = circles
    return float(np.sqrt(largest))


def _touched(model: Model, scene: Scenery, inverse_mass: FloatArray) -> float:
    n, points, edges = model.n_blocks, scene.points, scene.edges
    centre = np.column_stack((np.append(model.blocks.x, 0.0), np.append(model.blocks.y, 0.0)))
    own = np.zeros((n + 1, 3, 3))
    all_sides = np.zeros((n + 1, 3, 3))
    law = scene.laws[points["law"]]
    normal = law[:, 0] * points["area"], law[:, 1] * points["area"]
    face = edges[points["own_edge"]]
    rows = _stiffness_rows(points["x"], points["y"], face["along_x"], face["along_y"], *normal)
    np.add.at(own, points["body"], rows)
    np.add.at(all_sides, points["body"], rows)
    # those of others that lie on a block at first; the ground has no centroid, and does not move
    joined = points["status"] == HOME
    other = edges[points["target"][joined]]
    on = other["body"]
    at = np.column_stack((points["x"], points["y"]))[joined] + centre[points["body"][joined]] - centre[on]
    moves = (on < n) & (points["body"][joined] < n)
    at[~moves] = 0.0
    ground = (on < n) & (points["body"][joined] == n)
    along = points["anchor"][joined]
    for axis, key in enumerate("xy"):  # on its edge: from the edge's end along it
        at[ground, axis] = (other[key] + other[f"along_{key}"] * along)[ground]
    rows = _stiffness_rows(at[:, 0], at[:, 1], other["along_x"], other["along_y"], *(k[joined] for k in normal))
    np.add.at(all_sides, on, rows)
    root = np.sqrt(inverse_mass)[:-1]
    worst = 0.0
    for stiffness in (all_sides, 2.0 * own):
        scaled = root[:, :, None] * stiffness[:-1] * root[:, None, :]
        worst = max(worst, float(np.linalg.eigvalsh(scaled).max(initial=0.0)))
    return float(np.sqrt(2.0 * worst))


def _stiffness_rows(
    x: FloatArray, y: FloatArray, t_x: FloatArray, t_y: FloatArray, k_n: FloatArray, k_s: FloatArray
) -> FloatArray:
    """Return the stiffness (p, 3, 3) of points at arms (x, y) along normal and direction of an edge."""
    across = np.stack((-t_y, t_x, x * t_x + y * t_y), axis=-1)
    along = np.stack((t_x, t_y, x * t_y - y * t_x), axis=-1)
    return np.asarray(
        k_n[:, None, None] * across[:, :, None] * across[:, None, :]
        + k_s[:, None, None] * along[:, :, None] * along[:, None, :]
    )


def time_step(frequency: float, settings: Dynamics) -> float:
    """Return the time step to use (s).

    Central differences are stable up to 2 / omega. Damping proportional to stiffness, taken from the last half step,
    lowers that to 2 / omega (sqrt(1 + xi^2) - xi), where xi = beta omega / 2; local damping alpha adds up to alpha
    times the unbalanced force, and lowers it by 1 / sqrt(1 + alpha). Damping proportional to mass does not.

    Parameters
    ----------
    frequency : float
        Highest angular frequency (rad/s); 0 if nothing is elastic.
    settings : Dynamics
        Damping, and the share of the limit to use.
    """
    if frequency == 0.0:
        return settings.duration / settings.outputs
    xi = 0.5 * settings.stiffness_damping * frequency
    limit = 2.0 / frequency / (np.sqrt(1.0 + xi * xi) + xi)
    if settings.damping == "local":
        limit /= np.sqrt(1.0 + settings.local_damping)
    return float(settings.time_step_safety * limit)
