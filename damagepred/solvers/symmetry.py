"""One half of a wall that is its own mirror image, solved in place of the whole.

The axis is the upright line through the middle of the wall's extent. Where geometry, properties, loads, supports and
movement are mirror images about it, so is a path of equilibria: no block on the axis moves sideways or turns, and no
joint on it is sheared. So the blocks on the right of it, and the halves of those that it cuts, make a model of their
own, on rollers along the axis, half as large; what happens on the left is what happens on the right in a mirror.

A wall can leave its symmetry only where rounding or chance decides which of two like bonds breaks first; the half
never does.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.model import BlockLaw, Blocks, Ground, Interfaces, Jacks, Jambs, JointProperties, Supports
from damagepred.assembly.section import Sections
from damagepred.errors import SolverError
from damagepred.solvers.state.increment import Increment

ROUNDING = 1e-9
"""Places (over the size of the wall), stiffnesses, loads and movements (over the largest) that differ by less agree."""
SLACK = 1e-15
"""Shear stiffness of a joint on the axis over its normal stiffness: none that counts, but the laws divide by it."""
OUT_OF_REACH = 1e6
"""Shear strength of a joint on the axis (Pa): more than so slack a spring carries, so that nothing slides there."""
MIRRORED = np.array([-1.0, 1.0, -1.0])
"""Signs of x, y and rotation in a mirror."""
NO_JAMBS = Jambs.none()


class Mirror(NamedTuple):
    """What lies where in the mirror, for a geometry of n blocks and m interfaces.

    Attributes
    ----------
    axis : float
        Where the mirror stands (m).
    block : array of int (n,)
        Mirror image of each block; a block that the axis cuts is its own.
    interface : array of int (m,)
        Mirror image of each interface; one on the axis, or cut by it, is its own.
    turned : array of bool (m,)
        Whether the contacts of the image follow each other the other way round. Those of a bed joint do, as its tangent
        points to the right wherever it lies; those of a perpend do not.
    """

    axis: float
    block: IntArray
    interface: IntArray
    turned: BoolArray

    def of_contacts(self, values: FloatArray) -> FloatArray:
        """Return values at the contacts of some of the last interfaces, arrays (g, q), as they are in the mirror."""
        first = len(self.interface) - len(values)
        image = values[self.interface[first:] - first]
        return np.where(self.turned[first:, None], image[:, ::-1], image)


class HalfGeometry(NamedTuple):
    """How a geometry of n blocks and m interfaces is halved.

    Attributes
    ----------
    mirror : Mirror
        What lies where in the mirror.
    kept : array of int (h,)
        Blocks of the half: those on the right, and those that the axis cuts.
    cut : array of bool (h,)
        Which of them the axis cuts.
    faces : array of int (k,)
        Interfaces of the half: those between its blocks, those on the axis, those with the ground.
    on_axis, halved : array of bool (k,)
        Which of them lie along the axis, between a block and its image; and which the axis cuts in the middle.
    blocks, interfaces
        Of the half.
    block_source : array of int (n,)
        Block of the half that tells how a block moves.
    block_sign : array (n, 3)
        Signs of its x, y and rotation.
    contact_source : array of int (m, q)
        Contact of the half, counted through, that tells what happens at a contact.
    shear_sign : array (m, 1)
        Sign of its shear: 0 on the axis, where there is none.
    """

    mirror: Mirror
    kept: IntArray
    cut: BoolArray
    faces: IntArray
    on_axis: BoolArray
    halved: BoolArray
    blocks: Blocks
    interfaces: Interfaces
    block_source: IntArray
    block_sign: FloatArray
    contact_source: IntArray
    shear_sign: FloatArray


@dataclass(frozen=True, kw_only=True)
class HalfModel(Model):
    """Model of one half.

    Attributes
    ----------
    whole : Model
        The wall, whose yardsticks for forces and stresses are those of its half.
    share : array (h,)
        Share of each of its blocks that is in the half.
    """

    whole: Model
    share: FloatArray

    @property
    def mean_block_weight(self) -> float:
        """The yardstick for unbalanced forces (N)."""
        return self.whole.mean_block_weight

    @property
    def block_share(self) -> FloatArray:
        """Share of each block (h,) that is modelled: half of a block on the axis."""
        return self.share

    @property
    def block_stress(self) -> float:
        """The yardstick for joint stresses (Pa)."""
        return self.whole.block_stress


@dataclass(frozen=True)
class SymmetryReduction:
    """One half of a wall, and the way back to the whole.

    Attributes
    ----------
    model : Model
        The half: blocks that the axis cuts have half their load, keep to the axis and do not turn; a joint on the axis
        is one with the ground, twice as stiff and without shear, for only half of its opening is on this side.
        Unbalanced forces are measured by the mean block weight of the whole wall, or half of it for a block that the
        axis cuts: the force on the whole of such a block is twice that on the half.
    whole : Model
        The wall.
    geometry : HalfGeometry
        How it is halved.
    """

    model: Model
    whole: Model
    geometry: HalfGeometry

    def expand(self, increment: Increment) -> Increment:
        """Return an increment of the whole wall.

        Work done (``cycles`` and the like) is that for the half; ``unbalanced_force_ratio`` is that of the whole wall.

        Parameters
        ----------
        increment : Increment
            Of the half.
        """
        whole: dict[str, object] = {}
        for field in dataclasses.fields(increment):
            value = getattr(increment, field.name)
            if isinstance(value, np.ndarray):
                whole[field.name] = EXPAND[field.name](self.geometry, value)
            elif field.name in SUMS or field.name.endswith(("_energy", "_work")):
                whole[field.name] = 2 * value
        return dataclasses.replace(increment, **whole)  # type: ignore[arg-type]

    def renumber(self, error: SolverError) -> SolverError:
        """Return an error of the half's path that names the block by its number in the whole wall."""
        if not 0 <= error.block < len(self.geometry.kept):
            return error
        block = int(self.geometry.kept[error.block])
        here, there = self.model.describe_block(error.block), self.whole.describe_block(block)
        return type(error)(str(error).replace(here, there), increment=error.increment, block=block)


