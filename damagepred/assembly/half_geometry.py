"""Half of a geometry that is its own mirror image about the upright line through the middle of its extent."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly.elastic_blocks import ElasticBlocks, elastic_sides
from damagepred.assembly.geometry import mass_properties
from damagepred.assembly.mesh import HalfMesh, Mesh, half_mesh
from damagepred.assembly.model import Blocks, Interfaces

MIRRORED = np.array([-1.0, 1.0, -1.0])  # signs of x, y and rotation in a mirror


class MirrorImage(NamedTuple):
    """Mirror images of n blocks and m interfaces."""

    axis: float  # x of the mirror (m)
    # (n,), (m,): image of each; blocks on the axis, and interfaces along or across it, are their own image
    block: IntArray
    interface: IntArray
    # (m,): whether the image has its contacts in reverse order, as bed joints have: their tangent points to the
    # right on both sides
    reverses: BoolArray

    def of_contacts(self, values: FloatArray) -> FloatArray:
        """Mirrored values (g, q) at the contacts of the last g interfaces."""
        first = len(self.interface) - len(values)
        image = values[self.interface[first:] - first]
        return np.where(self.reverses[first:, None], image[:, ::-1], image)


class HalfGeometry(NamedTuple):
    """Reduction of n blocks and m interfaces with q contacts to h blocks and k interfaces of the half."""

    mirror: MirrorImage
    kept: IntArray  # (h,): blocks of the whole
    faces: IntArray  # (k,): interfaces of the whole: between blocks, then on the axis, then with the ground
    cut: BoolArray  # (h,): rigid blocks on the axis; half of their load is modelled
    halved: BoolArray  # (h,): deformable blocks on the axis; their right half is a block
    on_axis: BoolArray  # (k,): interfaces along the axis, between a block and its image
    blocks: Blocks
    interfaces: Interfaces
    elastic: ElasticBlocks | None
    mesh: HalfMesh | None
    block_source: IntArray  # (n,): block of the half with the same motion
    block_sign: FloatArray  # (n, 3): signs of its x, y and rotation
    contact_source: IntArray  # (m, q): contact of the half with the same values
    shear_sign: FloatArray  # (m, q): 0 on the axis
    opening_factor: FloatArray  # (m, q): 2 on the axis


ROUNDING = 1e-9
"""Tolerated difference between mirror images: of positions over the size of the wall, of stiffness, load and movement
over the largest value (1)."""
_recent: deque[tuple[Blocks, Interfaces, HalfGeometry | None]] = deque(maxlen=8)
"""Cache by identity: all samples of a wall share one geometry."""


def half_geometry(
    blocks: Blocks, interfaces: Interfaces, elastic: ElasticBlocks | None, mesh: Mesh | None
) -> HalfGeometry | None:
    """Right half of a geometry; None if it is not its own mirror image."""
    for *key, geometry in tuple(_recent):  # threads may add to it
        if key[0] is blocks and key[1] is interfaces:
            return geometry
    mirror = _mirror_image(blocks, interfaces)
    geometry = None if mirror is None else _halve(mirror, blocks, interfaces, elastic, mesh)
    _recent.append((blocks, interfaces, geometry))
    return geometry


def _mirror_image(blocks: Blocks, interfaces: Interfaces) -> MirrorImage | None:
    """Mirror images of blocks and interfaces; None if the geometry is not its own mirror image."""
    low, high = blocks.vertices[:, 0].min(), blocks.vertices[:, 0].max()
    axis, near = float(low + high) / 2, ROUNDING * float(np.ptp(blocks.vertices, axis=0).max())
    image = _images(blocks.x, blocks.y, axis, near)
    face_image = _images(interfaces.x, interfaces.y, axis, near)
    if image is None or face_image is None:
        return None
    there = interfaces.taken(face_image)
    # the image's normal is the mirror image of the normal; or its opposite, and then the image of block a is b
    normal = np.stack((interfaces.normal_x, interfaces.normal_y))
    same, opposite = (np.abs(normal[:, face_image] + sign * normal) < ROUNDING for sign in (-1.0, 1.0))
    reverses, swaps = opposite[0] & same[1], same[0] & opposite[1]
    mirror = MirrorImage(axis, image, face_image, reverses)
    image_a, image_b = (np.append(image, len(image))[side] for side in (interfaces.block_a, interfaces.block_b))
    area, offset = mirror.of_contacts(interfaces.contact_area), mirror.of_contacts(interfaces.contact_offset)
    alike = (
        all(np.allclose(size[image], size, rtol=ROUNDING, atol=0.0) for size in (blocks.area, blocks.polar))
        and (reverses | swaps).all()
        and np.array_equal(there.block_a, np.where(reverses, image_a, image_b))
        and np.array_equal(there.block_b, np.where(reverses, image_b, image_a))
        and np.array_equal(there.kind, interfaces.kind)
        and (np.abs(there.length - interfaces.length) < near).all()
        and np.allclose(area, interfaces.contact_area, rtol=ROUNDING, atol=0.0)
        and (np.abs(np.where(reverses[:, None], -offset, offset) - interfaces.contact_offset) < near).all()
    )
    return mirror if alike else None


def _images(x: FloatArray, y: FloatArray, axis: float, near: float) -> IntArray | None:
    """Index of the mirror image of each point; None if a point has none."""
    tree = cKDTree(np.column_stack((x, y)))
    image = tree.query(np.column_stack((2 * axis - x, y)), distance_upper_bound=near)[1].astype(np.int64)
    if (image == len(x)).any() or not np.array_equal(image[image], np.arange(len(x))):
        return None
    return image


def _halve(
    mirror: MirrorImage,
    blocks: Blocks,
    interfaces: Interfaces,
    elastic: ElasticBlocks | None,
    mesh: Mesh | None,
) -> HalfGeometry | None:
    """Reduction to the right half; None if all blocks are on the axis, or an interface crosses it."""
    n, m, q = len(blocks.x), *interfaces.contact_area.shape
    own_block, own_face = mirror.block == np.arange(n), mirror.interface == np.arange(m)
    away, reach = np.abs(interfaces.x - mirror.axis), interfaces.length / 2 * np.abs(interfaces.normal_y)
    near = ROUNDING * float(away.max(initial=0.0))
    if own_block.all() or not (own_face | ((away > near) & (away > reach - near))).all():
        return None
    kept = np.flatnonzero(own_block | (blocks.x > mirror.axis))
    number = np.full(n + 1, -1)
    number[kept], number[n] = np.arange(len(kept)), len(kept)
    # the right half is kept because there a joint on the axis has the axis as block a, and the ground is always a
    axis_face, halved = own_face & ~mirror.reverses, own_face & mirror.reverses
    faces = np.flatnonzero(own_face | (interfaces.x > mirror.axis))
    faces = faces[np.argsort(np.where(axis_face, 1, 2 * (interfaces.block_a == n))[faces], kind="stable")]
    on_axis = axis_face[faces]
    a, b = number[interfaces.block_a[faces]], number[interfaces.block_b[faces]]
    if (b < 0).any() or ((a < 0) != on_axis).any():
        return None
    a[on_axis] = len(kept)
    interfaces_half = interfaces.taken(faces)
    bodies, zoned, half, cut = np.stack((a, b)), None, _blocks_of_half(blocks, kept), own_block[kept]
    in_half = np.zeros_like(cut)  # deformable blocks of which the right half is a block
    if mesh is not None:
        near = ROUNDING * float(np.ptp(blocks.vertices, axis=0).max())
        zoned = half_mesh(mesh, mirror.axis, mirror.block, number[:n], near)
        if zoned is None:
            return None
        in_half[list(zoned.outline)] = True
        if np.append(in_half, False)[bodies[:, own_face[faces] & ~on_axis]].any():
            return None
        half, cut = _with_outlines(half, zoned.outline), cut & ~in_half
        piece = np.stack((interfaces_half.body_a, interfaces_half.body_b)) - (n + 1)
        side = (piece >= 0) & ~np.stack((on_axis, np.zeros_like(on_axis)))
        bodies[side] = len(kept) + 1 + np.arange(int(side.sum()))
        x, y = (np.broadcast_to(v, side.shape)[side] for v in (interfaces_half.x, interfaces_half.y))
        facet = zoned.facet[mesh.piece_facet[piece[side]]]
        if (facet < 0).any():
            return None
        zoned = zoned._replace(mesh=zoned.mesh.in_pieces(facet, x, y))
    strained = elastic and elastic.taken(kept)
    position = np.full(m, -1)
    position[faces] = np.arange(len(faces))
    left_block, left_face = number[:n] < 0, position < 0
    source = number[np.where(left_block, mirror.block, np.arange(n))]
    mirrored = np.where(left_block[:, None], MIRRORED, 1.0)
    position[left_face] = position[mirror.interface[left_face]]
    contacts = np.where((left_face & mirror.reverses)[:, None], np.arange(q)[::-1], np.arange(q))
    face, centre = interfaces_half, np.column_stack((blocks.x, blocks.y))[kept]
    middle, normal = np.column_stack((face.x, face.y)), np.column_stack((face.normal_x, face.normal_y))
    face = face._replace(
        block_a=a,
        block_b=b,
        body_a=bodies[0],
        body_b=bodies[1],
        arm_normal_a=np.where(on_axis, 0.0, face.arm_normal_a),  # the axis does not turn
        arm_shear_a=np.where(on_axis, 0.0, face.arm_shear_a),
        contact_area=face.contact_area * np.where(halved[faces], 0.5, 1.0)[:, None],
        elastic=strained and elastic_sides(strained, (a, b), middle, normal, face.length, centre),
    )
    return HalfGeometry(
        *(mirror, kept, faces, cut, in_half, on_axis, half, face),
        elastic=strained,
        mesh=zoned,
        block_source=source,
        block_sign=np.where(in_half[source][:, None], MIRRORED > 0, mirrored),  # halved blocks only move up and down
        contact_source=position[:, None] * q + contacts,
        shear_sign=np.repeat(np.where(axis_face, 0.0, np.where(left_face, -1.0, 1.0))[:, None], q, axis=1),
        opening_factor=np.repeat(np.where(axis_face, 2.0, 1.0)[:, None], q, axis=1),
    )


def _blocks_of_half(blocks: Blocks, kept: IntArray) -> Blocks:
    """Blocks of the half, whole."""
    sizes = np.diff(blocks.first_vertex)
    return blocks._replace(
        vertices=blocks.vertices[np.isin(np.repeat(np.arange(len(sizes)), sizes), kept)],
        first_vertex=np.concatenate(([0], np.cumsum(sizes[kept]))),
        **{name: getattr(blocks, name)[kept] for name in ("x", "y", "area", "polar", "course")},
    )


def _with_outlines(blocks: Blocks, outlines: dict[int, FloatArray]) -> Blocks:
    """Blocks with new outlines, by number."""
    corners = np.split(blocks.vertices, blocks.first_vertex[1:-1])
    changed = blocks._replace(**{name: getattr(blocks, name).copy() for name in ("x", "y", "area", "polar")})
    for block, outline in outlines.items():
        corners[block] = outline
        changed.area[block], changed.x[block], changed.y[block], changed.polar[block] = mass_properties(outline)
    first = np.cumsum([0, *map(len, corners)])
    return changed._replace(vertices=np.concatenate(corners), first_vertex=first)
