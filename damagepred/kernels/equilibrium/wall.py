"""A wall and its state, as the steps of the quasi-static solver take them.

``Residual`` (solvers/quasi_static/residual.py) makes all of them. When the active fronts change, it makes a new
``Wall`` of the same arrays. Kernels change room, and the fields marked with their names; all others are constant.
"""

import numpy as np
from numba import from_dtype, types

from damagepred.kernels.concrete_section.structures import SECTIONS, SectionMemory
from damagepred.kernels.interface.kinematics import EDGE, ElasticSides
from damagepred.kernels.jit import kernel
from damagepred.kernels.joint.parameters import JOINT_PARAMETERS
from damagepred.kernels.linear.condensation import Condensation
from damagepred.kernels.linear.solver import SOLVE_TANGENT, Solver
from damagepred.kernels.structures import (
    FLAG_ROWS,
    FLAGS,
    FLOAT_PAIRS,
    FLOAT_ROWS,
    FLOATS,
    INTEGER_ROWS,
    INTEGERS,
    Structure,
)
from damagepred.kernels.zone.structures import BlockLaw


class Joints(Structure):
    """Interfaces and their joint law; arrays (m,) have one entry per interface."""

    edge = types.Array(from_dtype(EDGE), 1, "C")
    contact_offset = FLOAT_ROWS
    contact_area = FLOAT_ROWS
    """Contacts: place along the interface (m), and area (m2); (m, q)."""
    properties = types.Array(from_dtype(JOINT_PARAMETERS), 1, "C")
    elastic = types.BaseTuple.from_types([INTEGER_ROWS, FLOAT_PAIRS], ElasticSides)
    """Strains of the elastic blocks on both sides."""
    strain_stiffness = FLOATS
    first_strain = types.int64
    """Stiffness of their strains, and its first degree of freedom."""
    no_strength = types.float64
    block_stress = types.float64
    """Stress that breaks a bond without strength, and weight of a block over the largest area of a contact (Pa)."""


class History(Structure):
    """History variables of the contacts (m, q): arrays of a ``JointHistory``; only ``commit_history`` changes them."""

    slip = FLOAT_ROWS
    dilatant_opening = FLOAT_ROWS
    cracked = FLAG_ROWS
    kappa = FLOAT_ROWS


class Ground(Structure):
    """Displacement of the ground (g, q) under the last interfaces (m)."""

    normal = FLOAT_ROWS
    shear = FLOAT_ROWS


class TrescaBounds(Structure):
    """Given quantities of the Tresca problem (m, q): shear bound (Pa), dilatant opening and kappa (m)."""

    bound = FLOAT_ROWS
    dilatant_opening = FLOAT_ROWS
    kappa = FLOAT_ROWS


FORCES = types.void(
    Joints.kind, History.kind, Ground.kind, TrescaBounds.kind, INTEGERS, types.boolean, FLOATS, FLOATS, FLOAT_ROWS
)
BOND_LOADS = types.float64(Joints.kind, History.kind, Ground.kind, INTEGERS, FLOATS, FLOAT_ROWS)
SECTION_FORCES = types.void(SECTIONS, SectionMemory.kind, Joints.kind, FLOATS, FLOATS, FLOAT_ROWS, FLOAT_ROWS)
CHECK_ELASTIC = types.float64(Joints.kind, History.kind, Ground.kind, INTEGERS, FLOATS, FLAGS, FLOAT_ROWS)


class JointLaw(Structure):
    """Functions of the joints of one kind; see ``damagepred.kernels.equilibrium.joints``."""

    add_forces = types.FunctionType(FORCES)
    bond_loads = types.FunctionType(BOND_LOADS)
    check_elastic = types.FunctionType(CHECK_ELASTIC)


class SectionLaw(Structure):
    """Sections of a footing that cracks, and the function that only walls with them compile; ``empty`` in others."""

    present = types.boolean
    sections = SECTIONS
    values = FLOAT_ROWS
    """Room for deformation and forces of the sections (s, 6)."""
    add_forces = types.FunctionType(SECTION_FORCES)


class Components(Structure):
    """Components that resist: joints, sections of a footing that cracks, deformable blocks."""

    joints = Joints.kind
    law = JointLaw.kind
    bounds = TrescaBounds.kind
    footing = SectionLaw.kind
    blocks = BlockLaw.kind


