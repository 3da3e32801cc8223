"""Strengths from zero to unbreakable, friction from 0 to 2, bricks that yield under their own weight."""

from __future__ import annotations

import itertools
from functools import partial
from pathlib import Path

from damagepred.assembly import Assembly, Model
from damagepred.assembly.assembly import rectangle
from damagepred.scene import BlockMaterial, Dynamics, Joint, Movement, Scene, Wall
from studies.benchmarks import walls
from studies.benchmarks.stress.case import RIGID, WAYS, Case

FOOT = Wall(length=1.2, height=0.6, block_length=0.24, block_height=0.1)
ODD = walls.read(Path(__file__).with_name("laws.toml"))
"""Unusual laws: keys of ``[joint]``."""


def wall(_: bool, law: dict[str, float]) -> Scene:
    """Return a small wall in dishing of 1 mm."""
    joint = Joint(**{"tensile_strength": 1e4, "cohesion": 1e4, "friction": 0.5} | law)  # type: ignore[arg-type]
    return Scene(wall=FOOT, joint=joint, movement=Movement(central_deflection=1e-3, increments=4))


def moved(_: Model) -> Dynamics:
    """Return a run with slowly moving ground."""
    return Dynamics(duration=0.3, outputs=10, movement_time=0.25, damping="viscous", damping_ratio=0.5, frequency=20.0)


def strengths() -> list[Case]:
    """Return the wall with joints of every strength and friction, and of unusual laws."""
    plain = {
        f"f_t = C = {f_t:g} Pa, mu = {mu:g}": {"tensile_strength": f_t, "cohesion": f_t, "friction": mu}
        for f_t, mu in itertools.product((0.0, 1.0, 1e3, 1e4, 1e5, 1e6, 1e9, 1e15), (0.0, 0.5, 2.0))
    }
    made = []
    for name, law in (plain | ODD).items():
        ways = WAYS if name in ODD or law["friction"] == 0.5 else RIGID
        made.append(Case("strengths", name, partial(wall, law=law), increments=4, dynamics=moved, ways=ways))
    return made


def weak_stack(deformable: bool, cohesion: float, friction: float) -> Assembly:
    """Return four bricks that yield at a cohesion; rigid ones never do."""
    made = Assembly(
        joint=Joint(tensile_strength=1e9, cohesion=1e9), block=BlockMaterial(cohesion=cohesion, friction=friction)
    )
    for i in range(4):
        made.add_block(rectangle(0.0, 0.075 * i, 0.24, 0.075 * (i + 1)), course=i, zone_size=0.0375 * deformable)
    made.rest_on_ground([0])
    return made


def weak_bricks() -> list[Case]:
    """Return stacks of bricks of decreasing strength.

    The lowest brick carries 5.9 kPa. Lower bound of its strength: uniaxial compression, 2 C (sqrt(1 + mu2) + mu). Upper
    bound without friction: 3.6 C between rough plates, three times as long as high.
    """
    made = []
    for cohesion, mu in itertools.product((0.0, 1.0, 300.0, 1e3, 2.9e3, 3.1e3, 1e4, 1e6), (0.0, 0.75)):
        carried = 2.0 * cohesion * ((1.0 + mu**2) ** 0.5 + mu)
        falls = mu == 0.0 and 3.6 * cohesion < 5.3e3
        make = partial(weak_stack, cohesion=cohesion, friction=mu)
        expect = "stands" if carried > 5.9e3 else "falls" if falls else ""
        made.append(Case("weak bricks", f"C = {cohesion:g} Pa, mu = {mu:g}", make, expect, ways=WAYS[1::2]))
    return made


def cases() -> list[Case]:
    """Return all cases."""
    return strengths() + weak_bricks()
