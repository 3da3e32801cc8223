"""From joint materials to the law of every interface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly.elastic_blocks import ElasticBlocks
from damagepred.assembly.model import BlockLaw, Blocks, Interfaces, JointProperties
from damagepred.kernels.joint.softening import EXPONENTIAL_SHAPE
from damagepred.scene import BlockMaterial, Joint

BRITTLE_SLIP = 1.1  # least slip at which a bond is lost over that at first slip, below which the joint is made brittle

#: Values that vary from joint to joint: for a material's number, field name -> one value for each joint.
Fields = Mapping[int, Mapping[str, FloatArray]]


def joint_properties(
    materials: Sequence[Joint], material: IntArray, joint: IntArray, fields: Fields
) -> tuple[JointProperties, int]:
    """Law of each interface, and the number of joints whose tensile strength was cut to the apex, C / tan(phi)."""
    names = (*JointProperties._fields[:-3], "fracture_energy", "shear_fracture_energy", "strength_factor")
    table = np.array([[_value(m, name) for m in materials] for name in names])
    columns: dict[str, FloatArray] = dict(zip(names, np.take(table, material, axis=1)))
    for number, varied in fields.items():
        interfaces = np.flatnonzero(material == number) if varied else joint[:0]
        for name in columns.keys() & varied.keys():
            columns[name][interfaces] = varied[name][joint[interfaces]]
        if "friction" in varied and "residual_friction" not in varied and materials[number].residual_friction is None:
            columns["residual_friction"][interfaces] = varied["friction"][joint[interfaces]]
    batch = columns.pop("strength_factor")
    for name in ("tensile_strength", "cohesion", "residual_tensile_strength", "residual_cohesion"):
        columns[name] = columns[name] * batch
    # sampled independently, a residual value may exceed the intact one, and the dilation the friction
    for residual, intact in (("residual_tensile_strength", "tensile_strength"), ("residual_cohesion", "cohesion")):
        columns[residual] = np.minimum(columns[residual], columns[intact])
    columns["dilation"] = np.minimum(columns["dilation"], columns["friction"])
    columns["dilation"][np.isfinite(columns["compressive_strength"])] = 0.0
    limited = _cut_at_apex(columns, "tensile_strength", "cohesion", "friction")
    _cut_at_apex(columns, "residual_tensile_strength", "residual_cohesion", "residual_friction")
    columns["brittle_shear"] = columns["brittle_shear"].astype(np.bool_)
    energy, strength = columns.pop("fracture_energy"), columns["tensile_strength"]
    columns["critical_opening"] = np.divide(2.0 * energy, strength, out=np.zeros_like(energy), where=strength > 0)
    energy, lost = columns.pop("shear_fracture_energy"), columns["cohesion"] - columns["residual_cohesion"]
    columns["critical_slip"] = np.divide(2.0 * energy, lost, out=np.zeros_like(energy), where=lost > 0)
    columns["gap"] = np.zeros_like(energy)
    return JointProperties(**columns), len(np.unique(joint[limited]))  # type: ignore[arg-type]


def no_tension_joint(joint: Joint) -> bool:
    """Whether a joint carries no tension and has no bond to break: damp-proof course, dry joint, soil."""
    tension = 0.0 if joint.cohesion == 0.0 and joint.friction > 0.0 else joint.tensile_strength
    same_friction = _value(joint, "residual_friction") == joint.friction
    return tension == 0.0 and joint.cohesion == joint.residual_cohesion and same_friction


def _value(material: Joint, name: str) -> float:
    if name == "softening_shape":
        return EXPONENTIAL_SHAPE if material.softening == "exponential" else 0.0
    value = getattr(material, name)
    if value is None:
        value = {"residual_friction": material.friction, "compressive_strength": np.inf}.get(name, 0.0)
    return float(value)


def _cut_at_apex(columns: dict[str, FloatArray], tension: str, cohesion: str, friction: str) -> BoolArray:
    slope = columns[friction]
    apex = np.full_like(slope, np.inf)
    np.divide(columns[cohesion], slope, out=apex, where=slope > 0)
    limited = columns[tension] > apex * (1 + 1e-12)
    columns[tension] = np.minimum(columns[tension], apex)
    return limited


def lump_block_elasticity(
    properties: JointProperties,
    interfaces: Interfaces,
    blocks: Blocks,
    materials: Sequence[BlockMaterial],
    material: IntArray,
    soft: int | None = None,
    elastic: ElasticBlocks | None = None,
) -> JointProperties:
    """Joint stiffness with the elasticity of rigid blocks in series.

    1/k = 1/k_n + h_a/E_a + h_b/E_b (G for shear), h: distance from the interface to the centroid of a block, of the
    first ``soft`` blocks. Elastic blocks add nothing to their head joints.
    """
    soft_n = 1.0 / properties.normal_stiffness
    soft_s = 1.0 / properties.shear_stiffness
    modulus = np.array([m.elastic_modulus for m in materials])
    shear = np.array([m.shear_modulus for m in materials])
    for side in (interfaces.body_a, interfaces.body_b):
        is_block = side < (blocks.x.size if soft is None else soft)
        number = np.where(is_block, side, 0)
        away_x, away_y = interfaces.x - blocks.x[number], interfaces.y - blocks.y[number]
        depth = np.abs(interfaces.normal_x * away_x + interfaces.normal_y * away_y)
        flexible, slack = depth / modulus[material[number]], depth / shear[material[number]]
        if elastic is not None:
            stretch = elastic.number[side]
            ratio = np.where(stretch >= 0, elastic.poisson_ratio[stretch], 0.0)
            head = elastic.along(side, np.column_stack((interfaces.normal_x, interfaces.normal_y)))
            flexible = np.where(head, 0.0, (1.0 - ratio**2) * flexible)
            slack = np.where(head, 0.0, slack)
        soft_n = soft_n + np.where(is_block, flexible, 0.0)
        soft_s = soft_s + np.where(is_block, slack, 0.0)
    return properties._replace(normal_stiffness=1.0 / soft_n, shear_stiffness=1.0 / soft_s)


def softened(properties: JointProperties, which: BoolArray, creep: float) -> JointProperties:
    """Joints with their long-term stiffness, k / (1 + creep), where they creep (m,)."""
    share = np.where(which, 1.0 / (1.0 + creep), 1.0)
    names = ("normal_stiffness", "shear_stiffness")
    return properties._replace(**{name: share * getattr(properties, name) for name in names})


def brittle_where_soft(properties: JointProperties, joint: IntArray) -> tuple[JointProperties, int]:
    """Make joints brittle whose fracture energy is below their elastic energy at cracking (snap-back); count them."""
    elastic = properties.tensile_strength / properties.normal_stiffness
    opening = properties.critical_opening
    soft = opening > elastic
    slip = np.where(soft, properties.critical_slip, 0.0)
    shear = BRITTLE_SLIP * (properties.cohesion - properties.residual_cohesion) / properties.shear_stiffness
    limited = ((opening > 0) & ~soft) | ((properties.critical_slip > 0) & (slip <= shear))
    brittle = properties._replace(
        critical_opening=np.where(soft, opening, 0.0),
        critical_slip=np.where(slip > shear, slip, 0.0),
        brittle_shear=properties.brittle_shear | ((slip > 0) & (slip <= shear)),
    )
    return brittle, len(np.unique(joint[limited]))


def block_law(materials: Sequence[BlockMaterial], material: IntArray, thickness: FloatArray) -> BlockLaw:
    """Law of each block."""

    def each(name: str) -> FloatArray:
        values = [getattr(m, name, None) for m in materials]
        return np.array([np.inf if v is None else float(v) for v in values])[material]

    return BlockLaw(**{name: each(name) for name in BlockLaw._fields[:-1]}, thickness=thickness)
