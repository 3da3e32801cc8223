"""Kinematics of interfaces: relative displacements from those of the bodies, and the transposed scatter of forces.

An interface is a straight edge, so the opening along it is linear and the shear constant: both follow from three
numbers (opening and shear at its middle, relative rotation). The contacts, its integration points, share them. Elastic
blocks add to the three by their strain and curvature; see ``damagepred.assembly.elastic_blocks``.
"""

import numpy as np

from damagepred.kernels.jit import law

EDGE = np.dtype(
    [("body_a", np.int64), ("body_b", np.int64)]
    + [
        (name, np.float64)
        for name in ("normal_x", "normal_y", "arm_normal_a", "arm_shear_a", "arm_normal_b", "arm_shear_b")
    ]
)
"""Bodies, normal and arms of an interface in one record."""


@law
def midpoint_displacement(normal, arm_a, arm_b, drift, turn_a, turn_b):
    """Return opening and shear (m) in the middle of an interface.

    Parameters
    ----------
    normal : tuple of float
        Unit normal from block a to block b.
    arm_a, arm_b : tuple of float
        Displacement along (normal, tangent) for a unit rotation of the block (m).
    drift : tuple of float
        Displacement of b's centroid less that of a's (m).
    turn_a, turn_b : float
        Rotations.
    """
    opening = normal[0] * drift[0] + normal[1] * drift[1] + arm_b[0] * turn_b - arm_a[0] * turn_a
    shear = normal[1] * drift[0] - normal[0] * drift[1] + arm_b[1] * turn_b - arm_a[1] * turn_a
    return opening, shear


@law
def with_strains(elastic, displacement, i, opening, shear, turn):
    """Add the part of elastic blocks to opening, shear (m) and relative rotation of interface i.

    Parameters
    ----------
    elastic : NamedTuple of arrays or None
        See ``damagepred.assembly.elastic_blocks.ElasticSides``; None if no block is elastic.
    displacement : array (size,)
        Of all degrees of freedom.
    i : int
        Interface.
    opening, shear, turn : float
        Of the rigid motion.
    """
    if elastic is not None:
        for side in range(2):
            dof = elastic.dof[i, side]
            if dof >= 0:
                strain, curvature, rows = displacement[dof], displacement[dof + 1], elastic.rows[i, side]
                opening += rows[0, 0] * strain + rows[0, 1] * curvature
                shear += rows[1, 0] * strain + rows[1, 1] * curvature
                turn += rows[2, 1] * curvature
    return opening, shear, turn


@law
def scatter_to_strains(elastic, i, normal, shear, moment, force):
    """Add the forces of interface i on strain and curvature of its elastic blocks.

    Parameters
    ----------
    elastic, i
        As ``with_strains``.
    normal, shear, moment, force
        As ``scatter_interface_force``.
    """
    if elastic is not None:
        for side in range(2):
            dof = elastic.dof[i, side]
            if dof >= 0:
                rows = elastic.rows[i, side]
                force[dof] -= rows[0, 0] * normal + rows[1, 0] * shear
                force[dof + 1] -= rows[0, 1] * normal + rows[1, 1] * shear + rows[2, 1] * moment


@law
def interface_displacement(interfaces, displacement, i):
    """Return opening and shear (m) in the middle of interface i, and its relative rotation.

    Parameters
    ----------
    interfaces : InterfaceRecords
        See ``damagepred.assembly.model``.
    displacement : array (size,)
        x, y (m) and rotation of each body.
    i : int
        Interface.
    """
    return interface_motion(interfaces.edge[i], interfaces.elastic, displacement, i)


@law
def interface_motion(edge, elastic, displacement, i):
    """Return what ``interface_displacement`` does: a law that takes a tuple of arrays would count references."""
    a, b = 3 * edge.body_a, 3 * edge.body_b
    turn_a, turn_b = displacement[a + 2], displacement[b + 2]
    opening, shear = midpoint_displacement(
        (edge.normal_x, edge.normal_y),
        (edge.arm_normal_a, edge.arm_shear_a),
        (edge.arm_normal_b, edge.arm_shear_b),
        (displacement[b] - displacement[a], displacement[b + 1] - displacement[a + 1]),
        turn_a,
        turn_b,
    )
    return with_strains(elastic, displacement, i, opening, shear, turn_b - turn_a)


@law
def scatter_interface_force(interfaces, i, normal, shear, moment, force):
    """Add the forces of interface i on its two bodies.

    Parameters
    ----------
    interfaces, i
        As ``interface_displacement``.
    normal, shear, moment : float
        Forces (N) and moment about the middle (N m) of the interface, tension positive.
    force : array (size,)
        On each body (N, N m); added to.
    """
    scatter_force(interfaces.edge[i], interfaces.elastic, i, normal, shear, moment, force)


@law
def scatter_force(edge, elastic, i, normal, shear, moment, force):
    """Add forces as ``scatter_interface_force`` does."""
    n_x, n_y = edge.normal_x, edge.normal_y
    pull_x, pull_y = normal * n_x + shear * n_y, normal * n_y - shear * n_x
    a, b = 3 * edge.body_a, 3 * edge.body_b
    force[a] += pull_x
    force[a + 1] += pull_y
    force[a + 2] += normal * edge.arm_normal_a + shear * edge.arm_shear_a + moment
    force[b] -= pull_x
    force[b + 1] -= pull_y
    force[b + 2] -= normal * edge.arm_normal_b + shear * edge.arm_shear_b + moment
    scatter_to_strains(elastic, i, normal, shear, moment, force)


@law
def ground_at(displacement, first, i, k):
    """Return the displacement of the ground (g, q) under contact k of interface i, 0 before the first one on it."""
    return displacement[i - first, k] if i >= first else 0.0