def reduce_by_symmetry(model: Model) -> SymmetryReduction | None:
    """Return the half of a wall that is its own mirror image; None if it is not.

    Walls with deformable blocks are not halved. Strengths must be the same to the last digit, all else up to rounding.
    The shape of a block counts by what the solvers see of it: centroid, area, inertia and interfaces.

    Parameters
    ----------
    model : Model
        The wall: n blocks, m interfaces.
    """
    if model.mesh is not None:
        return None  # the axis would cut blocks through their zones
    geometry = _cached_geometry(_Geometry(model.blocks, model.interfaces))
    if geometry is None or not (
        _same_joints(model.properties, geometry.mirror) and _same_actions(model, geometry.mirror)
    ):
        return None
    half = HalfModel(
        blocks=geometry.blocks,
        interfaces=geometry.interfaces,
        properties=_joints_of_half(model.properties, geometry),
        ground=model.ground.map(lambda ground: _ground_of_half(ground, geometry)),
        supports=_supports_of_half(model, geometry),
        jambs=NO_JAMBS,
        joints=model.joints,
        density=model.density[geometry.kept],
        thickness=model.thickness,
        span=model.span,
        central_deflection=model.central_deflection,
        apex_limited=model.apex_limited,
        snap_back_limited=model.snap_back_limited,
        block_law=BlockLaw(*(values[geometry.kept] for values in model.block_law)),
        plane=model.plane,
        footing=_footing_of_half(model, geometry),
        deflection=None if model.deflection is None else _half_weights(geometry, model.deflection),
        jacks=_jacks_of_half(model, geometry),
        sections=_sections_of_half(model, geometry),
        whole=model,
        share=np.where(geometry.cut, 0.5, 1.0),
    )
    return SymmetryReduction(half, model, geometry)


# -- is it symmetric? -------------------------------------------------------------------------------------------------