class Interfaces(Structure):
    """Lists of interfaces."""

    all = INTEGERS
    active = INTEGERS
    """Interfaces of active fronts."""
    condensed = INTEGERS
    """Interfaces of condensed fronts."""
    jointed = INTEGERS
    """Active ones that follow the joint law, not the law of a concrete section."""
    moving = INTEGERS
    """Jointed ones that ground and supports move."""


class Bonds(Structure):
    """Loads of the bonds (m, q), 1 at the strength, and where the next one fails."""

    load = FLOAT_ROWS
    """At the last solution (``complete``, ``predict``, ``fill_bond_loads``)."""
    load_at_start = FLOAT_ROWS
    """Room for the loads at the start of a step (``interpolate_event``)."""
    slides = FLAGS
    """Condensed interfaces that leave the elastic range (``complete``)."""
    overloaded = INTEGERS
    """Room for interfaces with an overloaded bond."""


class Freedoms(Structure):
    """Degrees of freedom."""

    free = INTEGERS
    """Free ones of active fronts."""
    prescribed = INTEGERS
    per_weight = FLOATS
    """One over the reference force of each (1/N, 1/(N m))."""
    arms = FLOATS
    """Arms that make rotations comparable to displacements (m); 1 for displacements."""
    push = FLOATS
    weights = FLOATS
    """Force of unit loads of the jacks, and weights in the deflection that controls them; empty without jacks."""


class Wall(Structure):
    """A wall with its linear solver."""

    tolerance = types.float64
    """Largest unbalanced force in equilibrium over the mean block weight (1)."""
    newton_iterations = types.int64
    line_search_iterations = types.int64
    """Iterations of one attempt by Newton's method, with backtracking and with line search."""
    components = Components.kind
    bonds = Bonds.kind
    interfaces = Interfaces.kind
    freedoms = Freedoms.kind
    solver = Solver.kind
    condensation = Condensation.kind
    solve_tangent = types.FunctionType(SOLVE_TANGENT)
    stiffness = FLOAT_ROWS
    """Tangents D of the interfaces at the last residual (m, 9) (``wall_residual``)."""
    tangent = FLOAT_ROWS
    rate = FLOATS
    """Tangents at the last equilibrium, and force of the joints per load factor there (``store_tangent``)."""
    force = FLOATS
    room = FLOAT_ROWS
    pairs = FLOAT_ROWS
    """Room for the force on all degrees of freedom, for four vectors, and for two pairs of vectors."""


class State(Structure):
    """Loads and history of a state; ``fill_state`` puts another state in its place."""

    history = History.kind
    ground = Ground.kind
    other_ground = Ground.kind
    """Ground at the other end of a step: a small step ahead, or at the start of a predicted one."""
    sections = SectionMemory.kind
    plastic = FLOAT_ROWS
    """Plastic strain of the zones (z, 4)."""
    external = FLOATS
    """External load with condensed fronts, without jacks (N, N m)."""
    load = types.float64
    live = types.float64
    """Factors of dead and live load (1)."""
    deflection = types.float64
    """Deflection at the jacks (m), NaN where their load is given."""
    limit = types.float64
    """Displacement beyond which no equilibrium is sought (m)."""


@kernel
def fill_state(state, history, ground, other_ground, sections, plastic, external, load, live, deflection, limit):
    """Fill a state, once made, with the arrays of another one: far faster than making structures at each step."""
    inside = state.history
    inside.slip, inside.dilatant_opening, inside.cracked, inside.kappa = history
    state.ground.normal, state.ground.shear = ground
    state.other_ground.normal, state.other_ground.shear = other_ground
    state.sections.cracked, state.sections.plastic = sections
    state.plastic, state.external, state.load, state.live = plastic, external, load, live
    state.deflection, state.limit = deflection, limit


def empty_state() -> State:
    """State for ``fill_state``."""
    parts = {"history": History.empty(), "ground": Ground.empty(), "other_ground": Ground.empty()}
    arrays = {"sections": SectionMemory.empty(), "plastic": np.empty((0, 4)), "external": np.empty(0)}
    return State(**parts, **arrays, **dict.fromkeys(("load", "live", "deflection", "limit"), 0.0))
