"""Internal forces of the footing and loads of its supports, from the contact stresses of an equilibrium."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.section import SectionMemory
from damagepred.enumerations import ContactKind
from damagepred.kernels.concrete_section.forces import section_forces as section_forces_of


class SectionForces(NamedTuple):
    """Deformation and internal forces of the footing's s sections, arrays (s,) or (increments, s)."""

    strain: FloatArray  # at mid-depth, elongation positive (1)
    curvature: FloatArray  # sagging positive (1/m)
    axial_force: FloatArray  # tension positive (N)
    shear_force: FloatArray  # upward force of the left part on the right (N)
    moment: FloatArray  # sagging positive, tension below (N m)


def section_interfaces(model: Model) -> IntArray:
    """Interfaces between segments of the footing (s,), left to right."""
    sections = np.flatnonzero(model.interfaces.kind == ContactKind.FOOTING_SECTION)
    return sections[np.argsort(model.interfaces.x[sections])]


def section_lengths(model: Model, sections: IntArray) -> FloatArray:
    """Tributary length of each section (m), centre to centre of its segments; from the axis of a symmetric half."""
    face, x = model.interfaces, model.blocks.x
    on_axis = face.block_a[sections] == model.n_blocks
    left_centre = np.where(on_axis, face.x[sections], np.append(x, 0.0)[face.block_a[sections]])
    return np.asarray(x[face.block_b[sections]] - left_centre)


def section_forces(model: Model, opening: FloatArray, sigma: FloatArray, tau: FloatArray) -> SectionForces:
    """Deformation and internal forces of the footing's sections."""
    sections, face = section_interfaces(model), model.interfaces
    length, area, offset = section_lengths(model, sections), face.contact_area[sections], face.contact_offset[sections]
    opens, normal, shear = (values[..., sections, :] for values in (opening, sigma, tau))
    whole = area.sum(axis=-1)
    middle = (opens * area).sum(axis=-1) / whole
    turn = (opens * area * offset).sum(axis=-1) / (area * offset**2).sum(axis=-1)
    return SectionForces(
        strain=middle / length,
        curvature=turn / length,
        axial_force=(normal * area).sum(axis=-1),
        shear_force=(shear * area).sum(axis=-1),
        moment=(normal * area * offset).sum(axis=-1),
    )


def section_response_of(model: Model, memory: SectionMemory, displacement: FloatArray) -> FloatArray:
    """Opening, shear (m), rotation, axial and shear force (N) and moment (N m) of cracking sections (s, 6)."""
    assert model.sections is not None
    force, stiffness = np.zeros(model.size), np.zeros((len(model.interfaces.kind), 9))
    values = np.empty((len(model.sections.interface), 6))
    section_forces_of(model.sections, memory, model.interface_records, displacement, force, stiffness, values)
    return values


def section_energy(model: Model, now: FloatArray, before: FloatArray | None) -> tuple[float, FloatArray]:
    """Energy of cracking sections less the energy of their contacts if whole, and the dissipation of a step (J)."""
    # work by the trapezoidal rule; where the curvature changes sign, the section unloads to the origin and reloads with
    # the secant of the other face without dissipation; under axial tension, dissipation is negative where cracks close
    assert model.sections is not None
    sections, face, law = model.sections.interface, model.interfaces, model.properties
    opening, shear, turn = now[:, :3].T
    apart = opening[:, None] + face.contact_offset[sections] * turn[:, None]
    squares = (
        law.normal_stiffness[sections, None] * apart**2 + law.shear_stiffness[sections, None] * shear[:, None] ** 2
    )
    as_whole = 0.5 * float((face.contact_area[sections] * squares).sum())
    then = np.zeros_like(now) if before is None else before
    stored, was = (0.5 * (v[:, :3] * v[:, 3:]).sum(axis=1) for v in (now, then))
    work = 0.5 * ((now[:, 3:] + then[:, 3:]) * (now[:, :3] - then[:, :3])).sum(axis=1)
    reverses = turn * then[:, 2] < 0.0
    dissipated = np.where(reverses, 0.0, work - (stored - was))
    return float(stored.sum()) - as_whole, dissipated


def set_linear_stresses(model: Model, response: FloatArray, sigma: FloatArray, tau: FloatArray) -> None:
    """Set the contact stresses of cracking sections to linear distributions with the same resultants."""
    assert model.sections is not None
    sections, face = model.sections.interface, model.interfaces
    area, offset = face.contact_area[sections], face.contact_offset[sections]
    whole, second = area.sum(axis=1), (area * offset**2).sum(axis=1)
    axial, across, moment = response[:, 3:].T
    sigma[sections] = (axial / whole)[:, None] + (moment / second)[:, None] * offset
    tau[sections] = (across / whole)[:, None]


def support_loads(model: Model, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Positions of the footing's supports (m), left to right, and their loads (N, upwards)."""
    supports = np.flatnonzero(model.interfaces.kind == ContactKind.SUPPORT)
    load = -(sigma[..., supports, :] * model.interfaces.contact_area[supports]).sum(axis=-1)
    # two segments that meet share one support
    x, which = np.unique(np.round(model.interfaces.x[supports], 9), return_inverse=True)
    return x, load @ np.eye(len(x))[which.ravel()]


def outer_support_loads(model: Model, ends: FloatArray, sigma: FloatArray) -> FloatArray:
    """Loads of the supports at given positions (N, upwards), left to right."""
    x, load = support_loads(model, sigma)
    return load[np.isclose(x[:, None], ends, rtol=0.0, atol=1e-6).any(axis=1)]