def find_mirror(blocks: Blocks, interfaces: Interfaces) -> Mirror | None:
    """Return what lies where in the mirror; None if the geometry is not its own mirror image.

    Parameters
    ----------
    blocks, interfaces
        Of the whole wall.
    """
    left, right = blocks.vertices[:, 0].min(), blocks.vertices[:, 0].max()
    axis, near = float(left + right) / 2, ROUNDING * float(np.ptp(blocks.vertices, axis=0).max())
    block = _images(blocks.x, blocks.y, axis, near)
    interface = _images(interfaces.x, interfaces.y, axis, near)
    if block is None or interface is None:
        return None
    for size in (blocks.area, blocks.polar):
        if not np.allclose(size[block], size, rtol=ROUNDING, atol=0.0):
            return None
    n_x, n_y = interfaces.normal_x, interfaces.normal_y
    # the normal's own image; or its opposite, and then the image of block a is b
    turned = _near(n_x[interface], -n_x) & _near(n_y[interface], n_y)
    swapped = _near(n_x[interface], n_x) & _near(n_y[interface], -n_y)
    image_a, image_b = (np.append(block, len(block))[side] for side in (interfaces.block_a, interfaces.block_b))
    expected_a, expected_b = np.where(turned, (image_a, image_b), (image_b, image_a))
    mirror = Mirror(axis, block, interface, turned)
    alike = (
        (turned | swapped).all()
        and np.array_equal(interfaces.block_a[interface], expected_a)
        and np.array_equal(interfaces.block_b[interface], expected_b)
        and np.array_equal(interfaces.kind[interface], interfaces.kind)
        and (np.abs(interfaces.length[interface] - interfaces.length) < near).all()
        and np.allclose(mirror.of_contacts(interfaces.contact_area), interfaces.contact_area, rtol=ROUNDING, atol=0.0)
        and (np.abs(_offsets_in(mirror, interfaces) - interfaces.contact_offset) < near).all()
    )
    return mirror if alike else None


def _near(one: FloatArray, other: FloatArray) -> BoolArray:
    return np.abs(one - other) < ROUNDING


def _offsets_in(mirror: Mirror, interfaces: Interfaces) -> FloatArray:
    image = mirror.of_contacts(interfaces.contact_offset)
    return np.where(mirror.turned[:, None], -image, image)


def _images(x: FloatArray, y: FloatArray, axis: float, near: float) -> IntArray | None:
    """Return which point is the mirror image of each; None if one has none."""
    tree = cKDTree(np.column_stack((x, y)))
    image = tree.query(np.column_stack((2 * axis - x, y)), distance_upper_bound=near)[1].astype(np.int64)
    if (image == len(x)).any() or not np.array_equal(image[image], np.arange(len(x))):
        return None
    return image


def _same_joints(law: JointProperties, mirror: Mirror) -> bool:
    """Tell whether all joints have the law of their mirror images."""
    image = mirror.interface
    # strengths first: they are what varies from joint to joint, and then one look is enough
    stiffness = ("normal_stiffness", "shear_stiffness")
    for name in (*(n for n in law._fields if n not in stiffness), *stiffness):
        values = getattr(law, name)
        here = values[image]
        if name in stiffness:  # blocks' elasticity in it comes from distances
            if not (np.abs(here - values) <= ROUNDING * values).all():
                return False
        elif not np.array_equal(here, values):
            return False
    return True


def _same_actions(model: Model, mirror: Mirror) -> bool:
    """Tell whether loads, supports and movement are their own mirror images, and the blocks equally dense."""
    held, moved = _prescribed(model)
    later = _per_block(model, model.supports.after_load)
    load, image = model.supports.load.reshape(-1, 3), mirror.block
    live = model.supports.live_load.reshape(-1, 3)
    along_footing = [v for v in (model.deflection, None if model.jacks is None else model.jacks.push) if v is not None]
    return bool(
        np.array_equal(model.density[image], model.density)
        and np.array_equal(held[image], held)
        and _agree(MIRRORED * moved[image], moved)
        and _agree(MIRRORED * load[image], load)
        and _agree(MIRRORED * live[image], live)
        and np.array_equal(later[image], later)
        and all(_agree(mirror.of_contacts(ground.normal), ground.normal) for ground in model.ground.states())
        and all(_agree(-mirror.of_contacts(ground.shear), ground.shear) for ground in model.ground.states())
        and all(_agree(MIRRORED * v.reshape(-1, 3)[image], v.reshape(-1, 3)[:-1]) for v in along_footing)
    )


