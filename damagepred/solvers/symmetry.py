"""Symmetry reduction: one half of a wall that is its own mirror image, solved in place of the whole.

Where geometry, properties, loads, supports and movement are mirror images about an upright axis, so is a path of
equilibria: no block on the axis moves sideways or turns, and no joint on it is sheared. The blocks to the right, with
the halves of those on the axis, then make a model of their own. Blocks on the axis have half their load and are held
against sideways motion and rotation. Of a deformable block on the axis the right half remains; its gridpoints there are
held against sideways motion. Joints on the axis join a block to the ground; they are twice as stiff, for half of the
opening is on this side, and guides without shear.

The whole wall may leave its symmetry where rounding decides which of two equal bonds breaks first; the half never does.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from damagepred.arrays import BoolArray, FloatArray
from damagepred.assembly import Model
from damagepred.assembly.half_geometry import MIRRORED, HalfGeometry, MirrorImage, half_geometry
from damagepred.assembly.mesh import HalfMesh
from damagepred.assembly.model import BlockLaw, Ground, Jambs, JointProperties, Supports
from damagepred.assembly.section import Sections
from damagepred.errors import SolverError
from damagepred.solvers.options import DEFAULTS, SymmetryOptions
from damagepred.solvers.state.increment import Increment, ZoneResults


@dataclass(frozen=True, kw_only=True)
class HalfModel(Model):
    """Model of one half of a symmetric wall, and the way back to the whole.

    Attributes
    ----------
    whole : Model
        The wall; residuals and stresses of the half are scaled as those of the whole.
    geometry : HalfGeometry
        Its reduction.
    """

    whole: Model
    geometry: HalfGeometry

    @property
    def mean_block_weight(self) -> float:
        """Mean weight of a block of the whole wall (N)."""
        return self.whole.mean_block_weight

    @property
    def block_stress(self) -> float:
        """Mean block weight over the largest contact area, of the whole wall (Pa)."""
        return self.whole.block_stress

    @property
    def block_share(self) -> FloatArray:
        """Share of each block (h,) that is modelled: half of a rigid block that the axis cuts."""
        return np.where(self.geometry.cut, 0.5, 1.0)

    @property
    def guides(self) -> BoolArray:
        """Whether each interface (k,) lies along the axis."""
        return self.geometry.on_axis

    def expand(self, increment: Increment) -> Increment:
        """Return an increment of the whole wall from one of the half; counts of work done stay those of the half."""
        geometry, force = self.geometry, increment.support_force

        def at_contacts(values: NDArray, factor: FloatArray | None = None) -> NDArray:
            found = values.ravel().take(geometry.contact_source)
            return found if factor is None else factor * found

        if force is not None:  # twice that on half a block; sideways force and moment of the axis are no support's
            on_axis = (geometry.cut | geometry.halved)[:, None]
            force = np.where(on_axis, np.array([0.0, 2.0, 0.0]) * force, force)
            force = geometry.block_sign * force[geometry.block_source]
        return replace(
            increment,
            displacement=geometry.block_sign * increment.displacement[geometry.block_source],
            strain=None if increment.strain is None else increment.strain[geometry.block_source],
            opening=at_contacts(increment.opening, geometry.opening_factor),
            slip=at_contacts(increment.slip, geometry.shear_sign),
            normal_stress=at_contacts(increment.normal_stress),
            shear_stress=at_contacts(increment.shear_stress, geometry.shear_sign),
            state=at_contacts(increment.state),
            broken_at=None if increment.broken_at is None else at_contacts(increment.broken_at),
            support_force=force,
            zones=None
            if geometry.mesh is None or increment.zones is None
            else _unfolded(geometry.mesh, increment.zones),
            base_reaction=2 * increment.base_reaction,
            energy=increment.energy.twice(),
        )

    def renumber(self, error: SolverError) -> SolverError:
        """Return an error of the half's path that names the block by its number in the whole wall."""
        if not 0 <= error.block < self.n_blocks:
            return error
        block = int(self.geometry.kept[error.block])
        message = str(error).replace(self.describe_block(error.block), self.whole.describe_block(block))
        return type(error)(message, increment=error.increment, block=block)


