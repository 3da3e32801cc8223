"""The footing as a structure of its own: a beam under the wall, what carries it and what pushes it.

The beam is a chain of rigid segments, one under each brick of the first course unless they are to be shorter. Between
two segments an upright interface has the flexibility of the beam from the middle of one to the middle of the other.
About the middle of a piece of Timoshenko beam of length h that is diagonal: h / (E A) axially, h / (kappa G A) + h^3
/ (12 E I) across, h / (E I) in bending. So the chain has no error of its own where loads act on segments' middles,
and in bending one of the order of (h / L)^2 where they are spread or act elsewhere. Segments do not shear between a
support or a jack and their middles: of what shear adds to the deflection, h / L is missing.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly.assembly import BEARING_WIDTH, Assembly, rectangle
from damagepred.assembly.bond import Brick
from damagepred.assembly.interfaces import Geometry
from damagepred.assembly.model import Jacks, JointProperties
from damagepred.assembly.section import Sections, concrete_sections
from damagepred.enumerations import ContactKind
from damagepred.scene import Footing, Joint, Scene

SHEAR_AREA = 5.0 / 6.0
"""Share of a rectangle's area that carries shear, kappa."""
UNLIMITED_STRENGTH = 1e13
"""Strength (Pa) above any stress, and small enough for the laws to calculate with."""


class Foundation(NamedTuple):
    """What of a footing shapes the geometry, and how it is carried.

    Attributes
    ----------
    model : {"beam", "deformable"}
        A beam of segments, or one block of zones.
    width, depth : float
        Cross-section (m).
    segment_length : float or None
        Longest segment of the beam (m); None: a segment for each brick of the first course.
    zone_size : float
        Of the block of zones (m).
    supports : tuple of float
        Where it bears on supports (m).
    on_soil : bool
        Whether its underside rests on the ground.
    """

    model: str
    width: float
    depth: float
    segment_length: float | None
    zone_size: float
    supports: tuple[float, ...]
    on_soil: bool


def foundation(scene: Scene) -> Foundation | None:
    """Return the footing of a scene as the geometry takes it; None if the wall's underside itself is moved."""
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
    """Return how many cells of zones a footing has over its depth unless it is said: more where they bend it freely."""
    if not scene.movement.prescribed:
        return 6
    return 2 if scene.solver.method == "quasi_static" else 4


def add_footing(
    assembly: Assembly, found: Foundation, bricks: Sequence[Brick], length: float, unit: float, *, alone: bool = False
) -> IntArray:
    """Add the blocks of a footing to a wall, join them, and support them on bearings or ground.

    Parameters
    ----------
    assembly : Assembly
        With the bricks, by their number.
    found : Foundation
        The footing.
    bricks : sequence of Brick
        Of the wall.
    length, unit : float
        Of the wall, and of a brick (m).
    alone : bool
        Whether the bricks are not there, and only tell where segments end.

    Returns
    -------
    array of int
        Its blocks, left to right.
    """
    lowest = [i for i, brick in enumerate(bricks) if brick.course == 0]
    if found.model == "deformable":
        ends = np.array([0.0, length])
    else:
        ends = _segment_ends([bricks[i] for i in lowest], length, unit, found.segment_length)
    size = found.zone_size if found.model == "deformable" else 0.0
    blocks = [
        assembly.add_block(
            rectangle(left, -found.depth, right, 0.0), zone_size=size, elastic=False, thickness=found.width
        )
        for left, right in itertools.pairwise(ends)
    ]
    for left, right in itertools.pairwise(blocks):
        assembly.set_joint(left, right, Joint(), ContactKind.FOOTING_SECTION)
    for i in [] if alone else lowest:
        for at in np.flatnonzero((ends[:-1] < bricks[i].right - 1e-9) & (ends[1:] > bricks[i].left + 1e-9)):
            assembly.set_joint(blocks[at], i, Joint(), ContactKind.FOOTING_INTERFACE)
    if found.on_soil:
        assembly.rest_on_ground(blocks, kind=ContactKind.SOIL)
    for x in found.supports:
        # where two segments meet, both are carried: else a wall were not its own mirror image
        here = under(ends, x)
        for at in here:
            assembly.bear(blocks[at], x, width=BEARING_WIDTH / len(here))
    return np.array(blocks, dtype=np.int64)