def _agree(one: FloatArray, other: FloatArray) -> bool:
    return bool((np.abs(one - other) <= ROUNDING * np.abs(other).max(initial=0.0)).all())


def _prescribed(model: Model) -> tuple[BoolArray, FloatArray]:
    """Return which degrees of freedom are held or moved, and by how much, as arrays (n, 3)."""
    held = _per_block(model, np.ones(len(model.supports.prescribed), dtype=np.bool_))
    return held, _per_block(model, model.supports.prescribed_displacement)


def _per_block(model: Model, values: NDArray) -> NDArray:
    """Return values (p,) of what is prescribed as an array (n, 3), 0 elsewhere."""
    spread = np.zeros(3 * model.n_blocks, dtype=values.dtype)
    spread[model.supports.prescribed] = values
    return spread.reshape(-1, 3)


# -- the geometry of the half -----------------------------------------------------------------------------------------


class _Geometry:
    """Blocks and interfaces as a key: two are equal if they are the very same arrays, as for all samples of a wall."""

    def __init__(self, blocks: Blocks, interfaces: Interfaces) -> None:
        self.blocks, self.interfaces = blocks, interfaces

    def __hash__(self) -> int:
        return hash((id(self.blocks), id(self.interfaces)))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Geometry) and other.blocks is self.blocks and other.interfaces is self.interfaces


@lru_cache(maxsize=8)
def _cached_geometry(geometry: _Geometry) -> HalfGeometry | None:
    return halve_geometry(geometry.blocks, geometry.interfaces)


def halve_geometry(blocks: Blocks, interfaces: Interfaces) -> HalfGeometry | None:
    """Return how a geometry is halved; None if it is not its own mirror image, or has no second half to skip.

    Parameters
    ----------
    blocks, interfaces
        Of the whole wall.
    """
    mirror = find_mirror(blocks, interfaces)
    if mirror is None:
        return None
    n = len(blocks.x)
    own_block, own_face = mirror.block == np.arange(n), mirror.interface == np.arange(len(interfaces.x))
    if own_block.all() or not _parted(mirror, interfaces, own_face):
        return None
    kept = np.flatnonzero(own_block | (blocks.x > mirror.axis))
    number = np.full(n + 1, -1)
    number[kept], number[n] = np.arange(len(kept)), len(kept)
    # the right half is kept because there a joint on the axis has the axis as block a, and the ground is always a
    axis_face = own_face & ~mirror.turned
    keep, with_ground = own_face | (interfaces.x > mirror.axis), interfaces.block_a == n
    groups = (keep & ~axis_face & ~with_ground, axis_face, keep & ~axis_face & with_ground)
    faces = np.concatenate([np.flatnonzero(g) for g in groups])
    on_axis, halved = axis_face[faces], (own_face & mirror.turned)[faces]
    a, b = number[interfaces.block_a[faces]], number[interfaces.block_b[faces]]
    if (b < 0).any() or (a[~on_axis] < 0).any() or (a[on_axis] >= 0).any():
        return None
    a[on_axis] = len(kept)
    place = np.full(len(own_face), -1)
    place[faces] = np.arange(len(faces))
    other = place < 0  # what happens there is read off from the image
    place[other] = place[mirror.interface[other]]
    contacts = np.arange(interfaces.contact_area.shape[1])
    order = np.where((other & mirror.turned)[:, None], contacts[::-1], contacts)
    left_block = number[:n] < 0
    return HalfGeometry(
        mirror,
        kept,
        own_block[kept],
        faces,
        on_axis,
        halved,
        blocks=_blocks_of_half(blocks, kept),
        interfaces=_faces_of_half(interfaces, faces, a, b, on_axis, halved),
        block_source=number[np.where(left_block, mirror.block, np.arange(n))],
        block_sign=np.where(left_block[:, None], MIRRORED, 1.0),
        contact_source=place[:, None] * len(contacts) + order,
        shear_sign=np.where(axis_face, 0.0, np.where(other, -1.0, 1.0))[:, None],
    )


