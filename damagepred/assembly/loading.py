"""Loads on walls, and laboratory tests: supports, loaded strips and measured displacements."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly.assembly import Assembly
from damagepred.assembly.bond import Brick, exposed_top
from damagepred.assembly.footing_beam import GUIDING_STIFFNESS
from damagepred.assembly.model import Blocks, Jacks, LaboratoryTest, Model
from damagepred.errors import InputError
from damagepred.scene import Joint, Load, Loading, Scene, Support, Wall
from damagepred.scene.loading import force_of, strip_of
from damagepred.scene.wall import EDGE_TOLERANCE

_WHOLE_TOP = Load()
POINT = 1e-6  # half the width of a load at a point, over the wall's length: on a perpend it acts on both bricks


class Sides(NamedTuple):
    """Bricks that loads can act on, and the beam on them."""

    box: FloatArray  # (blocks, 4): left, bottom, right, top (m)
    top: FloatArray  # (p, 3): block under each part of the wall's top, start and end of the part (m)


NO_SIDES = Sides(np.empty((0, 4)), np.empty((0, 3)))


def sides_of(bricks: Sequence[Brick], scene: Scene, beam: bool) -> Sides:
    """Bricks and top of a wall under loads; a beam on the wall carries the loads on the top."""
    box = np.array([brick[:4] for brick in bricks])
    if beam:
        wall = scene.wall
        on_it = [0.0, wall.height, wall.length, wall.height + wall.block_height]
        return Sides(np.vstack((box, on_it)), np.array([[len(bricks), 0.0, wall.length]]))
    return Sides(box, np.array(exposed_top(scene, bricks)))


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


def bearing_joint(scene: Scene) -> Joint:
    """Law of supports: compression and friction; rollers have a small shear stiffness that guides the wall."""
    assert scene.loading is not None
    stiffness = scene.loading.bearing_stiffness or scene.joint.normal_stiffness
    friction = scene.loading.bearing_friction
    ratio = scene.joint.shear_stiffness / scene.joint.normal_stiffness if friction else GUIDING_STIFFNESS
    loose = Joint(tensile_strength=0.0, cohesion=0.0, friction=friction or 1.0)
    return replace(loose, normal_stiffness=stiffness, shear_stiffness=ratio * stiffness)


def under_loads(scene: Scene, model: Model, bricks: Sequence[Brick], sides: Sides) -> Model:
    """Model with the loads of a test."""
    loading = scene.loading
    assert loading is not None
    if loading.beam in ("level", "clamped"):
        turning = 3 * len(bricks) + 2
        dofs = np.array([turning] if loading.beam == "level" else [turning - 1, turning])
        none = np.zeros(len(dofs))
        after = dofs < turning
        held = model.supports._replace(prescribed=dofs, prescribed_displacement=none, start=none, after_load=after)
        model = replace(model, supports=held)
    push, gauge = _push(scene, model, sides), _gauge(loading, model, bricks)
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


def _push(scene: Scene, model: Model, sides: Sides) -> FloatArray:
    """Load vector (3 n,) of 1 N in all, by the shares of the strips."""
    strips = [(number, load) for number, load in enumerate(scene.load, start=1) if not load.sized]
    total, push = sum(load.share for _, load in strips), np.zeros((model.n_blocks, 3))
    for number, load in strips:
        on_strip, length = _on_strip(load, load.share / total, model.blocks, sides, scene.wall)
        if not length:
            raise InputError(f"load {number}: there is no brick where it acts on the {load.side}")
        push += on_strip
    return push.ravel()


def dead_loads(scene: Scene, blocks: Blocks, sides: Sides) -> FloatArray:
    """Roof and loads with a size, as forces and moments (n, 3) about the centroids of the blocks (N, N m)."""
    wall, total = scene.wall, np.zeros((len(blocks.x), 3))
    if not len(sides.box):
        return total
    if scene.loads.roof:
        total += _on_strip(_WHOLE_TOP, scene.loads.roof, blocks, sides, wall)[0]
    for number, load in enumerate(scene.load, start=1):
        if not load.sized:
            continue
        start, end = strip_of(load, wall)
        on_strip, length = _on_strip(load, force_of(load, wall), blocks, sides, wall)
        if not length or end - start - length > EDGE_TOLERANCE * wall.block_length:
            where = f"the {load.side}" if load.y is None else f"a height of {load.y:g} m"
            raise InputError(
                f"load {load.name or number}: on {where}, bricks carry {length:g} of its {end - start:g} m from "
                f"{start:g} to {end:g} m; put it where the wall has bricks"
            )
        total += on_strip
    return total


def _on_strip(load: Load, size: float, blocks: Blocks, sides: Sides, wall: Wall) -> tuple[FloatArray, float]:
    """Force (N), uniform along a strip, as loads (n, 3) of the blocks, and the length (m) with bricks."""
    west, bottom, east, top = sides.box.T
    if load.side != "top":
        near = 1e-6 * wall.height
        block = np.flatnonzero(west < near if load.side == "left" else east > wall.length - near)
        start, end, level = bottom[block], top[block], (west if load.side == "left" else east)[block]
    elif load.y is None:
        block, start, end = sides.top[:, 0].astype(np.int64), *sides.top[:, 1:].T
        level = np.minimum(top[block], wall.height)
    else:
        block = np.flatnonzero(np.abs(top - top[np.argmin(np.abs(top - load.y))]) < 1e-6 * wall.height)
        start, end, level = west[block], east[block], top[block]
    first, last = strip_of(load, wall)
    widening = POINT * wall.length if first == last else 0.0
    start, end = np.maximum(start, first - widening), np.minimum(end, last + widening)
    loaded, loads = np.maximum(end - start, 0.0), np.zeros((len(blocks.x), 3))
    if not (length := float(loaded.sum())) > 0.0:
        return loads, 0.0
    towards = {"top": (0.0, -1.0), "left": (1.0, 0.0), "right": (-1.0, 0.0)}[load.side]
    along = (1.0, 0.0) if load.side == "top" else (0.0, -1.0)
    force = np.outer(size * loaded / length, towards if load.direction == "towards" else along)
    centre = (0.5 * (start + end), level) if load.side == "top" else (level, 0.5 * (start + end))
    arms = [place - own[block] for place, own in zip(centre, (blocks.x, blocks.y))]
    arm_x, arm_y = (np.where(np.abs(arm) < 1e-9 * wall.length, 0.0, arm) for arm in arms)
    np.add.at(loads, block, np.column_stack((force, arm_x * force[:, 1] - arm_y * force[:, 0])))
    return loads, length


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
