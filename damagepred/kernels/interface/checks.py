"""Checks of the joint law at a displacement: loads of the bonds, inelastic condensed joints, violation by stresses."""

import numpy as np

from damagepred.kernels.interface.kinematics import ground_at, interface_motion
from damagepred.kernels.jit import law
from damagepred.kernels.joint.limits import capped, coulomb_limit, shear_limit
from damagepred.kernels.joint.return_mapping import coulomb_return, is_plain, normal_law
from damagepred.kernels.joint.softening import degraded, integrity_of


@law
def bond_load(stress, strength, block_stress):
    """Return the load of a bond in tension, 1 at its strength.

    For a strength below the stress of a block's weight, the overload is a share of that stress, not of the strength.

    Parameters
    ----------
    stress, strength : float
        Normal stress and tensile strength (Pa).
    block_stress : float
        Weight of a block over the largest area of a contact (Pa).
    """
    return stress / strength if strength >= block_stress else 1.0 + (stress - strength) / block_stress


@law
def softened_bond_load(general, parameters, kappa, e, tau, no_strength):
    """Return the load of a softening bond that slip breaks: 1 where |tau| is at its limit.

    The overload is the stress beyond the limit over the intact cohesion. A ratio to the limit, which falls to 0 as the
    bond opens, would not tell where along the step it was reached.

    Parameters
    ----------
    general : bool or None
        See ``damagepred.kernels.joint.return_mapping.ReturnMapping``.
    parameters : JointParameters
        Of the joint.
    kappa, e : float
        History variable at the last equilibrium, and opening less dilatant opening (m).
    tau, no_strength : float
        Shear stress, and stress that breaks a bond without strength (Pa).
    """
    p = parameters
    if general is None:
        return 0.0
    sigma, _, integrity, _ = normal_law(p, True, kappa, e, True)
    cohesion = degraded(integrity, p.cohesion, p.residual_cohesion)
    limit = coulomb_limit(cohesion, degraded(integrity, p.friction, p.residual_friction), sigma)
    return 1.0 + (capped(abs(tau), sigma, p) - max(limit, 0.0)) / max(p.cohesion, no_strength)


@law
def _load_of_contact(p, options, plain, cracked, kappa, e, u_s, no_strength, block_stress):
    """Return the load of the bond of a contact, 1 at its strength, 0 where there is none.

    A softening bond breaks once in tension, and then, if its shear is brittle, once more where it would slide.
    """
    residual, w_c = p.residual_tensile_strength, p.critical_opening
    if not plain and cracked and p.brittle_shear and kappa < w_c:
        return softened_bond_load(options.general, p, kappa, e, p.shear_stiffness * u_s, no_strength)
    if cracked and (plain or residual == 0.0 or kappa > 0.0 or w_c > 0.0):
        return 0.0
    sigma = p.normal_stiffness * e
    if not plain and p.dilation > 0.0:  # the dilatancy of slip along the step reduces the tension
        sigma, _, _, _, _, _, _, _, _ = coulomb_return(p, options.general, plain, cracked, kappa, e, u_s, options)
    if cracked:
        return bond_load(sigma, residual, block_stress)
    load = bond_load(sigma, max(p.tensile_strength, no_strength), block_stress)
    if not plain and p.brittle_shear:
        limit = max(coulomb_limit(p.cohesion, p.friction, sigma), no_strength)
        load = max(load, capped(abs(p.shear_stiffness * u_s), sigma, p) / limit)
    return load


@law
def bond_loads(active, interfaces, properties, options, ground, history, displacement, no_strength, block_stress, load):
    """Fill the load of each bond, 1 at its strength, 0 where there is none; return the largest.

    Parameters
    ----------
    active, interfaces, properties, options, ground, history, displacement
        As ``damagepred.kernels.interface.internal_force.joint_forces``.
    no_strength : float
        Stress that breaks a bond without strength (Pa).
    block_stress : float
        Weight of a block over the largest area of a contact (Pa).
    load : array (m, q)
        Filled for active interfaces.
    """
    edges, offsets, areas = interfaces.edge, interfaces.contact_offset, interfaces.contact_area
    slips, openings, cracks, kappas = history.slip, history.dilatant_opening, history.cracked, history.kappa
    elastic, on_normal, on_shear, general = interfaces.elastic, ground.normal, ground.shear, options.general
    first_ground = edges.size - on_normal.shape[0]
    heaviest = 0.0
    for i in active:
        opening_i, shear_i, turn_i = interface_motion(edges[i], elastic, displacement, i)
        p = properties[i]
        plain = is_plain(p, general)
        for k in range(areas.shape[1]):
            u_n = opening_i + offsets[i, k] * turn_i - ground_at(on_normal, first_ground, i, k)
            u_s = shear_i - slips[i, k] - ground_at(on_shear, first_ground, i, k)
            cracked, kappa, e = cracks[i, k], kappas[i, k], u_n - openings[i, k]
            load[i, k] = _load_of_contact(p, options, plain, cracked, kappa, e, u_s, no_strength, block_stress)
            heaviest = max(heaviest, load[i, k])
    return heaviest


