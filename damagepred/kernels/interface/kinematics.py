"""Kinematics of interfaces: relative displacements of two bodies, and the transposed scatter of forces.

An interface is a straight edge, so the opening along it is linear and the shear constant: both follow from three
numbers (opening and shear at its middle, relative rotation). The contacts, its integration points, share them. Elastic
blocks add to the three by their strain and curvature; see ``damagepred.assembly.elastic_blocks``.
"""

from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.kernels.jit import law

EDGE = np.dtype(
    [("body_a", np.int64), ("body_b", np.int64)]
    + [
        (name, np.float64)
        for name in ("normal_x", "normal_y", "arm_normal_a", "arm_shear_a", "arm_normal_b", "arm_shear_b")
    ]
)
"""Record of an interface: its bodies, normal and arms (m)."""


class ElasticSides(NamedTuple):
    """Displacement of the sides of m interfaces by strain and curvature of elastic blocks."""

    dof: IntArray  # (m, 2): degree of freedom of the strain of block a and b, the curvature follows; -1 if rigid
    # (m, 2, 3, 2): opening and shear at the middle (m), and relative rotation, per unit strain and unit
    # curvature (1/m)
    rows: FloatArray


@law
def midpoint_displacement(normal, arm_a, arm_b, drift, turn_a, turn_b):
    """Opening and shear (m) in the middle of an interface whose body b has moved by ``drift`` relative to body a."""
    opening = normal[0] * drift[0] + normal[1] * drift[1] + arm_b[0] * turn_b - arm_a[0] * turn_a
    shear = normal[1] * drift[0] - normal[0] * drift[1] + arm_b[1] * turn_b - arm_a[1] * turn_a
    return opening, shear


@law
def with_strains(elastic, displacement, i, opening, shear, turn):
    """Opening, shear (m) and relative rotation of interface i: of rigid blocks, plus the strains of elastic blocks."""
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
    """Add the forces of interface i on the strains of elastic blocks: -``rows``^T times N, S (N) and M (N m)."""
    if elastic is not None:
        for side in range(2):
            dof = elastic.dof[i, side]
            if dof >= 0:
                rows = elastic.rows[i, side]
                force[dof] -= rows[0, 0] * normal + rows[1, 0] * shear
                force[dof + 1] -= rows[0, 1] * normal + rows[1, 1] * shear + rows[2, 1] * moment


@law
def interface_displacement(edge, elastic, displacement, i):
    """Opening and shear (m) in the middle of interface i, and its relative rotation; ``elastic`` may be None."""
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
def scatter_interface_force(edge, elastic, i, normal, shear, moment, force):
    """Add -B^T (N, S, M) to the bodies and strains of interface i: forces (N), moment (N m), tension positive."""
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
    """Displacement of the ground (g, q) under contact k of interface i; 0 before ``first``, the first on the ground."""
    return displacement[i - first, k] if i >= first else 0.0
