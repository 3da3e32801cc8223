"""Elastic stiffness of all joints and zones together, and what is held of it."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.solvers.system.deformable_blocks import idle_dofs, kinematics, rigid_motion, spread, zone_stiffness

ELASTIC_RESIDUAL_TOLERANCE = 1e-3
"""Residual of an elastic solution over the largest load, above which the wall counts as singular (1)."""


def elastic_stiffness(model: Model, apart: bool = False) -> sparse.csc_array:
    """Return the stiffness of the intact wall.

    Parameters
    ----------
    model : Model
        n blocks.
    apart : bool
        Whether interfaces with a gap carry nothing, or as if they had closed.

    Returns
    -------
    csc_array (size, size)
        Force on each degree of freedom for unit displacements (N/m, N, N m): three of each block, the ground's, and
        those of deformable blocks (``damagepred.assembly.mesh.Mesh``), nothing where they follow from others.
    """
    joints = joint_stiffness(model, apart)
    if model.mesh is None:
        return joints
    bodies = joints.shape[0]
    follow = kinematics(model)[:bodies]
    return (follow.T @ joints @ follow + zone_stiffness(model)).tocsc()


def joint_stiffness(model: Model, apart: bool = False) -> sparse.csc_array:
    """Return the stiffness of the intact joints alone, (3 bodies, 3 bodies).

    Parameters
    ----------
    model, apart
        As ``elastic_stiffness``.
    """
    face = model.interfaces
    q = face.contact_area.shape[1]
    ones = np.ones((1, q))
    # rows of the kinematics: opening and shear at a contact for unit displacements of blocks a and b
    opening = np.stack(
        [
            -face.normal_x[:, None] * ones,
            -face.normal_y[:, None] * ones,
            -(face.arm_normal_a[:, None] + face.contact_offset),
            face.normal_x[:, None] * ones,
            face.normal_y[:, None] * ones,
            face.arm_normal_b[:, None] + face.contact_offset,
        ],
        axis=-1,
    )
    shear = np.stack(
        [
            -face.normal_y[:, None] * ones,
            face.normal_x[:, None] * ones,
            -face.arm_shear_a[:, None] * ones,
            face.normal_y[:, None] * ones,
            -face.normal_x[:, None] * ones,
            face.arm_shear_b[:, None] * ones,
        ],
        axis=-1,
    )
    area = face.contact_area * (model.properties.gap == 0.0)[:, None] if apart else face.contact_area
    k_n = model.properties.normal_stiffness[:, None] * area
    k_s = model.properties.shear_stiffness[:, None] * area
    blocks = np.einsum("mq,mqi,mqj->mij", k_n, opening, opening) + np.einsum("mq,mqi,mqj->mij", k_s, shear, shear)
    dof = np.concatenate((3 * face.body_a[:, None] + np.arange(3), 3 * face.body_b[:, None] + np.arange(3)), axis=1)
    rows = np.broadcast_to(dof[:, :, None], blocks.shape).ravel()
    columns = np.broadcast_to(dof[:, None, :], blocks.shape).ravel()
    size = 3 * model.n_bodies
    return sparse.coo_array((blocks.ravel(), (rows, columns)), shape=(size, size)).tocsc()


def elastic_displacement(model: Model) -> FloatArray | None:
    """Return where the dead load takes the intact wall before any movement.

    Parameters
    ----------
    model : Model
        n blocks.

    Returns
    -------
    array (size,) or None
        Of blocks, ground, facets and gridpoints; None if the wall is not held in place by its joints.
    """
    found = elastic_solutions(model, dead_load(model))
    return None if found is None else follow_up(model, found[0])


def elastic_solutions(model: Model, *loads: FloatArray) -> list[FloatArray] | None:
    """Return where loads take the intact wall, each by itself, with nothing moved.

    Parameters
    ----------
    model : Model
        n blocks.
    *loads : array (size,)
        On all degrees of freedom (N, N m); what is held takes no part.

    Returns
    -------
    list of array (size,) or None
        0 where the wall is held and where facets and whole blocks follow from gridpoints, see ``follow_up``; None if
        its joints do not hold it in place.
    """
    free = np.setdiff1d(np.arange(model.size), held_dofs(model))
    stiffness = elastic_stiffness(model, apart=True)[free][:, free].tocsc()
    try:  # symmetric ordering and pivoting: a fifteenth of the time of the default
        factors = splu(stiffness, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:  # singular
        return None
    found = []
    for load in loads:
        displacement = np.zeros(model.size)
        displacement[free] = moved = factors.solve(load[free])
        # what nothing holds may come out singular but for rounding: it is then taken so far that nothing balances
        missing = np.abs(stiffness @ moved - load[free]).max(initial=0.0)
        if not missing <= ELASTIC_RESIDUAL_TOLERANCE * np.abs(load[free]).max(initial=0.0):
            return None
        found.append(displacement)
    return found


def follow_up(model: Model, displacement: FloatArray) -> FloatArray:
    """Return displacements in which facets and deformable blocks as a whole follow from the gridpoints.

    Parameters
    ----------
    model : Model
        n blocks.
    displacement : array (size,)
        Of all degrees of freedom.
    """
    if model.mesh is None:
        return displacement
    followed = kinematics(model) @ displacement
    whole = 3 * model.mesh.block[:, None] + np.arange(3)
    followed[whole] = (rigid_motion(model) @ displacement)[whole]
    return np.asarray(followed)


def dead_load(model: Model) -> FloatArray:
    """Return the dead load on all degrees of freedom (size,) (N, N m)."""
    load = spread(model, model.supports.load)
    return load if model.edge_load is None else load + model.edge_load


def live_load(model: Model) -> FloatArray:
    """Return the load at full movement that grows with it, on all degrees of freedom (size,) (N, N m)."""
    load = spread(model, model.supports.live_load)
    return load if model.live_edge_load is None else load + model.live_edge_load


def turning_length(model: Model) -> FloatArray:
    """Return the radius of gyration of each block (m): the arm that makes a rotation comparable to a displacement."""
    return np.sqrt(model.blocks.polar / model.blocks.area)


def dof_arms(model: Model) -> FloatArray:
    """Return the arm that makes each degree of freedom a displacement (m), array (size,): 1 where it is one."""
    arms = np.ones(model.size)
    arms[2 : 3 * model.n_blocks : 3] = turning_length(model)
    return arms


def residual_scale(model: Model) -> FloatArray:
    """Return the residual force (N, N m) of each degree of freedom that counts as one mean block weight (size,).

    Of half a block, on the axis of a half wall, half as much counts: so it does on the whole of it.
    """
    scale = model.mean_block_weight * dof_arms(model)
    scale[: 3 * model.n_blocks] *= np.repeat(model.block_share, 3)
    return scale


def held_dofs(model: Model) -> IntArray:
    """Return the degrees of freedom that do not move freely: supports, the ground, and what follows from others."""
    ground = 3 * model.n_blocks + np.arange(3)
    return np.concatenate((model.supports.prescribed, ground, idle_dofs(model)))


def block_of_dof(model: Model, dof: int) -> int:
    """Return the block that a degree of freedom belongs to.

    Parameters
    ----------
    model : Model
        The model.
    dof : int
        Degree of freedom.
    """
    if dof < 3 * (model.n_blocks + 1) or model.mesh is None:
        return dof // 3
    mesh = model.mesh
    here = np.flatnonzero((mesh.dof_x == dof) | (mesh.dof_y == dof))
    return int(mesh.gridpoint_block[here[0]]) if here.size else model.n_blocks


def base_reaction(model: Model, force: FloatArray) -> float:
    """Return the vertical force of ground and supports on the wall (N, upwards): the opposite of what reaches them.

    Parameters
    ----------
    model : Model
        n blocks.
    force : array (size,)
        Of joints, zones and loads on all degrees of freedom, held ones included.
    """
    ground = -float(force[3 * model.n_blocks + 1])
    return ground + float(support_force(model, force)[:, 1].sum())


def support_force(model: Model, force: FloatArray) -> FloatArray:
    """Return the force of the supports on each block, array (n, 3): x, y (N) and moment (N m), 0 where it is free.

    Parameters
    ----------
    model, force
        As ``base_reaction``.
    """
    found = np.zeros(3 * model.n_blocks)
    held = model.supports.prescribed
    whole = held[held < found.size]
    found[whole] = -force[whole]
    by_block = found.reshape(-1, 3)
    if model.mesh is not None and whole.size < held.size:
        mesh, block = model.mesh, model.mesh.gridpoint_block
        single = np.zeros(model.size)
        points = held[held >= found.size]
        single[points] = -force[points]
        x, y = single[mesh.dof_x], single[mesh.dof_y]
        turning = x * (model.blocks.y[block] - mesh.y) + y * (mesh.x - model.blocks.x[block])
        for axis, values in enumerate((x, y, turning)):
            by_block[:, axis] += np.bincount(block, values, model.n_blocks)
    return by_block
