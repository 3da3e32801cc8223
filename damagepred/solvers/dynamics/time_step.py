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
from damagepred.solvers.dynamics.options import DynamicsOptions
from damagepred.solvers.dynamics.strains import BlockStrains, along_and_outwards
from damagepred.solvers.system.discrete_system import DiscreteSystem


class HighestFrequency(NamedTuple):
    """Highest angular frequencies (rad/s).

    Attributes
    ----------
    intact : float
        Of the wall with all joints intact: an eigenvalue.
    touched : float
        Upper bound for all walls that it may become by new contacts.
    """

    intact: float
    touched: float


def highest_frequency(
    model: Model,
    scene: BodyArrays,
    inverse_mass: FloatArray,
    options: DynamicsOptions,
    strains: BlockStrains | None = None,
) -> HighestFrequency:
    """Return the highest frequency of a model, and a bound for it with new contacts.

    The bound: with S the stiffness of all points that act on a block while the other side is held, the energy of each
    contact is at most twice that of both sides' own movement, so omega^2 <= 2 max eig(M^-1 S) over the blocks. S is
    that of the intact wall, or twice that of the block's own points if this is more: all of its faces in full
    contact, as many points of others on them as there are of its own.
    """
    system = DiscreteSystem.of(model)
    inverse, stiffness = np.zeros(model.size), system.elastic_stiffness
    inverse[: inverse_mass.size] = inverse_mass.ravel()
    if strains is not None:
        inverse[system.strain_dofs] = strains.inverse_mass[:-1].ravel()
    return HighestFrequency(_highest(stiffness, inverse, options), _touched(model, scene, inverse_mass, strains))


def _highest(stiffness: sparse.sparray, inverse_mass: FloatArray, options: DynamicsOptions) -> float:
    """Return the highest angular frequency (rad/s) of a stiffness; prescribed motion has an inverse mass of 0."""
    root = np.sqrt(inverse_mass)
    free = np.flatnonzero(root > 0)
    scale = sparse.diags_array(root[free])
    matrix = (scale @ stiffness.tocsr()[free][:, free] @ scale).tocsr()
    if matrix.nnz == 0:
        return 0.0
    if len(free) <= options.dense_eigenvalues:
        return float(np.sqrt(np.linalg.eigvalsh(matrix.toarray())[-1]))
    # Gershgorin's circles, rotations made comparable by the scaling itself: never below the true one
    circles = float(abs(matrix).sum(axis=1).max())
    try:
        start = np.random.default_rng(1).standard_normal(len(free))
        found = eigsh(matrix, k=1, which="LA", tol=options.eigenvalue_tolerance, v0=start, return_eigenvectors=False)
        largest = min(float(found[0]) * (1.0 + options.eigenvalue_tolerance), circles)
    except (ArpackNoConvergence, ArpackError):
        largest = circles
    return float(np.sqrt(largest))


def _touched(model: Model, scene: BodyArrays, inverse_mass: FloatArray, strains: BlockStrains | None = None) -> float:
    n, points, edges = model.n_blocks, scene.points, scene.edges
    centre = np.column_stack((np.append(model.blocks.x, 0.0), np.append(model.blocks.y, 0.0)))
    size = 3 if strains is None else 5
    own = np.zeros((n + 1, size, size))
    all_sides = np.zeros((n + 1, size, size))
    joint = scene.laws[points["law"]]
    normal = joint["normal_stiffness"] * points["area"], joint["shear_stiffness"] * points["area"]
    face = edges[points["own_edge"]]
    moved = None if strains is None else along_and_outwards(face) @ strains.own
    rows = _stiffness_rows(points["x"], points["y"], face["along_x"], face["along_y"], *normal, moved)
    np.add.at(own, points["body"], rows)
    np.add.at(all_sides, points["body"], rows)
    # those of others that lie on a block at first; the ground has no centroid, and does not move
    joined = (points["status"] == BONDED) & (edges["body"][points["target"]] <= n)
    other = edges[points["target"][joined]]
    on, body = other["body"], points["body"][joined]
    moves = (on < n) & (body < n)
    at = np.zeros((len(on), 2))
    at[moves] = np.column_stack((points["x"], points["y"]))[joined][moves] + (centre[body[moves]] - centre[on[moves]])
    elsewhere = (on < n) & (body >= n)
    along = points["anchor"][joined]
    for axis, key in enumerate("xy"):  # on its edge: from the edge's end along it
        at[elsewhere, axis] = (other[key] + other[f"along_{key}"] * along)[elsewhere]
    moved = None if strains is None else strains.target[joined]
    rows = _stiffness_rows(
        at[:, 0], at[:, 1], other["along_x"], other["along_y"], normal[0][joined], normal[1][joined], moved
    )
    np.add.at(all_sides, on, rows)
    if strains is not None:
        inverse_mass = np.hstack((inverse_mass, strains.inverse_mass[strains.number]))
        for k in range(2):
            resisted = 0.5 * strains.stiffness[strains.number, k]
            all_sides[:, 3 + k, 3 + k] += resisted
            own[:, 3 + k, 3 + k] += 0.5 * resisted
    root = np.sqrt(inverse_mass)[:-1]
    worst = 0.0
    for stiffness in (all_sides, 2.0 * own):
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
    """Return the stiffness of points at arms (x, y) along normal and direction of an edge: (p, 3, 3), or (p, 5, 5).

    ``moved``: displacement along the edge and across (p, 2, 2) for unit strain and curvature of elastic blocks.
    """
    across = np.stack((-t_y, t_x, x * t_x + y * t_y), axis=-1)
    along = np.stack((t_x, t_y, x * t_y - y * t_x), axis=-1)
    if moved is not None:
        along, across = np.hstack((along, moved[:, 0])), np.hstack((across, moved[:, 1]))
    return np.asarray(
        k_n[:, None, None] * across[:, :, None] * across[:, None, :]
        + k_s[:, None, None] * along[:, :, None] * along[:, None, :]
    )


def contact_damping(model: Model, settings: Dynamics) -> float:
    """Return the damping stress of pressed contacts over the rate of their elastic stress (s).

    2 zeta / omega, with omega = sqrt(k_n A / m) the lowest frequency at which a block bounces on a joint; m is the mass
    of the lighter of the two.
    """
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
    """Return the time step to use (s).

    Central differences are stable up to 2 / omega. Damping proportional to stiffness, taken from the last half step,
    lowers that to 2 / omega (sqrt(1 + xi^2) - xi), where xi = beta omega / 2; local damping alpha adds up to alpha
    times the unbalanced force, and lowers it by 1 / sqrt(1 + alpha). Damping proportional to mass does not.
    """
    if frequency == 0.0:
        return settings.run_duration / settings.outputs
    xi = 0.5 * (settings.stiffness_damping + contact_damping) * frequency
    limit = 2.0 / frequency / (np.sqrt(1.0 + xi * xi) + xi)
    if settings.damping == "local":
        limit /= np.sqrt(1.0 + settings.local_damping)
    return float(settings.step_share(unbonded) * limit)
