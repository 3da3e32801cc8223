"""Elastic energy and fracture work of interfaces, and their forces on the ground."""

import numpy as np

from damagepred.kernels.interface.kinematics import elastic_trial, interface_displacement
from damagepred.kernels.jit import kernel
from damagepred.kernels.joint.return_mapping import is_plain, joint_stress
from damagepred.kernels.joint.softening import softening_work


@kernel
def energy(listed, interfaces, properties, options, ground, history, displacement, on_ground):
    """Return elastic energy and softening work of interfaces (J), and fill the forces on the ground.

    The history must be committed at the displacement. The softening work of bonds that soften by slip is left out, see
    ``commit_joint_history``; that of bonds that slip has broken, too, see ``break_in_shear``.

    Parameters
    ----------
    listed : array of int
        The interfaces.
    interfaces, properties, options, ground, history, displacement
        As ``damagepred.kernels.interface.internal_force.joint_forces``.
    on_ground : NamedTuple of arrays (g, q)
        Normal and shear force of each contact, work-conjugate to the displacement of the ground (N); filled.
    """
    stored, softened = 0.0, 0.0
    first_ground = interfaces.block_a.size - ground.normal.shape[0]
    for i in listed:
        middle, plain = interface_displacement(interfaces, displacement, i), is_plain(properties, i)
        k_n, k_s = properties.normal_stiffness[i], properties.shear_stiffness[i]
        f_t, w_c = properties.tensile_strength[i], properties.critical_opening[i]
        for k in range(interfaces.contact_area.shape[1]):
            area, kappa = interfaces.contact_area[i, k], history.kappa[i, k]
            u_n, u_s = elastic_trial(interfaces, ground, history, middle, i, k)
            cracked, e = history.cracked[i, k], u_n - history.dilatant_opening[i, k]
            sigma, tau = joint_stress(properties, i, plain, cracked, kappa, e, u_s, options)
            stored += 0.5 * area * sigma * e
            stored += 0.5 * area * tau * tau / k_s
            if cracked and properties.critical_slip[i] == 0.0 and w_c > 0.0 and kappa < np.inf:
                softened += area * softening_work(max(kappa, f_t / k_n), f_t, k_n, w_c)
            if i >= first_ground:
                on_ground.normal[i - first_ground, k] = -area * sigma
                on_ground.shear[i - first_ground, k] = -area * tau
    return stored, softened