def _segment_ends(lowest: Sequence[Brick], length: float, unit: float, longest: float | None) -> FloatArray:
    """Return where the segments of a beam end (m): at the ends of the bricks above; ``unit`` long elsewhere."""
    ends = np.unique(np.round([0.0, length] + [x for b in lowest for x in (b.left, b.right)], 9))
    pieces = [ends[:1]]
    for left, right in itertools.pairwise(ends):
        built_on = any(b.left < right - 1e-6 and b.right > left + 1e-6 for b in lowest)
        most = longest or (right - left if built_on else unit)
        # ends are rounded: what is longer by no more than that is not cut
        count = max(1, int(np.ceil((right - left) / most * (1 - 1e-6))))
        pieces.append(left + (right - left) * (np.arange(count) + 1) / count)
    return np.concatenate(pieces)


def under(ends: FloatArray, x: float) -> IntArray:
    """Return which segments are at a place (m): one, or the two that meet there.

    Parameters
    ----------
    ends : array of float
        Ends of the segments, left to right (m).
    x : float
        Place along the wall (m).
    """
    near = 1e-6 * float(ends[-1] - ends[0])
    here = (ends[:-1] <= x + near) & (ends[1:] >= x - near)
    return np.flatnonzero(here)


def section_law(
    properties: JointProperties, geometry: Geometry, footing: Footing
) -> tuple[JointProperties, Sections | None]:
    """Return the law of all interfaces, those between segments being elastic with the stiffness of the beam.

    Reinforced concrete has sections with a law of their own besides; their interfaces get the stiffness of the whole,
    uncracked section, in bending and axially the larger of the two.

    Parameters
    ----------
    properties : JointProperties
        Of all m interfaces.
    geometry : Geometry
        With segments, the interfaces between which are of kind FOOTING_SECTION.
    footing : Footing
        Cross-section and material.
    """
    face, blocks = geometry.interfaces, geometry.blocks
    here = np.flatnonzero(face.kind == ContactKind.FOOTING_SECTION)
    if not here.size:
        return properties, None
    h = blocks.x[face.block_b[here]] - blocks.x[face.block_a[here]]
    sections = None
    area, second = footing.width * footing.depth, footing.width * footing.depth**3 / 12.0
    modulus = elastic = footing.elastic_modulus
    if footing.concrete is not None:
        sections = concrete_sections(here, h, footing)
        elastic = footing.concrete.concrete_modulus
        modulus = max(sections.axial_stiffness[0] / area, sections.bending_stiffness[0] / second)
    shear_modulus = elastic / (2.0 * (1.0 + footing.poisson_ratio))
    bending = elastic * second
    across = h / (SHEAR_AREA * shear_modulus * area) + h**3 / (12.0 * bending)
    normal, shear = properties.normal_stiffness.copy(), properties.shear_stiffness.copy()
    normal[here], shear[here] = modulus / h, 1.0 / (area * across)
    return properties._replace(normal_stiffness=normal, shear_stiffness=shear), sections


def section_joint() -> Joint:
    """Return the law of the interfaces between segments: unlimited strength."""
    return Joint(tensile_strength=UNLIMITED_STRENGTH, cohesion=UNLIMITED_STRENGTH, friction=0.0)


def soil_joint(scene: Scene) -> Joint:
    """Return the law of the soil: springs that press, and rub."""
    return Joint(
        normal_stiffness=scene.soil.stiffness(scene.movement.kind),
        shear_stiffness=scene.soil.stiffness_along(scene.movement.kind),
        tensile_strength=0.0,
        cohesion=0.0,
        friction=scene.soil.friction,
    )


