"""Sections of a concrete footing and their history, in the form that kernels read."""

from typing import NamedTuple

from numba import types

from damagepred.arrays import FloatArray, IntArray
from damagepred.kernels.structures import FLOAT_BLOCKS, FLOAT_ROWS, FLOATS, INTEGERS, Structure


class Wires(NamedTuple):
    """Wires at top and bottom of s sections: stiffness, yield strength, stress per plastic strain, areas, levels."""

    modulus: FloatArray  # (s,): E_s, yield strength, and stress per plastic strain after yield (Pa)
    strength: FloatArray
    hardening: FloatArray
    top_area: FloatArray  # (s,): area (m2), level (m); the top level is negative
    bottom_area: FloatArray
    top_level: FloatArray
    bottom_level: FloatArray


class Sections(NamedTuple):
    """Sections of a reinforced-concrete beam (s,), each between two segments; depths (m) are below mid-depth."""

    interface: IntArray  # (s,): number of the interface in the model
    length: FloatArray  # (s,): length of beam it stands for (m): opening = strain x length, turn = curvature x length
    law: IntArray  # (s,): CRACKED or BRANSON of kernels/concrete_section/law.py
    width: FloatArray  # (s,): concrete (m)
    depth: FloatArray
    concrete_modulus: FloatArray  # (s,): E_c (Pa), f'c / E_c (1)
    crushing_strain: FloatArray
    wires: Wires
    tension_stiffening: FloatArray  # (s,): beta (1)
    # (s,): of the uncracked section about mid-depth (N, Nm, Nm2), with its steel for "cracked": N = axial x
    # strain + coupled x curvature, M = coupled x strain + bending x curvature
    axial_stiffness: FloatArray
    coupled_stiffness: FloatArray
    bending_stiffness: FloatArray
    # (s, 3): inverse of the stiffness with moment / depth and curvature x depth: f11, f12, f22 (1/N)
    flexibility: FloatArray
    # (s, 2, 2): cracking of top and bottom: r per N of axial force, and of moment / depth (1/N), by the tensile
    # strength of concrete, and by ``USABLE_STRENGTH`` of the strength of the wires
    pull: FloatArray
    wires_pull: FloatArray
    crush: FloatArray  # (s, 2, 2): likewise its pressure over ``USABLE_STRENGTH`` f'c (1/N)
    # (s, 2, 2): mid-depth strain and curvature x depth of the cracked state at first cracking of top and
    # bottom, N = 0
    first_cracked: FloatArray
    # (s, 2): I_cr, with the top and with the bottom in tension, in terms of concrete (m4), at most I_g
    cracked_second_moment: FloatArray
    cracking_moment: FloatArray  # (s,): M_cr = f_ct I_g / (depth / 2) (Nm), Branson
    exponent: FloatArray  # (s,): Branson (1)
    earlier_moment: FloatArray  # (s,): earlier bending moment, in both directions (Nm)


_KINDS = dict.fromkeys(Sections._fields, FLOATS) | {"interface": INTEGERS, "law": INTEGERS}
_KINDS["wires"] = types.BaseTuple.from_types([FLOATS] * len(Wires._fields), Wires)
_KINDS |= dict.fromkeys(("flexibility", "cracked_second_moment"), FLOAT_ROWS)
_KINDS |= dict.fromkeys(("pull", "wires_pull", "crush", "first_cracked"), FLOAT_BLOCKS)
SECTIONS = types.BaseTuple.from_types(list(_KINDS.values()), Sections)
"""Type of ``Sections`` in signatures and structures."""


class SectionMemory(Structure):
    """History variables of the sections (s, 2); see ``damagepred.assembly.section.SectionMemory``."""

    cracked = FLOAT_ROWS
    plastic = FLOAT_ROWS
