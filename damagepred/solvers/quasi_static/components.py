"""Components of a wall that resist, as structures for the kernels of the quasi-static solver."""

from __future__ import annotations

import numpy as np

from damagepred.kernels.equilibrium.joints import JointSteps, add_section_forces
from damagepred.kernels.equilibrium.wall import Components, Joints, SectionLaw, TrescaBounds
from damagepred.kernels.interface.kinematics import ElasticSides
from damagepred.kernels.joint.limits import NO_LIMIT
from damagepred.kernels.zone.structures import BlockLaw
from damagepred.solvers.quasi_static.superelements import Superelements
from damagepred.solvers.system.discrete_system import DiscreteSystem


def make_components(
    system: DiscreteSystem, steps: JointSteps, superelements: Superelements | None, tolerance: float
) -> Components:
    """Joints, sections of a footing that cracks, and deformable blocks of a wall."""
    model, footing = system.model, SectionLaw.empty()
    shape = model.interfaces.contact_area.shape
    if model.sections is not None:
        values = np.zeros((len(model.sections.interface), 6))
        footing = SectionLaw(present=True, sections=model.sections, values=values, add_forces=add_section_forces)
    return Components(
        joints=_joints(system, tolerance),
        law=steps.law(),
        bounds=TrescaBounds(bound=np.full(shape, NO_LIMIT), dilatant_opening=np.zeros(shape), kappa=np.zeros(shape)),
        footing=footing,
        blocks=BlockLaw.empty() if superelements is None else superelements.law,
    )


def _joints(system: DiscreteSystem, tolerance: float) -> Joints:
    """Interfaces and joint law."""
    model, records = system.model, system.model.interface_records
    count = len(records.edge)
    return Joints(
        edge=records.edge,
        contact_offset=records.contact_offset,
        contact_area=records.contact_area,
        properties=records.properties,
        elastic=records.elastic or ElasticSides(np.full((count, 2), -1), np.zeros((count, 2, 3, 2))),
        strain_stiffness=system.strain_stiffness,
        first_strain=system.strain_dofs.start,
        block_stress=model.block_stress,
        # a bond without strength breaks at the first tension: one that balance, to its tolerance, does not explain
        no_strength=tolerance * model.block_stress,
    )
