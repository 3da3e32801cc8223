"""Sections of a concrete footing and their history, as structures for kernels."""

from damagepred.kernels.structures import FLOAT_BLOCKS, FLOAT_ROWS, FLOATS, INTEGERS, Structure


class Wires(Structure):
    """Wires of the sections; see ``damagepred.assembly.section.Wires``."""

    modulus = FLOATS
    strength = FLOATS
    hardening = FLOATS
    top_area = FLOATS
    bottom_area = FLOATS
    top_level = FLOATS
    bottom_level = FLOATS


class Sections(Structure):
    """Sections of a concrete footing; see ``damagepred.assembly.section.Sections``."""

    interface = INTEGERS
    length = FLOATS
    law = INTEGERS
    width = FLOATS
    depth = FLOATS
    concrete_modulus = FLOATS
    crushing_strain = FLOATS
    wires = Wires.kind
    tension_stiffening = FLOATS
    axial_stiffness = FLOATS
    coupled_stiffness = FLOATS
    bending_stiffness = FLOATS
    flexibility = FLOAT_ROWS
    pull = FLOAT_BLOCKS
    wires_pull = FLOAT_BLOCKS
    crush = FLOAT_BLOCKS
    first_cracked = FLOAT_BLOCKS
    cracked_second_moment = FLOAT_ROWS
    cracking_moment = FLOATS
    exponent = FLOATS


class SectionMemory(Structure):
    """History variables of the sections (s, 2); see ``damagepred.assembly.section.SectionMemory``."""

    cracked = FLOAT_ROWS
    plastic = FLOAT_ROWS