def reduce_by_symmetry(model: Model, options: SymmetryOptions = DEFAULTS.symmetry) -> HalfModel | None:
    """Return the half of a wall that is its own mirror image; None if it is not, or has strained blocks.

    Walls of deformable blocks with jacks, or loads or supports on single gridpoints, are not halved either.

    Parameters
    ----------
    model : Model
        The wall.
    options : SymmetryOptions, optional
        Rounding, and shear of the joints on the axis.
    """
    if model.is_strained or (model.mesh is not None and not _loaded_by_block(model)):
        return None
    geometry = half_geometry(model.blocks, model.interfaces, model.elastic, model.mesh, options.rounding)
    if geometry is None or not _is_symmetric(model, geometry.mirror, options.rounding):
        return None
    kept, jacks = geometry.kept, model.jacks
    if jacks is not None:  # half their force; the support on the right is the only outer one
        weights = None if jacks.weights is None else _half_weights(geometry, jacks.weights)
        jacks = jacks._replace(push=0.5 * _half_weights(geometry, jacks.push), ends=jacks.ends[-1:], weights=weights)
    of_half = {
        "blocks": geometry.blocks,
        "interfaces": geometry.interfaces,
        "elastic": geometry.elastic,
        "mesh": None if geometry.mesh is None else geometry.mesh.mesh,
        "properties": _joints_of_half(model.properties, geometry, options),
        "ground": model.ground.map(lambda ground: _ground_of_half(ground, geometry)),
        "supports": _supports_of_half(model, geometry),
        "jambs": Jambs.none(),
        "initial_velocity": None,
        "density": model.density[kept],
        "block_law": BlockLaw(*(values[kept] for values in model.block_law)),
        "footing": None if model.footing is None else np.flatnonzero(np.isin(kept, model.footing)),
        "deflection": None if model.deflection is None else _half_weights(geometry, model.deflection),
        "jacks": jacks,
        "sections": None if model.sections is None else _sections_of_half(model.sections, geometry),
    }
    of_whole = {field.name: getattr(model, field.name) for field in fields(Model)}
    return HalfModel(**of_whole | of_half, whole=model, geometry=geometry)


def _loaded_by_block(model: Model) -> bool:
    """Return whether loads and supports are those of whole blocks, and no jacks or deflections measured."""
    others = model.edge_load, model.live_edge_load, model.jacks, model.deflection
    return all(v is None for v in others) and bool((model.supports.prescribed < 3 * model.n_blocks).all())


def _unfolded(half: HalfMesh, zones: ZoneResults) -> ZoneResults:
    """Return the zones of the whole wall from those of the half."""
    moves_back = np.where(half.mirrored_gridpoint[:, None], MIRRORED[:2], 1.0)
    shears_back = np.where(half.mirrored_zone[:, None], np.array([1.0, 1.0, -1.0, 1.0]), 1.0)
    return ZoneResults(
        moves_back * zones.displacement[half.gridpoint], shears_back * zones.stress[half.zone], zones.state[half.zone]
    )


def _is_symmetric(model: Model, mirror: MirrorImage, rounding: float) -> bool:
    """Whether joints and densities, to the last digit, stiffness, supports, loads and movement are mirror images."""
    law, image, face_image = model.properties, mirror.block, mirror.interface
    # strengths first: they vary from joint to joint, so that one comparison is mostly enough
    strengths = (v for name, v in law._asdict().items() if name not in ("normal_stiffness", "shear_stiffness"))
    if not all(np.array_equal(values[face_image], values) for values in strengths):
        return False
    held, moved, later = _prescribed(model)
    whole = 3 * model.n_blocks
    jacks = () if model.jacks is None else (model.jacks.push, model.jacks.weights)
    weights = [v[:whole] for v in (model.deflection, *jacks) if v is not None]
    loads = (values.reshape(-1, 3) for values in (model.supports.load, model.supports.live_load, *weights))
    pairs = [(MIRRORED * values[image], values) for values in (moved, *loads)]
    for ground in model.ground.states():
        pairs += [(mirror.of_contacts(ground.normal), ground.normal), (-mirror.of_contacts(ground.shear), ground.shear)]
    return (
        (model.elastic is None or np.array_equal(stretches := model.elastic.number[:-1] >= 0, stretches[image]))
        and all((np.abs(k[face_image] - k) <= rounding * k).all() for k in (law.normal_stiffness, law.shear_stiffness))
        and all(np.array_equal(values[image], values) for values in (model.density, held, later, *model.block_law))
        and all((np.abs(there - here) <= rounding * np.abs(here).max(initial=0.0)).all() for there, here in pairs)
    )


