"""Elastic energy and fracture work of interfaces, and their forces on the ground."""

import numpy as np

from damagepred.kernels.interface.kinematics import elastic_trial, interface_displacement
from damagepred.kernels.jit import kernel
from damagepred.kernels.joint.return_mapping import coulomb_return, is_plain
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
    first_ground = interfaces.edge.size - ground.normal.shape[0]
    for i in listed:
        middle = interface_displacement(interfaces, displacement, i)
        p = properties[i]
        plain = is_plain(p, options.general)
        kappa_0 = p.tensile_strength / p.normal_stiffness
        for k in range(interfaces.contact_area.shape[1]):
            area, kappa = interfaces.contact_area[i, k], history.kappa[i, k]
            u_n, u_s = elastic_trial(interfaces, ground, history, middle, i, k)
            cracked, e = history.cracked[i, k], u_n - history.dilatant_opening[i, k]
            sigma, tau, _, _, _, _, _, _, _ = coulomb_return(p, options.general, plain, cracked, kappa, e, u_s, options)
            stored += 0.5 * area * sigma * e
            stored += 0.5 * area * tau * tau / p.shear_stiffness
            if not plain and cracked and p.slip_weight == 0.0 and p.critical_opening > 0.0 and kappa < np.inf:
                softened += area * softening_work(p, max(kappa, kappa_0))
            if i >= first_ground:
                on_ground.normal[i - first_ground, k] = -area * sigma
                on_ground.shear[i - first_ground, k] = -area * tau
    return stored, softened
