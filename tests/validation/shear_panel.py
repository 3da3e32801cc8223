"""The shear panel J4D of Raijmakers and Vermeltfoort, as an assembly of blocks."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from damagepred import Assembly, BlockMaterial, Joint
from damagepred.assembly.assembly import rectangle

THICKNESS, LENGTH, HEIGHT = 0.1, 0.99, 1.0
COURSES, MODULE = 16, 0.22
"""Courses between the clamps; a brick with its share of the joints around it (m)."""
PRELOAD = 0.30e6
"""Vertical preload (Pa)."""

BRITTLE = Joint(normal_stiffness=82e9, shear_stiffness=36e9, tensile_strength=0.25e6, cohesion=0.35e6, friction=0.75)
SOFT = replace(BRITTLE, fracture_energy=18.0)
"""Tension softens with the opening: 0.018 N/mm."""
SOFT_IN_SHEAR = replace(SOFT, shear_fracture_energy=125.0)
"""The bond also softens with slip: 0.125 N/mm."""
BRICK = BlockMaterial(elastic_modulus=16.7e9, poisson_ratio=0.15, density=2000.0)
STEEL = BlockMaterial(elastic_modulus=2e13, poisson_ratio=0.3, density=0.0)
"""The clamps of the panel: nearly rigid; their weight is part of the preload."""
BRICK_CRACK = Joint(normal_stiffness=1e15, shear_stiffness=1e15, tensile_strength=2.0e6, cohesion=2.8e6, friction=1.0)
"""The vertical joint in mid-brick in which a brick may crack; nearly rigid before. Its shear strength is assumed, and
not reached before its tensile strength."""


@dataclass(frozen=True)
class Panel:
    assembly: Assembly
    beam: int


def brick_edges(course: int, length: float, split: bool) -> np.ndarray:
    """Return the ends of the blocks of a course (m), and the joints in mid-brick."""
    joints = np.arange(MODULE if course % 2 else MODULE / 2, length - 1e-9, MODULE)
    edges = np.concatenate(([0.0], joints, [length]))
    if not split:
        return np.column_stack((edges, np.zeros(len(edges))))
    whole = np.diff(edges) > 0.75 * MODULE
    middles = (0.5 * (edges[:-1] + edges[1:]))[whole]
    everything = np.concatenate((edges, middles))
    kind = np.concatenate((np.zeros(len(edges)), np.ones(len(middles))))
    order = np.argsort(everything)
    return np.column_stack((everything[order], kind[order]))


def panel(
    joint: Joint = BRITTLE,
    push: float = 4e-3,
    *,
    bricks_crack: bool = False,
    courses: int = COURSES,
    length: float = LENGTH,
    preload: float = PRELOAD,
    brick_crack: Joint = BRICK_CRACK,
) -> Panel:
    """Return the panel: clamped courses below and above, compressed, then displaced along its top at fixed height."""
    height = HEIGHT / COURSES
    wall = Assembly(thickness=THICKNESS, joint=joint, block=BRICK)
    base = wall.add_block(rectangle(0.0, -height, length, 0.0), STEEL)
    wall.support(base)
    for course in range(courses):
        edges = brick_edges(course, length, bricks_crack)
        last = None
        for (left, in_brick), (right, _) in pairwise(edges):
            block = wall.add_block(rectangle(left, course * height, right, (course + 1) * height), course=course)
            if in_brick and last is not None:
                wall.set_joint(last, block, brick_crack)
            last = block
    top = courses * height
    beam = wall.add_block(rectangle(0.0, top, length, top + height), STEEL, course=courses)
    wall.load(beam, y=-preload * length * THICKNESS)
    wall.support(beam, x=True, y=False, rotation=True)
    wall.hold_after_load(beam, x=False, y=True, rotation=False)
    wall.move(beam, x=push)
    return Panel(wall, beam)
