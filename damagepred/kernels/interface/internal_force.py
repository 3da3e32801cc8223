"""Internal force and tangent stiffness of interfaces: the joint law integrated over their contacts."""

from damagepred.kernels.interface.kinematics import elastic_trial, interface_displacement, scatter_interface_force
from damagepred.kernels.jit import law
from damagepred.kernels.joint.limits import NO_LIMIT
from damagepred.kernels.joint.return_mapping import coulomb_return, is_plain, tresca_return
from damagepred.kernels.joint.softening import updated_kappa


@law
def joint_forces(
    active, interfaces, properties, options, ground, history, tresca, coulomb, displacement, force, stiffness
):
    """Add the internal force of interfaces to ``force``, and fill their tangent stiffness.

    Parameters
    ----------
    active : array of int
        The interfaces.
    interfaces, ground : InterfaceRecords, Ground
        Of the model, m interfaces with q contacts; the ground in its present state. See ``damagepred.assembly.model``.
    properties : JointParameters
        Arrays (m,).
    options : ReturnMapping
        Parameters of the return mapping.
    history : NamedTuple of arrays (m, q)
        History variables at the last equilibrium; see ``damagepred.solvers.state.joint_history``.
    tresca : tuple of array (m, q)
        Shear bound (Pa), dilatant opening (m) and kappa (m) of each contact in the Tresca problem.
    coulomb : bool
        Whether the Coulomb law holds, or the Tresca problem is solved.
    displacement, force : array (size,)
        Of the bodies (m, N, N m).
    stiffness : array (m, 9)
        Derivatives of normal force, shear force and moment of an interface with opening and shear at its middle and
        relative rotation, row by row (N/m, N, N m).
    """
    bound, dilatant_opening, kappa = tresca
    for i in active:
        middle = interface_displacement(interfaces, displacement, i)
        total_n, total_s, total_m = 0.0, 0.0, 0.0
        nn, ns, nm, sn, ss, sm, ms, mm = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        p = properties[i]
        plain = is_plain(p, options.general)
        for k in range(interfaces.contact_area.shape[1]):
            at, area = interfaces.contact_offset[i, k], interfaces.contact_area[i, k]
            u_n, u_s = elastic_trial(interfaces, ground, history, middle, i, k)
            cracked = history.cracked[i, k]
            if coulomb:
                e = u_n - history.dilatant_opening[i, k]
                sigma, tau, d_nn, d_ns, d_sn, d_ss, _, _, _ = coulomb_return(
                    p, options.general, plain, cracked, history.kappa[i, k], e, u_s, options
                )
            else:
                e = u_n - dilatant_opening[i, k]
                sigma, tau, d_nn, d_ns, d_sn, d_ss = tresca_return(
                    p, options.general, plain, cracked, kappa[i, k], bound[i, k], e, u_s, options
                )
            total_n += area * sigma
            total_s += area * tau
            total_m += area * at * sigma
            nn += area * d_nn
            ns += area * d_ns
            nm += area * at * d_nn
            sn += area * d_sn
            ss += area * d_ss
            sm += area * at * d_sn
            ms += area * at * d_ns
            mm += area * at * at * d_nn
        row = stiffness[i]
        row[0], row[1], row[2] = nn, ns, nm
        row[3], row[4], row[5] = sn, ss, sm
        row[6], row[7], row[8] = nm, ms, mm
        scatter_interface_force(interfaces, i, total_n, total_s, total_m, force)


@law
def update_tresca_bounds(active, interfaces, properties, options, ground, history, displacement, tresca, relaxation):
    """Set the shear bounds, dilatant openings and kappas of the Tresca problem from the Coulomb law at a displacement.

    Parameters
    ----------
    active, interfaces, properties, options, ground, history, displacement, tresca
        As ``joint_forces``; ``tresca`` is updated.
    relaxation : float
        Relaxation factor of the fixed point for bounds and dilatant openings, 0 to 1.
    """
    bound, dilatant_opening, kappa = tresca
    for i in active:
        middle = interface_displacement(interfaces, displacement, i)
        p = properties[i]
        plain = is_plain(p, options.general)
        for k in range(interfaces.contact_area.shape[1]):
            u_n, u_s = elastic_trial(interfaces, ground, history, middle, i, k)
            cracked, largest, old = history.cracked[i, k], history.kappa[i, k], bound[i, k]
            e = u_n - history.dilatant_opening[i, k]
            _, _, _, _, _, _, slip, dilatancy, limit = coulomb_return(
                p, options.general, plain, cracked, largest, e, u_s, options
            )
            bound[i, k] = max(limit if old >= 0.5 * NO_LIMIT else old + relaxation * (limit - old), 0.0)
            if plain:
                continue
            dilates = dilatancy if p.dilation > 0.0 else 0.0  # crushing is part of the energy
            dilatant_opening[i, k] += relaxation * (history.dilatant_opening[i, k] + dilates - dilatant_opening[i, k])
            if p.critical_opening > 0.0:
                reached, _ = updated_kappa(p, cracked, largest, e, slip, dilatancy)
                kappa[i, k] = max(kappa[i, k], reached)


@law
def contact_stresses(interfaces, properties, options, ground, history, displacement, opening, sigma, tau):
    """Fill opening (m), normal and shear stress (Pa) of all contacts.

    Parameters
    ----------
    interfaces, properties, options, ground, history, displacement
        As ``joint_forces``.
    opening, sigma, tau : array (m, q)
        Filled.
    """
    for i in range(interfaces.edge.size):
        middle = interface_displacement(interfaces, displacement, i)
        p = properties[i]
        plain = is_plain(p, options.general)
        for k in range(interfaces.contact_area.shape[1]):
            u_n, u_s = elastic_trial(interfaces, ground, history, middle, i, k)
            opening[i, k] = u_n
            cracked, e = history.cracked[i, k], u_n - history.dilatant_opening[i, k]
            sigma[i, k], tau[i, k], _, _, _, _, _, _, _ = coulomb_return(
                p, options.general, plain, cracked, history.kappa[i, k], e, u_s, options
            )