def _parted(mirror: Mirror, interfaces: Interfaces, own: BoolArray) -> bool:
    """Tell whether every interface that is not its own image lies on one side of the axis."""
    near = ROUNDING * float(np.abs(interfaces.x - mirror.axis).max(initial=0.0))
    away, reach = np.abs(interfaces.x - mirror.axis), interfaces.length / 2 * np.abs(interfaces.normal_y)
    return bool((own | ((away > near) & (away > reach - near))).all())


def _blocks_of_half(blocks: Blocks, kept: IntArray) -> Blocks:
    sizes = np.diff(blocks.first_vertex)
    corners = np.isin(np.repeat(np.arange(len(sizes)), sizes), kept)
    return Blocks(
        x=blocks.x[kept],
        y=blocks.y[kept],
        area=blocks.area[kept],
        polar=blocks.polar[kept],
        course=blocks.course[kept],
        vertices=blocks.vertices[corners],
        first_vertex=np.concatenate(([0], np.cumsum(sizes[kept]))),
    )


def _faces_of_half(
    interfaces: Interfaces, faces: IntArray, a: IntArray, b: IntArray, on_axis: BoolArray, halved: BoolArray
) -> Interfaces:
    part = Interfaces(*(values[faces] for values in interfaces))  # type: ignore[arg-type]
    return part._replace(
        block_a=a,
        block_b=b,
        body_a=a,
        body_b=b,
        # the axis does not turn
        arm_normal_a=np.where(on_axis, 0.0, part.arm_normal_a),
        arm_shear_a=np.where(on_axis, 0.0, part.arm_shear_a),
        contact_area=part.contact_area * np.where(halved, 0.5, 1.0)[:, None],
    )


# -- what acts on the half --------------------------------------------------------------------------------------------


def _joints_of_half(law: JointProperties, geometry: HalfGeometry) -> JointProperties:
    """Return the law of the half's interfaces; those on the axis open half as far, and are not sheared."""
    axis, part = geometry.on_axis, JointProperties(*(values[geometry.faces] for values in law))  # type: ignore[arg-type]
    stiffness = np.where(axis, 2.0, 1.0) * part.normal_stiffness
    # a joint that a crack leaves as it was has no bond: keep that difference
    bond = (part.cohesion != part.residual_cohesion) | (part.friction != part.residual_friction)
    return JointProperties(
        normal_stiffness=stiffness,
        shear_stiffness=np.where(axis, SLACK * stiffness, part.shear_stiffness),
        tensile_strength=part.tensile_strength,
        cohesion=np.where(axis, OUT_OF_REACH, part.cohesion),
        friction=np.where(axis, 0.0, part.friction),
        dilation=np.where(axis, 0.0, part.dilation),
        residual_tensile_strength=part.residual_tensile_strength,
        residual_cohesion=np.where(axis, np.where(bond, 0.5, 1.0) * OUT_OF_REACH, part.residual_cohesion),
        residual_friction=np.where(axis, 0.0, part.residual_friction),
        brittle_shear=part.brittle_shear & ~axis,
        compressive_strength=part.compressive_strength,
        cap_shear=part.cap_shear,
        critical_opening=np.where(axis, 0.5, 1.0) * part.critical_opening,
        critical_slip=np.where(axis, 0.0, part.critical_slip),
        gap=np.where(axis, 0.5, 1.0) * part.gap,
    )


def _ground_of_half(ground: Ground, geometry: HalfGeometry) -> Ground:
    """Return the movement under the half: that of the ground, and none of the axis."""
    still = int(geometry.on_axis.sum())
    first = len(geometry.mirror.interface) - len(ground.normal)
    rows = geometry.faces[geometry.faces >= first] - first
    normal, shear = (np.concatenate((np.zeros((still, values.shape[1])), values[rows])) for values in ground)
    return Ground(normal, shear)


