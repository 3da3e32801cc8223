"""Forces out of balance, and how far stresses lie beyond the law: small loops over all that an equilibrium has."""

import numpy as np

from damagepred.kernels.jit import kernel, kernel_making_arrays
from damagepred.kernels.joint.law import capped


@kernel
def combine_loads(dead, live, load, progress, force):
    """Fill the force on every degree of freedom with shares of dead and live load."""
    for i in range(force.size):
        force[i] = load * dead[i] + progress * live[i]


@kernel_making_arrays
def free_residual(force, free, per_weight):
    """Return the force on what is free, 0 elsewhere, and the largest of it; infinity if any is no number.

    Parameters
    ----------
    force : array (size,)
        Of every degree of freedom (N, N m).
    free : array of bool (size,)
        Those that must be in balance.
    per_weight : array (size,)
        One over what forces are measured by.
    """
    left, largest, known = np.zeros_like(force), 0.0, True
    for i in range(force.size):
        if free[i]:
            left[i] = force[i]
            ratio = abs(force[i] * per_weight[i])
            known &= ratio < np.inf  # not so for what is no number
            largest = max(largest, ratio)
    return left, largest if known else np.inf


@kernel
def largest_block_resultant(force, block, dof_x, dof_y, arm_x, arm_y, total):
    """Add up the forces on the gridpoints of each block; return the largest resultant x, y or turning of any.

    Parameters
    ----------
    force : array (size,)
        On every degree of freedom (N).
    block, dof_x, dof_y : array of int (g,)
        Block of each gridpoint, and its degrees of freedom.
    arm_x, arm_y : array (g,)
        From its block's centroid, over the block's radius of gyration.
    total : array (n, 3)
        Filled with what is on the blocks.
    """
    total[:] = 0.0
    largest = 0.0
    for g in range(block.size):
        x, y = force[dof_x[g]], force[dof_y[g]]
        of_block = total[block[g]]
        of_block[0] += x
        of_block[1] += y
        of_block[2] += arm_x[g] * y - arm_y[g] * x
    for b in range(len(total)):
        for axis in range(3):
            largest = max(largest, abs(total[b, axis]))
    return largest


@kernel
def within_limit(displacement, free, arms, limit):
    """Tell whether all displacements of what is free are smaller than a limit (m); turns are multiplied by an arm."""
    within = True
    for i in range(displacement.size):
        within &= not free[i] or abs(displacement[i] * arms[i]) < limit  # not so for what is no number
    return within


@kernel
def joint_law_violation_of(properties, cracked, kappa, sigma, tau):
    """Return by how much stresses (m, q) exceed what the joints carry (Pa), at most; 0 if they obey the law.

    Parameters
    ----------
    properties : NamedTuple of arrays (m,)
        Of the joints.
    cracked, kappa : array (m, q)
        What the joints remember.
    sigma, tau : array (m, q)
        Normal stress, tension positive, and shear stress (Pa).
    """
    largest, known = 0.0, True
    for i in range(sigma.shape[0]):
        strength, critical = properties.tensile_strength[i], properties.critical_opening[i]
        left, first = properties.residual_tensile_strength[i], strength / properties.normal_stiffness[i]
        strongest = properties.compressive_strength[i]
        for k in range(sigma.shape[1]):
            bond = 1.0
            if cracked[i, k]:
                bond = 0.0
                if critical > 0.0:
                    bond = min(max((critical - max(kappa[i, k], first)) / (critical - first), 0.0), 1.0)
            tension = sigma[i, k] - (left + bond * (strength - left))
            cohesion = properties.residual_cohesion[i]
            cohesion += bond * (properties.cohesion[i] - cohesion)
            friction = properties.residual_friction[i]
            friction += bond * (properties.friction[i] - friction)
            limit = max(cohesion - sigma[i, k] * friction, 0.0)
            limit = capped(limit, sigma[i, k], strongest, 1.0 / properties.cap_shear[i])
            shear = abs(tau[i, k]) - limit
            known &= sigma[i, k] == sigma[i, k] and tau[i, k] == tau[i, k]
            largest = max(largest, max(tension, max(shear, -sigma[i, k] - strongest)))
    return largest if known else np.nan
