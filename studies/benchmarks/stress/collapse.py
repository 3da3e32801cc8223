"""Walls near their collapse load: friction, slender and squat blocks, near-mechanisms.

The collapse load of dry walls of rigid blocks follows from statics alone. For one block the limit is known; for walls
it is found by linear programming (tests/verification/limit_analysis.py, which shares nothing with the solvers). Limit
analysis assumes dilatant (associated) sliding; the solvers' joints do not dilate. So every wall must collapse above the
factor, and a wall that slides as it rotates may collapse below it. A wall that is reported to stand must be in
equilibrium, which is checked for every block from the stresses.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from damagepred.assembly import Assembly, Model
from damagepred.scene import BlockMaterial, Dynamics, Joint
from studies.benchmarks.stress.case import RIGID, STATIC, WAYS, Case
from tests.verification.dry_walls import DryWall, arch, box, leaning, portal, running_bond, tipping_slope
from tests.verification.limit_analysis import collapse_factor

THICKNESS, G, DENSITY = 0.2, 9.81, 2000.0


def tilted(deformable: bool, wall: DryWall, factor: float) -> Assembly:
    """Return a dry wall on which gravity has a share along x; fixed blocks stay rigid."""
    made = Assembly(
        thickness=THICKNESS,
        gravity=(factor * G, -G),
        block=BlockMaterial(density=DENSITY),
        joint=Joint(tensile_strength=0.0, cohesion=0.0, friction=wall.friction),
    )
    for number, corners in enumerate(wall.blocks):
        soft = deformable and number not in wall.held
        made.add_block(corners, zone_size=float(np.ptp(np.array(corners), axis=0).max()) / 4 * soft)
    for block in wall.held:
        made.support(block)
    return made


def pushed(deformable: bool, wall: DryWall, factor: float) -> Assembly:
    """Return a dry wall that is pushed along x by a share of its weight, the push growing with the movement."""
    made = tilted(deformable, wall, 0.0)
    made.push_body(x=factor)
    return made


def in_time(seconds: float) -> Callable[[Model], Dynamics]:
    """Return a run from equilibrium if there is one, long enough for a collapse to develop.

    Damping is strong for vibrations of joints and weak for sliding and rotation. Without damping a sliding block may
    flutter, because friction is not derived from a potential, and one that chatters gains energy: see the family
    "chatter".
    """

    def dynamics(model: Model) -> Dynamics:
        return Dynamics(
            duration=seconds, outputs=40, damping="rayleigh", damping_ratio=0.05, frequency=0.5, second_frequency=1000.0
        )

    return dynamics


def one_block() -> list[Case]:
    """Return a block on a slope: it slides at mu, or topples at b/h.

    In time the block's rotation adds to its lever arm. So it tips earlier on an elastic joint, and its joint of four
    parts gives that limit within a tenth: nothing is expected near it.
    """
    made, stiffness = [], Joint().normal_stiffness
    for mu, slender in itertools.product((0.0, 0.2, 0.75, 2.0), (0.05, 0.5, 1.0, 20.0)):
        wide = 0.3 * np.sqrt(slender)
        wall = DryWall("block", [box(-10.0, -0.1, 30.0, 0.1), box(0.0, 0.0, wide, wide / slender)], mu)
        falls_at = min(mu, slender)
        tips_at = tipping_slope(wide, wide / slender, DENSITY * G * wide**2 / slender, stiffness)
        for share in (0.99, 1.01, 1.5):
            factor = share * falls_at if falls_at else 0.01 * (share - 0.99)
            expect = "falls" if factor > falls_at else "stands"
            near = expect == "stands" and factor > 0.9 * tips_at
            made.append(
                Case(
                    "friction and form",
                    f"mu = {mu:g}, b/h = {slender:g}, {share:g} of the limit",
                    partial(tilted, wall=wall, factor=factor),
                    expect,
                    dynamics=in_time(2.0),
                    ways=WAYS if mu in (0.2, 0.75) and slender in (0.5, 20.0) else RIGID,
                    expect_in_time="" if near else None,
                )
            )
    return made


WALLS = (
    DryWall("portal", portal(5, 1.2, 0.3, 0.3, 0.3), 0.3),
    DryWall("arch", arch(13, 1.0, 1.2, 2.6), 0.4, (0, 12)),
    DryWall("panel 14 courses", running_bond(14, 2, 0.4, 0.175, True), 0.3),
    DryWall("panel 6 courses", running_bond(6, 5, 0.4, 0.175, True), 0.65),
    DryWall("panel 5 courses, mu = 2", running_bond(5, 3, 0.4, 0.175, True), 2.0),
    DryWall("leaning panel", leaning(running_bond(5, 3, 0.4, 0.175, True), -0.1), 0.3),
    DryWall("stack of 20", [box(-1, -1, 3, 1), *(box(0.0, 0.1 * i, 0.24, 0.1) for i in range(20))], 0.6),
)


def walls() -> list[Case]:
    """Return dry walls under inclined gravity, and pushed, by shares of their limit."""
    family, made = "near the limit load", []
    for wall in WALLS:
        falls_at = collapse_factor(wall.blocks, set(wall.held), wall.friction, *wall.loads())
        for share in (0.4, 0.9, 0.99, 1.01, 1.1, 2.0):
            expect = "falls" if share > 1 else "stands" if share == 0.4 else ""
            how: dict[str, Any] = {"wall": wall, "factor": share * falls_at}
            leans, push = (f"{wall.name}, {what} by {share:g} of the limit" for what in ("gravity leans", "pushed"))
            ways = WAYS if share in (0.9, 1.1) else RIGID
            made += [
                Case(family, leans, partial(tilted, **how), expect, dynamics=in_time(3.0), ways=ways),
                Case(family, push, partial(pushed, **how), expect, increments=3, ways=RIGID[:2]),
            ]
    return made


def corbel(bricks: int, share: float) -> DryWall:
    """Return a tower of overhanging bricks, each upper part at a share of its toppling overhang."""
    length, height, left, low = 0.24, 0.075, 0.0, 0.0
    blocks = [box(-1.0, -1.0, 3.0, 1.0)]
    for i in range(bricks):
        blocks.append(box(left, low, length, height))
        left, low = left + share * length / (2 * (bricks - 1 - i)) if i < bricks - 1 else left, low + height
    return DryWall(f"tower of {bricks}", blocks, 0.7)


def on_points(strength: float, apart: float, deformable: bool) -> Assembly:
    """Return a wall of five bricks a course on two bearings of no width."""
    made = Assembly(joint=Joint(tensile_strength=strength, cohesion=2 * strength, friction=0.7))
    for course in range(4):
        edges = [0.0, *(0.24 * (i + 0.5 * (course % 2)) for i in range(course % 2 == 0, 5)), 1.2]
        for left, right in itertools.pairwise(edges):
            made.add_block(box(left, 0.1 * course, right - left, 0.1), course=course, zone_size=0.1 * deformable)
    for x in (0.6 - 0.5 * apart, 0.6 + 0.5 * apart):
        made.bear(int(x / 0.24), x, joint=Joint(tensile_strength=1e9, cohesion=1e9))
    return made


def mechanisms() -> list[Case]:
    """Return walls on two points (not in time, where the ground has no gaps), and stacks about to topple."""
    family, made = "near-mechanisms", []
    for bricks, share in itertools.product((2, 5, 20), (0.9, 0.99, 1.01, 1.1)):
        wall = corbel(bricks, share)
        make, ways = partial(tilted, wall=wall, factor=0.0), WAYS if bricks < 20 and share in (0.9, 1.1) else RIGID
        case = Case(family, f"{wall.name}, {share:g} of the overhang", make, dynamics=in_time(3.0), ways=ways)
        # twenty bricks lean by 3 mm on their joints, more than the overhang that is left; on joints ten times as stiff
        # they stand
        other = "" if (bricks, share) == (20, 0.99) else None
        made.append(replace(case, expect="falls" if share > 1 else "stands", expect_in_time=other))
    for strength, apart in itertools.product((0.0, 1e3, 1e5, 1e7), (0.01, 0.5, 1.1)):
        # bearings far apart carry a thrust, with which also joints without a bond may be in equilibrium
        expect = "falls" if strength == 0.0 and apart < 1.0 else "stands" if strength == 1e7 else ""
        name, make = f"on two points {apart:g} m apart, f_t = {strength:g} Pa", partial(on_points, strength, apart)
        made.append(Case(family, name, make, expect, ways=STATIC if apart == 0.5 else RIGID[:2]))
    return made


def cases() -> list[Case]:
    """Return all cases."""
    return [replace(case, explicit_tolerance=1e-5) for case in one_block() + walls() + mechanisms()]
