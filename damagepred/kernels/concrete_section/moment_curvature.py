"""Moment-curvature diagram of one reinforced-concrete section."""

from damagepred.kernels.concrete_section.law import commit_section, section_response
from damagepred.kernels.jit import kernel


@kernel
def moment_curvature_diagram(sections, memory, curvature, axial_force, strains, moments):
    """Compute the moment-curvature diagram of section 0 under a constant axial force.

    At each curvature the strain that balances the axial force is found by bracketed Newton iterations, and committed.

    Parameters
    ----------
    sections : Sections
        See assembly/section.py; the first is bent.
    memory : SectionMemory
        History variables, changed in place.
    curvature : array (k,)
        In the order of bending, sagging positive (1/m).
    axial_force : float
        N, tension positive (N).
    strains, moments : array (k,)
        Filled: strain at mid-depth (1), moment, sagging positive (Nm).
    """
    strain = 0.0
    axial = sections.axial_stiffness[0]
    for i in range(curvature.size):
        # N grows with the strain: bracket, then Newton kept inside
        force, _, slope, _, _, _ = section_response(sections, 0, memory, strain, curvature[i])
        low, high = strain, strain
        width = 1e-6 + abs(axial_force - force) / axial
        while force > axial_force:
            high = low
            low -= width
            width *= 2.0
            force, _, slope, _, _, _ = section_response(sections, 0, memory, low, curvature[i])
        width = 1e-6 + abs(axial_force - force) / axial
        force, _, slope, _, _, _ = section_response(sections, 0, memory, high, curvature[i])
        while force < axial_force:
            low = high
            high += width
            width *= 2.0
            force, _, slope, _, _, _ = section_response(sections, 0, memory, high, curvature[i])
        strain = low if low == high else 0.5 * (low + high)
        for _ in range(200):
            force, _, slope, _, _, _ = section_response(sections, 0, memory, strain, curvature[i])
            if force > axial_force:
                high = strain
            else:
                low = strain
            excess = force - axial_force
            step = excess / slope if slope > 0.0 else 0.0
            if abs(excess) <= 1e-12 * axial * (abs(strain) + abs(curvature[i]) * sections.depth[0]):
                break
            if high - low <= 1e-15 * (abs(low) + abs(high)):
                break
            strain -= step
            if not low < strain < high or step == 0.0:
                strain = 0.5 * (low + high)
        _, moments[i], _, _, _, _ = section_response(sections, 0, memory, strain, curvature[i])
        strains[i] = strain
        commit_section(sections, 0, memory, strain, curvature[i])
