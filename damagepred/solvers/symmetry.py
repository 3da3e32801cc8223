"""Symmetry reduction: one half of a wall that is its own mirror image, solved in place of the whole.

Where geometry, properties, loads, supports and movement are mirror images about an upright axis, so is a path of
equilibria: no block on the axis moves sideways or turns, and no joint on it is sheared. The half model has the blocks
to the right and the halves of blocks on the axis, with half their load, held against sideways motion and rotation (a
deformable block by its gridpoints on the axis). Joints on the axis join a block to the ground: twice as stiff, because
half of the opening is on each side, and without shear.

The whole wall may lose its symmetry where rounding decides which of two equal bonds breaks first; the half does not.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from damagepred.arrays import BoolArray, FloatArray
from damagepred.assembly import Model
from damagepred.assembly.half_geometry import MIRRORED, ROUNDING, HalfGeometry, MirrorImage, half_geometry
from damagepred.assembly.house import HouseModel
from damagepred.assembly.mesh import HalfMesh
from damagepred.assembly.model import BlockLaw, Ground, Jambs, JointProperties, Supports
from damagepred.errors import SolverError
from damagepred.kernels.concrete_section.structures import Sections, Wires
from damagepred.solvers.state.increment import Increment, ZoneResults

GUIDE_SHEAR_RATIO = 1e-15
"""Shear stiffness of a joint on the axis over its normal stiffness: next to none, but the joint laws divide by it
(1)."""
GUIDE_COHESION = 1e6
"""Cohesion of a joint on the axis: its shear stress, with that stiffness, never reaches it."""


@dataclass(frozen=True, kw_only=True)
class HalfModel(Model):
    """Model of one half of a symmetric wall, and its expansion to the whole."""

    whole: Model  # scales residuals and stresses of the half
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
        """Modelled share of each block (h,): half of a rigid block on the axis."""
        return np.where(self.geometry.cut, 0.5, 1.0)

    @property
    def guides(self) -> BoolArray:
        """Whether each interface (k,) lies along the axis."""
        return self.geometry.on_axis

    def expand(self, increment: Increment) -> Increment:
        """Increment of the whole wall; counters are not doubled."""
        geometry, force = self.geometry, increment.support_force

        def at_contacts(values: NDArray, factor: FloatArray | None = None) -> NDArray:
            expanded = values.ravel().take(geometry.contact_source)
            return expanded if factor is None else factor * expanded

        if force is not None:  # on half blocks twice, without the guides' sideways force and moment
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
        """Error that names the block by its number in the whole wall."""
        if not 0 <= error.block < self.n_blocks:
            return error
        block = int(self.geometry.kept[error.block])
        message = str(error).replace(self.describe_block(error.block), self.whole.describe_block(block))
        return type(error)(message, increment=error.increment, block=block)


def reduce_by_symmetry(model: Model) -> HalfModel | None:
    """Half of a wall that is its own mirror image; None for other walls, strained blocks, houses, loaded gridpoints."""
    if isinstance(model, HouseModel) or model.is_strained or (model.mesh is not None and not _loaded_by_block(model)):
        return None
    geometry = half_geometry(model.blocks, model.interfaces, model.elastic, model.mesh)
    if geometry is None or not _is_symmetric(model, geometry.mirror):
        return None
    kept, jacks = geometry.kept, model.jacks
    if jacks is not None:  # half their force; only the right outer support remains
        push, weights = 0.5 * _half_weights(geometry, jacks.push), _half_weights(geometry, jacks.weights)
        jacks = jacks._replace(push=push, ends=jacks.ends[-1:], weights=weights)
    of_half = {
        "blocks": geometry.blocks,
        "interfaces": geometry.interfaces,
        "elastic": geometry.elastic,
        "mesh": None if geometry.mesh is None else geometry.mesh.mesh,
        "properties": _joints_of_half(model.properties, geometry),
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
    """Whether loads and supports act on whole blocks, without jacks and measured deflection."""
    others = model.edge_load, model.live_edge_load, model.jacks, model.deflection
    return all(v is None for v in others) and bool((model.supports.prescribed < 3 * model.n_blocks).all())


def _unfolded(half: HalfMesh, zones: ZoneResults) -> ZoneResults:
    """Zone results of the whole wall."""
    moves_back = np.where(half.mirrored_gridpoint[:, None], MIRRORED[:2], 1.0)
    shears_back = np.where(half.mirrored_zone[:, None], np.array([1.0, 1.0, -1.0, 1.0]), 1.0)
    return ZoneResults(
        moves_back * zones.displacement[half.gridpoint], shears_back * zones.stress[half.zone], zones.state[half.zone]
    )


def _is_symmetric(model: Model, mirror: MirrorImage) -> bool:
    """Whether joints and densities (exactly), stiffness, supports, loads and movement are mirror images."""
    law, image, face_image = model.properties, mirror.block, mirror.interface
    # strengths first: where they vary from joint to joint, one comparison is enough
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
        and all((np.abs(k[face_image] - k) <= ROUNDING * k).all() for k in (law.normal_stiffness, law.shear_stiffness))
        and all(np.array_equal(values[image], values) for values in (model.density, held, later, *model.block_law))
        and all((np.abs(mirrored - v) <= ROUNDING * np.abs(v).max(initial=0.0)).all() for mirrored, v in pairs)
    )


def _prescribed(model: Model) -> tuple[BoolArray, FloatArray, BoolArray]:
    """Arrays (n, 3): prescribed degrees of freedom, their displacement, and those held after the dead load."""
    supports, tables = model.supports, np.zeros((3, 3 * model.n_blocks))
    values = np.broadcast_arrays(1.0, supports.prescribed_displacement, supports.after_load)
    tables[:, supports.prescribed] = values
    held, moved, later = tables.reshape(3, -1, 3)
    return held != 0.0, moved, later != 0.0


def _joints_of_half(law: JointProperties, geometry: HalfGeometry) -> JointProperties:
    """Joint properties of the half; joints on the axis open half as far and are not sheared."""
    axis, joints = geometry.on_axis, JointProperties(*(values[geometry.faces] for values in law))  # type: ignore[arg-type]
    share, cohesion = np.where(axis, 0.5, 1.0), GUIDE_COHESION
    # joints with equal intact and residual strength count as unbonded
    bond = (joints.cohesion != joints.residual_cohesion) | (joints.friction != joints.residual_friction)
    zero_on_axis = ("friction", "dilation", "residual_friction", "critical_slip")
    return joints._replace(
        normal_stiffness=joints.normal_stiffness / share,
        shear_stiffness=np.where(axis, GUIDE_SHEAR_RATIO * joints.normal_stiffness / share, joints.shear_stiffness),
        cohesion=np.where(axis, cohesion, joints.cohesion),
        residual_cohesion=np.where(axis, np.where(bond, 0.5, 1.0) * cohesion, joints.residual_cohesion),
        brittle_shear=joints.brittle_shear & ~axis,
        critical_opening=share * joints.critical_opening,
        gap=share * joints.gap,
        **{name: np.where(axis, 0.0, getattr(joints, name)) for name in zero_on_axis},
    )


def _ground_of_half(ground: Ground, geometry: HalfGeometry) -> Ground:
    """Ground movement under the half, 0 on the axis."""
    first = len(geometry.mirror.interface) - len(ground.normal)
    rows = geometry.faces[geometry.faces >= first] - first
    still = np.zeros((int(geometry.on_axis.sum()), ground.normal.shape[1]))
    return Ground(*(np.concatenate((still, values[rows])) for values in ground))


def _supports_of_half(model: Model, geometry: HalfGeometry) -> Supports:
    """Supports and loads of the half; blocks on the axis are held against sideways motion and rotation."""
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
    if (half := geometry.mesh) is not None:  # gridpoints on the axis do not move sideways
        axis = half.mesh.dof_x[half.axis_gridpoints]
        dofs, moves, later = (np.append(v, w) for v, w in ((dofs, axis), (moves, 0.0 * axis), (later, axis < 0)))
    return Supports(
        prescribed=dofs,
        prescribed_displacement=moves,
        load=dead,
        live_load=live,
        start=np.zeros(len(dofs)),
        after_load=later,
    )


def _half_weights(geometry: HalfGeometry, weights: FloatArray) -> FloatArray:
    """Weights of the half's blocks with the same weighted sum as the whole wall."""
    half = np.zeros((len(geometry.kept) + 1, 3))
    of_blocks = weights[: geometry.block_sign.size].reshape(-1, 3)
    np.add.at(half, geometry.block_source, geometry.block_sign * of_blocks)
    strains = 0 if geometry.elastic is None else 2 * len(geometry.elastic.block)
    return np.concatenate((half.ravel(), np.zeros(strains)))


def _sections_of_half(sections: Sections, geometry: HalfGeometry) -> Sections:
    """Sections on the right, and half the length of a section on the axis."""
    number = np.full(len(geometry.mirror.interface), -1)
    number[geometry.faces] = np.arange(len(geometry.faces))
    interface = number[sections.interface]
    of_half = interface >= 0
    wires = Wires(*(values[of_half] for values in sections.wires))
    half = Sections(*(values[of_half] if isinstance(values, np.ndarray) else wires for values in sections))  # type: ignore[arg-type]
    interface = interface[of_half]
    return half._replace(interface=interface, length=np.where(geometry.on_axis[interface], 0.5, 1.0) * half.length)