@law
def _elastic_shear_limit(general, p, cracked, sigma, options):
    """Return the shear limit of a contact whose bond has not softened (Pa)."""
    if general is None:
        return coulomb_limit(p.cohesion, p.friction, sigma)
    limit, _ = shear_limit(p, cracked, 1.0, sigma, 0.0, 0.0, options)
    return limit


@law
def check_elastic(
    listed, interfaces, properties, options, ground, history, displacement, no_strength, block_stress, slides, load
):
    """Check interfaces that are taken as elastic: find those that slide, are crushed or close their gap.

    Return their number, and the largest load of a bond. A bond within its strength may still slide.

    Parameters
    ----------
    listed : array of int
        The interfaces.
    interfaces, properties, options, ground, history, displacement, no_strength, block_stress, load
        As ``bond_loads``; loads are filled for those listed.
    slides : array of bool (m,)
        Whether an interface does any of these; set for those listed.
    """
    edges, offsets, areas = interfaces.edge, interfaces.contact_offset, interfaces.contact_area
    slips, openings, cracks, kappas = history.slip, history.dilatant_opening, history.cracked, history.kappa
    elastic, on_normal, on_shear, general = interfaces.elastic, ground.normal, ground.shear, options.general
    first_ground = edges.size - on_normal.shape[0]
    count, heaviest = 0, 0.0
    for i in listed:
        p, inelastic = properties[i], False
        opening_i, shear_i, turn_i = interface_motion(edges[i], elastic, displacement, i)
        plain = is_plain(p, general)
        for k in range(areas.shape[1]):
            u_n = opening_i + offsets[i, k] * turn_i - ground_at(on_normal, first_ground, i, k)
            u_s = shear_i - slips[i, k] - ground_at(on_shear, first_ground, i, k)
            cracked, kappa, e = cracks[i, k], kappas[i, k], u_n - openings[i, k]
            load[i, k] = _load_of_contact(p, options, plain, cracked, kappa, e, u_s, no_strength, block_stress)
            heaviest, sigma = max(heaviest, load[i, k]), p.normal_stiffness * e
            if p.gap > 0.0:
                inelastic |= sigma < 0.0  # closed here, whatever the other contacts do
                continue
            limit = _elastic_shear_limit(general, p, cracked, sigma, options)
            inelastic |= abs(p.shear_stiffness * u_s) > limit
            inelastic |= sigma < -p.compressive_strength
        slides[i] = inelastic
        count += inelastic
    return count, heaviest


@law
def joint_law_violation_of(general, properties, cracked, kappa, sigma, tau):
    """Return the largest stress by which contacts violate the joint law (Pa), 0 if none does.

    Parameters
    ----------
    general : bool or None
        See ``damagepred.kernels.joint.return_mapping.ReturnMapping``.
    properties : JointParameters
        Arrays (m,).
    cracked, kappa : array (m, q)
        History variables.
    sigma, tau : array (m, q)
        Normal stress, tension positive, and shear stress (Pa).
    """
    largest, known = 0.0, True
    for i in range(sigma.shape[0]):
        p = properties[i]
        for k in range(sigma.shape[1]):
            integrity = 0.0 if cracked[i, k] else 1.0
            if general is not None and cracked[i, k]:
                integrity = integrity_of(p, max(kappa[i, k], p.tensile_strength / p.normal_stiffness))
            tension = sigma[i, k] - degraded(integrity, p.tensile_strength, p.residual_tensile_strength)
            cohesion = degraded(integrity, p.cohesion, p.residual_cohesion)
            friction = degraded(integrity, p.friction, p.residual_friction)
            limit = max(coulomb_limit(cohesion, friction, sigma[i, k]), 0.0)
            if general is not None:
                limit = capped(limit, sigma[i, k], p)
            shear = abs(tau[i, k]) - limit
            known &= sigma[i, k] == sigma[i, k] and tau[i, k] == tau[i, k]
            largest = max(largest, max(tension, max(shear, -sigma[i, k] - p.compressive_strength)))
    return largest if known else np.nan