def _supports_of_half(model: Model, geometry: HalfGeometry) -> Supports:
    """Return what holds, moves and loads the half."""
    held, moved = _prescribed(model)
    held, moved = held[geometry.kept], moved[geometry.kept]
    later = _per_block(model, model.supports.after_load)[geometry.kept]
    loads = [values.reshape(-1, 3)[geometry.kept] for values in (model.supports.load, model.supports.live_load)]
    for load in loads:
        load[geometry.cut] *= 0.5
    to_and_fro = geometry.cut[:, None] & (MIRRORED < 0)
    held[to_and_fro], moved[to_and_fro], later[to_and_fro] = True, 0.0, False
    dofs = np.flatnonzero(held)
    return Supports(
        dofs, moved.ravel()[dofs], loads[0].ravel(), loads[1].ravel(), np.zeros(len(dofs)), later.ravel()[dofs]
    )


def _half_weights(geometry: HalfGeometry, weights: FloatArray) -> FloatArray:
    """Return weights of the half's degrees of freedom that make the same sum as those of the whole (3 (n + 1),)."""
    whole = weights.reshape(-1, 3)[:-1]
    half = np.zeros((len(geometry.kept) + 1, 3))
    np.add.at(half, geometry.block_source, geometry.block_sign * whole)
    return half.ravel()


def _footing_of_half(model: Model, geometry: HalfGeometry) -> IntArray | None:
    return None if model.footing is None else np.flatnonzero(np.isin(geometry.kept, model.footing))


def _jacks_of_half(model: Model, geometry: HalfGeometry) -> Jacks | None:
    """Return the jacks: half their force acts on the half, and the support on the right is the only outer one."""
    jacks = model.jacks
    if jacks is None:
        return None
    return jacks._replace(push=0.5 * _half_weights(geometry, jacks.push), ends=jacks.ends[-1:])


def _sections_of_half(model: Model, geometry: HalfGeometry) -> Sections | None:
    """Return the sections on the right, and that on the axis, which stands for half its length."""
    sections = model.sections
    if sections is None:
        return None
    place = np.full(len(geometry.mirror.interface), -1)
    place[geometry.faces] = np.arange(len(geometry.faces))
    here = place[sections.interface]
    part = Sections(*(values[here >= 0] for values in sections))  # type: ignore[arg-type]
    here = here[here >= 0]
    return part._replace(interface=here, length=np.where(geometry.on_axis[here], 0.5, 1.0) * part.length)


# -- back to the whole ------------------------------------------------------------------------------------------------


def _even(geometry: HalfGeometry, values: NDArray) -> NDArray:
    """Of contacts: the same in the mirror."""
    return values.ravel()[geometry.contact_source]


def _odd(geometry: HalfGeometry, values: FloatArray) -> FloatArray:
    """Of contacts: the opposite in the mirror, and nothing on the axis."""
    return geometry.shear_sign * _even(geometry, values)


def _opening(geometry: HalfGeometry, values: FloatArray) -> FloatArray:
    """On the axis the other block moves as far away as this one."""
    return np.where(geometry.shear_sign == 0.0, 2.0, 1.0) * _even(geometry, values)


def _displacement(geometry: HalfGeometry, values: FloatArray) -> FloatArray:
    return geometry.block_sign * values[geometry.block_source]


def _support_force(geometry: HalfGeometry, values: FloatArray) -> FloatArray:
    """Return twice the force on the half of a block on the axis; what holds it to the axis is no support."""
    return _displacement(geometry, np.where(geometry.cut[:, None], np.array([0.0, 2.0, 0.0]) * values, values))


EXPAND: Mapping[str, Callable[[HalfGeometry, NDArray], NDArray]] = {
    "displacement": _displacement,
    "opening": _opening,
    "slip": _odd,
    "normal_stress": _even,
    "shear_stress": _odd,
    "state": _even,
    "broken_at": _even,
    "support_force": _support_force,
}
"""How each array of an ``Increment`` is made that of the whole wall."""

SUMS = frozenset({"base_reaction", "energy_error"})
"""Its numbers that are sums over the wall, besides all whose names end in ``_energy`` or ``_work``."""
