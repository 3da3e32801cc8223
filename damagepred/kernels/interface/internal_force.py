"""Internal force and tangent stiffness of interfaces: the joint law integrated over their contacts.

``joints``, ``history``, ``ground`` and ``bounds`` are structures of ``damagepred.kernels.equilibrium.wall``.
``general`` is None in a wall of plain joints (``is_plain``). i is an interface, k one of its contacts.
"""

from damagepred.kernels.interface.kinematics import ground_at, interface_displacement, scatter_interface_force
from damagepred.kernels.jit import law
from damagepred.kernels.joint.limits import NO_LIMIT
from damagepred.kernels.joint.return_mapping import coulomb_return, is_plain, tresca_return
from damagepred.kernels.joint.softening import updated_kappa


@law
def joint_forces(listed, joints, general, ground, history, bounds, coulomb, displacement, force, stiffness):
    """Add the forces of listed interfaces by the Coulomb law or the Tresca problem; fill their tangents D (m, 9)."""
    edges, offsets, areas, properties = joints.edge, joints.contact_offset, joints.contact_area, joints.properties
    slips, openings, cracks, kappas = history.slip, history.dilatant_opening, history.cracked, history.kappa
    elastic, on_normal, on_shear = joints.elastic, ground.normal, ground.shear
    first_ground = edges.size - on_normal.shape[0]
    bound, dilatant_opening, kappa = bounds.bound, bounds.dilatant_opening, bounds.kappa
    for i in listed:
        opening_i, shear_i, turn_i = interface_displacement(edges[i], elastic, displacement, i)
        total_n, total_s, total_m = 0.0, 0.0, 0.0
        nn, ns, nm, sn, ss, sm, ms, mm = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        p = properties[i]
        plain = is_plain(p, general)
        for k in range(areas.shape[1]):
            offset, area = offsets[i, k], areas[i, k]
            u_n = opening_i + offsets[i, k] * turn_i - ground_at(on_normal, first_ground, i, k)
            u_s = shear_i - slips[i, k] - ground_at(on_shear, first_ground, i, k)
            cracked = cracks[i, k]
            if coulomb:
                e = u_n - openings[i, k]
                sigma, tau, d_nn, d_ns, d_sn, d_ss, _, _, _ = coulomb_return(
                    p, general, plain, cracked, kappas[i, k], e, u_s
                )
            else:
                e = u_n - dilatant_opening[i, k]
                sigma, tau, d_nn, d_ns, d_sn, d_ss = tresca_return(
                    p, general, plain, cracked, kappa[i, k], bound[i, k], e, u_s
                )
            total_n += area * sigma
            total_s += area * tau
            total_m += area * offset * sigma
            nn += area * d_nn
            ns += area * d_ns
            nm += area * offset * d_nn
            sn += area * d_sn
            ss += area * d_ss
            sm += area * offset * d_sn
            ms += area * offset * d_ns
            mm += area * offset * offset * d_nn
        row = stiffness[i]
        row[0], row[1], row[2] = nn, ns, nm
        row[3], row[4], row[5] = sn, ss, sm
        row[6], row[7], row[8] = nm, ms, mm
        scatter_interface_force(edges[i], elastic, i, total_n, total_s, total_m, force)


@law
def update_tresca_bounds(listed, joints, general, ground, history, displacement, bounds, relaxation):
    """Move bounds and dilatant openings by a share of the way to the Coulomb law at a displacement; kappas grow."""
    edges, offsets, areas, properties = joints.edge, joints.contact_offset, joints.contact_area, joints.properties
    slips, openings, cracks, kappas = history.slip, history.dilatant_opening, history.cracked, history.kappa
    elastic, on_normal, on_shear = joints.elastic, ground.normal, ground.shear
    first_ground = edges.size - on_normal.shape[0]
    bound, dilatant_opening, kappa = bounds.bound, bounds.dilatant_opening, bounds.kappa
    for i in listed:
        opening_i, shear_i, turn_i = interface_displacement(edges[i], elastic, displacement, i)
        p = properties[i]
        plain = is_plain(p, general)
        for k in range(areas.shape[1]):
            u_n = opening_i + offsets[i, k] * turn_i - ground_at(on_normal, first_ground, i, k)
            u_s = shear_i - slips[i, k] - ground_at(on_shear, first_ground, i, k)
            cracked, largest, old = cracks[i, k], kappas[i, k], bound[i, k]
            e = u_n - openings[i, k]
            _, _, _, _, _, _, slip, dilatancy, limit = coulomb_return(p, general, plain, cracked, largest, e, u_s)
            bound[i, k] = max(limit if old >= 0.5 * NO_LIMIT else old + relaxation * (limit - old), 0.0)
            if plain:
                continue
            dilates = dilatancy if p.dilation > 0.0 else 0.0  # crushing is part of the energy
            dilatant_opening[i, k] += relaxation * (openings[i, k] + dilates - dilatant_opening[i, k])
            if p.critical_opening > 0.0:
                reached, _ = updated_kappa(p, cracked, largest, e, slip, dilatancy)
                kappa[i, k] = max(kappa[i, k], reached)


@law
def contact_stresses(joints, general, ground, history, displacement, opening, sigma, tau):
    """Fill opening (m), normal and shear stress (Pa) of all contacts."""
    edges, offsets, areas, properties = joints.edge, joints.contact_offset, joints.contact_area, joints.properties
    slips, openings, cracks, kappas = history.slip, history.dilatant_opening, history.cracked, history.kappa
    elastic, on_normal, on_shear = joints.elastic, ground.normal, ground.shear
    first_ground = edges.size - on_normal.shape[0]
    for i in range(edges.size):
        opening_i, shear_i, turn_i = interface_displacement(edges[i], elastic, displacement, i)
        p = properties[i]
        plain = is_plain(p, general)
        for k in range(areas.shape[1]):
            u_n = opening_i + offsets[i, k] * turn_i - ground_at(on_normal, first_ground, i, k)
            u_s = shear_i - slips[i, k] - ground_at(on_shear, first_ground, i, k)
            opening[i, k] = u_n
            cracked, e = cracks[i, k], u_n - openings[i, k]
            sigma[i, k], tau[i, k], _, _, _, _, _, _, _ = coulomb_return(
                p, general, plain, cracked, kappas[i, k], e, u_s
            )