def support_joint(scene: Scene, pulls: bool, guide_stiffness_ratio: float = 1e-6) -> Joint:
    """Return the law of supports, which guide the footing along the wall and hold it upright.

    Parameters
    ----------
    scene : Scene
        With a rig.
    pulls : bool
        Whether they hold the footing down, too.
    guide_stiffness_ratio : float
        Stiffness along the wall over the upright one; small, as no force acts along the wall.
    """
    stiffness = scene.rig.support_stiffness / (BEARING_WIDTH * scene.footing.width)
    strength = UNLIMITED_STRENGTH if pulls else 0.0
    return Joint(
        normal_stiffness=stiffness,
        shear_stiffness=guide_stiffness_ratio * stiffness,
        tensile_strength=strength,
        cohesion=strength,
        friction=0.0 if pulls else 1.0,
    )


def stops_at(scene: Scene) -> str:
    """Return what ends the path of a footing on jacks when it carries nothing any more: jacks, supports, or nothing."""
    if not scene.rig.stop_at_zero:
        return ""
    if scene.rig.control == "load":
        return "supports"
    return "jacks" if scene.movement.kind == "dishing" else "supports"


Upward = Callable[[float], FloatArray]
"""Place along the wall (m) -> weights of all degrees of freedom (size,) in the footing's upward displacement there."""


def upward(geometry: Geometry, segments: IntArray, size: int, *, top: bool = False) -> Upward:
    """Return how the footing goes up at a place: for unit displacements of all degrees of freedom.

    Parameters
    ----------
    geometry : Geometry
        With the footing.
    segments : array of int
        Its blocks, left to right.
    size : int
        Number of degrees of freedom.
    top : bool
        Of a block of zones, whether its upper side is meant, or its underside.
    """
    blocks, mesh = geometry.blocks, geometry.mesh
    zoned = mesh is not None and np.isin(segments, mesh.block).all()

    def of_beam(x: float) -> FloatArray:
        first = blocks.first_vertex[segments]
        corners = blocks.vertices[first[:, None] + np.arange(4), 0]
        ends = np.append(corners.min(axis=1), corners.max())
        weights = np.zeros(size)
        here = under(ends, x)
        for block in segments[here]:
            weights[3 * block + 1] += 1.0 / len(here)
            weights[3 * block + 2] += (x - blocks.x[block]) / len(here)
        return weights

    def of_zones(x: float) -> FloatArray:
        assert mesh is not None
        own = np.flatnonzero(mesh.gridpoint_block == segments[0])
        y = mesh.y[own]
        level = y.max() if top else y.min()
        row = own[np.abs(y - level) < 1e-9 * float(np.ptp(y))]
        row = row[np.argsort(mesh.x[row])]
        at = int(np.clip(np.searchsorted(mesh.x[row], x) - 1, 0, len(row) - 2))
        share = (x - mesh.x[row[at]]) / (mesh.x[row[at + 1]] - mesh.x[row[at]])
        weights = np.zeros(size)
        weights[mesh.dof_y[row[at]]] += 1.0 - share
        weights[mesh.dof_y[row[at + 1]]] += share
        return weights

    return of_zones if zoned else of_beam


def deflection_of(up: Upward, left: float, right: float) -> FloatArray:
    """Return the weights of all degrees of freedom in the upward deflection of the middle relative to two ends (m).

    Parameters
    ----------
    up : Upward
        Weights of the upward displacement at a place.
    left, right : float
        The two ends (m).
    """
    return up(0.5 * (left + right)) - 0.5 * (up(left) + up(right))


def jacks_model(scene: Scene, up: Upward) -> Jacks:
    """Return the jacks of a rig.

    Parameters
    ----------
    scene : Scene
        With a rig.
    up : callable
        How the footing goes up where a jack pushes.
    """
    at = scene.rig.jack_places(scene.wall.length)
    return Jacks(
        push=np.sum([up(x) for x in at], axis=0),
        at=np.array(at),
        ends=np.array(scene.rig.support_places(scene.wall.length))[[0, -1]],
        deflection=scene.movement.sign * scene.movement.central_deflection,
        load=scene.rig.jack_load or 0.0,
        by_load=scene.rig.control == "load",
        stop=stops_at(scene),
    )
