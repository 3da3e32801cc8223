"""Footing as a beam under the wall, with its supports and jacks.

The beam is a chain of rigid segments, one under each brick of the first course unless shorter ones are chosen. Between
two segments an upright interface has the flexibility of the beam from the middle of one to the middle of the other.
About the middle of a piece of Timoshenko beam of length h it is diagonal: h / (E A) axially, h / (kappa G A) + h^3
/ (12 E I) across, h / (E I) in bending. So the chain is exact for loads at the middles of segments; for other loads the
error in bending is of the order of (h / L)^2. Segments do not shear between a support or jack and their middle: a share
h / L of the shear deflection is missing.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly.assembly import Assembly, rectangle
from damagepred.assembly.bond import Brick
from damagepred.assembly.interfaces import BEARING_WIDTH, Geometry
from damagepred.assembly.model import Jacks, JointProperties
from damagepred.assembly.section import concrete_sections
from damagepred.enumerations import ContactKind
from damagepred.kernels.concrete_section.structures import Sections
from damagepred.scene import Footing, Joint, Scene

SHEAR_AREA = 5.0 / 6.0  # share of a rectangle's area that carries shear, kappa
GUIDING_STIFFNESS = 1e-6  # shear stiffness over normal stiffness of supports that only guide a wall or footing
UNLIMITED_STRENGTH = 1e13  # strength (Pa) above any stress, and small enough for the laws to calculate with


UNBREAKABLE = Joint(tensile_strength=UNLIMITED_STRENGTH, cohesion=UNLIMITED_STRENGTH, friction=0.0)


class Foundation(NamedTuple):
    """Footing geometry and its supports."""

    model: str  # {"beam", "deformable"}: chain of segments, or one block of zones
    width: float  # cross-section (m)
    depth: float
    segment_length: float | None  # longest segment (m); None: one segment per brick of the first course
    zone_size: float  # largest edge of the cells (m)
    supports: tuple[float, ...]  # x of the supports (m)
    on_soil: bool  # whether the underside rests on the ground


def foundation(scene: Scene) -> Foundation | None:
    """Footing of a scene; None if the underside of the wall itself is moved."""
    footing, shape = scene.footing, scene.movement.shape
    if scene.footing_model == "none":
        return None
    return Foundation(
        model=scene.footing_model,
        width=footing.width,
        depth=footing.depth,
        segment_length=footing.segment_length,
        zone_size=scene.solver.zone_size_footing or footing.depth / _cells(scene),
        supports=scene.rig.support_places(scene.wall.length) if shape == "jacks" else (),
        on_soil=shape == "mound",
    )


def _cells(scene: Scene) -> int:
    """Default number of cells over the depth of a footing of zones: more where the footing bends freely."""
    if not scene.movement.prescribed:
        return 6
    return 2 if scene.solver.method == "quasi_static" else 4


def add_footing(
    assembly: Assembly, footing: Foundation, laid: Sequence[Brick], length: float, unit: float, bricks: Sequence[Brick]
) -> IntArray:
    """Add the blocks of a footing, join them to the bricks (whole or in halves), support them; return them in order."""
    if footing.model == "deformable":
        ends = np.array([0.0, length])
    else:
        ends = _segment_ends([brick for brick in laid if brick.course == 0], length, unit, footing.segment_length)
    size = footing.zone_size if footing.model == "deformable" else 0.0
    outlines = [rectangle(start, -footing.depth, end, 0.0) for start, end in itertools.pairwise(ends)]
    blocks = [assembly.add_block(o, zone_size=size, elastic=False, thickness=footing.width) for o in outlines]
    for start, end in itertools.pairwise(blocks):
        assembly.set_joint(start, end, Joint(), ContactKind.FOOTING_SECTION)
    for i in [i for i, brick in enumerate(bricks) if brick.course == 0]:
        for segment in np.flatnonzero((ends[:-1] < bricks[i].right - 1e-9) & (ends[1:] > bricks[i].left + 1e-9)):
            assembly.set_joint(blocks[segment], i, Joint(), ContactKind.FOOTING_INTERFACE)
    if footing.on_soil:
        assembly.rest_on_ground(blocks, kind=ContactKind.SOIL)
    for x in footing.supports:
        # where two segments meet, support both, so that mirrored walls get mirrored supports
        carrying = under(ends, x)
        for segment in carrying:
            assembly.bear(blocks[segment], x, width=BEARING_WIDTH / len(carrying))
    return np.array(blocks, dtype=np.int64)


def _segment_ends(lowest: Sequence[Brick], length: float, unit: float, longest: float | None) -> FloatArray:
    """Ends of the segments (m): at the ends of the bricks above; at most ``unit`` apart elsewhere."""
    ends = np.unique(np.round([0.0, length] + [x for b in lowest for x in (b.left, b.right)], 9))
    pieces = [ends[:1]]
    for start, end in itertools.pairwise(ends):
        built_on = any(b.left < end - 1e-6 and b.right > start + 1e-6 for b in lowest)
        most = longest or (end - start if built_on else unit)
        # ends are rounded: a difference of this size adds no segment
        count = max(1, int(np.ceil((end - start) / most * (1 - 1e-6))))
        pieces.append(start + (end - start) * (np.arange(count) + 1) / count)
    return np.concatenate(pieces)


def under(ends: FloatArray, x: float) -> IntArray:
    """Indices of the one or two segments at x (m)."""
    near = 1e-6 * float(ends[-1] - ends[0])
    covers = (ends[:-1] <= x + near) & (ends[1:] >= x - near)
    return np.flatnonzero(covers)


def section_law(
    properties: JointProperties, geometry: Geometry, footing: Footing
) -> tuple[JointProperties, Sections | None]:
    """Law of all interfaces, with the stiffness of the uncracked beam between segments; sections of concrete."""
    face, blocks = geometry.interfaces, geometry.blocks
    between = np.flatnonzero(face.kind == ContactKind.FOOTING_SECTION)
    if not between.size:
        return properties, None
    h = blocks.x[face.block_b[between]] - blocks.x[face.block_a[between]]
    sections = None
    area, second = footing.width * footing.depth, footing.width * footing.depth**3 / 12.0
    modulus = elastic = footing.elastic_modulus
    if footing.concrete is not None:
        sections = concrete_sections(between, h, footing)
        elastic = footing.concrete.concrete_modulus
        modulus = max(sections.axial_stiffness[0] / area, sections.bending_stiffness[0] / second)
    shear_modulus = elastic / (2.0 * (1.0 + footing.poisson_ratio))
    bending = elastic * second
    across = h / (SHEAR_AREA * shear_modulus * area) + h**3 / (12.0 * bending)
    normal, shear = properties.normal_stiffness.copy(), properties.shear_stiffness.copy()
    normal[between], shear[between] = modulus / h, 1.0 / (area * across)
    return properties._replace(normal_stiffness=normal, shear_stiffness=shear), sections


def soil_joint(scene: Scene) -> Joint:
    """Soil springs: compression and friction only."""
    loose, soil, kind = Joint(tensile_strength=0.0, cohesion=0.0), scene.soil, scene.movement.kind
    normal, shear = soil.stiffness(kind), soil.stiffness_along(kind)
    return replace(loose, normal_stiffness=normal, shear_stiffness=shear, friction=soil.friction)


def support_joint(scene: Scene, pulls: bool) -> Joint:
    """Supports, which guide the footing along the wall (small stiffness: no force acts there) and carry it."""
    stiffness = scene.rig.support_stiffness / (BEARING_WIDTH * scene.footing.width)
    strength = UNLIMITED_STRENGTH if pulls else 0.0
    bond = Joint(tensile_strength=strength, cohesion=strength, friction=0.0 if pulls else 1.0)
    return replace(bond, normal_stiffness=stiffness, shear_stiffness=GUIDING_STIFFNESS * stiffness)


def stops_at(scene: Scene) -> str:
    """Event that ends the path of a footing on jacks: "jacks" or "supports" carry no load any more; "" for none."""
    if not scene.rig.stop_at_zero:
        return ""
    if scene.rig.control == "load":
        return "supports"
    return "jacks" if scene.movement.kind == "dishing" else "supports"


Upward = Callable[[float], FloatArray]
"""x (m) -> weights of all degrees of freedom (size,) in the upward displacement of the footing at x."""


def upward(geometry: Geometry, segments: IntArray, size: int, *, top: bool = False) -> Upward:
    """Upward displacement of the footing as weights of all degrees of freedom; ``top``: of its upper side."""
    blocks, mesh = geometry.blocks, geometry.mesh
    zoned = mesh is not None and np.isin(segments, mesh.block).all()

    def of_beam(x: float) -> FloatArray:
        first = blocks.first_vertex[segments]
        corners = blocks.vertices[first[:, None] + np.arange(4), 0]
        ends = np.append(corners.min(axis=1), corners.max())
        weights = np.zeros(size)
        segment = under(ends, x)
        for block in segments[segment]:
            weights[3 * block + 1] += 1.0 / len(segment)
            weights[3 * block + 2] += (x - blocks.x[block]) / len(segment)
        return weights

    def of_zones(x: float) -> FloatArray:
        assert mesh is not None
        gridpoints = np.flatnonzero(mesh.gridpoint_block == segments[0])
        y = mesh.y[gridpoints]
        level = y.max() if top else y.min()
        row = gridpoints[np.abs(y - level) < 1e-9 * float(np.ptp(y))]
        row = row[np.argsort(mesh.x[row])]
        first = int(np.clip(np.searchsorted(mesh.x[row], x) - 1, 0, len(row) - 2))
        share = (x - mesh.x[row[first]]) / (mesh.x[row[first + 1]] - mesh.x[row[first]])
        weights = np.zeros(size)
        weights[mesh.dof_y[row[first]]] += 1.0 - share
        weights[mesh.dof_y[row[first + 1]]] += share
        return weights

    return of_zones if zoned else of_beam


def deflection_of(up: Upward, left: float, right: float) -> FloatArray:
    """Weights of all degrees of freedom in the upward deflection of the middle relative to two ends (m)."""
    return up(0.5 * (left + right)) - 0.5 * (up(left) + up(right))


def jacks_model(scene: Scene, up: Upward, deflection: FloatArray) -> Jacks:
    """Jacks of a rig that control a deflection, by its weights (size,)."""
    positions = scene.rig.jack_places(scene.wall.length)
    return Jacks(
        push=np.sum([up(x) for x in positions], axis=0),
        at=np.array(positions),
        ends=np.array(scene.rig.support_places(scene.wall.length))[[0, -1]],
        deflection=scene.movement.sign * scene.movement.central_deflection,
        load=scene.rig.jack_load or 0.0,
        by_load=scene.rig.control == "load",
        stop=stops_at(scene),
        weights=deflection,
    )
