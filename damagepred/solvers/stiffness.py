"""Elastic stiffness of all joints together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from damagepred.assembly import Model

FloatArray = NDArray[np.float64]


def elastic_stiffness(model: Model) -> sparse.csc_array:
    """Return the stiffness of the intact wall.

    Parameters
    ----------
    model : Model
        n blocks.

    Returns
    -------
    csc_array (3 (n + 1), 3 (n + 1))
        Force on each degree of freedom for unit displacements (N/m, N, N m); the last three are the ground's.
    """
    face = model.interfaces
    q = face.contact_area.shape[1]
    ones = np.ones((1, q))
    # rows of the kinematics: opening and shear at a contact for unit displacements of blocks a and b
    opening = np.stack(
        [
            -face.normal_x[:, None] * ones, -face.normal_y[:, None] * ones,
            -(face.arm_normal_a[:, None] + face.contact_offset),
            face.normal_x[:, None] * ones, face.normal_y[:, None] * ones,
            face.arm_normal_b[:, None] + face.contact_offset,
        ],
        axis=-1,
    )  # fmt: skip
    shear = np.stack(
        [
            -face.normal_y[:, None] * ones, face.normal_x[:, None] * ones, -face.arm_shear_a[:, None] * ones,
            face.normal_y[:, None] * ones, -face.normal_x[:, None] * ones, face.arm_shear_b[:, None] * ones,
        ],
        axis=-1,
    )  # fmt: skip
    k_n = model.properties.normal_stiffness[:, None] * face.contact_area
    k_s = model.properties.shear_stiffness[:, None] * face.contact_area
    blocks = np.einsum("mq,mqi,mqj->mij", k_n, opening, opening) + np.einsum("mq,mqi,mqj->mij", k_s, shear, shear)
    dof = np.concatenate((3 * face.body_a[:, None] + np.arange(3), 3 * face.body_b[:, None] + np.arange(3)), axis=1)
    rows = np.broadcast_to(dof[:, :, None], blocks.shape).ravel()
    columns = np.broadcast_to(dof[:, None, :], blocks.shape).ravel()
    size = 3 * (model.n_blocks + 1)
    return sparse.coo_array((blocks.ravel(), (rows, columns)), shape=(size, size)).tocsc()


def elastic_displacement(model: Model) -> FloatArray | None:
    """Return where the dead load takes the intact wall before any movement.

    Parameters
    ----------
    model : Model
        n blocks.

    Returns
    -------
    array (3 (n + 1),) or None
        Of the blocks and the ground; None if the wall is not held in place by its joints.
    """
    displacement = np.zeros(3 * (model.n_blocks + 1))
    free = np.setdiff1d(np.arange(displacement.size), held_dofs(model))
    stiffness = elastic_stiffness(model)[free][:, free].tocsc()
    try:  # symmetric ordering and pivoting: a fifteenth of the time of the default
        factors = splu(stiffness, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:  # singular
        return None
    displacement[free] = factors.solve(model.supports.load[free])
    return displacement if np.isfinite(displacement).all() else None


def turning_length(model: Model) -> FloatArray:
    """Return the radius of gyration of each block (m): the arm that makes a rotation comparable to a displacement."""
    return np.sqrt(model.blocks.polar / model.blocks.area)


def dof_arms(model: Model) -> FloatArray:
    """Return the arm that makes each degree of freedom a displacement (m), array (3 (n + 1),): 1 where it is one."""
    arms = np.ones((model.n_blocks + 1, 3))
    arms[:-1, 2] = turning_length(model)
    return arms.ravel()


def held_dofs(model: Model) -> NDArray[np.int64]:
    """Return the degrees of freedom that do not move freely: supports and the ground."""
    ground = 3 * model.n_blocks + np.arange(3)
    return np.concatenate((model.supports.prescribed, ground))


def base_reaction(model: Model, force: FloatArray) -> float:
    """Return the vertical force of ground and supports on the wall (N, upwards): the opposite of what reaches them.

    Parameters
    ----------
    model : Model
        n blocks.
    force : array (3 (n + 1),)
        Of joints and loads on the blocks and the ground, held ones included.
    """
    held = held_dofs(model)
    return -float(force[held[held % 3 == 1]].sum())


def support_force(model: Model, force: FloatArray) -> FloatArray:
    """Return the force of the supports on each block, array (n, 3): x, y (N) and moment (N m), 0 where it is free.

    Parameters
    ----------
    model, force
        As ``base_reaction``.
    """
    found = np.zeros(3 * model.n_blocks)
    held = model.supports.prescribed
    found[held] = -force[held]
    return found.reshape(-1, 3)
