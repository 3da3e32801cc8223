"""Forces of footing sections that follow a law of their own, in place of that of their contacts."""

from damagepred.kernels.concrete_section.law import commit_section, section_response
from damagepred.kernels.interface.kinematics import interface_displacement, scatter_interface_force
from damagepred.kernels.jit import kernel, law


@law
def across(interfaces, properties, i):
    """Return the shear stiffness of an interface of the footing (N/m): that of the joint times contact area.

    Parameters
    ----------
    interfaces, properties : InterfaceRecords, NamedTuple of arrays
        Of the model, m interfaces; contact areas (m2), shear stiffness (Pa/m).
    i : int
        The interface.
    """
    area = 0.0
    for k in range(interfaces.contact_area.shape[1]):
        area += interfaces.contact_area[i, k]
    return properties.shear_stiffness[i] * area


@kernel
def section_forces(sections, memory, interfaces, properties, displacement, force, stiffness):
    """Add the internal forces of reinforced-concrete sections to ``force``, and fill the tangent of their interfaces.

    Parameters
    ----------
    sections, memory : NamedTuple of arrays
        See ``damagepred.assembly.section``.
    interfaces, properties, displacement, force, stiffness
        As in ``damagepred.kernels.interface.internal_force.joint_forces``.
    """
    for s in range(sections.interface.size):
        i, h = sections.interface[s], sections.length[s]
        opening, shear, turn = interface_displacement(interfaces, displacement, i)
        axial, moment, nn, nm, mn, mm = section_response(sections, s, memory, opening / h, turn / h)
        ss = across(interfaces, properties, i)
        transverse = ss * shear
        row = stiffness[i]
        row[0], row[1], row[2] = nn / h, 0.0, nm / h
        row[3], row[4], row[5] = 0.0, ss, 0.0
        row[6], row[7], row[8] = mn / h, 0.0, mm / h
        scatter_interface_force(interfaces, i, axial, transverse, moment, force)


@kernel
def commit_sections(sections, memory, interfaces, displacement):
    """Commit the history variables of all sections at an equilibrium.

    Parameters
    ----------
    sections, memory : NamedTuple of arrays
        Sections and their history variables, changed in place; see ``damagepred.assembly.section``.
    interfaces : InterfaceRecords
        Of the model.
    displacement : array (size,)
        At the equilibrium, of all degrees of freedom (m, rad).
    """
    for s in range(sections.interface.size):
        opening, _, turn = interface_displacement(interfaces, displacement, sections.interface[s])
        commit_section(sections, s, memory, opening / sections.length[s], turn / sections.length[s])


@kernel
def section_values(sections, memory, interfaces, properties, displacement, values):
    """Fill the deformations and internal forces of all sections.

    Parameters
    ----------
    sections, memory : NamedTuple of arrays
        Sections, s of them, and their history variables; see ``damagepred.assembly.section``.
    interfaces, properties : InterfaceRecords, NamedTuple of arrays
        Of the model.
    displacement : array (size,)
        Of all degrees of freedom (m, rad).
    values : array (s, 6)
        Filled: opening, shear (m), rotation (rad), axial force, shear force (N), moment (N m); tension and sagging
        positive.
    """
    for s in range(sections.interface.size):
        i, h = sections.interface[s], sections.length[s]
        opening, shear, turn = interface_displacement(interfaces, displacement, i)
        axial, moment, _, _, _, _ = section_response(sections, s, memory, opening / h, turn / h)
        values[s, 0], values[s, 1], values[s, 2] = opening, shear, turn
        values[s, 3], values[s, 4], values[s, 5] = axial, across(interfaces, properties, i) * shear, moment
