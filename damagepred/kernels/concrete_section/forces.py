"""Forces of reinforced-concrete footing sections, whose law replaces the joint law of their contacts."""

from damagepred.kernels.concrete_section.law import commit_section, section_response
from damagepred.kernels.interface.kinematics import interface_displacement, scatter_interface_force
from damagepred.kernels.jit import kernel


@kernel
def section_forces(sections, memory, interfaces, displacement, force, stiffness, values):
    """Add the internal forces of the sections to ``force``, and fill the tangent of their interfaces.

    ``values`` takes opening, shear (m), rotation, axial and shear force (N) and moment (N m) of each section, (s, 6).
    """
    for s in range(sections.interface.size):
        i, h = sections.interface[s], sections.length[s]
        opening, shear, turn = interface_displacement(interfaces.edge[i], interfaces.elastic, displacement, i)
        axial, moment, nn, nm, mn, mm = section_response(sections, s, memory, opening / h, turn / h)
        ss = interfaces.properties[i].shear_stiffness * interfaces.contact_area[i].sum()
        transverse = ss * shear
        row = stiffness[i]
        row[0], row[1], row[2] = nn / h, 0.0, nm / h
        row[3], row[4], row[5] = 0.0, ss, 0.0
        row[6], row[7], row[8] = mn / h, 0.0, mm / h
        scatter_interface_force(interfaces.edge[i], interfaces.elastic, i, axial, transverse, moment, force)
        values[s, 0], values[s, 1], values[s, 2] = opening, shear, turn
        values[s, 3], values[s, 4], values[s, 5] = axial, transverse, moment


@kernel
def commit_sections(sections, memory, interfaces, displacement):
    """Commit the history variables of all sections at an equilibrium."""
    for s in range(sections.interface.size):
        i = sections.interface[s]
        opening, _, turn = interface_displacement(interfaces.edge[i], interfaces.elastic, displacement, i)
        commit_section(sections, s, memory, opening / sections.length[s], turn / sections.length[s])
