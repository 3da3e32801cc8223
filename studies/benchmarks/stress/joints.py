"""Strengths from zero to unbreakable, friction from 0 to 2, bricks that yield under their own weight."""

from __future__ import annotations

import itertools
from functools import partial

from damagepred.assembly import Assembly, Model
from damagepred.assembly.assembly import rectangle
from damagepred.scene import BlockMaterial, Dynamics, Joint, Movement, Scene, Wall
from studies.benchmarks.stress.case import RIGID, WAYS, Case

FOOT = Wall(length=1.2, height=0.6, block_length=0.24, block_height=0.1)
ODD: dict[str, tuple[float, float, float, dict[str, float]]] = {
    "cohesion alone": (0.0, 1e5, 0.5, {}),
    "tension alone, cut at the apex": (1e5, 0.0, 0.5, {}),
    "tension alone, no friction": (1e5, 0.0, 0.0, {}),
    "strength is all left by a crack": (1e4, 1e4, 0.5, {"residual_tensile_strength": 1e4, "residual_cohesion": 1e4}),
    "hardly any fracture energy": (1e5, 1e5, 0.5, {"fracture_energy": 1e-12}),
    "endless fracture energy": (1e4, 1e4, 0.5, {"fracture_energy": 1e9}),
    "both bonds wear": (1e5, 1e5, 0.5, {"fracture_energy": 10.0, "shear_fracture_energy": 100.0}),
    "brittle shear": (1e5, 1e5, 0.5, {"brittle_shear": True}),
    "dilation as much as friction": (1e4, 1e4, 0.5, {"dilation": 0.5}),
    "friction grows when it cracks": (1e4, 1e4, 0.2, {"residual_friction": 2.0}),
    "crushed at once": (1e4, 1e4, 0.5, {"compressive_strength": 1e3}),
    "crushed a little": (1e4, 1e4, 0.5, {"compressive_strength": 3e4}),
    "soft, k_n = 1e3 Pa/m": (1e4, 1e4, 0.5, {"normal_stiffness": 1e3, "shear_stiffness": 1e3}),
    "stiff, k_n = 1e16 Pa/m": (1e4, 1e4, 0.5, {"normal_stiffness": 1e16, "shear_stiffness": 1e16}),
    "k_s = 1e-6 k_n": (1e4, 1e4, 0.5, {"shear_stiffness": 82e3}),
    "k_s = 1e6 k_n": (1e4, 1e4, 0.5, {"normal_stiffness": 36e3}),
}
"""Unusual laws: tensile strength and cohesion (Pa), friction, other keys of ``[joint]``."""


def wall(_: bool, strength: float, cohesion: float, friction: float, law: dict[str, float]) -> Scene:
    """Return a small wall in dishing of 1 mm."""
    joint = Joint(tensile_strength=strength, cohesion=cohesion, friction=friction, **law)  # type: ignore[arg-type]
    return Scene(wall=FOOT, joint=joint, movement=Movement(central_deflection=1e-3, increments=4))


def moved(_: Model) -> Dynamics:
    """Return a run with slowly moving ground."""
    return Dynamics(duration=0.3, outputs=10, movement_time=0.25, damping="viscous", damping_ratio=0.5, frequency=20.0)


def strengths() -> list[Case]:
    """Return the wall with joints of every strength and friction, and of unusual laws."""
    plain = {
        f"f_t = C = {f_t:g} Pa, mu = {mu:g}": (f_t, f_t, mu, {})
        for f_t, mu in itertools.product((0.0, 1.0, 1e3, 1e4, 1e5, 1e6, 1e9, 1e15), (0.0, 0.5, 2.0))
    }
    made = []
    for name, (f_t, cohesion, mu, law) in (plain | ODD).items():
        make = partial(wall, strength=f_t, cohesion=cohesion, friction=mu, law=law)
        ways = WAYS if name in ODD or mu == 0.5 else RIGID
        made.append(Case("strengths", name, make, increments=4, dynamics=moved, ways=ways))
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
