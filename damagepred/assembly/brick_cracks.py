"""Bricks that break: a potential vertical crack in the middle of rigid and elastic bricks (Lourenco and Rots 1997).

A whole brick is two halves with an interface of kind ``BRICK_JOINT``. It softens from the strength of ``[block]`` to 0
over the fracture energy; a broken brick has friction alone. Until then the interface is nearly rigid: the elasticity of
a rigid brick is in the joints around it, and the halves of an elastic brick share its strain and curvature.

A path is solved with whole bricks first. If the forces on half a brick reach a share of the strength of its middle, it
is solved again from the start with halves.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly.bond import Brick, may_break
from damagepred.assembly.interfaces import whole_bricks
from damagepred.assembly.model import Blocks, Interfaces, JointProperties, Model
from damagepred.enumerations import ContactKind
from damagepred.scene import BlockMaterial, House, Joint, Scene

STIFF = 100.0
"""Stiffness of the middle of an unbroken brick over the stiffness of the brick: it adds 1 % to the flexibility."""
NEAR = 0.8  # share of the strength from which bricks are solved in halves; stresses between increments may be larger


def bricks_break(scene: Scene) -> bool:
    """Whether rigid and elastic bricks of a scene have a potential crack in the middle."""
    block, solver = scene.block, scene.solver
    given = block.tensile_strength is not None and block.fracture_energy is not None
    return given and solver.brick_cracks != "none" and scene.dynamics is None


def brick_joint(block: BlockMaterial) -> Joint:
    """Strength of the middle of a brick; its stiffness follows from the brick."""
    strength = block.tensile_strength or 0.0
    cohesion = strength * max(1.0, block.friction) if block.cohesion is None else block.cohesion
    return Joint(
        tensile_strength=strength,
        cohesion=cohesion,
        friction=block.friction,
        fracture_energy=block.fracture_energy,
        brittle_shear=True,
    )


def with_brick_stiffness(
    properties: JointProperties, interfaces: Interfaces, bricks: Sequence[Brick], block: BlockMaterial
) -> JointProperties:
    """Stiffness of the middles of bricks: nearly rigid."""
    normal, shear = properties.normal_stiffness.copy(), properties.shear_stiffness.copy()
    for i in np.flatnonzero(interfaces.kind == ContactKind.BRICK_JOINT).tolist():
        halves = [bricks[side[i]] for side in (interfaces.block_a, interfaces.block_b)]
        stiffer = STIFF / (max(half.right for half in halves) - min(half.left for half in halves))
        normal[i], shear[i] = stiffer * block.elastic_modulus, stiffer * block.shear_modulus
    return properties._replace(normal_stiffness=normal, shear_stiffness=shear)


def whole_centres(interfaces: Interfaces, blocks: Blocks) -> Blocks:
    """Blocks in which halves of a brick have the centroid of the brick."""
    brick = whole_bricks(interfaces.block_a, interfaces.block_b, interfaces.kind, len(blocks.x) + 1)[:-1]
    halves = np.flatnonzero(np.bincount(brick, minlength=len(brick))[brick] > 1)
    x, y = blocks.x.copy(), blocks.y.copy()
    for place in (x, y):
        moment, area = (np.bincount(brick[halves], v[halves], len(brick)) for v in (blocks.area * place, blocks.area))
        place[halves] = (moment[brick] / np.maximum(area[brick], 1e-300))[halves]
    return blocks._replace(x=x, y=y)


class BrickWatch(NamedTuple):
    """Whole bricks (k,) that may break, and the strength of their middles."""

    brick: IntArray  # number of the block
    length: FloatArray  # (k,) (m)
    height: FloatArray
    area: FloatArray  # (k,) (m2)
    strength: Joint

    @classmethod
    def of(cls, scene: Scene, model: Model) -> BrickWatch:
        """Bricks of a model with whole bricks."""
        blocks = model.blocks
        corners = np.split(blocks.vertices, blocks.first_vertex[1:-1])
        size = np.array([np.ptp(corner, axis=0) for corner in corners])
        bricks = may_break(size[:, 0], scene.wall.block_length) & (blocks.course >= 0)
        if model.mesh is not None:
            bricks[model.mesh.block] = False
        number = np.flatnonzero(bricks)
        length, height = size[number].T
        return cls(number, length, height, height * scene.wall.thickness, brick_joint(scene.block))

    def near(self, model: Model, normal_stress: FloatArray, shear_stress: FloatArray) -> bool:
        """Whether the forces in the middle of a brick near its strength; mean of its halves, by contact stresses."""
        face, n = model.interfaces, model.n_blocks + 1
        pull, slide = (face.contact_area * stress for stress in (normal_stress, shear_stress))
        n_x, n_y = face.normal_x[:, None], face.normal_y[:, None]
        force_x, force_y = pull * n_x + slide * n_y, pull * n_y - slide * n_x
        x, y = face.x[:, None] + n_y * face.contact_offset, face.y[:, None] - n_x * face.contact_offset
        totals, load = np.zeros((3, n)), np.zeros(n)
        for side, sign in ((face.block_a, 1.0), (face.block_b, -1.0)):
            arm_x, arm_y = (p - np.append(c, 0.0)[side][:, None] for p, c in ((x, model.blocks.x), (y, model.blocks.y)))
            share = np.where(np.abs(arm_x) <= 1e-9 * (1.0 + np.abs(x)), 0.0, 0.5 * sign * np.sign(arm_x))
            for total, values in zip(totals, (force_x, force_y, arm_x * force_y - arm_y * force_x)):
                total += np.bincount(side, (share * values).sum(axis=1), n)
            load -= np.bincount(side, sign * force_y.sum(axis=1), n)
        totals[2, self.brick] += 0.125 * self.length * load[self.brick]
        axial, shear, moment = totals[:, self.brick] / self.area
        bent, joint = 6.0 * np.abs(moment) / self.height, self.strength
        limit = joint.cohesion - joint.friction * np.minimum(axial, 0.0)
        return bool(((axial + bent > NEAR * joint.tensile_strength) | (np.abs(shear) > NEAR * limit)).any())


def brick_cautions(scene: Scene, sampled: Collection[str] = ()) -> list[str]:
    """Cautions on strengths of bricks, also of the material or sampled, that the model of the bricks does not read."""
    block, solver, default = scene.block, scene.solver, BlockMaterial()
    kinds = {solver.above_dpc or solver.blocks} | ({solver.below_dpc or solver.blocks} if scene.dpc else set())
    zoned = "deformable" in kinds
    breaks = kinds != {"deformable"} and bricks_break(scene)
    keys: tuple[str, ...] = () if breaks or zoned else ("tensile_strength", "cohesion")
    keys += () if breaks else ("fracture_energy",)
    keys += () if zoned else ("dilation",)
    unread = [
        f"block.{key}" for key in keys if getattr(block, key) != getattr(default, key) or f"block.{key}" in sampled
    ]
    if kinds == {"deformable"}:
        why = "zones yield at their strength and do not soften"
    elif breaks or unread == ["block.dilation"]:
        why = "zones alone read it (solver.blocks = 'deformable')"
    elif isinstance(scene, House):
        why = "bricks of a house do not break"
    elif scene.dynamics is not None:
        why = "in a run in time bricks do not break"
    elif solver.brick_cracks == "none":
        why = "with solver.brick_cracks = 'none' bricks do not break"
    else:
        missing = "tensile_strength" if block.tensile_strength is None else "fracture_energy"
        why = f"rigid and elastic bricks break only with block.{missing}; without it, zones alone read a strength"
    own, material = {*(scene.given or ()), *sampled}, scene.material
    named = [place if material is None or place in own else f"{place} of {material!r}" for place in unread]
    return [f"{', '.join(named)}: not read: {why}"] if unread else []
