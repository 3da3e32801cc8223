"""Laboratory tests of walls: supports, loads and measured displacements."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly.assembly import Assembly
from damagepred.assembly.bond import Brick
from damagepred.assembly.model import Jacks, LaboratoryTest, Model
from damagepred.errors import InputError
from damagepred.scene import Joint, Load, Loading, Scene, Support


def add_supports(assembly: Assembly, supports: Sequence[Support], bricks: Sequence[Brick]) -> None:
    """Support the lowest course of a wall on strips."""
    for number, strip in enumerate(supports, start=1):
        carried = 0.0
        for block, brick in enumerate(bricks):
            start, end = max(brick.left, strip.x - strip.width / 2.0), min(brick.right, strip.x + strip.width / 2.0)
            if brick.course == 0 and end - start > 1e-6 * strip.width:
                assembly.bear(block, 0.5 * (start + end), width=end - start)
                carried += end - start
        if carried == 0.0:
            raise InputError(f"support {number}: no brick of the lowest course is at x = {strip.x:g} m")


def has_beam(scene: Scene) -> bool:
    """Whether a beam lies on the wall: the block after the bricks."""
    return scene.loading is not None and scene.loading.beam != "none"


def bearing_joint(scene: Scene, guide_stiffness_ratio: float = 1e-6) -> Joint:
    """Law of supports: compression and friction; rollers have a small shear stiffness that guides the wall."""
    assert scene.loading is not None
    stiffness = scene.loading.bearing_stiffness or scene.joint.normal_stiffness
    friction = scene.loading.bearing_friction
    ratio = scene.joint.shear_stiffness / scene.joint.normal_stiffness if friction else guide_stiffness_ratio
    return Joint(
        normal_stiffness=stiffness,
        shear_stiffness=ratio * stiffness,
        tensile_strength=0.0,
        cohesion=0.0,
        friction=friction or 1.0,
    )


def under_loads(scene: Scene, model: Model, bricks: Sequence[Brick]) -> Model:
    """Model with the loads of a test."""
    loading = scene.loading
    assert loading is not None
    if loading.beam in ("level", "clamped"):
        turning = 3 * len(bricks) + 2
        dofs = np.array([turning] if loading.beam == "level" else [turning - 1, turning])
        none = np.zeros(len(dofs))
        held = model.supports._replace(
            prescribed=dofs, prescribed_displacement=none, start=none, after_load=dofs < turning
        )
        model = replace(model, supports=held)
    push, gauge = _push(scene, model, bricks), _gauge(loading, model, bricks)
    test = LaboratoryTest(push, gauge, loading.target if loading.control == "force" else 0.0)
    if loading.control == "force":
        return replace(model, supports=model.supports._replace(live_load=loading.target * push), test=test)
    if model.mesh is not None:
        raise InputError(
            f"loading.control = '{loading.control}': needs rigid or elastic blocks; zones take control = 'force'."
        )
    rest = np.zeros(model.size - len(push))
    weights = push if gauge is None or loading.control == "displacement" else gauge
    jacks = Jacks(
        push=np.append(push, rest),
        at=np.empty(0),
        ends=np.empty(0),
        deflection=loading.target,
        load=0.0,
        by_load=False,
        stop="" if scene.movement.stage else "jacks",
        weights=np.append(weights, rest),
        after_load=True,
    )
    return replace(model, jacks=jacks, test=test)


def _push(scene: Scene, model: Model, bricks: Sequence[Brick]) -> FloatArray:
    """Load vector (3 n,) of 1 N in all, by the shares of the strips."""
    if has_beam(scene):
        reach = scene.wall.length, scene.wall.height
        bricks = [*bricks, Brick(0.0, reach[1], reach[0], reach[1] + scene.wall.block_height, -1)]
    total, push = sum(load.share for load in scene.load), np.zeros((model.n_blocks, 3))
    for number, load in enumerate(scene.load, start=1):
        on_strip = _on_strip(load, model, bricks, scene.wall.length, scene.wall.height)
        if on_strip is None:
            raise InputError(f"load {number}: there is no brick where it acts on the {load.side}")
        push += load.share / total * on_strip
    return push.ravel()


def _on_strip(load: Load, model: Model, bricks: Sequence[Brick], length: float, height: float) -> FloatArray | None:
    """Load vector (n, 3) of 1 N, uniform along a strip; None if there is no brick."""
    box = np.array([brick[:4] for brick in bricks])
    west, bottom, east, top = box.T
    size = length if load.side == "top" else height
    middle, width = size / 2.0 if load.at is None else load.at, load.width or size
    near = 1e-6 * size
    if load.side == "top":
        start, end, on_side, level = west, east, top > top.max() - near, np.minimum(top, height)
    else:
        start, end = bottom, top
        on_side, level = (west < near, west) if load.side == "left" else (east > length - near, east)
    start, end = np.maximum(start, middle - width / 2.0), np.minimum(end, middle + width / 2.0)
    loaded = np.where(on_side, np.maximum(end - start, 0.0), 0.0)
    if not loaded.sum() > 0.0:
        return None
    towards = {"top": (0.0, -1.0), "left": (1.0, 0.0), "right": (-1.0, 0.0)}[load.side]
    along = (1.0, 0.0) if load.side == "top" else (0.0, -1.0)
    force = np.outer(loaded / loaded.sum(), towards if load.direction == "towards" else along)
    centre = (0.5 * (start + end), level) if load.side == "top" else (level, 0.5 * (start + end))
    n = len(bricks)
    moment = (centre[0] - model.blocks.x[:n]) * force[:, 1] - (centre[1] - model.blocks.y[:n]) * force[:, 0]
    loads = np.zeros((model.n_blocks, 3))
    loads[:n] = np.column_stack((force, moment))
    return loads


def _gauge(loading: Loading, model: Model, bricks: Sequence[Brick]) -> FloatArray | None:
    """Weights (3 n,) of the degrees of freedom in the opening of the gauge; None without a gauge."""
    if not loading.gauge:
        return None
    first, second = np.array(loading.gauge)
    way, weights = (second - first) / math.dist(first, second), np.zeros((model.n_blocks, 3))
    for sign, (x, y) in ((-1.0, first), (1.0, second)):
        touched = [i for i, b in enumerate(bricks) if b.left <= x <= b.right and b.bottom <= y <= b.top]
        if not touched:
            raise InputError(f"loading.gauge: there is no brick at x = {x:g} m, y = {y:g} m")
        for i in touched:  # on a joint: mean of both bricks
            arm = (x - model.blocks.x[i]) * way[1] - (y - model.blocks.y[i]) * way[0]
            weights[i] += sign / len(touched) * np.array([way[0], way[1], arm])
    return weights.ravel()
