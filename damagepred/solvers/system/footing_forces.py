"""Internal forces of the footing and loads of its supports, from the contact stresses of an equilibrium."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.section import SectionMemory
from damagepred.enumerations import ContactKind
from damagepred.kernels.concrete_section.forces import section_values


class SectionForces(NamedTuple):
    """Deformation and internal forces of the footing's s sections, arrays (s,) or (increments, s).

    Attributes
    ----------
    strain, curvature : array
        At mid-depth, elongation positive (1), and sagging positive (1/m).
    axial_force, shear_force, moment : array
        Tension positive (N); upward force of the left part on the right (N); sagging positive, tension below (N m).
    """

    strain: FloatArray
    curvature: FloatArray
    axial_force: FloatArray
    shear_force: FloatArray
    moment: FloatArray


def section_interfaces(model: Model) -> IntArray:
    """Return the interfaces between segments of the footing (s,), left to right."""
    here = np.flatnonzero(model.interfaces.kind == ContactKind.FOOTING_SECTION)
    return here[np.argsort(model.interfaces.x[here])]


def section_lengths(model: Model, here: IntArray) -> FloatArray:
    """Return the tributary length of each section (m): from centre to centre of its segments.

    On the axis of a symmetric half it reaches from the axis to the centre of the segment.

    Parameters
    ----------
    model : Model
        The wall.
    here : array of int (s,)
        Interfaces of the sections.
    """
    face, x = model.interfaces, model.blocks.x
    on_axis = face.block_a[here] == model.n_blocks
    left = np.where(on_axis, face.x[here], np.append(x, 0.0)[face.block_a[here]])
    return np.asarray(x[face.block_b[here]] - left)


def section_forces(model: Model, opening: FloatArray, sigma: FloatArray, tau: FloatArray) -> SectionForces:
    """Return deformation and internal forces of the footing's sections.

    Parameters
    ----------
    model : Model
        m interfaces with q contacts.
    opening, sigma, tau : array (..., m, q)
        Opening (m), normal stress, tension positive, and shear stress (Pa) of all contacts.
    """
    here, face = section_interfaces(model), model.interfaces
    length, area, at = section_lengths(model, here), face.contact_area[here], face.contact_offset[here]
    opens, normal, shear = (values[..., here, :] for values in (opening, sigma, tau))
    whole = area.sum(axis=-1)
    middle = (opens * area).sum(axis=-1) / whole
    turn = (opens * area * at).sum(axis=-1) / (area * at**2).sum(axis=-1)
    return SectionForces(
        middle / length,
        turn / length,
        (normal * area).sum(axis=-1),
        (shear * area).sum(axis=-1),
        (normal * area * at).sum(axis=-1),
    )


def section_response_of(model: Model, memory: SectionMemory, displacement: FloatArray) -> FloatArray:
    """Return opening, shear (m), rotation, axial, shear force (N) and moment (N m) of cracking sections, array (s, 6).

    Parameters
    ----------
    model : Model
        With sections.
    memory : SectionMemory
        History variables of the sections.
    displacement : array (size,)
        Of all degrees of freedom.
    """
    assert model.sections is not None
    values = np.empty((len(model.sections.interface), 6))
    section_values(model.sections, memory, model.interface_records, model.properties, displacement, values)
    return values


def section_energy(model: Model, now: FloatArray, before: FloatArray | None) -> tuple[float, FloatArray]:
    """Return the energy of cracking sections less that of their contacts if whole, and the dissipation of a step (J).

    Work is integrated by the trapezoidal rule. Where the curvature changes its sign, the secant stiffness becomes that
    of the other face: the section unloads to the origin and reloads from there, which dissipates nothing. Dissipation
    is negative where the secant stiffness grows under load: under axial tension the cracks of the less stressed face
    close as the moment reverses, and the law follows its secant.

    Parameters
    ----------
    model : Model
        With sections; they unload to the origin along the secant, as long as no steel yields.
    now, before : array (s, 6)
        See ``section_response_of``; None before the first step.
    """
    assert model.sections is not None
    here, face, law = model.sections.interface, model.interfaces, model.properties
    opening, shear, turn = now[:, :3].T
    apart = opening[:, None] + face.contact_offset[here] * turn[:, None]
    squares = law.normal_stiffness[here, None] * apart**2 + law.shear_stiffness[here, None] * shear[:, None] ** 2
    as_whole = 0.5 * float((face.contact_area[here] * squares).sum())
    then = np.zeros_like(now) if before is None else before
    stored, was = (0.5 * (v[:, :3] * v[:, 3:]).sum(axis=1) for v in (now, then))
    work = 0.5 * ((now[:, 3:] + then[:, 3:]) * (now[:, :3] - then[:, :3])).sum(axis=1)
    reverses = turn * then[:, 2] < 0.0
    dissipated = np.where(reverses, 0.0, work - (stored - was))
    return float(stored.sum()) - as_whole, dissipated


def set_linear_stresses(model: Model, response: FloatArray, sigma: FloatArray, tau: FloatArray) -> None:
    """Set the stresses of cracking sections to linear distributions with the same resultants.

    Parameters
    ----------
    model : Model
        With sections.
    response : array (s, 6)
        See ``section_response_of``.
    sigma, tau : array (m, q)
        Stresses (Pa) of all contacts; those of the sections are replaced.
    """
    assert model.sections is not None
    here, face = model.sections.interface, model.interfaces
    area, at = face.contact_area[here], face.contact_offset[here]
    whole, second = area.sum(axis=1), (area * at**2).sum(axis=1)
    axial, across, moment = response[:, 3:].T
    sigma[here] = (axial / whole)[:, None] + (moment / second)[:, None] * at
    tau[here] = (across / whole)[:, None]


def support_loads(model: Model, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the places of the footing's supports (m), left to right, and their loads (N, upwards).

    Parameters
    ----------
    model : Model
        m interfaces with q contacts.
    sigma : array (..., m, q)
        Normal stress (Pa), tension positive.

    Returns
    -------
    tuple of array (p,), array (..., p)
    """
    here = np.flatnonzero(model.interfaces.kind == ContactKind.SUPPORT)
    load = -(sigma[..., here, :] * model.interfaces.contact_area[here]).sum(axis=-1)
    # where two segments meet, both bear on the one support
    at, which = np.unique(np.round(model.interfaces.x[here], 9), return_inverse=True)
    return at, load @ np.eye(len(at))[which.ravel()]


def outer_support_loads(model: Model, ends: FloatArray, sigma: FloatArray) -> FloatArray:
    """Return the loads of the supports at given places (N, upwards), left to right; see ``support_loads``.

    Parameters
    ----------
    model : Model
        m interfaces with q contacts.
    ends : array
        Places (m).
    sigma : array (m, q)
        Normal stress (Pa), tension positive.
    """
    at, load = support_loads(model, sigma)
    return load[np.isclose(at[:, None], ends, rtol=0.0, atol=1e-6).any(axis=1)]