def _prescribed(model: Model) -> tuple[BoolArray, FloatArray, BoolArray]:
    """Return arrays (n, 3): prescribed degrees of freedom, their displacement, and which are held after the load."""
    supports, tables = model.supports, np.zeros((3, 3 * model.n_blocks))
    values = np.broadcast_arrays(1.0, supports.prescribed_displacement, supports.after_load)
    tables[:, supports.prescribed] = values
    held, moved, later = tables.reshape(3, -1, 3)
    return held != 0.0, moved, later != 0.0


def _joints_of_half(law: JointProperties, geometry: HalfGeometry, options: SymmetryOptions) -> JointProperties:
    """Return the law of the half's interfaces; those on the axis open half as far, and are not sheared."""
    axis, part = geometry.on_axis, JointProperties(*(values[geometry.faces] for values in law))  # type: ignore[arg-type]
    share, cohesion = np.where(axis, 0.5, 1.0), options.guide_cohesion
    # a joint that a crack leaves as it was has no bond: keep that difference
    bond = (part.cohesion != part.residual_cohesion) | (part.friction != part.residual_friction)
    zero_on_axis = ("friction", "dilation", "residual_friction", "critical_slip")
    return part._replace(
        normal_stiffness=part.normal_stiffness / share,
        shear_stiffness=np.where(axis, options.guide_shear_ratio * part.normal_stiffness / share, part.shear_stiffness),
        cohesion=np.where(axis, cohesion, part.cohesion),
        residual_cohesion=np.where(axis, np.where(bond, 0.5, 1.0) * cohesion, part.residual_cohesion),
        brittle_shear=part.brittle_shear & ~axis,
        critical_opening=share * part.critical_opening,
        gap=share * part.gap,
        **{name: np.where(axis, 0.0, getattr(part, name)) for name in zero_on_axis},
    )


def _ground_of_half(ground: Ground, geometry: HalfGeometry) -> Ground:
    """Return the movement under the half: that of the ground, and none of the axis."""
    first = len(geometry.mirror.interface) - len(ground.normal)
    rows = geometry.faces[geometry.faces >= first] - first
    still = np.zeros((int(geometry.on_axis.sum()), ground.normal.shape[1]))
    return Ground(*(np.concatenate((still, values[rows])) for values in ground))


def _supports_of_half(model: Model, geometry: HalfGeometry) -> Supports:
    """Return supports and loads of the half; blocks on the axis are held against sideways motion and rotation."""
    kept, (held, moved, later) = geometry.kept, _prescribed(model)
    held, moved, later = held[kept], moved[kept], later[kept]
    guided = geometry.cut[:, None] & (MIRRORED < 0)
    held[guided], moved[guided], later[guided] = True, 0.0, False
    share = np.where(geometry.cut | geometry.halved, 0.5, 1.0)[:, None]
    dead, live = (
        (share * values.reshape(-1, 3)[kept]).ravel() for values in (model.supports.load, model.supports.live_load)
    )
    dofs = np.flatnonzero(held)
    moves, later = moved.ravel()[dofs], later.ravel()[dofs]
    if (half := geometry.mesh) is not None:  # nothing on the axis moves sideways
        axis = half.mesh.dof_x[half.axis_gridpoints]
        dofs, moves, later = (np.append(v, w) for v, w in ((dofs, axis), (moves, 0.0 * axis), (later, axis < 0)))
    return Supports(dofs, moves, dead, live, np.zeros(len(dofs)), later)


def _half_weights(geometry: HalfGeometry, weights: FloatArray) -> FloatArray:
    """Return weights of the half's degrees of freedom that make the same sum as those of the whole, of blocks alone."""
    half = np.zeros((len(geometry.kept) + 1, 3))
    here = weights[: geometry.block_sign.size].reshape(-1, 3)
    np.add.at(half, geometry.block_source, geometry.block_sign * here)
    strains = 0 if geometry.elastic is None else 2 * len(geometry.elastic.block)
    return np.concatenate((half.ravel(), np.zeros(strains)))


def _sections_of_half(sections: Sections, geometry: HalfGeometry) -> Sections:
    """Return the sections on the right, and that on the axis, which stands for half its length."""
    number = np.full(len(geometry.mirror.interface), -1)
    number[geometry.faces] = np.arange(len(geometry.faces))
    here = number[sections.interface]
    part, here = Sections(*(values[here >= 0] for values in sections)), here[here >= 0]  # type: ignore[arg-type]
    return part._replace(interface=here, length=np.where(geometry.on_axis[here], 0.5, 1.0) * part.length)
