"""From one block to 20 000: walls in dishing, and stacks under their own weight."""

from __future__ import annotations

from functools import partial

from damagepred.assembly import Assembly, Model
from damagepred.assembly.assembly import rectangle
from damagepred.scene import Dpc, Dynamics, Joint, Loads, Movement, Scene, Wall
from studies.benchmarks.stress.case import IN_TIME, STATIC, Case, Check, Found

LENGTH, HEIGHT = 0.24, 0.075
MOST = {
    "quasi-static, rigid": 20_000,
    "explicit, rigid": 20_000,
    "quasi-static, deformable": 1000,
    "explicit, deformable": 1000,
    "in time, rigid": 5000,
    "in time, deformable": 100,
}
"""Largest number of blocks for each solver: some minutes at most."""


def wall(blocks: int) -> Scene:
    """Return a wall of about this number of bricks, 2.5 times as long as high, in dishing of L/2000."""
    courses = max(1, round((blocks * LENGTH / (2.5 * HEIGHT)) ** 0.5))
    units = max(1, round(blocks / courses))
    length, height = units * LENGTH, courses * HEIGHT
    return Scene(
        wall=Wall(length=length, height=height),
        dpc=Dpc(course=2) if courses > 3 else None,
        loads=Loads(roof=1000.0 * length),
        movement=Movement(central_deflection=length / 2000.0),
    )


def stack(deformable: bool, count: int) -> Assembly:
    """Return a stack of rigid or deformable blocks on the ground."""
    made = Assembly(joint=Joint(tensile_strength=1e12, cohesion=1e12))
    for i in range(count):
        made.add_block(rectangle(0.0, HEIGHT * i, LENGTH, HEIGHT * (i + 1)), course=i, zone_size=LENGTH * deformable)
    made.rest_on_ground([0])
    return made


def closed_form(found: Found) -> Check | None:
    """Compare the top of the stack with n (n + 1) W / (2 k_n A): FACTS, for rigid blocks with elastic joints alone."""
    model = found.model
    n, law = model.n_blocks, model.properties
    weight = 2000.0 * 9.81 * LENGTH * HEIGHT * model.thickness
    exact = -weight * n * (n + 1) / (2 * law.normal_stiffness[0] * LENGTH * model.thickness)
    return Check("closed form", abs(float(found.path[-1].displacement[:, 1].min()) / exact - 1.0))


def carries_all(found: Found) -> Check:
    """Compare the force on the ground with the total weight."""
    weight = -float(found.model.supports.load.reshape(-1, 3)[:, 1].sum())
    return Check("weight", max(abs(step.base_reaction / weight - 1.0) for step in found.path))


def shortly(model: Model) -> Dynamics:
    """Return a short run from equilibrium."""
    return Dynamics(duration=0.02, outputs=4, movement_time=0.02, damping="viscous")


def cases() -> list[Case]:
    """Return all cases."""
    made = []
    for count in (1, 2, 10, 100, 1000, 5000, 20_000):
        static = tuple(way for way in STATIC if MOST[way] >= count)
        made.append(
            Case(
                "1 to 20 000 blocks", f"wall of {count}", lambda d, c=count: wall(c), "stands", carries_all, ways=static
            )
        )
        short = tuple(way for way in IN_TIME if MOST[way] >= count)
        if short:
            made.append(
                Case(
                    "1 to 20 000 blocks",
                    f"wall of {count}, in time",
                    lambda d, c=count: wall(c),
                    "stands",
                    dynamics=shortly,
                    ways=short,
                )
            )
    own = {"lump_block_elasticity": False}
    for count in (1, 10, 100, 1000, 5000):
        rigid = tuple(way for way in STATIC if way.endswith("rigid"))
        make = partial(stack, count=count)
        made.append(
            Case("1 to 20 000 blocks", f"stack of {count}", make, "stands", closed_form, settings=own, ways=rigid)
        )
    return made
